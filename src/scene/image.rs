//! Pictures in a scene: `image_map`, `bump_map`, `material_map`, `image_pattern` (manual section 3.4.7.11). The files are
//! not opened.

use super::{Pigment, function};

/// A picture, and how it lies in space.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Where its dots come from.
    pub source: ImageSource,
    /// How it is wrapped: 0 plane, 1 sphere, 2 cylinder, 5 torus, 7 angular.
    pub map_type: u8,
    /// Not repeated.
    pub once: bool,
    /// Between dots: 0 nearest, 2 bilinear, 3 bicubic, 4 normalized.
    pub interpolate: u8,
    /// Its index is meant, not its colour.
    pub use_index: bool,
    /// Its alpha channel is meant, or left aside.
    pub use_alpha: bool,
    /// Filter and transmit of all its colours.
    pub all: [f64; 2],
    /// Those of single colours: `(index, filter, transmit)`.
    pub by_index: Vec<(u32, f64, f64)>,
}

/// Where an image's dots come from.
#[derive(Debug, Clone, PartialEq)]
pub enum ImageSource {
    /// A file.
    File {
        /// As it was written.
        name: String,
        /// `png`, `jpeg` and the like; by the name's ending if not given.
        kind: Option<&'static str>,
        /// Its dots are decoded by this power.
        gamma: Option<f64>,
        /// Its colours have been multiplied by their alpha.
        premultiplied: Option<bool>,
    },
    /// Taken from a function or a pigment over the unit square.
    Computed {
        /// Dots in a row and in a column.
        size: [u32; 2],
        /// What is asked.
        from: Computed,
    },
}

/// What a computed image asks.
#[derive(Debug, Clone, PartialEq)]
pub enum Computed {
    /// A function.
    Callee(Box<function::Callee>),
    /// A pigment.
    Pigment(Box<Pigment>),
}

impl Image {
    /// One of which nothing has been said.
    pub fn new(source: ImageSource) -> Self {
        Self {
            source,
            map_type: 0,
            once: false,
            interpolate: 0,
            use_index: false,
            use_alpha: true,
            all: [0.0; 2],
            by_index: Vec::new(),
        }
    }
}
