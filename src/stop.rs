//! SIGHUP, SIGINT and SIGTERM as a flag: every verb that runs for long looks at it and ends in good order.

use rustix::process::{Signal, getppid, set_parent_process_death_signal};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

/// Says to a process of a run who supervises it: that process's number.
pub const SUPERVISOR_VARIABLE: &str = "CHAINMAIL_SUPERVISOR";

static REQUESTED: OnceLock<Arc<AtomicBool>> = OnceLock::new();

/// The flag; from the first call on the signals set it and no longer end the process.
pub fn flag() -> Arc<AtomicBool> {
    let flag = REQUESTED.get_or_init(|| {
        let flag = Arc::new(AtomicBool::new(false));
        for signal in [SIGHUP, SIGINT, SIGTERM] {
            if let Err(error) = signal_hook::flag::register(signal, Arc::clone(&flag)) {
                tracing::warn!(signal, %error, "cannot catch a signal");
            }
        }
        // A file that grows beyond a quota is an error to report, not the end of the process.
        if let Err(error) = signal_hook::flag::register(SIGXFSZ, Arc::default()) {
            tracing::warn!(%error, "a quota will end this process");
        }
        end_with_supervisor(&flag);
        flag
    });
    Arc::clone(flag)
}

/// Whether the process was asked to stop.
pub fn requested() -> bool {
    REQUESTED.get().is_some_and(|flag| flag.load(Ordering::Relaxed))
}

/// Lets a process of a run end in good order when the one that started it dies, however it dies.
fn end_with_supervisor(flag: &AtomicBool) {
    let Ok(supervisor) = std::env::var(SUPERVISOR_VARIABLE) else { return };
    if let Err(error) = set_parent_process_death_signal(Some(Signal::TERM)) {
        tracing::warn!(%error, "a killed supervisor would not be noticed");
    }
    // It may have died before.
    if getppid().map(|parent| parent.as_raw_nonzero().to_string()) != Some(supervisor) {
        flag.store(true, Ordering::Relaxed);
    }
}
