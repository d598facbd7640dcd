//! The test of a run of primitives of one kind by several packets: by their outlines, or each packet by itself.

use super::outlined::Outlined;
use super::query::Query;
use super::rows::{Rows, Views};
use super::screened::ScreenedPackets;
use crate::bvh::{Count, Packet, Packets, each_packet};
use crate::compile::WithBlock;
use crate::kernel::Block;
use crate::lane::Scalar;

/// The test of a run of one kind by several packets: a bit for each that found something nearer.
pub struct TestPackets<'a, S: Scalar, B: Scalar, C: Count, const ANY: bool> {
    pub rows: Rows<'a>,
    pub which: Packets,
    pub packets: &'a mut [Packet<B>],
    pub queries: &'a mut [Query<S::Lane>],
    pub views: &'a Views<'a, S>,
    pub count: &'a mut C,
}

impl<S: Scalar, B: Scalar, C: Count, const ANY: bool> WithBlock<S> for TestPackets<'_, S, B, C, ANY> {
    type Output = Packets;

    #[inline(always)]
    fn block<K: Block<S>>(mut self, block: &K) -> Packets {
        if K::SCREENED && self.which.count_ones() > 1 {
            let Self { rows, which, packets, queries, count, .. } = self;
            return ScreenedPackets::<S, B, C, ANY> { rows, packets, queries, count }.test(block, which);
        }
        if !K::OUTLINED {
            return self.row_by_row(block, self.which);
        }
        let Rows { run, base, .. } = self.rows;
        // Rays that start on a row are for the rows' own test.
        let mut starting = 0;
        for k in each_packet(self.which & self.views.starting) {
            starting |= Packets::from(self.queries[k].starts_within(base + run.first, run.len)) << k;
        }
        let found = self.row_by_row(block, starting);
        let Self { rows, which, packets, queries, views, count } = self;
        let mut others = Outlined::<S, B, C, ANY> { rows, packets, queries, views, count };
        let which = which & !starting;
        if which == 0 { found } else { found | others.test(block, which) }
    }
}

impl<S: Scalar, B: Scalar, C: Count, const ANY: bool> TestPackets<'_, S, B, C, ANY> {
    /// The packets of `which`, each by itself.
    #[inline(always)]
    fn row_by_row<K: Block<S>>(&mut self, block: &K, which: Packets) -> Packets {
        let mut found = 0;
        for k in each_packet(which) {
            let (query, state) = (&mut self.queries[k], &mut self.packets[k]);
            let changed = self.rows.test_counting(block, query, (state.live(), ANY), self.count);
            if changed != 0 {
                state.found(changed, query.t, ANY);
                found |= 1 << k;
            }
        }
        found
    }
}
