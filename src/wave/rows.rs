//! The test of a run of primitives of one kind: by one packet, or by a single ray against four rows.

use super::query::Query;
use crate::bvh::{Count, Packets, Run};
use crate::compile::{SurfaceId, WithBlock};
use crate::kernel::{Block, Center, Left, Looking, PluckerLines, Ranks, Ray, Rays, Screened};
use crate::lane::{LANES, Lane, Mask, QUAD, Quad, Scalar, choose, first_and_last};

/// How the rays of a group of packets see corners: nothing in scenes that have no triangles.
pub struct Views<'a, S: Scalar> {
    /// The rays as lines, by packet, and what about.
    pub lines: &'a mut Vec<PluckerLines>,
    pub center: Center<S>,
    /// Packets with rays that start on a surface.
    pub starting: Packets,
}

impl<'a, S: Scalar> Views<'a, S> {
    /// Of no rays, with room for their lines.
    #[inline(always)]
    pub fn none(lines: &'a mut Vec<PluckerLines>) -> Self {
        Self { lines, center: Center::default(), starting: 0 }
    }

    /// Becomes those of the rays of `queries`. Where all of them go `to_light`, which is tried, that is what they are seen from: their
    /// lines have it in common. (In place: views are large, and most scenes need none.)
    #[inline(always)]
    pub fn see(&mut self, queries: &[Query<S::Lane>], to_light: bool) {
        let (Some(first), Some(last)) = (queries.first(), queries.last()) else { return };
        for (k, query) in queries.iter().enumerate() {
            self.starting |= Packets::from(query.starts()) << k;
        }
        if to_light {
            let ends =
                [(&first.rays, first_and_last(first.lanes).0), (&last.rays, first_and_last(last.lanes).1)];
            if let Some(light) = Center::where_meet(ends) {
                self.see_from(light, queries);
                if self.center.is_common() {
                    return;
                }
            }
        }
        self.see_from(Center::at_start(&first.rays), queries);
    }

    #[inline(always)]
    fn see_from(&mut self, center: Center<S>, queries: &[Query<S::Lane>]) {
        self.center = center;
        if self.lines.len() < queries.len() {
            self.lines.resize(queries.len(), PluckerLines::default());
        }
        self.center.take_in(queries.iter().map(|query| (&query.rays, query.lanes)), self.lines);
    }
}

/// The test of a run of one kind by one ray, four rows at a time: whether anything nearer was found; `None` for kinds that
/// cannot.
pub struct TestAcross<'a, S: Scalar, C: Count> {
    pub rows: Rows<'a>,
    /// That of the ray's packet.
    pub query: &'a mut Query<S::Lane>,
    pub lone: &'a Lone<S>,
    pub count: &'a mut C,
}

/// A ray that walks alone.
pub struct Lone<S: Scalar> {
    /// Number of its packet.
    pub packet: usize,
    /// Its lane there.
    pub lane: usize,
    ray: Ray<S>,
    t_min: S,
    /// The surface it starts on.
    left: SurfaceId,
}

impl<S: Scalar> Lone<S> {
    /// The ray in lane `lane` of packet `packet`; it sees corners if `to_corners`.
    #[inline(always)]
    pub fn of(query: &Query<S::Lane>, (packet, lane): (usize, usize), to_corners: bool) -> Self {
        let (ray, t_min) = (Ray::of(&query.rays, lane, to_corners), query.t_min.lanes()[lane]);
        Self { packet, lane, ray, t_min, left: query.left[lane] }
    }
}

impl<S: Scalar, C: Count> WithBlock<S> for TestAcross<'_, S, C> {
    type Output = Option<bool>;

    #[inline(always)]
    fn block<K: Block<S>>(self, block: &K) -> Option<bool> {
        let Self { rows: Rows { run, base, ranks }, query, lone, count } = self;
        if !K::ACROSS {
            return None;
        }
        let &Lone { lane, ref ray, t_min, left, .. } = lone;
        let lane = lane & (LANES - 1);
        let mut found = false;
        let (end, mut first) = (run.first + run.len, run.first - run.first % FOUR);
        let mut rows = !0u32 << (run.first % FOUR); // Those of this run among the four, and any number after them.
        while first < end {
            rows &= !(!0 << (end - first).min(FOUR));
            count.leaf(1, rows.count_ones());
            let left = left.wrapping_sub(base + first);
            let left = if left < FOUR { 1 << left } else { 0 };
            let limits = (t_min, query.t.lanes()[lane]);
            let (t, near) = block.near_in_four((first / FOUR) as usize, ray, limits, left);
            let mut near = near & rows as u8;
            rows = !0;
            if near != 0 {
                let t = t.to_array();
                while near != 0 {
                    let k = near.trailing_zeros() % FOUR;
                    near &= near - 1;
                    found |= query.take(lane, t[k as usize], base + first + k, ranks);
                }
            }
            first += FOUR;
        }
        Some(found)
    }
}

/// Rows that one ray is tested against at a time.
const FOUR: u32 = QUAD as u32;

/// Rows of one kind that stand together in a leaf.
#[derive(Clone, Copy)]
pub struct Rows<'a> {
    /// Which.
    pub run: &'a Run,
    /// Surface number of the kind's first row.
    pub base: SurfaceId,
    /// Of all surfaces.
    pub ranks: &'a Ranks,
}

impl Rows<'_> {
    /// Tests them against the lanes given of one packet, with `any` until each has met one: the lanes that have, and how many rows
    /// were tested.
    #[inline(always)]
    pub fn test<S: Scalar, K: Block<S>>(
        &self,
        block: &K,
        query: &mut Query<S::Lane>,
        (lanes, any): (u8, bool),
    ) -> (u8, u32) {
        let Self { run, base, ranks } = *self;
        let starts_here = query.starts_within(base + run.first, run.len);
        let (mut changed, mut tested) = (0, 0);
        for row in run.first..run.first + run.len {
            let surface = base + row;
            let on = if starts_here { query.lanes_on(surface) & lanes } else { 0 };
            let left = Left { on: Mask::from_bits(on), part: query.part };
            let gone = if on != 0 { block.left_behind(row as usize, &query.rays, &left) } else { 0 };
            if lanes & !gone == 0 {
                continue;
            }
            let left = (on & !gone != 0).then_some(&left);
            let looking = query.looking(lanes & !gone, any);
            tested += 1;
            let t = if K::SCREENED {
                let Some(t) = first_screened(block, row as usize, &query.rays, left, &looking) else {
                    continue;
                };
                t
            } else {
                block.first(row as usize, &query.rays, left, &looking)
            };
            changed |= accept(query, t, &[surface; LANES], lanes & !gone, ranks);
            if any && changed == lanes {
                break;
            }
        }
        (changed, tested)
    }

    /// The same, called: a dozen walks send rays here, and with every kernel in each of them the program would take a third longer
    /// to compile.
    #[inline(never)]
    fn test_apart<S: Scalar, K: Block<S>>(
        &self,
        block: &K,
        query: &mut Query<S::Lane>,
        looking: (u8, bool),
    ) -> (u8, u32) {
        self.test(block, query, looking)
    }

    /// The same, counted: the lanes that have met one.
    #[inline(always)]
    pub fn test_counting<S: Scalar, K: Block<S>>(
        &self,
        block: &K,
        query: &mut Query<S::Lane>,
        (lanes, any): (u8, bool),
        count: &mut impl Count,
    ) -> u8 {
        let looking = (lanes, any);
        let (changed, tested) = if K::SHORT || K::SCREENED {
            self.test(block, query, looking)
        } else {
            self.test_apart(block, query, looking)
        };
        count.leaf(tested, lanes.count_ones());
        changed
    }
}

/// [`Block::first`] of a kind that is screened; `None` if all rays miss it. Only the look is inlined.
#[inline(always)]
fn first_screened<S: Scalar, K: Block<S>>(
    block: &K,
    row: usize,
    rays: &Rays<S::Lane>,
    left: Option<&Left<S::Lane>>,
    looking: &Looking<S::Lane>,
) -> Option<S::Lane> {
    if let Some(left) = left {
        return Some(first_left(block, row, rays, left, looking));
    }
    let screened = block.screen(row, rays, looking);
    if screened.is_missed() {
        None
    } else if screened.may_meet.none() {
        Some(screened.met_at.cast())
    } else {
        Some(first_met(block, row, rays, looking, screened))
    }
}

/// [`Block::first`] of rays some of which start there, called.
#[inline(never)]
pub fn first_left<S: Scalar, K: Block<S>>(
    block: &K,
    row: usize,
    rays: &Rays<S::Lane>,
    left: &Left<S::Lane>,
    looking: &Looking<S::Lane>,
) -> S::Lane {
    block.first(row, rays, Some(left), looking)
}

/// [`Block::first_screened`], called.
#[inline(never)]
pub fn first_met<S: Scalar, K: Block<S>>(
    block: &K,
    row: usize,
    rays: &Rays<S::Lane>,
    looking: &Looking<S::Lane>,
    screened: Screened,
) -> S::Lane {
    block.first_screened(row, rays, looking, screened)
}

/// The test of a run of one kind by some lanes of several packets: those of the last that found something nearer.
pub struct TestRun<'a, S: Scalar, C: Count, const ANY: bool> {
    pub rows: Rows<'a>,
    pub queries: &'a mut [Query<S::Lane>],
    pub lanes: u8,
    pub count: &'a mut C,
}

impl<S: Scalar, C: Count, const ANY: bool> WithBlock<S> for TestRun<'_, S, C, ANY> {
    type Output = u8;

    #[inline(always)]
    fn block<K: Block<S>>(self, block: &K) -> u8 {
        let Self { rows, queries, lanes, count } = self;
        let mut changed = 0;
        for query in queries {
            let lanes = lanes & query.waiting::<ANY>();
            changed = if lanes == 0 { 0 } else { rows.test_counting(block, query, (lanes, ANY), count) };
        }
        changed
    }
}

/// Asks the memory for a row.
pub struct Prefetch(pub usize);

impl<S: Scalar> WithBlock<S> for Prefetch {
    type Output = ();
    #[inline(always)]
    fn block<K: Block<S>>(self, block: &K) {
        block.prefetch(self.0);
    }
}

/// Takes the crossing at `t` (NaN for none: nothing is nearer than a miss, whatever the limit) where it is nearer than what is
/// known.
#[inline(always)]
pub fn accept<L: Lane>(
    query: &mut Query<L>,
    t: L,
    surfaces: &[SurfaceId; LANES],
    lanes: u8,
    ranks: &Ranks,
) -> u8 {
    let near = t.le(query.t).bits() & lanes;
    if near == 0 {
        return 0;
    }
    let mut ties = t.equal(query.t).bits() & near;
    let mut nearer = near & !ties;
    while ties != 0 {
        let lane = ties.trailing_zeros() as usize;
        ties &= ties - 1;
        // Two surfaces at one place: the one declared first is seen.
        if ranks.prefer(surfaces[lane], query.surface[lane]) {
            nearer |= 1 << lane;
        }
    }
    query.t = Mask::from_bits(nearer).select(t, query.t);
    query.surface = choose(nearer, surfaces, &query.surface);
    nearer
}
