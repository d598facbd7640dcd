//! What the ways of deciding a composite ask of its parts, and what they keep between calls.

use super::bracket::Bracket;
use super::cull::Near;
use super::plan::MOST_PARTS;
use crate::kernel::Rays;
use crate::lane::f64x8;
use std::ops::Range;

/// What parts do along eight rays.
pub trait PartRoots {
    /// Surface crossings and boundary crossings (both into the list given, surface first; no boundary crossings: the same),
    /// how many are surface, and the lanes that are inside at minus infinity.
    fn roots(&self, part: u32, rays: &Rays<f64x8>, out: &mut Vec<f64x8>) -> (usize, u8);
    /// The surface crossings only.
    fn crossings(&self, part: u32, rays: &Rays<f64x8>, out: &mut Vec<f64x8>);
    /// True if some of the rays start on a part.
    fn starts(&self) -> bool;
    /// The lanes that start on a part.
    fn on(&self, part: u32) -> u8;
}

/// What is known of a composite's parts along eight rays; kept between calls so that nothing is allocated.
#[derive(Debug, Default)]
pub struct Scratch {
    pub(super) crossings: Vec<f64x8>,
    /// Parts that rays may meet.
    pub(super) near: Vec<Near>,
    /// By part of the composite: its place in `near`, or [`NOT_NEAR`](super::cull::NOT_NEAR).
    pub(super) places: Vec<u32>,
    /// Places in `near`, with where the first of the rays comes to them.
    pub(super) order: Vec<(f32, u32)>,
    /// What is known of them in single precision.
    pub(super) sketch: Sketch,
}

/// Brackets of a composite's parts along eight rays; kept between calls so that nothing is allocated.
#[derive(Debug)]
pub(super) struct Sketch {
    /// By part.
    pub(super) brackets: Box<[Bracket; MOST_PARTS]>,
    /// Crossings of parts that had to be asked,
    pub(super) crossings: Vec<f64x8>,
    /// and whose they are.
    pub(super) asked: Vec<(u32, Range<usize>)>,
}

impl Default for Sketch {
    fn default() -> Self {
        let brackets = Box::new([Bracket::default(); MOST_PARTS]);
        Self { brackets, crossings: Vec::new(), asked: Vec::new() }
    }
}
