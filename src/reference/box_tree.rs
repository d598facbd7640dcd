//! Where lines need not look: boxes about parts, and a tree over them.
//!
//! What a picture is checked against looks everywhere. Scripts, though, drop ten thousand blades of grass on a ground of a million
//! triangles, and ask the same object each time; for them, and only for them, parts are left out that a line passes by at a
//! distance. What is left is asked as ever, so no answer depends on it.

use glam::DVec3;
use smallvec::SmallVec;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Lowest and highest corner of what holds a part's surface.
pub type PartBox = (DVec3, DVec3);

/// Boxes are widened by this share of the coordinates: thousands of times the roundings of a corner and of a crossing.
const BOX_PAD: f64 = 1e-9;

/// How many boxes and parts lines have been held against.
pub type Tally = Arc<AtomicU64>;

/// Boxes within boxes, halved by the middle of their longest side.
pub struct BoxTree {
    /// A node stands before what is in it, the lower half first.
    nodes: Vec<TreeNode>,
    /// The parts in the order of the nodes that hold them.
    parts: Vec<u32>,
    /// Parts without a box.
    endless: Vec<u32>,
    tally: Tally,
}

struct TreeNode {
    bounds: PartBox,
    /// The first of its parts in the list.
    first: u32,
    /// How many it holds by itself; 0 if other nodes do.
    count: u32,
    /// The first node that is not in it.
    after: u32,
}

/// What a line passes through: all of it, or from its origin on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reach {
    /// From `t = -∞`.
    Whole,
    /// From `t = 0`.
    Ahead,
}

impl BoxTree {
    /// A tree over parts by their boxes, `None` for those that have none; `least` parts or fewer are not told apart.
    pub fn new(boxes: &[Option<PartBox>], least: usize, tally: &Tally) -> Self {
        let numbers = || 0..boxes.len() as u32;
        let mut tree = Self {
            nodes: Vec::new(),
            parts: numbers().filter(|&part| boxes[part as usize].is_some()).collect(),
            endless: numbers().filter(|&part| boxes[part as usize].is_none()).collect(),
            tally: tally.clone(),
        };
        let mut parts = std::mem::take(&mut tree.parts);
        if !parts.is_empty() {
            tree.add(&mut parts, 0, boxes, least);
        }
        tree.parts = parts;
        tree
    }

    /// Adds a node over `parts`, which stand at `first` in the list, and what is in it.
    fn add(&mut self, parts: &mut [u32], first: u32, boxes: &[Option<PartBox>], least: usize) {
        let of = |part: u32| boxes[part as usize].unwrap_or_default();
        let hull = |a: PartBox, b: PartBox| (a.0.min(b.0), a.1.max(b.1));
        let bounds = parts.iter().map(|&part| of(part)).reduce(hull).unwrap_or_default();
        let index = self.nodes.len();
        let count = if parts.len() <= least { parts.len() as u32 } else { 0 };
        self.nodes.push(TreeNode { bounds, first, count, after: 0 });
        if count == 0 {
            let middle = |part: u32| of(part).0 + of(part).1;
            let (low, high) =
                parts.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), &part| {
                    (low.min(middle(part)), high.max(middle(part)))
                });
            let axis = (high - low).max_position();
            let half = parts.len() / 2;
            parts.select_nth_unstable_by(half, |&a, &b| middle(a)[axis].total_cmp(&middle(b)[axis]));
            let (lower, upper) = parts.split_at_mut(half);
            self.add(lower, first, boxes, least);
            self.add(upper, first + half as u32, boxes, least);
        }
        self.nodes[index].after = self.nodes.len() as u32;
    }

    /// The parts that a line may meet, in rising order; `dir` has any length but 0.
    pub fn met_by(&self, origin: DVec3, dir: DVec3, reach: Reach) -> SmallVec<[u32; 16]> {
        let mut met: SmallVec<[u32; 16]> = SmallVec::from_slice(&self.endless);
        let (mut index, mut asked) = (0, 0);
        while let Some(node) = self.nodes.get(index) {
            asked += 1;
            if may_meet(node.bounds, origin, dir, reach) {
                let (first, count) = (node.first as usize, node.count as usize);
                met.extend_from_slice(&self.parts[first..first + count]);
                index += 1;
            } else {
                index = node.after as usize;
            }
        }
        self.tally.fetch_add(asked + met.len() as u64, Ordering::Relaxed);
        met.sort_unstable();
        met
    }
}

/// False if a line passes by a box.
fn may_meet((min, max): PartBox, origin: DVec3, dir: DVec3, reach: Reach) -> bool {
    let pad = min.abs().max(max.abs()).max(origin.abs()).max_element() * BOX_PAD;
    let start = if reach == Reach::Ahead { 0.0 } else { f64::NEG_INFINITY };
    let (mut near, mut far) = (start, f64::INFINITY);
    for axis in 0..3 {
        let (low, high) = (min[axis] - pad - origin[axis], max[axis] + pad - origin[axis]);
        if dir[axis] == 0.0 {
            if low > 0.0 || high < 0.0 {
                return false;
            }
            continue;
        }
        let (a, b) = (low / dir[axis], high / dir[axis]);
        (near, far) = (near.max(a.min(b)), far.min(a.max(b)));
    }
    near <= far
}
