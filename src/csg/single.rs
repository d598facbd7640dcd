//! What bodies in single precision have in common: how much they are grown and shrunk by, and the numbers of sixteen rays.

use crate::lane::{Scalar, f32x16};
use glam::DVec3;

/// What bodies are grown and shrunk by, of the largest coordinates (in own space) of rays and body: the start, the direction, the
/// map and the shape are each rounded once, sums and products some ten times more, in three axes.
pub(super) const GROWTH: f64 = 64.0 * f32::UNIT_ROUNDOFF;

/// Bodies that are thinner than this, in shares of what they are grown by, are not bracketed, nor those that are so far off that
/// the composite is: too much would be in doubt.
pub(super) const LEAST_SIZE: f64 = 64.0;

/// The smaller; the second where either is NaN.
#[inline(always)]
pub(super) fn least(a: f32x16, b: f32x16) -> f32x16 {
    a.fast_min(b)
}

/// The larger; the second where either is NaN.
#[inline(always)]
pub(super) fn most(a: f32x16, b: f32x16) -> f32x16 {
    a.fast_max(b)
}

/// Rounded.
pub(super) fn single(v: DVec3) -> [f32; 3] {
    v.to_array().map(|x| x as f32)
}

/// The roots of `a t^2 + 2 b t + c`, by the inverse of `a` and the `root` of `b^2 - a c`: neither cancels, each is over `a` or under `c` (Press and
/// others 1992, Numerical Recipes in C, section 5.6).
#[inline(always)]
pub(super) fn rising_roots(inv: f32x16, b: f32x16, c: f32x16, root: f32x16) -> [f32x16; 2] {
    let q = -(b + root.copysign(b));
    let (r1, r2) = (c / q, q * inv);
    [least(r1, r2), most(r1, r2)]
}
