//! What is about the objects: `fog`, `sky_sphere`, `rainbow`, `media` (manual sections 3.4.2 and 3.4.8.3). All read; nothing
//! of it rendered.

use super::noise::Octaves;
use super::{Color, ColorMap, Pigment, Placement, Rgb};
use glam::DVec3;

/// The air of a scene.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Atmosphere {
    /// In order of declaration.
    pub fogs: Vec<Fog>,
    /// In order of declaration.
    pub rainbows: Vec<Rainbow>,
    /// The last one that was given.
    pub sky_sphere: Option<SkySphere>,
    /// In what is in no object.
    pub media: Vec<Media>,
}

/// Haze of one colour.
#[derive(Debug, Clone, PartialEq)]
pub struct Fog {
    /// Where 1/e of what is behind is still seen; 0 is no fog.
    pub distance: f64,
    /// `transmit` is the least that is seen through it, `filter` how far what is seen takes its colour.
    pub color: Color,
    /// If it lies on the ground.
    pub ground: Option<GroundFog>,
    /// Upwards, unit length.
    pub up: DVec3,
    /// How far it moves the points between which density is asked.
    pub turbulence: DVec3,
    /// How much of that counts.
    pub turbulence_depth: f64,
    /// Of what noise.
    pub octaves: Octaves,
}

/// Fog that is full below a height and thins out above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroundFog {
    /// Full below.
    pub offset: f64,
    /// A quarter of it is left at this height above `offset`.
    pub altitude: f64,
}

/// What rays see that hit nothing.
#[derive(Debug, Clone, PartialEq)]
pub struct SkySphere {
    /// Asked at the ray's direction; the last one is on top.
    pub pigments: Vec<Pigment>,
    /// Multiplies their light.
    pub emission: Rgb,
    /// Of the sphere, after the pigments' own.
    pub transform: Placement,
}

/// A band of colours about a direction.
#[derive(Debug, Clone, PartialEq)]
pub struct Rainbow {
    /// Of the light that makes it, unit length.
    pub direction: DVec3,
    /// Upwards, unit length.
    pub up: DVec3,
    /// Between a ray and `direction` in the middle of the band.
    pub angle_deg: f64,
    /// Of the band.
    pub width_deg: f64,
    /// As [`Fog::distance`].
    pub distance: f64,
    /// Random share of the place in the band.
    pub jitter: f64,
    /// Of the arc that is seen,
    pub arc_angle_deg: f64,
    /// and of the arc that is seen in full.
    pub falloff_angle_deg: f64,
    /// Inside to outside.
    pub colors: ColorMap,
}

/// Dust and glow in space.
#[derive(Debug, Clone, PartialEq)]
pub struct Media {
    /// 1, 2 or 3: how a ray's way is cut into pieces.
    pub method: u8,
    /// Pieces of the way.
    pub intervals: u32,
    /// In each piece, least and most.
    pub samples: [u32; 2],
    /// Of method 1 and 2: when to stop.
    pub confidence: f64,
    /// See `confidence`.
    pub variance: f64,
    /// Share of samples in lit pieces.
    pub ratio: f64,
    /// Of method 3: depth of subdivision,
    pub aa_level: u32,
    /// and the difference that asks for it.
    pub aa_threshold: f64,
    /// Random share of a sample's place.
    pub jitter: f64,
    /// Light lost per unit of length.
    pub absorption: Rgb,
    /// Light of its own per unit of length.
    pub emission: Rgb,
    /// Light from lamps that turns to the eye.
    pub scattering: Option<Scattering>,
    /// Multiplied with each other; full everywhere if empty.
    pub densities: Vec<Pigment>,
    /// Of the densities, after their own.
    pub transform: Placement,
}

/// How media turn light aside.
#[derive(Debug, Clone, PartialEq)]
pub struct Scattering {
    /// 1 isotropic, 2 and 3 Mie, 4 Rayleigh, 5 Henyey and Greenstein.
    pub kind: u8,
    /// Per unit of length.
    pub color: Rgb,
    /// Of kind 5: 0 is isotropic, above 0 forwards.
    pub eccentricity: f64,
    /// Share of the scattered light that is lost to the ray.
    pub extinction: f64,
}

impl Default for Fog {
    fn default() -> Self {
        Self {
            distance: 0.0,
            color: Color::default(),
            ground: None,
            up: DVec3::Y,
            turbulence: DVec3::ZERO,
            turbulence_depth: 0.5,
            octaves: Octaves::default(),
        }
    }
}

impl Default for SkySphere {
    fn default() -> Self {
        Self { pigments: Vec::new(), emission: Rgb::ONE, transform: Placement::IDENTITY }
    }
}

impl Default for Rainbow {
    fn default() -> Self {
        Self {
            direction: DVec3::ZERO,
            up: DVec3::Y,
            angle_deg: 0.0,
            width_deg: 0.0,
            distance: 1e7,
            jitter: 0.0,
            arc_angle_deg: 180.0,
            falloff_angle_deg: 180.0,
            colors: ColorMap::default(),
        }
    }
}

impl Default for Media {
    fn default() -> Self {
        Self {
            method: 3,
            intervals: 1,
            samples: [10, 10],
            confidence: 0.9,
            variance: 1.0 / 128.0,
            ratio: 0.9,
            aa_level: 4,
            aa_threshold: 0.1,
            jitter: 0.0,
            absorption: Rgb::ZERO,
            emission: Rgb::ZERO,
            scattering: None,
            densities: Vec::new(),
            transform: Placement::IDENTITY,
        }
    }
}
