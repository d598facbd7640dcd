//! Boxes to a tree of two children a node, from the top down, each node's items parted in place (`part`).
//!
//! It knows boxes in single precision and what a test of their contents costs; not what the contents are.

use super::extent::{Around, Extent};
use super::part::{FEW, binned, by_size, exhausted, swept};
use crate::parallel;

/// A tree of two children a node over reordered items, in whose place no nodes stand: they would be half of all.
///
/// Nodes stand before what is below them, first all of the first child. A node's first number is how many items that has: it tells where
/// the second child stands, since of a tree over `n` items there are `n - 1` nodes. An item's numbers are its owner's number for it
/// and the bits of its cost.
#[derive(Debug, Default)]
pub(super) struct Binary {
    pub nodes: Vec<Extent>,
    pub items: Vec<Extent>,
}

/// Some items that stand together, all that is below a node, or one.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Subtree {
    pub first: u32,
    pub count: u32,
    /// The node above them, if they are several.
    pub node: u32,
}

impl Binary {
    /// Over `items` (at least one, at most 2^31), splits sought among `BINS` places an axis, or `HALF` as many where there
    /// are few items. The same tree on any number of threads.
    pub fn over<const BINS: usize, const HALF: usize>(mut items: Vec<Extent>) -> Self {
        // (Zeros, so that the pages come to the thread that writes to them first.)
        let mut nodes = bytemuck::zeroed_vec(items.len() - 1);
        let around = parallel::fold(items.len(), Around::NOTHING, |k| Around::of(items[k]), Around::with);
        split::<BINS, HALF>(&mut items, &mut nodes, (around, true));
        Self { nodes, items }
    }

    /// All of it.
    pub fn root(&self) -> Subtree {
        Subtree { first: 0, count: self.items.len() as u32, node: 0 }
    }

    /// The children of a node.
    #[inline(always)]
    pub fn children(&self, Subtree { first, count, node }: Subtree) -> [Subtree; 2] {
        let (left, _) = self.nodes[node as usize].tags();
        [
            Subtree { first, count: left, node: node + 1 },
            Subtree { first: first + left, count: count - left, node: node + left },
        ]
    }

    /// The box around items.
    #[inline(always)]
    pub fn bounds(&self, Subtree { first, count, node }: Subtree) -> &Extent {
        if count == 1 { &self.items[first as usize] } else { &self.nodes[node as usize] }
    }

    /// The items themselves.
    #[inline(always)]
    pub fn items_of(&self, Subtree { first, count, .. }: Subtree) -> &[Extent] {
        &self.items[first as usize..(first + count) as usize]
    }
}

/// `around` the items need know of the middles only where there are more than [`FEW`]. At the `top`, that is where all items are
/// together but for larger ones or smaller ones, they may be parted by size. (Farther down it hardly ever is better.)
fn split<const BINS: usize, const HALF: usize>(
    items: &mut [Extent],
    nodes: &mut [Extent],
    (around, top): (Around, bool),
) {
    let mut sized = None;
    let (at, sides) = match items.len() {
        1 => return,
        2 => {
            nodes[0] = around.bounds.tagged(1, 0);
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
    nodes[0] = around.bounds.tagged(at as u32, 0);
    let top = sized.is_some();
    let parallel = items.len() > parallel::PIECE;
    let (left, right) = items.split_at_mut(at);
    let (left_nodes, right_nodes) = nodes[1..].split_at_mut(at - 1);
    let mut left = || split::<BINS, HALF>(left, left_nodes, (sides[0], top));
    let mut right = || split::<BINS, HALF>(right, right_nodes, (sides[1], top));
    if parallel {
        rayon::join(left, right);
    } else {
        left();
        right();
    }
}

/// Nodes of at most so many items make do with half as many bins.
const HALF_BINS_TO: usize = 32;
