//! What happens in the leaves of the tree: the walk's packets and single rays are held against runs of primitives.

use super::composite::{Comers, composites, settle};
use super::crossings::{InTheWay, NoteRun, note_composite};
use super::instances::Placed;
use super::item_buffer::Item;
use super::packets::TestPackets;
use super::query::Query;
use super::rows::{Lone, Prefetch, Rows, TestAcross, TestRun, Views, accept};
use super::sharpen::sharpen;
use super::trace::{BLOCKS, Known, Tracer};
use crate::bvh::{Count, GROUP, Packet, Packets, Run, Visit, each_packet};
use crate::compile::{COMPOSITE, Geometry, INSTANCE, class};
use crate::csg::{Scratch, Stretch};
use crate::lane::{LANES, Lane, Scalar, choose};
use smallvec::SmallVec;
use std::ops::Range;

/// Buffers for what is in leaves.
#[derive(Default)]
pub struct LeafBuffers<B: Scalar> {
    /// For composites.
    pub scratch: Scratch,
    /// For what stands in instances; there if there are any.
    pub inner: Option<Box<Tracer<B>>>,
}

/// What happens in the tree's leaves.
pub struct Leaves<'a, S: Scalar, B: Scalar, C: Count, const ANY: bool> {
    scene: &'a Geometry<S, B>,
    /// By packet.
    pub queries: &'a mut [Query<S::Lane>],
    filter: u8,
    buffers: &'a mut LeafBuffers<B>,
    /// By packet, its rays as composites' bounds see them, once one has asked.
    stretches: &'a mut [Option<Stretch>],
    /// By packet, what is see-through in the way of its shadow rays.
    ways: &'a mut [InTheWay; GROUP],
    /// How its packets' rays see corners.
    views: &'a Views<'a, S>,
    /// Packets that may have [loose](Query::loose) rays.
    loose: Packets,
    /// What has blocked a shadow ray last.
    pub blocker: Option<Run>,
    /// What was tested, if that is counted.
    pub count: C,
}

impl<S: Scalar, B: Scalar, C: Count, const ANY: bool> Visit<B> for Leaves<'_, S, B, C, ANY> {
    const ANY: bool = ANY;
    #[inline]
    fn packets(&mut self, run: &Run, which: Packets, packets: &mut [Packet<B>]) -> Packets {
        let noted = self.only_notes(run);
        if run.kind < COMPOSITE && !noted {
            self.settle(which);
            let (rows, queries) = (rows(self.scene, run), &mut *self.queries);
            let (views, count) = (self.views, &mut self.count);
            let test = TestPackets::<S, B, C, ANY> { rows, which, packets, queries, views, count };
            let changed = self.scene.columns.with(run.kind, test);
            if ANY && changed != 0 {
                self.blocker = Some(*run);
            }
            return changed;
        }
        // (Live rays are waiting for something.)
        let mut in_instances = [0; GROUP];
        if run.kind == INSTANCE {
            self.settle(which);
            let mut live = [0; GROUP];
            for k in each_packet(which) {
                live[k] = packets[k].live();
            }
            in_instances = self.instances(run, 0, &live[..packets.len().min(GROUP)]);
        }
        let (mut changed, mut in_composites) = (0, [0; GROUP]);
        if run.kind == COMPOSITE {
            self.composites_by_two(run, which, packets, (noted, &mut in_composites));
        }
        for k in each_packet(which) {
            let found = match run.kind {
                INSTANCE => in_instances[k],
                COMPOSITE => in_composites[k],
                _ => self.run(run, k, packets[k].live()),
            };
            if found != 0 {
                packets[k].found(found, self.queries[k].t, ANY);
                changed |= 1 << k;
            }
        }
        if ANY && changed != 0 {
            self.blocker = Some(*run);
        }
        changed
    }

    type Lone = Lone<S>;

    #[inline(always)]
    fn lone(&self, packet: usize, lane: usize) -> Lone<S> {
        Lone::of(&self.queries[packet], (packet, lane & (LANES - 1)), self.scene.has_triangles())
    }

    #[inline(always)]
    fn single(&mut self, run: &Run, lone: &Lone<S>, state: &Packet<B>, far: B) -> B {
        let (packet, lane) = (lone.packet, lone.lane & (LANES - 1));
        if run.kind != COMPOSITE {
            self.settle(1 << packet);
        }
        let before = self.queries[packet].t.lanes()[lane];
        let found = if run.kind >= COMPOSITE || self.only_notes(run) {
            None
        } else {
            let (rows, query) = (rows(self.scene, run), &mut self.queries[packet]);
            let test = TestAcross::<S, C> { rows, query, lone, count: &mut self.count };
            self.scene.columns.with(run.kind, test)
        };
        if !found.unwrap_or_else(|| self.one_lane(run, packet, lane)) {
            return far;
        }
        if ANY {
            self.blocker = Some(*run);
            return B::from_f64(-1.0);
        }
        let t = self.queries[packet].t.lanes()[lane];
        if t == before { far } else { state.far_of_lane(t.to_f64(), lane) }
    }

    #[inline(always)]
    fn prefetches(&self) -> bool {
        self.scene.has_triangles()
    }

    #[inline(always)]
    fn prefetch(&self, run: &Run) {
        if run.kind < COMPOSITE {
            self.scene.columns.with(run.kind, Prefetch(run.first as usize));
        }
    }

    #[inline(always)]
    fn boxes(&mut self, lanes: u32) {
        self.count.boxes(lanes);
    }

    #[inline(always)]
    fn wants(&self, class: u8) -> bool {
        class & self.filter != 0
    }
}

impl<'a, S: Scalar, B: Scalar, C: Count, const ANY: bool> Leaves<'a, S, B, C, ANY> {
    /// For rays that care for the classes of `filter`.
    #[inline(always)]
    pub fn new(
        scene: &'a Geometry<S, B>,
        (queries, views): (&'a mut [Query<S::Lane>], &'a Views<'a, S>),
        filter: u8,
        (buffers, stretches): (&'a mut LeafBuffers<B>, &'a mut [Option<Stretch>]),
        ways: &'a mut [InTheWay; GROUP],
    ) -> Self {
        Self {
            scene,
            queries,
            filter,
            buffers,
            stretches,
            ways,
            views,
            loose: 0,
            blocker: None,
            count: C::default(),
        }
    }

    /// Tests a run that has no test of one ray against four rows: the packet's test, with one lane.
    #[cold]
    #[inline(never)]
    fn one_lane(&mut self, run: &Run, packet: usize, lane: usize) -> bool {
        self.run(run, packet, 1 << lane) != 0
    }

    /// True if what rays meet of a run lets them go on: see-through things in the way of shadow rays.
    #[inline(always)]
    fn only_notes(&self, run: &Run) -> bool {
        ANY && run.class & self.filter & class::BLOCKS == 0
    }

    /// Works out where rays of packets `which` have met composites, before that is compared with where they meet something else.
    #[inline(always)]
    fn settle(&mut self, which: Packets) {
        if !ANY && self.loose & which != 0 {
            self.settle_loose(which);
        }
    }

    /// (Out of the way of those who have none.)
    #[cold]
    #[inline(never)]
    fn settle_loose(&mut self, which: Packets) {
        for k in each_packet(self.loose & which) {
            settle(self.scene, &mut self.queries[k], &mut self.buffers.scratch);
        }
        self.loose &= !which;
    }

    /// Tests a run against all packets.
    #[inline]
    pub fn run_all(&mut self, run: &Run) {
        if run.kind >= COMPOSITE || self.only_notes(run) {
            for k in 0..self.queries.len() {
                self.run(run, k, !0);
            }
            return;
        }
        let packets = 0..self.queries.len();
        self.settle(!0);
        self.primitives(run, packets, !0);
    }

    /// Tests what may be seen in blocks of pixels against their packets, the nearest first; with room for what is known of these.
    #[inline(always)]
    pub fn blocks(&mut self, blocks: &[&[Item]; BLOCKS], packets: &mut Vec<Packet<B>>) {
        if blocks.iter().all(|items| items.is_empty()) {
            return;
        }
        packets.clear();
        packets.extend(self.queries.iter().map(|query| Packet::looking(query.lanes)));
        for (block, items) in blocks.iter().enumerate() {
            let filter = self.filter;
            for item in items.iter().filter(|item| item.run.class & filter != 0) {
                let mut which = 0;
                for k in each_packet(Packets::from(item.packets) << (block * LANES)) {
                    let looks =
                        self.queries.get(k).is_some_and(|query| query.t.ge(S::Lane::lit(item.near)).any());
                    which |= Packets::from(looks) << k;
                }
                if which != 0 {
                    self.packets(&item.run, which, packets);
                }
            }
        }
    }

    /// Tests a run against one packet and returns the lanes whose hit changed.
    #[inline]
    pub fn run(&mut self, run: &Run, packet: usize, lanes: u8) -> u8 {
        let lanes = lanes & self.queries[packet].waiting::<ANY>();
        if lanes == 0 {
            return 0;
        }
        if run.kind != INSTANCE && self.only_notes(run) {
            self.note(run, packet, lanes);
            return 0;
        }
        self.test(run, packet, lanes)
    }

    #[inline(always)]
    fn test(&mut self, run: &Run, packet: usize, lanes: u8) -> u8 {
        if run.kind != COMPOSITE {
            self.settle(1 << packet);
        }
        match run.kind {
            COMPOSITE => self.composites(run, [packet; 2], [lanes, 0])[0],
            INSTANCE => self.instances(run, packet, &[lanes])[0],
            _ => self.primitives(run, packet..packet + 1, lanes),
        }
    }

    /// Tests a run of instances against lanes of packets from `first` on: by packet, those that have found something nearer. What is
    /// see-through in the way of shadow rays is noted.
    #[inline(never)]
    fn instances(&mut self, run: &Run, first: usize, lanes: &[u8]) -> [u8; GROUP] {
        let mut found = [0; GROUP];
        // (Prototypes do not know whether they are.)
        let filter = if self.only_notes(run) { class::FILTERS } else { !0 };
        let Some(inner) = &mut self.buffers.inner else { return found };
        for row in run.first..run.first + run.len {
            let placed = Placed::of(self.scene, row);
            let (mut moved, mut lengths) = (SmallVec::<[_; GROUP]>::new(), SmallVec::<[_; GROUP]>::new());
            for (k, &lanes) in lanes.iter().enumerate() {
                let waiting = if ANY { lanes & !found[k] } else { lanes };
                if waiting != 0 {
                    let (mut rays, length) = placed.rays(&self.queries[first + k], waiting);
                    if !ANY {
                        // What is just as near as what is known may be seen in its place: rounding must not hide it.
                        rays.t = rays.t * S::Lane::lit(1.0 + TIE_ROUNDINGS * S::UNIT_ROUNDOFF);
                    }
                    moved.push(rays);
                    lengths.push((k, length));
                }
            }
            self.count.add(inner.trace_counting::<S, C, ANY>(
                placed.prototype,
                &mut moved,
                filter,
                Known::nothing(&mut None),
            ));
            if !ANY {
                inner.settle(placed.prototype, &mut moved);
                sharpen(placed.prototype, &mut moved);
            }
            for (number, (moved, (k, length))) in moved.iter().zip(lengths).enumerate() {
                if ANY {
                    inner.ways()[number].hand_to(&mut self.ways[first + k], |own| placed.surface(own));
                }
                let hits = moved.hits();
                if hits == 0 {
                    continue;
                }
                let (query, surfaces) = (&mut self.queries[first + k], placed.surfaces(&moved.surface));
                if ANY {
                    // (Where it is blocked is not known of all.)
                    query.surface = choose(hits, &surfaces, &query.surface);
                    found[k] |= hits;
                } else {
                    found[k] |= accept(query, moved.t / length, &surfaces, hits, &self.scene.ranks);
                }
            }
        }
        found
    }

    /// Tests a run of composites against lanes of two packets, or of one packet named twice: what they have found.
    #[inline(always)]
    fn composites(&mut self, run: &Run, which: [usize; 2], lanes: [u8; 2]) -> [u8; 2] {
        for lanes in lanes.iter().filter(|&&lanes| lanes != 0) {
            self.count.leaf(run.len, lanes.count_ones());
        }
        let mut comers = Comers { queries: self.queries, stretches: self.stretches };
        let scratch = &mut self.buffers.scratch;
        let found =
            composites::<S, B, ANY>(self.scene, run, &mut comers, (which, lanes, self.filter), scratch);
        if !ANY {
            for (k, found) in which.into_iter().zip(found) {
                self.loose |= Packets::from(found != 0) << k;
            }
        }
        found
    }

    /// Tests a run of composites against some packets, two by two: by packet, the lanes that have found something. Or has them `noted`.
    #[inline(always)]
    fn composites_by_two(
        &mut self,
        run: &Run,
        which: Packets,
        packets: &[Packet<B>],
        (noted, found): (bool, &mut [u8; GROUP]),
    ) {
        let mut which = each_packet(which);
        while let Some(a) = which.next() {
            let (b, live) = which.next().map_or((a, 0), |b| (b, packets[b].live()));
            let lanes = [packets[a].live(), live];
            if noted {
                self.note_composites(run, [a, b], lanes);
                continue;
            }
            let [of_a, of_b] = self.composites(run, [a, b], lanes);
            // (The second first: it may be the first again, idle.)
            (found[b], found[a]) = (of_b, of_a);
        }
    }

    /// Tests a run of anything else against some packets: what changed of the last.
    #[inline(always)]
    fn primitives(&mut self, run: &Run, packets: Range<usize>, lanes: u8) -> u8 {
        let (rows, queries) = (rows(self.scene, run), &mut self.queries[packets]);
        let test = TestRun::<S, C, ANY> { rows, queries, lanes, count: &mut self.count };
        self.scene.columns.with(run.kind, test)
    }

    /// Notes which shadow rays meet the see-through things of a run, and lets them go on.
    #[inline(never)]
    fn note(&mut self, run: &Run, packet: usize, lanes: u8) {
        if run.kind == COMPOSITE {
            self.note_composites(run, [packet; 2], [lanes, 0]);
            return;
        }
        let (rows, query) = (rows(self.scene, run), &self.queries[packet]);
        let way = &mut self.ways[packet];
        let tested = self.scene.columns.with(run.kind, NoteRun { rows, query, lanes, way });
        self.count.leaf(tested, lanes.count_ones());
    }

    /// The same with see-through composites and two packets, or one packet named twice.
    #[inline(never)]
    fn note_composites(&mut self, run: &Run, which: [usize; 2], lanes: [u8; 2]) {
        let Self { scene, queries, buffers, stretches, ways, count, .. } = self;
        let mut comers = Comers { queries, stretches };
        for composite in &scene.csg.composites[run.first as usize..(run.first + run.len) as usize] {
            for lanes in lanes.iter().filter(|&&lanes| lanes != 0) {
                count.leaf(1, lanes.count_ones());
            }
            let looking = (which, lanes);
            note_composite(&mut ways[..], scene, composite, &mut comers, looking, &mut buffers.scratch);
        }
    }
}

/// What a distance may be off by that was taken to an instance's space and back, in roundings.
const TIE_ROUNDINGS: f64 = 4.0;

/// The rows of a run.
#[inline(always)]
fn rows<'a, S: Scalar, B: Scalar>(scene: &'a Geometry<S, B>, run: &'a Run) -> Rows<'a> {
    Rows { run, base: scene.base[usize::from(run.kind)], ranks: &scene.ranks }
}
