//! A ray's point of closest approach, accurate for origins far away.

use crate::Vec3;

/// Above this distance (in units of the object's size) the plain sum `origin + s * direction` would cost
/// more than about 7e-15 of the object's size, so it is done in twice the precision. The value only
/// trades a little time near the limit; the result is accurate on both sides of it.
const FAR: f64 = 64.0;

/// The ray parameter `s` at which the ray is closest to the point `origin` is measured from, and the
/// point there. `size` is the size of the object near that point.
#[inline]
pub fn closest_approach(origin: &Vec3, direction: &Vec3, size: f64) -> (f64, Vec3) {
    let s = -origin.dot(direction);
    if s > FAR * size || s < -FAR * size {
        let point = Vec3::new(
            sum_of_product(origin.x, s, direction.x),
            sum_of_product(origin.y, s, direction.y),
            sum_of_product(origin.z, s, direction.z),
        );
        (s, point)
    } else {
        (s, origin + direction * s)
    }
}

/// `a + b * c` with the product and the sum carried in twice the precision and rounded once at the end
/// (Dekker's product, Knuth's sum: no fused operation, so the same bits everywhere).
#[inline]
fn sum_of_product(a: f64, b: f64, c: f64) -> f64 {
    let (b_high, b_low) = split(b);
    let (c_high, c_low) = split(c);
    let product = b * c;
    let product_error = ((b_high * c_high - product) + b_high * c_low + b_low * c_high) + b_low * c_low;
    let sum = a + product;
    let virtual_product = sum - a;
    let sum_error = (a - (sum - virtual_product)) + (product - virtual_product);
    sum + (sum_error + product_error)
}

/// Veltkamp's split into two halves of 26 bits.
#[inline]
fn split(a: f64) -> (f64, f64) {
    let scaled = a * 134_217_729.0;
    let high = scaled - (scaled - a);
    (high, a - high)
}
