//! A better tree of two children a node: subtrees are taken out and put in again where they make the nodes above them
//! larger by least (Bittner, Hapala, Havran 2013, Fast insertion-based optimization of bounding volume hierarchies), many
//! at a time, each sought from its own place up and down again (Meister, Bittner 2018, Parallel reinsertion for bounding
//! volume hierarchy optimization).

use super::binary::Binary;
use super::extent::Extent;
use rayon::prelude::*;

/// In a round the largest of so many nodes are looked at: the rest hardly count. (Of a quarter, a tenth, a twentieth the
/// smaller shares come to worse trees, whatever the rounds.)
const ONE_OF: usize = 4;
/// Nodes whose places are sought by one thread at a time.
const CHUNK: usize = 64;
/// No node.
const NONE: u32 = u32::MAX;

/// `tree` after some rounds; the same on any number of threads.
pub(super) fn bettered(tree: Binary, rounds: usize) -> Binary {
    let mut linked = Linked::of(&tree);
    for _ in 0..rounds {
        if linked.round() == 0 {
            break;
        }
    }
    linked.in_order(&tree.items)
}

/// A tree whose nodes may lie anywhere; the first is the root.
struct Linked {
    /// A leaf's first number is its item.
    extents: Vec<Extent>,
    /// `[NONE; 2]` for leaves.
    children: Vec<[u32; 2]>,
    parent: Vec<u32>,
}

/// A subtree that would lie better elsewhere.
#[derive(Clone, Copy)]
struct Move {
    /// What all areas together lose.
    gain: f32,
    node: u32,
    /// The node that it is to be made the sibling of.
    target: u32,
}

impl Linked {
    fn of(tree: &Binary) -> Self {
        let count = tree.nodes.len() + tree.items.len();
        let mut linked = Self {
            extents: Vec::with_capacity(count),
            children: Vec::with_capacity(count),
            parent: Vec::with_capacity(count),
        };
        // With their parents, the next on top.
        let mut waiting = vec![(tree.root(), NONE)];
        while let Some((subtree, parent)) = waiting.pop() {
            let at = linked.extents.len() as u32;
            linked.extents.push(tree.bounds(subtree).tagged(subtree.first, 0));
            linked.parent.push(parent);
            let mut children = [NONE; 2];
            if subtree.count > 1 {
                let [one, other] = tree.children(subtree);
                // A tree over `n` items has `2 n - 1` places here.
                children = [at + 1, at + 2 * one.count];
                waiting.extend([(other, at), (one, at)]);
            }
            linked.children.push(children);
        }
        linked
    }

    fn sibling(&self, at: u32) -> u32 {
        let [a, b] = self.children[self.parent[at as usize] as usize];
        if a == at { b } else { a }
    }

    /// Moves what gains by it; how many were moved.
    fn round(&mut self) -> usize {
        let mut largest: Vec<(f32, u32)> = (1..self.extents.len() as u32)
            .filter(|&at| self.parent[at as usize] != 0)
            .map(|at| (self.extents[at as usize].half_area(), at))
            .collect();
        let by_area = |a: &(f32, u32), b: &(f32, u32)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
        let count = largest.len() / ONE_OF;
        if count == 0 {
            return 0;
        }
        largest.select_nth_unstable_by(count, by_area);
        largest.truncate(count);
        let mut moves: Vec<Move> = largest
            .par_chunks(CHUNK)
            .flat_map_iter(|chunk| {
                let mut stack = Vec::new();
                chunk.iter().filter_map(|&(_, at)| self.best_place(at, &mut stack)).collect::<Vec<_>>()
            })
            .collect();
        moves.sort_unstable_by(|a, b| b.gain.total_cmp(&a.gain).then(a.node.cmp(&b.node)));
        let mut touched = vec![false; self.extents.len()];
        moves.into_iter().filter(|&this| self.apply(this, &mut touched)).count()
    }

    /// Where `node` would lie best; `None` if it does already. Branch and bound: below a node, no place is better than
    /// that node's own growth leaves it.
    fn best_place(&self, node: u32, stack: &mut Vec<(f32, u32)>) -> Option<Move> {
        let extent = self.extents[node as usize];
        let area = extent.half_area();
        let parent = self.parent[node as usize];
        let mut best = Move { gain: 0.0, node, target: NONE };
        // What is gained by taking the node out, so far up as has been looked: its parent goes, those above shrink.
        let mut out = self.extents[parent as usize].half_area();
        let (mut pivot, mut below) = (parent, node);
        let mut rest = Extent::EMPTY;
        loop {
            let sibling = self.sibling(below);
            stack.push((out, sibling));
            while let Some((gain, at)) = stack.pop() {
                if gain - area <= best.gain {
                    continue;
                }
                let there = self.extents[at as usize];
                let gain_here = gain - there.around(extent).half_area();
                if gain_here > best.gain {
                    (best.gain, best.target) = (gain_here, at);
                }
                let [a, b] = self.children[at as usize];
                if a != NONE {
                    let gain_below = gain_here + there.half_area();
                    if gain_below - area > best.gain {
                        stack.push((gain_below, a));
                        stack.push((gain_below, b));
                    }
                }
            }
            rest = rest.around(self.extents[sibling as usize]);
            if pivot != parent {
                out += self.extents[pivot as usize].half_area() - rest.half_area();
            }
            if self.parent[pivot as usize] == NONE {
                break;
            }
            (below, pivot) = (pivot, self.parent[pivot as usize]);
        }
        (best.target != NONE).then_some(best)
    }

    /// Moves a subtree, unless what it is taken from or put to has been touched in this round.
    fn apply(&mut self, Move { node, target, .. }: Move, touched: &mut [bool]) -> bool {
        let parent = self.parent[node as usize];
        let above = self.parent[parent as usize];
        let sibling = self.sibling(node);
        let concerned = [node, parent, above, sibling, target, self.parent[target as usize]];
        if concerned.iter().any(|&at| at == NONE || touched[at as usize]) || self.is_below(target, node) {
            return false;
        }
        concerned.iter().for_each(|&at| touched[at as usize] = true);
        self.relink(above, parent, sibling);
        let target_parent = self.parent[target as usize];
        self.relink(target_parent, target, parent);
        self.children[parent as usize] = [target, node];
        self.parent[target as usize] = parent;
        self.refit(parent);
        self.refit(above);
        true
    }

    fn is_below(&self, mut at: u32, node: u32) -> bool {
        while at != NONE && at != node {
            at = self.parent[at as usize];
        }
        at == node
    }

    /// Puts `new` in the place of `old` below `at`.
    fn relink(&mut self, at: u32, old: u32, new: u32) {
        for child in &mut self.children[at as usize] {
            if *child == old {
                *child = new;
            }
        }
        self.parent[new as usize] = at;
    }

    /// Boxes from `at` up.
    fn refit(&mut self, mut at: u32) {
        while at != NONE {
            let [a, b] = self.children[at as usize];
            self.extents[at as usize] = self.extents[a as usize].around(self.extents[b as usize]);
            at = self.parent[at as usize];
        }
    }

    /// In the order of [`Binary`].
    fn in_order(&self, old: &[Extent]) -> Binary {
        let mut order = Vec::with_capacity(self.extents.len());
        let mut waiting = vec![0u32];
        while let Some(at) = waiting.pop() {
            let [a, b] = self.children[at as usize];
            order.push(at as usize);
            if a != NONE {
                waiting.extend([b, a]);
            }
        }
        let is_item = |at: usize| self.children[at][0] == NONE;
        // Items, by place in that order.
        let mut counts = vec![1u32; order.len()];
        for place in (0..order.len()).rev().filter(|&place| !is_item(order[place])) {
            let left = counts[place + 1];
            counts[place] = left + counts[place + 2 * left as usize];
        }
        let (mut nodes, mut items) = (Vec::with_capacity(old.len() - 1), Vec::with_capacity(old.len()));
        for (place, at) in order.into_iter().enumerate() {
            let extent = self.extents[at];
            if is_item(at) {
                items.push(old[extent.tags().0 as usize]);
            } else {
                nodes.push(extent.tagged(counts[place + 1], 0));
            }
        }
        Binary { nodes, items }
    }
}
