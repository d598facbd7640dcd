//! From boxes to a tree: binned surface-area heuristic (Wald 2007, On fast construction of SAH-based bounding
//! volume hierarchies), two children a node, then collapsed to eight by opening the largest (Wald, Benthin, Boulos 2008).
//!
//! All decisions are made in f64 and depend on ratios only: a scene scaled by a power of two gives the same tree.

use super::{Bvh, Child, Node, Run};
use crate::kernel::Aabb;
use crate::lane::{LANES, Scalar};
use glam::DVec3;
use smallvec::{SmallVec, smallvec};

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

/// Most bins per axis.
const MOST_BINS: usize = 32;

impl Preset {
    /// Bins per axis, among which splits are sought. 32 gain under 1 % of SAH cost over 16 and cost a third more time.
    fn bins(self) -> usize {
        match self {
            Self::Fast => 8,
            Self::Balanced => 16,
            Self::Best => MOST_BINS,
        }
    }
}

/// A leaf never holds more, unless all boxes have one centre.
const MAX_LEAF: usize = 8;
/// Cost of one step of a packet through a node, in box tests of a packet: the eight-box culling test and the stack.
const STEP_COST: f64 = 1.0;
/// Subtrees over this many items are built side by side.
const PARALLEL_OVER: usize = 8192;

/// The finished tree, and for each kind the new order of its rows: row `k` of the columns must become row `order[kind][k]`.
pub fn build<B: Scalar>(items: &mut [Item], kinds: usize, preset: Preset) -> (Bvh<B>, Vec<Vec<u32>>) {
    let bounds = items.iter().fold(Aabb::EMPTY, |b, item| b.union(item.bounds));
    let mut tree = Bvh {
        nodes: Vec::new(),
        runs: Vec::new(),
        bounds,
        depth: 0,
        classes: items.iter().fold(0, |classes, item| classes | item.class),
        origin: origin(&bounds),
        entry: [[B::default(); 3]; 2],
    };
    let mut order = vec![Vec::new(); kinds];
    if items.is_empty() {
        return (tree, order);
    }
    let mut rows = vec![0; kinds];
    for item in items.iter() {
        let most = &mut rows[usize::from(item.kind)];
        *most = item.index.max(*most);
    }
    let place = rows.iter().map(|&most| vec![u32::MAX; most as usize + 1]).collect();
    let root = split(items, preset.bins());

    let slack = Bvh::<B>::slack(&tree.moved_bounds());
    let corners = [tree.moved_bounds().min - slack, tree.moved_bounds().max + slack];
    tree.entry = corners.map(|corner| corner.to_array().map(B::from_f64));
    let mut emit = Emit { tree: &mut tree, order: &mut order, place, slack };
    emit.node(&root, 1);
    (tree, order)
}

/// Zero unless the middle is further off than the bounds are wide: near the origin nothing is gained by moving it.
fn origin(bounds: &Aabb) -> DVec3 {
    let (center, diagonal) = (bounds.center(), bounds.max - bounds.min);
    if center.is_finite() && center.length() > diagonal.length() { center } else { DVec3::ZERO }
}

/// A tree of two children a node over reordered items.
enum Binary<'a> {
    Leaf { bounds: Aabb, items: &'a mut [Item] },
    Node { bounds: Aabb, children: Box<[Binary<'a>; 2]> },
}

impl Binary<'_> {
    fn bounds(&self) -> Aabb {
        match self {
            Self::Leaf { bounds, .. } | Self::Node { bounds, .. } => *bounds,
        }
    }
}

fn split(items: &mut [Item], bins: usize) -> Binary<'_> {
    let bounds = items.iter().fold(Aabb::EMPTY, |b, item| b.union(item.bounds));
    let Some(at) = partition(items, &bounds, bins) else {
        return Binary::Leaf { bounds, items };
    };
    let parallel = items.len() > PARALLEL_OVER;
    let (left, right) = items.split_at_mut(at);
    let (left, right) = if parallel {
        rayon::join(|| split(left, bins), || split(right, bins))
    } else {
        (split(left, bins), split(right, bins))
    };
    Binary::Node { bounds, children: Box::new([left, right]) }
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Aabb,
    cost: f64,
}

/// Sorts items into two sides and says where the second begins; `None` if a leaf is cheaper.
fn partition(items: &mut [Item], bounds: &Aabb, count: usize) -> Option<usize> {
    if items.len() < 2 {
        return None;
    }
    let centers = Aabb::of(items.iter().map(|item| item.bounds.center()));
    let extent = centers.max - centers.min;
    let scale = DVec3::splat(count as f64) / extent;
    let bin_of = |item: &Item, axis: usize| {
        let place = (item.bounds.center()[axis] - centers.min[axis]) * scale[axis];
        (place as usize).min(count - 1)
    };

    let total: f64 = items.iter().map(|item| f64::from(item.cost)).sum();
    let mut best: Option<(f64, usize, usize)> = None; // (cost, axis, first bin of the right side)
    for axis in 0..3 {
        if extent[axis] <= 0.0 || !scale[axis].is_finite() {
            continue;
        }
        let mut bins = [Bin { bounds: Aabb::EMPTY, cost: 0.0 }; MOST_BINS];
        for item in items.iter() {
            let bin = &mut bins[bin_of(item, axis)];
            bin.bounds = bin.bounds.union(item.bounds);
            bin.cost += f64::from(item.cost);
        }
        // Costs of the right sides from the end, then a sweep from the left.
        let mut right = [0.0; MOST_BINS];
        let mut sum = Bin { bounds: Aabb::EMPTY, cost: 0.0 };
        for k in (1..count).rev() {
            sum = Bin { bounds: sum.bounds.union(bins[k].bounds), cost: sum.cost + bins[k].cost };
            right[k] = if sum.cost > 0.0 { sum.bounds.half_area() * sum.cost } else { f64::INFINITY };
        }
        let mut sum = Bin { bounds: Aabb::EMPTY, cost: 0.0 };
        for k in 1..count {
            let bin = bins[k - 1];
            sum = Bin { bounds: sum.bounds.union(bin.bounds), cost: sum.cost + bin.cost };
            if sum.cost > 0.0 {
                let cost = sum.bounds.half_area() * sum.cost + right[k];
                if cost.is_finite() && best.is_none_or(|(least, ..)| cost < least) {
                    best = Some((cost, axis, k));
                }
            }
        }
    }

    let Some((cost, axis, first_right)) = best else {
        // All centres coincide: no plane parts them, so part them by number.
        return (items.len() > MAX_LEAF).then_some(items.len() / 2);
    };
    let area = bounds.half_area();
    let worth = area <= 0.0 || STEP_COST + cost / area < total;
    if !worth && items.len() <= MAX_LEAF {
        return None;
    }
    // Stable, so that the tree does not depend on how a sort treats equals.
    let mut left: Vec<Item> = Vec::with_capacity(items.len());
    let mut right: Vec<Item> = Vec::new();
    for item in items.iter() {
        if bin_of(item, axis) < first_right { left.push(*item) } else { right.push(*item) }
    }
    let at = left.len();
    items[..at].copy_from_slice(&left);
    items[at..].copy_from_slice(&right);
    Some(at)
}

/// Writes the eight-wide tree.
struct Emit<'a, B: Scalar> {
    tree: &'a mut Bvh<B>,
    order: &'a mut [Vec<u32>],
    /// By kind and old row: its new one, or `u32::MAX` if no leaf has had it.
    place: Vec<Vec<u32>>,
    slack: DVec3,
}

impl<B: Scalar> Emit<'_, B> {
    /// Emits `root` as a node at `depth` and returns its number.
    fn node(&mut self, root: &Binary, depth: usize) -> usize {
        let mut children: SmallVec<[&Binary; LANES]> = smallvec![root];
        // Open the child of largest area until there are eight or only leaves.
        while children.len() < LANES {
            let largest = (0..children.len())
                .filter(|&k| matches!(children[k], Binary::Node { .. }))
                .max_by(|&a, &b| area(children[a]).total_cmp(&area(children[b])));
            let Some(k) = largest else { break };
            if let Binary::Node { children: pair, .. } = children[k] {
                children[k] = &pair[0];
                children.insert(k + 1, &pair[1]);
            }
        }
        let number = self.tree.nodes.len();
        let mut node = Node::empty();
        self.tree.nodes.push(node);
        self.tree.depth = self.tree.depth.max(depth);
        for (k, binary) in children.into_iter().enumerate() {
            let bounds = binary.bounds();
            let lo = bounds.min - self.tree.origin - self.slack;
            let hi = bounds.max - self.tree.origin + self.slack;
            for axis in 0..3 {
                node.planes[axis][k] = B::from_f64(lo[axis]);
                node.planes[3 + axis][k] = B::from_f64(hi[axis]);
            }
            node.child[k] = match binary {
                Binary::Leaf { items, .. } => self.leaf(items),
                Binary::Node { .. } => Child::node(self.node(binary, depth + 1)),
            };
        }
        self.tree.nodes[number] = node;
        number
    }

    /// A row that several items share, piece by piece, gets its place where it first comes.
    fn leaf(&mut self, items: &[Item]) -> Child {
        let mut items: SmallVec<[Item; MAX_LEAF]> = items.into();
        items.sort_by_key(|item| (item.kind, item.class, item.index));
        items.dedup_by_key(|item| (item.kind, item.index));
        for item in &mut items {
            let place = &mut self.place[usize::from(item.kind)][item.index as usize];
            if *place == u32::MAX {
                let order = &mut self.order[usize::from(item.kind)];
                *place = order.len() as u32;
                order.push(item.index);
            }
            item.index = *place;
        }
        items.sort_by_key(|item| (item.kind, item.class, item.index));
        let first = self.tree.runs.len();
        let next_to = |a: &Item, b: &Item| (a.kind, a.class, a.index + 1) == (b.kind, b.class, b.index);
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

fn area(binary: &Binary) -> f64 {
    binary.bounds().half_area()
}
