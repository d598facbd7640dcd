//! How far two pictures are apart: figures, and a strip to look at.
//!
//! Two films of one size in linear light go in, numbers and a third film come out. It knows neither files nor who made
//! the pictures.

mod edges;
mod figures;
mod strip;

pub use edges::{EDGE_CONTRAST, edge_mask};
pub use figures::{Comparison, Difference, WITHIN, Worst, apart, clipped, compare};
pub use strip::{AMPLIFY, strip};

#[cfg(test)]
mod tests;
