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
    starts: Column<Vec3<f32x8>>,
    dirs: Column<Vec3<f32x8>>,
    /// Where they begin to look, and where they end.
    limits: Column<[f32x8; 2]>,
    /// Lengths of their directions as they were given.
    lengths: Column<f64x8>,
    /// Rays.
    len: usize,
    query: RayQuery,
}

/// What packets of neighbouring rays have, past the end of the set that of the last ray; once, where all have the same: the eye that a
/// picture is seen from, or how far rays look.
enum Column<T> {
    Same(T),
    Each(Vec<T>),
}

impl<T: PartialEq> Column<T> {
    fn of(mut each: Vec<T>) -> Self {
        let same = each.windows(2).all(|two| two[0] == two[1]);
        match if same { each.pop() } else { None } {
            Some(one) => Self::Same(one),
            None => Self::Each(each),
        }
    }

    /// That of packet `number`.
    #[inline(always)]
    fn at(&self, number: usize) -> &T {
        match self {
            Self::Same(one) => one,
            Self::Each(each) => &each[number],
        }
    }

    /// The same, if there is such a packet and it has one of its own.
    #[inline(always)]
    fn own(&self, number: usize) -> Option<&T> {
        match self {
            Self::Same(_) => None,
            Self::Each(each) => each.get(number),
        }
    }
}

/// Buffers of a thread.
struct Buffers<S: Scalar, B: Scalar> {
    tracer: Tracer<B>,
    queries: Vec<Query<S::Lane>>,
    regrouping: Regrouping,
    /// Rays that were put together anew.
    regrouped: Vec<Regrouped>,
}

impl<S: Scalar, B: Scalar> Buffers<S, B> {
    /// For rays that go through the tree this way.
    fn new(traversal: Traversal) -> Self {
        let (queries, regrouped) = (Vec::with_capacity(GROUP), Vec::with_capacity(GROUP));
        let (tracer, regrouping) = (Tracer::with(traversal), Regrouping::new(traversal));
        Self { tracer, queries, regrouping, regrouped }
    }
}

/// Eight rays of a set.
#[derive(Clone, Copy)]
struct StreamPacket<'a> {
    origin: &'a Vec3<f32x8>,
    dir: &'a Vec3<f32x8>,
    limits: &'a [f32x8; 2],
    length: &'a f64x8,
}

/// Eight rays that need not be neighbours.
#[derive(Clone, Copy, Default)]
struct Regrouped {
    origin: Vec3<f32x8>,
    dir: Vec3<f32x8>,
    limits: [f32x8; 2],
    length: f64x8,
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
        let firsts = || (0..rays.len()).step_by(LANES);
        let starts = firsts().map(|first| vector(&rays.origin, first)).collect();
        let dirs: Vec<_> = firsts().map(|first| vector(&rays.dir, first)).collect();
        let limits = firsts().map(|first| [&rays.t_near, &rays.t_far].map(|column| lanes(column, first)));
        let (limits, lengths) = (limits.collect(), dirs.iter().map(lengths).collect());
        Self {
            starts: Column::of(starts),
            dirs: Column::of(dirs),
            limits: Column::of(limits),
            lengths: Column::of(lengths),
            len: rays.len(),
            query: rays.query,
        }
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
        self.lengths.at(row / LANES).lanes()[row % LANES]
    }

    /// Asks the memory for packet number `number`, if there is one.
    #[inline(always)]
    fn prefetch(&self, number: usize) {
        for column in [&self.starts, &self.dirs] {
            if let Some(Vec3 { x, z, .. }) = column.own(number) {
                // (Three columns of single precision lie in two lines, wherever they begin.)
                prefetch(x);
                prefetch(z);
            }
        }
        if let Some(limits) = self.limits.own(number) {
            prefetch(limits);
        }
        if let Some(lengths) = self.lengths.own(number) {
            prefetch(lengths);
        }
    }

    /// Packet number `number`.
    #[inline(always)]
    fn packet(&self, number: usize) -> StreamPacket<'_> {
        let Self { starts, dirs, limits, lengths, .. } = self;
        let (origin, dir) = (starts.at(number), dirs.at(number));
        StreamPacket { origin, dir, limits: limits.at(number), length: lengths.at(number) }
    }

    /// True if directions are as long as they were given.
    #[inline(always)]
    fn is_unit(&self) -> bool {
        matches!(&self.lengths, Column::Same(length) if *length == f64x8::lit(1.0))
    }
}

/// Lengths of directions.
fn lengths(dir: &Vec3<f32x8>) -> f64x8 {
    let dir = dir.cast::<f64x8>();
    let square = dir.dot(dir);
    let unit = (square - f64x8::lit(1.0)).abs().le(f64x8::lit(UNIT));
    unit.select(f64x8::lit(1.0), square.sqrt())
}

impl StreamPacket<'_> {
    /// Makes `query` ask for its `lanes`, in the space that has its zero at `origin` (see [`Geometry::origin`]); directions that are not
    /// of `unit` length become so.
    #[inline(always)]
    fn aim<L: Lane>(&self, unit: bool, lanes: u8, origin: DVec3, query: &mut Query<L>) {
        let Self { origin: start, dir: along, limits: &[t_near, t_far], length } = *self;
        let mut from = start.cast();
        if origin != DVec3::ZERO {
            from = (start.cast::<f64x8>() - Vec3::splat(origin)).cast();
        }
        let (mut dir, mut limits) = (along.cast(), [t_near.cast(), t_far.cast()]);
        if !unit {
            let inverse = f64x8::lit(1.0) / *length;
            dir = along.cast::<f64x8>().map(|x| x * inverse).cast();
            limits = [t_near, t_far].map(|t| (t.to_f64s() * *length).cast());
        }
        query.aim_free(&Rays { origin: from, dir }, limits, lanes);
    }
}

impl Regrouped {
    /// Lane `from` of `other` becomes lane `to`.
    #[inline(always)]
    fn put(&mut self, to: usize, other: &StreamPacket, from: usize) {
        put3(&mut self.origin, to, other.origin, from);
        put3(&mut self.dir, to, other.dir, from);
        for (limit, other) in self.limits.iter_mut().zip(other.limits) {
            put(limit, to, other, from);
        }
        put(&mut self.length, to, other.length, from);
    }

    fn packet(&self) -> StreamPacket<'_> {
        let Self { origin, dir, limits, length } = self;
        StreamPacket { origin, dir, limits, length }
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
    let (first, len, unit) = (first / LANES, surface.len(), stream.is_unit());
    let starts =
        (0..len.div_ceil(LANES)).map(|k| (stream.starts.at(first + k), first_lanes(len - k * LANES)));
    let Some(order) = regrouping.order(starts) else { return false };
    for group in order.chunks(scene.group_size() * LANES) {
        gather(group, regrouped, |packet, to, (from, lane)| {
            packet.put(to, &stream.packet(first + from), lane)
        });
        queries.resize(regrouped.len(), Query::default());
        for (packet, (query, rays)) in regrouped.iter().zip(queries.iter_mut().zip(group.chunks(LANES))) {
            packet.packet().aim(unit, first_lanes(rays.len()), scene.origin, query);
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
    let (group, unit) = (scene.group_size(), stream.is_unit());
    let half = group / 2;
    queries.resize(t.len().div_ceil(LANES), Query::default());
    for (k, query) in queries.iter_mut().enumerate() {
        let lanes = first_lanes(t.len() - k * LANES);
        stream.packet(first / LANES + k).aim(unit, lanes, scene.origin, query);
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
