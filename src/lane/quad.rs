//! Four numbers at a time, for one ray against the few primitives of a leaf: eight lanes would be twice as many as leaves
//! fill, and in double precision twice the work.

use super::{LANES, Scalar};
use std::fmt::Debug;
use std::ops::{Add, BitAnd, BitXor, Div, Mul, Neg, Sub};
use wide::{f32x4, f64x4, f64x8};

/// Numbers in a [`Quad`].
pub const QUAD: usize = 4;

/// Four numbers. Answers of comparisons are of the same type: all bits of a lane or none.
pub trait Quad:
    Copy
    + Debug
    + Default
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + BitAnd<Output = Self>
    + BitXor<Output = Self>
{
    /// One lane's number.
    type Scalar: Scalar<Quad = Self>;

    /// The same number in every lane.
    fn splat(x: Self::Scalar) -> Self;
    /// Lane by lane.
    fn from_array(lanes: [Self::Scalar; QUAD]) -> Self;
    /// Lane by lane.
    fn to_array(self) -> [Self::Scalar; QUAD];
    /// Each rounded to single precision.
    fn to_f32s(self) -> f32x4;
    /// A constant in every lane.
    #[inline(always)]
    fn lit(x: f64) -> Self {
        Self::splat(Self::Scalar::from_f64(x))
    }
    /// Square root, correctly rounded; NaN below zero.
    fn sqrt(self) -> Self;
    /// Magnitude.
    fn abs(self) -> Self;
    /// The sign bit of `sign` on the magnitude of `self`.
    fn copysign(self, sign: Self) -> Self;
    /// The smaller; `other` where either is NaN.
    fn min(self, other: Self) -> Self;
    /// The larger; `other` where either is NaN.
    fn max(self, other: Self) -> Self;
    /// `self > other`, false on NaN.
    fn gt(self, other: Self) -> Self;
    /// `self <= other`, false on NaN.
    fn le(self, other: Self) -> Self;
    /// Lanes of `yes` where `self`, an answer, is true, of `no` elsewhere.
    fn choose(self, yes: Self, no: Self) -> Self;
    /// A bit per lane of an answer; lane 0 is the lowest.
    fn bits(self) -> u8;
}

macro_rules! impl_quad {
    ($quad:ty, $scalar:ty, $to_f32s:expr) => {
        impl Quad for $quad {
            type Scalar = $scalar;

            #[inline(always)]
            fn splat(x: $scalar) -> Self {
                <$quad>::splat(x)
            }
            #[inline(always)]
            fn from_array(lanes: [$scalar; QUAD]) -> Self {
                <$quad>::from(lanes)
            }
            #[inline(always)]
            fn to_array(self) -> [$scalar; QUAD] {
                <$quad>::to_array(self)
            }
            #[inline(always)]
            fn to_f32s(self) -> f32x4 {
                ($to_f32s)(self)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                <$quad>::sqrt(self)
            }
            #[inline(always)]
            fn abs(self) -> Self {
                <$quad>::abs(self)
            }
            #[inline(always)]
            fn copysign(self, sign: Self) -> Self {
                <$quad>::abs(self) | (sign & <$quad>::splat(-0.0))
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                self.fast_min(other)
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                self.fast_max(other)
            }
            #[inline(always)]
            fn gt(self, other: Self) -> Self {
                self.simd_gt(other)
            }
            #[inline(always)]
            fn le(self, other: Self) -> Self {
                self.simd_le(other)
            }
            #[inline(always)]
            fn choose(self, yes: Self, no: Self) -> Self {
                self.select(yes, no)
            }
            #[inline(always)]
            fn bits(self) -> u8 {
                self.to_bitmask() as u8
            }
        }
    };
}

impl_quad!(f32x4, f32, |x| x);
impl_quad!(f64x4, f64, |x: f64x4| f32x4::from(x.to_array().map(|x| x as f32)));

/// Eight rows of four numbers as four columns.
#[inline(always)]
pub fn columns(rows: [f64x4; LANES]) -> [f64x8; QUAD] {
    // `wide` turns four rows of four by shuffles; eight of eight it takes apart.
    let [a, b, c, d, e, f, g, h] = rows;
    let (low, high) = (f64x4::transpose([a, b, c, d]), f64x4::transpose([e, f, g, h]));
    std::array::from_fn(|k| bytemuck::cast([low[k], high[k]]))
}

/// Four columns of eight numbers as eight rows.
#[inline(always)]
pub fn rows(columns: [f64x8; QUAD]) -> [f64x4; LANES] {
    let halves: [[f64x4; 2]; QUAD] = columns.map(bytemuck::cast);
    let [[a, b, c, d], [e, f, g, h]] = [0, 1].map(|half| f64x4::transpose(halves.map(|column| column[half])));
    [a, b, c, d, e, f, g, h]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_become_columns() {
        let rows: [[f64; QUAD]; LANES] =
            std::array::from_fn(|k| std::array::from_fn(|m| (100 * k + m) as f64));
        for (m, column) in columns(rows.map(f64x4::from)).into_iter().enumerate() {
            assert_eq!(column.to_array(), std::array::from_fn(|k| (100 * k + m) as f64));
        }
        assert_eq!(super::rows(columns(rows.map(f64x4::from))).map(f64x4::to_array), rows);
    }
}
