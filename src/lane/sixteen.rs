//! The lanes of two packets side by side, in single precision.

use super::{LANES, Many, Mask, f32x8, f32x16};

/// What sixteen numbers have by the names that eight have them by ([`Lane`](super::Lane)), beside what [`Many`] gives them.
pub trait Sixteen: Many<Eight = f32x8> {
    /// Number `k` of them.
    fn number(&self, k: usize) -> f32;
    /// The numbers of packet `k`.
    fn eight(self, k: usize) -> f32x8;
    /// `self < other`, false on NaN.
    fn lt(self, other: Self) -> Mask<f32x16>;
    /// `self <= other`, false on NaN.
    fn le(self, other: Self) -> Mask<f32x16>;
    /// Numbers equal, false on NaN.
    fn equal(self, other: Self) -> Mask<f32x16>;
    /// The sign bit of `sign` on the magnitude of `self`.
    fn copysign(self, sign: Self) -> Self;
    /// [`Lane::in_register`](super::Lane::in_register).
    fn in_register(self) -> Self;
}

impl Sixteen for f32x16 {
    #[inline(always)]
    fn number(&self, k: usize) -> f32 {
        self.as_array()[k % (2 * LANES)]
    }
    #[inline(always)]
    fn eight(self, k: usize) -> f32x8 {
        let eights: [f32x8; 2] = bytemuck::cast(self);
        eights[k & 1]
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Mask<Self> {
        Mask(self.simd_lt(other))
    }
    #[inline(always)]
    fn le(self, other: Self) -> Mask<Self> {
        Mask(self.simd_le(other))
    }
    #[inline(always)]
    fn equal(self, other: Self) -> Mask<Self> {
        Mask(self.simd_eq(other))
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        self.abs() | (sign & Self::splat(-0.0))
    }
    #[allow(clippy::eq_op, reason = "an operation that changes nothing, which memory has none of")]
    #[inline(always)]
    fn in_register(self) -> Self {
        self | self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sixteen_have_what_eight_have() {
        let row = f32x16::from(std::array::from_fn::<f32, 16, _>(|k| k as f32));
        let (five, nan) = (f32x16::splat(5.0), f32x16::splat(f32::NAN));
        for k in 0..16 {
            assert_eq!(row.number(k), k as f32);
            assert_eq!(row.eight(k / LANES).to_array()[k % LANES], k as f32);
            assert_eq!(row.lt(five).bits() >> k & 1 == 1, k < 5);
            assert_eq!(row.le(five).bits() >> k & 1 == 1, k <= 5);
            assert_eq!(row.equal(five).bits() >> k & 1 == 1, k == 5);
            assert_eq!(Mask::from_bits(1 << k).select(nan, row).equal(row).bits(), !(1 << k));
            assert_eq!(row.copysign(-five).number(k), -(k as f32));
        }
        for bits in [0, 1, 0x35, 0x80, 0x4321, 0xffff] {
            let mask = Mask::<f32x16>::from_bits(bits);
            assert_eq!((mask.bits(), (!mask).bits()), (bits, !bits));
            assert_eq!(mask.keep(five).equal(five).bits(), bits);
        }
        assert!(Mask::<f32x16>::all_set().all() && Mask::<f32x16>::none_set().none());
        assert!(nan.lt(five).none() && nan.le(five).none() && nan.equal(nan).none());
    }
}
