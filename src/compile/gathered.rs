//! Primitives before there is a tree over them: what goes into it, and what stands beside it.

use super::composites::Composites;
use super::flatten::flatten_prototype;
use super::prototypes::Prototype;
use super::{COMPOSITE, Flat, INSTANCE, Kind, Tag, WithBlock};
use crate::bvh::{Item, Items};
use crate::kernel::{Aabb, Block};
use crate::lane::Scalar;
use crate::parallel;
use glam::DVec3;

/// What reaches so many times as far as all others is left out of the tree: a sky of a planet's size around a table. Boxes in single
/// precision are widened by a millionth of how far the tree reaches, which is a thousandth of the table then, and soon all of it.
const GIANT: f64 = (1 << 10) as f64;
/// If it is so few: every ray is held against them.
const MOST_GIANTS: usize = 16;

/// Primitives in columns of precision `S`.
pub(super) struct Gathered<S: Scalar> {
    /// Subtracted from world coordinates: see [`Geometry::origin`](super::Geometry::origin).
    pub origin: DVec3,
    pub flat: Flat<S>,
    /// What stands in several places and is kept once.
    pub prototypes: Vec<Prototype>,
    /// Around all that goes into the tree.
    pub whole: Aabb,
    /// What goes into the tree.
    pub items: Items,
    /// By kind: the rows that do not.
    pub loose: Vec<Vec<u32>>,
    /// Most of what the leaves cost is in tests that one ray takes no less time for than eight.
    pub together: bool,
    /// There are [giants](super::Primitives::have_giants).
    pub giants: bool,
}

impl<S: Scalar> Gathered<S> {
    /// Of a scene that reaches so far.
    pub fn of(flat: Flat<S>, prototypes: Vec<Prototype>, origin: DVec3, reach: Reach) -> Self {
        let Reach { whole, giants } = reach;
        let (items, loose, together) = gather(&flat, whole);
        Self { origin, flat, prototypes, whole, items, loose, together, giants }
    }

    /// Those of a prototype by itself, in its own space.
    pub fn of_prototype(prototype: &Prototype) -> Self {
        let mut origin = DVec3::ZERO;
        if S::UNIT_ROUNDOFF > f64::UNIT_ROUNDOFF {
            origin = middle(prototype.bounds()).unwrap_or_default();
        }
        let flat = flatten_prototype(prototype, origin);
        let reach = Reach::of(&flat);
        Self::of(flat, Vec::new(), origin, reach)
    }
}

/// How far a scene reaches.
pub(super) struct Reach {
    /// Around what has finite bounds, but for giants.
    pub whole: Aabb,
    /// There are some.
    giants: bool,
}

impl Reach {
    pub fn of<S: Scalar>(flat: &Flat<S>) -> Self {
        let all = within(flat, f64::INFINITY).0;
        let (rest, giants) = within(flat, all.reach() / GIANT);
        let giants = (1..=MOST_GIANTS).contains(&giants) && rest.is_finite();
        Self { whole: if giants { rest } else { all }, giants }
    }
}

/// Around what has finite bounds and reaches no farther, and how much reaches farther.
fn within<S: Scalar>(flat: &Flat<S>, farthest: f64) -> (Aabb, usize) {
    let columns = Kind::ALL.iter().map(|&kind| flat.columns.with(kind as u8, Within { farthest }));
    let composites =
        flat.composites.csg.composites.iter().map(|composite| one_within(composite.bounds, farthest));
    let placed = flat.placed.iter().map(|placed| one_within(placed.bounds, farthest));
    columns.chain(composites).chain(placed).fold((Aabb::EMPTY, 0), sum)
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

/// The middle of what is finite, which `whole` lies around, or zero if that is not far off; `None` if nothing is.
pub(super) fn middle(whole: Aabb) -> Option<DVec3> {
    // Around the world's origin nothing is gained, and what was given in single precision would be rounded again.
    let center = whole.center();
    let is_far = center.length() > (whole.max - whole.min).length();
    whole.is_finite().then_some(if is_far { center } else { DVec3::ZERO })
}

/// What [`Gathered`] keeps as `items`, `loose` and `together`.
fn gather<S: Scalar>(flat: &Flat<S>, whole: Aabb) -> (Items, Vec<Vec<u32>>, bool) {
    let Flat { columns, plain, composites: Composites { csg, tags: composites, .. }, placed, .. } = flat;
    let rows = Kind::ALL.iter().map(|&kind| columns.len(kind)).sum::<usize>();
    let mut items = Items::within(whole, rows + composites.len() + placed.len());
    let mut loose: Vec<Vec<u32>> = vec![Vec::new(); usize::from(INSTANCE) + 1];
    let mut costs = [0.0; 2]; // Of tests of one row at a time, and of several.
    for &kind in Kind::ALL {
        let (tags, loose) = (&plain[kind as usize], &mut loose[kind as usize]);
        let before = items.len();
        columns.with(kind as u8, Gather { items: &mut items, loose, kind, tags, whole });
        costs[usize::from(kind.tests_across())] += (items.len() - before) as f64 * f64::from(kind.cost());
    }
    for (number, (tag, composite)) in composites.iter().zip(&csg.composites).enumerate() {
        if composite.bounds.is_empty() {
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
    for (number, one) in placed.iter().enumerate() {
        if one.bounds.is_empty() {
            continue;
        }
        let bounds = bounds_in(whole, one.bounds);
        if bounds.is_finite() {
            let (class, index) = (one.tag.class, number as u32);
            items.push(&Item { bounds, kind: INSTANCE, class, index, cost: INSTANCE_COST });
        } else {
            loose[usize::from(INSTANCE)].push(number as u32);
        }
        costs[0] += f64::from(INSTANCE_COST);
    }
    (items, loose, costs[0] > costs[1])
}

/// What it costs to move rays into an instance and through the first nodes of its tree, in box tests.
const INSTANCE_COST: f32 = 30.0;

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
