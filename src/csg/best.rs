//! The nearest hits so far.

use crate::kernel::{Ranks, SurfaceId};
use crate::lane::{LANES, Lane, Mask, choose, f64x8};

/// The nearest hits of eight rays so far.
#[derive(Debug)]
pub struct Best<'a> {
    /// How far they are.
    pub t: f64x8,
    /// Which surfaces they are, or [`NO_SURFACE`](crate::kernel::NO_SURFACE).
    pub surface: [SurfaceId; LANES],
    /// Surface number of part 0.
    pub first_part: SurfaceId,
    /// Of all surfaces.
    pub ranks: &'a Ranks,
}

impl Best<'_> {
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
}
