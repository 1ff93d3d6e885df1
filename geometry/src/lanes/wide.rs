//! Sixteen numbers side by side: two vectors, worked on in turn.
//!
//! The one thing to know: the arithmetic of one pair of rings is a long chain in which each operation waits for the
//! one before. Two chains at once fill the time that one would wait.

use super::Simd;
use core::ops::{Add, AddAssign, BitAnd, BitOr, BitOrAssign, BitXor, Div, Mul, Neg, Not, Sub};
use fearless_simd::prelude::*;
use fearless_simd::{f64x4, f64x8, mask64x8};

/// Pairs side by side.
pub const LANES: usize = 16;

/// Numbers side by side.
#[derive(Clone, Copy)]
pub struct Lanes<S: Simd>(f64x8<S>, f64x8<S>);

/// Truth values side by side.
#[derive(Clone, Copy)]
pub struct Mask<S: Simd>(mask64x8<S>, mask64x8<S>);

impl<S: Simd> Lanes<S> {
    /// The same number in all lanes.
    #[inline(always)]
    pub fn splat(simd: S, x: f64) -> Lanes<S> {
        Lanes(f64x8::splat(simd, x), f64x8::splat(simd, x))
    }

    /// A number for each lane.
    #[inline(always)]
    pub fn load_array(simd: S, numbers: [f64; LANES]) -> Lanes<S> {
        Lanes::load_array_ref(simd, &numbers)
    }

    /// A number for each lane.
    #[inline(always)]
    pub fn load_array_ref(simd: S, numbers: &[f64; LANES]) -> Lanes<S> {
        let [low, high] = halves(numbers);
        Lanes(f64x8::load_array_ref(simd, low), f64x8::load_array_ref(simd, high))
    }

    /// Writes the number of each lane.
    #[inline(always)]
    pub fn store_array(self, numbers: &mut [f64; LANES]) {
        let (low, high) = numbers.split_at_mut(LANES / 2);
        if let (Ok(low), Ok(high)) = (low.try_into(), high.try_into()) {
            self.0.store_array(low);
            self.1.store_array(high);
        }
    }

    /// The four quarters, in order.
    #[inline(always)]
    pub(super) fn quarters(self) -> [f64x4<S>; 4] {
        let ((a, b), (c, d)) = (self.0.split(), self.1.split());
        [a, b, c, d]
    }

    /// From four quarters.
    #[inline(always)]
    pub(super) fn of_quarters([a, b, c, d]: [f64x4<S>; 4]) -> Lanes<S> {
        Lanes(a.combine(b), c.combine(d))
    }

    /// Absolute values.
    #[inline(always)]
    pub fn abs(self) -> Lanes<S> {
        Lanes(self.0.abs(), self.1.abs())
    }

    /// The sizes of these with the signs of those.
    #[inline(always)]
    pub fn copysign(self, signs: Lanes<S>) -> Lanes<S> {
        Lanes(self.0.copysign(signs.0), self.1.copysign(signs.1))
    }

    /// Square roots.
    #[inline(always)]
    pub fn sqrt(self) -> Lanes<S> {
        Lanes(self.0.sqrt(), self.1.sqrt())
    }

    /// Whether less; not for NaN.
    #[inline(always)]
    pub fn simd_lt(self, other: Lanes<S>) -> Mask<S> {
        Mask(self.0.simd_lt(other.0), self.1.simd_lt(other.1))
    }

    /// Whether less or equal; not for NaN.
    #[inline(always)]
    pub fn simd_le(self, other: Lanes<S>) -> Mask<S> {
        Mask(self.0.simd_le(other.0), self.1.simd_le(other.1))
    }

    /// Whether greater; not for NaN.
    #[inline(always)]
    pub fn simd_gt(self, other: Lanes<S>) -> Mask<S> {
        Mask(self.0.simd_gt(other.0), self.1.simd_gt(other.1))
    }

    /// Whether greater or equal; not for NaN.
    #[inline(always)]
    pub fn simd_ge(self, other: Lanes<S>) -> Mask<S> {
        Mask(self.0.simd_ge(other.0), self.1.simd_ge(other.1))
    }

    /// The token of the instruction set.
    #[inline(always)]
    pub fn simd(self) -> S {
        self.0.simd
    }
}

#[inline(always)]
fn halves(numbers: &[f64; LANES]) -> [&[f64; 8]; 2] {
    let (low, high) = numbers.as_chunks::<8>().0.split_at(1);
    [&low[0], &high[0]]
}

impl<S: Simd> Mask<S> {
    /// True where a bit is set, the lowest for the first lane.
    #[inline(always)]
    pub fn from_bitmask(simd: S, bits: u32) -> Mask<S> {
        Mask(
            mask64x8::from_bitmask(simd, u64::from(bits & 0xff)),
            mask64x8::from_bitmask(simd, u64::from((bits >> 8) & 0xff)),
        )
    }

    /// The one number where true, the other where false.
    #[inline(always)]
    pub fn select(self, yes: Lanes<S>, no: Lanes<S>) -> Lanes<S> {
        Lanes(self.0.select(yes.0, no.0), self.1.select(yes.1, no.1))
    }

    /// A bit for each lane, the lowest for the first.
    #[inline(always)]
    pub fn to_bitmask(self) -> u32 {
        self.0.to_bitmask() as u32 | ((self.1.to_bitmask() as u32) << 8)
    }
}

macro_rules! operator {
    ($trait:ident, $function:ident) => {
        impl<S: Simd> $trait for Lanes<S> {
            type Output = Lanes<S>;
            #[inline(always)]
            fn $function(self, other: Lanes<S>) -> Lanes<S> {
                Lanes(self.0.$function(other.0), self.1.$function(other.1))
            }
        }
        impl<S: Simd> $trait<f64> for Lanes<S> {
            type Output = Lanes<S>;
            #[inline(always)]
            fn $function(self, other: f64) -> Lanes<S> {
                Lanes(self.0.$function(other), self.1.$function(other))
            }
        }
        impl<S: Simd> $trait<Lanes<S>> for f64 {
            type Output = Lanes<S>;
            #[inline(always)]
            fn $function(self, other: Lanes<S>) -> Lanes<S> {
                Lanes(self.$function(other.0), self.$function(other.1))
            }
        }
    };
}

operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);

impl<S: Simd> AddAssign for Lanes<S> {
    #[inline(always)]
    fn add_assign(&mut self, other: Lanes<S>) {
        *self = *self + other;
    }
}

impl<S: Simd> AddAssign<f64> for Lanes<S> {
    #[inline(always)]
    fn add_assign(&mut self, other: f64) {
        *self = *self + other;
    }
}

impl<S: Simd> Neg for Lanes<S> {
    type Output = Lanes<S>;
    #[inline(always)]
    fn neg(self) -> Lanes<S> {
        Lanes(-self.0, -self.1)
    }
}

impl<S: Simd> BitAnd for Mask<S> {
    type Output = Mask<S>;
    #[inline(always)]
    fn bitand(self, other: Mask<S>) -> Mask<S> {
        Mask(self.0 & other.0, self.1 & other.1)
    }
}

impl<S: Simd> BitOr for Mask<S> {
    type Output = Mask<S>;
    #[inline(always)]
    fn bitor(self, other: Mask<S>) -> Mask<S> {
        Mask(self.0 | other.0, self.1 | other.1)
    }
}

impl<S: Simd> BitXor for Mask<S> {
    type Output = Mask<S>;
    #[inline(always)]
    fn bitxor(self, other: Mask<S>) -> Mask<S> {
        Mask(self.0 ^ other.0, self.1 ^ other.1)
    }
}

impl<S: Simd> BitOrAssign for Mask<S> {
    #[inline(always)]
    fn bitor_assign(&mut self, other: Mask<S>) {
        *self = *self | other;
    }
}

impl<S: Simd> Not for Mask<S> {
    type Output = Mask<S>;
    #[inline(always)]
    fn not(self) -> Mask<S> {
        Mask(!self.0, !self.1)
    }
}
