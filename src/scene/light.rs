//! Lights (manual section 3.4.4).

use super::{Object, PhotonUse, Rgb, Transform};
use glam::DVec3;
use std::sync::Arc;

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
    /// What is read but not rendered.
    pub more: Option<Box<LightMore>>,
}

impl Light {
    /// Moves it by `transform`.
    pub fn move_by(&mut self, transform: &Transform) {
        self.location = transform.point(self.location);
        self.point_at = transform.point(self.point_at);
        if let Some(area) = self.more.as_mut().and_then(|more| more.area.as_mut()) {
            area.axes = area.axes.map(|axis| transform.vector(axis));
        }
    }
}

/// What is said of a light and not rendered.
#[derive(Debug, Clone, PartialEq)]
pub struct LightMore {
    /// A grid of lights in place of one.
    pub area: Option<AreaLight>,
    /// It shines only through this.
    pub projected_through: Option<Arc<Object>>,
    /// Media are lit by it.
    pub media_interaction: bool,
    /// Media dim it.
    pub media_attenuation: bool,
    /// Its photons.
    pub photons: Option<PhotonUse>,
}

/// A grid of lights about the light's place.
#[derive(Debug, Clone, PartialEq)]
pub struct AreaLight {
    /// The sides of the grid.
    pub axes: [DVec3; 2],
    /// Lights along each side.
    pub size: [u32; 2],
    /// The grid is refined this many times at most where its shadow is partial.
    pub adaptive: Option<f64>,
    /// Each light is moved at random within its cell.
    pub jitter: bool,
    /// A disc instead of a rectangle.
    pub circular: bool,
    /// Turned to face each point.
    pub orient: bool,
    /// All its lights shine, not its middle alone.
    pub illumination: bool,
}

impl Default for LightMore {
    fn default() -> Self {
        Self {
            area: None,
            projected_through: None,
            media_interaction: true,
            media_attenuation: false,
            photons: None,
        }
    }
}

impl Default for AreaLight {
    fn default() -> Self {
        Self {
            axes: [DVec3::X, DVec3::Y],
            size: [1, 1],
            adaptive: None,
            jitter: false,
            circular: false,
            orient: false,
            illumination: false,
        }
    }
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
