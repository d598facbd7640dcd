//! Packets of one octant through the tree: several held together, or one by itself.
//!
//! A group is held against all eight children of a node by one interval test (Boulos, Wald, Shirley 2006, Geometric
//! and arithmetic culling methods for entire ray packets). It tells what no ray of the group meets, and what all of
//! them meet; only in between are packets tested one by one. Where few rays of a single packet are left they go on
//! singly; where packets are wide beside the boxes, as a stream.

use super::bounds::{Bounds, Culls, Interval, columns};
use super::eights::{HALVES, Packets, bytes_in_use, bytes_of, each_packet, eight_of};
use super::packet::{Frame, Packet, Units};
use super::single::walk_single;
use super::stack::{Entry, Sides, Stacks, farther_than};
use super::stream::walk_stream;
use super::visit::Visit;
use super::{Bvh, Child, Node};
use crate::lane::{LANES, Lane, Many, Mask, Scalar, bits, bits_from_last, folded, highest};

/// Packets that share an octant, and how they are looked at.
pub(super) struct Group<'a, B: Scalar, const N: usize> {
    pub bvh: &'a Bvh<B>,
    pub frame: Frame,
    pub octant: u8,
    pub bounds: &'a Bounds<B, N>,
    /// How far off the frame's starts may be.
    pub pad: B,
    pub least_lanes: u32,
    /// Rays go as a stream where packets are wide.
    pub streams: bool,
    pub packets: Packets,
}

impl<'a, B: Scalar, const N: usize> Group<'a, B, N> {
    /// Packet `number` of it by itself.
    #[inline(always)]
    fn packet(&self, number: usize) -> OnePacket<'a, B> {
        let &Self { bvh, frame, octant, bounds, pad, least_lanes, .. } = self;
        OnePacket { bvh, number, frame, octant, interval: bounds.lane(number), pad, least_lanes }
    }
}

/// `LOOSE` bounds of packets only tell some boxes that are missed: rays are asked too.
pub(super) fn walk_group<B: Scalar, M: Many<Eight = B::Lane>, const N: usize, const LOOSE: bool>(
    how: &Group<B, N>,
    packets: &mut [Packet<B>],
    (stack, waiting): Stacks<B>,
    visit: &mut impl Visit<B>,
) {
    let &Group { bvh, frame, octant, bounds, .. } = how;
    let (culls, units) = (Culls::of(&bounds.around(how.packets), octant), bounds.units::<M>(octant));
    let mut fars = Fars::<M>::none(how.packets);
    fars.look_again(how.packets, packets, frame);
    stack[0] = Entry { near: B::default(), child: Child::ROOT, who: how.packets };
    let mut top = 1;
    while top > 0 {
        top -= 1;
        let entry = stack[top];
        // Packets that have found something nearer since the entry was made drop out.
        let who = entry.who & !M::each(entry.near).which_beyond(fars.by_packet);
        if who == 0 {
            continue;
        }
        if entry.child.is_leaf() {
            let mut changed = 0;
            bvh.for_each_run(entry.child, |run| {
                if visit.wants(run.class) {
                    changed |= visit.packets(run, who, packets);
                }
            });
            if changed != 0 {
                fars.look_again(changed, packets, frame);
            }
            continue;
        }
        if who & (who - 1) == 0 {
            // One packet is left: its rays are held against boxes from here on.
            let k = who.trailing_zeros() as usize;
            let start = Entry { who: packets[k].live().into(), ..entry };
            walk_packet(&how.packet(k), packets, start, &mut stack[top..], visit);
            fars.look_again(who, packets, frame);
            continue;
        }
        let looking = (&units, fars.by_packet, fars.farthest);
        let (node, before) = ((bvh, entry.child), top);
        let met = expand::<B, _, _, LOOSE>(node, who, &culls, looking, packets, (stack, &mut top), visit);
        if how.streams
            && met > who.count_ones() * FEW_CHILDREN
            && are_wide(&bvh.nodes[entry.child.index()], &culls.sides, packets, who, met)
        {
            top = before;
            walk_stream((bvh, entry.child), packets, who, (&mut stack[top..], waiting), visit);
            fars.look_again(who, packets, frame);
        }
    }
}

/// So many packets of a group are looked at again all at once, fewer one by one. (From 4 or 9 on rays are within 1 % as fast.)
const AT_ONCE: u32 = 6;

/// How far a group's packets look.
struct Fars<M: Many> {
    /// The group.
    group: Packets,
    /// The farthest that any ray of a packet looks; negative for packets that do not.
    by_packet: M,
    /// The farthest of all.
    farthest: <M::Eight as Lane>::Scalar,
}

impl<M: Many> Fars<M> {
    /// Of packets that do not look.
    fn none(group: Packets) -> Self {
        let none = M::constant(-1.0);
        Self { group, by_packet: none, farthest: none.highest() }
    }

    /// The packets of `which` may look less far than they did.
    #[inline(always)]
    fn look_again<B: Scalar<Lane = M::Eight>>(
        &mut self,
        which: Packets,
        packets: &[Packet<B>],
        frame: Frame,
    ) {
        if which.count_ones() < AT_ONCE {
            for k in each_packet(which) {
                self.by_packet = self.by_packet.with(k, highest(packets[k].far_in(frame)));
            }
        } else {
            self.by_packet = M::of(|half| {
                let highest = folded(columns(packets, half, |_, packet| packet.far_in(frame)), B::Lane::max);
                Mask::from_bits(eight_of(self.group, half)).select(highest, B::Lane::lit(-1.0))
            });
        }
        self.farthest = self.by_packet.highest();
    }
}

/// See [`are_wide`].
const SAMPLED: usize = 4;

/// Packets that meet no more children than this on average are taken to be narrow beside them.
const FEW_CHILDREN: u32 = 3;

/// Whether packets meet so many more of a node's children than single rays do, by the first ray of each, that their rays had better
/// go as a stream. Each packet that goes on below a child costs a test of its bounds and tests of all its rays, however few come there;
/// a stream begins by holding every ray against the node, which is not worth it right above leaves. (2,500 places of a
/// mesh of 20,000 triangles: 0.93 of the time without. From 2 children more on, and above leaves, it would be 0.87, but camera rays on
/// meshes would lose 3 to 7 %.) One packet in four is asked, as where packets are narrow that is what is found out, again and again.
#[cold]
#[inline(never)]
fn are_wide<B: Scalar>(node: &Node<B>, sides: &Sides, packets: &[Packet<B>], who: Packets, met: u32) -> bool {
    if node.child.iter().any(|&child| child != Child::NONE && child.is_leaf()) {
        return false;
    }
    let by_one = |k: usize| {
        let packet = &packets[k];
        let lane = packet.live().trailing_zeros() as usize & (LANES - 1);
        let (mut t_in, mut t_out) = (B::Lane::zero(), B::Lane::splat(packet.far.lanes()[lane]));
        for axis in 0..3 {
            let [inverse, offset] =
                [packet.inverse[axis], packet.offset[axis]].map(|x| B::Lane::splat(x.lanes()[lane]));
            t_in = sides.near(node, axis).fused(inverse, offset).later(t_in);
            t_out = sides.far(node, axis).fused(inverse, offset).sooner(t_out);
        }
        t_in.beyond(t_out).count_zeros()
    };
    let (count, asked) = (who.count_ones(), who.count_ones().div_ceil(SAMPLED as u32));
    let by_ones = each_packet(who).step_by(SAMPLED).map(by_one).sum::<u32>();
    2 * met * asked > (2 * FEW_CHILDREN * asked + 3 * by_ones) * count
}

/// One packet, and how it is looked at.
pub(super) struct OnePacket<'a, B: Scalar> {
    pub bvh: &'a Bvh<B>,
    pub number: usize,
    pub frame: Frame,
    pub octant: u8,
    pub interval: Interval<B>,
    pub pad: B,
    pub least_lanes: u32,
}

/// Some rays of one packet that share an octant.
pub(super) fn walk_packet<B: Scalar>(
    how: &OnePacket<B>,
    packets: &mut [Packet<B>],
    start: Entry<B>,
    stack: &mut [Entry<B>],
    visit: &mut impl Visit<B>,
) {
    let &OnePacket { bvh, number, frame, octant, .. } = how;
    let culls = Culls::of(&how.interval, octant);
    let units = packets[number].units(frame, octant, how.pad);
    let mut far = packets[number].far_in(frame);
    let mut farthest = highest(far);
    stack[0] = start;
    let mut top = 1;
    while top > 0 {
        top -= 1;
        let entry = stack[top];
        let lanes = eight_of(entry.who, 0) & B::Lane::splat(entry.near).le(far).bits();
        if lanes == 0 {
            continue;
        }
        if lanes.count_ones() < how.least_lanes {
            for lane in bits(lanes) {
                walk_single(bvh, &mut packets[number], number, lane, entry.child, &mut stack[top..], visit);
            }
            far = packets[number].far_in(frame);
            farthest = highest(far);
            continue;
        }
        if entry.child.is_leaf() {
            let mut changed = 0;
            bvh.for_each_run(entry.child, |run| {
                if visit.wants(run.class) {
                    changed |= visit.packets(run, 1 << number, packets);
                }
            });
            if changed != 0 {
                far = packets[number].far_in(frame);
                farthest = highest(far);
            }
            continue;
        }
        let looking = (&units, far, farthest);
        let node = (bvh, entry.child);
        expand::<B, _, _, false>(node, lanes.into(), &culls, looking, packets, (stack, &mut top), visit);
    }
}

/// Puts the children of a node on the stack that units of `who` may meet, the farthest first, or the last if any hit ends. `LOOSE` units
/// are packets; where they neither surely miss a child nor surely meet it by their bounds, their rays are asked. Returns
/// how many pairs of a unit and a child that makes.
#[inline(always)]
fn expand<B: Scalar, V: Visit<B>, M: Many<Eight = B::Lane>, const LOOSE: bool>(
    (bvh, child): (&Bvh<B>, Child),
    who: Packets,
    culls: &Culls<B>,
    (units, fars, farthest): (&Units<M>, M, B),
    packets: &[Packet<B>],
    (stack, top): (&mut [Entry<B>], &mut usize),
    visit: &mut V,
) -> u32 {
    let node = &bvh.nodes[child.index()];
    visit.boxes(node.children());
    // All eight children against the bounds of the whole group.
    let (t_in, mut children) = culls.meet(node, farthest);
    let sides = &culls.sides;
    let fetches = visit.prefetches();
    // A byte a child, a bit a unit. What is to be tested is known from one loop to the next, not from one test to the next: each
    // branch that is guessed wrongly costs all that is under way.
    let (mut missed, mut unsure) = ([0u64; HALVES], [0u64; HALVES]);
    let tested = bytes_of(children);
    while children != 0 {
        let c = children.trailing_zeros() as usize & (LANES - 1);
        children &= children - 1;
        let child = node.child[c];
        bvh.prefetch(child, fetches, |run| visit.prefetch(run));
        let (near, far) = sides.of_child::<B, M>(node, c);
        let (mut enter, mut leave) = (M::constant(0.0), fars);
        let (mut sure_in, mut sure_out) = (M::constant(0.0), M::constant(f64::INFINITY));
        for axis in 0..3 {
            let ((inverse, offset), (late_inverse, late_offset)) = (units.soon[axis], units.late[axis]);
            enter = near[axis].times_plus(inverse, offset).later_of(enter);
            leave = far[axis].times_plus(late_inverse, late_offset).sooner_of(leave);
            if LOOSE {
                sure_in = near[axis].times_plus(late_inverse, late_offset).later_of(sure_in);
                sure_out = far[axis].times_plus(inverse, offset).sooner_of(sure_out);
            }
        }
        visit.boxes(who.count_ones());
        let missed_by = enter.eights_beyond(leave);
        let unsure_by = if LOOSE { sure_in.eights_beyond(sure_out) } else { [0; HALVES] };
        for half in 0..M::EIGHTS {
            missed[half] |= u64::from(missed_by[half]) << (LANES * c);
            unsure[half] |= u64::from(unsure_by[half]) << (LANES * c);
        }
    }
    let mut met = [0; HALVES];
    for half in 0..M::EIGHTS {
        met[half] = (tested * u64::from(eight_of(who, half))) & !missed[half];
        let mut unsure = unsure[half] & met[half];
        while LOOSE && unsure != 0 {
            let pair = unsure.trailing_zeros() as usize;
            unsure &= unsure - 1;
            let packet = &packets[LANES * half + pair % LANES];
            let (near, far) = sides.of_child::<B, B::Lane>(node, pair / LANES);
            let (mut enter, mut leave) = (B::Lane::zero(), packet.far);
            for axis in 0..3 {
                let (inverse, offset) = (packet.inverse[axis], packet.offset[axis]);
                enter = near[axis].fused(inverse, offset).later(enter);
                leave = far[axis].fused(inverse, offset).sooner(leave);
            }
            visit.boxes(packet.live().count_ones());
            met[half] &= !(u64::from(enter.beyond(leave) == !0) << pair);
        }
    }
    let met_at_all = bytes_in_use(met.iter().fold(0, |all, met| all | met));
    let mut place = *top;
    for c in bits_from_last(met_at_all) {
        let who = (0..M::EIGHTS)
            .fold(0, |who, half| who | ((met[half] >> (LANES * c)) as u8 as Packets) << (LANES * half));
        let entry = Entry { near: t_in.lanes()[c], child: node.child[c], who };
        let at = if V::ANY { place } else { *top + farther_than(t_in, met_at_all, c) };
        stack[at] = entry;
        place += 1;
    }
    *top = place;
    met.iter().map(|met| met.count_ones()).sum()
}
