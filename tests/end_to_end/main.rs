//! Do the processes agree? The built command, run as a user runs it.

mod bad_input;
mod command;
mod lost_process;
mod main_job;
mod questions;
mod stopped_run;
#[cfg(feature = "view")]
mod view;
