//! Which nodes of a tree of two children become nodes of eight, and which leaves: the choice of least cost by the
//! surface-area heuristic, found from the bottom up (Ylitie, Karras, Laine 2017, Efficient incoherent ray traversal on
//! GPUs through compressed wide BVHs, section 3.1).

use super::binary::{Binary, Subtree};
use super::extent::Extent;
use super::items::Tag;
use crate::lane::{LANES, Lane, QUAD, f32x8};
use crate::parallel;
use bytemuck::Zeroable;

/// A leaf never holds more.
pub(super) const MAX_LEAF: usize = 8;
/// Cost of one step through a node, in box tests of a packet. (1.5 is as good on meshes, 3 costs spheres' camera rays 6 %.)
const STEP_COST: f32 = 2.0;
/// Cost of going into a leaf, for every four rows or part of them: one ray is tested against four at a time. The tests come
/// on top.
const LEAF_COST: f32 = 2.0;

/// How a node is best divided if it must be `k + 1` trees or fewer: how many of those come from its first child; 0 for as
/// with one tree fewer. For one tree: 0 for a leaf.
#[derive(Debug, Clone, Copy, Zeroable)]
pub(super) struct Plan([u8; LANES]);

/// What a node and all below it cost at best in `k + 1` trees or fewer; at last, in eight.
type Costs = [f32; LANES];

/// Plans for every node.
pub(super) fn plan(tree: &Binary) -> Vec<Plan> {
    let mut plans = bytemuck::zeroed_vec(tree.nodes.len());
    weigh(&tree.nodes, &tree.items, &mut plans);
    plans
}

fn weigh(nodes: &[Extent], items: &[Extent], plans: &mut [Plan]) -> Costs {
    let area = nodes.first().unwrap_or(&items[0]).half_area();
    let count = items.len();
    let leaf = if count <= MAX_LEAF {
        let tests: f32 = items.iter().map(|item| Tag::of(item).cost()).sum();
        (tests + LEAF_COST * count.div_ceil(QUAD) as f32) * area
    } else {
        f32::INFINITY
    };
    if count == 1 {
        return [leaf; LANES];
    }
    let at = nodes[0].tags().0 as usize;
    let (own, below) = plans.split_at_mut(1);
    let (left_plans, right_plans) = below.split_at_mut(at - 1);
    let (left_nodes, right_nodes) = nodes[1..].split_at(at - 1);
    let (left_items, right_items) = items.split_at(at);
    let mut left = || weigh(left_nodes, left_items, left_plans);
    let mut right = || weigh(right_nodes, right_items, right_plans);
    let (left, right) = if count > parallel::PIECE { rayon::join(left, right) } else { (left(), right()) };

    // For two trees up to eight at once: with k of them from the first child, the second gives as many less.
    let (none, mut shifted) = (f32x8::splat(f32::INFINITY), [f32::INFINITY; 2 * LANES]);
    shifted[LANES..].copy_from_slice(&right);
    let (mut least, mut first) = (none, f32x8::splat(1.0));
    for k in 1..LANES {
        let rest: [f32; LANES] = std::array::from_fn(|trees| shifted[LANES - k + trees]);
        let cost = f32x8::splat(left[k - 1]) + f32x8::new(rest);
        let less = cost.lt(least);
        (least, first) = (least.fast_min(cost), less.select(f32x8::splat(k as f32), first));
    }
    let (mut costs, mut firsts) = (least.to_array(), first.to_array().map(|k| k as u8));
    let node = costs[LANES - 1] + STEP_COST * area;
    (costs[0], firsts[0]) = if leaf <= node { (leaf, 0) } else { (node, 1) };
    for trees in 2..LANES {
        // As another node's child it may stay whole.
        if costs[trees - 2] <= costs[trees - 1] {
            (costs[trees - 1], firsts[trees - 1]) = (costs[trees - 2], 0);
        }
    }
    own[0] = Plan(firsts);
    costs
}

/// What becomes the children of the node above `at`, which is not a leaf, and how many they are.
pub(super) fn children(tree: &Binary, plans: &[Plan], at: Subtree) -> ([Subtree; LANES], usize) {
    let (mut children, mut count) = ([Subtree::default(); LANES], 0);
    let (mut waiting, mut left) = ([(at, LANES); LANES], 1);
    while left > 0 {
        left -= 1;
        let (at, mut trees) = waiting[left];
        let Plan(firsts) = plan_of(plans, at);
        let mut first = usize::from(firsts[trees - 1]);
        while trees > 1 && first == 0 {
            trees -= 1;
            first = usize::from(firsts[trees - 1]);
        }
        if trees == 1 {
            children[count] = at;
            count += 1;
        } else {
            let [one, other] = tree.children(at);
            waiting[left] = (other, trees - first);
            waiting[left + 1] = (one, first);
            left += 2;
        }
    }
    (children, count)
}

/// True if `at` becomes a leaf.
#[inline(always)]
pub(super) fn is_leaf(plans: &[Plan], at: Subtree) -> bool {
    plan_of(plans, at).0[0] == 0
}

/// One item is one tree, however many it might be.
#[inline(always)]
fn plan_of(plans: &[Plan], at: Subtree) -> Plan {
    if at.count == 1 { Plan([0; LANES]) } else { plans[at.node as usize] }
}
