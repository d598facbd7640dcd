//! Rays from outside through the compiled scene, in the order they come: the same packets, groups and walk as a
//! picture's waves, without the shading.

use super::query::Query;
use super::queue::{put, put3};
use super::regroup::{Regrouping, WINDOW, gather};
use super::trace::Tracer;
use crate::bvh::{GROUP, Occupancy, Traversal};
use crate::compile::{Geometry, NO_SURFACE, SurfaceId, class};
use crate::kernel::Rays;
use crate::lane::{LANES, Lane, Scalar, Vec3, bits, f32x8, f64x8, first_lanes, prefetch};
use crate::ray_set::{NO_PRIMITIVE, RayHits, RayQuery, RaySet};
use glam::DVec3;
use rayon::prelude::*;

/// A [`RaySet`] made ready: packets of rays in single precision, as the set has them, so that as little as can be is read from
/// memory while they are traced. Each packet is moved to the scene's space and precision when its turn comes.
pub struct RayStream {
    packets: Vec<StreamPacket>,
    /// Rays.
    len: usize,
    /// Length of each ray's direction as it was given, packet by packet; empty if all are 1.
    lengths: Vec<f64x8>,
    query: RayQuery,
}

/// Buffers of a thread.
struct Buffers<S: Scalar, B: Scalar> {
    tracer: Tracer<B>,
    queries: Vec<Query<S::Lane>>,
    regrouping: Regrouping,
    /// Rays that were put together anew.
    regrouped: Vec<(StreamPacket, f64x8)>,
}

impl<S: Scalar, B: Scalar> Buffers<S, B> {
    /// For rays that go through the tree this way.
    fn new(traversal: Traversal) -> Self {
        let (queries, regrouped) = (Vec::with_capacity(GROUP), Vec::with_capacity(GROUP));
        let (tracer, regrouping) = (Tracer::with(traversal), Regrouping::new(traversal));
        Self { tracer, queries, regrouping, regrouped }
    }
}

/// Eight neighbouring rays; past the end of the set, the last one again.
#[derive(Clone, Copy, Default)]
struct StreamPacket {
    rays: Rays<f32x8>,
    t_near: f32x8,
    t_far: f32x8,
}

/// What a stream's rays hit, row by row.
pub struct StreamHits<S> {
    /// How far off; of rays that only ask whether anything is there, nothing is written.
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

impl RayStream {
    /// Of `rays`.
    pub fn new(rays: &RaySet) -> Self {
        let last = rays.len().saturating_sub(1);
        let lanes = |column: &[f32], first: usize| f32x8::from_fn(|k| column[(first + k).min(last)]);
        let vector = |[x, y, z]: &[Vec<f32>; 3], first: usize| {
            Vec3::new(lanes(x, first), lanes(y, first), lanes(z, first))
        };
        let packet = |first: usize| StreamPacket {
            rays: Rays { origin: vector(&rays.origin, first), dir: vector(&rays.dir, first) },
            t_near: lanes(&rays.t_near, first),
            t_far: lanes(&rays.t_far, first),
        };
        let packets: Vec<_> = (0..rays.len()).step_by(LANES).map(packet).collect();
        let mut lengths: Vec<_> = packets.iter().map(StreamPacket::lengths).collect();
        if lengths.iter().flat_map(|lanes| *lanes.lanes()).all(|length| length == 1.0) {
            lengths.clear();
        }
        Self { packets, len: rays.len(), lengths, query: rays.query }
    }

    /// Rays.
    pub fn len(&self) -> usize {
        self.len
    }

    /// True without rays.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Length of a ray's direction as it was given.
    fn length(&self, row: usize) -> f64 {
        self.lengths.get(row / LANES).map_or(1.0, |lengths| lengths.lanes()[row % LANES])
    }

    /// Asks the memory for packet number `number`, if there is one.
    #[inline(always)]
    fn prefetch(&self, number: usize) {
        if let Some(StreamPacket { rays: Rays { origin, dir }, t_near, .. }) = self.packets.get(number) {
            // (A line holds two columns of single precision.)
            prefetch(&origin.x);
            prefetch(&origin.z);
            prefetch(&dir.y);
            prefetch(t_near);
        }
        if let Some(lengths) = self.lengths.get(number) {
            prefetch(lengths);
        }
    }

    /// Packet number `number`, of which `lanes` are rays, in the space that has its zero at `origin` (see
    /// [`Geometry::origin`]).
    #[inline(always)]
    fn aim<L: Lane>(&self, number: usize, lanes: u8, origin: DVec3, query: &mut Query<L>) {
        let length = self.lengths.get(number);
        self.packets[number].aim(length, lanes, origin, query);
    }
}

impl StreamPacket {
    /// Lane `from` of `other` becomes lane `to`.
    #[inline(always)]
    fn put(&mut self, to: usize, other: &Self, from: usize) {
        put3(&mut self.rays.origin, to, &other.rays.origin, from);
        put3(&mut self.rays.dir, to, &other.rays.dir, from);
        put(&mut self.t_near, to, &other.t_near, from);
        put(&mut self.t_far, to, &other.t_far, from);
    }

    /// See [`RayStream::aim`].
    #[inline(always)]
    fn aim<L: Lane>(&self, length: Option<&f64x8>, lanes: u8, origin: DVec3, query: &mut Query<L>) {
        let Self { rays, t_near, t_far } = self;
        let mut from = rays.origin.cast();
        if origin != DVec3::ZERO {
            from = (rays.origin.cast::<f64x8>() - Vec3::splat(origin)).cast();
        }
        let (mut dir, mut limits) = (rays.dir.cast(), [t_near.cast(), t_far.cast()]);
        if let Some(&length) = length {
            let inverse = f64x8::lit(1.0) / length;
            dir = rays.dir.cast::<f64x8>().map(|x| x * inverse).cast();
            limits = [t_near, t_far].map(|t| (t.to_f64s() * length).cast());
        }
        query.aim_free(&Rays { origin: from, dir }, limits, lanes);
    }

    /// Lengths of the directions.
    fn lengths(&self) -> f64x8 {
        let dir = self.rays.dir.cast::<f64x8>();
        let square = dir.dot(dir);
        let unit = (square - f64x8::lit(1.0)).abs().le(f64x8::lit(UNIT));
        unit.select(f64x8::lit(1.0), square.sqrt())
    }
}

impl<S: Scalar> StreamHits<S> {
    /// Room for the hits of a stream.
    pub fn new(stream: &RayStream) -> Self {
        Self { t: vec![S::default(); stream.len()], surface: vec![NO_SURFACE; stream.len()] }
    }

    /// In the terms of the set that the stream was made from.
    pub fn develop<B: Scalar>(&self, scene: &Geometry<S, B>, rays: &RaySet, stream: &RayStream) -> RayHits {
        let first = scene.first_place();
        let mut hits = RayHits::default();
        for (row, &surface) in self.surface.iter().enumerate() {
            let (t, primitive) = match (stream.query, surface) {
                (RayQuery::Any, NO_SURFACE) => (rays.t_far[row], 0),
                (RayQuery::Any, _) => (f32::NEG_INFINITY, 1),
                (RayQuery::Closest, NO_SURFACE) => (f32::INFINITY, NO_PRIMITIVE),
                (RayQuery::Closest, surface) => {
                    let t = self.t[row].to_f64() / stream.length(row);
                    (t as f32, scene.place_of(surface) - first)
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
    scene: &Geometry<S, B>,
    stream: &RayStream,
    traversal: Traversal,
    hits: &mut StreamHits<S>,
) {
    let chunks = hits.t.par_chunks_mut(CHUNK).zip(hits.surface.par_chunks_mut(CHUNK)).enumerate();
    chunks.with_max_len(MOST_CHUNKS).for_each_init(
        || Buffers::new(traversal),
        |buffers, (chunk, (t, surface))| trace_chunk(scene, stream, chunk * CHUNK, buffers, (t, surface)),
    );
}

/// Traces a stream with one thread and counts what is tested.
pub fn stream_occupancy<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    stream: &RayStream,
    traversal: Traversal,
) -> Occupancy {
    let (mut buffers, mut hits) = (Buffers::new(traversal), StreamHits::new(stream));
    buffers.tracer.count();
    trace_chunk(scene, stream, 0, &mut buffers, (&mut hits.t, &mut hits.surface));
    buffers.tracer.occupancy()
}

/// Traces the rays from `first` on, a multiple of a group, as many as there is room for.
fn trace_chunk<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    stream: &RayStream,
    first: usize,
    buffers: &mut Buffers<S, B>,
    (t, surface): (&mut [S], &mut [SurfaceId]),
) {
    if stream.query == RayQuery::Closest {
        return trace_in_groups(scene, stream, first, buffers, (t, surface));
    }
    let windows = t.chunks_mut(WINDOW * LANES).zip(surface.chunks_mut(WINDOW * LANES));
    for (window, (t, surface)) in windows.enumerate() {
        let first = first + window * WINDOW * LANES;
        if !trace_regrouped(scene, stream, first, buffers, surface) {
            trace_in_groups(scene, stream, first, buffers, (t, surface));
        }
    }
}

/// Traces the rays from `first` on as they come, as many as there is room for.
fn trace_in_groups<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    stream: &RayStream,
    first: usize,
    Buffers { tracer, queries, .. }: &mut Buffers<S, B>,
    (t, surface): (&mut [S], &mut [SurfaceId]),
) {
    let rays = scene.group_size() * LANES;
    let groups = t.chunks_mut(rays).zip(surface.chunks_mut(rays));
    for (group, (t, surface)) in groups.enumerate() {
        trace_group(scene, stream, first + group * rays, tracer, queries, t, surface);
    }
}

/// Whether anything is hit by the rays of a window from `first` on, as many as there is room for, if they had better be put together
/// anew: false where nothing was done, as they had not.
fn trace_regrouped<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    stream: &RayStream,
    first: usize,
    Buffers { tracer, queries, regrouping, regrouped }: &mut Buffers<S, B>,
    surface: &mut [SurfaceId],
) -> bool {
    let (first, len) = (first / LANES, surface.len());
    let packets = &stream.packets[first..first + len.div_ceil(LANES)];
    let starts =
        packets.iter().enumerate().map(|(k, packet)| (&packet.rays.origin, first_lanes(len - k * LANES)));
    let Some(order) = regrouping.order(starts) else { return false };
    let lengths = (!stream.lengths.is_empty()).then(|| &stream.lengths[first..]);
    for group in order.chunks(scene.group_size() * LANES) {
        gather(group, regrouped, |(packet, length), to, (from, lane)| {
            packet.put(to, &packets[from], lane);
            if let Some(lengths) = lengths {
                put(length, to, &lengths[from], lane);
            }
        });
        queries.resize(regrouped.len(), Query::default());
        for ((packet, length), (query, rays)) in
            regrouped.iter().zip(queries.iter_mut().zip(group.chunks(LANES)))
        {
            packet.aim(lengths.map(|_| length), first_lanes(rays.len()), scene.origin, query);
        }
        find_any(scene, tracer, queries);
        for (query, rays) in queries.iter().zip(group.chunks(LANES)) {
            for (&hit, &ray) in query.surface.iter().zip(rays) {
                surface[ray as usize] = hit;
            }
        }
    }
    true
}

/// Whether rays hit anything. What is see-through is hit, too: any surface stands for it.
fn find_any<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    tracer: &mut Tracer<B>,
    queries: &mut [Query<S::Lane>],
) {
    let ways = tracer.occluded(scene, queries, (&mut None, None));
    for (query, way) in queries.iter_mut().zip(ways) {
        for k in bits(way.noted) {
            query.surface[k] = 0;
        }
    }
}

/// Traces the rays from `first` on, as many as there is room for in `t`.
fn trace_group<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    stream: &RayStream,
    first: usize,
    tracer: &mut Tracer<B>,
    queries: &mut Vec<Query<S::Lane>>,
    t: &mut [S],
    surface: &mut [SurfaceId],
) {
    // The rays of the next group are asked for in two halves, some time apart: a core waits for so many lines at once, and stands
    // still for more.
    let group = scene.group_size();
    let half = group / 2;
    queries.resize(t.len().div_ceil(LANES), Query::default());
    for (k, query) in queries.iter_mut().enumerate() {
        let lanes = first_lanes(t.len() - k * LANES);
        stream.aim(first / LANES + k, lanes, scene.origin, query);
        if k >= half {
            stream.prefetch(first / LANES + k + group - half);
        }
    }
    match stream.query {
        RayQuery::Closest => tracer.nearest(scene, queries, class::CAMERA),
        RayQuery::Any => find_any(scene, tracer, queries),
    }
    for k in 0..half.min(queries.len()) {
        stream.prefetch(first / LANES + k + group + half);
    }
    copy_to_rows(queries, surface, |query| &query.surface);
    if stream.query == RayQuery::Closest {
        copy_to_rows(queries, t, |query| query.t.lanes());
    }
}

/// Copies what queries have of their rays to the rays' rows. (Whole packets by themselves: to copy a number of rows that is not known is
/// a call.)
#[inline(always)]
fn copy_to_rows<L: Lane, T: Copy>(
    queries: &[Query<L>],
    rows: &mut [T],
    of: impl for<'a> Fn(&'a Query<L>) -> &'a [T; LANES],
) {
    let (whole, last) = rows.as_chunks_mut::<LANES>();
    if let Some(query) = queries.get(whole.len()) {
        last.copy_from_slice(&of(query)[..last.len()]);
    }
    for (query, rows) in queries.iter().zip(whole) {
        *rows = *of(query);
    }
}
