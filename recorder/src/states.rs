//! Where the states of a log come from, those included that it does not keep (`record.state_every`).

use crate::fault::LogError;
use crate::reader::Log;
use schemas::state::StateMessage;

/// Gives states by their steps. This crate knows the ones that a log keeps; who can simulate gives the others, too.
pub trait StateSource {
    /// The state after a step; `None` if it is not to be had.
    ///
    /// # Errors
    ///
    /// [`LogError`] if it cannot be read, or cannot be made again.
    fn state(&mut self, step: u64) -> Result<Option<StateMessage>, LogError>;
}

/// The states that a log keeps, and no others.
pub struct Kept<'a>(pub &'a Log);

impl StateSource for Kept<'_> {
    fn state(&mut self, step: u64) -> Result<Option<StateMessage>, LogError> {
        self.0.state(step)
    }
}
