//! Boxes to a tree of two children a node, from the top down, each node's items parted in place (`part`).
//!
//! It knows boxes in single precision and what a test of their contents costs; not what the contents are.

use super::extent::{Around, Extent};
use super::part::{FEW, binned, by_size, exhausted, swept};
use crate::parallel;

/// A tree of two children a node over reordered items, one in each leaf.
///
/// Nodes stand before their children, the first of which follows at once: the second is found by the count, since a node
/// over `n` items and all below it are `2 n - 1`. A node's numbers are its first item and how many it has; an item's are
/// its owner's number for it and the bits of its cost.
#[derive(Debug, Default)]
pub(super) struct Binary {
    pub nodes: Vec<Extent>,
    pub items: Vec<Extent>,
}

impl Binary {
    /// Over `items` (at least one, at most 2^31), splits sought among `BINS` places an axis, or `HALF` as many where there
    /// are few items. The same tree on any number of threads.
    pub fn over<const BINS: usize, const HALF: usize>(mut items: Vec<Extent>) -> Self {
        // (Zeros, so that the pages come to the thread that writes to them first.)
        let mut nodes = bytemuck::zeroed_vec(2 * items.len() - 1);
        let around = parallel::fold(items.len(), Around::NOTHING, |k| Around::of(items[k]), Around::with);
        split::<BINS, HALF>(&mut items, &mut nodes, 0, (around, true));
        Self { nodes, items }
    }

    /// Where the second child of node `at` stands; `at` must not be a leaf.
    #[inline(always)]
    pub fn second(&self, at: usize) -> usize {
        second(&self.nodes, at)
    }
}

/// The same for a node and all below it.
#[inline(always)]
pub(super) fn second(nodes: &[Extent], at: usize) -> usize {
    at + 2 * nodes[at + 1].tags().1 as usize
}

/// `around` the items need know of the middles only where there are more than [`FEW`]. At the `top`, that is where all items are
/// together but for larger ones or smaller ones, they may be parted by size. (Farther down it hardly ever is better.)
fn split<const BINS: usize, const HALF: usize>(
    items: &mut [Extent],
    nodes: &mut [Extent],
    first: u32,
    (around, top): (Around, bool),
) {
    nodes[0] = around.bounds.tagged(first, items.len() as u32);
    let mut sized = None;
    let (at, sides) = match items.len() {
        1 => return,
        2 => {
            // Both children are leaves.
            nodes[1] = items[0].tagged(first, 1);
            nodes[2] = items[1].tagged(first + 1, 1);
            return;
        }
        3 => exhausted::<3>(items),
        4 => exhausted::<4>(items),
        few if few <= FEW => swept(items),
        many => {
            if top {
                sized = by_size::<BINS>(items, &around);
            }
            match sized {
                Some(sides) => sides,
                None if many <= HALF_BINS_TO => binned::<HALF>(items, &around.centers),
                None => binned::<BINS>(items, &around.centers),
            }
        }
    };
    let top = sized.is_some();
    let parallel = items.len() > parallel::PIECE;
    let (left, right) = items.split_at_mut(at);
    let (left_nodes, right_nodes) = nodes[1..].split_at_mut(2 * at - 1);
    let second = first + at as u32;
    let mut left = || split::<BINS, HALF>(left, left_nodes, first, (sides[0], top));
    let mut right = || split::<BINS, HALF>(right, right_nodes, second, (sides[1], top));
    if parallel {
        rayon::join(left, right);
    } else {
        left();
        right();
    }
}

/// Nodes of at most so many items make do with half as many bins.
const HALF_BINS_TO: usize = 32;
