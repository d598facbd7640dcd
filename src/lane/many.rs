//! Eight numbers at a time or several times eight, for what is the same of all of them.

use super::{LANES, Lane, Mask, Scalar, f32x8, f32x16, f64x8, highest};
use bytemuck::cast;
use std::fmt::Debug;
use wide::i32x16;

/// Some eights of numbers. (The operations are those of [`Lane`]; as eight lanes have both, the names are others.)
pub trait Many: Copy + Debug {
    /// One of the eights.
    type Eight: Lane;
    /// How many eights there are.
    const EIGHTS: usize;

    /// Eight by eight.
    fn of(eight: impl Fn(usize) -> Self::Eight) -> Self;
    /// The same number everywhere.
    fn each(x: <Self::Eight as Lane>::Scalar) -> Self;
    /// The same constant everywhere.
    #[inline(always)]
    fn constant(x: f64) -> Self {
        Self::each(<Self::Eight as Lane>::Scalar::from_f64(x))
    }
    /// Number `k` becomes `x`.
    fn with(self, k: usize, x: <Self::Eight as Lane>::Scalar) -> Self;
    /// The highest, if none is NaN.
    fn highest(self) -> <Self::Eight as Lane>::Scalar;
    /// [`Lane::fused`].
    fn times_plus(self, b: Self, c: Self) -> Self;
    /// [`Lane::sooner`].
    fn sooner_of(self, other: Self) -> Self;
    /// [`Lane::later`].
    fn later_of(self, other: Self) -> Self;
    /// [`Lane::beyond`], eight by eight; of the second there may be none.
    fn eights_beyond(self, other: Self) -> [u8; 2];
    /// The same in one.
    #[inline(always)]
    fn which_beyond(self, other: Self) -> u16 {
        u16::from_le_bytes(self.eights_beyond(other))
    }
}

impl<L: Lane> Many for L {
    type Eight = L;
    const EIGHTS: usize = 1;

    #[inline(always)]
    fn of(eight: impl Fn(usize) -> L) -> L {
        eight(0)
    }
    #[inline(always)]
    fn each(x: L::Scalar) -> L {
        Lane::splat(x)
    }
    #[inline(always)]
    fn with(self, k: usize, x: L::Scalar) -> L {
        Mask::from_bits(1 << (k % LANES)).select(Lane::splat(x), self)
    }
    #[inline(always)]
    fn highest(self) -> L::Scalar {
        highest(self)
    }
    #[inline(always)]
    fn times_plus(self, b: L, c: L) -> L {
        Lane::fused(self, b, c)
    }
    #[inline(always)]
    fn sooner_of(self, other: L) -> L {
        Lane::sooner(self, other)
    }
    #[inline(always)]
    fn later_of(self, other: L) -> L {
        Lane::later(self, other)
    }
    #[inline(always)]
    fn eights_beyond(self, other: L) -> [u8; 2] {
        [Lane::beyond(self, other), 0]
    }
}

/// (One operation on machines with AVX-512, as those of eight are.)
impl Many for f32x16 {
    type Eight = f32x8;
    const EIGHTS: usize = 2;

    #[inline(always)]
    fn of(eight: impl Fn(usize) -> f32x8) -> Self {
        cast([eight(0), eight(1)])
    }
    #[inline(always)]
    fn each(x: f32) -> Self {
        Self::splat(x)
    }
    #[inline(always)]
    fn with(self, k: usize, x: f32) -> Self {
        let number = i32x16::from([0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]);
        let here: Self = cast(number.simd_eq(i32x16::splat(k as i32)));
        here.select(Self::splat(x), self)
    }
    #[inline(always)]
    fn highest(self) -> f32 {
        let [a, b]: [f32x8; 2] = cast(self);
        highest(Lane::max(a, b))
    }
    #[inline(always)]
    fn times_plus(self, b: Self, c: Self) -> Self {
        self.mul_add(b, c)
    }
    #[inline(always)]
    fn sooner_of(self, other: Self) -> Self {
        cast(cast::<_, i32x16>(self).min(cast(other)))
    }
    #[inline(always)]
    fn later_of(self, other: Self) -> Self {
        cast(cast::<_, i32x16>(self).max(cast(other)))
    }
    #[inline(always)]
    fn eights_beyond(self, other: Self) -> [u8; 2] {
        if AT_ONCE {
            let beyond = cast::<_, i32x16>(self).simd_gt(cast::<_, i32x16>(other));
            return (beyond.to_bitmask() as u16).to_le_bytes();
        }
        let ([a, b], [c, d]): ([f32x8; 2], [f32x8; 2]) = (cast(self), cast(other));
        [Lane::beyond(a, c), Lane::beyond(b, d)]
    }
}

/// True if the machine takes sixteen numbers at a time.
const AT_ONCE: bool = cfg!(target_feature = "avx512f");

/// Sixteen answers, by sign, as bits from `place` on.
#[inline(always)]
pub fn sixteen_bits(answers: f32x16, place: usize) -> u64 {
    if AT_ONCE {
        return u64::from(answers.to_bitmask()) << place;
    }
    // (Each eight is put in its place by itself: if they are put side by side first, the compiler packs the answers together before
    // it takes their signs, which takes twice as many instructions, one after the other.)
    let [low, high]: [f32x8; 2] = cast(answers);
    u64::from(low.to_bitmask()) << place | u64::from(high.to_bitmask()) << (place + LANES)
}

/// Two eights, where the machine has no operations for both at once.
#[derive(Debug, Clone, Copy)]
pub struct Two<L>([L; 2]);

impl<L> Two<L> {
    #[inline(always)]
    fn by_eights(f: impl Fn(usize) -> L) -> Self {
        Self([f(0), f(1)])
    }
}

impl Many for Two<f64x8> {
    type Eight = f64x8;
    const EIGHTS: usize = 2;

    #[inline(always)]
    fn of(eight: impl Fn(usize) -> f64x8) -> Self {
        Self::by_eights(eight)
    }
    #[inline(always)]
    fn each(x: f64) -> Self {
        Self([Lane::splat(x); 2])
    }
    #[inline(always)]
    fn with(self, k: usize, x: f64) -> Self {
        Self::by_eights(|n| if n == k / LANES { Many::with(self.0[n], k, x) } else { self.0[n] })
    }
    #[inline(always)]
    fn highest(self) -> f64 {
        highest(Lane::max(self.0[0], self.0[1]))
    }
    #[inline(always)]
    fn times_plus(self, b: Self, c: Self) -> Self {
        Self::by_eights(|n| Lane::fused(self.0[n], b.0[n], c.0[n]))
    }
    #[inline(always)]
    fn sooner_of(self, other: Self) -> Self {
        Self::by_eights(|n| Lane::sooner(self.0[n], other.0[n]))
    }
    #[inline(always)]
    fn later_of(self, other: Self) -> Self {
        Self::by_eights(|n| Lane::later(self.0[n], other.0[n]))
    }
    #[inline(always)]
    fn eights_beyond(self, other: Self) -> [u8; 2] {
        [0, 1].map(|n| Lane::beyond(self.0[n], other.0[n]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lane::each_lane;

    /// Two eights are as the eights by themselves.
    fn check<B: Scalar>() {
        type Pair<B> = <B as Scalar>::Sixteen;
        let row = |first: f64, step: f64, n: usize| {
            B::Lane::from_array(each_lane(|k| B::from_f64(first + step * (8 * n + k) as f64)))
        };
        let (a, b) = (|n| row(-3.0, 0.75, n), |n| row(7.0, -0.5, n));
        let (both, other) = (<Pair<B> as Many>::of(a), <Pair<B> as Many>::of(b));
        let zero = <Pair<B> as Many>::constant(0.0);
        let later = both.later_of(zero);
        let beyond = [0, 1].map(|n| Lane::beyond(Lane::later(a(n), B::Lane::zero()), b(n)));
        assert_eq!(later.which_beyond(other), u16::from_le_bytes(beyond));
        assert_eq!(later.eights_beyond(other), beyond);
        assert!(beyond[0] == 0 && beyond[1] != 0);
        let fused = |n| Lane::later(Lane::fused(a(n), b(n), b(n)), B::Lane::zero());
        let least =
            [0, 1].map(|n| Lane::beyond(Lane::sooner(fused(n), B::Lane::lit(5.0)), B::Lane::lit(4.0)));
        let found = both.times_plus(other, other).later_of(zero).sooner_of(<Pair<B> as Many>::constant(5.0));
        assert_eq!(found.which_beyond(<Pair<B> as Many>::constant(4.0)), u16::from_le_bytes(least));
        assert_eq!(both.highest().to_f64(), 8.25);
        for k in 0..2 * LANES {
            let changed = later.with(k, B::from_f64(100.0));
            assert_eq!(changed.highest().to_f64(), 100.0);
            assert_eq!(changed.which_beyond(<Pair<B> as Many>::constant(50.0)), 1 << k);
        }
    }

    #[test]
    fn answers_are_put_in_their_place() {
        let signs = |k: usize| if 0b1001_0110_0011_0101 >> k & 1 == 1 { -1.0 } else { 1.0 };
        let answers = f32x16::from(std::array::from_fn::<f32, 16, _>(signs));
        for place in [0, 16, 48] {
            assert_eq!(sixteen_bits(answers, place), 0b1001_0110_0011_0101 << place);
        }
    }

    #[test]
    fn sixteen_are_two_eights() {
        check::<f32>();
        check::<f64>();
    }
}
