//! From primitives to what rays meet: the tree over what has bounds, rows in the order of its leaves, and a number for
//! every surface.

use super::composites::Composites;
use super::gathered::Gathered;
use super::instances::Instances;
use super::{COMPOSITE, Columns, Flat, Geometry, INSTANCE, Kind, PART, WithBlock};
use crate::bvh::{Items, Preset, Run, build};
use crate::kernel::{Aabb, Block, Ranks};
use crate::lane::Scalar;
use crate::parallel;

/// Builds the tree, puts rows in leaf order and numbers the surfaces.
pub(super) fn assemble<S: Scalar, B: Scalar>(gathered: Gathered<S>, preset: Preset) -> Geometry<S, B> {
    let Gathered { origin, flat, prototypes, whole, mut items, loose, together, .. } = gathered;
    cut_long(&flat.columns, &mut items, preset, whole);
    let mut rows: Vec<usize> = Kind::ALL.iter().map(|&kind| flat.columns.len(kind)).collect();
    rows.push(flat.composites.csg.composites.len());
    rows.push(flat.placed.len());
    let (mut bvh, mut order) = build::<B>(items, &rows, preset);
    bvh.together = together;
    let unbounded = place_loose(&flat, &loose, &mut order);
    let classes = unbounded.iter().fold(bvh.classes, |classes, run| classes | run.class);

    let Flat { mut columns, plain, composites, placed } = flat;
    let Composites { parts, mut csg, part_tags, .. } = composites;
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
    let prototypes = prototypes.iter().map(|one| assemble(Gathered::of_prototype(one), preset)).collect();
    let in_order = &order[usize::from(INSTANCE)];
    let instances = Instances::new(prototypes, &placed, in_order, owner.len() as u32);
    let stretches = instances.rows.iter().zip(in_order);
    let stretches =
        stretches.map(|(instance, &number)| (instance.first, placed[number as usize].tag.rank)).collect();
    let order = &order[usize::from(COMPOSITE)];
    let mut place = vec![u32::MAX; csg.composites.len()];
    for (new, &old) in order.iter().enumerate() {
        place[old as usize] = new as u32;
    }
    for part in &mut csg.parts {
        part.composite = place[part.composite as usize];
    }
    csg.composites = order.iter().map(|&number| csg.composites[number as usize].clone()).collect();

    let blurred = S::from_f64(blurred(&columns, &bvh.bounds));
    Geometry {
        origin,
        columns,
        base,
        parts,
        csg,
        first_part,
        kinds,
        owner,
        ranks: Ranks::new(rank, stretches),
        instances,
        unbounded,
        bvh,
        classes,
        blurred,
    }
}

/// See [`Geometry::blurred`]. A few large and slanting things must not have all rays looked at again.
fn blurred<S: Scalar>(columns: &Columns<S>, bounds: &Aabb) -> f64 {
    if S::UNIT_ROUNDOFF == f64::UNIT_ROUNDOFF {
        return 0.0;
    }
    let most = (bounds.max - bounds.min).length() / 64.0;
    Kind::ALL.iter().map(|&kind| columns.with(kind as u8, Blurred)).fold(0.0, f64::max).min(most)
}

struct Blurred;

impl<S: Scalar> WithBlock<S> for Blurred {
    type Output = f64;

    fn block<K: Block<S>>(self, block: &K) -> f64 {
        block.blurred()
    }
}

/// Puts the rows without bounds behind the others in `order`: the runs they make.
fn place_loose<S: Scalar>(flat: &Flat<S>, loose: &[Vec<u32>], order: &mut [Vec<u32>]) -> Vec<Run> {
    let Flat { plain, composites, placed, .. } = flat;
    let mut unbounded = Vec::new();
    for (kind, rows) in loose.iter().enumerate() {
        let class = |row: u32| match kind as u8 {
            INSTANCE => placed[row as usize].tag.class,
            COMPOSITE => composites.tags[row as usize].class,
            _ => plain[kind][row as usize].class,
        };
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
