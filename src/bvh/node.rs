//! The form of the finished tree.

use crate::kernel::Aabb;
use crate::lane::{LANES, Scalar, prefetch};
use glam::DVec3;

/// A tree with boxes in precision `B`.
///
/// Boxes are rounded outward and widened by [`Bvh::slack`], so that rays rounded to `B` hit every box that the exact
/// ray hits, provided they start within the tree's bounds (the walk moves their start there).
#[derive(Debug, Clone)]
pub struct Bvh<B: Scalar> {
    /// The root is the first; empty for an empty tree.
    pub nodes: Vec<Node<B>>,
    /// Leaves of more than one run are stretches of this list, each up to a run that is marked `last`.
    pub runs: Vec<Run>,
    /// Around everything.
    pub bounds: Aabb,
    /// Nodes on the longest way down.
    pub depth: usize,
    /// Union of the classes of all leaves.
    pub classes: u8,
    /// The bounds relative to `origin`, widened as the boxes are: lowest and highest corner.
    pub entry: [[B; 3]; 2],
    /// Testing one ray costs as much as testing eight for most of what is in the leaves, so rays had better stay together.
    pub together: bool,
    /// What is subtracted from coordinates before rounding to `B`: the middle of `bounds`, or zero if that is not far.
    pub origin: DVec3,
}

/// Eight boxes and what is in them: 256 bytes in single precision.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub struct Node<B: Scalar> {
    /// Lowest corners by axis, then highest corners by axis; `+inf` and `-inf` for absent children.
    pub planes: [[B; LANES]; 6],
    /// Child by child, the largest box first.
    pub child: [Child; LANES],
}

/// A node or a leaf, in one number: a walk waits for it, and two would be read as a vector and taken apart.
///
/// In the lower half the node's number, a leaf's first row, or the first of a leaf's runs in [`Bvh::runs`]. In the upper half 0
/// for a node; for a leaf of one run `LEAF`, length, class and kind, in bits 31, 16 to 30, 8 to 15, 0 to 7; for a leaf of
/// several runs `SEVERAL`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Child(u64);

impl Child {
    const LEAF: u32 = 1 << 31;
    const SEVERAL: u32 = 0x7fff_ffff;
    const MOST: u32 = 0x7fff;
    /// There is none.
    pub const NONE: Self = Self(u64::MAX);
    /// The root of a tree that is not empty.
    pub const ROOT: Self = Self(0);

    fn new(at: u32, what: u32) -> Self {
        Self(u64::from(what) << 32 | u64::from(at))
    }

    #[inline(always)]
    fn what(self) -> u32 {
        (self.0 >> 32) as u32
    }

    /// Node number `index`.
    pub fn node(index: usize) -> Self {
        debug_assert!(index < u32::MAX as usize);
        Self::new(index as u32, 0)
    }

    /// A leaf of one run, if it is not too long for that.
    pub fn run(run: &Run) -> Option<Self> {
        let what = Self::LEAF | run.len << 16 | u32::from(run.class) << 8 | u32::from(run.kind);
        (run.len <= Self::MOST && run.kind < u8::MAX).then_some(Self::new(run.first, what))
    }

    /// A leaf whose first run is number `run` of [`Bvh::runs`].
    pub fn runs(run: usize) -> Self {
        Self::new(run as u32, Self::SEVERAL)
    }

    /// The same child where so many nodes and runs have come before those it was made among.
    pub fn behind(self, nodes: usize, runs: usize) -> Self {
        match self.what() {
            0 => Self::node(self.index() + nodes),
            Self::SEVERAL => Self::runs(self.index() + runs),
            _ => self,
        }
    }

    /// True for a leaf.
    #[inline(always)]
    pub fn is_leaf(self) -> bool {
        self.what() != 0
    }

    /// The run of a leaf of one.
    #[inline(always)]
    pub fn only_run(self) -> Option<Run> {
        (self.what() & Self::LEAF != 0).then_some(self.as_run())
    }

    #[inline(always)]
    fn as_run(self) -> Run {
        let what = self.what();
        let (kind, class, len) = (what as u8, (what >> 8) as u8, what >> 16 & Self::MOST);
        Run { kind, class, last: true, len, first: self.0 as u32 }
    }

    /// A node's number.
    #[inline(always)]
    pub fn index(self) -> usize {
        self.0 as u32 as usize
    }
}

/// Neighbouring rows of one kind's columns that are alike in what rays see them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Run {
    /// Which columns.
    pub kind: u8,
    /// Bits that a walk's filter must share, at least one of them (see `compile::class`).
    pub class: u8,
    /// The leaf ends here.
    pub last: bool,
    /// Rows.
    pub len: u32,
    /// First row.
    pub first: u32,
}

impl<B: Scalar> Node<B> {
    /// How many children there are.
    #[inline(always)]
    pub fn children(&self) -> u32 {
        self.present().count_ones()
    }

    /// A bit for each child that is there.
    #[inline(always)]
    pub fn present(&self) -> u8 {
        (0..LANES).fold(0, |present, c| present | u8::from(self.child[c] != Child::NONE) << c)
    }

    /// Asks the memory for all of it.
    #[inline(always)]
    pub fn prefetch(&self) {
        self.planes.iter().step_by(64 / size_of::<[B; LANES]>()).for_each(prefetch);
        prefetch(&self.child);
    }

    /// No children.
    pub fn empty() -> Self {
        Self {
            planes: std::array::from_fn(|k| {
                [B::from_f64(if k < 3 { f64::INFINITY } else { f64::NEG_INFINITY }); LANES]
            }),
            child: [Child::NONE; LANES],
        }
    }
}

impl<B: Scalar> Bvh<B> {
    /// Asks the memory for what a child is: a node, or, if these are `worth` it, a leaf's rows, by `rows`. For other leaves it asks for
    /// the first node, which is always there: which children are leaves would have to be guessed.
    #[inline(always)]
    pub fn prefetch(&self, child: Child, worth: bool, rows: impl FnOnce(&Run)) {
        match child.only_run() {
            Some(run) if worth => rows(&run),
            _ => self.nodes[if child.is_leaf() { 0 } else { child.index() }].prefetch(),
        }
    }

    /// Bytes of nodes and runs.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.runs[..])
    }

    /// What a ray that meets the bounds is expected to cost (the surface-area heuristic): 1 for each node it steps
    /// through, 1 for each primitive it is tested against.
    pub fn sah(&self) -> f64 {
        let whole = self.bounds.half_area();
        let mut cost = 1.0;
        for node in &self.nodes {
            for (k, child) in node.child.iter().enumerate().filter(|(_, child)| **child != Child::NONE) {
                let side: [f64; 3] = std::array::from_fn(|axis| {
                    node.planes[3 + axis][k].to_f64() - node.planes[axis][k].to_f64()
                });
                let area = side[0] * side[1] + side[1] * side[2] + side[2] * side[0];
                let tests = if child.is_leaf() { self.leaf_len(*child) as f64 } else { 1.0 };
                cost += tests * area / whole;
            }
        }
        cost
    }

    fn leaf_len(&self, leaf: Child) -> u32 {
        let mut len = 0;
        self.for_each_run(leaf, |run| len += run.len);
        len
    }

    /// Hands the runs of a leaf to `with`, one after the other.
    #[inline(always)]
    pub fn for_each_run(&self, leaf: Child, mut with: impl FnMut(&Run)) {
        let mut next = leaf.index();
        let mut run = leaf.as_run();
        if leaf.what() == Child::SEVERAL {
            run = self.runs[next];
        }
        // One call, so that it is inlined: what a leaf does is large.
        loop {
            with(&run);
            if run.last {
                break;
            }
            next += 1;
            run = self.runs[next];
        }
    }

    /// How far boxes within `bounds` are widened on either side of each axis: what roundings can move a plane's
    /// crossing, seen as a displacement of the plane.
    ///
    /// A ray's crossing of a plane is taken as `plane * inverse - start * inverse`. With u the unit roundoff, r the
    /// largest coordinate and w the width along the axis, that is off by u r for each of the rounded start, the rounded
    /// plane and the product `start * inverse`, and by u w for each of the rounded direction, its
    /// inverse and the last sum, since rays start within the bounds. A machine that does not multiply and add at once
    /// rounds `plane * inverse` too: 4 r + 3 w.
    /// In double precision the walk's own arithmetic for moving the start counts as well, hence the factor.
    pub fn slack(bounds: &Aabb) -> DVec3 {
        let reach = bounds.min.abs().max(bounds.max.abs());
        let width = bounds.max - bounds.min;
        let own = if B::UNIT_ROUNDOFF > f64::UNIT_ROUNDOFF { 1.0 } else { 3.0 };
        (reach * 4.0 + width * 3.0) * (1.0625 * own * B::UNIT_ROUNDOFF)
    }
}
