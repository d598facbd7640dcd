//! Packets through the compiled scene: what is hit first, and whether anything is hit at all.

use super::composite::settle;
use super::crossings::InTheWay;
use super::item_buffer::Item;
use super::leaves::{LeafBuffers, Leaves};
use super::light_buffer::Cones;
use super::query::Query;
use super::rows::Views;
use super::sharpen::sharpen;
use crate::bvh::{Count, GROUP, Occupancy, Packet, Run, Stack, Traversal, walk};
use crate::compile::{Geometry, class};
use crate::csg::Stretch;
use crate::kernel::PluckerLines;
use crate::lane::{LANES, Lane, Scalar};

/// Buffers for tracing, one set a thread.
#[derive(Default)]
pub struct Tracer<B: Scalar> {
    stack: Stack<B>,
    packets: Vec<Packet<B>>,
    buffers: LeafBuffers<B>,
    /// By packet, its rays as composites' bounds see them, once one has asked.
    stretches: Vec<Option<Stretch>>,
    /// By packet, its rays as triangles see them.
    lines: Vec<PluckerLines>,
    /// By packet of the last rays that any hit ends, what is see-through on the way.
    ways: [InTheWay; GROUP],
    traversal: Traversal,
    /// What its walks have tested, if that is counted.
    occupancy: Option<Occupancy>,
}

/// Blocks of eight packets in a group.
pub const BLOCKS: usize = GROUP / LANES;

/// What is known of rays before they are traced.
pub(super) struct Known<'a> {
    /// What has blocked such rays the last time, see [`Tracer::occluded`].
    pub suspect: &'a mut Option<Run>,
    /// What is around the light that they go to.
    pub cones: Option<&'a Cones>,
    /// What of the tree may be seen in blocks of pixels, if they come from there.
    pub blocks: Option<&'a [&'a [Item]; BLOCKS]>,
}

impl<'a> Known<'a> {
    /// Nothing; what will be known is put there.
    pub fn nothing(suspect: &'a mut Option<Run>) -> Self {
        Self { suspect, cones: None, blocks: None }
    }
}

impl<B: Scalar> Tracer<B> {
    /// Walks the tree in the way that is asked for, not the one that is best for the rays.
    pub fn with(traversal: Traversal) -> Self {
        Self { traversal, ..Self::default() }
    }

    /// From now on, counts what is tested.
    pub fn count(&mut self) {
        self.occupancy.get_or_insert_default();
    }

    /// What was tested since [`Tracer::count`].
    pub fn occupancy(&self) -> Occupancy {
        self.occupancy.unwrap_or_default()
    }

    /// The nearest hits of up to [`GROUP`] packets among runs that share a bit of `filter`. Of some it is known only about how far away they
    /// are ([`Query::loose`]): [`resolve`](super::hits::resolve) works that out, or [`Tracer::settle`].
    pub fn nearest<S: Scalar>(&mut self, scene: &Geometry<S, B>, queries: &mut [Query<S::Lane>], filter: u8) {
        self.trace::<S, false>(scene, queries, filter, Known::nothing(&mut None));
        sharpen(scene, queries);
    }

    /// Works out how far away hits are of which that is known only about.
    pub fn settle<S: Scalar>(&mut self, scene: &Geometry<S, B>, queries: &mut [Query<S::Lane>]) {
        queries.iter_mut().for_each(|query| settle(scene, query, &mut self.buffers.scratch));
    }

    /// [`Tracer::nearest`] for camera rays, eight packets to a block of pixels, of which is known what of the tree may be seen in each.
    pub fn nearest_among<S: Scalar>(
        &mut self,
        scene: &Geometry<S, B>,
        queries: &mut [Query<S::Lane>],
        filter: u8,
        blocks: &[&[Item]; BLOCKS],
    ) {
        self.trace::<S, false>(
            scene,
            queries,
            filter,
            Known { blocks: Some(blocks), ..Known::nothing(&mut None) },
        );
        sharpen(scene, queries);
    }

    /// Whether anything that blocks light is hit before `t`: in lanes where it is, `surface` names something hit (not
    /// the nearest). Returns, for each packet, what is see-through on the way.
    ///
    /// The first of what is known is what blocked such rays the last time, which is tried before anything is looked for: a light's shadow
    /// rays come in the order of pixels, and neighbours mostly lie in one shadow (Haines and Greenberg 1986, The light
    /// buffer). One does as well as four, and only as long as it blocks whole packets.
    pub fn occluded<S: Scalar>(
        &mut self,
        scene: &Geometry<S, B>,
        queries: &mut [Query<S::Lane>],
        (suspect, cones): (&mut Option<Run>, Option<&Cones>),
    ) -> &[InTheWay; GROUP] {
        let classes = class::BLOCKS | class::FILTERS;
        if scene.has_class(classes) {
            self.trace::<S, true>(scene, queries, classes, Known { suspect, cones, blocks: None });
        } else {
            self.ways.iter_mut().for_each(InTheWay::clear);
        }
        &self.ways
    }

    /// By packet of the last [`Tracer::trace_counting`] for whether anything is hit, what is see-through on the way.
    #[inline(always)]
    pub(super) fn ways(&self) -> &[InTheWay; GROUP] {
        &self.ways
    }

    fn trace<S: Scalar, const ANY: bool>(
        &mut self,
        scene: &Geometry<S, B>,
        queries: &mut [Query<S::Lane>],
        filter: u8,
        known: Known<'_>,
    ) {
        if self.occupancy.is_none() {
            self.trace_counting::<S, (), ANY>(scene, queries, filter, known);
            return;
        }
        let counted = self.trace_counting::<S, Occupancy, ANY>(scene, queries, filter, known);
        if let Some(occupancy) = &mut self.occupancy {
            *occupancy += counted;
        }
    }

    /// The same, with what was tested.
    pub(super) fn trace_counting<S: Scalar, C: Count, const ANY: bool>(
        &mut self,
        scene: &Geometry<S, B>,
        queries: &mut [Query<S::Lane>],
        filter: u8,
        Known { suspect, cones, blocks }: Known<'_>,
    ) -> C {
        let Self { stack, packets, buffers, stretches, lines, ways, traversal, .. } = self;
        if !scene.instances.is_empty() {
            buffers.inner.get_or_insert_with(|| Box::new(Self::with(*traversal)));
        }
        if ANY {
            ways.iter_mut().take(queries.len()).for_each(InTheWay::clear);
        }
        stretches.clear();
        stretches.resize_with(queries.len(), || None);
        let mut views = Views::none(lines);
        if scene.has_triangles() {
            views.see(queries, ANY);
        }
        let mut leaves =
            Leaves::<S, B, C, ANY>::new(scene, (queries, &views), filter, (buffers, stretches), ways);
        if let (true, Some(run)) = (ANY, *suspect) {
            for k in 0..leaves.queries.len() {
                leaves.run(&run, k, !0);
                if !leaves.queries[k].is_done() {
                    break;
                }
            }
        }
        for run in &scene.unbounded {
            if run.class & filter != 0 {
                leaves.run_all(run);
            }
        }
        if scene.bvh.nodes.is_empty() {
            return leaves.count;
        }
        if let (Some(cones), true, Traversal::Auto) = (cones, ANY, *traversal) {
            for k in 0..leaves.queries.len() {
                let query = &leaves.queries[k];
                let (way, waiting) = ((query.rays.dir, query.t), query.waiting::<ANY>());
                cones.each_met(way, waiting, |run, lanes| {
                    leaves.run(run, k, lanes);
                });
            }
            return leaves.count;
        }
        if let (Some(blocks), false) = (blocks, ANY) {
            leaves.blocks(blocks, packets);
            return leaves.count;
        }
        packets.resize(leaves.queries.len(), Packet::idle());
        for (packet, query) in packets.iter_mut().zip(leaves.queries.iter()) {
            let lanes = query.waiting::<ANY>();
            if lanes == 0 {
                *packet = Packet::idle();
                continue;
            }
            packet.aim(&scene.bvh, &query.rays, query.t.in_register(), lanes);
        }
        walk(&scene.bvh, packets, stack, &mut leaves, *traversal);
        if ANY {
            // What blocks a packet in part is at an edge of its shadow, and would be asked for nothing the next time.
            let dark = leaves.queries.last().is_some_and(Query::is_done);
            *suspect = leaves.blocker.or(*suspect).filter(|_| dark);
        }
        leaves.count
    }
}
