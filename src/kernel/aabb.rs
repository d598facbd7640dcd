//! Axis-parallel boxes around primitives.

use glam::{BVec3, DVec3};

/// A box between two corners; empty if `min > max`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// Lowest corner.
    pub min: DVec3,
    /// Highest corner.
    pub max: DVec3,
}

impl Aabb {
    /// Holds nothing.
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };
    /// Holds everything.
    pub const INFINITE: Self = Self { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY };

    /// Around points.
    pub fn of(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Self { min: b.min.min(p), max: b.max.max(p) })
    }

    /// Around both.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// What both hold.
    pub fn intersection(self, other: Self) -> Self {
        Self { min: self.min.max(other.min), max: self.max.min(other.max) }
    }

    /// True if both hold some point.
    pub fn meets(&self, other: &Self) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    /// Grown by a share of its own largest coordinate on every side, to hold what rounding moves out of it.
    pub fn inflated(self, share: f64) -> Self {
        let reach = self.reach() * share;
        Self { min: self.min - reach, max: self.max + reach }
    }

    /// Its largest coordinate, by size.
    pub fn reach(&self) -> f64 {
        self.min.abs().max(self.max.abs()).max_element()
    }

    /// True if it holds nothing.
    pub fn is_empty(&self) -> bool {
        self.min.cmpgt(self.max).any()
    }

    /// True if every side is finite and none is reversed.
    pub fn is_finite(&self) -> bool {
        self.min.is_finite() && self.max.is_finite() && self.min.cmple(self.max).all()
    }

    /// Its eight corners.
    pub fn corners(&self) -> impl Iterator<Item = DVec3> {
        let Self { min, max } = *self;
        (0..8).map(move |k| DVec3::select(BVec3::new(k & 1 != 0, k & 2 != 0, k & 4 != 0), max, min))
    }

    /// Its middle.
    pub fn center(&self) -> DVec3 {
        (self.min + self.max) * 0.5
    }

    /// Half its surface.
    pub fn half_area(&self) -> f64 {
        let d = self.max - self.min;
        d.x * d.y + d.y * d.z + d.z * d.x
    }
}
