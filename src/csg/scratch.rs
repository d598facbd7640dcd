//! What the ways of deciding a composite ask of its parts, and what they keep between calls.

use super::bracket::Bracket;
use super::cull::{NOT_NEAR, Near};
use super::plan::MOST_PARTS;
use crate::kernel::{Looking, Rays};
use crate::lane::f64x8;
use std::ops::Range;

/// What parts do along eight rays.
pub trait PartRoots {
    /// Surface crossings and boundary crossings (both into the list given, surface first; no boundary crossings: the same),
    /// how many are surface, and the lanes that are inside at minus infinity.
    fn roots(&self, part: u32, rays: &Rays<f64x8>, out: &mut Vec<f64x8>) -> (usize, u8);
    /// Where inside and outside change between two distances, and perhaps elsewhere: of a part whose surface is its whole boundary.
    /// And the lanes that are inside before all of this.
    fn between(&self, part: u32, rays: &Rays<f64x8>, looking: &Looking<f64x8>, out: &mut Vec<f64x8>) -> u8;
    /// The surface crossings only, those of `lanes` at least.
    fn crossings(&self, part: u32, rays: &Rays<f64x8>, lanes: u8, out: &mut Vec<f64x8>);
    /// Asks the memory for a part that will soon be asked.
    fn prefetch(&self, part: u32);
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
    /// By part of the composite: its place in `near`, or [`NOT_NEAR`].
    pub(super) places: Vec<u32>,
    /// The composite's first part.
    pub(super) first_part: u32,
    /// Places in `near`, with where the first of the rays comes to them.
    pub(super) order: Vec<(f32, u32)>,
    /// What is left of long lists of nodes.
    pub(super) within_reach: WithinReach,
    /// What is known of parts in single precision. (Made when it is first asked for: it is large, and most scenes have no composites.)
    pub(super) sketch: Option<Sketch>,
}

impl Scratch {
    /// Room for crossings, until something is asked of a composite.
    pub fn room(&mut self) -> &mut Vec<f64x8> {
        &mut self.crossings
    }

    /// No part is near any more. (Place by place: a mesh may have a hundred thousand parts, of which a ray meets four.)
    pub(super) fn forget_near(&mut self) {
        for near in self.near.drain(..) {
            self.places[(near.number - self.first_part) as usize] = NOT_NEAR;
        }
    }
}

/// Of lists of nodes, those that the rays may be in.
#[derive(Debug, Default)]
pub(super) struct WithinReach {
    pub(super) nodes: Vec<u32>,
    /// Of which lists that is known, and where their nodes stand.
    pub(super) known: Vec<(Range<u32>, Range<usize>)>,
}

impl WithinReach {
    /// Forgets all.
    pub(super) fn clear(&mut self) {
        self.nodes.clear();
        self.known.clear();
    }
}

/// Brackets of a composite's parts along rays; kept between calls so that nothing is allocated.
#[derive(Debug)]
pub(super) struct Sketch {
    /// By part.
    pub(super) brackets: Box<[Bracket; MOST_PARTS]>,
    /// Crossings of parts that had to be asked,
    pub(super) crossings: Vec<f64x8>,
    /// and whose they are, along which packet's rays.
    pub(super) asked: Vec<((usize, u32), Range<usize>)>,
    /// Crossings where something else has been met before.
    pub(super) loose: Vec<f64x8>,
    /// What are surfaces, if all are asked for: packets, parts, distances and lanes.
    pub(super) surfaces: Vec<(usize, u32, f64x8, u8)>,
}

impl Default for Sketch {
    fn default() -> Self {
        let brackets = Box::new([Bracket::default(); MOST_PARTS]);
        Self { brackets, crossings: Vec::new(), asked: Vec::new(), loose: Vec::new(), surfaces: Vec::new() }
    }
}
