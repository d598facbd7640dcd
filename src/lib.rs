//! octray renders POV-Ray scenes, eight rays at a time, and measures what each fast path costs in accuracy.
//!
//! The rooms, in a newcomer's reading order: text becomes tokens in [`lang`], values in [`eval`] and a plain
//! description in [`scene`]; [`reference`](mod@reference) traces that description in the textbook's way, one f64 ray at a time; the
//! packet engine compiles it to columns and traces it eight rays at a time; both fill a [`film`]. [`render`](mod@render)
//! ties them, [`image_io`] turns pictures into files' bytes and back, [`file_io`] reads and writes those, [`compare`](mod@compare) says how far two of them are apart. [`random`](mod@random) writes scenes for them to differ on.
#![forbid(unsafe_code)]

// What pest's derive names where pest goes without `std`.
extern crate alloc;

pub mod bvh;
pub mod compare;
pub mod compile;
pub mod csg;
pub mod eval;
pub mod file_io;
pub mod film;
pub mod image_io;
pub mod kernel;
pub mod lane;
pub mod lang;
pub(crate) mod parallel;
mod precision;
pub mod random;
pub mod ray_io;
pub mod ray_set;
pub mod reference;
pub mod render;
pub mod scene;
pub mod texture;
pub mod transfer;
pub mod wave;
pub mod workbench;
