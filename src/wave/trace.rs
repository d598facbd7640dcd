//! Packets through the compiled scene: what is hit first, and whether anything is hit at all.

use super::queue::Lines;
use crate::bvh::{Count, Occupancy, Packet, Run, Stack, Traversal, Visit, walk};
use crate::compile::{COMPOSITE, Compiled, NO_SURFACE, SurfaceId, WithBlock, class};
use crate::csg::{Best, PartRoots, Scratch, Stretch};
use crate::kernel::{Block, Left, Rays, View};
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3, f64x8};

/// Packets that walk the tree together.
pub const GROUP: usize = 8;

/// Eight rays and what is known of them so far.
#[derive(Debug, Clone, Copy)]
pub struct Query<L> {
    /// The rays.
    pub rays: Rays<L>,
    /// The surfaces they started on, or [`NO_SURFACE`].
    pub left: [SurfaceId; LANES],
    /// The parts of them.
    pub part: [u8; LANES],
    /// Hits at or before this do not count: the rounding of the start.
    pub t_min: L,
    /// The nearest hit so far, or how far to look.
    pub t: L,
    /// What was hit, or [`NO_SURFACE`].
    pub surface: [SurfaceId; LANES],
    /// Lanes that hold a ray.
    pub lanes: u8,
    /// Some of them start on a surface.
    starts: bool,
}

/// The start of a ray that left a surface is off by a few roundings of its largest coordinate; what lies within that
/// of the start is the start. (The surface left itself is not missed by this but by [`Left`].)
const START_ROUNDINGS: f64 = 32.0;

impl<L: Lane> Query<L> {
    /// Rays up to distance `t_max`.
    pub fn new(lines: &Lines<L>, t_max: L, lanes: u8) -> Self {
        let Lines { rays, left, part } = *lines;
        let reach = rays.origin.abs().max_element() * L::lit(START_ROUNDINGS * L::Scalar::UNIT_ROUNDOFF);
        let mut free = 0;
        for (k, left) in left.iter().enumerate() {
            free |= u8::from(*left == NO_SURFACE) << k;
        }
        let t_min = Mask::from_bits(free).select(L::zero(), reach);
        Self { rays, left, part, t_min, t: t_max, surface: [NO_SURFACE; LANES], lanes, starts: free != !0 }
    }

    /// Lanes that start on `surface`.
    #[inline(always)]
    fn lanes_on(&self, surface: SurfaceId) -> u8 {
        let mut on = 0;
        for (k, left) in self.left.iter().enumerate() {
            on |= u8::from(*left == surface) << k;
        }
        on
    }

    /// Lanes that have hit something.
    pub fn hits(&self) -> u8 {
        let mut bits = 0;
        for (k, surface) in self.surface.iter().enumerate() {
            bits |= u8::from(*surface != NO_SURFACE) << k;
        }
        bits & self.lanes
    }
}

/// Buffers for tracing, one set a thread.
#[derive(Default)]
pub struct Tracer<B: Scalar> {
    stack: Stack<B>,
    packets: Vec<Packet<B>>,
    scratch: Scratch,
    /// By packet, its rays as composites' bounds see them, once one has asked.
    stretches: Vec<Option<Stretch>>,
    traversal: Traversal,
    /// What its walks have tested, if that is counted.
    occupancy: Option<Occupancy>,
}

impl<B: Scalar> Tracer<B> {
    /// Walks the tree in the way that is asked for, not the one that is best for the rays.
    pub fn with(traversal: Traversal) -> Self {
        Self { traversal, ..Self::default() }
    }

    /// From now on, counts what is tested.
    pub fn count(&mut self) {
        self.occupancy.get_or_insert_default();
    }

    /// What was tested since [`Tracer::count`].
    pub fn occupancy(&self) -> Occupancy {
        self.occupancy.unwrap_or_default()
    }

    /// The nearest hits of up to [`GROUP`] packets among runs that share a bit of `filter`.
    pub fn nearest<S: Scalar>(&mut self, scene: &Compiled<S, B>, queries: &mut [Query<S::Lane>], filter: u8) {
        self.trace::<S, false>(scene, queries, filter, &mut None);
    }

    /// Whether anything that blocks light is hit before `t`: in lanes where it is, `surface` names something hit (not
    /// the nearest). Returns, for each packet, the lanes that meet something see-through on the way.
    ///
    /// `suspect` is what blocked such rays the last time, and is tried before anything is looked for: a light's shadow
    /// rays come in the order of pixels, and neighbours mostly lie in one shadow (Haines and Greenberg 1986, The light
    /// buffer). One does as well as four.
    pub fn occluded<S: Scalar>(
        &mut self,
        scene: &Compiled<S, B>,
        queries: &mut [Query<S::Lane>],
        suspect: &mut Option<Run>,
    ) -> [u8; GROUP] {
        let classes = class::BLOCKS | class::FILTERS;
        if !scene.has_class(classes) {
            return [0; GROUP];
        }
        self.trace::<S, true>(scene, queries, classes, suspect)
    }

    fn trace<S: Scalar, const ANY: bool>(
        &mut self,
        scene: &Compiled<S, B>,
        queries: &mut [Query<S::Lane>],
        filter: u8,
        suspect: &mut Option<Run>,
    ) -> [u8; GROUP] {
        if self.occupancy.is_none() {
            return self.trace_counting::<S, (), ANY>(scene, queries, filter, suspect).0;
        }
        let (tinted, counted) = self.trace_counting::<S, Occupancy, ANY>(scene, queries, filter, suspect);
        if let Some(occupancy) = &mut self.occupancy {
            *occupancy += counted;
        }
        tinted
    }

    fn trace_counting<S: Scalar, C: Count, const ANY: bool>(
        &mut self,
        scene: &Compiled<S, B>,
        queries: &mut [Query<S::Lane>],
        filter: u8,
        suspect: &mut Option<Run>,
    ) -> ([u8; GROUP], C) {
        let Self { stack, packets, scratch, stretches, traversal, .. } = self;
        stretches.clear();
        stretches.resize_with(queries.len(), || None);
        let mut leaves = Leaves::<S, B, C, ANY> {
            scene,
            queries,
            filter,
            scratch,
            stretches,
            tinted: [0; GROUP],
            views: [View::default(); GROUP],
            one: One::default(),
            blocker: None,
            count: C::default(),
        };
        if scene.has_triangles() {
            for (view, query) in leaves.views.iter_mut().zip(leaves.queries.iter()) {
                *view = View::along(query.rays.dir);
            }
        }
        if let (true, Some(run)) = (ANY, *suspect) {
            let mut met = 0;
            for k in 0..leaves.queries.len() {
                met |= leaves.run(&run, k, !0);
            }
            if met == 0 {
                *suspect = None;
            }
        }
        for run in &scene.unbounded {
            if run.class & filter != 0 {
                for k in 0..leaves.queries.len() {
                    leaves.run(run, k, !0);
                }
            }
        }
        packets.clear();
        for query in leaves.queries.iter() {
            let lanes = if ANY { query.lanes & !query.hits() } else { query.lanes };
            if lanes == 0 {
                packets.push(Packet::idle());
                continue;
            }
            let Rays { origin, dir } = query.rays;
            packets.push(Packet::new(&scene.bvh, origin, dir, query.t, lanes));
        }
        walk(&scene.bvh, packets, stack, &mut leaves, *traversal);
        if leaves.blocker.is_some() {
            *suspect = leaves.blocker;
        }
        (leaves.tinted, leaves.count)
    }
}

/// What happens in the tree's leaves.
struct Leaves<'a, S: Scalar, B: Scalar, C: Count, const ANY: bool> {
    scene: &'a Compiled<S, B>,
    queries: &'a mut [Query<S::Lane>],
    filter: u8,
    scratch: &'a mut Scratch,
    stretches: &'a mut [Option<Stretch>],
    /// By packet, the shadow rays that something see-through is in the way of.
    tinted: [u8; GROUP],
    /// By packet, how its rays see corners, if there are any.
    views: [View<S::Lane>; GROUP],
    one: One<S>,
    /// What has blocked a shadow ray last.
    blocker: Option<Run>,
    count: C,
}

/// The ray that walks alone, in every lane, and what it has hit so far.
struct One<S: Scalar> {
    packet: usize,
    lane: usize,
    rays: Rays<S::Lane>,
    view: View<S::Lane>,
    t_min: S::Lane,
    left: SurfaceId,
    part: u8,
    t: S,
    surface: SurfaceId,
}

impl<S: Scalar> Default for One<S> {
    fn default() -> Self {
        let rays = Rays { origin: Vec3::default(), dir: Vec3::default() };
        let (t, t_min) = (S::default(), S::Lane::default());
        Self {
            packet: 0,
            lane: 0,
            rays,
            view: View::default(),
            t_min,
            left: NO_SURFACE,
            part: 0,
            t,
            surface: NO_SURFACE,
        }
    }
}

impl<S: Scalar, B: Scalar, C: Count, const ANY: bool> Visit<B> for Leaves<'_, S, B, C, ANY> {
    #[inline]
    fn packets(&mut self, run: &Run, which: u8, packets: &mut [Packet<B>]) -> u8 {
        if run.kind != COMPOSITE && !(ANY && run.class & class::BLOCKS == 0) {
            let base = self.scene.base[usize::from(run.kind)];
            let (queries, views, rank) = (&mut *self.queries, &self.views, &self.scene.rank[..]);
            let count = &mut self.count;
            let test = TestPackets::<S, B, C, ANY> { run, base, which, packets, queries, views, rank, count };
            let changed = self.scene.columns.with(run.kind, test);
            if ANY && changed != 0 {
                self.blocker = Some(*run);
            }
            return changed;
        }
        let (mut changed, mut which) = (0, which);
        while which != 0 {
            let k = which.trailing_zeros() as usize;
            which &= which - 1;
            let state = &mut packets[k];
            let lanes = self.run(run, k, state.live());
            if lanes != 0 {
                if ANY {
                    self.blocker = Some(*run);
                }
                let far = if ANY { B::Lane::lit(-1.0) } else { state.far_of(self.queries[k].t) };
                state.far = Mask::from_bits(lanes).select(far, state.far);
                changed |= 1 << k;
            }
        }
        changed
    }

    #[inline]
    fn begin_single(&mut self, packet: usize, lane: usize) {
        let query = &self.queries[packet];
        let one = |x: S::Lane| S::Lane::splat(x.lanes()[lane]);
        let all = |v: Vec3<S::Lane>| Vec3::new(one(v.x), one(v.y), one(v.z));
        let rays = Rays { origin: all(query.rays.origin), dir: all(query.rays.dir) };
        self.one = One {
            packet,
            lane,
            rays,
            view: View::along(rays.dir),
            t_min: one(query.t_min),
            left: query.left[lane],
            part: query.part[lane],
            t: query.t.lanes()[lane],
            surface: query.surface[lane],
        };
    }

    #[inline]
    fn single(&mut self, run: &Run, state: &Packet<B>, far: B) -> B {
        let before = self.one.t;
        let found = if run.kind == COMPOSITE || (ANY && run.class & class::BLOCKS == 0) {
            None
        } else {
            let base = self.scene.base[usize::from(run.kind)];
            let rank = &self.scene.rank[..];
            let test = TestAcross { run, base, one: &mut self.one, rank, count: &mut self.count };
            self.scene.columns.with(run.kind, test)
        };
        let found = found.unwrap_or_else(|| {
            // No test of one ray against eight rows: the packet's test, with one lane.
            self.end();
            let found = self.run(run, self.one.packet, 1 << self.one.lane) != 0;
            let query = &self.queries[self.one.packet];
            self.one.t = query.t.lanes()[self.one.lane];
            self.one.surface = query.surface[self.one.lane];
            found
        });
        match (found, ANY) {
            (false, _) => far,
            (true, true) => {
                self.blocker = Some(*run);
                B::from_f64(-1.0)
            }
            (true, false) if self.one.t == before => far,
            (true, false) => state.far_of_lane(self.one.t.to_f64(), self.one.lane),
        }
    }

    #[inline]
    fn end_single(&mut self) {
        self.end();
    }

    #[inline(always)]
    fn boxes(&mut self, lanes: u32) {
        self.count.boxes(lanes);
    }

    #[inline(always)]
    fn wants(&self, class: u8) -> bool {
        class & self.filter != 0
    }
}

impl<S: Scalar, B: Scalar, C: Count, const ANY: bool> Leaves<'_, S, B, C, ANY> {
    /// Writes down what the single ray has hit.
    fn end(&mut self) {
        let query = &mut self.queries[self.one.packet];
        query.t.lanes_mut()[self.one.lane] = self.one.t;
        query.surface[self.one.lane] = self.one.surface;
    }

    /// Tests a run against one packet and returns the lanes whose hit changed.
    #[inline]
    fn run(&mut self, run: &Run, packet: usize, lanes: u8) -> u8 {
        let lanes = lanes & self.queries[packet].lanes;
        if ANY && run.class & class::BLOCKS == 0 {
            self.note(run, packet, lanes & !self.tinted[packet]);
            return 0;
        }
        self.test(run, packet, lanes)
    }

    /// The same for what blocks, and for what is only noted.
    #[inline(always)]
    fn test(&mut self, run: &Run, packet: usize, lanes: u8) -> u8 {
        for _ in 0..run.len {
            self.count.leaf(lanes.count_ones());
        }
        let query = &mut self.queries[packet];
        if run.kind == COMPOSITE {
            let buffers = (&mut *self.scratch, &mut self.stretches[packet]);
            return composites::<S, B, ANY>(self.scene, run, query, lanes, buffers);
        }
        let base = self.scene.base[usize::from(run.kind)];
        self.scene
            .columns
            .with(run.kind, TestRun { run, base, query, lanes, rank: &self.scene.rank, any: ANY })
    }

    /// Notes which shadow rays meet the see-through surfaces of a run, and lets them go on.
    #[cold]
    fn note(&mut self, run: &Run, packet: usize, lanes: u8) {
        if lanes == 0 {
            return;
        }
        let Query { t, surface, .. } = self.queries[packet];
        self.tinted[packet] |= self.test(run, packet, lanes);
        let query = &mut self.queries[packet];
        (query.t, query.surface) = (t, surface);
    }
}

/// The test of a run of one kind by one ray, eight rows at a time: whether anything nearer was found; `None` for kinds
/// that cannot.
struct TestAcross<'a, S: Scalar, C: Count> {
    run: &'a Run,
    base: SurfaceId,
    one: &'a mut One<S>,
    rank: &'a [u32],
    count: &'a mut C,
}

impl<S: Scalar, C: Count> WithBlock<S> for TestAcross<'_, S, C> {
    type Output = Option<bool>;

    #[inline(always)]
    fn block<K: Block<S>>(self, block: &K) -> Option<bool> {
        let Self { run, base, one, rank, count } = self;
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

/// The test of a run of one kind by several packets: a bit for each that found something nearer.
struct TestPackets<'a, S: Scalar, B: Scalar, C: Count, const ANY: bool> {
    run: &'a Run,
    base: SurfaceId,
    which: u8,
    packets: &'a mut [Packet<B>],
    queries: &'a mut [Query<S::Lane>],
    views: &'a [View<S::Lane>; GROUP],
    rank: &'a [u32],
    count: &'a mut C,
}

impl<S: Scalar, B: Scalar, C: Count, const ANY: bool> WithBlock<S> for TestPackets<'_, S, B, C, ANY> {
    type Output = u8;

    #[inline(always)]
    fn block<K: Block<S>>(self, block: &K) -> u8 {
        let Self { run, base, mut which, packets, queries, views, rank, count } = self;
        let first = base + run.first;
        let mut found = 0;
        while which != 0 {
            let k = which.trailing_zeros() as usize & (GROUP - 1);
            which &= which - 1;
            let (query, state) = (&mut queries[k], &mut packets[k]);
            let lanes = state.live();
            let here = |left: &SurfaceId| left.wrapping_sub(first) < run.len;
            let starts_here = query.starts && query.left.iter().fold(false, |any, left| any | here(left));
            let mut changed = 0;
            for row in run.first..run.first + run.len {
                let surface = base + row;
                let roots = if starts_here {
                    let on = query.lanes_on(surface);
                    let left = Left { on: Mask::from_bits(on), part: query.part };
                    block.roots_seen(row as usize, &query.rays, &views[k], Some(&left))
                } else {
                    block.roots_seen(row as usize, &query.rays, &views[k], None)
                };
                count.leaf(lanes.count_ones());
                changed |= accept(query, roots.as_ref(), surface, lanes, rank);
                if ANY && changed == lanes {
                    break;
                }
            }
            if changed != 0 {
                let far = if ANY { B::Lane::lit(-1.0) } else { state.far_of(query.t) };
                state.far = Mask::from_bits(changed).select(far, state.far);
                found |= 1 << k;
            }
        }
        found
    }
}

/// The test of a run of one kind.
struct TestRun<'a, L> {
    run: &'a Run,
    base: SurfaceId,
    query: &'a mut Query<L>,
    lanes: u8,
    rank: &'a [u32],
    any: bool,
}

impl<S: Scalar> WithBlock<S> for TestRun<'_, S::Lane> {
    type Output = u8;

    #[inline(always)]
    fn block<K: Block<S>>(self, block: &K) -> u8 {
        let Self { run, base, query, lanes, rank, any } = self;
        let first = base + run.first;
        let starts_here =
            query.left.iter().fold(false, |any, left| any | (left.wrapping_sub(first) < run.len));
        let mut changed = 0;
        for row in run.first..run.first + run.len {
            let surface = base + row;
            let roots = if starts_here {
                let left = Left { on: Mask::from_bits(query.lanes_on(surface)), part: query.part };
                block.roots(row as usize, &query.rays, Some(&left))
            } else {
                block.roots(row as usize, &query.rays, None)
            };
            changed |= accept(query, roots.as_ref(), surface, lanes, rank);
            if any && changed == lanes {
                break;
            }
        }
        changed
    }
}

/// Takes the first of `roots` (rising) that lies beyond `t_min`, where it is nearer than what is known.
#[inline(always)]
fn accept<L: Lane>(query: &mut Query<L>, roots: &[L], surface: SurfaceId, lanes: u8, rank: &[u32]) -> u8 {
    let mut t = L::lit(f64::NAN); // As a miss is: nothing is nearer than a miss, whatever the limit.
    for &root in roots.iter().rev() {
        t = root.gt(query.t_min).select(root, t);
    }
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

/// Tests a run of composites.
fn composites<S: Scalar, B: Scalar, const ANY: bool>(
    scene: &Compiled<S, B>,
    run: &Run,
    query: &mut Query<S::Lane>,
    lanes: u8,
    (scratch, stretch): (&mut Scratch, &mut Option<Stretch>),
) -> u8 {
    // Constructive geometry is done in double precision in every mode.
    let rays = Rays { origin: query.rays.origin.cast(), dir: query.rays.dir.cast() };
    let stretch = stretch.get_or_insert_with(|| Stretch::new(&rays, query.lanes));
    let source = Parts { scene, left: query.left, part: query.part };
    let t_min = query.t_min.to_f64s();
    let mut best = Best {
        t: query.t.to_f64s(),
        surface: query.surface,
        first_part: scene.first_part,
        rank: &scene.rank,
    };
    let mut changed = 0;
    for composite in &scene.csg.composites[run.first as usize..(run.first + run.len) as usize] {
        let waiting = if ANY { lanes & !changed } else { lanes };
        changed |= scene.csg.nearest(
            composite,
            (&rays, stretch),
            (waiting, t_min, ANY),
            &source,
            scratch,
            &mut best,
        );
        if ANY && changed == lanes {
            break;
        }
    }
    query.surface = best.surface;
    if !ANY {
        query.t = Mask::from_bits(changed).select(S::Lane::from_f64s(best.t), query.t);
    }
    changed
}

/// Crossings of composites' parts.
pub struct Parts<'a, S: Scalar, B: Scalar> {
    /// Where the parts are.
    pub scene: &'a Compiled<S, B>,
    /// The surfaces the rays started on.
    pub left: [SurfaceId; LANES],
    /// The parts of them.
    pub part: [u8; LANES],
}

impl<S: Scalar, B: Scalar> PartRoots for Parts<'_, S, B> {
    #[inline]
    fn roots(&self, part: u32, rays: &Rays<f64x8>, out: &mut Vec<f64x8>) -> (usize, u8) {
        let surface = self.scene.first_part + part;
        let mut on = 0u8;
        for (k, left) in self.left.iter().enumerate() {
            on |= u8::from(*left == surface) << k;
        }
        let left = Left { on: Mask::from_bits(on), part: self.part };
        let part = &self.scene.csg.parts[part as usize];
        self.scene
            .parts
            .with(part.kind, RootsOf { row: part.row as usize, rays, left: (on != 0).then_some(&left), out })
    }
}

struct RootsOf<'a> {
    row: usize,
    rays: &'a Rays<f64x8>,
    left: Option<&'a Left<f64x8>>,
    out: &'a mut Vec<f64x8>,
}

impl WithBlock<f64> for RootsOf<'_> {
    type Output = (usize, u8);

    #[inline(always)]
    fn block<K: Block<f64>>(self, block: &K) -> (usize, u8) {
        let Self { row, rays, left, out } = self;
        let before = out.len();
        out.extend_from_slice(block.roots(row, rays, left).as_ref());
        let surface = out.len() - before;
        if K::SKIN_IS_PARTIAL {
            out.extend_from_slice(block.boundary(row, rays, left).as_ref());
        }
        (surface, block.starts_inside(row, rays).bits())
    }
}
