//! The camera, after its keywords have been worked off (`look_at`, `angle`, `sky`, transforms).

use super::{Normal, Object, Pigment};
use glam::DVec3;
use std::sync::Arc;

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
    /// What is read but not rendered.
    pub lens: Option<Box<Lens>>,
}

impl Camera {
    /// True if direction, right and up are at right angles, as those of a camera with `look_at` always are.
    pub fn is_square(&self) -> bool {
        /// Sine of the least angle that is seen; rounding makes far smaller ones.
        const SKEWED: f64 = 1e-6;
        let square = |a: DVec3, b: DVec3| a.dot(b).abs() <= SKEWED * a.length() * b.length();
        square(self.direction, self.right) && square(self.right, self.up) && square(self.up, self.direction)
    }
}

/// What is said of a camera and not rendered.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Lens {
    /// Another way to make rays.
    pub kind: Option<LensKind>,
    /// `angle`, one or two, degrees.
    pub angles_deg: Vec<f64>,
    /// Out of focus.
    pub blur: Blur,
    /// Bends its rays.
    pub normal: Option<Box<Normal>>,
}

/// Kinds of camera that are not rendered (manual section 3.4.3.2).
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "the names are the manual's")]
pub enum LensKind {
    Fisheye,
    UltraWideAngle,
    Omnimax,
    Panoramic,
    Spherical,
    /// 1 and 2: the axis stands or lies, the eye is a point; 3 and 4: the same with the eye on the axis.
    Cylinder(u8),
    /// Rays start from the faces of meshes.
    Mesh {
        rays: u32,
        distribution: u8,
        max_distance: f64,
        meshes: Vec<Arc<Object>>,
        smooth: bool,
    },
}

/// Focal blur.
#[derive(Debug, Clone, PartialEq)]
pub struct Blur {
    /// 0 is none.
    pub aperture: f64,
    /// Rays a pixel, at least and at most; 0 is not given.
    pub samples: [f64; 2],
    /// What is sharp.
    pub focal_point: DVec3,
    /// Rays are sent until the mean is this sure,
    pub confidence: f64,
    /// within this.
    pub variance: f64,
    /// The shape of the aperture.
    pub bokeh: Option<Box<Pigment>>,
}

impl Default for Blur {
    fn default() -> Self {
        Self {
            aperture: 0.0,
            samples: [0.0; 2],
            focal_point: DVec3::Z,
            confidence: 0.9,
            variance: 0.0001,
            bokeh: None,
        }
    }
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            projection: Projection::Perspective,
            location: DVec3::ZERO,
            direction: DVec3::Z,
            right: DVec3::X * 1.33,
            up: DVec3::Y,
            lens: None,
        }
    }
}
