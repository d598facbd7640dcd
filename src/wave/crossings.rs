//! What is see-through in the way of shadow rays: noted thing by thing while a walk looks for what blocks them, and
//! gone through crossing by crossing once nothing does.

use super::composite::{Comers, surfaces};
use super::instances::Placed;
use super::query::{Query, rounded, rounding_at};
use super::rows::Rows;
use crate::compile::{Geometry, SurfaceId, WithBlock, class};
use crate::csg::{Composite, Scratch};
use crate::kernel::{Block, Left, Rays};
use crate::lane::{LANES, Lane, Mask, Scalar, bits, each_lane, f64x8};
use glam::DVec3;
use std::cmp::Ordering;

/// Something that is see-through.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Transparent {
    /// A primitive, by its surface.
    Primitive(SurfaceId),
    /// A composite, by where its crossings stand in [`InTheWay::crossings`].
    Composite {
        /// From here on,
        first: u32,
        /// up to here.
        end: u32,
    },
}

/// What is see-through in the way of eight shadow rays.
#[derive(Debug, Default)]
pub struct InTheWay {
    /// Things in any order, and the rays that meet them.
    pub things: Vec<(Transparent, u8)>,
    /// Where rays cross composites: surfaces, distances and the rays these hold for. (Whether a ray meets a composite is as much work
    /// as where.)
    crossings: Vec<(SurfaceId, f64x8, u8)>,
    /// Rays that meet any.
    pub noted: u8,
}

impl InTheWay {
    /// Nothing.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.things.clear();
        self.crossings.clear();
        self.noted = 0;
    }

    /// Where rays cross a composite between two places of the list: surfaces, distances and the rays these hold for, in no order.
    #[inline(always)]
    pub fn crossed(&self, first: u32, end: u32) -> &[(SurfaceId, f64x8, u8)] {
        &self.crossings[first as usize..end as usize]
    }

    /// Hands what was noted of an instance on to the way through its scene, where surfaces have the numbers that `surface` gives.
    #[inline(always)]
    pub fn hand_to(&self, way: &mut Self, surface: impl Fn(SurfaceId) -> SurfaceId) {
        for &(thing, met) in &self.things {
            // (Composites that are see-through stand in no instance.)
            if let Transparent::Primitive(own) = thing {
                way.note(Transparent::Primitive(surface(own)), met);
            }
        }
    }

    /// Rays `met`, some at least, meet a thing.
    #[inline(always)]
    pub fn note(&mut self, thing: Transparent, met: u8) {
        self.things.push((thing, met));
        self.noted |= met;
    }
}

/// Notes on the `ways` of two packets which of their rays `lanes` meet a composite, and where. (Of one packet named twice the second has no
/// such rays.)
pub fn note_composite<S: Scalar, B: Scalar>(
    ways: &mut [InTheWay],
    scene: &Geometry<S, B>,
    composite: &Composite,
    comers: &mut Comers<S::Lane>,
    (which, lanes): ([usize; 2], [u8; 2]),
    scratch: &mut Scratch,
) {
    let (first, mut met) = (which.map(|k| ways[k].crossings.len() as u32), [0; 2]);
    let looking = (which, lanes, class::FILTERS);
    surfaces(scene, composite, comers, looking, scratch, |k, surface, t, crossed| {
        ways[which[k]].crossings.push((surface, t, crossed));
        met[k] |= crossed;
    });
    for (k, met) in met.into_iter().enumerate() {
        if met != 0 {
            let way = &mut ways[which[k]];
            way.note(Transparent::Composite { first: first[k], end: way.crossings.len() as u32 }, met);
        }
    }
}

/// Notes which rays of a packet meet the rows of a run; how many rows were tested.
pub struct NoteRun<'a, S: Scalar> {
    pub rows: Rows<'a>,
    pub query: &'a Query<S::Lane>,
    pub lanes: u8,
    pub way: &'a mut InTheWay,
}

impl<S: Scalar> WithBlock<S> for NoteRun<'_, S> {
    type Output = u32;

    fn block<K: Block<S>>(self, block: &K) -> u32 {
        let Self { rows: Rows { run, base, .. }, query, lanes, way } = self;
        let mut tested = 0;
        let starts_here = query.starts_within(base + run.first, run.len);
        for row in run.first..run.first + run.len {
            let surface = base + row;
            let on = if starts_here { query.lanes_on(surface) & lanes } else { 0 };
            let left = Left { on: Mask::from_bits(on), part: query.part };
            let gone = if on != 0 { block.left_behind(row as usize, &query.rays, &left) } else { 0 };
            let lanes = lanes & !gone;
            if lanes == 0 {
                continue;
            }
            let left = (on != 0).then_some(&left);
            let t = block.first(row as usize, &query.rays, left, &query.looking(lanes, false));
            tested += 1;
            // (Nothing is nearer than a miss, which is NaN.)
            let met = t.lt(query.t).bits() & lanes;
            if met != 0 {
                way.note(Transparent::Primitive(surface), met);
            }
        }
        tested
    }
}

/// Where a ray crosses a surface.
#[derive(Debug, Clone, Copy)]
pub struct Crossing {
    /// Distance along the ray.
    pub t: f64,
    /// Of surfaces at one place the first declared counts.
    pub rank: u32,
    /// What is crossed.
    pub surface: SurfaceId,
    /// What it lets through, if that is one colour.
    pub tint: Option<[f32; 3]>,
}

impl Crossing {
    /// By distance, then by rank.
    pub fn order(&self, other: &Self) -> Ordering {
        self.t.total_cmp(&other.t).then(self.rank.cmp(&other.rank))
    }
}

/// The crossings of eight rays with several things, ray by ray and in order; a buffer.
#[derive(Debug, Default)]
pub struct Crossings {
    lanes: [Vec<Crossing>; LANES],
    /// How many of each ray's have been gone through.
    passed: [usize; LANES],
}

impl Crossings {
    /// Becomes those of the rays `lanes` of `query` with what is in their `way`, whose surfaces `tint` knows.
    pub fn find<S: Scalar, B: Scalar>(
        &mut self,
        scene: &Geometry<S, B>,
        query: &Query<S::Lane>,
        way: &InTheWay,
        lanes: u8,
        mut tint: impl FnMut(SurfaceId) -> Option<[f32; 3]>,
    ) {
        let Self { lanes: found, passed } = self;
        found.iter_mut().for_each(Vec::clear);
        *passed = [0; LANES];
        for &(thing, met) in way.things.iter().filter(|(_, met)| met & lanes != 0) {
            let met = met & lanes;
            match thing {
                Transparent::Primitive(surface) => {
                    let (rank, tint) = (scene.place_of(surface), tint(surface));
                    each_crossing(scene, query, surface, met, |t| {
                        let crossed = (t.gt(query.t_min) & t.lt(query.t)).bits() & met;
                        for lane in bits(crossed) {
                            let t = t.lanes()[lane].to_f64();
                            found[lane].push(Crossing { t, rank, surface, tint });
                        }
                    });
                }
                Transparent::Composite { first, end } => {
                    let before = each_lane(|lane| found[lane].len());
                    for &(surface, t, crossed) in way.crossed(first, end) {
                        let (rank, tint) = (scene.ranks.of(surface), tint(surface));
                        for lane in bits(crossed & met) {
                            found[lane].push(Crossing { t: t.lanes()[lane], rank, surface, tint });
                        }
                    }
                    for lane in bits(met) {
                        found[lane][before[lane]..].sort_unstable_by(Crossing::order);
                        let line = (query.rays.origin.lane(lane), query.rays.dir.lane(lane));
                        settle::<S>(&mut found[lane], before[lane], line);
                    }
                }
            }
        }
        for crossings in found {
            crossings.sort_unstable_by(Crossing::order);
        }
    }

    /// All of one ray's.
    #[inline(always)]
    pub fn of(&self, lane: usize) -> &[Crossing] {
        &self.lanes[lane]
    }

    /// The next of a ray's that lies beyond `after`.
    pub fn next(&mut self, lane: usize, after: f64) -> Option<Crossing> {
        let (crossings, passed) = (&self.lanes[lane], &mut self.passed[lane]);
        let next = *passed + crossings[*passed..].iter().position(|crossing| crossing.t > after)?;
        *passed = next + 1;
        Some(crossings[next])
    }
}

/// A crossing is off by one rounding of its distance in the scene's precision, and the sum with this by another; four are two places.
pub const T_ROUNDINGS: f64 = 4.0;

/// Drops those of a ray's crossings with a composite, which come in order, that are at one place with the one before, and rounds the
/// others to the scene's precision.
pub fn settle<S: Scalar>(crossings: &mut Vec<Crossing>, first: usize, line: (DVec3, DVec3)) {
    let (mut kept, mut beyond) = (first, f64::NEG_INFINITY);
    for k in first..crossings.len() {
        let crossing = crossings[k];
        if crossing.t > beyond {
            // Near the middle of the scene points are known better than what the crossing itself is rounded by.
            let t = rounded::<S>(crossing.t);
            let rounding = rounding_at::<S>(line, t).max(t * (T_ROUNDINGS * S::UNIT_ROUNDOFF));
            beyond = rounded::<S>(t + rounding);
            crossings[kept] = Crossing { t, ..crossing };
            kept += 1;
        }
    }
    crossings.truncate(kept);
}

/// Hands on the crossings of the rays of `query`, of which `lanes` are of interest, with one primitive, the nearest first.
#[inline(always)]
pub fn each_crossing<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    query: &Query<S::Lane>,
    surface: SurfaceId,
    lanes: u8,
    crossed: impl FnMut(S::Lane),
) {
    match scene.ranks.stretch(surface) {
        None => each_crossing_here(scene, query, surface, lanes, crossed),
        Some(row) => each_crossing_within(&Placed::of(scene, row as u32), query, surface, lanes, crossed),
    }
}

/// The same with what stands in an instance. (A call: inlined, it would make heaps of glass a sixth slower that have none.)
#[cold]
#[inline(never)]
fn each_crossing_within<S: Scalar, B: Scalar>(
    placed: &Placed<S, B>,
    query: &Query<S::Lane>,
    surface: SurfaceId,
    lanes: u8,
    mut crossed: impl FnMut(S::Lane),
) {
    let (moved, length) = placed.rays(query, lanes);
    let crossed = |t: S::Lane| crossed(t / length);
    each_crossing_here(placed.prototype, &moved, placed.own(surface), lanes, crossed);
}

/// The same with what stands in no instance.
#[inline(always)]
fn each_crossing_here<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    query: &Query<S::Lane>,
    surface: SurfaceId,
    lanes: u8,
    crossed: impl FnMut(S::Lane),
) {
    let on = query.lanes_on(surface) & lanes;
    let left = Left { on: Mask::from_bits(on), part: query.part };
    let left = (on != 0).then_some(&left);
    let (kind, row) = scene.row_of(surface);
    scene.columns.with(kind, EachCrossing { row: row as usize, rays: &query.rays, left, crossed });
}

/// See [`each_crossing_here`].
struct EachCrossing<'a, L, F> {
    row: usize,
    rays: &'a Rays<L>,
    left: Option<&'a Left<L>>,
    crossed: F,
}

impl<S: Scalar, F: FnMut(S::Lane)> WithBlock<S> for EachCrossing<'_, S::Lane, F> {
    type Output = ();

    fn block<K: Block<S>>(mut self, block: &K) {
        block.roots(self.row, self.rays, self.left).as_ref().iter().for_each(|&t| (self.crossed)(t));
    }
}
