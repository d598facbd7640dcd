//! Eight rays on their way to what they hit.

use super::queue::Lines;
use crate::compile::{NO_SURFACE, SurfaceId};
use crate::kernel::Rays;
use crate::lane::{LANES, Lane, Mask, Scalar};

/// Packets that walk the tree together.
pub const GROUP: usize = 8;

/// Eight rays and what is known of them so far.
#[derive(Debug, Clone, Copy)]
pub struct Query<L> {
    /// The rays.
    pub rays: Rays<L>,
    /// The surfaces they started on, or [`NO_SURFACE`].
    pub left: [SurfaceId; LANES],
    /// The parts of them.
    pub part: [u8; LANES],
    /// Hits at or before this do not count: the rounding of the start.
    pub t_min: L,
    /// The nearest hit so far, or how far to look.
    pub t: L,
    /// What was hit, or [`NO_SURFACE`].
    pub surface: [SurfaceId; LANES],
    /// Lanes that hold a ray.
    pub lanes: u8,
    /// Some of them start on a surface.
    starts: bool,
}

/// The start of a ray that left a surface is off by a few roundings of its largest coordinate; what lies within that
/// of the start is the start. (The surface left itself is not missed by this but by [`Left`].)
const START_ROUNDINGS: f64 = 32.0;

impl<L: Lane> Query<L> {
    /// Rays up to distance `t_max`.
    pub fn new(lines: &Lines<L>, t_max: L, lanes: u8) -> Self {
        let Lines { rays, left, part } = *lines;
        let reach = rays.origin.abs().max_element() * L::lit(START_ROUNDINGS * L::Scalar::UNIT_ROUNDOFF);
        let mut free = 0;
        for (k, left) in left.iter().enumerate() {
            free |= u8::from(*left == NO_SURFACE) << k;
        }
        let t_min = Mask::from_bits(free).select(L::zero(), reach);
        Self { rays, left, part, t_min, t: t_max, surface: [NO_SURFACE; LANES], lanes, starts: free != !0 }
    }

    /// True if a ray starts on one of `len` surfaces from `first` on.
    #[inline(always)]
    pub fn starts_within(&self, first: SurfaceId, len: u32) -> bool {
        let here = |left: &SurfaceId| left.wrapping_sub(first) < len;
        self.starts && self.left.iter().fold(false, |any, left| any | here(left))
    }

    /// Lanes that start on `surface`.
    #[inline(always)]
    pub fn lanes_on(&self, surface: SurfaceId) -> u8 {
        let mut on = 0;
        for (k, left) in self.left.iter().enumerate() {
            on |= u8::from(*left == surface) << k;
        }
        on
    }

    /// Lanes that have hit something.
    pub fn hits(&self) -> u8 {
        let mut bits = 0;
        for (k, surface) in self.surface.iter().enumerate() {
            bits |= u8::from(*surface != NO_SURFACE) << k;
        }
        bits & self.lanes
    }
}
