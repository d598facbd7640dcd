//! Rays that go all ways, through the tree together.
//!
//! A node is fetched, and its children are put in order, once for all rays that come to it. Each of them is held against the
//! eight boxes at once, one after the other and without a branch in between, so that none waits for another's answer: a ray
//! that walks alone waits for each of its own (Barringer and Akenine-Möller 2014, Dynamic ray stream traversal, ACM
//! Transactions on Graphics 33(4)). Where few rays are left they go on singly.

use super::packet::Packet;
use super::single::{LEAST_TOGETHER, walk_single};
use super::stack::{Entry, Order, Sides, Stacks};
use super::visit::Visit;
use super::{Bvh, Child, Node, Run};
use crate::lane::{LANES, Lane, Scalar, bits, bits_of_many, each_lane};

/// So many rays of one packet are tested as a packet in leaves: eight rays against a row take as long as three or less against four
/// rows each.
const TESTED_TOGETHER: u32 = 3;

/// Walks the live rays of the packets `which` through what is below `start`.
pub(super) fn walk_stream<B: Scalar>(
    (bvh, start): (&Bvh<B>, Child),
    packets: &mut [Packet<B>],
    which: u8,
    (stack, waiting): Stacks<B>,
    visit: &mut impl Visit<B>,
) {
    let who = bits(which).fold(0, |who, k| who | u64::from(packets[k].live()) << (LANES * k));
    waiting[0] = Entry { near: B::default(), child: start, who };
    let mut top = 1;
    let octants = octants_of(packets);
    // Rays that do not look as far any more as they did: others need not be asked.
    let mut shortened = 0;
    while top > 0 {
        top -= 1;
        let Entry { near, child, who } = waiting[top];
        let who = who & !done_before(packets, who & shortened, near);
        if who.count_ones() < LEAST_TOGETHER {
            for ray in bits_of_many(who) {
                let (number, lane) = place_of(ray);
                let shorter = walk_single(bvh, &mut packets[number], number, lane, child, stack, visit);
                shortened |= u64::from(shorter) << ray;
            }
            continue;
        }
        if child.is_leaf() {
            bvh.for_each_run(child, |run| {
                if visit.wants(run.class) {
                    shortened |= test(run, who, packets, visit);
                }
            });
            continue;
        }
        let node = &bvh.nodes[child.index()];
        let (met_by, nearest) = meet(node, who, (packets, &octants), visit);
        let mut order = Order::default();
        for (c, &child) in node.child.iter().enumerate().take_while(|(_, child)| **child != Child::NONE) {
            if met_by[c] != 0 {
                bvh.prefetch(child);
                order.insert(nearest[c], c);
            }
        }
        for c in order.farthest_first() {
            waiting[top] = Entry { near: nearest[c], child: node.child[c], who: met_by[c] };
            top += 1;
        }
    }
}

/// Packet and lane of a ray.
#[inline(always)]
fn place_of(ray: usize) -> (usize, usize) {
    ((ray / LANES) & (LANES - 1), ray % LANES)
}

/// Those of the rays `who` that do not look as far as `near`.
#[inline(always)]
fn done_before<B: Scalar>(packets: &[Packet<B>], who: u64, near: B) -> u64 {
    let near = B::Lane::splat(near);
    let (mut done, mut rest) = (0, who);
    while rest != 0 {
        let (number, _) = place_of(rest.trailing_zeros() as usize);
        done |= u64::from(packets[number].far.lt(near).bits()) << (LANES * number);
        rest &= !lanes_of(number);
    }
    who & done
}

/// The rays of a packet.
#[inline(always)]
fn lanes_of(number: usize) -> u64 {
    0xff << (LANES * number)
}

/// The octants of all rays.
#[inline(always)]
fn octants_of<B: Scalar>(packets: &[Packet<B>]) -> [u8; RAYS] {
    let mut octants = [0; RAYS];
    for (packet, octants) in packets.iter().zip(octants.chunks_exact_mut(LANES)) {
        for (lane, octant) in octants.iter_mut().enumerate() {
            *octant = packet.octant_of(lane);
        }
    }
    octants
}

/// Rays that walk together, at most.
const RAYS: usize = LANES * LANES;

/// The bit of a ray, in halves. (Merged in lanes of 32 bits: of 64 they would be as wide as a processor has them, and some do
/// nothing beside while they are at those.)
static BIT_OF: [[u32; 2]; RAYS] = {
    let (mut all, mut ray) = ([[0; 2]; RAYS], 0);
    while ray < RAYS {
        all[ray][ray / 32] = 1 << (ray % 32);
        ray += 1;
    }
    all
};

/// Holds the rays `who` against a node's boxes: child by child, which rays meet it, and where the first of them does.
#[inline(always)]
fn meet<B: Scalar>(
    node: &Node<B>,
    who: u64,
    (packets, octants): (&[Packet<B>], &[u8; RAYS]),
    visit: &mut impl Visit<B>,
) -> ([u64; LANES], [B; LANES]) {
    // A ray's bit in the lanes of the children that it meets. (Of children that are not there, too.)
    let mut met_by = [B::Lane::zero(); 2];
    let mut nearest = B::Lane::lit(f64::INFINITY);
    for ray in bits_of_many(who) {
        let (number, lane) = place_of(ray);
        let packet = &packets[number];
        let sides = Sides::known(octants[ray]);
        let (mut t_in, mut t_out) = (B::Lane::zero(), B::Lane::splat(packet.far.lanes()[lane]));
        for axis in 0..3 {
            // Numbers are read where they stand: to move eight of them for one costs a stall.
            let inverse = B::Lane::splat(packet.inverse[axis].lanes()[lane]);
            let offset = B::Lane::splat(packet.offset[axis].lanes()[lane]);
            t_in = sides.near(node, axis).fused(inverse, offset).later(t_in);
            t_out = sides.far(node, axis).fused(inverse, offset).sooner(t_out);
        }
        visit.boxes(node.children());
        let met = t_in.le(t_out);
        nearest = met.or_never(t_in).sooner(nearest);
        for (met_by, bits) in met_by.iter_mut().zip(BIT_OF[ray]) {
            *met_by = *met_by | met.keep(B::Lane::splat(B::of_bits(bits)));
        }
    }
    let [low, high] = met_by.map(Lane::to_array);
    let both = |c: usize| u64::from(low[c].as_bits()) | u64::from(high[c].as_bits()) << 32;
    (each_lane(both), nearest.to_array())
}

/// Tests the primitives of `run` against the rays `who`: those that may look less far now.
#[inline(always)]
fn test<B: Scalar>(run: &Run, who: u64, packets: &mut [Packet<B>], visit: &mut impl Visit<B>) -> u64 {
    let mut shortened = 0;
    let (mut whole, mut lone) = (0, who);
    for number in 0..packets.len().min(LANES) {
        let lanes = lanes_of(number);
        if (who & lanes).count_ones() >= TESTED_TOGETHER {
            whole |= 1 << number;
            lone &= !lanes;
        }
    }
    if whole != 0 {
        shortened = bits(visit.packets(run, whole, packets)).fold(0, |rays, number| rays | lanes_of(number));
    }
    for ray in bits_of_many(lone) {
        let (number, lane) = place_of(ray);
        let (packet, lone) = (&mut packets[number], visit.lone(number, lane));
        let known = packet.far.lanes()[lane];
        // A ray that any hit ends may be done by now.
        if known >= B::default() {
            let far = visit.single(run, &lone, packet, known);
            shortened |= u64::from(packet.shorten(lane, far)) << ray;
        }
    }
    shortened
}
