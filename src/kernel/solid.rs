//! What a primitive is as a body, for tests that are rounded otherwise than its own: shapes in plain f64.

use super::Quadric;
use glam::{DMat3, DVec3};

/// A space of a shape's own: `own = rows (p - center)`.
#[derive(Debug, Clone, Copy)]
pub struct OwnSpace {
    /// World position of its origin.
    pub center: DVec3,
    /// The linear part, 1 / scene unit.
    pub map: DMat3,
}

/// A body whose whole boundary is its surface.
#[derive(Debug, Clone, Copy)]
pub enum Solid {
    /// What is within `radius` of `center`.
    Ball {
        /// Its middle.
        center: DVec3,
        /// How far it goes.
        radius: f64,
    },
    /// The unit ball of an own space.
    Ellipsoid(OwnSpace),
    /// An axis-parallel box.
    Box {
        /// Its lowest corner.
        min: DVec3,
        /// Its highest corner.
        max: DVec3,
    },
    /// What is within `half` of the middle in each axis of an own space.
    OrientedBox(OwnSpace, DVec3),
    /// In its own space of radius 1 about the z axis, from 0 to 1.
    Cylinder(OwnSpace),
    /// The same with a radius that falls by `taper` (over 0, at most 1) from the one end to the other.
    Cone {
        /// Its space.
        space: OwnSpace,
        /// What of the radius the other end lacks.
        taper: f64,
    },
    /// What lies behind a plane.
    HalfSpace {
        /// Outward, of length 1.
        normal: DVec3,
        /// A point of the plane.
        foot: DVec3,
    },
    /// Where a quadric of an own space is not above 0.
    Quadric(OwnSpace, Quadric),
    /// Anything else that has an end: its crossings tell.
    Other,
    /// Anything that may have no end: its crossings tell, and which rays come from inside.
    Endless,
}
