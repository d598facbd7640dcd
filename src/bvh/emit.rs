//! The finished tree of eight children a node, written from the tree of two and the plan of which of its nodes stay.

use super::binary::{Binary, Subtree};
use super::collapse::{MAX_LEAF, Plan, children, is_leaf};
use super::extent::Extent;
use super::filling::Filling;
use super::items::Tag;
use super::{Bvh, Child, Node, Run};
use crate::lane::{LANES, Scalar};
use crate::parallel;
use glam::DVec3;
use rayon::prelude::*;

/// What is to be written, and how.
pub(super) struct Outline<'a> {
    pub binary: &'a Binary,
    pub plans: &'a [Plan],
    /// Rows, by kind.
    pub rows: &'a [usize],
    /// Leaves share rows.
    pub shared: bool,
    /// One of the binary tree's coordinates in scene units.
    pub unit: f64,
    pub slack: DVec3,
}

/// Subtrees over at most so many items are written each by itself, by whatever thread is free.
const PART: usize = 2 * parallel::PIECE;
/// There is room for one node for so many items from the start, which does for meshes. (Memory has a price even if it is never used:
/// pages come two megabytes at a time.)
const ITEMS_PER_NODE: usize = 16;

/// Writes nodes and runs into `tree`. By kind: rows in the order of the leaves.
pub(super) fn emit<B: Scalar>(outline: &Outline, tree: &mut Bvh<B>) -> Vec<Vec<u32>> {
    // Which of its leaves a shared row comes with, only one writer can tell.
    let items = outline.binary.items.len();
    let apart = items > 2 * PART && !outline.shared;
    let mut whole = Emit::new(outline, outline.rows, vec![0; outline.rows.len()]);
    if apart {
        whole.later = Some(Vec::new());
    } else {
        whole.nodes.reserve_exact(items / ITEMS_PER_NODE);
    }
    whole.root();
    whole.add_parts();
    (tree.nodes, tree.runs, tree.depth) = (whole.nodes, whole.runs, whole.depth);
    whole.order
}

/// A leaf that has no rows yet.
struct Leaf {
    /// The child of which node it is, and which.
    parent: (usize, usize),
    /// What it is in the binary tree.
    at: Subtree,
}

/// A subtree to be written later.
struct Later {
    /// The child of which node it is, and which.
    parent: (usize, usize),
    /// What it is in the binary tree.
    at: Subtree,
    depth: usize,
    /// By kind: its rows, and those that come before.
    rows: Vec<usize>,
    before: Vec<usize>,
}

/// Writes nodes, runs and the new order of rows of a subtree.
struct Emit<'a, B: Scalar> {
    outline: &'a Outline<'a>,
    nodes: Vec<Node<B>>,
    runs: Vec<Run>,
    depth: usize,
    /// By kind: rows of other subtrees that come before.
    before: Vec<usize>,
    /// By kind: rows in the order of the leaves.
    order: Vec<Vec<u32>>,
    /// If leaves share rows, by kind and old row: its new one, or `u32::MAX` if no leaf has had it.
    place: Option<Vec<Vec<u32>>>,
    /// By kind: leaves that have no rows yet.
    waiting: Vec<Filling<Leaf>>,
    /// Subtrees are left for later, if they are to be.
    later: Option<Vec<Later>>,
}

impl<'a, B: Scalar> Emit<'a, B> {
    /// Of a subtree over so many rows of each kind, behind so many others.
    fn new(outline: &'a Outline<'a>, rows: &[usize], before: Vec<usize>) -> Self {
        let place = outline.shared.then(|| outline.rows.iter().map(|&rows| vec![u32::MAX; rows]).collect());
        Self {
            outline,
            nodes: Vec::new(),
            runs: Vec::new(),
            depth: 0,
            order: rows.iter().map(|&rows| Vec::with_capacity(rows)).collect(),
            before,
            place,
            waiting: rows.iter().map(|_| Filling::default()).collect(),
            later: None,
        }
    }

    /// Emits everything, or as much as is not left for later.
    fn root(&mut self) {
        let all = self.outline.binary.root();
        if !is_leaf(self.outline.plans, all) {
            self.subtree(all, 1);
            return;
        }
        // The walk begins at a node.
        self.depth = 1;
        let mut node = Node::empty();
        self.planes(&mut node, 0, all);
        node.child[0] = self.leaf(all);
        self.nodes.push(node);
    }

    /// Emits `at` of the binary tree and all below it.
    fn subtree(&mut self, at: Subtree, depth: usize) {
        self.node(at, depth);
        for kind in 0..self.waiting.len() {
            while self.next_leaf(kind) {}
        }
    }

    /// Emits `at` of the binary tree as a node at `depth` and returns its number.
    fn node(&mut self, at: Subtree, depth: usize) -> usize {
        let number = self.nodes.len();
        let Outline { binary, plans, .. } = *self.outline;
        let (children, count) = children(binary, plans, at);
        let children = &self.by_area(children, count)[..count];
        let mut node = Node::empty();
        for (k, &child) in children.iter().enumerate() {
            self.planes(&mut node, k, child);
        }
        self.nodes.push(node);
        self.depth = self.depth.max(depth);
        for (k, &at) in children.iter().enumerate().filter(|(_, child)| is_leaf(plans, **child)) {
            self.wait((number, k), at);
        }
        for (k, &at) in children.iter().enumerate().filter(|(_, child)| !is_leaf(plans, **child)) {
            let (parent, depth) = ((number, k), depth + 1);
            match &mut self.later {
                Some(later) if at.count as usize <= PART => {
                    let (rows, before) = (Vec::new(), Vec::new());
                    later.push(Later { parent, at, depth, rows, before });
                }
                _ => self.nodes[number].child[k] = Child::node(self.node(at, depth)),
            }
        }
        number
    }

    /// Emits what was left for later, each by itself, and puts it behind the rest.
    fn add_parts(&mut self) {
        let Some(mut later) = self.later.take() else { return };
        later.par_iter_mut().for_each(|later| later.rows = self.rows_below(later.at));
        let mut before: Vec<usize> = self.order.iter().map(Vec::len).collect();
        for later in &mut later {
            later.before.clone_from(&before);
            before.iter_mut().zip(&later.rows).for_each(|(before, rows)| *before += rows);
        }
        let outline = self.outline;
        let part = |later: &Later| {
            let mut part = Self::new(outline, &later.rows, later.before.clone());
            part.nodes.reserve_exact(later.rows.iter().sum::<usize>() / ITEMS_PER_NODE);
            part.subtree(later.at, later.depth);
            part
        };
        let parts: Vec<Self> = later.par_iter().map(part).collect();
        self.nodes.reserve_exact(parts.iter().map(|part| part.nodes.len()).sum());
        self.runs.reserve_exact(parts.iter().map(|part| part.runs.len()).sum());
        for (&Later { parent: (number, k), .. }, part) in later.iter().zip(parts) {
            let (nodes, runs) = (self.nodes.len(), self.runs.len());
            self.nodes[number].child[k] = Child::node(nodes);
            self.nodes.extend(part.nodes.into_iter().map(|mut node| {
                node.child = node.child.map(|child| child.behind(nodes, runs));
                node
            }));
            self.runs.extend(part.runs);
            self.depth = self.depth.max(part.depth);
            self.order.iter_mut().zip(part.order).for_each(|(order, more)| order.extend(more));
        }
    }

    /// Rows of `at` of the binary tree, by kind, if no two leaves share one.
    fn rows_below(&self, at: Subtree) -> Vec<usize> {
        let mut rows = vec![0; self.order.len()];
        for item in self.outline.binary.items_of(at) {
            rows[usize::from(Tag::of(item).kind())] += 1;
        }
        rows
    }

    /// The new row that comes next in a kind.
    #[inline(always)]
    fn next_row(&self, kind: usize) -> u32 {
        (self.before[kind] + self.order[kind].len()) as u32
    }

    /// Puts the largest surface first, the likeliest to stop a ray: rays that any hit ends take children in this order (Nah and
    /// Manocha 2014, SATO: surface area traversal order for shadow ray tracing).
    fn by_area(&self, children: [Subtree; LANES], count: usize) -> [Subtree; LANES] {
        let area = |at: Subtree| {
            let [low, high] = self.outline.binary.bounds(at).corners();
            let [x, y, z] = [0, 1, 2].map(|axis| high[axis] - low[axis]);
            x * y + y * z + z * x
        };
        // Bits of numbers that are not negative are in the numbers' order.
        let key = |k: usize| u64::from(!area(children[k]).to_bits()) << 32 | k as u64;
        let mut keys = [u64::MAX; LANES];
        (0..count).for_each(|k| keys[k] = key(k));
        keys.sort_unstable();
        keys.map(|key| children[key as usize & (LANES - 1)])
    }

    /// Makes the box around `at` of the binary tree that of the `k`th child of `node`.
    #[inline(always)]
    fn planes(&self, node: &mut Node<B>, k: usize, at: Subtree) {
        let [low, high] = self.outline.binary.bounds(at).corners();
        let plane = |x: f32, slack: f64| B::from_f64(f64::from(x) * self.outline.unit + slack);
        for axis in 0..3 {
            node.planes[axis][k] = plane(low[axis], -self.outline.slack[axis]);
            node.planes[3 + axis][k] = plane(high[axis], self.outline.slack[axis]);
        }
    }

    /// Has a leaf, a child of `parent`, wait for its rows among those of its kind.
    fn wait(&mut self, parent: (usize, usize), at: Subtree) {
        let items = self.outline.binary.items_of(at);
        let kind = usize::from(Tag::of(&items[0]).kind());
        self.waiting[kind].push(items.len(), Leaf { parent, at });
        if self.waiting[kind].is_full() {
            self.next_leaf(kind);
        }
    }

    /// Gives rows to one of the waiting leaves of a kind; false if none waits.
    fn next_leaf(&mut self, kind: usize) -> bool {
        let row = self.next_row(kind) as usize;
        let Some(Leaf { parent: (number, k), at }) = self.waiting[kind].pop(row) else { return false };
        self.nodes[number].child[k] = self.leaf(at);
        true
    }

    /// A row that several items share, piece by piece, gets its place where it first comes.
    fn leaf(&mut self, at: Subtree) -> Child {
        let extents = self.outline.binary.items_of(at);
        let mut tags = [Tag::of(&Extent::EMPTY); MAX_LEAF];
        tags[..extents.len()].iter_mut().zip(extents).for_each(|(tag, extent)| *tag = Tag::of(extent));
        let mut tags = &mut tags[..extents.len()];
        tags.sort_unstable_by_key(|tag| tag.key());
        if let Some(place) = &mut self.place {
            let mut kept = 1;
            for k in 1..tags.len() {
                if tags[k].key() != tags[kept - 1].key() {
                    tags[kept] = tags[k];
                    kept += 1;
                }
            }
            tags = &mut tags[..kept];
            for tag in tags.iter_mut() {
                let kind = usize::from(tag.kind());
                let place = &mut place[kind][tag.row as usize];
                if *place == u32::MAX {
                    *place = self.order[kind].len() as u32;
                    self.order[kind].push(tag.row);
                }
                tag.row = *place;
            }
            tags.sort_unstable_by_key(|tag| tag.key());
        } else {
            for tag in tags.iter_mut() {
                let kind = usize::from(tag.kind());
                let new = self.next_row(kind);
                self.order[kind].push(tag.row);
                tag.row = new;
            }
        }
        self.runs(tags)
    }

    /// A leaf of rows, given in the order of kind, class and new row.
    #[inline(always)]
    fn runs(&mut self, tags: &[Tag]) -> Child {
        let first = self.runs.len();
        for run in tags.chunk_by(|a, b| a.key() + 1 == b.key()) {
            let (kind, class) = (run[0].kind(), run[0].class());
            let run = Run { kind, class, last: false, len: run.len() as u32, first: run[0].row };
            if run.len as usize == tags.len()
                && let Some(leaf) = Child::run(&run)
            {
                return leaf;
            }
            self.runs.push(run);
        }
        if let Some(run) = self.runs.last_mut() {
            run.last = true;
        }
        Child::runs(first)
    }
}
