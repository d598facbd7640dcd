//! Shadow rays of one light: what blocks them, and what tints them.
//!
//! Rays are first held against everything in the way, in any order: what blocks all light ends them, what is
//! see-through is only noted. Those with such a note then gather what the surfaces let through.

use super::filters::{Tinting, through};
use super::light_buffer::Cones;
use super::medium::Media;
use super::query::Query;
use super::queue::{Batch, Feelers, Queue};
use super::sums::Sums;
use super::trace::Tracer;
use crate::bvh::Run;
use crate::compile::Compiled;
use crate::lane::{Lane, Scalar};

/// Buffers for shadow rays.
#[derive(Default)]
pub struct ShadowTracer<S: Scalar> {
    batch: Batch<Feelers<S::Lane>>,
    queries: Vec<Query<S::Lane>>,
    tinting: Tinting,
    /// By light: see [`Tracer::occluded`].
    suspects: Vec<Option<Run>>,
}

impl<S: Scalar> ShadowTracer<S> {
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
        for group in self.batch.packets().chunks(scene.geometry.group_size()) {
            aim(&mut self.queries, group);
            let ways =
                tracer.occluded(&scene.geometry, &mut self.queries, (&mut self.suspects[light], cones));
            for ((query, rays), way) in self.queries.iter_mut().zip(group).zip(ways) {
                let lanes = rays.lanes & !query.hits();
                let tinted = lanes & way.noted;
                sums.add(&rays.sink, rays.light, lanes & !tinted);
                if tinted != 0 {
                    let filter = through(scene, rays, (query, tinted), way, &mut self.tinting, media);
                    sums.add(&rays.sink, rays.light.mul(filter), tinted);
                }
            }
        }
    }
}

/// Makes `queries` ask for what is in the way of `group`.
fn aim<L: Lane>(queries: &mut Vec<Query<L>>, group: &[Feelers<L>]) {
    queries.resize(group.len(), Query::default());
    for (query, rays) in queries.iter_mut().zip(group) {
        query.aim(&rays.lines, rays.t_max, rays.lanes);
    }
}
