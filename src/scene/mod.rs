//! The scene in POV-Ray's words: plain f64 values, no lanes, no text.
//!
//! The evaluator fills it; the reference tracer and the compiler of the packet engine read it. It knows neither how
//! it was written nor how it will be traced. Space is POV-Ray's: left-handed, +x right, +y up, +z into the picture.
//! Lengths are scene units, colours linear RGB, angles radians.

mod atmosphere;
mod camera;
mod color;
mod double;
mod finish;
pub mod function;
mod image;
pub mod internal;
mod light;
mod mesh;
pub mod noise;
mod normal;
pub mod number;
mod object;
mod other_shape;
pub mod pattern;
mod patterned;
mod pigment;
mod polynomial;
mod settings;
mod spline;
mod texture;
mod transform;

pub use atmosphere::{Atmosphere, Fog, GroundFog, Media, Rainbow, Scattering, SkySphere};
pub use camera::{Blur, Camera, Lens, LensKind, Projection};
pub use color::{Color, Opacity, Rgb};
pub use finish::{Finish, Reflection, Subsurface};
pub use function::Function;
pub use image::{Computed, Image, ImageSource};
pub use light::{AreaLight, Fade, Light, LightKind, LightMore};
pub use mesh::{Mesh, MeshTriangle};
use noise::Generator;
pub use normal::Normal;
pub use object::{CsgOp, Flags, More, Object, Shape};
pub use other_shape::{BlobPart, Curve, Font, Isosurface, JuliaFractal, OtherKind, OtherShape, Parametric};
pub use pattern::Pattern;
pub use patterned::{AnyPattern, Fractal, Map, OtherPattern, Patterned, Warp, WrapKind};
pub use pigment::{BlockPattern, Blocks, ColorMap, Mapped, Pigment, PigmentKind, Wave};
pub use polynomial::Polynomial;
pub use settings::{PhotonUse, Photons, Radiosity};
pub use spline::{Spline, SplineKind};
pub use texture::{Interior, Layer, Texture};
pub use transform::{ENDLESS, Placement, Transform};

use std::sync::Arc;

/// Everything a renderer needs to know.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The last camera of the file, or POV-Ray's default.
    pub camera: Camera,
    /// Scene-wide settings.
    pub globals: Globals,
    /// What a ray sees that hits nothing. `rgb` is the light as it is seen: the evaluator has dimmed the colour given by
    /// `1 - transmit`, as POV-Ray does. `transmit` counts for alpha alone, and is 1 for a scene that gives no background.
    pub background: Color,
    /// What is about the objects.
    pub atmosphere: Atmosphere,
    /// In order of declaration.
    pub lights: Vec<Light>,
    /// In order of declaration: on exact ties the earlier one is seen.
    pub objects: Vec<Arc<Object>>,
}

impl Default for Scene {
    /// An empty scene before a transparent, black background.
    fn default() -> Self {
        Self {
            camera: Camera::default(),
            globals: Globals::default(),
            background: Color { transmit: 1.0, ..Color::default() },
            atmosphere: Atmosphere::default(),
            lights: Vec::new(),
            objects: Vec::new(),
        }
    }
}

/// `global_settings` (manual section 3.4.1), with POV-Ray 3.7's defaults.
#[derive(Debug, Clone, PartialEq)]
pub struct Globals {
    /// Levels of recursion, the camera ray counted: 1 sees no reflections.
    pub max_trace_level: u32,
    /// Rays whose share of the pixel is below this are not traced.
    pub adc_bailout: f64,
    /// Multiplies every `ambient`.
    pub ambient_light: Rgb,
    /// Wavelengths of the `irid` interference, red, green and blue, in micrometres.
    pub irid_wavelength: Rgb,
    /// Gamma of the working space; 1 is linear light.
    pub assumed_gamma: Gamma,
    /// What a `filter` leaves of its surface's own light: by the version that holds at the end of the scene.
    pub opacity: Opacity,
    /// Of noise: as said, or else by the version that holds at the end of the scene.
    pub noise_generator: Generator,
    /// Light between surfaces.
    pub radiosity: Option<Box<Radiosity>>,
    /// Light from lamps that is kept where it falls.
    pub photons: Option<Box<Photons>>,
}

/// The space in which the scene's colours are given and light is summed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Gamma {
    /// Light is summed in a space whose values are decoded to linear light by this power; 1 is linear.
    Power(f64),
    /// The same with the sRGB transfer curve.
    Srgb,
    /// No correction at all: values are written to 8-bit files as they are (scenes before version 3.7 that do not
    /// say `assumed_gamma`).
    Off,
}

impl Default for Globals {
    fn default() -> Self {
        Self {
            max_trace_level: 5,
            adc_bailout: 1.0 / 255.0,
            ambient_light: Rgb::ONE,
            irid_wavelength: Rgb::new(0.70, 0.52, 0.48),
            assumed_gamma: Gamma::Power(1.0),
            opacity: Opacity::Share,
            noise_generator: Generator::default(),
            radiosity: None,
            photons: None,
        }
    }
}
