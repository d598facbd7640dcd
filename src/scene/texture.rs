//! Layers of pigment and finish on a surface, and what is inside it.

use super::{Finish, Media, Normal, Patterned, Pigment, Placement, Rgb, Transform};
use smallvec::{SmallVec, smallvec};
use std::sync::Arc;

/// A `texture`: one layer, or several over each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    /// In order of declaration: the last one is on top. Never empty. (In place, as nearly all have one: scenes have a texture for
    /// each of a million objects.)
    pub layers: SmallVec<[Layer; 1]>,
    /// A pattern of whole textures, which is read but not rendered: the layers stand in for it.
    pub patterned: Option<Arc<Patterned<Texture>>>,
    /// Points are places on the surface, `<u, v, 0>`; not rendered.
    pub uv_mapping: bool,
    /// From the texture's space to the parent space of the object that carries it (see [`super::Object`]).
    pub transform: Placement,
}

/// One layer.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Layer {
    /// Its colour.
    pub pigment: Pigment,
    /// Its answer to light; shared, as most layers have the default one.
    pub finish: Arc<Finish>,
    /// Its bumps; not rendered.
    pub normal: Option<Arc<Normal>>,
}

impl Default for Texture {
    fn default() -> Self {
        Self {
            layers: smallvec![Layer::default()],
            patterned: None,
            uv_mapping: false,
            transform: Placement::IDENTITY,
        }
    }
}

impl Texture {
    /// True if it blocks all light, by POV-Ray's static test: one layer without any transparent colour.
    pub fn is_opaque(&self) -> bool {
        self.layers.iter().any(|layer| layer.pigment.is_opaque())
    }
}

/// An `interior`: what light meets between entering and leaving.
///
/// Which interior a ray is in is decided by identity (`Arc::ptr_eq`, and [`super::Object::own_interiors`]), not by value: two
/// objects of equal glass that touch are two interiors.
#[derive(Debug, Clone, PartialEq)]
pub struct Interior {
    /// Index of refraction; 1 bends nothing.
    pub ior: f64,
    /// Distance over which light fades; 0 is no fading.
    pub fade_distance: f64,
    /// How it fades; 1000 and over is exponential.
    pub fade_power: f64,
    /// What colour it fades to.
    pub fade_color: Rgb,
    /// Strength of the simulated caustics in shadows.
    pub caustics: f64,
    /// How far `ior` is spread over the colours; 1 is not at all. Not rendered.
    pub dispersion: f64,
    /// Colours that dispersion parts light into.
    pub dispersion_samples: u32,
    /// Dust and glow; not rendered.
    pub media: Vec<Media>,
}

impl Default for Interior {
    fn default() -> Self {
        Self {
            ior: 1.0,
            fade_distance: 0.0,
            fade_power: 0.0,
            fade_color: Rgb::ZERO,
            caustics: 0.0,
            dispersion: 1.0,
            dispersion_samples: 7,
            media: Vec::new(),
        }
    }
}

impl Texture {
    /// The texture moved by `next`.
    pub fn transformed(&self, next: &Transform) -> Self {
        let (layers, patterned) = (self.layers.clone(), self.patterned.clone());
        Self { layers, patterned, uv_mapping: self.uv_mapping, transform: self.transform.then(next).into() }
    }

    /// True if transforms leave it alone.
    pub fn is_still(&self) -> bool {
        let still = |layer: &Layer| {
            layer.normal.is_none() && matches!(layer.pigment.kind, super::PigmentKind::Solid(_))
        };
        self.patterned.is_none() && self.layers.iter().all(still)
    }

    /// True if it is rendered the same at every point.
    pub fn is_uniform(&self) -> bool {
        self.layers.iter().all(|layer| layer.pigment.is_uniform())
    }
}
