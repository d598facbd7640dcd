//! From boxes to a tree: two children a node (`binary`), bettered by moving subtrees where asked (`reinsert`), then
//! put together by eight (`collapse`).
//!
//! Decisions are made in single precision, on boxes rounded outward as those of the finished tree are, and on
//! coordinates scaled by a power of two: a scene scaled by one gives the same tree, and none is too large or too small.

use super::binary::{Binary, Extent};
use super::collapse::{MAX_LEAF, Plan, children, is_leaf, plan};
use super::reinsert::bettered;
use super::{Bvh, Child, Node, Run};
use crate::kernel::Aabb;
use crate::lane::Scalar;
use glam::DVec3;
use smallvec::SmallVec;

/// One primitive to be put in the tree.
#[derive(Debug, Clone, Copy)]
pub struct Item {
    /// Finite.
    pub bounds: Aabb,
    /// Which columns it is a row of.
    pub kind: u8,
    /// Bits for [`Run::class`].
    pub class: u8,
    /// Its row.
    pub index: u32,
    /// What a test of it against a packet costs, in box tests of a packet.
    pub cost: f32,
}

/// How much time a tree may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Preset {
    /// As little as possible: for previews of large scenes.
    Fast,
    /// What pays off within one picture.
    #[default]
    Balanced,
    /// What pays off over many.
    Best,
}

impl Preset {
    /// The tree of two children a node: splits sought among 8, 16 or 32 places an axis.
    fn binary(self, items: Vec<Extent>) -> Binary {
        let tree = match self {
            Self::Fast => Binary::over::<8, 8>(items),
            Self::Balanced => Binary::over::<16, 8>(items),
            Self::Best => Binary::over::<32, 16>(items),
        };
        if self.rounds() == 0 { tree } else { bettered(tree, self.rounds()) }
    }

    /// How often the whole tree is looked through for subtrees that would lie better elsewhere.
    fn rounds(self) -> usize {
        match self {
            Self::Fast | Self::Balanced => 0,
            Self::Best => 6,
        }
    }
}

/// There is room for one node for so many items from the start: more than most trees need.
const NODES_PER_ITEM: usize = 4;

/// The finished tree, and for each kind the new order of its rows: row `k` of the columns must become row `order[kind][k]`.
pub fn build<B: Scalar>(items: &[Item], kinds: usize, preset: Preset) -> (Bvh<B>, Vec<Vec<u32>>) {
    let bounds = items.iter().fold(Aabb::EMPTY, |b, item| b.union(item.bounds));
    let mut tree = Bvh {
        nodes: Vec::with_capacity(items.len() / NODES_PER_ITEM),
        runs: Vec::new(),
        bounds,
        depth: 0,
        classes: items.iter().fold(0, |classes, item| classes | item.class),
        origin: origin(&bounds),
        entry: [[B::default(); 3]; 2],
        together: false,
    };
    let mut order = vec![Vec::new(); kinds];
    if items.is_empty() {
        return (tree, order);
    }
    let mut rows = vec![0; kinds];
    for item in items {
        let rows = &mut rows[usize::from(item.kind)];
        *rows = (item.index + 1).max(*rows);
    }
    for (order, &rows) in order.iter_mut().zip(&rows) {
        order.reserve_exact(rows as usize);
    }
    let place = rows.iter().map(|&rows| vec![u32::MAX; rows as usize]).collect();

    let moved = tree.moved_bounds();
    let slack = Bvh::<B>::slack(&moved);
    tree.entry = [moved.min - slack, moved.max + slack].map(|corner| corner.to_array().map(B::from_f64));

    let unit = power_of_two_over(moved.min.abs().max(moved.max.abs()).max_element());
    let extents = items.iter().enumerate().map(|(number, item)| {
        let low = ((item.bounds.min - tree.origin) / unit).to_array().map(down);
        let high = ((item.bounds.max - tree.origin) / unit).to_array().map(|x| -down(-x));
        Extent::new(low, high).tagged(number as u32, item.cost.to_bits())
    });
    let binary = preset.binary(extents.collect());
    let plans = plan(&binary);
    let mut emit = Emit {
        tree: &mut tree,
        items,
        binary: &binary,
        plans: &plans,
        order: &mut order,
        place,
        unit,
        slack,
    };
    emit.root();
    (tree, order)
}

/// Zero unless the middle is further off than the bounds are wide: near the origin nothing is gained by moving it.
fn origin(bounds: &Aabb) -> DVec3 {
    let (center, diagonal) = (bounds.center(), bounds.max - bounds.min);
    if center.is_finite() && center.length() > diagonal.length() { center } else { DVec3::ZERO }
}

/// The least power of two that is not less than `x`, within what can be divided by.
fn power_of_two_over(x: f64) -> f64 {
    let least = f64::MIN_POSITIVE * 16.0;
    x.log2().ceil().exp2().clamp(least, 1.0 / least)
}

/// The next number in single precision that is not greater.
fn down(x: f64) -> f32 {
    let nearest = x as f32;
    if f64::from(nearest) > x { nearest.next_down() } else { nearest }
}

/// Writes the eight-wide tree.
struct Emit<'a, B: Scalar> {
    tree: &'a mut Bvh<B>,
    items: &'a [Item],
    binary: &'a Binary,
    plans: &'a [Plan],
    order: &'a mut [Vec<u32>],
    /// By kind and old row: its new one, or `u32::MAX` if no leaf has had it.
    place: Vec<Vec<u32>>,
    /// One of the binary tree's coordinates in scene units.
    unit: f64,
    slack: DVec3,
}

impl<B: Scalar> Emit<'_, B> {
    /// Emits everything.
    fn root(&mut self) {
        if !is_leaf(self.plans, 0) {
            self.node(0, 1);
            return;
        }
        // The walk begins at a node.
        self.tree.depth = 1;
        let mut node = Node::empty();
        self.child(&mut node, 0, 0, 1);
        self.tree.nodes.push(node);
    }

    /// Emits node `at` of the binary tree as a node at `depth` and returns its number.
    fn node(&mut self, at: usize, depth: usize) -> usize {
        let number = self.tree.nodes.len();
        let mut node = Node::empty();
        self.tree.nodes.push(node);
        self.tree.depth = self.tree.depth.max(depth);
        for (k, child) in children(self.binary, self.plans, at).into_iter().enumerate() {
            self.child(&mut node, k, child, depth + 1);
        }
        self.tree.nodes[number] = node;
        number
    }

    /// Makes node `at` of the binary tree the `k`th child of `node`.
    fn child(&mut self, node: &mut Node<B>, k: usize, at: usize, depth: usize) {
        let extent = self.binary.nodes[at];
        let [low, high] = extent.corners();
        for axis in 0..3 {
            let plane = |x: f32, slack: f64| B::from_f64(f64::from(x) * self.unit + slack);
            node.planes[axis][k] = plane(low[axis], -self.slack[axis]);
            node.planes[3 + axis][k] = plane(high[axis], self.slack[axis]);
        }
        node.child[k] = if is_leaf(self.plans, at) {
            let (first, count) = extent.tags();
            let binary = self.binary;
            self.leaf(&binary.items[first as usize..(first + count) as usize])
        } else {
            Child::node(self.node(at, depth))
        };
    }

    /// A row that several items share, piece by piece, gets its place where it first comes.
    fn leaf(&mut self, extents: &[Extent]) -> Child {
        let mut items: SmallVec<[Leafed; MAX_LEAF]> =
            extents.iter().map(|extent| Leafed::of(&self.items[extent.tags().0 as usize])).collect();
        if items.len() > 1 {
            items.sort_unstable_by_key(Leafed::key);
            items.dedup();
        }
        for item in &mut items {
            let place = &mut self.place[usize::from(item.kind)][item.index as usize];
            if *place == u32::MAX {
                let order = &mut self.order[usize::from(item.kind)];
                *place = order.len() as u32;
                order.push(item.index);
            }
            item.index = *place;
        }
        if items.len() > 1 {
            items.sort_unstable_by_key(Leafed::key);
        }
        let first = self.tree.runs.len();
        let next_to = |a: &Leafed, b: &Leafed| (a.kind, a.class, a.index + 1) == (b.kind, b.class, b.index);
        for run in items.chunk_by(next_to) {
            self.tree.runs.push(Run {
                kind: run[0].kind,
                class: run[0].class,
                last: false,
                len: run.len() as u32,
                first: run[0].index,
            });
        }
        if let [run] = self.tree.runs[first..]
            && let Some(leaf) = Child::run(&run)
        {
            self.tree.runs.pop();
            return leaf;
        }
        if let Some(run) = self.tree.runs.last_mut() {
            run.last = true;
        }
        Child::runs(first)
    }
}

/// What a leaf must know of an item.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Leafed {
    kind: u8,
    class: u8,
    index: u32,
}

impl Leafed {
    fn of(item: &Item) -> Self {
        Self { kind: item.kind, class: item.class, index: item.index }
    }

    fn key(&self) -> u64 {
        u64::from(self.kind) << 40 | u64::from(self.class) << 32 | u64::from(self.index)
    }
}
