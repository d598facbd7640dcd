//! From one pass's columns to a compiled scene: the tree over what has bounds, rows in the order of its leaves, and a
//! number for every surface.

use super::{COMPOSITE, Columns, Compiled, Flat, Kind, PART, Tag, WithBlock};
use crate::bvh::{Item, Items, Preset, Run, build};
use crate::kernel::{Aabb, Block};
use crate::lane::Scalar;
use crate::parallel;
use crate::scene::Scene;
use glam::DVec3;

/// What reaches so many times as far as all others is left out of the tree: a sky of a planet's size around a table. Boxes in single
/// precision are widened by a millionth of how far the tree reaches, which is a thousandth of the table then, and soon all of it.
const GIANT: f64 = (1 << 10) as f64;
/// If it is so few: every ray is held against them.
const MOST_GIANTS: usize = 16;

/// Around what has finite bounds, but for giants, if there are any.
pub(super) fn whole<S: Scalar>(flat: &Flat<S>) -> Aabb {
    let all = within(flat, f64::INFINITY).0;
    let (rest, giants) = within(flat, all.reach() / GIANT);
    if (1..=MOST_GIANTS).contains(&giants) && rest.is_finite() { rest } else { all }
}

/// Around what has finite bounds and reaches no farther, and how much reaches farther.
fn within<S: Scalar>(flat: &Flat<S>, farthest: f64) -> (Aabb, usize) {
    let columns = Kind::ALL.iter().map(|&kind| flat.columns.with(kind as u8, Within { farthest }));
    let composites = flat.csg.composites.iter().map(|composite| one_within(composite.bounds, farthest));
    columns.chain(composites).fold((Aabb::EMPTY, 0), sum)
}

/// [`within`] of one.
fn one_within(bounds: Aabb, farthest: f64) -> (Aabb, usize) {
    match bounds.is_finite() {
        true if bounds.reach() <= farthest => (bounds, 0),
        finite => (Aabb::EMPTY, usize::from(finite)),
    }
}

fn sum((a, m): (Aabb, usize), (b, n): (Aabb, usize)) -> (Aabb, usize) {
    (a.union(b), m + n)
}

/// [`within`] of a block's rows.
struct Within {
    farthest: f64,
}

impl<S: Scalar> WithBlock<S> for Within {
    type Output = (Aabb, usize);
    fn block<B: Block<S>>(self, block: &B) -> (Aabb, usize) {
        let one = |row| one_within(block.bounds(row), self.farthest);
        parallel::fold(block.len(), (Aabb::EMPTY, 0), one, sum)
    }
}

/// `bounds`, or none for what does not lie in the `whole` of the tree.
fn bounds_in(whole: Aabb, bounds: Aabb) -> Aabb {
    if bounds.is_finite() && whole.union(bounds) != whole { Aabb::INFINITE } else { bounds }
}

/// The middle of what is finite in the scene, which `whole` lies around, or zero if that is not far off.
pub(super) fn middle(scene: &Scene, whole: Aabb) -> DVec3 {
    if !whole.is_finite() {
        return scene.camera.location;
    }
    // Around the world's origin nothing is gained, and what was given in single precision would be rounded again.
    let center = whole.center();
    if center.length() > (whole.max - whole.min).length() { center } else { DVec3::ZERO }
}

/// Builds the tree, puts rows in leaf order and numbers the surfaces.
pub(super) fn assemble<S: Scalar, B: Scalar>(
    scene: &Scene,
    origin: DVec3,
    flat: Flat<S>,
    whole: Aabb,
    preset: Preset,
) -> Compiled<S, B> {
    let Gathered { mut items, loose, together } = gather(&flat, whole);
    cut_long(&flat.columns, &mut items, preset, whole);
    let mut rows: Vec<usize> = Kind::ALL.iter().map(|&kind| flat.columns.len(kind)).collect();
    rows.push(flat.csg.composites.len());
    let (mut bvh, mut order) = build::<B>(items, &rows, preset);
    bvh.together = together;
    let unbounded = place_loose(&flat, &loose, &mut order);
    let classes = unbounded.iter().fold(bvh.classes, |classes, run| classes | run.class);

    let Flat {
        mut columns,
        parts,
        mut csg,
        plain,
        part_tags,
        bodies,
        mesh_bodies,
        owners,
        textures,
        interiors,
        ..
    } = flat;
    let (mut owner, mut rank, mut base, mut kinds) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for &kind in Kind::ALL {
        base.push(owner.len() as u32);
        kinds.resize(owner.len() + columns.len(kind), kind as u8);
        let order = &order[kind as usize];
        columns.permute(kind, order);
        let tags = &plain[kind as usize];
        parallel::extend(&mut owner, order.len(), |k| tags[order[k] as usize].owner);
        parallel::extend(&mut rank, order.len(), |k| tags[order[k] as usize].rank);
    }
    let first_part = owner.len() as u32;
    owner.extend(part_tags.iter().map(|tag| tag.owner));
    rank.extend(part_tags.iter().map(|tag| tag.rank));
    kinds.extend(csg.parts.iter().map(|part| part.kind | PART));
    let order = &order[usize::from(COMPOSITE)];
    let mut place = vec![u32::MAX; csg.composites.len()];
    for (new, &old) in order.iter().enumerate() {
        place[old as usize] = new as u32;
    }
    for part in &mut csg.parts {
        part.composite = place[part.composite as usize];
    }
    csg.composites = order.iter().map(|&number| csg.composites[number as usize].clone()).collect();

    Compiled {
        origin,
        columns,
        base,
        parts,
        csg,
        first_part,
        kinds,
        owner,
        rank,
        bodies,
        mesh_bodies,
        owners,
        textures,
        fades: interiors.iter().any(|interior| interior.fade_distance != 0.0),
        interiors,
        unbounded,
        bvh,
        classes,
        lights: scene.lights.clone(),
        camera: scene.camera.clone(),
        globals: scene.globals.clone(),
        background: scene.background,
    }
}

/// What there is to be put together.
struct Gathered {
    /// What goes into the tree.
    items: Items,
    /// By kind: the rows that have no bounds.
    loose: Vec<Vec<u32>>,
    /// Most of what the leaves cost is in tests that one ray takes no less time for than eight.
    together: bool,
}

fn gather<S: Scalar>(flat: &Flat<S>, whole: Aabb) -> Gathered {
    let Flat { columns, csg, plain, composites, .. } = flat;
    let rows = Kind::ALL.iter().map(|&kind| columns.len(kind)).sum::<usize>();
    let mut items = Items::within(whole, rows + composites.len());
    let mut loose: Vec<Vec<u32>> = vec![Vec::new(); usize::from(COMPOSITE) + 1];
    let mut costs = [0.0; 2]; // Of tests of one row at a time, and of several.
    for &kind in Kind::ALL {
        let (tags, loose) = (&plain[kind as usize], &mut loose[kind as usize]);
        let before = items.len();
        columns.with(kind as u8, Gather { items: &mut items, loose, kind, tags, whole });
        costs[usize::from(kind.tests_across())] += (items.len() - before) as f64 * f64::from(kind.cost());
    }
    for (number, (tag, composite)) in composites.iter().zip(&csg.composites).enumerate() {
        if composite.bounds.min.cmpgt(composite.bounds.max).any() {
            continue; // Its parts nowhere meet.
        }
        let bounds = bounds_in(whole, composite.bounds);
        if bounds.is_finite() {
            let parts = composite.parts.clone();
            let cost = parts.map(|p| Kind::ALL[usize::from(csg.parts[p as usize].kind)].cost()).sum();
            items.push(&Item { bounds, kind: COMPOSITE, class: tag.class, index: number as u32, cost });
            costs[0] += f64::from(cost);
        } else {
            loose[usize::from(COMPOSITE)].push(number as u32);
        }
    }
    Gathered { items, loose, together: costs[0] > costs[1] }
}

/// What a row more costs where rows are tested four at a time, as a share of a test by itself. (Packets take them row by row, and
/// yet they, too, do best by leaves that are filled: with 1 meshes' camera and shadow rays lose 5 %, scattered ones 10 %.)
const AMONG_OTHERS: f32 = 0.1;

/// Puts a block's rows into the items, or among those without bounds.
struct Gather<'a> {
    items: &'a mut Items,
    loose: &'a mut Vec<u32>,
    kind: Kind,
    /// By row.
    tags: &'a [Tag],
    /// Around all that goes into the tree.
    whole: Aabb,
}

impl<S: Scalar> WithBlock<S> for Gather<'_> {
    type Output = ();
    fn block<B: Block<S>>(self, block: &B) {
        let Self { items, loose, kind, tags, whole } = self;
        let cost = kind.cost() * if kind.tests_across() { AMONG_OTHERS } else { 1.0 };
        let item = |row: usize| Item {
            bounds: bounds_in(whole, block.bounds(row)),
            kind: kind as u8,
            class: tags[row].class,
            index: row as u32,
            cost,
        };
        *loose = items.extend(tags.len(), item);
    }
}

/// Puts the rows without bounds behind the others in `order`: the runs they make.
fn place_loose<S: Scalar>(flat: &Flat<S>, loose: &[Vec<u32>], order: &mut [Vec<u32>]) -> Vec<Run> {
    let Flat { plain, composites, .. } = flat;
    let mut unbounded = Vec::new();
    for (kind, rows) in loose.iter().enumerate() {
        let tags = plain.get(kind).unwrap_or(composites);
        let class = |row: u32| tags[row as usize].class;
        for run in rows.chunk_by(|&a, &b| class(a) == class(b)) {
            let (first, len) = (order[kind].len() as u32, run.len() as u32);
            unbounded.push(Run { kind: kind as u8, class: class(run[0]), last: true, len, first });
            order[kind].extend_from_slice(run);
        }
    }
    unbounded
}

/// A triangle's pieces are not cut further where they are smaller than so many of the items' even shares of the whole.
/// (Of 100,000 long triangles in a heap, with 32, 64, 128, 256: SAH 416, 337, 414, 533, and 949 uncut.)
const CUT_OVER: f64 = 64.0;
/// Most pieces of one primitive, and of all on average.
const MOST_PIECES: usize = 64;
const MEAN_PIECES: usize = 8;

/// Puts long slanting triangles into the tree piece by piece (Ernst and Greiner 2007, Early split clipping for bounding
/// volume hierarchies): their boxes are mostly empty. The row stays one, and leaves share it.
fn cut_long<S: Scalar>(columns: &Columns<S>, items: &mut Items, preset: Preset, whole: Aabb) {
    if preset == Preset::Fast {
        return;
    }
    let mut least = CUT_OVER * whole.half_area() / items.len() as f64;
    let mut pieces: Vec<(usize, Vec<Aabb>)> = Vec::new();
    loop {
        let mut count = 0;
        for number in 0..items.len() {
            let (kind, row, half_area) = items.at(number);
            let kind = Kind::ALL.get(usize::from(kind));
            let Some(&kind @ (Kind::Triangle | Kind::SmoothTriangle)) = kind else { continue };
            if half_area > least {
                let mut boxes = Vec::new();
                columns.pieces(kind, row as usize, least, MOST_PIECES, &mut boxes);
                count += boxes.len();
                pieces.push((number, boxes));
            }
        }
        if count <= MEAN_PIECES * items.len() {
            break;
        }
        least *= 2.0;
        pieces.clear();
    }
    for (number, boxes) in pieces {
        items.cut(number, &boxes);
    }
}
