//! Any text as the formula of a surface: refused with a place, or a polynomial of the degrees that can be
//! simulated.

#![no_main]

use geometry::polynomial::{DEGREE_MAX, Polynomial};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Ok(text) = std::str::from_utf8(data) else { return };
    match Polynomial::parse(text) {
        Ok(polynomial) => assert!(polynomial.degree() <= DEGREE_MAX, "{text:?}"),
        Err(error) => assert!(error.place >= 1 && error.place <= text.len() + 1, "{error}"),
    }
});
