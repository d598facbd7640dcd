//! What a walk remembers of the nodes behind it, and in which order it takes a node's children.

use super::eights::{GroupRays, Packets};
use super::{Child, Node};
use crate::lane::{LANES, Lane, Many, Scalar};

/// What is still to be looked at; kept between walks so that nothing is allocated.
#[derive(Debug, Default)]
pub struct Stack<B: Scalar> {
    packets: Vec<Entry<B>>,
    rays: Vec<Entry<B, GroupRays>>,
}

/// What waits for packets or lanes of a packet, and what waits for rays of several packets.
pub(super) type Stacks<'a, B> = (&'a mut [Entry<B>], &'a mut [Entry<B, GroupRays>]);

/// A node or a leaf that waits.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry<B, W = Packets> {
    pub near: B,
    pub child: Child,
    /// The packets of a group, the lanes of a packet, or the rays of a group, that may meet it.
    pub who: W,
}

impl<B: Scalar> Stack<B> {
    /// Both with room for walks of a tree so deep.
    #[inline(always)]
    pub(super) fn for_depth(&mut self, depth: usize) -> Stacks<'_, B> {
        let left_behind = (LANES - 1) * depth + 1;
        // A group leaves entries on each level, and so do the packet and the single ray that follow it.
        (with_room(&mut self.packets, 3 * left_behind), with_room(&mut self.rays, left_behind))
    }
}

fn with_room<B: Scalar, W: Default + Copy>(stack: &mut Vec<Entry<B, W>>, room: usize) -> &mut [Entry<B, W>] {
    if stack.len() < room {
        stack.resize(room, Entry { near: B::default(), child: Child::NONE, who: W::default() });
    }
    stack
}

/// Which planes of a node a ray meets first and last, by axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sides {
    pub near: [usize; 3],
    pub far: [usize; 3],
}

impl Sides {
    #[inline(always)]
    pub const fn of(octant: u8) -> Self {
        let backward = octant as usize;
        let [x, y, z] = [3 * (backward & 1), 3 * (backward >> 1 & 1), 3 * (backward >> 2 & 1)];
        Self { near: [x, 1 + y, 2 + z], far: [3 - x, 4 - y, 5 - z] }
    }

    #[inline(always)]
    pub fn near<B: Scalar>(&self, node: &Node<B>, axis: usize) -> B::Lane {
        B::Lane::from_array(node.planes[self.near[axis]])
    }

    #[inline(always)]
    pub fn far<B: Scalar>(&self, node: &Node<B>, axis: usize) -> B::Lane {
        B::Lane::from_array(node.planes[self.far[axis]])
    }

    /// The near and far planes of child `c`, in all lanes.
    #[inline(always)]
    pub fn of_child<B: Scalar, M: Many<Eight = B::Lane>>(
        &self,
        node: &Node<B>,
        c: usize,
    ) -> ([M; 3], [M; 3]) {
        let plane = |k: usize| M::each(node.planes[k][c & (LANES - 1)]);
        (self.near.map(plane), self.far.map(plane))
    }
}

/// How many of the children `met` come before child `c` if the farthest comes first, and of children that are entered at the same
/// distance the last. (Each child is held against all at once, as nobody guesses how the next of a row falls.)
#[inline(always)]
pub(super) fn farther_than<L: Lane>(near: L, met: u8, c: usize) -> usize {
    let own = L::splat(near.lanes()[c & (LANES - 1)]);
    let after = !1u8 << (c & (LANES - 1));
    ((near.beyond(own) | near.equal(own).bits() & after) & met).count_ones() as usize
}

/// What puts a child in order: by where it is entered, then by its number.
#[inline(always)]
pub(super) fn key_of<B: Scalar>(near: B, child: usize) -> u64 {
    near.order_key() | child as u64
}

/// The number of the child that has this key.
#[inline(always)]
pub(super) fn child_of(key: u64) -> usize {
    key as usize & (LANES - 1)
}
