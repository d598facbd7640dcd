//! Convex bodies as what is around a few ellipsoids, discs and points: for tests of how they look from somewhere.

use super::{OwnSpace, Solid};
use glam::{DMat3, DVec3};
use smallvec::{SmallVec, smallvec};

/// An ellipsoid; a disc, a line or a point where half axes are zero.
#[derive(Debug, Clone, Copy)]
pub struct Lobe {
    /// Its middle, in compiled space.
    pub center: DVec3,
    /// Half axes: it is all `center + half_axes * v` with `|v| <= 1`.
    pub half_axes: DMat3,
}

/// What a body is the convex hull of, or lies within.
pub type Lobes = SmallVec<[Lobe; 8]>;

impl Lobe {
    fn point(center: DVec3) -> Self {
        Self { center, half_axes: DMat3::ZERO }
    }

    /// The disc of an own space across its z axis, at height `z`.
    pub fn disc(space: &OwnSpace, z: f64, radius: f64) -> Self {
        let [x, y, height] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| space.map.inverse() * axis);
        let half_axes = DMat3::from_cols(x * radius, y * radius, DVec3::ZERO);
        Self { center: space.center + height * z, half_axes }
    }

    /// The corners of a box.
    pub fn corners(min: DVec3, max: DVec3) -> Lobes {
        let corner = |k: u32| DVec3::select(glam::BVec3::new(k & 1 == 0, k & 2 == 0, k & 4 == 0), min, max);
        (0..8).map(|k| Self::point(corner(k))).collect()
    }
}

impl Solid {
    /// What it is the hull of; none if that is not told, or it has no end.
    pub fn lobes(&self) -> Option<Lobes> {
        let lobes = match self {
            Self::Ball { center, radius } => {
                let half_axes = DMat3::from_diagonal(DVec3::splat(*radius));
                smallvec![Lobe { center: *center, half_axes }]
            }
            Self::Ellipsoid(space) => {
                smallvec![Lobe { center: space.center, half_axes: space.map.inverse() }]
            }
            Self::Box { min, max } => Lobe::corners(*min, *max),
            Self::OrientedBox(space, half) => {
                let to_world = space.map.inverse();
                let corners = Lobe::corners(-*half, *half);
                corners.into_iter().map(|own| Lobe::point(space.center + to_world * own.center)).collect()
            }
            Self::Cylinder(space) => smallvec![Lobe::disc(space, 0.0, 1.0), Lobe::disc(space, 1.0, 1.0)],
            Self::Cone { space, taper } => {
                smallvec![Lobe::disc(space, 0.0, 1.0), Lobe::disc(space, 1.0, 1.0 - taper)]
            }
            Self::HalfSpace { .. } | Self::Quadric(..) | Self::Other | Self::Endless => return None,
        };
        Some(lobes)
    }
}
