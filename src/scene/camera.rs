//! The camera, after its keywords have been worked off (`look_at`, `angle`, `sky`, transforms).

use glam::DVec3;

/// How the picture plane makes rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Projection {
    /// All rays start at the eye.
    #[default]
    Perspective,
    /// All rays are parallel.
    Orthographic,
}

/// A camera in look-at form: the eye, the direction l, and the picture's axes u (right) and v (up).
///
/// The ray through pixel (x, y) of a `w` by `h` picture, x and y counted from the top left, has
/// `s = (x + 1/2)/w - 1/2` and `t = 1/2 - (y + 1/2)/h`: perspective rays go from `location` along
/// `direction + s * right + t * up`, orthographic ones from `location + s * right + t * up` along `direction`.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// How rays are made.
    pub projection: Projection,
    /// The eye, or the picture's middle.
    pub location: DVec3,
    /// Towards the picture's middle; its length against those of `right` and `up` is the opening.
    pub direction: DVec3,
    /// Across the whole picture, left to right.
    pub right: DVec3,
    /// Across the whole picture, bottom to top.
    pub up: DVec3,
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            projection: Projection::Perspective,
            location: DVec3::ZERO,
            direction: DVec3::Z,
            right: DVec3::X * 1.33,
            up: DVec3::Y,
        }
    }
}
