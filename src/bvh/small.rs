//! Packets through a tree of a few nodes: each packet is held against each box that is reached.
//!
//! What a group of packets costs before it is under way (its bounds, its octants) is more than a small tree can give
//! back. Here rays may go any way.

use super::eights::{Packets, each_packet};
use super::packet::Packet;
use super::visit::Visit;
use super::{Bvh, Node};
use crate::lane::{LANES, Lane, Scalar};

/// Trees of up to this many nodes are walked this way.
const MOST_NODES: usize = 8;

impl<B: Scalar> Bvh<B> {
    /// True if the tree is walked box by box, or not there at all.
    pub fn is_small(&self) -> bool {
        self.nodes.len() <= MOST_NODES
    }
}

/// A child of a node, and the packets that reached the node.
#[derive(Debug, Clone, Copy, Default)]
struct Waiting {
    node: u8,
    child: u8,
    who: Packets,
}

/// Walks a group of packets through a tree of at most [`MOST_NODES`] nodes.
pub(super) fn walk_small<B: Scalar>(bvh: &Bvh<B>, packets: &mut [Packet<B>], visit: &mut impl Visit<B>) {
    let mut live: Packets = 0;
    for (k, packet) in packets.iter().enumerate() {
        live |= Packets::from(packet.live() != 0) << k;
    }
    if live == 0 {
        return;
    }
    // One ray of them says what is near.
    let guide = Guide::of(&packets[live.trailing_zeros() as usize]);
    // Every node leaves at most its children here.
    let mut stack = [Waiting::default(); MOST_NODES * LANES];
    let mut top = 0;
    guide.push(&bvh.nodes[0], 0, live, &mut stack, &mut top);
    while top > 0 {
        top -= 1;
        let Waiting { node, child, who } = stack[top & (MOST_NODES * LANES - 1)];
        let (node, slot) = (&bvh.nodes[usize::from(node)], usize::from(child) & (LANES - 1));
        let mut met: Packets = 0;
        for k in each_packet(who) {
            met |= Packets::from(meets(&packets[k], node, slot)) << k;
            visit.boxes(packets[k].live().count_ones());
        }
        if met == 0 {
            continue;
        }
        let child = node.child[slot];
        if child.is_leaf() {
            bvh.for_each_run(child, |run| {
                if visit.wants(run.class) {
                    visit.packets(run, met, packets);
                }
            });
        } else {
            guide.push(&bvh.nodes[child.index()], child.index(), met, &mut stack, &mut top);
        }
    }
}

/// Whether a ray of the packet meets a box before what it has found. Rays that are done look a negative way.
#[inline(always)]
fn meets<B: Scalar>(packet: &Packet<B>, node: &Node<B>, slot: usize) -> bool {
    let (mut enter, mut leave) = (B::Lane::zero(), packet.far);
    for axis in 0..3 {
        let (inverse, offset) = (packet.inverse[axis], packet.offset[axis]);
        let [a, b] = [axis, axis + 3].map(|k| B::Lane::splat(node.planes[k][slot]).fused(inverse, offset));
        enter = a.min(b).later(enter);
        leave = a.max(b).sooner(leave);
    }
    enter.beyond(leave) != !0
}

/// The ray that says in which order boxes are looked at, in every lane.
struct Guide<B: Scalar> {
    inverse: [B::Lane; 3],
    offset: [B::Lane; 3],
}

impl<B: Scalar> Guide<B> {
    /// The first live ray of a packet.
    fn of(packet: &Packet<B>) -> Self {
        let k = packet.live().trailing_zeros() as usize & (LANES - 1);
        let [inverse, offset] =
            [packet.inverse, packet.offset].map(|v| v.map(|x| B::Lane::splat(x.lanes()[k])));
        Self { inverse, offset }
    }

    /// Puts the children of a node on the stack, the farthest first.
    #[inline(always)]
    fn push(&self, node: &Node<B>, number: usize, who: Packets, stack: &mut [Waiting], top: &mut usize) {
        let mut enter = B::Lane::zero();
        for axis in 0..3 {
            let low = B::Lane::from_array(node.planes[axis]).fused(self.inverse[axis], self.offset[axis]);
            let high =
                B::Lane::from_array(node.planes[axis + 3]).fused(self.inverse[axis], self.offset[axis]);
            enter = low.min(high).max(enter);
        }
        let enter = enter.to_array();
        let first = *top;
        for (child, _) in node.child.iter().enumerate().filter(|(_, child)| **child != super::Child::NONE) {
            // By insertion: children are few.
            let mut place = *top;
            while place > first && enter[usize::from(stack[place - 1].child)] < enter[child] {
                stack[place] = stack[place - 1];
                place -= 1;
            }
            stack[place] = Waiting { node: number as u8, child: child as u8, who };
            *top += 1;
        }
    }
}
