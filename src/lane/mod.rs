//! Eight numbers at a time, in single or double precision, behind one trait; four of them behind another.
//!
//! Kernels are written once over [`Lane`]; the caller picks `f32x8` or `f64x8`. This room knows no geometry.
//!
//! `wide` picks its instructions when it is compiled, and some of its operations are traps for geometry, so only the
//! sound ones are let through: no 12-bit reciprocals, no multiply-add whose rounding depends on the build.

#[cfg(all(target_arch = "x86_64", target_feature = "avx2"))]
mod four;
mod many;
mod mask;
mod quad;
mod sixteen;
mod vec3;

pub use many::{Many, sixteen_bits};
pub use mask::{Mask, Masked};
pub use quad::{QUAD, Quad, columns, rows};
pub use sixteen::Sixteen;
pub use vec3::{Component, Vec3};

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};
pub use wide::{f32x4, f32x8, f32x16, f64x2, f64x4, f64x8};
use wide::{i32x8, i64x8, u32x8};

/// Lanes in a packet.
pub const LANES: usize = 8;

/// `[f(0), …, f(7)]`. (`std::array::from_fn` with a closure of any size is left as a call by the compiler, and that
/// call costs more than the work.)
#[inline(always)]
pub fn each_lane<T: Copy + Default>(mut f: impl FnMut(usize) -> T) -> [T; LANES] {
    let mut lanes = [T::default(); LANES];
    for (k, lane) in lanes.iter_mut().enumerate() {
        *lane = f(k);
    }
    lanes
}

/// A bit for each lane whose number is `value`.
#[inline(always)]
pub fn equal_lanes(lanes: &[u32; LANES], value: u32) -> u8 {
    u32x8::from(*lanes).simd_eq(u32x8::splat(value)).to_bitmask() as u8
}

/// A bit for each lane whose numbers are the same.
#[inline(always)]
pub fn same_lanes(a: &[u32; LANES], b: &[u32; LANES]) -> u8 {
    u32x8::from(*a).simd_eq(u32x8::from(*b)).to_bitmask() as u8
}

/// A bit for each lane whose number is one of `len` (at least 1) from `first` on.
#[inline(always)]
pub fn lanes_within(lanes: &[u32; LANES], first: u32, len: u32) -> u8 {
    let beyond = u32x8::from(*lanes) - u32x8::splat(first); // What is below `first` comes out large.
    beyond.min(u32x8::splat(len.saturating_sub(1))).simd_eq(beyond).to_bitmask() as u8
}

/// `f` of eight numbers; asked once where all are the same, as those of neighbours mostly are.
#[inline(always)]
pub fn each_number<T: Copy>(numbers: &[u32; LANES], f: impl Fn(u32) -> T) -> [T; LANES] {
    let mut all = [f(numbers[0]); LANES];
    if equal_lanes(numbers, numbers[0]) != !0 {
        each_apart(numbers, f, &mut all);
    }
    all
}

/// The same of numbers that differ. (Inlined, it would have the compiler keep the eight in registers of their own and store them
/// one by one, and who then loads them as a vector waits for that.)
#[inline(never)]
fn each_apart<T>(numbers: &[u32; LANES], f: impl Fn(u32) -> T, all: &mut [T; LANES]) {
    for (one, &number) in all.iter_mut().zip(numbers) {
        *one = f(number);
    }
}

/// Asks the memory for the cache line where `what` begins and does not wait for it. (Nothing happens on machines for which
/// `safe_arch` has no instruction.)
#[inline(always)]
pub fn prefetch<T>(what: &T) {
    #[cfg(target_arch = "x86_64")]
    safe_arch::prefetch_t0(what);
    #[cfg(not(target_arch = "x86_64"))]
    let _ = what;
}

/// The bits of the first `n` lanes; of all for more.
#[inline(always)]
pub fn first_lanes(n: usize) -> u8 {
    if n >= LANES { !0 } else { (1 << n) - 1 }
}

/// The set bits of a byte, lowest first.
#[inline(always)]
pub fn bits(mask: u8) -> impl Iterator<Item = usize> {
    bits_of_many::<LANES>(mask.into())
}

/// The set bits of a number of `N` bits, lowest first. `N` is a power of two.
#[inline(always)]
pub fn bits_of_many<const N: usize>(mut mask: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        (mask != 0).then(|| {
            let k = mask.trailing_zeros() as usize & (N - 1);
            mask &= mask - 1;
            k
        })
    })
}

/// The set bits of a byte, highest first.
#[inline(always)]
pub fn bits_from_last(mut mask: u8) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        (mask != 0).then(|| {
            let k = first_and_last(mask).1;
            mask &= !(1 << k);
            k
        })
    })
}

/// The lowest and the highest set bit of a byte, which is not 0.
#[inline(always)]
pub fn first_and_last(mask: u8) -> (usize, usize) {
    let last = (LANES - 1).saturating_sub(mask.leading_zeros() as usize);
    (mask.trailing_zeros() as usize & (LANES - 1), last)
}

/// Numbers of `yes` where the bit is set, of `no` elsewhere.
#[inline(always)]
pub fn choose(bits: u8, yes: &[u32; LANES], no: &[u32; LANES]) -> [u32; LANES] {
    let [yes, no] = [yes, no].map(|numbers| f32x8::from(numbers.map(f32::from_bits)));
    Mask::<f32x8>::from_bits(bits).select(yes, no).to_array().map(f32::to_bits)
}

/// By lane, a number from 0 to 3 by its two bits.
#[inline(always)]
pub fn of_two_bits(low: u8, high: u8) -> [u32; LANES] {
    let worth = |bits: u8, worth: u32| Mask::from_bits(bits).keep(f32x8::splat(f32::from_bits(worth)));
    (worth(low, 1) | worth(high, 2)).to_array().map(f32::to_bits)
}

/// `of_two` over eight, by pairs.
#[inline(always)]
pub fn folded<T>([a, b, c, d, e, f, g, h]: [T; LANES], of_two: impl Fn(T, T) -> T) -> T {
    of_two(of_two(of_two(a, b), of_two(c, d)), of_two(of_two(e, f), of_two(g, h)))
}

/// The highest number of the lanes, none of which is NaN.
#[inline(always)]
pub fn highest<L: Lane>(x: L) -> L::Scalar {
    over_lanes(x, Quad::max, |a, b| if b > a { b } else { a })
}

/// The lowest number of the lanes, none of which is NaN.
#[inline(always)]
pub fn lowest<L: Lane>(x: L) -> L::Scalar {
    over_lanes(x, Quad::min, |a, b| if b < a { b } else { a })
}

/// One number of eight: by halves, and then by two.
#[inline(always)]
fn over_lanes<L: Lane, Q: Quad<Scalar = L::Scalar>>(
    x: L,
    of_halves: impl Fn(Q, Q) -> Q,
    of_two: impl Fn(L::Scalar, L::Scalar) -> L::Scalar,
) -> L::Scalar
where
    L::Scalar: Scalar<Quad = Q>,
{
    let [a, b] = x.halves();
    let four = of_halves(a, b).to_array();
    of_two(of_two(four[0], four[2]), of_two(four[1], four[3]))
}

/// The number in one lane: `f32` or `f64`.
pub trait Scalar: Copy + Default + PartialEq + PartialOrd + Debug + Send + Sync + 'static {
    /// The lanes that hold it.
    type Lane: Lane<Scalar = Self>;
    /// Two of these.
    type Sixteen: Many<Eight = Self::Lane>;
    /// Four of it.
    type Quad: Quad<Scalar = Self>;
    /// Half the distance from 1 to the next number: 2^-24 or 2^-53.
    const UNIT_ROUNDOFF: f64;
    /// Rounds to nearest.
    fn from_f64(x: f64) -> Self;
    /// Exact.
    fn to_f64(self) -> f64;
    /// For numbers that are not negative: a key in the same order, whose lowest eight bits are free.
    fn order_key(self) -> u64;
    /// A number that stands for 32 bits, to be masked, merged and taken apart again.
    fn of_bits(bits: u32) -> Self;
    /// The bits that it stands for.
    fn as_bits(self) -> u32;
}

impl Scalar for f32 {
    type Lane = f32x8;
    type Sixteen = f32x16;
    type Quad = f32x4;
    const UNIT_ROUNDOFF: f64 = f32::EPSILON as f64 / 2.0;
    fn from_f64(x: f64) -> Self {
        x as f32
    }
    fn to_f64(self) -> f64 {
        self.into()
    }
    #[inline(always)]
    fn order_key(self) -> u64 {
        u64::from(self.to_bits()) << 8
    }
    #[inline(always)]
    fn of_bits(bits: u32) -> Self {
        Self::from_bits(bits)
    }
    #[inline(always)]
    fn as_bits(self) -> u32 {
        self.to_bits()
    }
}

impl Scalar for f64 {
    type Lane = f64x8;
    type Sixteen = many::Two<f64x8>;
    type Quad = f64x4;
    const UNIT_ROUNDOFF: f64 = f64::EPSILON / 2.0;
    fn from_f64(x: f64) -> Self {
        x
    }
    fn to_f64(self) -> f64 {
        self
    }
    #[inline(always)]
    fn order_key(self) -> u64 {
        self.to_bits() & !0xff
    }
    #[inline(always)]
    fn of_bits(bits: u32) -> Self {
        Self::from_bits(bits.into())
    }
    #[inline(always)]
    fn as_bits(self) -> u32 {
        self.to_bits() as u32
    }
}

/// Eight numbers.
pub trait Lane:
    Masked<Bits = u8>
    + Debug
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
{
    /// One lane's number.
    type Scalar: Scalar<Lane = Self>;

    /// The same number in every lane.
    fn splat(x: Self::Scalar) -> Self;
    /// Lane by lane.
    fn from_array(lanes: [Self::Scalar; LANES]) -> Self;
    /// Lane by lane.
    fn to_array(self) -> [Self::Scalar; LANES];
    /// The lanes in place.
    fn lanes(&self) -> &[Self::Scalar; LANES];
    /// The lanes in place.
    fn lanes_mut(&mut self) -> &mut [Self::Scalar; LANES];
    /// Rounds each lane to this precision.
    fn from_f64s(lanes: f64x8) -> Self;
    /// Exact.
    fn to_f64s(self) -> f64x8;

    /// The same, handed on through a register. (From memory to memory the compiler copies 64 bytes as two halves on some machines that
    /// have lanes so wide, and who then loads all of them waits until both halves have reached the cache. For copies that are
    /// soon read.)
    #[allow(clippy::eq_op, reason = "an operation that changes nothing, which memory has none of")]
    #[inline(always)]
    fn in_register(self) -> Self {
        self | self
    }
    /// Rounded to another precision; exact towards the wider.
    #[inline(always)]
    fn cast<M: Lane>(self) -> M {
        M::from_f64s(self.to_f64s())
    }
    /// A constant in every lane.
    #[inline(always)]
    fn lit(x: f64) -> Self {
        Self::splat(Self::Scalar::from_f64(x))
    }
    /// Zero in every lane.
    #[inline(always)]
    fn zero() -> Self {
        Self::default()
    }
    /// Lane `k` is `f(k)`: gathers from columns.
    #[inline(always)]
    fn from_fn(f: impl FnMut(usize) -> Self::Scalar) -> Self {
        Self::from_array(each_lane(f))
    }

    /// `self * b + c`, rounded once where the machine can and twice where it cannot: for tests that are padded for either, and for
    /// polynomials and noise, which are told to the last digits of either. Nothing else that is seen may hang on it.
    fn fused(self, b: Self, c: Self) -> Self;
    /// Square root, correctly rounded; NaN below zero.
    fn sqrt(self) -> Self;
    /// Magnitude.
    fn abs(self) -> Self;
    /// Largest whole number not above.
    fn floor(self) -> Self;
    /// Whole part, towards zero.
    fn trunc(self) -> Self;
    /// The smaller; `other` where either is NaN. One instruction.
    fn min(self, other: Self) -> Self;
    /// The larger; `other` where either is NaN. One instruction.
    fn max(self, other: Self) -> Self;
    /// The smaller of two distances; something below zero if one is. This and the next two take numbers from 0 on by their bits, which
    /// are in order as whole numbers are: an operation of one cycle on machines where [`Lane::min`] takes four. (-0 is below zero, and
    /// a NaN is below zero or beyond infinity, by its sign. AVX2 has none for whole numbers of 64 bits: there doubles are taken as
    /// they are, -0 is 0, and a NaN gives way to `other`, but is beyond anything.)
    fn sooner(self, other: Self) -> Self;
    /// The larger of two distances, of which `other` is not below zero.
    fn later(self, other: Self) -> Self;
    /// A bit for each lane where this distance, which is not below zero, is larger than `other`.
    fn beyond(self, other: Self) -> u8;
    /// `self < other`, false on NaN.
    fn lt(self, other: Self) -> Mask<Self>;
    /// `self <= other`, false on NaN.
    fn le(self, other: Self) -> Mask<Self>;
    /// `self > other`, false on NaN.
    #[inline(always)]
    fn gt(self, other: Self) -> Mask<Self> {
        other.lt(self)
    }
    /// `self >= other`, false on NaN.
    #[inline(always)]
    fn ge(self, other: Self) -> Mask<Self> {
        other.le(self)
    }
    /// Numbers equal (`0 == -0`), false on NaN.
    fn equal(self, other: Self) -> Mask<Self>;
    /// Sine and cosine of radians.
    fn sin_cos(self) -> (Self, Self);
    /// Arc cosine; NaN outside -1..1.
    fn acos(self) -> Self;
    /// Angle of the point `(x, self)`, -π to π.
    fn atan2(self, x: Self) -> Self;
    /// Exponential.
    fn exp(self) -> Self;
    /// Natural logarithm.
    fn ln(self) -> Self;
    /// Cube root, odd.
    fn cbrt(self) -> Self;
    /// `self^y` for `self >= 0`: `0^0 = 1`, `0^y = 0` for `y > 0`.
    fn pow(self, y: Self) -> Self;

    /// The same for one exponent in all lanes: by squaring where that is a small whole number, at most `y` roundings.
    #[inline(always)]
    fn pow_const(self, y: f64) -> Self {
        // Few enough roundings to vanish in a picture: 2^-43 of the result in double precision, 2^-18 in single.
        let most = if Self::Scalar::UNIT_ROUNDOFF < f64::from(f32::EPSILON) / 2.0 { 1024.0 } else { 64.0 };
        if y.fract() != 0.0 || !(1.0..=most).contains(&y) {
            return self.pow_apart(y);
        }
        let (mut rest, mut square) = (y as u32, self.in_register());
        while rest & 1 == 0 {
            (rest, square) = (rest >> 1, square * square);
        }
        let mut product = square;
        while rest > 1 {
            (rest, square) = (rest >> 1, square * square);
            if rest & 1 == 1 {
                product = product * square;
            }
        }
        product
    }

    /// [`Lane::pow`] for one exponent, called: inlined, it would weigh down every place where a power is mostly squared.
    #[doc(hidden)]
    #[inline(never)]
    fn pow_apart(self, y: f64) -> Self {
        self.pow(Self::lit(y))
    }

    /// The sign bit of `sign` on the magnitude of `self`.
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        let bit = Self::lit(-0.0);
        self.abs() | (sign & bit)
    }

    /// The lower four lanes and the upper four.
    fn halves(self) -> [<Self::Scalar as Scalar>::Quad; 2];

    /// Lane `k` is number `which[k]` (0 to 3) of four: one instruction, or one for each half, where the machine has it.
    #[inline(always)]
    fn of_four(four: &[Self::Scalar; QUAD], which: &[u32; LANES]) -> Self {
        Self::from_fn(|k| four[which[k] as usize % QUAD])
    }

    /// Lane `k` of row `i` becomes lane `i` of row `k`.
    fn transpose(rows: [Self; LANES]) -> [Self; LANES];
}

macro_rules! impl_lane {
    ($lane:ty, $scalar:ty, $from_f64s:expr, $to_f64s:expr, $of_four:expr, ($bits:ty, $by_bits:expr)) => {
        impl Lane for $lane {
            type Scalar = $scalar;

            #[inline(always)]
            fn splat(x: $scalar) -> Self {
                <$lane>::splat(x)
            }
            #[inline(always)]
            fn from_array(lanes: [$scalar; LANES]) -> Self {
                <$lane>::from(lanes)
            }
            #[inline(always)]
            fn to_array(self) -> [$scalar; LANES] {
                <$lane>::to_array(self)
            }
            #[inline(always)]
            fn lanes(&self) -> &[$scalar; LANES] {
                self.as_array()
            }
            #[inline(always)]
            fn lanes_mut(&mut self) -> &mut [$scalar; LANES] {
                self.as_mut_array()
            }
            #[inline(always)]
            fn from_f64s(lanes: f64x8) -> Self {
                ($from_f64s)(lanes)
            }
            #[inline(always)]
            fn to_f64s(self) -> f64x8 {
                ($to_f64s)(self)
            }
            #[inline(always)]
            fn fused(self, b: Self, c: Self) -> Self {
                <$lane>::mul_add(self, b, c)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                <$lane>::sqrt(self)
            }
            #[inline(always)]
            fn abs(self) -> Self {
                <$lane>::abs(self)
            }
            #[inline(always)]
            fn floor(self) -> Self {
                <$lane>::floor(self)
            }
            #[inline(always)]
            fn trunc(self) -> Self {
                <$lane>::trunc(self)
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
            fn sooner(self, other: Self) -> Self {
                let (a, b): ($bits, $bits) = (bytemuck::cast(self), bytemuck::cast(other));
                if $by_bits { bytemuck::cast(a.min(b)) } else { Lane::min(self, other) }
            }
            #[inline(always)]
            fn later(self, other: Self) -> Self {
                let (a, b): ($bits, $bits) = (bytemuck::cast(self), bytemuck::cast(other));
                if $by_bits { bytemuck::cast(a.max(b)) } else { Lane::max(self, other) }
            }
            #[inline(always)]
            fn beyond(self, other: Self) -> u8 {
                let (a, b): ($bits, $bits) = (bytemuck::cast(self), bytemuck::cast(other));
                if $by_bits { a.simd_gt(b).to_bitmask() as u8 } else { (!self.le(other)).bits() }
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
            fn sin_cos(self) -> (Self, Self) {
                <$lane>::sin_cos(self)
            }
            #[inline(always)]
            fn acos(self) -> Self {
                <$lane>::acos(self)
            }
            #[inline(always)]
            fn atan2(self, x: Self) -> Self {
                <$lane>::atan2(self, x)
            }
            #[inline(always)]
            fn exp(self) -> Self {
                <$lane>::exp(self)
            }
            #[inline(always)]
            fn ln(self) -> Self {
                <$lane>::ln(self)
            }
            #[inline(always)]
            fn cbrt(self) -> Self {
                <$lane>::cbrt(self)
            }
            #[inline]
            fn pow(self, y: Self) -> Self {
                // `wide` computes exp2(y log2 x); where x is 0 the logarithm is not to be trusted.
                let zero = self.simd_le(Self::zero());
                let at_zero = y.simd_eq(Self::zero()).select(Self::lit(1.0), Self::zero());
                zero.select(at_zero, self.powf_simd(y))
            }
            #[inline(always)]
            fn halves(self) -> [<$scalar as Scalar>::Quad; 2] {
                bytemuck::cast(self)
            }
            #[cfg(all(target_arch = "x86_64", target_feature = "avx2"))]
            #[inline(always)]
            fn of_four(four: &[$scalar; QUAD], which: &[u32; LANES]) -> Self {
                ($of_four)(four, which)
            }
            #[inline(always)]
            fn transpose(rows: [Self; LANES]) -> [Self; LANES] {
                <$lane>::transpose(rows)
            }
        }
    };
}

impl_lane!(f32x8, f32, narrow, widen, four::singles, (i32x8, true));
impl_lane!(f64x8, f64, |x| x, |x| x, four::doubles, (i64x8, cfg!(target_feature = "avx512f")));

#[inline(always)]
fn narrow(lanes: f64x8) -> f32x8 {
    let lanes = lanes.to_array();
    f32x8::from(each_lane(|k| lanes[k] as f32))
}

#[inline(always)]
fn widen(lanes: f32x8) -> f64x8 {
    let lanes = lanes.to_array();
    f64x8::from(each_lane(|k| f64::from(lanes[k])))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check<L: Lane>() {
        let a = L::from_fn(|k| L::Scalar::from_f64(k as f64 - 3.0));
        assert_eq!(a.lt(L::zero()).bits(), 0b0000_0111);
        assert_eq!(a.le(L::zero()).bits(), 0b0000_1111);
        assert_eq!(a.equal(L::lit(-0.0)).bits(), 0b0000_1000);
        for bits in 0..=255 {
            assert_eq!(Mask::<L>::from_bits(bits).bits(), bits);
            assert_eq!((!Mask::<L>::from_bits(bits)).bits(), !bits);
        }
        let four = [0.5, -1.0, 2.25, 7.0].map(L::Scalar::from_f64);
        for (low, high) in [(0b1010_0101, 0b0011_1100), (0, !0), (!0, 0), (!0, !0)] {
            let which = of_two_bits(low, high);
            let expected = each_lane(|k| u32::from(low >> k & 1) + 2 * u32::from(high >> k & 1));
            assert_eq!(which, expected);
            assert_eq!(L::of_four(&four, &which).to_array(), each_lane(|k| four[which[k] as usize]));
        }
        let numbers = [0, 6, 7, 8, 9, 10, u32::MAX, 1 << 31];
        assert_eq!(lanes_within(&numbers, 7, 3), 0b0001_1100);
        let nan = L::lit(f64::NAN);
        assert!(nan.lt(a).none() && nan.gt(a).none() && nan.equal(nan).none());
        // The new value first, the bound second: NaN loses.
        assert_eq!(nan.min(a).to_array(), a.to_array());
        assert_eq!(nan.max(a).to_array(), a.to_array());
        let (zero, huge) = (L::zero(), L::lit(f64::INFINITY));
        assert_eq!(a.later(zero).to_array(), a.max(zero).to_array());
        assert_eq!(a.sooner(huge).to_array(), a.to_array());
        assert_eq!(L::lit(2.0).sooner(a).lt(zero).bits(), 0b0000_0111);
        assert_eq!(L::lit(2.0).beyond(a), 0b0001_1111);
        assert_eq!((zero.beyond(zero), huge.beyond(zero), zero.beyond(a)), (0, !0, 0b0000_0111));
        let powers = L::zero().pow(a);
        assert_eq!(powers.to_array()[3].to_f64(), 1.0);
        assert_eq!(powers.to_array()[4].to_f64(), 0.0);
        let tolerance = 8.0 * L::Scalar::UNIT_ROUNDOFF; // a few roundings of `exp2(y log2 x)`
        for (x, y) in [(0.9, 40.0), (0.999, 500.0), (0.5, 0.25), (2.0, 10.0)] {
            let (x, y) = (L::lit(x), L::lit(y));
            let expected = x.to_array()[0].to_f64().powf(y.to_array()[0].to_f64());
            let found = x.pow(y).to_array()[0].to_f64();
            // The error of the logarithm is multiplied by y.
            let scale = 1.0 + (y.to_array()[0].to_f64() * x.to_array()[0].to_f64().ln()).abs();
            assert!((found - expected).abs() <= tolerance * scale * expected, "{found} for {expected}");
            let exponent = y.to_array()[0].to_f64();
            let found = x.pow_const(exponent).to_array()[0].to_f64();
            let tolerance = tolerance * scale.max(exponent);
            assert!((found - expected).abs() <= tolerance * expected, "{found} for {expected}");
        }
    }

    #[test]
    fn lanes_agree_with_scalars() {
        check::<f32x8>();
        check::<f64x8>();
    }
}
