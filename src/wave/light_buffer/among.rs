//! Shadow rays against the few things that stand in their cell.

use super::casters::Caster;
use crate::compile::{Compiled, Kind, SurfaceId, WithBlock};
use crate::kernel::{Block, Ray, Rays, View};
use crate::lane::{LANES, Lane, QUAD, Quad, Scalar};
use std::cmp::Ordering;

/// Opaque rows of one kind that stand together in their columns.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    /// The rows are `4 * four` to `4 * four + 3`.
    four: u32,
    kind: u8,
    /// A bit for each that counts.
    rows: u8,
    /// The least depth at which they are met.
    near: f32,
}

impl Candidate {
    /// The nearest first; of equally near ones always the same.
    pub fn order(&self, other: &Self) -> Ordering {
        self.near.total_cmp(&other.near).then((self.kind, self.four).cmp(&(other.kind, other.four)))
    }
}

/// Longer lists are not made: the tree is as fast.
const MOST: usize = 24;

/// Adds a row to the list that begins at `first`, unless that gets too long; false if it cannot be had in a list.
#[inline(always)]
pub(super) fn list(candidates: &mut Vec<Candidate>, first: usize, (kind, row): (u8, u32), near: f32) -> bool {
    let (four, rows) = (row / QUAD as u32, 1 << (row % QUAD as u32));
    for candidate in &mut candidates[first..] {
        if candidate.four == four && candidate.kind == kind {
            candidate.rows |= rows;
            candidate.near = candidate.near.min(near);
            return true;
        }
    }
    candidates.push(Candidate { four, kind, rows, near });
    candidates.len() - first <= MOST
}

/// True of casters that lists may hold.
pub(super) fn is_listed(caster: &Caster) -> bool {
    caster.opaque && caster.kind == Kind::Sphere as u8
}

/// Eight ways to a light.
pub struct Ways<'a, S: Scalar> {
    /// As rays from surfaces.
    pub rays: &'a Rays<S::Lane>,
    /// Hits at or before the one do not count, nor those at or beyond the other.
    pub limits: (S::Lane, S::Lane),
    /// The surfaces they start on.
    pub left: &'a [SurfaceId; LANES],
}

/// Whether anything of `candidates` is in the way in lane `lane`, which starts at `depth` in their cell; as tracing has it, to the
/// bit.
pub(super) fn meets<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    candidates: &[Candidate],
    ways: &Ways<S>,
    (view, lane): (&View<S::Lane>, usize),
    depth: f32,
) -> bool {
    let ray = Ray::of(ways.rays, view, lane);
    let limits = (ways.limits.0.lanes()[lane], ways.limits.1.lanes()[lane]);
    let own = ways.left[lane];
    let mut rest = candidates;
    while let Some(first) = rest.first() {
        let base = scene.base[usize::from(first.kind)];
        let test = Meets { rest: &mut rest, ray: &ray, limits, own: own.wrapping_sub(base), depth };
        if scene.columns.with(first.kind, test) {
            return true;
        }
    }
    false
}

/// The test of a list's first candidates that are of one kind, which it takes off.
struct Meets<'a, 'b, S: Scalar> {
    rest: &'a mut &'b [Candidate],
    ray: &'a Ray<S>,
    limits: (S, S),
    /// The row that the ray starts on, or one that is none.
    own: u32,
    depth: f32,
}

impl<S: Scalar> WithBlock<S> for Meets<'_, '_, S> {
    type Output = bool;

    #[inline(always)]
    fn block<K: Block<S>>(self, block: &K) -> bool {
        let Self { rest, ray, limits, own, depth } = self;
        let kind = rest.first().map_or(0, |first| first.kind);
        while let Some((first, others)) = rest.split_first() {
            if first.kind != kind {
                return false;
            }
            if first.near > depth {
                break; // And so are all after it.
            }
            *rest = others;
            let own = own.wrapping_sub(QUAD as u32 * first.four);
            let left = if own < QUAD as u32 { 1 << own } else { 0 };
            let (t, near) = block.near_in_four(first.four as usize, ray, limits, left);
            let near = near & first.rows;
            // Nothing is at the limit itself.
            if near != 0 && (0..QUAD).any(|k| near >> k & 1 == 1 && t.to_array()[k] < limits.1) {
                return true;
            }
        }
        *rest = &[];
        false
    }
}
