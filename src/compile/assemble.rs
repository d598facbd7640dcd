//! From one pass's columns to a compiled scene: the tree over what has bounds, rows in the order of its leaves, and a
//! number for every surface.

use super::{COMPOSITE, Columns, Compiled, Flat, Kind, PART, build_tree, item};
use crate::bvh::{Item, Preset, Run};
use crate::kernel::Aabb;
use crate::lane::Scalar;
use crate::scene::Scene;
use glam::DVec3;

/// The middle of what is finite in the scene that `flat` was made of, or zero if that is not far off.
pub(super) fn middle<S: Scalar>(scene: &Scene, flat: &Flat<S>) -> DVec3 {
    let mut bounds = Aabb::EMPTY;
    for &kind in Kind::ALL {
        for row in 0..flat.columns.len(kind) {
            let b = flat.columns.bounds(kind, row);
            if b.is_finite() {
                bounds = bounds.union(b);
            }
        }
    }
    for composite in &flat.csg.composites {
        if composite.bounds.is_finite() {
            bounds = bounds.union(composite.bounds);
        }
    }
    if !bounds.is_finite() {
        return scene.camera.location;
    }
    // Around the world's origin nothing is gained, and what was given in single precision would be rounded again.
    let center = bounds.center();
    if center.length() > (bounds.max - bounds.min).length() { center } else { DVec3::ZERO }
}

/// Builds the tree, puts rows in leaf order and numbers the surfaces.
pub(super) fn assemble<S: Scalar, B: Scalar>(
    scene: &Scene,
    origin: DVec3,
    flat: Flat<S>,
    preset: Preset,
) -> Compiled<S, B> {
    let (mut items, loose) = gather(&flat);
    let together = stays_together(&items);
    cut_long(&flat.columns, &mut items, preset);
    let (mut bvh, mut order) = build_tree::<B>(&items, preset);
    bvh.together = together;
    let unbounded = place_loose(&flat, &loose, &mut order);
    let classes = unbounded.iter().fold(bvh.classes, |classes, run| classes | run.class);

    let Flat { mut columns, parts, mut csg, plain, part_tags, owners, textures, interiors, .. } = flat;
    let (mut owner, mut rank, mut base, mut kinds) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for &kind in Kind::ALL {
        base.push(owner.len() as u32);
        kinds.resize(owner.len() + columns.len(kind), kind as u8);
        let order = &order[kind as usize];
        columns.permute(kind, order);
        owner.extend(order.iter().map(|&row| plain[kind as usize][row as usize].owner));
        rank.extend(order.iter().map(|&row| plain[kind as usize][row as usize].rank));
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

/// What goes into the tree, and by kind the rows that have no bounds.
fn gather<S: Scalar>(flat: &Flat<S>) -> (Vec<Item>, Vec<Vec<u32>>) {
    let Flat { columns, csg, plain, composites, .. } = flat;
    let mut items = Vec::new();
    let mut loose: Vec<Vec<u32>> = vec![Vec::new(); usize::from(COMPOSITE) + 1];
    for &kind in Kind::ALL {
        for (row, tag) in plain[kind as usize].iter().enumerate() {
            let bounds = columns.bounds(kind, row);
            if bounds.is_finite() {
                items.push(item(kind as u8, row, bounds, tag.class, kind.cost()));
            } else {
                loose[kind as usize].push(row as u32);
            }
        }
    }
    for (number, tag) in composites.iter().enumerate() {
        let composite = &csg.composites[number];
        if composite.bounds.min.cmpgt(composite.bounds.max).any() {
            continue; // Its parts nowhere meet.
        }
        if composite.bounds.is_finite() {
            let cost = composite
                .parts
                .clone()
                .map(|p| Kind::ALL[usize::from(csg.parts[p as usize].kind)].cost())
                .sum();
            items.push(item(COMPOSITE, number, composite.bounds, tag.class, cost));
        } else {
            loose[usize::from(COMPOSITE)].push(number as u32);
        }
    }
    (items, loose)
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

/// True if most of what the leaves cost is in tests that one ray takes no less time for than eight.
fn stays_together(items: &[Item]) -> bool {
    let costs = items.iter().fold([0.0; 2], |mut costs: [f64; 2], item| {
        let across = Kind::ALL.get(usize::from(item.kind)).is_some_and(|kind| kind.tests_across());
        costs[usize::from(across)] += f64::from(item.cost);
        costs
    });
    costs[0] > costs[1]
}

/// A triangle's pieces are not cut further where they are smaller than so many of the items' even shares of the whole.
/// (Of 100,000 long triangles in a heap, with 32, 64, 128, 256: SAH 416, 337, 414, 533, and 949 uncut.)
const CUT_OVER: f64 = 64.0;
/// Most pieces of one primitive, and of all on average.
const MOST_PIECES: usize = 64;
const MEAN_PIECES: usize = 8;

/// Puts long slanting triangles into the tree piece by piece (Ernst and Greiner 2007, Early split clipping for bounding
/// volume hierarchies): their boxes are mostly empty. The row stays one, and leaves share it.
fn cut_long<S: Scalar>(columns: &Columns<S>, items: &mut Vec<Item>, preset: Preset) {
    if preset == Preset::Fast {
        return;
    }
    let whole = items.iter().fold(Aabb::EMPTY, |whole, item| whole.union(item.bounds));
    let mut least = CUT_OVER * whole.half_area() / items.len() as f64;
    let mut pieces: Vec<(usize, Vec<Aabb>)> = Vec::new();
    loop {
        let mut count = 0;
        for (number, item) in items.iter().enumerate() {
            let kind = Kind::ALL.get(usize::from(item.kind));
            let Some(&kind @ (Kind::Triangle | Kind::SmoothTriangle)) = kind else { continue };
            if item.bounds.half_area() > least {
                let mut boxes = Vec::new();
                columns.pieces(kind, item.index as usize, least, MOST_PIECES, &mut boxes);
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
        let item = items[number];
        items[number].bounds = boxes[0];
        items.extend(boxes[1..].iter().map(|&bounds| Item { bounds, ..item }));
    }
}
