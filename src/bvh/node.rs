//! The form of the finished tree.

use crate::kernel::Aabb;
use crate::lane::{LANES, Scalar};
use glam::DVec3;

/// A tree with boxes in precision `B`.
///
/// Boxes are rounded outward and widened by [`Bvh::slack`], so that rays rounded to `B` hit every box that the exact
/// ray hits, provided they start within the tree's bounds (the walk moves their start there).
#[derive(Debug, Clone)]
pub struct Bvh<B: Scalar> {
    /// The root is the first; empty for an empty tree.
    pub nodes: Vec<Node<B>>,
    /// Leaves are stretches of this list, each up to a run that is marked `last`.
    pub runs: Vec<Run>,
    /// Around everything.
    pub bounds: Aabb,
    /// What is subtracted from world coordinates before rounding to `B`: the middle of `bounds`.
    pub origin: DVec3,
}

/// Eight boxes and what is in them.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub struct Node<B: Scalar> {
    /// Lowest corners, by axis; `+inf` for absent children.
    pub min: [[B; LANES]; 3],
    /// Highest corners, by axis; `-inf` for absent children.
    pub max: [[B; LANES]; 3],
    /// Child by child.
    pub child: [Child; LANES],
}

/// A node or a leaf.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Child(u32);

impl Child {
    const LEAF: u32 = 1 << 31;
    /// There is none.
    pub const NONE: Self = Self(u32::MAX);

    /// Node number `index`.
    pub fn node(index: usize) -> Self {
        debug_assert!(index < Self::LEAF as usize);
        Self(index as u32)
    }

    /// The leaf whose first run is `run`.
    pub fn leaf(run: usize) -> Self {
        debug_assert!(run < Self::LEAF as usize - 1);
        Self(run as u32 | Self::LEAF)
    }

    /// True for a leaf.
    #[inline(always)]
    pub fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    /// The node's or first run's number.
    #[inline(always)]
    pub fn index(self) -> usize {
        (self.0 & !Self::LEAF) as usize
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
    /// No children.
    pub fn empty() -> Self {
        Self {
            min: [[B::from_f64(f64::INFINITY); LANES]; 3],
            max: [[B::from_f64(f64::NEG_INFINITY); LANES]; 3],
            child: [Child::NONE; LANES],
        }
    }
}

impl<B: Scalar> Bvh<B> {
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
                let side: [f64; 3] =
                    std::array::from_fn(|axis| node.max[axis][k].to_f64() - node.min[axis][k].to_f64());
                let area = side[0] * side[1] + side[1] * side[2] + side[2] * side[0];
                let tests = if child.is_leaf() { self.leaf_len(*child) as f64 } else { 1.0 };
                cost += tests * area / whole;
            }
        }
        cost
    }

    fn leaf_len(&self, leaf: Child) -> u32 {
        let mut len = 0;
        for run in &self.runs[leaf.index()..] {
            len += run.len;
            if run.last {
                break;
            }
        }
        len
    }

    /// How far each box is widened on every side: what rounding a start and a direction inside the bounds to `B`
    /// can move a point of the ray, with room for the slab test's own three roundings.
    ///
    /// A start is off by at most u per component times the half size of the bounds; a direction component is off by
    /// u, over a way of at most the diagonal d; origin and box add one rounding each: together under `6 u d`. The
    /// doubled figure covers the walk's own arithmetic for moving the start.
    pub fn slack(bounds: &Aabb) -> f64 {
        12.0 * B::UNIT_ROUNDOFF * (bounds.max - bounds.min).length()
    }
}
