//! Composites against packets: the crossings of their parts come from the parts' columns.

use super::query::Query;
use super::rows::Prefetch;
use crate::bvh::Run;
use crate::compile::{Geometry, SurfaceId, WithBlock};
use crate::csg::{Asker, Best, Composite, Part, PartRoots, Scratch, Stretch};
use crate::kernel::{Block, Left, Looking, Rays};
use crate::lane::{LANES, Lane, Mask, Scalar, equal_lanes, f64x8};

/// Packets that come to composites: their rays, and these as composites' bounds see them, once one has asked.
pub struct Comers<'a, L: Lane> {
    /// By packet.
    pub queries: &'a mut [Query<L>],
    /// By packet.
    pub stretches: &'a mut [Option<Stretch>],
}

/// Tests a run of composites for `lanes` of two packets (for the same one twice where there is no other, which then has none), whose
/// rays care for the classes of `filter`: by packet, the lanes that have found something.
#[inline(always)]
pub fn composites<S: Scalar, B: Scalar, const ANY: bool>(
    scene: &Geometry<S, B>,
    run: &Run,
    comers: &mut Comers<S::Lane>,
    (which, lanes, filter): ([usize; 2], [u8; 2], u8),
    scratch: &mut Scratch,
) -> [u8; 2] {
    let mut changed = [0; 2];
    for composite in &scene.csg.composites[run.first as usize..(run.first + run.len) as usize] {
        let waiting = [0, 1].map(|k| if ANY { lanes[k] & !changed[k] } else { lanes[k] });
        let now = one::<S, B, ANY>(scene, composite, comers, (which, waiting, filter), scratch);
        changed = [0, 1].map(|k| changed[k] | now[k]);
        if ANY && changed == lanes {
            break;
        }
    }
    changed
}

/// Tests a composite. (A function by itself, as a loop around it would prepare for more than the one composite that most runs
/// have.)
#[inline(never)]
fn one<S: Scalar, B: Scalar, const ANY: bool>(
    scene: &Geometry<S, B>,
    composite: &Composite,
    comers: &mut Comers<S::Lane>,
    ([a, b], lanes, filter): ([usize; 2], [u8; 2], u8),
    scratch: &mut Scratch,
) -> [u8; 2] {
    let Comers { queries, stretches } = comers;
    let (mut room, mut other_room) = (None, None);
    let mut both = [best(scene, &queries[a]), best(scene, &queries[b])];
    let askers = [
        &asker(scene, composite, &queries[a], &mut room),
        &asker(scene, composite, &queries[b], &mut other_room),
    ];
    let (looking, lines) = ((askers, lanes), (&mut **stretches, [a, b]));
    let changed = scene.csg.nearest(composite, looking, lines, (ANY, filter), scratch, &mut both);
    take::<S::Lane, ANY>(&mut queries[a], changed[0], &both[0]);
    take::<S::Lane, ANY>(&mut queries[b], changed[1], &both[1]);
    changed
}

/// What is known of a packet's rays so far.
#[inline(always)]
fn best<'a, S: Scalar, B: Scalar>(scene: &'a Geometry<S, B>, query: &Query<S::Lane>) -> Best<'a> {
    Best {
        t: query.t.to_f64s().in_register(),
        surface: query.surface,
        loose: query.loose,
        slack: query.slack,
        roundoff: S::UNIT_ROUNDOFF,
        first_part: scene.first_part,
        ranks: &scene.ranks,
    }
}

/// Works out where the rays of a query meet parts of composites, where that is known only about.
#[inline(always)]
pub fn settle<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    query: &mut Query<S::Lane>,
    scratch: &mut Scratch,
) {
    if query.loose != 0 {
        settle_loose(scene, query, scratch);
    }
}

#[inline(never)]
fn settle_loose<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    query: &mut Query<S::Lane>,
    scratch: &mut Scratch,
) {
    let (mut room, mut best) = (None, best(scene, query));
    let source = Parts { scene, left: &query.left, part: &query.part, starts: false };
    best.settle(query.loose, query.rays.in_double(&mut room), &source, scratch.room());
    query.t = Mask::from_bits(query.loose).select(S::Lane::from_f64s(best.t), query.t);
    query.loose = 0;
}

/// A packet that asks. (Constructive geometry is done in double precision in every mode.)
#[inline(always)]
fn asker<'a, S: Scalar, B: Scalar>(
    scene: &'a Geometry<S, B>,
    composite: &Composite,
    query: &'a Query<S::Lane>,
    room: &'a mut Option<Rays<f64x8>>,
) -> Asker<'a, Parts<'a, S, B>> {
    Asker {
        rays: query.rays.in_double(room),
        source: Parts::of(scene, composite, query),
        t_min: query.t_min.to_f64s().in_register(),
        all: query.lanes,
    }
}

/// Lanes that have `changed` have found something.
#[inline(always)]
fn take<L: Lane, const ANY: bool>(query: &mut Query<L>, changed: u8, best: &Best) {
    if changed != 0 {
        query.surface = best.surface;
        if !ANY {
            let known = changed | (query.loose & !best.loose);
            query.t = Mask::from_bits(known).select(L::from_f64s(best.t), query.t);
            (query.loose, query.slack) = (best.loose, best.slack);
        }
    }
}

/// Hands on all surfaces of a composite in the way of rays of two packets, in no order: whether they are the first's (0) or the second's
/// (1), which surface it is, how far away, and the lanes it holds for. What is asked is told as to [`composites`].
pub fn surfaces<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    composite: &Composite,
    comers: &mut Comers<S::Lane>,
    ([a, b], lanes, filter): ([usize; 2], [u8; 2], u8),
    scratch: &mut Scratch,
    mut found: impl FnMut(usize, SurfaceId, f64x8, u8),
) {
    let Comers { queries, stretches } = comers;
    let (mut room, mut other_room) = (None, None);
    let askers = [
        &asker(scene, composite, &queries[a], &mut room),
        &asker(scene, composite, &queries[b], &mut other_room),
    ];
    let t_max = [a, b].map(|k| queries[k].t.to_f64s());
    let found = |k, part, t, lanes| found(k, scene.first_part + part, t, lanes);
    let lines = (&mut **stretches, [a, b]);
    scene.csg.surfaces(composite, (askers, lanes), lines, (t_max, filter), scratch, found);
}

/// Crossings of composites' parts.
#[derive(Clone, Copy)]
pub struct Parts<'a, S: Scalar, B: Scalar> {
    /// Where the parts are.
    pub scene: &'a Geometry<S, B>,
    /// The surfaces the rays started on.
    pub left: &'a [SurfaceId; LANES],
    /// The parts of them.
    pub part: &'a [u8; LANES],
    /// False if none of them is a part that is asked for.
    pub starts: bool,
}

impl<S: Scalar, B: Scalar> PartRoots for Parts<'_, S, B> {
    #[inline]
    fn roots(&self, part: u32, rays: &Rays<f64x8>, out: &mut Vec<f64x8>) -> (usize, u8) {
        self.ask(part, rays, out, (true, None))
    }

    #[inline]
    fn between(&self, part: u32, rays: &Rays<f64x8>, looking: &Looking<f64x8>, out: &mut Vec<f64x8>) -> u8 {
        self.ask(part, rays, out, (true, Some(looking))).1
    }

    #[inline]
    fn crossings(&self, part: u32, rays: &Rays<f64x8>, lanes: u8, out: &mut Vec<f64x8>) {
        let inf = f64x8::lit(f64::INFINITY);
        let looking = Looking { from: -inf, to: inf, lanes, any: false };
        self.ask(part, rays, out, (false, Some(&looking)));
    }

    #[inline(always)]
    fn prefetch(&self, part: u32) {
        let Part { kind, row, .. } = self.scene.csg.parts[part as usize];
        self.scene.parts.with(kind, Prefetch(row as usize));
    }

    #[inline(always)]
    fn starts(&self) -> bool {
        self.starts
    }

    #[inline(always)]
    fn on(&self, part: u32) -> u8 {
        equal_lanes(self.left, self.scene.first_part + part)
    }
}

impl<'a, S: Scalar, B: Scalar> Parts<'a, S, B> {
    /// Those of one composite, for the rays of `query`.
    #[inline(always)]
    fn of(scene: &'a Geometry<S, B>, composite: &Composite, query: &'a Query<S::Lane>) -> Self {
        let Composite { parts, .. } = composite;
        let starts = query.starts_within(scene.first_part + parts.start, parts.len() as u32);
        Self { scene, left: &query.left, part: &query.part, starts }
    }

    /// A part's crossings, with all else that is to be known of it if it is to be `full`; perhaps only those where rays are `looking`.
    #[inline]
    fn ask(
        &self,
        part: u32,
        rays: &Rays<f64x8>,
        out: &mut Vec<f64x8>,
        (full, looking): (bool, Option<&Looking<f64x8>>),
    ) -> (usize, u8) {
        let on = if self.starts { self.on(part) } else { 0 };
        let left = Left { on: Mask::from_bits(on), part: *self.part };
        let Part { kind, row, whole_skin, .. } = self.scene.csg.parts[part as usize];
        let (left, boundary) = ((on != 0).then_some(&left), full && !whole_skin);
        self.scene.parts.with(kind, RootsOf { row: row as usize, rays, left, looking, boundary, full, out })
    }
}

struct RootsOf<'a> {
    row: usize,
    rays: &'a Rays<f64x8>,
    left: Option<&'a Left<f64x8>>,
    looking: Option<&'a Looking<f64x8>>,
    /// That of the boundary is wanted, where it is not the surface.
    boundary: bool,
    /// And where the rays come from.
    full: bool,
    out: &'a mut Vec<f64x8>,
}

impl WithBlock<f64> for RootsOf<'_> {
    type Output = (usize, u8);

    #[inline(always)]
    fn block<K: Block<f64>>(self, block: &K) -> (usize, u8) {
        let Self { row, rays, left, looking, boundary, full, out } = self;
        let before = out.len();
        let from_inside = block.cross(row, rays, left, looking, out);
        let surface = out.len() - before;
        if K::SKIN_IS_PARTIAL && boundary {
            out.extend_from_slice(block.boundary(row, rays, left).as_ref());
        }
        (surface, if full { from_inside.bits() } else { 0 })
    }
}
