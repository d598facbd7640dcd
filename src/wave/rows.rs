//! The test of a run of primitives of one kind: by several packets, by one, or by a single ray against eight rows.

use super::query::{GROUP, Query};
use crate::bvh::{Count, Packet, Run};
use crate::compile::{NO_SURFACE, SurfaceId, WithBlock};
use crate::kernel::{Block, Left, Looking, Rays, View};
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3};
use smallvec::SmallVec;

/// The ray that walks alone, in every lane, and what it has hit so far.
pub struct One<S: Scalar> {
    packet: usize,
    lane: usize,
    rays: Rays<S::Lane>,
    view: View<S::Lane>,
    t_min: S::Lane,
    left: SurfaceId,
    part: u8,
    /// The nearest hit so far, or how far to look.
    pub t: S,
    surface: SurfaceId,
}

impl<S: Scalar> Default for One<S> {
    fn default() -> Self {
        let rays = Rays { origin: Vec3::default(), dir: Vec3::default() };
        let (t, t_min) = (S::default(), S::Lane::default());
        let (left, surface) = (NO_SURFACE, NO_SURFACE);
        Self { packet: 0, lane: 0, rays, view: View::default(), t_min, left, part: 0, t, surface }
    }
}

impl<S: Scalar> One<S> {
    /// The ray in lane `lane` of packet number `packet`, whose query is given.
    #[inline(always)]
    pub fn of(query: &Query<S::Lane>, packet: usize, lane: usize) -> Self {
        let one = |x: S::Lane| S::Lane::splat(x.lanes()[lane]);
        let all = |v: Vec3<S::Lane>| Vec3::new(one(v.x), one(v.y), one(v.z));
        let rays = Rays { origin: all(query.rays.origin), dir: all(query.rays.dir) };
        Self {
            packet,
            lane,
            rays,
            view: View::along(rays.dir),
            t_min: one(query.t_min),
            left: query.left[lane],
            part: query.part[lane],
            t: query.t.lanes()[lane],
            surface: query.surface[lane],
        }
    }

    /// Packet and lane that it came from.
    #[inline(always)]
    pub fn place(&self) -> (usize, usize) {
        (self.packet, self.lane)
    }

    /// Writes down in the query what was hit.
    #[inline(always)]
    pub fn tell(&self, query: &mut Query<S::Lane>) {
        query.t.lanes_mut()[self.lane] = self.t;
        query.surface[self.lane] = self.surface;
    }

    /// Takes over what the query has hit in the meantime.
    #[inline(always)]
    pub fn learn(&mut self, query: &Query<S::Lane>) {
        self.t = query.t.lanes()[self.lane];
        self.surface = query.surface[self.lane];
    }
}

/// How the rays of a group of packets see corners: nothing in scenes that have no triangles.
pub struct Views<S: Scalar> {
    by_packet: SmallVec<[View<S::Lane>; GROUP]>,
    none: View<S::Lane>,
}

impl<S: Scalar> Views<S> {
    /// Of the rays of `queries`, if they are `wanted`.
    #[inline(always)]
    pub fn new(queries: &[Query<S::Lane>], wanted: bool) -> Self {
        let mut views = Self { by_packet: SmallVec::new(), none: View::default() };
        if wanted {
            views.by_packet.extend(queries.iter().map(|query| View::along(query.rays.dir)));
        }
        views
    }

    /// Of packet number `k`.
    #[inline(always)]
    pub fn of(&self, k: usize) -> &View<S::Lane> {
        self.by_packet.get(k).unwrap_or(&self.none)
    }
}

/// The test of a run of one kind by one ray, eight rows at a time: whether anything nearer was found; `None` for kinds
/// that cannot.
pub struct TestAcross<'a, S: Scalar, C: Count> {
    pub rows: Rows<'a>,
    pub one: &'a mut One<S>,
    pub count: &'a mut C,
}

impl<S: Scalar, C: Count> WithBlock<S> for TestAcross<'_, S, C> {
    type Output = Option<bool>;

    #[inline(always)]
    fn block<K: Block<S>>(self, block: &K) -> Option<bool> {
        let Self { rows: Rows { run, base, rank }, one, count } = self;
        if K::ACROSS == 0 {
            return None;
        }
        let mut found = false;
        let (end, mut first) = (run.first + run.len, run.first - run.first % K::ACROSS);
        while first < end {
            // Rows of this run among the eight.
            let mut rows = !0u8 << run.first.saturating_sub(first);
            if end - first < LANES as u32 {
                rows &= (1 << (end - first)) - 1;
            }
            count.leaf(rows.count_ones());
            let surface = base + first;
            let lane = one.left.wrapping_sub(surface);
            let roots = if lane < LANES as u32 {
                let left = Left { on: Mask::from_bits(1 << lane), part: [one.part; LANES] };
                block.roots_across((first as usize, end as usize), &one.rays, &one.view, Some(&left))
            } else {
                block.roots_across((first as usize, end as usize), &one.rays, &one.view, None)
            };
            let mut t = S::Lane::lit(f64::INFINITY);
            for &root in roots.as_ref().iter().rev() {
                t = root.gt(one.t_min).select(root, t);
            }
            let mut near = t.le(S::Lane::splat(one.t)).bits() & rows;
            while near != 0 {
                let lane = near.trailing_zeros() as usize & (LANES - 1);
                near &= near - 1;
                let (t, surface) = (t.lanes()[lane], surface + lane as u32);
                // Two surfaces at one place: the one declared first is seen. (A miss is not nearer than an infinite
                // limit, nor a hit at the limit itself.)
                let first = one.surface != NO_SURFACE && rank[surface as usize] < rank[one.surface as usize];
                if t < one.t || (t == one.t && first) {
                    one.t = t;
                    one.surface = surface;
                    found = true;
                }
            }
            first += LANES as u32;
        }
        Some(found)
    }
}

/// Rows of one kind that stand together in a leaf.
#[derive(Clone, Copy)]
pub struct Rows<'a> {
    /// Which.
    pub run: &'a Run,
    /// Surface number of the kind's first row.
    pub base: SurfaceId,
    /// By surface number: the lower wins where two are equally near.
    pub rank: &'a [u32],
}

impl Rows<'_> {
    /// Tests them against the lanes given of one packet, with `any` until each has met one: the lanes that have.
    #[inline(always)]
    fn test<S: Scalar, K: Block<S>>(
        &self,
        block: &K,
        (query, view): (&mut Query<S::Lane>, &View<S::Lane>),
        (lanes, any): (u8, bool),
        count: &mut impl Count,
    ) -> u8 {
        let Self { run, base, rank } = *self;
        let starts_here = query.starts_within(base + run.first, run.len);
        let mut changed = 0;
        for row in run.first..run.first + run.len {
            let surface = base + row;
            let on = if starts_here { query.lanes_on(surface) & lanes } else { 0 };
            let left = Left { on: Mask::from_bits(on), part: query.part };
            let gone = if on != 0 { block.left_behind(row as usize, &query.rays, &left) } else { 0 };
            if lanes & !gone == 0 {
                continue;
            }
            let left = (on & !gone != 0).then_some(&left);
            let looking = Looking { from: query.t_min, to: query.t, lanes: lanes & !gone };
            let t = block.first(row as usize, &query.rays, view, left, &looking);
            count.leaf(lanes.count_ones());
            changed |= accept(query, t, surface, lanes & !gone, rank);
            if any && changed == lanes {
                break;
            }
        }
        changed
    }
}

/// The test of a run of one kind by several packets: a bit for each that found something nearer.
pub struct TestPackets<'a, S: Scalar, B: Scalar, C: Count, const ANY: bool> {
    pub rows: Rows<'a>,
    pub which: u8,
    pub packets: &'a mut [Packet<B>],
    pub queries: &'a mut [Query<S::Lane>],
    pub views: &'a Views<S>,
    pub count: &'a mut C,
}

impl<S: Scalar, B: Scalar, C: Count, const ANY: bool> WithBlock<S> for TestPackets<'_, S, B, C, ANY> {
    type Output = u8;

    #[inline(always)]
    fn block<K: Block<S>>(self, block: &K) -> u8 {
        let Self { rows, mut which, packets, queries, views, count } = self;
        let mut found = 0;
        while which != 0 {
            let k = which.trailing_zeros() as usize & (GROUP - 1);
            which &= which - 1;
            let (query, state) = (&mut queries[k], &mut packets[k]);
            let changed = rows.test(block, (query, views.of(k)), (state.live(), ANY), count);
            if changed != 0 {
                state.found(changed, query.t, ANY);
                found |= 1 << k;
            }
        }
        found
    }
}

/// The test of a run of one kind by some lanes of one packet: those that found something nearer.
pub struct TestRun<'a, S: Scalar, C: Count, const ANY: bool> {
    pub rows: Rows<'a>,
    pub query: &'a mut Query<S::Lane>,
    pub view: &'a View<S::Lane>,
    pub lanes: u8,
    pub count: &'a mut C,
}

impl<S: Scalar, C: Count, const ANY: bool> WithBlock<S> for TestRun<'_, S, C, ANY> {
    type Output = u8;

    #[inline(always)]
    fn block<K: Block<S>>(self, block: &K) -> u8 {
        let Self { rows, query, view, lanes, count } = self;
        rows.test(block, (query, view), (lanes, ANY), count)
    }
}

/// Takes the crossing at `t` (NaN for none: nothing is nearer than a miss, whatever the limit) where it is nearer than what is
/// known.
#[inline(always)]
fn accept<L: Lane>(query: &mut Query<L>, t: L, surface: SurfaceId, lanes: u8, rank: &[u32]) -> u8 {
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
        let other = query.surface[lane];
        if other != NO_SURFACE && rank[surface as usize] < rank[other as usize] {
            nearer |= 1 << lane;
        }
    }
    query.t = Mask::from_bits(nearer).select(t, query.t);
    query.surface = crate::lane::choose(nearer, &[surface; LANES], &query.surface);
    nearer
}
