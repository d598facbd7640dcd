//! What a formula over numbers needs, so that it is written once for one point and for many at a time.
//!
//! In this room it is one f64 (`double.rs`); the rooms that compute in lanes add theirs. Each operation but [`Number::sine`] and
//! [`Number::raised`] rounds as f64's own does, so that every kind of number comes to the same bits.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// One number, or one at each of several points.
pub trait Number:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
{
    /// A constant.
    fn lit(value: f64) -> Self;
    /// Square root, correctly rounded; NaN below zero.
    fn sqrt(self) -> Self;
    /// Magnitude.
    fn abs(self) -> Self;
    /// `yes` where `self < other`, `no` elsewhere and where either is NaN.
    fn if_less(self, other: Self, yes: Self, no: Self) -> Self;
    /// Without its fraction.
    fn whole(self) -> Self;
    /// Sine; in lanes within 2^-52.
    fn sine(self) -> Self;
    /// A power `p` of numbers from 0 on; in lanes within `2^-50 p (1 + |ln p|)`.
    fn raised(self, exponent: f64) -> Self;
    /// Random functions of space, independent of each other, about 0, that noise is made of: [`sums_at`](super::noise::sums_at).
    fn lattice<const N: usize>(p: [Self; 3]) -> [Self; N];
    /// The number, if it is the same at all points.
    fn everywhere(self) -> Option<f64>;
    /// `f` point by point: for what has no form of its own.
    fn each<const N: usize>(arguments: [Self; N], f: impl Fn([f64; N]) -> f64) -> Self;

    /// `f` point by point, of one number.
    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self::each([self], |[a]| f(a))
    }

    /// The smaller; `self` where either is NaN.
    fn smaller(self, other: Self) -> Self {
        other.if_less(self, other, self)
    }

    /// The larger; `self` where either is NaN.
    fn larger(self, other: Self) -> Self {
        self.if_less(other, other, self)
    }

    /// Not below `-limit` nor above `limit`; NaN stays.
    fn within(self, limit: Self) -> Self {
        self.larger(-limit).smaller(limit)
    }

    /// Not below 0 nor above 1; NaN stays.
    fn unit(self) -> Self {
        self.larger(Self::lit(0.0)).smaller(Self::lit(1.0))
    }

    /// Its second power.
    fn squared(self) -> Self {
        self * self
    }

    /// Its third power.
    fn cubed(self) -> Self {
        self * self * self
    }

    /// `self^exponent`.
    fn power(self, exponent: Self) -> Self {
        Self::each([self, exponent], |[a, b]| a.powf(b))
    }
}

/// The length of a vector, by the sum of its squares.
pub fn length<T: Number>([x, y, z]: [T; 3]) -> T {
    (x * x + y * y + z * z).sqrt()
}
