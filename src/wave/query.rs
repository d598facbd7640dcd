//! Eight rays on their way to what they hit.

use super::queue::Lines;
use crate::compile::{NO_SURFACE, SurfaceId};
use crate::kernel::{Looking, Ranks, Rays};
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3, choose, equal_lanes, lanes_within};
use glam::DVec3;

/// Eight rays and what is known of them so far.
#[derive(Debug, Clone, Copy, Default)]
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
    /// Lanes that have met a composite's part at `t`, or up to `slack` before it: exactly where is worked out where more is asked of them.
    pub loose: u8,
    /// See `loose`; in scene units. Of no meaning where none are.
    pub slack: f64,
}

/// The start of a ray that left a surface is off by a few roundings of its largest coordinate; what lies within that
/// of the start is the start. (The surface left itself is not missed by this but by [`Left`](crate::kernel::Left).)
pub const START_ROUNDINGS: f64 = 32.0;

/// How far from a start on a surface nothing is hit.
#[inline(always)]
pub fn start_rounding<L: Lane>(origin: &Vec3<L>) -> L {
    origin.abs().max_element() * L::lit(START_ROUNDINGS * L::Scalar::UNIT_ROUNDOFF)
}

/// The same of where a ray has come to, of its own precision `S`.
#[inline(always)]
pub fn rounding_at<S: Scalar>((origin, dir): (DVec3, DVec3), t: f64) -> f64 {
    // (A sum or product of single precision is that of double, rounded once more.)
    let each = |v: DVec3| DVec3::from_array(v.to_array().map(rounded::<S>));
    each(origin + each(dir * t)).abs().max_element() * (START_ROUNDINGS * S::UNIT_ROUNDOFF)
}

/// The number of precision `S` that is next to `x`.
#[inline(always)]
pub fn rounded<S: Scalar>(x: f64) -> f64 {
    S::from_f64(x).to_f64()
}

impl<L: Lane> Query<L> {
    /// Rays up to distance `t_max`.
    pub fn new(lines: &Lines<L>, t_max: L, lanes: u8) -> Self {
        let mut query = Self::default();
        query.aim(lines, t_max, lanes);
        query
    }

    /// Becomes rays up to distance `t_max`.
    #[inline(always)]
    pub fn aim(&mut self, lines: &Lines<L>, t_max: L, lanes: u8) {
        let reach = start_rounding(&lines.rays.origin);
        let free = equal_lanes(&lines.left, NO_SURFACE);
        self.rays.set(&lines.rays.origin, &lines.rays.dir);
        self.left = lines.left;
        self.part = lines.part;
        self.t_min = Mask::from_bits(free).select(L::zero(), reach);
        self.t = t_max.in_register();
        self.surface = [NO_SURFACE; LANES];
        self.lanes = lanes;
        self.starts = free != !0;
        self.loose = 0;
    }

    /// Becomes rays that start on no surface and look for hits beyond `from` and before `to`.
    #[inline(always)]
    pub fn aim_free(&mut self, rays: &Rays<L>, [from, to]: [L; 2], lanes: u8) {
        self.rays.set(&rays.origin, &rays.dir);
        self.left = [NO_SURFACE; LANES];
        self.part = [0; LANES];
        (self.t_min, self.t) = (from.in_register(), to.in_register());
        self.surface = [NO_SURFACE; LANES];
        self.lanes = lanes;
        self.starts = false;
        self.loose = 0;
    }

    /// The rays of `lanes` as `rays` in another space, where they are `length` times as long and surfaces have the numbers that `own`
    /// gives.
    #[inline(always)]
    pub fn moved(&self, rays: Rays<L>, length: L, own: impl Fn(SurfaceId) -> SurfaceId, lanes: u8) -> Self {
        let on_surface = Mask::from_bits(!equal_lanes(&self.left, NO_SURFACE));
        let rounding = on_surface.keep(start_rounding(&rays.origin));
        let left = if self.starts { self.left.map(own) } else { self.left };
        Self {
            rays,
            left,
            part: self.part,
            t_min: rounding.max(self.t_min * length),
            t: self.t * length,
            surface: [NO_SURFACE; LANES],
            lanes,
            starts: self.starts && equal_lanes(&left, NO_SURFACE) != !0,
            loose: 0,
            slack: 0.0,
        }
    }

    /// True if a ray starts on a surface.
    #[inline(always)]
    pub fn starts(&self) -> bool {
        self.starts
    }

    /// True if a ray starts on one of `len` surfaces from `first` on.
    #[inline(always)]
    pub fn starts_within(&self, first: SurfaceId, len: u32) -> bool {
        self.starts && lanes_within(&self.left, first, len) != 0
    }

    /// Where the rays `lanes` look for something, with `any` for whether there is anything.
    #[inline(always)]
    pub fn looking(&self, lanes: u8, any: bool) -> Looking<L> {
        Looking { from: self.t_min.in_register(), to: self.t.in_register(), lanes, any }
    }

    /// Lanes that start on `surface`.
    #[inline(always)]
    pub fn lanes_on(&self, surface: SurfaceId) -> u8 {
        equal_lanes(&self.left, surface)
    }

    /// The ray in lane `lane` has hit `surface` at `t`, which is not beyond what is known: whether that is what it sees.
    /// Nothing is at the limit itself, nor at an infinite one.
    #[inline(always)]
    pub fn take(&mut self, lane: usize, t: L::Scalar, surface: SurfaceId, ranks: &Ranks) -> bool {
        let (known, other) = (self.t.lanes()[lane], self.surface[lane]);
        let seen = t < known || (t == known && ranks.prefer(surface, other));
        if seen {
            self.t.lanes_mut()[lane] = t;
            self.surface[lane] = surface;
        }
        seen
    }

    /// Lanes that have hit something.
    #[inline(always)]
    pub fn hits(&self) -> u8 {
        !equal_lanes(&self.surface, NO_SURFACE) & self.lanes
    }

    /// Lanes that look for something: with `ANY` only until they have hit it.
    #[inline(always)]
    pub fn waiting<const ANY: bool>(&self) -> u8 {
        if ANY { self.lanes & !self.hits() } else { self.lanes }
    }

    /// True if all rays have hit something.
    #[inline(always)]
    pub fn is_done(&self) -> bool {
        self.hits() == self.lanes
    }

    /// What was hit; lanes that have hit nothing repeat what one of `hits`, which are not none, has.
    #[inline(always)]
    pub fn met(&self, hits: u8) -> [SurfaceId; LANES] {
        let one = self.surface[hits.trailing_zeros() as usize & (LANES - 1)];
        choose(hits, &self.surface, &[one; LANES])
    }
}
