//! Patterns with everything that can be said of them: over pigments, normals, textures and densities (manual section 3.4.7).
//!
//! What the renderer knows of this is in [`super::PigmentKind`]; the rest is kept here as it was read.

use super::noise::Octaves;
use super::{BlockPattern, ColorMap, Function, Image, Object, Pattern, Pigment, Transform, Wave, function};
use glam::DVec3;
use std::sync::Arc;

/// A pattern, and the things of kind `T` that it chooses among.
#[derive(Debug, Clone, PartialEq)]
pub struct Patterned<T> {
    /// A number, or a choice, at every point.
    pub pattern: AnyPattern,
    /// How the number is shaped before look-up.
    pub wave: Wave,
    /// The number is multiplied by this (default 1),
    pub frequency: f64,
    /// and this is added (default 0).
    pub phase: f64,
    /// How far `turbulence` moves points along each axis, before any warp.
    pub turbulence: DVec3,
    /// Of what noise.
    pub octaves: Octaves,
    /// In the order they were said: a point meets the last one first.
    pub warps: Vec<Warp>,
    /// 1, 2 or 3; 0 is the scene's.
    pub noise_generator: u8,
    /// Points are places on the surface, `<u, v, 0>`.
    pub uv_mapping: bool,
    /// What it chooses among.
    pub map: Map<T>,
}

/// What a pattern chooses among.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Map<T> {
    /// None was given: the pattern's own colours, or from black to white.
    #[default]
    Own,
    /// Colours at rising places (pigments, densities).
    Colors(ColorMap),
    /// `[place, height, slope]` at rising places (normals).
    Slopes(Vec<[f64; 3]>),
    /// Things at rising places; for `average` the numbers are weights.
    Entries(Vec<(f64, T)>),
    /// One thing for each kind of block, or each index of an image.
    List(Vec<T>),
}

/// Any of POV-Ray's patterns.
#[derive(Debug, Clone, PartialEq)]
pub enum AnyPattern {
    /// Chooses among a list.
    Blocks(BlockPattern),
    /// A number.
    Number(Pattern),
    /// One that is read but not rendered.
    Other(OtherPattern),
}

/// Patterns that are read but not rendered.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "the names are the manual's")]
pub enum OtherPattern {
    /// The angle between ray and surface.
    Aoi,
    /// No pattern: all entries of the map at once, by weight.
    Average,
    /// A number for each unit cube.
    Cells,
    /// Distances to scattered points.
    Crackle { form: DVec3, metric: f64, offset: f64, solid: bool },
    /// A choice of six by direction.
    Cubic,
    /// Numbers in a box, from a file.
    DensityFile { name: String, interpolate: u8 },
    /// Flat faces, of this size in space or (`coords`) by direction.
    Facets { size: f64, coords: Option<f64> },
    /// Steps of an iteration.
    Fractal(Fractal),
    /// A function that asks pigments.
    Function(Arc<Function>),
    /// A pigment, pattern, spline or transform as a function.
    Callee(Box<function::Callee>),
    /// Brightness, or colours, of an image.
    Image(Box<Image>),
    /// Inside or outside.
    Object(Option<Arc<Object>>),
    /// Tiles made of polygons.
    Pavement { sides: u8, tiles: u8, pattern: u8, exterior: u8, interior: u8, form: u8 },
    /// Brightness of a pigment.
    Pigment(Box<Pigment>),
    /// Cushions: the slopes at the edges and in the middle.
    Quilted([f64; 2]),
    /// Circles on water, seen from above.
    Ripples,
    /// Steepness against a direction, in a range; with height along another one.
    Slope { direction: DVec3, range: [f64; 2], altitude: Option<(DVec3, [f64; 2])> },
    /// Two sets of arms winding about the z axis.
    Spiral2(f64),
    /// Squares of the xz plane, four of them in turn.
    Square,
    /// Tilings of the plane by number, 1 to 27.
    Tiling(u8),
    /// Distance from a ring.
    Toroidal,
    /// Triangles of the xz plane, six of them in turn.
    Triangular,
    /// Waves on water.
    Waves,
}

/// The sets of Mandelbrot and Julia.
#[derive(Debug, Clone, PartialEq)]
pub struct Fractal {
    /// The constant of a Julia set; else Mandelbrot's.
    pub julia: Option<[f64; 2]>,
    /// 0, or which of the two magnet formulas.
    pub magnet: u8,
    /// Of the iteration, from 2.
    pub exponent: u8,
    /// Most steps.
    pub iterations: u32,
    /// How points outside are coloured, 0 to 8, and a factor.
    pub exterior: (u8, f64),
    /// How points inside are coloured, 0 to 6, and a factor.
    pub interior: (u8, f64),
}

/// A change of the points at which a pattern is asked.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "the names are the manual's")]
pub enum Warp {
    /// The transforms that were said between two warps.
    Transform(Box<Transform>),
    /// Noise.
    Turbulence { amount: DVec3, octaves: Octaves },
    /// Points near the centre are drawn to it, or pushed (`inverse`); again and again with a distance of `repeat`.
    BlackHole {
        center: DVec3,
        radius: f64,
        falloff: f64,
        strength: f64,
        repeat: Option<DVec3>,
        turbulence: DVec3,
        inverse: bool,
    },
    /// The same again along an axis, each moved by `offset` and mirrored where `flip` is not 0.
    Repeat { width: DVec3, offset: DVec3, flip: DVec3 },
    /// A plane pattern laid about a body.
    Wrap { about: WrapKind, orientation: DVec3, distance_exponent: f64, major_radius: f64, distance: f64 },
    /// A plane pattern on each face of a cube.
    Cubic,
}

/// What a plane pattern is wrapped about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names are the manual's")]
pub enum WrapKind {
    Cylinder,
    Sphere,
    Torus,
    Plane,
}

impl<T> Patterned<T> {
    /// A pattern of which nothing more has been said.
    pub fn new(pattern: AnyPattern) -> Self {
        Self {
            pattern,
            wave: Wave::Ramp,
            frequency: 1.0,
            phase: 0.0,
            turbulence: DVec3::ZERO,
            octaves: Octaves::default(),
            warps: Vec::new(),
            noise_generator: 0,
            uv_mapping: false,
            map: Map::Own,
        }
    }
}

impl<T> Map<T> {
    /// The things it holds, apart from colours and slopes.
    pub fn items(&self) -> impl Iterator<Item = &T> {
        let (entries, list) = match self {
            Map::Entries(entries) => (entries.as_slice(), [].as_slice()),
            Map::List(list) => ([].as_slice(), list.as_slice()),
            _ => ([].as_slice(), [].as_slice()),
        };
        entries.iter().map(|(_, item)| item).chain(list)
    }
}
