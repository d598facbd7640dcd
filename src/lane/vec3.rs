//! Eight vectors at a time.

use super::{Lane, Many, Mask, Scalar};
use glam::DVec3;
use std::ops::{Add, AddAssign, Mul, Neg, Sub};

/// No direction component counts as smaller than this before a slab test, so that none meets `0 * inf`. It bends a ray
/// by less than 2^-59 of its length, far below what boxes are widened by in either precision.
const LEAST_DIRECTION: f64 = 1.0 / (1u64 << 60) as f64;

/// What vectors can have as components: numbers of eight lanes, or of several times eight.
pub trait Component:
    Many + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self>
{
}

impl<M> Component for M where
    M: Many + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self>
{
}

/// Eight vectors (or colours), one a lane.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Vec3<L> {
    /// The x (or red) components.
    pub x: L,
    /// The y (or green) components.
    pub y: L,
    /// The z (or blue) components.
    pub z: L,
}

impl<C: Component> Vec3<C> {
    /// From three columns.
    #[inline(always)]
    pub fn new(x: C, y: C, z: C) -> Self {
        Self { x, y, z }
    }

    /// The same vector in every lane, rounded to the lane's precision.
    #[inline(always)]
    pub fn splat(v: DVec3) -> Self {
        Self::new(C::constant(v.x), C::constant(v.y), C::constant(v.z))
    }

    /// The same vector in every lane.
    #[inline(always)]
    pub fn broadcast(v: [<C::Eight as Lane>::Scalar; 3]) -> Self {
        let [x, y, z] = v.map(C::each);
        Self::new(x, y, z)
    }

    /// Scalar product.
    #[inline(always)]
    pub fn dot(self, other: Self) -> C {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// Scalar product by [`Lane::fused`]: for tests that are padded, never for what is seen.
    #[inline(always)]
    pub fn fused_dot(self, other: Self) -> C {
        self.x.times_plus(other.x, self.y.times_plus(other.y, self.z * other.z))
    }

    /// `self * s + other` by [`Lane::fused`].
    #[inline(always)]
    pub fn fused(self, s: C, other: Self) -> Self {
        Self::new(self.x.times_plus(s, other.x), self.y.times_plus(s, other.y), self.z.times_plus(s, other.z))
    }

    /// A matrix, given by its rows, times the vector, by [`Vec3::fused_dot`].
    #[inline(always)]
    pub fn fused_under(self, rows: &[Self; 3]) -> Self {
        Self::new(rows[0].fused_dot(self), rows[1].fused_dot(self), rows[2].fused_dot(self))
    }

    /// Vector product.
    #[inline(always)]
    pub fn cross(self, other: Self) -> Self {
        Self::new(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )
    }

    /// Component by component.
    #[allow(
        clippy::should_implement_trait,
        reason = "`*` scales by a number; two products under one sign mislead"
    )]
    #[inline(always)]
    pub fn mul(self, other: Self) -> Self {
        Self::new(self.x * other.x, self.y * other.y, self.z * other.z)
    }

    /// Each component through `f`.
    #[inline(always)]
    pub fn map(self, f: impl Fn(C) -> C) -> Self {
        Self::new(f(self.x), f(self.y), f(self.z))
    }
}

impl<L: Lane> Vec3<L> {
    /// The same number in every component of every lane.
    #[inline(always)]
    pub fn lit(x: f64) -> Self {
        let x = L::lit(x);
        Self::new(x, x, x)
    }

    /// Lane `k` is `f(k)`, rounded to the lane's precision.
    #[inline(always)]
    pub fn from_fn(mut f: impl FnMut(usize) -> DVec3) -> Self {
        let v = super::each_lane(&mut f);
        Self::new(
            L::from_fn(|k| L::Scalar::from_f64(v[k].x)),
            L::from_fn(|k| L::Scalar::from_f64(v[k].y)),
            L::from_fn(|k| L::Scalar::from_f64(v[k].z)),
        )
    }

    /// One lane's vector.
    #[inline(always)]
    pub fn lane(&self, k: usize) -> DVec3 {
        DVec3::new(
            self.x.to_array()[k].to_f64(),
            self.y.to_array()[k].to_f64(),
            self.z.to_array()[k].to_f64(),
        )
    }

    /// Each component rounded to another precision; exact towards the wider.
    #[inline(always)]
    pub fn cast<M: Lane>(self) -> Vec3<M> {
        Vec3::new(self.x.cast(), self.y.cast(), self.z.cast())
    }

    /// Of directions up to unit length: reciprocals for slab tests, finite whatever the direction.
    #[inline(always)]
    pub fn slab_inverse(self) -> Self {
        let least = L::lit(LEAST_DIRECTION);
        self.map(|d| L::lit(1.0) / least.max(d.abs()).copysign(d))
    }

    /// Length.
    #[inline(always)]
    pub fn length(self) -> L {
        self.dot(self).sqrt()
    }

    /// To length 1; NaN for zero.
    #[inline(always)]
    pub fn normalize(self) -> Self {
        self * (L::lit(1.0) / self.length())
    }

    /// Largest component.
    #[inline(always)]
    pub fn max_element(self) -> L {
        self.x.max(self.y).max(self.z)
    }

    /// Magnitudes.
    #[inline(always)]
    pub fn abs(self) -> Self {
        self.map(L::abs)
    }

    /// `yes` where `mask` is set, `no` elsewhere.
    #[inline(always)]
    pub fn select(mask: Mask<L>, yes: Self, no: Self) -> Self {
        Self::new(mask.select(yes.x, no.x), mask.select(yes.y, no.y), mask.select(yes.z, no.z))
    }
}

impl<C: Component> Add for Vec3<C> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self::new(self.x + o.x, self.y + o.y, self.z + o.z)
    }
}

impl<C: Component> AddAssign for Vec3<C> {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl<C: Component> Sub for Vec3<C> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self::new(self.x - o.x, self.y - o.y, self.z - o.z)
    }
}

impl<C: Component> Mul<C> for Vec3<C> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, s: C) -> Self {
        Self::new(self.x * s, self.y * s, self.z * s)
    }
}

impl<C: Component> Neg for Vec3<C> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}
