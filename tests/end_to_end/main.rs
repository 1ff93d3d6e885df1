//! Do the processes agree? The built command, run as a user runs it.

mod bad_input;
mod command;
#[cfg(feature = "render")]
mod farm;
mod full_disk;
mod killed_anywhere;
mod lost_process;
mod main_job;
mod memory;
mod questions;
mod recovery;
mod replayed;
mod resumed;
mod signals;
mod skipped_states;
mod stopped_run;
#[cfg(feature = "view")]
mod view;
