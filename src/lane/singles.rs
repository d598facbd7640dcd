//! The lanes of one packet in single precision, or those of two side by side.

use super::vec3::Component;
use super::{LANES, Many, f32x8, f32x16};
use std::ops::{BitAnd, BitAndAssign, BitOr, BitXor, Div, Not};

/// Numbers in single precision: those of a packet, or of two. (As [`Many`], whose operations these are added to; eight lanes
/// have them as [`Lane`](super::Lane), too, by the same names.)
pub trait Singles:
    Component
    + Many<Eight = f32x8>
    + Default
    + Div<Output = Self>
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + BitXor<Output = Self>
    + 'static
{
    /// The bits of all lanes.
    const LANES: u16 = if Self::EIGHTS == 1 { 0xff } else { 0xffff };

    /// Number `k` of them.
    fn number(&self, k: usize) -> f32;
    /// The numbers of packet `k`.
    fn eight(self, k: usize) -> f32x8;
    /// Square root, correctly rounded; NaN below zero.
    fn sqrt(self) -> Self;
    /// Magnitude.
    fn abs(self) -> Self;
    /// The smaller; `other` where either is NaN.
    fn least(self, other: Self) -> Self;
    /// The larger; `other` where either is NaN.
    fn most(self, other: Self) -> Self;
    /// `self < other`, false on NaN.
    fn below(self, other: Self) -> Flags<Self>;
    /// `self <= other`, false on NaN.
    fn up_to(self, other: Self) -> Flags<Self>;
    /// Numbers equal, false on NaN.
    fn same(self, other: Self) -> Flags<Self>;
    /// The magnitude of `self` with the sign bit of `sign`.
    #[inline(always)]
    fn signed_as(self, sign: Self) -> Self {
        self.abs() | (sign & Self::constant(-0.0))
    }
    /// [`Lane::in_register`](super::Lane::in_register).
    #[allow(clippy::eq_op, reason = "an operation that changes nothing, which memory has none of")]
    #[inline(always)]
    fn in_one_register(self) -> Self {
        self | self
    }
    #[doc(hidden)]
    fn chosen(mask: Self, yes: Self, no: Self) -> Self;
    #[doc(hidden)]
    fn mask_bits(mask: Self) -> u16;
    #[doc(hidden)]
    fn mask_of(bits: u16) -> Self;
}

macro_rules! impl_singles {
    ($lanes:ty, $bits:ty, $own:expr) => {
        impl Singles for $lanes {
            #[inline(always)]
            fn number(&self, k: usize) -> f32 {
                self.as_array()[k % (LANES * Self::EIGHTS)]
            }
            #[inline(always)]
            fn eight(self, k: usize) -> f32x8 {
                let eights: [f32x8; Self::EIGHTS] = bytemuck::cast(self);
                eights[k.min(Self::EIGHTS - 1)]
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                <$lanes>::sqrt(self)
            }
            #[inline(always)]
            fn abs(self) -> Self {
                <$lanes>::abs(self)
            }
            #[inline(always)]
            fn least(self, other: Self) -> Self {
                self.fast_min(other)
            }
            #[inline(always)]
            fn most(self, other: Self) -> Self {
                self.fast_max(other)
            }
            #[inline(always)]
            fn below(self, other: Self) -> Flags<Self> {
                Flags(self.simd_lt(other))
            }
            #[inline(always)]
            fn up_to(self, other: Self) -> Flags<Self> {
                Flags(self.simd_le(other))
            }
            #[inline(always)]
            fn same(self, other: Self) -> Flags<Self> {
                Flags(self.simd_eq(other))
            }
            #[inline(always)]
            fn chosen(mask: Self, yes: Self, no: Self) -> Self {
                mask.select(yes, no)
            }
            #[inline(always)]
            fn mask_bits(mask: Self) -> u16 {
                mask.to_bitmask() as u16
            }
            #[inline(always)]
            fn mask_of(bits: u16) -> Self {
                let own = <$bits>::from($own);
                bytemuck::cast((own & <$bits>::splat(bits.into())).simd_eq(own))
            }
        }
    };
}

impl_singles!(f32x8, wide::i32x8, [1, 2, 4, 8, 16, 32, 64, 128]);
impl_singles!(
    f32x16,
    wide::i32x16,
    [1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, 32768]
);

/// Yes or no for each lane, as [`Mask`](super::Mask) has it for eight.
#[derive(Debug, Clone, Copy)]
pub struct Flags<W>(W);

impl<W: Singles> Flags<W> {
    /// No in every lane.
    #[inline(always)]
    pub fn none_set() -> Self {
        Self(W::default())
    }

    /// Yes in every lane.
    #[inline(always)]
    pub fn all_set() -> Self {
        Self(W::mask_of(!0))
    }

    /// Yes in the lanes whose bit is set; lane 0 is the lowest bit.
    #[inline(always)]
    pub fn from_bits(bits: u16) -> Self {
        Self(W::mask_of(bits))
    }

    /// A bit per lane; lane 0 is the lowest.
    #[inline(always)]
    pub fn bits(self) -> u16 {
        W::mask_bits(self.0)
    }

    /// Yes everywhere.
    #[inline(always)]
    pub fn all(self) -> bool {
        self.bits() == W::LANES
    }

    /// No everywhere.
    #[inline(always)]
    pub fn none(self) -> bool {
        self.bits() == 0
    }

    /// `yes` where set, `no` elsewhere.
    #[inline(always)]
    pub fn select(self, yes: W, no: W) -> W {
        W::chosen(self.0, yes, no)
    }

    /// `x` where set, zero elsewhere.
    #[inline(always)]
    pub fn keep(self, x: W) -> W {
        self.0 & x
    }
}

impl<W: Singles> BitAnd for Flags<W> {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl<W: Singles> BitOr for Flags<W> {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl<W: Singles> Not for Flags<W> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(self.0 ^ Self::all_set().0)
    }
}

impl<W: Singles> BitAndAssign for Flags<W> {
    #[inline(always)]
    fn bitand_assign(&mut self, other: Self) {
        *self = *self & other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check<W: Singles>() {
        let row = W::of(|k| f32x8::from(std::array::from_fn::<f32, LANES, _>(|n| (LANES * k + n) as f32)));
        let (five, nan) = (W::constant(5.0), W::constant(f64::NAN));
        for k in 0..LANES * W::EIGHTS {
            assert_eq!(row.number(k), k as f32);
            assert_eq!(row.eight(k / LANES).to_array()[k % LANES], k as f32);
            assert_eq!((row * row).sqrt().number(k), k as f32);
            assert_eq!(row.below(five).bits() >> k & 1 == 1, k < 5);
            assert_eq!(row.up_to(five).bits() >> k & 1 == 1, k <= 5);
            assert_eq!(row.same(five).bits() >> k & 1 == 1, k == 5);
            assert_eq!(Flags::from_bits(1 << k).select(nan, row).same(row).bits(), W::LANES ^ 1 << k);
            assert_eq!(row.least(five).number(k), (k as f32).min(5.0));
            assert_eq!(row.most(five).signed_as(-five).abs().number(k), (k as f32).max(5.0));
        }
        for bits in [0, 1, 0x35, 0x80, 0x4321, 0xffff] {
            let flags = Flags::<W>::from_bits(bits);
            assert_eq!((flags.bits(), (!flags).bits()), (bits & W::LANES, !bits & W::LANES));
            assert_eq!(flags.keep(five).same(five).bits(), flags.bits());
        }
        assert!(Flags::<W>::all_set().all() && Flags::<W>::none_set().none());
        assert!(nan.below(five).none() && nan.up_to(five).none() && nan.same(nan).none());
        assert!(nan.least(five).same(five).all() && nan.most(five).same(five).all());
    }

    #[test]
    fn one_packet_is_as_two() {
        check::<f32x8>();
        check::<f32x16>();
    }
}
