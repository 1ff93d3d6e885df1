//! What a log holds, for other programs: tables of numbers, and a file for viewers.
//!
//! The log itself stays the truth. What is written here can be made again at any time, and no tool of this program reads
//! it back.

pub mod csv;
mod descriptor;
pub mod messages;
mod scenery;
mod viewer;

pub use viewer::{BODIES_DRAWN_MAX, Put, ViewChannel, Viewer, viewer};

use crate::fault::LogError;

/// Why an export broke off.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The log cannot be read any further.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The sink refused bytes: a full disk, most often.
    #[error("cannot write the export: {0}")]
    Io(#[from] std::io::Error),
    /// The MCAP library refused.
    #[error("the viewer's file cannot be written: {0}")]
    Container(#[source] Box<mcap::McapError>),
}

impl From<mcap::McapError> for ExportError {
    fn from(error: mcap::McapError) -> ExportError {
        match error {
            mcap::McapError::Io(error) => ExportError::Io(error),
            error => ExportError::Container(Box::new(error)),
        }
    }
}

/// Which states are exported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum States {
    /// Every state that the source has: those that the log keeps, or all.
    All,
    /// Those at frame times.
    Frames,
}
