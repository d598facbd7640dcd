//! Convex bodies as what is around a few ellipsoids, discs and points: for tests of how they look from somewhere.

use super::{Aabb, OwnSpace, Solid};
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
        let to_world = space.map.inverse();
        let [x, y] = [to_world.x_axis, to_world.y_axis].map(|axis| axis * radius);
        let half_axes = DMat3::from_cols(x, y, DVec3::ZERO);
        Self { center: space.center + to_world.z_axis * z, half_axes }
    }

    /// The corners of a box.
    pub fn corners(of: &Aabb) -> Lobes {
        of.corners().map(Self::point).collect()
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
            Self::Box { min, max } => Lobe::corners(&Aabb { min: *min, max: *max }),
            Self::OrientedBox(space, half) => {
                let to_world = space.map.inverse();
                let own = Aabb { min: -*half, max: *half };
                own.corners().map(|corner| Lobe::point(space.center + to_world * corner)).collect()
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
