//! Colour at hit points, eight at a time. Knows textures and points; no rays, no traversal.
//!
//! Textures that differ only in plain colours share one [`Program`], so that a city of a thousand colours still fills its
//! lanes: the colours are read per lane.

mod function;
mod noise;
mod pattern;
mod program;
mod ramp;
mod table;

pub use function::values as function_values;
pub use pattern::PatternProgram;
pub use program::{Colors, Highlights, LayerProgram, PigmentProgram, Program};
use ramp::Ramp;
pub use table::{TextureBuilder, TextureRow, TextureTable};
