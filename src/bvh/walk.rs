//! Rays through the tree: groups of up to eight packets that share an octant, or one ray against eight boxes.
//!
//! A group is held against all eight children of a node by one interval test (Boulos, Wald, Shirley 2006, Geometric
//! and arithmetic culling methods for entire ray packets), and only the packets that survive are tested ray by ray. Slab
//! tests choose their near and far planes by the octant's signs and pad the far side by three roundings (Ize 2013,
//! Robust BVH ray traversal). What happens in leaves is the caller's business ([`Visit`]).

use super::{Bvh, Child, Node, Run};
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3, f64x8};

/// Eight rays as the boxes see them: relative to the tree's origin, started at the tree's bounds, in precision `B`.
#[derive(Debug, Clone, Copy)]
pub struct Packet<B: Scalar> {
    origin: [B::Lane; 3],
    inverse: [B::Lane; 3],
    /// How far along each ray (from its moved start) a box still matters; negative in lanes without a ray, or whose
    /// ray is done.
    pub far: B::Lane,
    /// How far the start was moved, in scene units.
    pub start: f64x8,
}

/// No direction component is smaller than this in a packet, so that reciprocals are finite and no slab test meets
/// `0 * inf`. It bends a ray by less than 2^-59 of its length, far below [`Bvh::slack`] in both precisions.
const LEAST_DIRECTION: f64 = 1.0 / (1u64 << 60) as f64;

impl<B: Scalar> Packet<B> {
    /// `rays` up to distance `t_far` in lanes `active`; the others hold no ray.
    pub fn new(bvh: &Bvh<B>, origin: Vec3<f64x8>, dir: Vec3<f64x8>, t_far: f64x8, active: u8) -> Self {
        let zero = B::Lane::zero();
        let least = B::Lane::lit(LEAST_DIRECTION);
        let inverse = [dir.x, dir.y, dir.z].map(|d| {
            let d = B::Lane::from_f64s(d);
            B::Lane::lit(1.0) / least.max(d.abs()).copysign(d)
        });
        let origin = origin - Vec3::splat(bvh.origin);
        let mut packet = Self {
            origin: [origin.x, origin.y, origin.z].map(B::Lane::from_f64s),
            inverse,
            far: B::Lane::lit(-1.0),
            start: f64x8::zero(),
        };
        // Where the ray enters the bounds: start there, so that a far eye is no less exact than a near one.
        let half = (bvh.bounds.max - bvh.bounds.min) * 0.5 + Bvh::<B>::slack(&bvh.bounds);
        let half = [half.x, half.y, half.z].map(B::Lane::lit);
        let (mut t_in, mut t_out) = (zero, B::Lane::lit(f64::INFINITY));
        for axis in 0..3 {
            let (o, i, side) = (packet.origin[axis], inverse[axis], half[axis].copysign(inverse[axis]));
            t_in = ((-side - o) * i).max(t_in);
            t_out = ((side - o) * i).min(t_out);
        }
        // Four roundings of each plane distance, that of the start with it.
        let pad = B::Lane::lit(1.0 + 16.0 * B::UNIT_ROUNDOFF);
        let t_far_up = B::Lane::from_f64s(t_far * f64x8::lit(1.0 + 4.0 * B::UNIT_ROUNDOFF));
        let meets = t_in.le(t_out * pad) & t_in.le(t_far_up * pad) & Mask::from_bits(active);
        if t_in.gt(zero).any() {
            // Early rather than late, whatever the rounding.
            packet.start = (t_in * B::Lane::lit(1.0 - 16.0 * B::UNIT_ROUNDOFF)).to_f64s();
            let moved = origin + dir * packet.start;
            packet.origin = [moved.x, moved.y, moved.z].map(B::Lane::from_f64s);
        }
        packet.far = meets.select(packet.far_of(t_far), packet.far);
        packet
    }

    /// A distance along the rays as this packet's boxes count it, rounded up.
    #[inline(always)]
    pub fn far_of(&self, t: f64x8) -> B::Lane {
        let up = 1.0 + 4.0 * B::UNIT_ROUNDOFF;
        B::Lane::from_f64s((t - self.start) * f64x8::lit(up))
    }

    /// Lanes with a ray that is not done.
    #[inline(always)]
    pub fn live(&self) -> u8 {
        self.far.ge(B::Lane::zero()).bits()
    }

    /// Bit `axis` for each lane's negative direction components.
    fn signs(&self) -> [u8; 3] {
        self.inverse.map(|i| i.lt(B::Lane::zero()).bits())
    }

    /// The octant all live lanes share, if they do: bit `axis` set where directions are negative.
    pub fn octant(&self) -> Option<u8> {
        let live = self.live();
        let mut octant = 0;
        for (axis, signs) in self.signs().into_iter().enumerate() {
            if signs & live == live {
                octant |= 1 << axis;
            } else if signs & live != 0 {
                return None;
            }
        }
        Some(octant)
    }

    /// The live lanes that share the octant of the first live lane.
    fn first_octant_lanes(&self, live: u8) -> u8 {
        let first = live.trailing_zeros();
        self.signs()
            .into_iter()
            .fold(live, |lanes, signs| lanes & if signs >> first & 1 == 1 { signs } else { !signs })
    }
}

/// What the walk's owner does in leaves.
pub trait Visit<B: Scalar> {
    /// Tests the primitives of `run` against packet number `packet`, in the lanes of `lanes` that are live, and
    /// shortens `state.far` where a nearer hit was found (to a negative number where the ray is done).
    fn visit(&mut self, run: &Run, packet: usize, lanes: u8, state: &mut Packet<B>);
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

/// What is still to be looked at; kept between walks so that nothing is allocated.
#[derive(Debug, Default)]
pub struct Stack<B: Scalar>(Vec<Entry<B>>);

#[derive(Debug, Clone, Copy)]
struct Entry<B> {
    child: Child,
    packets: u8,
    near: B,
}

/// With fewer lanes than this in one octant, rays go singly: a packet step costs about three single-ray steps.
const LEAST_PACKET: u32 = 3;

/// Walks up to eight packets through the tree.
pub fn walk<B: Scalar>(
    bvh: &Bvh<B>,
    packets: &mut [Packet<B>],
    stack: &mut Stack<B>,
    visit: &mut impl Visit<B>,
    traversal: Traversal,
) {
    debug_assert!(packets.len() <= 8);
    if bvh.nodes.is_empty() {
        return;
    }
    // Packets of one octant go together, the others by themselves.
    let mut waiting = 0u8;
    for (k, packet) in packets.iter().enumerate() {
        waiting |= u8::from(packet.live() != 0) << k;
    }
    if traversal == Traversal::Single {
        for k in bits(waiting) {
            for lane in bits(packets[k].live()) {
                walk_single(bvh, &mut packets[k], k, lane, stack, visit);
            }
        }
        return;
    }
    let least_packet = if traversal == Traversal::Packet { 1 } else { LEAST_PACKET };
    let alone = traversal == Traversal::Hybrid;
    while waiting != 0 {
        let first = waiting.trailing_zeros() as usize;
        match packets[first].octant() {
            Some(octant) => {
                let mut group = 0u8;
                for (k, packet) in packets.iter().enumerate() {
                    let joins = waiting >> k & 1 == 1 && (k == first || !alone);
                    if joins && packet.octant() == Some(octant) {
                        group |= 1 << k;
                    }
                }
                walk_group(bvh, packets, group, octant, stack, visit);
                waiting &= !group;
            }
            None => {
                walk_mixed(bvh, packets, first, stack, visit, least_packet);
                waiting &= !(1 << first);
            }
        }
    }
}

/// A packet whose rays go several ways: octant by octant, a few rays singly.
fn walk_mixed<B: Scalar>(
    bvh: &Bvh<B>,
    packets: &mut [Packet<B>],
    number: usize,
    stack: &mut Stack<B>,
    visit: &mut impl Visit<B>,
    least_packet: u32,
) {
    let mut waiting = packets[number].live();
    while waiting != 0 {
        let lanes = packets[number].first_octant_lanes(waiting);
        waiting &= !lanes;
        if lanes.count_ones() < least_packet {
            for lane in (0..LANES).filter(|lane| lanes >> lane & 1 == 1) {
                walk_single(bvh, &mut packets[number], number, lane, stack, visit);
            }
            continue;
        }
        // The other lanes sit this walk out.
        let others = Mask::<B::Lane>::from_bits(!lanes);
        let kept = packets[number].far;
        packets[number].far = others.select(B::Lane::lit(-1.0), kept);
        if let Some(octant) = packets[number].octant() {
            walk_group(bvh, packets, 1 << number, octant, stack, visit);
        }
        packets[number].far = others.select(kept, packets[number].far);
    }
}

/// Bounds of a group's rays on one axis, chosen so that products with them bound the plane distances.
struct AxisInterval<L> {
    near_origin: L,
    far_origin: L,
    least_inverse: L,
    most_inverse: L,
}

fn intervals<B: Scalar>(packets: &[Packet<B>], group: u8, octant: u8) -> [AxisInterval<B::Lane>; 3] {
    std::array::from_fn(|axis| {
        let (inf, neg) = (B::Lane::lit(f64::INFINITY), B::Lane::lit(f64::NEG_INFINITY));
        let (mut o_min, mut o_max, mut i_min, mut i_max) = (inf, neg, inf, neg);
        for (k, packet) in packets.iter().enumerate() {
            if group >> k & 1 == 0 {
                continue;
            }
            let live = packet.far.ge(B::Lane::zero());
            let (o, i) = (packet.origin[axis], packet.inverse[axis]);
            o_min = o_min.min(live.select(o, inf));
            o_max = o_max.max(live.select(o, neg));
            i_min = i_min.min(live.select(i, inf));
            i_max = i_max.max(live.select(i, neg));
        }
        let least = |x: B::Lane| B::Lane::splat(fold(x, |a, b| if b < a { b } else { a }));
        let most = |x: B::Lane| B::Lane::splat(fold(x, |a, b| if b > a { b } else { a }));
        let (o_min, o_max) = (least(o_min), most(o_max));
        let negative = octant >> axis & 1 == 1;
        AxisInterval {
            near_origin: if negative { o_min } else { o_max },
            far_origin: if negative { o_max } else { o_min },
            least_inverse: least(i_min),
            most_inverse: most(i_max),
        }
    })
}

fn fold<L: Lane>(x: L, f: impl Fn(L::Scalar, L::Scalar) -> L::Scalar) -> L::Scalar {
    let lanes = x.to_array();
    lanes[1..].iter().fold(lanes[0], |a, &b| f(a, b))
}

/// The near and far planes of a node's children along `axis`.
#[inline(always)]
fn planes<B: Scalar>(node: &Node<B>, octant: u8, axis: usize) -> (&[B; LANES], &[B; LANES]) {
    if octant >> axis & 1 == 1 {
        (&node.max[axis], &node.min[axis])
    } else {
        (&node.min[axis], &node.max[axis])
    }
}

fn walk_group<B: Scalar>(
    bvh: &Bvh<B>,
    packets: &mut [Packet<B>],
    group: u8,
    octant: u8,
    stack: &mut Stack<B>,
    visit: &mut impl Visit<B>,
) {
    let pad = B::Lane::lit(1.0 + 8.0 * B::UNIT_ROUNDOFF);
    let spans = intervals(packets, group, octant);
    let base = stack.0.len();
    stack.0.push(Entry { child: Child::node(0), packets: group, near: B::default() });
    while stack.0.len() > base {
        let Some(entry) = stack.0.pop() else { break };
        let child = entry.child;
        let near = B::Lane::splat(entry.near);
        // Packets that have found something nearer since the entry was made drop out.
        let mut mask = 0u8;
        let mut farthest = B::Lane::lit(-1.0);
        for (k, packet) in packets.iter().enumerate() {
            if entry.packets >> k & 1 == 1 && near.le(packet.far).any() {
                mask |= 1 << k;
                farthest = packet.far.max(farthest);
            }
        }
        if mask == 0 {
            continue;
        }
        if child.is_leaf() {
            for run in leaf_runs(bvh, child) {
                if visit.wants(run.class) {
                    for k in bits(mask) {
                        visit.visit(run, k, !0, &mut packets[k]);
                    }
                }
            }
            continue;
        }

        let node = &bvh.nodes[child.index()];
        // All eight children against the bounds of the whole group.
        let farthest = B::Lane::splat(fold(farthest, |a, b| if b > a { b } else { a }));
        let mut t_in = B::Lane::zero();
        let mut t_out = farthest;
        for (axis, span) in spans.iter().enumerate() {
            let (near, far) = planes(node, octant, axis);
            let near = B::Lane::from_array(*near) - span.near_origin;
            let far = B::Lane::from_array(*far) - span.far_origin;
            t_in = (near * span.least_inverse).min(near * span.most_inverse).max(t_in);
            t_out = (far * span.least_inverse).max(far * span.most_inverse).min(t_out);
        }
        let mut children = t_in.le(t_out * pad).bits();
        let t_in = t_in.to_array();
        let first = stack.0.len();
        while children != 0 {
            let c = children.trailing_zeros() as usize;
            children &= children - 1;
            let box_planes: [(B::Lane, B::Lane); 3] = std::array::from_fn(|axis| {
                let (near, far) = planes(node, octant, axis);
                (B::Lane::splat(near[c]), B::Lane::splat(far[c]))
            });
            let mut kept = 0u8;
            for k in bits(mask) {
                let packet = &packets[k];
                let mut enter = B::Lane::zero();
                let mut leave = packet.far;
                for (axis, (near, far)) in box_planes.iter().enumerate() {
                    let (o, i) = (packet.origin[axis], packet.inverse[axis]);
                    enter = ((*near - o) * i).max(enter);
                    leave = (((*far - o) * i) * pad).min(leave);
                }
                kept |= u8::from(enter.le(leave).any()) << k;
            }
            if kept != 0 {
                insert(&mut stack.0, first, Entry { child: node.child[c], packets: kept, near: t_in[c] });
            }
        }
    }
}

/// One ray against eight boxes at a time.
fn walk_single<B: Scalar>(
    bvh: &Bvh<B>,
    packet: &mut Packet<B>,
    number: usize,
    lane: usize,
    stack: &mut Stack<B>,
    visit: &mut impl Visit<B>,
) {
    let pad = B::Lane::lit(1.0 + 8.0 * B::UNIT_ROUNDOFF);
    let octant = (0..3)
        .fold(0u8, |o, axis| o | u8::from(packet.inverse[axis].to_array()[lane] < B::default()) << axis);
    let origin = packet.origin.map(|o| B::Lane::splat(o.to_array()[lane]));
    let inverse = packet.inverse.map(|i| B::Lane::splat(i.to_array()[lane]));
    let base = stack.0.len();
    stack.0.push(Entry { child: Child::node(0), packets: 1, near: B::default() });
    while stack.0.len() > base {
        let Some(entry) = stack.0.pop() else { break };
        let far = packet.far.to_array()[lane];
        if entry.near > far {
            continue;
        }
        let child = entry.child;
        if child.is_leaf() {
            for run in leaf_runs(bvh, child) {
                if visit.wants(run.class) {
                    visit.visit(run, number, 1 << lane, packet);
                }
            }
            continue;
        }
        let node = &bvh.nodes[child.index()];
        let mut t_in = B::Lane::zero();
        let mut t_out = B::Lane::splat(far);
        for axis in 0..3 {
            let (near, far) = planes(node, octant, axis);
            t_in = ((B::Lane::from_array(*near) - origin[axis]) * inverse[axis]).max(t_in);
            t_out = (((B::Lane::from_array(*far) - origin[axis]) * inverse[axis]) * pad).min(t_out);
        }
        let children = t_in.le(t_out).bits();
        let t_in = t_in.to_array();
        let first = stack.0.len();
        for c in bits(children) {
            insert(&mut stack.0, first, Entry { child: node.child[c], packets: 1, near: t_in[c] });
        }
    }
}

/// Puts an entry among those of its node (from `first` on), nearest on top.
#[inline(always)]
fn insert<B: Scalar>(stack: &mut Vec<Entry<B>>, first: usize, entry: Entry<B>) {
    stack.push(entry);
    let mut k = stack.len() - 1;
    while k > first && stack[k - 1].near < entry.near {
        stack[k] = stack[k - 1];
        k -= 1;
    }
    stack[k] = entry;
}

/// The runs of a leaf.
#[inline(always)]
fn leaf_runs<B: Scalar>(bvh: &Bvh<B>, leaf: Child) -> impl Iterator<Item = &Run> {
    let mut more = true;
    bvh.runs[leaf.index()..].iter().take_while(move |run| std::mem::replace(&mut more, !run.last))
}

/// The set bits of a byte, lowest first.
#[inline(always)]
fn bits(mut mask: u8) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        (mask != 0).then(|| {
            let k = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            k
        })
    })
}
