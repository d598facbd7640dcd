//! Rays from outside through the compiled scene, in the order they come: the same packets, groups and walk as a
//! picture's waves, without the shading.

use super::query::{GROUP, Query};
use super::queue::Lines;
use super::trace::Tracer;
use crate::bvh::{Occupancy, Traversal};
use crate::compile::{Compiled, NO_SURFACE, SurfaceId, class};
use crate::kernel::Rays;
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3};
use crate::ray_set::{NO_PRIMITIVE, RayHits, RayQuery, RaySet};
use glam::DVec3;
use rayon::prelude::*;

/// A [`RaySet`] made ready: packets of unit directions in the scene's precision, starts in its space.
pub struct RayStream<S: Scalar> {
    packets: Vec<StreamPacket<S::Lane>>,
    /// Length of each ray's direction as it was given.
    length: Vec<f64>,
    query: RayQuery,
}

/// Eight neighbouring rays; past the end of the set, the last one again.
struct StreamPacket<L> {
    lines: Lines<L>,
    t_near: L,
    t_far: L,
}

/// What a stream's rays hit, row by row.
pub struct StreamHits<S> {
    t: Vec<S>,
    surface: Vec<SurfaceId>,
}

/// Rays that a thread takes at a time.
const CHUNK: usize = 4096;
/// And so many of them before others may have the rest: left to itself, rayon cuts the work of two threads in four.
const MOST_CHUNKS: usize = 4;

/// A direction whose length squared is this near to 1 is taken as it is: it was made a unit vector in single
/// precision, and to do it again would only turn it by another rounding.
const UNIT: f64 = 8.0 * f32::EPSILON as f64;

impl<S: Scalar> RayStream<S> {
    /// Rounds `rays` to precision `S`, relative to `origin` (see [`Compiled::origin`]).
    pub fn new(rays: &RaySet, origin: DVec3) -> Self {
        let vector = |columns: &[Vec<f32>; 3], row: usize| {
            DVec3::from_array(std::array::from_fn(|axis| f64::from(columns[axis][row])))
        };
        let of_length = |row: usize| {
            let square = vector(&rays.dir, row).length_squared();
            if (square - 1.0).abs() <= UNIT { 1.0 } else { square.sqrt() }
        };
        let length: Vec<f64> = (0..rays.len()).map(of_length).collect();
        let packet = |first: usize| {
            let row = |k: usize| (first + k).min(rays.len() - 1);
            let scaled = |column: &[f32]| {
                S::Lane::from_fn(|k| S::from_f64(f64::from(column[row(k)]) * length[row(k)]))
            };
            let lines = Rays {
                origin: Vec3::from_fn(|k| vector(&rays.origin, row(k)) - origin),
                dir: Vec3::from_fn(|k| vector(&rays.dir, row(k)) / length[row(k)]),
            };
            StreamPacket {
                lines: Lines { rays: lines, left: [NO_SURFACE; LANES], part: [0; LANES] },
                t_near: scaled(&rays.t_near),
                t_far: scaled(&rays.t_far),
            }
        };
        let packets = (0..rays.len()).step_by(LANES).map(packet).collect();
        Self { packets, length, query: rays.query }
    }

    /// Rays.
    pub fn len(&self) -> usize {
        self.length.len()
    }

    /// True without rays.
    pub fn is_empty(&self) -> bool {
        self.length.is_empty()
    }
}

impl<S: Scalar> StreamHits<S> {
    /// Room for the hits of a stream.
    pub fn new(stream: &RayStream<S>) -> Self {
        Self { t: vec![S::default(); stream.len()], surface: vec![NO_SURFACE; stream.len()] }
    }

    /// In the terms of the set that the stream was made from.
    pub fn develop<B: Scalar>(
        &self,
        scene: &Compiled<S, B>,
        rays: &RaySet,
        stream: &RayStream<S>,
    ) -> RayHits {
        let first = scene.rank.iter().copied().min().unwrap_or(0);
        let mut hits = RayHits::default();
        for (row, &surface) in self.surface.iter().enumerate() {
            let (t, primitive) = match (stream.query, surface) {
                (RayQuery::Any, NO_SURFACE) => (rays.t_far[row], 0),
                (RayQuery::Any, _) => (f32::NEG_INFINITY, 1),
                (RayQuery::Closest, NO_SURFACE) => (f32::INFINITY, NO_PRIMITIVE),
                (RayQuery::Closest, surface) => {
                    let t = self.t[row].to_f64() / stream.length[row];
                    (t as f32, scene.rank[surface as usize] - first)
                }
            };
            hits.t.push(t);
            hits.primitive.push(primitive);
        }
        hits
    }
}

/// Traces a stream with the threads of the current pool.
pub fn trace_stream<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    stream: &RayStream<S>,
    traversal: Traversal,
    hits: &mut StreamHits<S>,
) {
    let chunks = hits.t.par_chunks_mut(CHUNK).zip(hits.surface.par_chunks_mut(CHUNK)).enumerate();
    chunks.with_max_len(MOST_CHUNKS).for_each_init(
        || (Tracer::with(traversal), Vec::with_capacity(GROUP)),
        |(tracer, queries), (chunk, (t, surface))| {
            trace_chunk(scene, stream, chunk * CHUNK, tracer, queries, (t, surface));
        },
    );
}

/// Traces a stream with one thread and counts what is tested.
pub fn stream_occupancy<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    stream: &RayStream<S>,
    traversal: Traversal,
) -> Occupancy {
    let (mut tracer, mut queries) = (Tracer::with(traversal), Vec::with_capacity(GROUP));
    tracer.count();
    let mut hits = StreamHits::new(stream);
    trace_chunk(scene, stream, 0, &mut tracer, &mut queries, (&mut hits.t, &mut hits.surface));
    tracer.occupancy()
}

/// Traces the rays from `first` on, a multiple of a group, as many as there is room for.
fn trace_chunk<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    stream: &RayStream<S>,
    first: usize,
    tracer: &mut Tracer<B>,
    queries: &mut Vec<Query<S::Lane>>,
    (t, surface): (&mut [S], &mut [SurfaceId]),
) {
    let groups = t.chunks_mut(GROUP * LANES).zip(surface.chunks_mut(GROUP * LANES));
    for (group, (t, surface)) in groups.enumerate() {
        trace_group(scene, stream, first + group * GROUP * LANES, tracer, queries, t, surface);
    }
}

/// Traces the rays from `first` on, as many as there is room for in `t`.
fn trace_group<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    stream: &RayStream<S>,
    first: usize,
    tracer: &mut Tracer<B>,
    queries: &mut Vec<Query<S::Lane>>,
    t: &mut [S],
    surface: &mut [SurfaceId],
) {
    queries.clear();
    for (k, packet) in stream.packets[first / LANES..].iter().take(t.len().div_ceil(LANES)).enumerate() {
        let lanes = Mask::<S::Lane>::first(t.len() - k * LANES).bits();
        let mut query = Query::new(&packet.lines, packet.t_far, lanes);
        query.t_min = packet.t_near;
        queries.push(query);
    }
    match stream.query {
        RayQuery::Closest => tracer.nearest(scene, queries, class::CAMERA),
        RayQuery::Any => {
            // What is see-through is hit, too: any surface stands for it.
            let noted = tracer.occluded(scene, queries, &mut None);
            for (query, noted) in queries.iter_mut().zip(noted) {
                for k in (0..LANES).filter(|k| noted.lanes >> k & 1 == 1) {
                    query.surface[k] = 0;
                }
            }
        }
    }
    let lanes = t.chunks_mut(LANES).zip(surface.chunks_mut(LANES));
    for (query, (t, surface)) in queries.iter().zip(lanes) {
        let n = t.len();
        t.copy_from_slice(&query.t.to_array()[..n]);
        surface.copy_from_slice(&query.surface[..n]);
    }
}
