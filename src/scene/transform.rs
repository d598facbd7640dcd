//! Affine maps that carry their inverse with them.

use glam::{DAffine3, DMat3, DVec3};
use std::ops::Deref;
use std::sync::Arc;

/// How far POV-Ray says that something without end reaches.
pub const ENDLESS: f64 = 1e10;

/// An affine map and its inverse, both kept by composition, so that neither is ever inverted numerically twice.
///
/// Rotations are left-handed about x, then y, then z; a scale component of 0 counts as 1 (manual section 2.3.3).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transform {
    /// The map itself.
    pub forward: DAffine3,
    /// Its inverse.
    pub inverse: DAffine3,
}

/// A transform where most have none: the identity takes one word instead of 24. Reads as the [`Transform`] it is.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Placement(Option<Arc<Transform>>);

impl Placement {
    /// Moves nothing.
    pub const IDENTITY: Self = Self(None);

    /// True if it moves nothing.
    pub fn is_identity(&self) -> bool {
        self.0.is_none()
    }

    /// Moves what has been placed by `next`.
    pub fn move_by(&mut self, next: &Transform) {
        *self = match &self.0 {
            None => (*next).into(),
            Some(transform) => transform.then(next).into(),
        };
    }
}

impl From<Transform> for Placement {
    fn from(transform: Transform) -> Self {
        Self((transform != Transform::IDENTITY).then(|| Arc::new(transform)))
    }
}

impl Deref for Placement {
    type Target = Transform;

    fn deref(&self) -> &Transform {
        self.0.as_deref().unwrap_or(&Transform::IDENTITY)
    }
}

impl Default for Transform {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl Transform {
    /// The map that changes nothing.
    pub const IDENTITY: Self = Self { forward: DAffine3::IDENTITY, inverse: DAffine3::IDENTITY };

    /// Moves by `offset`.
    pub fn translate(offset: DVec3) -> Self {
        Self { forward: DAffine3::from_translation(offset), inverse: DAffine3::from_translation(-offset) }
    }

    /// Stretches each axis. The caller has replaced zeros by ones.
    pub fn scale(factor: DVec3) -> Self {
        Self { forward: DAffine3::from_scale(factor), inverse: DAffine3::from_scale(1.0 / factor) }
    }

    /// Turns about x, then y, then z, by `angles` in radians, left-handed.
    pub fn rotate(angles: DVec3) -> Self {
        // In POV-Ray's left-handed space the positive turn has the very matrix of the right-handed one.
        let m = DMat3::from_rotation_z(angles.z)
            * DMat3::from_rotation_y(angles.y)
            * DMat3::from_rotation_x(angles.x);
        Self { forward: DAffine3::from_mat3(m), inverse: DAffine3::from_mat3(m.transpose()) }
    }

    /// Any affine map; `None` if it cannot be inverted.
    pub fn from_affine(forward: DAffine3) -> Option<Self> {
        let inverse = forward.inverse();
        (forward.is_finite() && inverse.is_finite()).then_some(Self { forward, inverse })
    }

    /// First `self`, then `next`: how a scene file's transforms pile up.
    pub fn then(&self, next: &Self) -> Self {
        Self { forward: next.forward * self.forward, inverse: self.inverse * next.inverse }
    }

    /// The map the other way round.
    pub fn inverted(&self) -> Self {
        Self { forward: self.inverse, inverse: self.forward }
    }

    /// Maps a point.
    pub fn point(&self, p: DVec3) -> DVec3 {
        self.forward.transform_point3(p)
    }

    /// Maps a direction; its length changes with the scale.
    pub fn vector(&self, v: DVec3) -> DVec3 {
        self.forward.transform_vector3(v)
    }

    /// The box about the corners of a moved box. What has no end has none after a move.
    pub fn box_about(&self, min: DVec3, max: DVec3) -> (DVec3, DVec3) {
        if (max - min).max_element() >= ENDLESS {
            return (DVec3::splat(-ENDLESS), DVec3::splat(ENDLESS));
        }
        let corner = |i: usize| {
            self.point(DVec3::new(
                if i & 1 == 0 { min.x } else { max.x },
                if i & 2 == 0 { min.y } else { max.y },
                if i & 4 == 0 { min.z } else { max.z },
            ))
        };
        let first = corner(0);
        (1..8).map(corner).fold((first, first), |(low, high), p| (low.min(p), high.max(p)))
    }

    /// Maps a normal (by the inverse transpose); not normalised.
    pub fn normal(&self, n: DVec3) -> DVec3 {
        self.inverse.matrix3.transpose() * n
    }
}
