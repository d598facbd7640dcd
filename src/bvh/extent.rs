//! Boxes in single precision as trees are built from them, in one vector each.

use crate::lane::f32x8;
use bytemuck::Zeroable;
use wide::f32x4;

/// A box in single precision: the lowest corner in lanes 0 to 2, the highest one negated in lanes 4 to 6, so that the
/// box around two is their minimum. Lanes 3 and 7 hold two numbers that are the owner's business.
#[derive(Debug, Clone, Copy, Zeroable)]
#[repr(transparent)]
pub(super) struct Extent(f32x8);

impl Extent {
    /// Holds nothing.
    pub const EMPTY: Self = Self(f32x8::new([f32::INFINITY; 8]));

    /// Neither infinite nor NaN.
    pub fn is_finite(&self) -> bool {
        self.corners().iter().flatten().all(|x| x.is_finite())
    }

    /// From `low` to `high`.
    pub fn new([a, b, c]: [f32; 3], [d, e, f]: [f32; 3]) -> Self {
        Self(f32x8::new([a, b, c, 0.0, -d, -e, -f, 0.0]))
    }

    /// Around both; the owner's numbers become meaningless.
    #[inline(always)]
    pub fn around(self, other: Self) -> Self {
        Self(self.0.fast_min(other.0))
    }

    /// The same box with the owner's numbers.
    #[inline(always)]
    pub fn tagged(self, a: u32, b: u32) -> Self {
        let mut lanes = self.0.to_array();
        (lanes[3], lanes[7]) = (f32::from_bits(a), f32::from_bits(b));
        Self(f32x8::new(lanes))
    }

    /// The owner's numbers.
    #[inline(always)]
    pub fn tags(&self) -> (u32, u32) {
        let lanes = self.0.as_array();
        (lanes[3].to_bits(), lanes[7].to_bits())
    }

    /// Lowest and highest corner.
    pub fn corners(&self) -> [[f32; 3]; 2] {
        let [a, b, c, _, d, e, f, _] = *self.0.as_array();
        [[a, b, c], [-d, -e, -f]]
    }

    /// Half its surface.
    #[inline(always)]
    pub fn half_area(&self) -> f32 {
        let [low, negated] = self.halves();
        let [x, y, z, _] = (low + negated).to_array(); // Widths, negated; products of two do not mind.
        x * y + (y + x) * z
    }

    /// Lowest corner, and the highest one negated.
    #[inline(always)]
    pub fn halves(&self) -> [f32x4; 2] {
        bytemuck::cast(self.0)
    }

    /// Twice the middle.
    #[inline(always)]
    pub fn center(&self) -> f32x4 {
        let [low, negated] = self.halves();
        low - negated
    }

    /// Twice the middle along one axis.
    #[inline(always)]
    pub fn center_along(&self, axis: usize) -> f32 {
        let lanes = self.0.as_array();
        lanes[axis] - lanes[4 + axis]
    }

    /// Twice as far from zero.
    pub fn twice(self) -> Self {
        Self(self.0 + self.0)
    }

    /// What both hold.
    pub fn common(self, other: Self) -> Self {
        Self(self.0.fast_max(other.0))
    }

    /// What lies below `plane` along `axis`.
    pub fn below(self, axis: usize, plane: f32) -> Self {
        let mut lanes = self.0.to_array();
        lanes[4 + axis] = lanes[4 + axis].max(-plane);
        Self(f32x8::new(lanes))
    }

    /// What lies above `plane` along `axis`.
    pub fn above(self, axis: usize, plane: f32) -> Self {
        let mut lanes = self.0.to_array();
        lanes[axis] = lanes[axis].max(plane);
        Self(f32x8::new(lanes))
    }

    /// Around a point.
    #[inline(always)]
    pub fn point(at: f32x4) -> Self {
        Self(bytemuck::cast([at, -at]))
    }
}

/// What lies around items and around their middles (those twice as far from zero).
#[derive(Debug, Clone, Copy)]
pub(super) struct Around {
    pub bounds: Extent,
    pub centers: Extent,
}

impl Around {
    pub const NOTHING: Self = Self { bounds: Extent::EMPTY, centers: Extent::EMPTY };

    /// One item.
    #[inline(always)]
    pub fn of(item: Extent) -> Self {
        Self { bounds: item, centers: Extent::point(item.center()) }
    }

    /// Both.
    #[inline(always)]
    pub fn with(self, other: Self) -> Self {
        Self { bounds: self.bounds.around(other.bounds), centers: self.centers.around(other.centers) }
    }

    /// And one item more.
    #[inline(always)]
    pub fn and(self, item: Extent) -> Self {
        self.with(Self::of(item))
    }
}
