//! Do the processes agree? The built command, run as a user runs it.

mod bad_input;
mod command;
mod full_disk;
mod killed_anywhere;
mod lost_process;
mod main_job;
mod questions;
mod recovery;
mod resumed;
mod signals;
mod stopped_run;
#[cfg(feature = "view")]
mod view;
