//! Rays through the tree: groups of up to eight packets that share an octant, or one ray against eight boxes.
//!
//! A group is held against all eight children of a node by one interval test (Boulos, Wald, Shirley 2006, Geometric
//! and arithmetic culling methods for entire ray packets). It tells what no ray of the group meets, and what all of
//! them meet; only in between are packets tested one by one. Where few rays of a single packet are left they go on
//! singly. Slab tests choose their near and far planes by the octant's signs; that they lose no box is the business of
//! [`Bvh::slack`]. What happens in leaves is the caller's ([`Visit`]).

use super::packet::{Bounds, Crossing, Directions, Frame, Interval, Packet, Units};
use super::small::{MOST_NODES, walk_small};
use super::{Bvh, Child, Node, Run};
use crate::lane::{LANES, Lane, Mask, Scalar, highest};

/// What the walk's owner does in leaves.
pub trait Visit<B: Scalar> {
    /// Tests the primitives of `run` against the packets whose bit is set in `which`, in the lanes that are live, and
    /// shortens their `far` where a nearer hit was found (to a negative number where the ray is done). Returns a bit for
    /// each packet that has changed.
    fn packets(&mut self, run: &Run, which: u8, packets: &mut [Packet<B>]) -> u8;
    /// Tests the primitives of `run` against the ray in lane `.1` of packet `.0`, whose state is given and which looks up
    /// to `far`: the new `far`.
    fn single(&mut self, run: &Run, ray: (usize, usize), state: &Packet<B>, far: B) -> B;
    /// Eight lanes were held against boxes, so many of them with something to hold.
    fn boxes(&mut self, lanes: u32);
    /// False if no ray of the walk cares for runs of this class.
    fn wants(&self, class: u8) -> bool;
}

/// How rays go through the tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Traversal {
    /// As is best for the rays at hand: measured switches.
    #[default]
    Auto,
    /// Eight rays of a packet together as long as one of them lives, groups of packets where they share an octant.
    Packet,
    /// Each ray by itself, against eight boxes at a time.
    Single,
    /// Packets, but each by itself, that fall apart into single rays where few of their rays are left.
    Hybrid,
}

/// When to walk how.
#[derive(Debug, Clone, Copy)]
struct Switches {
    /// Packets walk together if their directions, axis by axis, lie within this sum of widths.
    group_spread: f64,
    /// A packet walks as one under the same condition.
    packet_spread: f64,
    /// With fewer rays than this a packet's rays go singly.
    least_lanes: u32,
}

impl Switches {
    fn of(traversal: Traversal, together: bool) -> Self {
        match traversal {
            Traversal::Auto if together => {
                Self { group_spread: GROUP_SPREAD, packet_spread: f64::INFINITY, least_lanes: 0 }
            }
            Traversal::Auto => {
                Self { group_spread: GROUP_SPREAD, packet_spread: PACKET_SPREAD, least_lanes: LEAST_LANES }
            }
            Traversal::Packet => {
                Self { group_spread: f64::INFINITY, packet_spread: f64::INFINITY, least_lanes: 0 }
            }
            Traversal::Single => Self { group_spread: 0.0, packet_spread: -1.0, least_lanes: u32::MAX },
            Traversal::Hybrid => {
                Self { group_spread: -1.0, packet_spread: f64::INFINITY, least_lanes: LEAST_LANES }
            }
        }
    }
}

/// See [`Switches::group_spread`].
const GROUP_SPREAD: f64 = 1.0;
/// See [`Switches::packet_spread`].
const PACKET_SPREAD: f64 = 2.0;
/// See [`Switches::least_lanes`].
const LEAST_LANES: u32 = 3;

/// What is still to be looked at; kept between walks so that nothing is allocated.
#[derive(Debug, Default)]
pub struct Stack<B: Scalar>(Vec<Entry<B>>);

#[derive(Debug, Clone, Copy)]
struct Entry<B> {
    near: B,
    child: Child,
    /// The packets of a group, or the lanes of a packet, that may meet it.
    who: u8,
}

/// Walks up to eight packets through the tree.
pub fn walk<B: Scalar>(
    bvh: &Bvh<B>,
    packets: &mut [Packet<B>],
    stack: &mut Stack<B>,
    visit: &mut impl Visit<B>,
    traversal: Traversal,
) {
    debug_assert!(packets.len() <= LANES);
    if bvh.nodes.is_empty() {
        return;
    }
    if traversal == Traversal::Auto && bvh.nodes.len() <= MOST_NODES {
        walk_small(bvh, packets, visit);
        return;
    }
    // A group leaves at most seven entries behind on each level, and so do the packet and the single ray that follow it.
    let room = 3 * (LANES - 1) * bvh.depth + 3;
    if stack.0.len() < room {
        stack.0.resize(room, Entry { near: B::default(), child: Child::NONE, who: 0 });
    }
    let (stack, switches) = (&mut stack.0[..], Switches::of(traversal, bvh.together));
    let mut waiting = 0u8;
    for (k, packet) in packets.iter().enumerate() {
        waiting |= u8::from(packet.live() != 0) << k;
    }
    if switches.packet_spread < 0.0 {
        for k in bits(waiting) {
            walk_lanes(bvh, packets, k, packets[k].live(), stack, visit);
        }
        return;
    }
    let directions = Directions::of(packets);
    let (backward, mixed) = directions.octants();
    let wide = !directions.spread().le(B::Lane::lit(switches.packet_spread)).bits();
    for k in bits(waiting & mixed) {
        walk_mixed(bvh, packets, k, stack, visit, &switches);
    }
    for k in bits(waiting & !mixed & wide) {
        walk_lanes(bvh, packets, k, packets[k].live(), stack, visit);
    }
    waiting &= !(mixed | wide);
    if waiting == 0 {
        return;
    }
    let common = Bounds::common(bvh, packets, waiting, &directions);
    let frame = if common.is_some() { Frame::Common } else { Frame::Own };
    let (bounds, pad) = common.unwrap_or_else(|| (Bounds::of(packets, &directions), B::default()));
    while waiting != 0 {
        let first = waiting.trailing_zeros();
        let (mut octant, mut group) = (0u8, waiting);
        for (axis, backward) in backward.into_iter().enumerate() {
            let negative = backward >> first & 1;
            octant |= negative << axis;
            group &= if negative == 1 { backward } else { !backward };
        }
        // Packets of one octant and much the same direction go together.
        if directions.spread_of(group) > switches.group_spread {
            let candidates = group & !(1 << first);
            group = 1 << first;
            for k in bits(candidates) {
                if directions.spread_of(group | 1 << k) <= switches.group_spread {
                    group |= 1 << k;
                }
            }
        }
        waiting &= !group;
        let group = Group {
            bvh,
            frame,
            octant,
            bounds: &bounds,
            pad,
            least_lanes: switches.least_lanes,
            packets: group,
        };
        if frame == Frame::Common {
            walk_group::<B, false>(&group, packets, stack, visit);
        } else {
            walk_group::<B, true>(&group, packets, stack, visit);
        }
    }
}

/// Packets that share an octant, and how they are looked at.
struct Group<'a, B: Scalar> {
    bvh: &'a Bvh<B>,
    frame: Frame,
    octant: u8,
    bounds: &'a Bounds<B>,
    /// How far off the frame's starts may be.
    pad: B,
    least_lanes: u32,
    packets: u8,
}

/// A packet whose rays go several ways: octant by octant, a few rays singly.
fn walk_mixed<B: Scalar>(
    bvh: &Bvh<B>,
    packets: &mut [Packet<B>],
    number: usize,
    stack: &mut [Entry<B>],
    visit: &mut impl Visit<B>,
    switches: &Switches,
) {
    let mut waiting = packets[number].live();
    while waiting != 0 {
        let first = waiting.trailing_zeros() as usize & (LANES - 1);
        let lanes = packets[number].first_octant_lanes(waiting);
        waiting &= !lanes;
        if lanes.count_ones() < switches.least_lanes {
            walk_lanes(bvh, packets, number, lanes, stack, visit);
            continue;
        }
        // The other lanes sit this walk out.
        let others = Mask::<B::Lane>::from_bits(!lanes);
        let kept = packets[number].far;
        packets[number].far = others.select(B::Lane::lit(-1.0), kept);
        let alone = &packets[number..=number];
        let directions = Directions::of(alone);
        if directions.spread_of(1) > switches.packet_spread {
            walk_lanes(bvh, packets, number, lanes, stack, visit);
        } else {
            let interval = Bounds::of(alone, &directions).lane(0);
            let octant = packets[number].octant_of(first);
            let start = Entry { near: B::default(), child: Child::ROOT, who: lanes };
            let least_lanes = switches.least_lanes;
            let how = OnePacket {
                bvh,
                number,
                frame: Frame::Own,
                octant,
                interval,
                pad: B::default(),
                least_lanes,
            };
            walk_packet(&how, packets, start, stack, visit);
        }
        packets[number].far = others.select(kept, packets[number].far);
    }
}

/// Which planes of a node a ray meets first and last, by axis.
#[derive(Debug, Clone, Copy)]
struct Sides {
    near: [usize; 3],
    far: [usize; 3],
}

impl Sides {
    #[inline(always)]
    fn of(octant: u8) -> Self {
        let near = [0, 1, 2].map(|axis| if octant >> axis & 1 == 1 { axis + 3 } else { axis });
        Self { near, far: near.map(|k| if k < 3 { k + 3 } else { k - 3 }) }
    }

    #[inline(always)]
    fn near<B: Scalar>(&self, node: &Node<B>, axis: usize) -> B::Lane {
        B::Lane::from_array(node.planes[self.near[axis]])
    }

    #[inline(always)]
    fn far<B: Scalar>(&self, node: &Node<B>, axis: usize) -> B::Lane {
        B::Lane::from_array(node.planes[self.far[axis]])
    }
}

/// `x` with `value` in lane `k`, without a way through memory.
#[inline(always)]
fn with_lane<L: Lane>(x: L, k: usize, value: L::Scalar) -> L {
    Mask::<L>::from_bits(1 << k).select(L::splat(value), x)
}

/// Puts the children of a node on the stack that units of `who` may meet, the farthest first. `LOOSE` units
/// are packets; where they neither surely miss a child nor surely meet it by their bounds, their rays are asked.
#[inline(always)]
fn expand<B: Scalar, const LOOSE: bool>(
    node: &Node<B>,
    who: u8,
    sides: &Sides,
    culls: &Culls<B>,
    (units, fars, farthest): (&Units<B>, B::Lane, B),
    packets: &[Packet<B>],
    (stack, top): (&mut [Entry<B>], &mut usize),
    visit: &mut impl Visit<B>,
) {
    visit.boxes(node.children());
    // All eight children against the bounds of the whole group.
    let (mut t_in, mut t_out) = (B::Lane::zero(), B::Lane::splat(farthest));
    for axis in 0..3 {
        let ((inverse, offset), (late_inverse, late_offset)) = (culls.soon[axis], culls.late[axis]);
        t_in = sides.near(node, axis).fused(inverse, offset).max(t_in);
        t_out = sides.far(node, axis).fused(late_inverse, late_offset).min(t_out);
    }
    let mut children = t_in.le(t_out).bits();
    let (t_in, mut order) = (t_in.to_array(), Order::default());
    let mut met_by = [0u8; LANES];
    while children != 0 {
        let c = children.trailing_zeros() as usize & (LANES - 1);
        children &= children - 1;
        let near = sides.near.map(|k| B::Lane::splat(node.planes[k][c]));
        let far = sides.far.map(|k| B::Lane::splat(node.planes[k][c]));
        let (mut enter, mut leave) = (B::Lane::zero(), fars);
        let (mut sure_in, mut sure_out) = (B::Lane::zero(), B::Lane::lit(f64::INFINITY));
        for axis in 0..3 {
            let ((inverse, offset), (late_inverse, late_offset)) = (units.soon[axis], units.late[axis]);
            enter = near[axis].fused(inverse, offset).max(enter);
            leave = far[axis].fused(late_inverse, late_offset).min(leave);
            if LOOSE {
                sure_in = near[axis].fused(late_inverse, late_offset).max(sure_in);
                sure_out = far[axis].fused(inverse, offset).min(sure_out);
            }
        }
        visit.boxes(who.count_ones());
        let mut met = enter.le(leave).bits() & who;
        if LOOSE {
            for k in bits(met & !sure_in.le(sure_out).bits()) {
                let packet = &packets[k];
                let (mut enter, mut leave) = (B::Lane::zero(), packet.far);
                for axis in 0..3 {
                    let (inverse, offset) = (packet.inverse[axis], packet.offset[axis]);
                    enter = near[axis].fused(inverse, offset).max(enter);
                    leave = far[axis].fused(inverse, offset).min(leave);
                }
                visit.boxes(packet.live().count_ones());
                met &= !(u8::from(enter.le(leave).bits() == 0) << k);
            }
        }
        if met != 0 {
            met_by[c] = met;
            order.insert(t_in[c], c);
        }
    }
    for c in order.farthest_first() {
        stack[*top] = Entry { near: t_in[c], child: node.child[c], who: met_by[c] };
        *top += 1;
    }
}

/// A group's bounds against eight boxes.
struct Culls<B: Scalar> {
    soon: [Crossing<B::Lane>; 3],
    late: [Crossing<B::Lane>; 3],
}

/// `LOOSE` bounds of packets only tell some boxes that are missed: rays are asked too.
fn walk_group<B: Scalar, const LOOSE: bool>(
    how: &Group<B>,
    packets: &mut [Packet<B>],
    stack: &mut [Entry<B>],
    visit: &mut impl Visit<B>,
) {
    let &Group { bvh, frame, octant, bounds, .. } = how;
    let sides = Sides::of(octant);
    let (soon, late) = bounds.around(how.packets).ends(octant);
    let (culls, units) = (Culls { soon, late }, bounds.units(octant));
    let mut fars = B::Lane::lit(-1.0); // The farthest that any ray of a packet looks, a lane a packet.
    for k in bits(how.packets) {
        fars = with_lane(fars, k, highest(packets[k].far_in(frame)));
    }
    let mut farthest = highest(fars);
    stack[0] = Entry { near: B::default(), child: Child::ROOT, who: how.packets };
    let mut top = 1;
    while top > 0 {
        top -= 1;
        let entry = stack[top];
        // Packets that have found something nearer since the entry was made drop out.
        let who = entry.who & B::Lane::splat(entry.near).le(fars).bits();
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
                for k in bits(changed) {
                    fars = with_lane(fars, k, highest(packets[k].far_in(frame)));
                }
                farthest = highest(fars);
            }
            continue;
        }
        if who & (who - 1) == 0 {
            // One packet is left: its rays are held against boxes from here on.
            let k = who.trailing_zeros() as usize & (LANES - 1);
            let start = Entry { who: packets[k].live(), ..entry };
            let (interval, pad, least_lanes) = (bounds.lane(k), how.pad, how.least_lanes);
            let how = OnePacket { bvh, number: k, frame, octant, interval, pad, least_lanes };
            walk_packet(&how, packets, start, &mut stack[top..], visit);
            fars = with_lane(fars, k, highest(packets[k].far_in(frame)));
            farthest = highest(fars);
            continue;
        }
        let node = &bvh.nodes[entry.child.index()];
        let looking = (&units, fars, farthest);
        expand::<B, LOOSE>(node, who, &sides, &culls, looking, packets, (stack, &mut top), visit);
    }
}

/// One packet, and how it is looked at.
struct OnePacket<'a, B: Scalar> {
    bvh: &'a Bvh<B>,
    number: usize,
    frame: Frame,
    octant: u8,
    interval: Interval<B>,
    pad: B,
    least_lanes: u32,
}

/// Some rays of one packet that share an octant.
fn walk_packet<B: Scalar>(
    how: &OnePacket<B>,
    packets: &mut [Packet<B>],
    start: Entry<B>,
    stack: &mut [Entry<B>],
    visit: &mut impl Visit<B>,
) {
    let &OnePacket { bvh, number, frame, octant, .. } = how;
    let sides = Sides::of(octant);
    let (soon, late) = how.interval.ends(octant);
    let (culls, units) = (Culls { soon, late }, packets[number].units(frame, octant, how.pad));
    let mut far = packets[number].far_in(frame);
    let mut farthest = highest(far);
    stack[0] = start;
    let mut top = 1;
    while top > 0 {
        top -= 1;
        let entry = stack[top];
        let lanes = entry.who & B::Lane::splat(entry.near).le(far).bits();
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
        let node = &bvh.nodes[entry.child.index()];
        let looking = (&units, far, farthest);
        expand::<B, false>(node, lanes, &sides, &culls, looking, packets, (stack, &mut top), visit);
    }
}

/// Lanes of a packet one by one.
fn walk_lanes<B: Scalar>(
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
fn walk_single<B: Scalar>(
    bvh: &Bvh<B>,
    packet: &mut Packet<B>,
    number: usize,
    lane: usize,
    start: Child,
    stack: &mut [Entry<B>],
    visit: &mut impl Visit<B>,
) {
    let inverse = packet.inverse.map(|i| B::Lane::splat(i.lanes()[lane]));
    let offset = packet.offset.map(|o| B::Lane::splat(o.lanes()[lane]));
    let octant =
        (0..3).fold(0u8, |o, axis| o | u8::from(packet.inverse[axis].lanes()[lane] < B::default()) << axis);
    let sides = Sides::of(octant);
    let mut far = packet.far.lanes()[lane];
    let mut child = start;
    let mut top = 0;
    'walk: loop {
        if child.is_leaf() {
            bvh.for_each_run(child, |run| {
                if visit.wants(run.class) {
                    far = visit.single(run, (number, lane), packet, far);
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
                t_in = sides.near(node, axis).fused(inverse[axis], offset[axis]).max(t_in);
                t_out = sides.far(node, axis).fused(inverse[axis], offset[axis]).min(t_out);
            }
            let mut met = t_in.le(t_out).bits();
            if met != 0 {
                let c = met.trailing_zeros() as usize & (LANES - 1);
                met &= met - 1;
                if met == 0 {
                    child = node.child[c];
                    continue;
                }
                let t_in = t_in.to_array();
                let d = met.trailing_zeros() as usize & (LANES - 1);
                met &= met - 1;
                let entry = |c: usize| Entry { near: t_in[c], child: node.child[c], who: 1 };
                if met == 0 {
                    let (nearer, other) = if t_in[d] < t_in[c] { (d, c) } else { (c, d) };
                    stack[top] = entry(other);
                    top += 1;
                    child = node.child[nearer];
                    continue;
                }
                let mut order = Order::default();
                order.insert(t_in[c], c);
                order.insert(t_in[d], d);
                for c in bits(met) {
                    order.insert(t_in[c], c);
                }
                for c in order.farthest_first() {
                    stack[top] = entry(c);
                    top += 1;
                }
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
    packet.far.lanes_mut()[lane] = far;
}

/// Children in the order of their nearest points. Entries are written to the stack once and in order: to move them
/// about there costs a stall each, since a processor cannot yet read as a whole what it has just written in parts.
#[derive(Debug, Clone, Copy, Default)]
struct Order {
    /// Distance in the upper bits, child in the lowest.
    keys: [u64; LANES],
    len: usize,
}

impl Order {
    #[inline(always)]
    fn insert<B: Scalar>(&mut self, near: B, child: usize) {
        let key = near.order_key() | child as u64;
        let mut k = self.len;
        while k > 0 && self.keys[(k - 1) & (LANES - 1)] < key {
            self.keys[k & (LANES - 1)] = self.keys[(k - 1) & (LANES - 1)];
            k -= 1;
        }
        self.keys[k & (LANES - 1)] = key;
        self.len += 1;
    }

    #[inline(always)]
    fn farthest_first(&self) -> impl Iterator<Item = usize> {
        (0..self.len).map(|k| (self.keys[k & (LANES - 1)] & 7) as usize)
    }
}

/// The set bits of a byte, lowest first.
#[inline(always)]
pub fn bits(mut mask: u8) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        (mask != 0).then(|| {
            let k = mask.trailing_zeros() as usize & (LANES - 1);
            mask &= mask - 1;
            k
        })
    })
}
