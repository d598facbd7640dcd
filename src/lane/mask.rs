//! Eight yes-or-no answers, in the form that comparisons give and selections take.

use super::Lane;
use std::ops::{BitAnd, BitAndAssign, BitOr, BitOrAssign, BitXor, Not};

/// One answer per lane.
#[derive(Debug, Clone, Copy, Default)]
pub struct Mask<L>(pub(super) L);

impl<L: Lane> Mask<L> {
    /// No in every lane.
    #[inline(always)]
    pub fn none_set() -> Self {
        Self(L::zero())
    }

    /// Yes in every lane.
    #[inline(always)]
    pub fn all_set() -> Self {
        Self(L::mask_from_bits(!0))
    }

    /// Yes in the lanes whose bit is set; lane 0 is the lowest bit.
    #[inline(always)]
    pub fn from_bits(bits: u8) -> Self {
        Self(L::mask_from_bits(bits))
    }

    /// A bit per lane; lane 0 is the lowest.
    #[inline(always)]
    pub fn bits(self) -> u8 {
        L::bitmask(self.0)
    }

    /// Yes anywhere.
    #[inline(always)]
    pub fn any(self) -> bool {
        self.bits() != 0
    }

    /// Yes everywhere.
    #[inline(always)]
    pub fn all(self) -> bool {
        self.bits() == !0
    }

    /// No everywhere.
    #[inline(always)]
    pub fn none(self) -> bool {
        self.bits() == 0
    }

    /// `yes` where set, `no` elsewhere.
    #[inline(always)]
    pub fn select(self, yes: L, no: L) -> L {
        L::select(self.0, yes, no)
    }

    /// `x` where set, zero elsewhere.
    #[inline(always)]
    pub fn keep(self, x: L) -> L {
        self.0 & x
    }

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

impl<L: Lane> BitAnd for Mask<L> {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl<L: Lane> BitOr for Mask<L> {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl<L: Lane> BitXor for Mask<L> {
    type Output = Self;
    #[inline(always)]
    fn bitxor(self, other: Self) -> Self {
        Self(self.0 ^ other.0)
    }
}

impl<L: Lane> Not for Mask<L> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        self ^ Self::all_set()
    }
}

impl<L: Lane> BitAndAssign for Mask<L> {
    #[inline(always)]
    fn bitand_assign(&mut self, other: Self) {
        *self = *self & other;
    }
}

impl<L: Lane> BitOrAssign for Mask<L> {
    #[inline(always)]
    fn bitor_assign(&mut self, other: Self) {
        *self = *self | other;
    }
}
