//! Shadow rays against the few things that stand in their cell.

use super::super::query::Query;
use super::super::rows::Rows;
use super::casters::Caster;
use crate::bvh::Run;
use crate::compile::{COMPOSITE, Geometry, SurfaceId, WithBlock};
use crate::kernel::{Block, Ranks, Ray};
use crate::lane::{LANES, Lane, Mask, QUAD, Scalar, bits, f32x8, highest};
use std::cmp::Ordering;

/// Opaque rows of one kind that stand together in their columns.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    /// The rows are `4 * four` to `4 * four + 3`.
    four: u32,
    kind: u8,
    /// A bit for each that counts.
    rows: u8,
    /// In a list, how many from here on are of the kind.
    alike: u8,
    /// The least depth at which they are met.
    near: f32,
}

impl Candidate {
    /// The nearest first; of equally near ones always the same.
    fn order(&self, other: &Self) -> Ordering {
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
    candidates.push(Candidate { four, kind, rows, alike: 1, near });
    candidates.len() - first <= MOST
}

/// Puts a list in order that is complete.
pub(super) fn settle(candidates: &mut [Candidate]) {
    candidates.sort_unstable_by(Candidate::order);
    for k in (1..candidates.len()).rev() {
        if candidates[k - 1].kind == candidates[k].kind {
            candidates[k - 1].alike = candidates[k].alike + 1;
        }
    }
}

/// True of casters that lists may hold.
pub(super) fn is_listed(caster: &Caster) -> bool {
    caster.opaque && caster.kind < COMPOSITE
}

/// Some of the ways of eight points to a light: as a query.
pub(super) struct Ways<'a, S: Scalar> {
    pub query: &'a mut Query<S::Lane>,
    /// In the points' cells.
    pub depths: &'a [f32; LANES],
}

/// With so many ways through one cell they are held against its list together, row by row: fewer each by itself, four rows at a
/// time.
const TOGETHER: u32 = 4;

/// The ways of `lanes`, all of which start in one cell, that anything of its list `candidates` is in; as tracing has it, to the
/// bit.
pub(super) fn met<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    candidates: &[Candidate],
    ways: &mut Ways<S>,
    lanes: u8,
) -> u8 {
    // Lists are long, and mostly little of them lies before the farthest of the points: no more is read.
    let depths = f32x8::from_array(*ways.depths);
    let farthest = highest(Mask::from_bits(lanes).select(depths, f32x8::zero()));
    let (mut met, mut rest) = (0, candidates);
    while let Some(&Candidate { kind, near, alike, .. }) = rest.first() {
        if near > farthest || met == lanes {
            break;
        }
        let (alike, others) = rest.split_at(rest.len().min(alike.into()));
        let (base, open) = (scene.base[usize::from(kind)], lanes & !met);
        met |= scene.columns.with(kind, Meets { alike, base, ranks: &scene.ranks, ways, lanes: open });
        rest = others;
    }
    met
}

/// The test of candidates of one kind, the nearest first.
struct Meets<'a, 'b, S: Scalar> {
    alike: &'a [Candidate],
    /// Surface number of the kind's first row.
    base: SurfaceId,
    ranks: &'a Ranks,
    ways: &'a mut Ways<'b, S>,
    lanes: u8,
}

impl<S: Scalar> WithBlock<S> for Meets<'_, '_, S> {
    type Output = u8;

    #[inline(always)]
    fn block<K: Block<S>>(self, block: &K) -> u8 {
        if !K::ACROSS || self.lanes.count_ones() >= TOGETHER {
            return self.together(block);
        }
        bits(self.lanes).fold(0, |met, lane| met | u8::from(self.alone(block, lane)) << lane)
    }
}

impl<S: Scalar> Meets<'_, '_, S> {
    /// One way, four rows at a time.
    #[inline(always)]
    fn alone<K: Block<S>>(&self, block: &K, lane: usize) -> bool {
        let Ways { query, depths } = &*self.ways;
        let lane = lane & (LANES - 1);
        let ray = Ray::of(&query.rays, lane, K::OUTLINED);
        let limits = (query.t_min.lanes()[lane], query.t.lanes()[lane]);
        let own = query.left[lane].wrapping_sub(self.base);
        self.alike.iter().take_while(|candidate| candidate.near <= depths[lane]).any(|candidate| {
            let own = own.wrapping_sub(QUAD as u32 * candidate.four);
            let left = if own < QUAD as u32 { 1 << own } else { 0 };
            block.blocked_in_four(candidate.four as usize, &ray, limits, (candidate.rows, left))
        })
    }

    /// Several ways, row by row. (A call, as some kinds' tests need more of the stack than it takes to clear.)
    #[inline(never)]
    fn together<K: Block<S>>(self, block: &K) -> u8 {
        let Self { alike, base, ranks, ways, lanes } = self;
        let Ways { query, depths } = ways;
        let depths = f32x8::from_array(**depths);
        let mut met = 0;
        for &Candidate { four, kind, rows, near, .. } in alike {
            let before = f32x8::splat(near).le(depths).bits() & lanes & !met;
            if before == 0 {
                break;
            }
            for k in bits(rows) {
                let run = Run { kind, class: 0, last: true, len: 1, first: QUAD as u32 * four + k as u32 };
                let rows = Rows { run: &run, base, ranks };
                met |= rows.test(block, query, (before & !met, true)).0;
            }
        }
        met
    }
}
