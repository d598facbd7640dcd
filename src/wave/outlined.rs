//! The test of a run of triangles by several packets, by their outlines.
//!
//! What hangs on no answer is asked first: which rays of all packets pass through which of four rows. Only then are answers looked
//! at, and each packet's rays have their distances taken at once, whichever rows they pass. Taken packet by packet and row by
//! row, every branch that was guessed wrongly cost all that was under way: coherent rays of meshes took 4 to 9 % longer, in
//! double precision up to 14.

use super::query::Query;
use super::rows::{Rows, Views, accept};
use crate::bvh::{Count, GROUP, Packet, Packets, each_packet};
use crate::kernel::{Block, LinePairs, Passing};
use crate::lane::{QUAD, Scalar};
use std::ops::Range;

/// Packets that rows are held against, none of whose rays starts on one of them.
pub struct Outlined<'a, S: Scalar, B: Scalar, C: Count, const ANY: bool> {
    pub rows: Rows<'a>,
    pub packets: &'a mut [Packet<B>],
    pub queries: &'a mut [Query<S::Lane>],
    pub views: &'a Views<'a, S>,
    pub count: &'a mut C,
}

impl<S: Scalar, B: Scalar, C: Count, const ANY: bool> Outlined<'_, S, B, C, ANY> {
    /// Tests all rows against the packets of `which`: a bit for each that found something nearer.
    #[inline(always)]
    pub fn test<K: Block<S>>(&mut self, block: &K, which: Packets) -> Packets {
        let (first, end) = (self.rows.run.first as usize, (self.rows.run.first + self.rows.run.len) as usize);
        let mut found = 0;
        for four in first / QUAD..end.div_ceil(QUAD) {
            let rows = first.saturating_sub(four * QUAD)..(end - four * QUAD).min(QUAD);
            let mut passing = [Passing::default(); GROUP];
            for k in each_packet(self.pass(block, (four, rows), which, &mut passing)) {
                found |= Packets::from(self.take(block, four, k, passing[k])) << k;
            }
        }
        found
    }

    /// By packet, its live rays that pass through these rows of a four; and a bit for each packet of `which` that has any.
    #[inline(always)]
    fn pass<K: Block<S>>(
        &mut self,
        block: &K,
        (four, rows): (usize, Range<usize>),
        which: Packets,
        all: &mut [Passing; GROUP],
    ) -> Packets {
        let outlines = block.outlines(four, &self.views.center);
        let all_rows = Passing::through_all(&rows);
        let (mut some, mut rest) = (0, which);
        while rest != 0 {
            // Two packets side by side; the last, if it is alone, beside itself.
            let first = |rest: Packets| rest.trailing_zeros() as usize & (GROUP - 1);
            let (k, more) = (first(rest), rest & (rest - 1));
            let other = if more == 0 { k } else { first(more) };
            rest = more & more.wrapping_sub(1);
            let lines = LinePairs::of([k, other].map(|k| &self.views.lines[k]));
            let [one, two] = outlines.meet(&rows, all_rows, &lines);
            for (k, told) in [(k, one), (other, two)] {
                all[k] = self.through(block, four, k, told);
                some |= Packets::from(!all[k].is_empty()) << k;
            }
            for k in [k, other].into_iter().take(1 + usize::from(more != 0)) {
                self.count.leaf(rows.len() as u32, self.packets[k].live().count_ones());
            }
        }
        some
    }

    /// The live rays of packet `k` that pass through rows of a four: those that are told so, and of those that it is not sure of the
    /// ones that the rows' own test says so of.
    #[inline(always)]
    fn through<K: Block<S>>(
        &self,
        block: &K,
        four: usize,
        k: usize,
        [told, unsure]: [Passing; 2],
    ) -> Passing {
        let live = self.packets[k].live();
        let mut passing = told.of(live);
        for row in unsure.of(live).rows() {
            let through = block.through(four * QUAD + row, &self.queries[k].rays);
            passing = passing.with(row, through & live);
        }
        passing
    }

    /// Takes what rays of packet `k` meet where they pass through rows of a four: true if anything is nearer than what is known.
    #[inline(always)]
    fn take<K: Block<S>>(&mut self, block: &K, four: usize, k: usize, mut passing: Passing) -> bool {
        let Self { rows: Rows { base, ranks, .. }, packets, queries, .. } = self;
        let (query, state) = (&mut queries[k], &mut packets[k]);
        let (live, first, mut changed) = (state.live(), *base + (four * QUAD) as u32, 0);
        while !passing.is_empty() {
            // Most rays pass through one row at most.
            let now = passing.first_rows();
            passing = passing.without(now);
            let t = block.first_through(four, now, &query.rays, query.t_min);
            let surfaces = now.rows_of_rays().map(|row| first + row);
            changed |= accept(query, t, &surfaces, live, ranks);
        }
        if changed != 0 {
            state.found(changed, query.t, ANY);
        }
        changed != 0
    }
}
