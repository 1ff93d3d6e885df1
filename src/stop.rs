//! SIGHUP, SIGINT and SIGTERM as a flag: every verb that runs for long looks at it and ends in good order.

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

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
        flag
    });
    Arc::clone(flag)
}

/// Whether the process was asked to stop.
pub fn requested() -> bool {
    REQUESTED.get().is_some_and(|flag| flag.load(Ordering::Relaxed))
}
