//! Simulated time as the log's clock.

/// The log time of a step: its simulated time in whole nanoseconds, rounded to nearest.
///
/// Wall time never enters the log, so that two runs of one scene write the same bytes.
pub fn log_time_ns(sim_time_s: f64) -> u64 {
    // A cast from f64 saturates, so a negative or absurd time cannot wrap.
    libm::floor(sim_time_s * 1e9 + 0.5) as u64
}

#[cfg(test)]
mod tests {
    #[test]
    fn nanoseconds_are_rounded_to_nearest() {
        assert_eq!(super::log_time_ns(0.0), 0);
        assert_eq!(super::log_time_ns(1.0 / 2400.0), 416_667);
        assert_eq!(super::log_time_ns(0.3), 300_000_000);
    }
}
