//! How a surface answers light (manual section 3.4.6.3).

use super::Rgb;

/// A `finish` with POV-Ray's defaults. The `albedo` forms have been worked into the plain amounts.
#[derive(Debug, Clone, PartialEq)]
pub struct Finish {
    /// Light of its own, times `ambient_light`.
    pub ambient: Rgb,
    /// Light of its own.
    pub emission: Rgb,
    /// Lambert's amount on the lit side.
    pub diffuse: f64,
    /// Lambert's amount for light from behind.
    pub diffuse_back: f64,
    /// Exponent of the diffuse cosine.
    pub brilliance: f64,
    /// Amount of the Phong highlight.
    pub phong: f64,
    /// Its exponent.
    pub phong_size: f64,
    /// Amount of the Blinn highlight.
    pub specular: f64,
    /// One over its exponent.
    pub roughness: f64,
    /// How far highlights take the pigment's colour.
    pub metallic: f64,
    /// Amount of the thin-film interference.
    pub irid: f64,
    /// Thickness of the film.
    pub irid_thickness: f64,
    /// Mirror reflection.
    pub reflection: Reflection,
    /// Transmitted light is lessened by what is reflected.
    pub conserve_energy: bool,
    /// What old scenes say of the interior here; it is in [`super::Interior::ior`] of placed objects.
    pub ior: Option<f64>,
    /// The same of [`super::Interior::caustics`], 45 times that.
    pub caustics: Option<f64>,
    /// Light that goes about below the surface; not rendered.
    pub subsurface: Option<Subsurface>,
}

/// `subsurface { ... }`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Subsurface {
    /// How far light goes, in millimetres.
    pub translucency: Rgb,
    /// 0 is isotropic.
    pub anisotropy: f64,
}

/// The `reflection` of a finish.
#[derive(Debug, Clone, PartialEq)]
pub struct Reflection {
    /// Seen head-on.
    pub min: Rgb,
    /// Seen at a grazing angle.
    pub max: Rgb,
    /// Between the two by Fresnel's law instead of by `falloff`.
    pub fresnel: bool,
    /// Exponent of `1 - cos` between `min` and `max`.
    pub falloff: f64,
    /// What is seen is raised to one over this.
    pub exponent: f64,
    /// How far the reflection takes the pigment's colour.
    pub metallic: f64,
}

impl Default for Finish {
    fn default() -> Self {
        Self {
            ambient: Rgb::splat(0.1),
            emission: Rgb::ZERO,
            diffuse: 0.6,
            diffuse_back: 0.0,
            brilliance: 1.0,
            phong: 0.0,
            phong_size: 40.0,
            specular: 0.0,
            roughness: 0.05,
            metallic: 0.0,
            irid: 0.0,
            irid_thickness: 0.0,
            reflection: Reflection::default(),
            conserve_energy: false,
            ior: None,
            caustics: None,
            subsurface: None,
        }
    }
}

impl Default for Reflection {
    fn default() -> Self {
        Self { min: Rgb::ZERO, max: Rgb::ZERO, fresnel: false, falloff: 1.0, exponent: 1.0, metallic: 0.0 }
    }
}

impl Reflection {
    /// False if no ray need be sent.
    pub fn is_some(&self) -> bool {
        self.min != Rgb::ZERO || self.max != Rgb::ZERO
    }
}
