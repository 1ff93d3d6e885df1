//! Four `f32` side by side, in vector instructions where the machine has them.
//!
//! They only cull. Machines differ in what comes out of a comparison with NaN, so who uses them must take a NaN for
//! "do not know": a body is left out where a comparison says so, never where none does.

use std::ops::{Add, Div, Mul, Neg, Sub};
use wide::f32x4;

/// Numbers in a group: as many as the narrowest vector registers of x86-64 and aarch64 hold.
pub(crate) const LANES: usize = 4;

/// Four numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lanes(f32x4);

impl From<[f32; LANES]> for Lanes {
    #[inline(always)]
    fn from(numbers: [f32; LANES]) -> Lanes {
        Lanes(f32x4::from(numbers))
    }
}

impl Lanes {
    #[inline(always)]
    pub(crate) fn all(value: f32) -> Lanes {
        Lanes(f32x4::splat(value))
    }

    #[inline(always)]
    pub(crate) fn to_array(self) -> [f32; LANES] {
        self.0.to_array()
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Lanes {
        Lanes(self.0.sqrt())
    }

    /// The larger of each two; where one is NaN, `self` or NaN.
    #[inline(always)]
    pub(crate) fn or_larger(self, other: Lanes) -> Lanes {
        Lanes(other.0.fast_max(self.0))
    }

    /// The smaller of each two; where one is NaN, `self` or NaN.
    #[inline(always)]
    pub(crate) fn or_smaller(self, other: Lanes) -> Lanes {
        Lanes(other.0.fast_min(self.0))
    }

    /// Bit k is set where number k is larger than that of `other`, not where one is NaN.
    #[inline(always)]
    pub(crate) fn larger(self, other: Lanes) -> u32 {
        self.0.simd_gt(other.0).to_bitmask()
    }
}

impl Add for Lanes {
    type Output = Lanes;

    #[inline(always)]
    fn add(self, other: Lanes) -> Lanes {
        Lanes(self.0 + other.0)
    }
}

impl Sub for Lanes {
    type Output = Lanes;

    #[inline(always)]
    fn sub(self, other: Lanes) -> Lanes {
        Lanes(self.0 - other.0)
    }
}

impl Mul for Lanes {
    type Output = Lanes;

    #[inline(always)]
    fn mul(self, other: Lanes) -> Lanes {
        Lanes(self.0 * other.0)
    }
}

impl Div for Lanes {
    type Output = Lanes;

    #[inline(always)]
    fn div(self, other: Lanes) -> Lanes {
        Lanes(self.0 / other.0)
    }
}

impl Neg for Lanes {
    type Output = Lanes;

    #[inline(always)]
    fn neg(self) -> Lanes {
        Lanes(-self.0)
    }
}
