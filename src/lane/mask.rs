//! Yes-or-no answers, one a lane, in the form that comparisons give and selections take.

use super::{Lane, f32x8, f32x16, f64x8};
use std::ops::{BitAnd, BitAndAssign, BitOr, BitOrAssign, BitXor, Not};
use wide::{i32x8, i32x16, i64x8};

/// One answer per lane.
#[derive(Debug, Clone, Copy, Default)]
pub struct Mask<L>(pub(super) L);

/// Numbers in whose place answers can stand: all bits of a lane, or none.
pub trait Masked:
    Copy + Default + BitAnd<Output = Self> + BitOr<Output = Self> + BitXor<Output = Self>
{
    /// A bit for each lane; lane 0 is the lowest.
    type Bits: Copy + PartialEq + Default;
    /// The bits of all lanes.
    const ALL: Self::Bits;
    #[doc(hidden)]
    fn choose(mask: Self, yes: Self, no: Self) -> Self;
    #[doc(hidden)]
    fn bits_of_mask(mask: Self) -> Self::Bits;
    #[doc(hidden)]
    fn mask_from_bits(bits: Self::Bits) -> Self;
}

macro_rules! impl_masked {
    ($lanes:ty, $bits:ty, $numbers:ty, $own:expr) => {
        impl Masked for $lanes {
            type Bits = $bits;
            const ALL: $bits = !0;
            #[inline(always)]
            fn choose(mask: Self, yes: Self, no: Self) -> Self {
                mask.select(yes, no)
            }
            #[inline(always)]
            fn bits_of_mask(mask: Self) -> $bits {
                mask.to_bitmask() as $bits
            }
            #[inline(always)]
            fn mask_from_bits(bits: $bits) -> Self {
                // (Tables of all masks would take half of a first-level cache.)
                let own = <$numbers>::from($own);
                bytemuck::cast((own & <$numbers>::splat(bits.into())).simd_eq(own))
            }
        }
    };
}

impl_masked!(f32x8, u8, i32x8, [1, 2, 4, 8, 16, 32, 64, 128]);
impl_masked!(f64x8, u8, i64x8, [1, 2, 4, 8, 16, 32, 64, 128]);
impl_masked!(
    f32x16,
    u16,
    i32x16,
    [1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, 32768]
);

impl<L: Masked> Mask<L> {
    /// No in every lane.
    #[inline(always)]
    pub fn none_set() -> Self {
        Self(L::default())
    }

    /// Yes in every lane.
    #[inline(always)]
    pub fn all_set() -> Self {
        Self(L::mask_from_bits(L::ALL))
    }

    /// Yes in the lanes whose bit is set; lane 0 is the lowest bit.
    #[inline(always)]
    pub fn from_bits(bits: L::Bits) -> Self {
        Self(L::mask_from_bits(bits))
    }

    /// A bit per lane; lane 0 is the lowest.
    #[inline(always)]
    pub fn bits(self) -> L::Bits {
        L::bits_of_mask(self.0)
    }

    /// Yes anywhere.
    #[inline(always)]
    pub fn any(self) -> bool {
        self.bits() != L::Bits::default()
    }

    /// Yes everywhere.
    #[inline(always)]
    pub fn all(self) -> bool {
        self.bits() == L::ALL
    }

    /// No everywhere.
    #[inline(always)]
    pub fn none(self) -> bool {
        self.bits() == L::Bits::default()
    }

    /// `yes` where set, `no` elsewhere.
    #[inline(always)]
    pub fn select(self, yes: L, no: L) -> L {
        L::choose(self.0, yes, no)
    }

    /// `x` where set, zero elsewhere.
    #[inline(always)]
    pub fn keep(self, x: L) -> L {
        self.0 & x
    }
}

impl<L: Lane> Mask<L> {
    /// A distance where set, which is not below zero; elsewhere a NaN, which is beyond any distance for [`Lane::sooner`].
    #[inline(always)]
    pub fn or_never(self, distance: L) -> L {
        (distance | (!self).0).abs()
    }

    /// The same answers for lanes of another width.
    #[inline(always)]
    pub fn cast<M: Lane>(self) -> Mask<M> {
        Mask::from_bits(self.bits())
    }
}

impl<L: Masked> BitAnd for Mask<L> {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl<L: Masked> BitOr for Mask<L> {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl<L: Masked> BitXor for Mask<L> {
    type Output = Self;
    #[inline(always)]
    fn bitxor(self, other: Self) -> Self {
        Self(self.0 ^ other.0)
    }
}

impl<L: Masked> Not for Mask<L> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        self ^ Self::all_set()
    }
}

impl<L: Masked> BitAndAssign for Mask<L> {
    #[inline(always)]
    fn bitand_assign(&mut self, other: Self) {
        *self = *self & other;
    }
}

impl<L: Masked> BitOrAssign for Mask<L> {
    #[inline(always)]
    fn bitor_assign(&mut self, other: Self) {
        *self = *self | other;
    }
}
