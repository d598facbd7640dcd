//! The finished tree of eight children a node, written from the tree of two and the plan of which of its nodes stay.

use super::binary::{Binary, Extent};
use super::collapse::{MAX_LEAF, Plan, children, is_leaf};
use super::items::Tag;
use super::{Bvh, Child, Node, Run};
use crate::lane::{LANES, QUAD, Scalar, bits};
use glam::DVec3;

/// Writes nodes, runs and the new order of rows.
pub(super) struct Emit<'a, B: Scalar> {
    pub tree: &'a mut Bvh<B>,
    pub binary: &'a Binary,
    pub plans: &'a [Plan],
    /// By kind: rows in the order of the leaves.
    pub order: &'a mut [Vec<u32>],
    /// If leaves share rows, by kind and old row: its new one, or `u32::MAX` if no leaf has had it.
    pub place: Option<Vec<Vec<u32>>>,
    /// One of the binary tree's coordinates in scene units.
    pub unit: f64,
    pub slack: DVec3,
}

impl<B: Scalar> Emit<'_, B> {
    /// Emits everything.
    pub fn root(&mut self) {
        if !is_leaf(self.plans, 0) {
            self.node(0, 1);
            return;
        }
        // The walk begins at a node.
        self.tree.depth = 1;
        let mut node = Node::empty();
        self.planes(&mut node, 0, 0);
        node.child[0] = self.leaf(0);
        self.tree.nodes.push(node);
    }

    /// Emits node `at` of the binary tree as a node at `depth` and returns its number.
    fn node(&mut self, at: usize, depth: usize) -> usize {
        let number = self.tree.nodes.len();
        let (children, count) = children(self.binary, self.plans, at);
        let children = &self.by_area(children, count)[..count];
        let mut node = Node::empty();
        for (k, &child) in children.iter().enumerate() {
            self.planes(&mut node, k, child);
        }
        self.tree.nodes.push(node);
        self.tree.depth = self.tree.depth.max(depth);
        let mut leaves = 0u8;
        for (k, &child) in children.iter().enumerate() {
            leaves |= u8::from(is_leaf(self.plans, child)) << k;
        }
        // A node's leaves lie together, in the order that parts the fewest of them over two fours of rows.
        while leaves != 0 {
            let k = self.next_leaf(children, leaves);
            leaves &= !(1 << k);
            self.tree.nodes[number].child[k] = self.leaf(children[k]);
        }
        for (k, &child) in children.iter().enumerate() {
            if !is_leaf(self.plans, child) {
                self.tree.nodes[number].child[k] = Child::node(self.node(child, depth + 1));
            }
        }
        number
    }

    /// Puts the largest surface first, the likeliest to stop a ray: rays that any hit ends take children in this order (Nah and
    /// Manocha 2014, SATO: surface area traversal order for shadow ray tracing).
    fn by_area(&self, children: [usize; LANES], count: usize) -> [usize; LANES] {
        let area = |at: usize| {
            let [low, high] = self.binary.nodes[at].corners();
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

    /// Makes the box of node `at` of the binary tree that of the `k`th child of `node`.
    #[inline(always)]
    fn planes(&self, node: &mut Node<B>, k: usize, at: usize) {
        let [low, high] = self.binary.nodes[at].corners();
        let plane = |x: f32, slack: f64| B::from_f64(f64::from(x) * self.unit + slack);
        for axis in 0..3 {
            node.planes[axis][k] = plane(low[axis], -self.slack[axis]);
            node.planes[3 + axis][k] = plane(high[axis], self.slack[axis]);
        }
    }

    /// The largest of `leaves`, bits of `children`, that fits into what is left of four rows, or the largest: single rays are
    /// tested against four rows at a time.
    fn next_leaf(&self, children: &[usize], leaves: u8) -> usize {
        let mut best = (0, 0);
        for k in bits(leaves) {
            let (first, count) = self.binary.nodes[children[k]].tags();
            let kind = Tag::of(&self.binary.items[first as usize]).kind();
            let room = QUAD - self.order[usize::from(kind)].len() % QUAD;
            let count = count as usize;
            let worth = if count <= room { 2 * MAX_LEAF + count } else { count };
            if worth > best.0 {
                best = (worth, k);
            }
        }
        best.1
    }

    /// A row that several items share, piece by piece, gets its place where it first comes.
    fn leaf(&mut self, at: usize) -> Child {
        let (first, count) = self.binary.nodes[at].tags();
        let binary = self.binary;
        let extents = &binary.items[first as usize..(first + count) as usize];
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
                let order = &mut self.order[usize::from(tag.kind())];
                order.push(tag.row);
                tag.row = order.len() as u32 - 1;
            }
        }
        self.runs(tags)
    }

    /// A leaf of rows, given in the order of kind, class and new row.
    #[inline(always)]
    fn runs(&mut self, tags: &[Tag]) -> Child {
        let first = self.tree.runs.len();
        for run in tags.chunk_by(|a, b| a.key() + 1 == b.key()) {
            let (kind, class) = (run[0].kind(), run[0].class());
            let run = Run { kind, class, last: false, len: run.len() as u32, first: run[0].row };
            if run.len as usize == tags.len()
                && let Some(leaf) = Child::run(&run)
            {
                return leaf;
            }
            self.tree.runs.push(run);
        }
        if let Some(run) = self.tree.runs.last_mut() {
            run.last = true;
        }
        Child::runs(first)
    }
}
