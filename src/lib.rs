//! octray renders POV-Ray scenes, eight rays at a time, and measures what each fast path costs in accuracy.
//!
//! The rooms, in a newcomer's reading order: text becomes tokens in [`lang`], values in [`eval`] and a plain
//! description in [`scene`]; [`reference`](mod@reference) traces that description in the textbook's way, one f64 ray at a time; the
//! packet engine compiles it to columns and traces it eight rays at a time; both fill a [`film`].
#![forbid(unsafe_code)]

pub mod eval;
pub mod film;
pub mod kernel;
pub mod lane;
pub mod lang;
pub mod scene;
