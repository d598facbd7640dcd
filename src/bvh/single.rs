//! One ray against eight boxes at a time.

use super::packet::Packet;
use super::stack::{Entry, Sides, child_of, farther_than, key_of};
use super::visit::Visit;
use super::{Bvh, Child};
use crate::lane::{LANES, Lane, Scalar, bits, bits_from_last};

/// With fewer rays than this they go singly. (A knot's diffuse rays with 3, 4, 5 and 6: 1.27, 1.28, 1.30 and 1.31 of the speed without
/// streams.)
pub(super) const LEAST_TOGETHER: u32 = 6;

/// Lanes of a packet one by one.
pub(super) fn walk_lanes<B: Scalar>(
    bvh: &Bvh<B>,
    packets: &mut [Packet<B>],
    number: usize,
    lanes: u8,
    stack: &mut [Entry<B>],
    visit: &mut impl Visit<B>,
) {
    for lane in bits(lanes) {
        walk_single(bvh, &mut packets[number], number, lane, Child::ROOT, stack, visit);
    }
}

/// One ray against eight boxes at a time, from `start` down.
pub(super) fn walk_single<B: Scalar, V: Visit<B>>(
    bvh: &Bvh<B>,
    packet: &mut Packet<B>,
    number: usize,
    lane: usize,
    start: Child,
    stack: &mut [Entry<B>],
    visit: &mut V,
) {
    // Numbers are read where they stand: to move eight of them for one costs a stall.
    let inverse = [0, 1, 2].map(|axis| packet.inverse[axis].lanes()[lane]);
    let offset = [0, 1, 2].map(|axis| B::Lane::splat(packet.offset[axis].lanes()[lane]));
    let octant = (0..3).fold(0u8, |octant, axis| octant | u8::from(inverse[axis] < B::default()) << axis);
    let (sides, inverse) = (Sides::of(octant), inverse.map(B::Lane::splat));
    let ray = visit.lone(number, lane);
    let mut far = packet.far.lanes()[lane];
    let mut child = start;
    let mut top = 0;
    // Of rays that any hit ends the first child is next: its rows come no sooner, and to ask for them costs a branch.
    let fetches = !V::ANY && visit.prefetches();
    'walk: loop {
        if child.is_leaf() {
            bvh.for_each_run(child, |run| {
                if visit.wants(run.class) {
                    far = visit.single(run, &ray, packet, far);
                }
            });
        } else {
            let node = &bvh.nodes[child.index()];
            visit.boxes(node.children());
            // Children lie on a cache line of their own: it is asked for now, not when it is known which of them is next.
            // (The first is always there.)
            if node.child[0] == Child::NONE {
                break;
            }
            let (mut t_in, mut t_out) = (B::Lane::zero(), B::Lane::splat(far));
            for axis in 0..3 {
                t_in = sides.near(node, axis).fused(inverse[axis], offset[axis]).later(t_in);
                t_out = sides.far(node, axis).fused(inverse[axis], offset[axis]).sooner(t_out);
            }
            let all = !t_in.beyond(t_out);
            if all != 0 {
                let mut met = all;
                let c = met.trailing_zeros() as usize & (LANES - 1);
                met &= met - 1;
                if met == 0 {
                    child = node.child[c];
                    continue;
                }
                let (near, t_in) = (t_in, t_in.to_array());
                // (Leaves' rows, too: nine rows of rounds by turns had diffuse rays on meshes at 0.99 to 1.12 times the speed, at the
                // middle 1.07, on a Zen 3 with half a megabyte of second-level cache; on a Zen 5 with twice that it made no difference.)
                let prefetch = |c: usize| bvh.prefetch(node.child[c], fetches, |run| visit.prefetch(run));
                prefetch(c);
                let entry = |c: usize| Entry { near: t_in[c], child: node.child[c], who: 1 };
                if V::ANY {
                    for c in bits_from_last(met) {
                        stack[top] = entry(c);
                        top += 1;
                    }
                    child = node.child[c];
                    continue;
                }
                let d = met.trailing_zeros() as usize & (LANES - 1);
                prefetch(d);
                met &= met - 1;
                if met == 0 {
                    let (nearer, other) = if t_in[d] < t_in[c] { (d, c) } else { (c, d) };
                    stack[top] = entry(other);
                    top += 1;
                    child = node.child[nearer];
                    continue;
                }
                let e = met.trailing_zeros() as usize & (LANES - 1);
                prefetch(e);
                met &= met - 1;
                if met == 0 {
                    // As `farther_than` has it.
                    let [nearest, next, last] = sorted([c, d, e].map(|c| key_of(t_in[c], c)));
                    stack[top] = entry(child_of(last));
                    stack[top + 1] = entry(child_of(next));
                    top += 2;
                    child = node.child[child_of(nearest)];
                    continue;
                }
                for c in bits(all) {
                    stack[top + farther_than(near, all, c)] = entry(c);
                }
                top += all.count_ones() as usize;
                top -= 1;
                child = stack[top].child;
                continue;
            }
        }
        loop {
            if top == 0 {
                break 'walk;
            }
            top -= 1;
            if stack[top].near <= far {
                child = stack[top].child;
                break;
            }
        }
    }
    packet.shorten(lane, far);
}

/// In rising order.
#[inline(always)]
fn sorted([a, b, c]: [u64; 3]) -> [u64; 3] {
    let (a, b) = (a.min(b), a.max(b));
    let (b, c) = (b.min(c), b.max(c));
    [a.min(b), a.max(b), c]
}
