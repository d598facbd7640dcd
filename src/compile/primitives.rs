//! A scene's primitives before there is a tree over them: all that the choice of a precision hangs on.

use super::composites::Composites;
use super::flatten::{flatten, flatten_prototype};
use super::instances::PlacedPrototype;
use super::looks::LooksOfMeshes;
use super::prototypes::{Prototype, Prototypes};
use super::{COMPOSITE, Compiled, Flat, INSTANCE, Instancing, Kind, Objects, Tag, WithBlock, assemble};
use crate::bvh::{Item, Items, Preset};
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

/// A scene's primitives in columns of precision `S`, and what of them goes into a tree.
pub struct Primitives<S: Scalar> {
    pub(super) gathered: Gathered<S>,
    pub(super) objects: Objects,
}

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
    /// There are [giants](Primitives::have_giants).
    giants: bool,
}

impl<S: Scalar> Primitives<S> {
    /// Those of `scene`.
    pub fn of(scene: &Scene) -> Self {
        Self::with(scene, Instancing::default())
    }

    /// The same where some of what stands in several places may be kept once.
    pub fn with(scene: &Scene, instancing: Instancing) -> Self {
        let (mut origin, mut meshes) = (DVec3::ZERO, LooksOfMeshes::default());
        let prototypes = Prototypes::of(scene, instancing, &mut meshes);
        let (mut flat, mut objects) = flatten::<S>(scene, origin, (&prototypes, &mut meshes));
        let mut reach = Reach::of(&flat);
        let middle = |whole| middle(whole).unwrap_or(scene.camera.location);
        if S::UNIT_ROUNDOFF > f64::UNIT_ROUNDOFF && middle(reach.whole) != DVec3::ZERO {
            // Its columns have lost digits: once more, from the middle that double precision finds.
            let (exact, _) = flatten::<f64>(scene, DVec3::ZERO, (&prototypes, &mut meshes));
            origin = middle(Reach::of(&exact).whole);
            drop(exact);
            (flat, objects) = flatten::<S>(scene, origin, (&prototypes, &mut meshes));
            reach = Reach::of(&flat);
        }
        Self { gathered: Gathered::of(flat, prototypes.all, origin, reach), objects }
    }

    /// True if a few are so much larger than all others that they stand beside the tree.
    pub fn have_giants(&self) -> bool {
        self.gathered.giants
    }

    /// True if something shared stands in a place whose map is beyond single precision.
    pub fn have_extreme_places(&self) -> bool {
        self.gathered.flat.placed.iter().any(PlacedPrototype::is_extreme)
    }

    /// True if boxes in precision `B` would tell little of where they are: a thousand far stars around a table.
    pub fn are_too_fine_for<B: Scalar>(&self) -> bool {
        self.gathered.items.are_too_fine_for::<B>()
    }

    /// With a tree over them, of those that were made from the same `scene`.
    pub fn compile<B: Scalar>(self, scene: &Scene, preset: Preset) -> Compiled<S, B> {
        let Objects { bodies, mesh_bodies, owners, textures, interiors } = self.objects;
        Compiled {
            geometry: assemble::assemble(self.gathered, preset),
            bodies,
            mesh_bodies,
            owners,
            textures,
            fades: interiors.iter().any(|interior| interior.fade_distance != 0.0),
            interiors,
            lights: scene.lights.clone(),
            camera: scene.camera.clone(),
            globals: scene.globals.clone(),
            background: scene.background,
        }
    }
}

impl<S: Scalar> Gathered<S> {
    fn of(flat: Flat<S>, prototypes: Vec<Prototype>, origin: DVec3, reach: Reach) -> Self {
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
struct Reach {
    /// Around what has finite bounds, but for giants.
    whole: Aabb,
    /// There are some.
    giants: bool,
}

impl Reach {
    fn of<S: Scalar>(flat: &Flat<S>) -> Self {
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
fn middle(whole: Aabb) -> Option<DVec3> {
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
