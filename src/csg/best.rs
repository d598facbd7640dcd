//! The nearest hits so far.

use super::scratch::PartRoots;
use crate::kernel::{Ranks, Rays, SurfaceId, next_to};
use crate::lane::{LANES, Lane, Mask, choose, equal_lanes, f64x8};

/// The nearest hits of eight rays so far.
#[derive(Debug)]
pub struct Best<'a> {
    /// How far they are.
    pub t: f64x8,
    /// Which surfaces they are, or [`NO_SURFACE`](crate::kernel::NO_SURFACE).
    pub surface: [SurfaceId; LANES],
    /// Lanes that have met a part at `t`, or up to `slack` before it.
    pub loose: u8,
    /// See `loose`. Of no meaning where none are.
    pub slack: f64,
    /// What distances are rounded to when they are kept, as a share of themselves.
    pub roundoff: f64,
    /// Surface number of part 0.
    pub first_part: SurfaceId,
    /// Of all surfaces.
    pub ranks: &'a Ranks,
}

impl Best<'_> {
    /// How far before `t` rays may have met what they have.
    #[inline(always)]
    pub(super) fn leeway(&self) -> f64 {
        if self.loose != 0 { self.slack } else { 0.0 }
    }

    /// Puts crossings of part `number`, none of them farther than what stands there, where they are `wanted`: the lanes that
    /// have changed.
    #[inline(always)]
    pub(super) fn take(&mut self, number: u32, at: f64x8, wanted: u8) -> u8 {
        let mut wanted = wanted;
        let mut ties = at.equal(self.t).bits() & wanted;
        while ties != 0 {
            let lane = ties.trailing_zeros() as usize;
            ties &= ties - 1;
            if !self.ranks.prefer(self.first_part + number, self.surface[lane]) {
                wanted &= !(1 << lane);
            }
        }
        if wanted != 0 {
            self.t = Mask::from_bits(wanted).select(at, self.t);
            self.surface = choose(wanted, &[self.first_part + number; LANES], &self.surface);
        }
        wanted
    }

    /// Works out where those of `lanes` that are loose meet their parts, on which they do not start; with room for crossings.
    #[cold]
    #[inline(never)]
    pub fn settle(&mut self, lanes: u8, rays: &Rays<f64x8>, source: &impl PartRoots, room: &mut Vec<f64x8>) {
        let mut waiting = lanes & self.loose;
        self.loose &= !waiting;
        while waiting != 0 {
            let surface = self.surface[waiting.trailing_zeros() as usize & (LANES - 1)];
            let these = equal_lanes(&self.surface, surface) & waiting;
            waiting &= !these;
            room.clear();
            source.crossings(surface - self.first_part, rays, these, room);
            self.t = Mask::from_bits(these).select(next_to(room, self.t), self.t);
        }
    }
}
