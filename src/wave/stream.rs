//! Rays from outside through the compiled scene, in the order they come: the same packets, groups and walk as a
//! picture's waves, without the shading.

use super::query::Query;
use super::queue::{put, put3};
use super::regroup::{Regrouping, WINDOW, gather};
use super::trace::Tracer;
use crate::bvh::{GROUP, Occupancy, Traversal};
use crate::compile::{Geometry, NO_SURFACE, SurfaceId, class};
use crate::kernel::Rays;
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3, bits, f32x8, f64x8, first_lanes, prefetch};
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
    /// Of their directions.
    lengths: Lengths,
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

/// What is known of the lengths of a set's directions. Those that are not 1 are computed when their rays' turn comes, which takes less
/// time than to read them from memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Lengths {
    /// All are of unit length.
    Unit,
    /// All have squares that are well within single precision: rays are made ready in the precision that they are traced in.
    Single,
    /// The square of one or another would be infinite there, or lose its digits: made ready in double.
    Double,
}

/// Squares of lengths that are well within single precision: what is too small for it in the sum does not count beside the rest.
const SINGLE: std::ops::RangeInclusive<f64> = 1e-30..=1e30;

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
}

/// Eight rays that need not be neighbours.
#[derive(Clone, Copy, Default)]
struct Regrouped {
    origin: Vec3<f32x8>,
    dir: Vec3<f32x8>,
    limits: [f32x8; 2],
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
        let lengths = dirs.iter().map(Lengths::of).max().unwrap_or(Lengths::Unit);
        let (starts, dirs, limits) = (Column::of(starts), Column::of(dirs), Column::of(limits.collect()));
        Self { starts, dirs, limits, lengths, len: rays.len(), query: rays.query }
    }

    /// Rays.
    pub fn len(&self) -> usize {
        self.len
    }

    /// True without rays.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Length of a ray's direction as it was given, if it is traced in the precision of `L`.
    fn length<L: Lane>(&self, row: usize) -> f64 {
        let (dirs, lane) = (self.dirs.at(row / LANES), row % LANES);
        match self.lengths {
            Lengths::Unit => 1.0,
            Lengths::Single => lengths::<L>(dirs.cast()).lanes()[lane].to_f64(),
            Lengths::Double => lengths::<f64x8>(dirs.cast()).lanes()[lane],
        }
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
    }

    /// Packet number `number`.
    #[inline(always)]
    fn packet(&self, number: usize) -> StreamPacket<'_> {
        let Self { starts, dirs, limits, .. } = self;
        StreamPacket { origin: starts.at(number), dir: dirs.at(number), limits: limits.at(number) }
    }
}

impl Lengths {
    /// Of these directions.
    fn of(dirs: &Vec3<f32x8>) -> Self {
        let dirs = dirs.cast::<f64x8>();
        let squares = dirs.dot(dirs);
        if is_unit(squares).all() {
            return Self::Unit;
        }
        if squares.lanes().iter().all(|square| SINGLE.contains(square)) { Self::Single } else { Self::Double }
    }
}

/// Which squares of lengths are as good as 1.
#[inline(always)]
fn is_unit<L: Lane>(squares: L) -> Mask<L> {
    (squares - L::lit(1.0)).abs().le(L::lit(UNIT))
}

/// Lengths of directions.
#[inline(always)]
fn lengths<L: Lane>(dirs: Vec3<L>) -> L {
    let squares = dirs.dot(dirs);
    is_unit(squares).select(L::lit(1.0), squares.sqrt())
}

impl StreamPacket<'_> {
    /// Makes `query` ask for its `lanes`, in the space that has its zero at `origin` (see [`Geometry::origin`]); directions become of unit
    /// length.
    #[inline(always)]
    fn aim<L: Lane>(&self, lengths: Lengths, lanes: u8, origin: DVec3, query: &mut Query<L>) {
        let mut from = self.origin.cast();
        if origin != DVec3::ZERO {
            from = (self.origin.cast::<f64x8>() - Vec3::splat(origin)).cast();
        }
        let (dir, limits) = match lengths {
            Lengths::Unit => (self.dir.cast(), self.limits.map(|t| t.cast())),
            Lengths::Single => self.of_unit_length(),
            Lengths::Double => {
                let (dir, limits) = self.of_unit_length::<f64x8>();
                (dir.cast(), limits.map(|t| t.cast()))
            }
        };
        query.aim_free(&Rays { origin: from, dir }, limits, lanes);
    }

    /// Directions, and limits in their length.
    #[inline(always)]
    fn of_unit_length<L: Lane>(&self) -> (Vec3<L>, [L; 2]) {
        let dir = self.dir.cast::<L>();
        let length = lengths(dir);
        let inverse = L::lit(1.0) / length;
        (dir.map(|x| x * inverse), self.limits.map(|t| t.cast::<L>() * length))
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
    }

    fn packet(&self) -> StreamPacket<'_> {
        let Self { origin, dir, limits } = self;
        StreamPacket { origin, dir, limits }
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
                    let t = self.t[row].to_f64() / stream.length::<S::Lane>(row);
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
    let (first, len, lengths) = (first / LANES, surface.len(), stream.lengths);
    let starts =
        (0..len.div_ceil(LANES)).map(|k| (stream.starts.at(first + k), first_lanes(len - k * LANES)));
    let Some(order) = regrouping.order(starts) else { return false };
    for group in order.chunks(scene.group_size() * LANES) {
        gather(group, regrouped, |packet, to, (from, lane)| {
            packet.put(to, &stream.packet(first + from), lane)
        });
        queries.resize(regrouped.len(), Query::default());
        for (packet, (query, rays)) in regrouped.iter().zip(queries.iter_mut().zip(group.chunks(LANES))) {
            packet.packet().aim(lengths, first_lanes(rays.len()), scene.origin, query);
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
    let (group, lengths) = (scene.group_size(), stream.lengths);
    let half = group / 2;
    queries.resize(t.len().div_ceil(LANES), Query::default());
    for (k, query) in queries.iter_mut().enumerate() {
        let lanes = first_lanes(t.len() - k * LANES);
        stream.packet(first / LANES + k).aim(lengths, lanes, scene.origin, query);
        if k >= half {
            stream.prefetch(first / LANES + k + group - half);
        }
    }
    match stream.query {
        RayQuery::Closest => {
            tracer.nearest(scene, queries, class::CAMERA);
            tracer.settle(scene, queries);
        }
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
