//! Lights (manual section 3.4.4).

use super::Rgb;
use glam::DVec3;

/// A `light_source`.
#[derive(Debug, Clone, PartialEq)]
pub struct Light {
    /// Its place.
    pub location: DVec3,
    /// Its light; may be over 1.
    pub color: Rgb,
    /// The shape of its beam.
    pub kind: LightKind,
    /// Where spotlights, cylinders and parallel lights look; `<0, 0, 1>` if not given.
    pub point_at: DVec3,
    /// All rays run along the axis from `location` to `point_at`.
    pub parallel: bool,
    /// No shadows and no highlights: a fill light.
    pub shadowless: bool,
    /// How it falls off with distance, if it does.
    pub fade: Option<Fade>,
}

/// The beam of a light.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum LightKind {
    /// Shines everywhere.
    #[default]
    Point,
    /// A cone; `radius` and `falloff` are angles from the axis in radians: full light inside the one, none outside the other.
    Spot {
        /// Full light inside (default 30 degrees).
        radius: f64,
        /// No light outside (default 45 degrees).
        falloff: f64,
        /// Exponent of the cosine from the axis (default 0).
        tightness: f64,
    },
    /// A beam; `radius` and `falloff` are distances from the axis.
    Cylinder {
        /// Full light inside (default 0.75).
        radius: f64,
        /// No light outside (default 1).
        falloff: f64,
        /// Exponent of the share of the way to the rim (default 0).
        tightness: f64,
    },
}

/// Light is multiplied by `2 / (1 + (d / distance)^power)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fade {
    /// Where the factor is 1.
    pub distance: f64,
    /// 1 for a line, 2 for a point in the limit.
    pub power: f64,
}
