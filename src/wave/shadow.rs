//! Shadow rays of one light: what blocks them, and what tints them.
//!
//! Rays are first held against everything in the way, in any order: what blocks all light ends them, what is
//! see-through is only noted. Those with such a note then gather what the surfaces let through.

use super::filters::{Tinting, through};
use super::light_buffer::Cones;
use super::medium::Media;
use super::query::Query;
use super::queue::{Batch, Feelers, Packet, Queue};
use super::regroup::{Regrouping, WINDOW, gather};
use super::sums::Sums;
use super::trace::Tracer;
use crate::bvh::{Run, Traversal};
use crate::compile::Compiled;
use crate::lane::{LANES, Lane, Scalar, first_lanes};

/// Buffers for shadow rays.
pub struct ShadowTracer<S: Scalar> {
    batch: Batch<Feelers<S::Lane>>,
    queries: Vec<Query<S::Lane>>,
    tinting: Tinting,
    regrouping: Regrouping,
    /// Those of a batch that were put together anew.
    regrouped: Vec<Feelers<S::Lane>>,
    /// By light: see [`Tracer::occluded`].
    suspects: Vec<Option<Run>>,
}

impl<S: Scalar> ShadowTracer<S> {
    /// For rays that go through the tree this way.
    pub fn new(traversal: Traversal) -> Self {
        Self {
            batch: Batch::default(),
            queries: Vec::new(),
            tinting: Tinting::default(),
            regrouping: Regrouping::new(traversal),
            regrouped: Vec::new(),
            suspects: Vec::new(),
        }
    }

    /// Suspects nothing: what has blocked rays of another tile depends on which tile that was.
    pub fn begin_tile(&mut self) {
        self.suspects.clear();
    }

    /// Traces the ready packets of `queue`, which lead to light number `light` with these `cones` around it, and adds the light that arrives to
    /// `sums`.
    pub fn trace<B: Scalar>(
        &mut self,
        scene: &Compiled<S, B>,
        (light, cones, queue): (usize, Option<&Cones>, &mut Queue<Feelers<S::Lane>>),
        tracer: &mut Tracer<B>,
        media: &mut Media,
        sums: &mut Sums,
    ) {
        if self.suspects.len() <= light {
            self.suspects.resize(light + 1, None);
        }
        queue.take(&mut self.batch);
        let Self { batch, regrouping, regrouped, queries, tinting, suspects } = self;
        for window in batch.packets().chunks(WINDOW) {
            let starts = window.iter().map(|rays| (&rays.lines.rays.origin, rays.lanes));
            // (A few things with cones around them are no matter for a tree.)
            let order = if cones.is_none() { regrouping.order(starts) } else { None };
            let packets = match order {
                Some(order) => {
                    regroup(window, order, regrouped);
                    &*regrouped
                }
                None => window,
            };
            for group in packets.chunks(scene.geometry.group_size()) {
                aim(queries, group);
                let ways = tracer.occluded(&scene.geometry, queries, (&mut suspects[light], cones));
                for ((query, rays), way) in queries.iter_mut().zip(group).zip(ways) {
                    let lanes = rays.lanes & !query.hits();
                    let tinted = lanes & way.noted;
                    sums.add(&rays.sink, rays.light, lanes & !tinted);
                    if tinted != 0 {
                        let filter = through(scene, rays, (query, tinted), way, tinting, media);
                        sums.add(&rays.sink, rays.light.mul(filter), tinted);
                    }
                }
            }
        }
    }
}

/// Makes `regrouped` the rays of `packets` in this order.
fn regroup<L: Lane>(packets: &[Feelers<L>], order: &[u32], regrouped: &mut Vec<Feelers<L>>) {
    gather(order, regrouped, |packet, to, (from, lane)| packet.put(to, &packets[from], lane));
    for (packet, rays) in regrouped.iter_mut().zip(order.chunks(LANES)) {
        packet.lanes = first_lanes(rays.len());
    }
}

/// Makes `queries` ask for what is in the way of `group`.
fn aim<L: Lane>(queries: &mut Vec<Query<L>>, group: &[Feelers<L>]) {
    queries.resize(group.len(), Query::default());
    for (query, rays) in queries.iter_mut().zip(group) {
        query.aim(&rays.lines, rays.t_max, rays.lanes);
    }
}
