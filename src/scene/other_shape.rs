//! Shapes that are read but not rendered (manual sections 3.4.5.1 to 3.4.5.4), in the object's own space.

use super::{ImageSource, Light, Object, Placement, Texture, function};
use glam::DVec3;
use std::sync::Arc;

/// A shape that is read but not rendered.
#[derive(Debug, Clone, PartialEq)]
pub struct OtherShape {
    /// What it is.
    pub kind: OtherKind,
    /// Lowest and highest corner of a box that holds it; an estimate for text and for curves.
    pub extent: (DVec3, DVec3),
    /// Without its ends, or not closed where its container cuts it.
    pub open: bool,
}

/// Which shape.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "the names are the manual's")]
pub enum OtherKind {
    /// Sixteen points of a surface of third degree each way.
    BicubicPatch {
        kind: u8,
        flatness: f64,
        steps: [u32; 2],
        uv: Option<[[f64; 2]; 4]>,
        points: Box<[DVec3; 16]>,
    },
    /// Where the strengths of all parts add up to `threshold`.
    Blob { threshold: f64, parts: Vec<BlobPart> },
    /// Heights of an image over the unit square, from `water_level` on.
    HeightField { image: Box<ImageSource>, water_level: f64, smooth: bool },
    /// Where a function is `threshold`.
    Isosurface(Box<Isosurface>),
    /// A slice of a set of four dimensions.
    JuliaFractal(Box<JuliaFractal>),
    /// A curve turned about the y axis.
    Lathe { curve: Curve, points: Vec<[f64; 2]> },
    /// Objects, and lights that shine on nothing else.
    LightGroup { objects: Vec<Arc<Object>>, lights: Vec<Light>, global_lights: bool },
    /// Two spheres, the upper one at the height of the lower one's radius, with a smooth skin about both.
    Ovus { bottom: f64, top: f64 },
    /// Points of three functions of u and v.
    Parametric(Box<Parametric>),
    /// A plane outline drawn out between two heights, straight or to a point.
    Prism { curve: Curve, conic: bool, heights: [f64; 2], points: Vec<[f64; 2]> },
    /// `[radius, height]` of a surface of revolution; the first and the last point give the slope.
    Sor(Vec<[f64; 2]>),
    /// Spheres along a curve.
    SphereSweep { curve: Curve, points: Vec<(DVec3, f64)>, tolerance: f64 },
    /// East-west and north-south exponents.
    Superellipsoid([f64; 2]),
    /// Letters, each moved by `offset` against the one before.
    Text { font: Font, text: String, thickness: f64, offset: DVec3 },
}

/// A part of a blob.
#[derive(Debug, Clone, PartialEq)]
pub struct BlobPart {
    /// The centre, or the ends of the axis.
    pub ends: Vec<DVec3>,
    /// Its strength is 0 from there on.
    pub radius: f64,
    /// In the middle.
    pub strength: f64,
    /// From its own space to the blob's.
    pub transform: Placement,
    /// Blended with those of the others by strength.
    pub texture: Option<Arc<Texture>>,
}

/// What an `isosurface` says.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "the names are the manual's")]
pub struct Isosurface {
    pub function: function::Callee,
    /// A box or a sphere.
    pub container: Arc<Object>,
    pub threshold: f64,
    pub accuracy: f64,
    pub max_gradient: f64,
    /// Of a gradient that adapts: the least, the factor of growth and of decay.
    pub evaluate: Option<[f64; 3]>,
    /// Crossings looked for in composites; `None` is all.
    pub max_trace: Option<f64>,
}

/// What a `parametric` says.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "the names are the manual's")]
pub struct Parametric {
    pub functions: [function::Callee; 3],
    /// Lowest and highest `[u, v]`.
    pub bounds: [[f64; 2]; 2],
    /// A box or a sphere.
    pub container: Arc<Object>,
    pub accuracy: f64,
    pub max_gradient: f64,
    /// How often u and v are halved beforehand, and for which of x, y, z.
    pub precompute: Option<(f64, [bool; 3])>,
}

/// What a `julia_fractal` says.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "the names are the manual's")]
pub struct JuliaFractal {
    pub parameter: [f64; 4],
    pub hypercomplex: bool,
    /// The iterated function's word,
    pub function: &'static str,
    /// and its exponent if that is a power.
    pub exponent: [f64; 2],
    pub max_iteration: u32,
    pub precision: f64,
    /// The plane of the slice: its normal and distance.
    pub slice: ([f64; 4], f64),
}

/// How a curve goes through its points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names are the manual's")]
pub enum Curve {
    Linear,
    Quadratic,
    Cubic,
    Bezier,
    BSpline,
}

/// Where letters come from.
#[derive(Debug, Clone, PartialEq)]
pub enum Font {
    /// A TrueType file.
    File(String),
    /// One of POV-Ray's own, by number.
    Internal(u32),
}
