//! Packets through a tree of few nodes: each packet is held against each box that is reached, if what bounds them all meets it.
//!
//! What a group of packets costs before it is under way (bounds of each, its octants) is more than a small tree can give
//! back. Here rays may go any way.

use super::bounds::Hull;
use super::eights::{Packets, each_packet};
use super::packet::Packet;
use super::stack::farther_than;
use super::visit::Visit;
use super::{Bvh, Node};
use crate::lane::{LANES, Lane, Scalar, bits};

/// Trees of up to this many nodes are small.
const FEW_NODES: usize = 8;

/// Trees of up to so many nodes are walked this way if rays had better stay together. (Instructions of pictures of 60, 120, 250, 500
/// and 1000 composites, to those of groups: 0.94, 0.96, 0.98, 1.00, 1.01; of 120, 250 and 500 spheres, for which this is not: 1.00,
/// 1.04, 1.09.)
const MOST_NODES: usize = 64;

/// And if no way down is longer.
const MOST_DEPTH: usize = 9;

/// Each node on the way down leaves its children here, of which one is the next.
const ROOM: usize = (LANES - 1) * MOST_DEPTH + 1;
const _: () = assert!(ROOM.is_power_of_two() && FEW_NODES <= MOST_DEPTH);

/// With fewer packets than this, what bounds them all costs as much as it spares.
const LEAST_BOUNDED: u32 = 4;

impl<B: Scalar> Bvh<B> {
    /// True if the tree has few nodes, or is not there at all.
    pub fn is_small(&self) -> bool {
        self.nodes.len() <= FEW_NODES
    }

    /// True if it is walked box by box: if it is small, or not large, and what is in its leaves takes longer than boxes.
    pub fn goes_box_by_box(&self) -> bool {
        self.is_small() || self.together && self.nodes.len() <= MOST_NODES && self.depth <= MOST_DEPTH
    }
}

/// A child of a node, and the packets that reached the node.
#[derive(Debug, Clone, Copy, Default)]
struct Waiting {
    node: u8,
    child: u8,
    who: Packets,
}

/// Walks a group of packets through a tree that [goes box by box](Bvh::goes_box_by_box).
pub(super) fn walk_small<B: Scalar, V: Visit<B>>(bvh: &Bvh<B>, packets: &mut [Packet<B>], visit: &mut V) {
    let mut live: Packets = 0;
    for (k, packet) in packets.iter().enumerate() {
        live |= Packets::from(packet.live() != 0) << k;
    }
    if live == 0 {
        return;
    }
    // One ray of them says what is near.
    let guide = Guide::of(&packets[live.trailing_zeros() as usize]);
    // And what bounds all of them, what none of them meets: mostly most of what there is.
    let hull = (live.count_ones() >= LEAST_BOUNDED).then(|| Hull::of(packets, live));
    let near = |node: &Node<B>, visit: &mut V| {
        hull.as_ref().map_or(!0, |hull| {
            visit.boxes(node.children());
            hull.meets(node)
        })
    };
    let mut stack = [Waiting::default(); ROOM];
    let mut top = 0;
    guide.push((&bvh.nodes[0], 0), (near(&bvh.nodes[0], visit), live), &mut stack, &mut top);
    while top > 0 {
        top -= 1;
        let Waiting { node, child, who } = stack[top & (ROOM - 1)];
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
            let node = &bvh.nodes[child.index()];
            guide.push((node, child.index()), (near(node, visit), met), &mut stack, &mut top);
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

    /// Puts those of a node's children that are `near` on the stack, the farthest first, for the packets `who`.
    #[inline(always)]
    fn push(
        &self,
        (node, number): (&Node<B>, usize),
        (near, who): (u8, Packets),
        stack: &mut [Waiting],
        top: &mut usize,
    ) {
        let mut enter = B::Lane::zero();
        for axis in 0..3 {
            let low = B::Lane::from_array(node.planes[axis]).fused(self.inverse[axis], self.offset[axis]);
            let high =
                B::Lane::from_array(node.planes[axis + 3]).fused(self.inverse[axis], self.offset[axis]);
            enter = low.min(high).later(enter);
        }
        let near = near & node.present();
        for child in bits(near) {
            let place = *top + farther_than(enter, near, child);
            stack[place & (ROOM - 1)] = Waiting { node: number as u8, child: child as u8, who };
        }
        *top += near.count_ones() as usize;
    }
}
