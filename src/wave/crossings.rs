//! What is see-through in the way of shadow rays: noted thing by thing while a walk looks for what blocks them, and
//! gone through crossing by crossing once nothing does.

use super::query::Query;
use super::rows::Rows;
use crate::bvh::Count;
use crate::compile::{Geometry, SurfaceId, WithBlock};
use crate::kernel::{Block, Left, Looking, Rays, View};
use crate::lane::{LANES, Lane, Mask, Scalar, bits};

/// What is see-through in the way of eight shadow rays.
#[derive(Debug, Default)]
pub struct InTheWay {
    /// Primitives in any order, and the rays that meet them.
    pub rows: Vec<(SurfaceId, u8)>,
    /// Rays that meet any.
    pub noted: u8,
    /// Rays that meet composites, too, which do not tell all of their crossings.
    pub untold: u8,
}

impl InTheWay {
    /// Nothing.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.rows.clear();
        (self.noted, self.untold) = (0, 0);
    }
}

/// Notes which rays of a packet meet the rows of a run.
pub struct NoteRun<'a, S: Scalar, C: Count> {
    pub rows: Rows<'a>,
    pub query: &'a Query<S::Lane>,
    pub view: &'a View<S::Lane>,
    pub lanes: u8,
    pub way: &'a mut InTheWay,
    pub count: &'a mut C,
}

impl<S: Scalar, C: Count> WithBlock<S> for NoteRun<'_, S, C> {
    type Output = ();

    #[inline(always)]
    fn block<K: Block<S>>(self, block: &K) {
        let Self { rows: Rows { run, base, .. }, query, view, lanes, way, count } = self;
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
            let looking = Looking { from: query.t_min, to: query.t, lanes };
            let t = block.first(row as usize, &query.rays, view, left, &looking);
            count.leaf(lanes.count_ones());
            // (Nothing is nearer than a miss, which is NaN.)
            let met = t.lt(query.t).bits() & lanes;
            if met != 0 {
                way.noted |= met;
                way.rows.push((surface, met));
            }
        }
    }
}

/// Where a ray crosses a surface.
#[derive(Debug, Clone, Copy)]
pub struct Crossing {
    /// Distance along the ray.
    pub t: f64,
    /// Of surfaces at one place the first declared counts.
    rank: u32,
    /// Which of the rows that it was found in.
    pub row: u32,
}

/// The crossings of eight rays with several things, ray by ray and in order; a buffer.
#[derive(Debug, Default)]
pub struct Crossings {
    lanes: [Vec<Crossing>; LANES],
    /// How many of each ray's have been gone through.
    passed: [usize; LANES],
}

impl Crossings {
    /// Becomes those of the rays `lanes` of `query` with `rows`.
    pub fn find<S: Scalar, B: Scalar>(
        &mut self,
        scene: &Geometry<S, B>,
        query: &Query<S::Lane>,
        rows: &[(SurfaceId, u8)],
        lanes: u8,
    ) {
        self.lanes.iter_mut().for_each(Vec::clear);
        self.passed = [0; LANES];
        for (row, &(surface, met)) in (0u32..).zip(rows).filter(|(_, (_, met))| met & lanes != 0) {
            let rank = scene.ranks.of(surface);
            each_crossing(scene, query, surface, met & lanes, |t| {
                let crossed = (t.gt(query.t_min) & t.lt(query.t)).bits() & met & lanes;
                for lane in bits(crossed) {
                    self.lanes[lane].push(Crossing { t: t.lanes()[lane].to_f64(), rank, row });
                }
            });
        }
        for crossings in &mut self.lanes {
            crossings.sort_unstable_by(|a, b| a.t.total_cmp(&b.t).then(a.rank.cmp(&b.rank)));
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

/// Hands on the crossings of the rays of `query`, of which `lanes` are of interest, with one primitive, the nearest first.
#[inline(always)]
pub fn each_crossing<S: Scalar, B: Scalar>(
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

/// See [`each_crossing`].
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
