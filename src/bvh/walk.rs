//! Rays through the tree: which go together, and how. Groups of up to sixteen packets that share an octant and, where none go as
//! streams, much the same direction, packets by themselves, streams of rays that go all ways, or one ray against eight boxes.
//!
//! Slab tests choose their near and far planes by the octant's signs; that they lose no box is the business of
//! [`Bvh::slack`]. What happens in leaves is the caller's ([`Visit`]).

use super::bounds::{Alive, Bounds, Interval};
use super::eights::{GROUP, HALVES, each_packet};
use super::group::{Group, OnePacket, walk_group, walk_packet};
use super::packet::{Frame, Packet};
use super::single::{LEAST_TOGETHER, walk_lanes};
use super::small::walk_small;
use super::stack::{Entry, Stack, Stacks};
use super::stream::walk_stream;
use super::visit::Visit;
use super::{Bvh, Child};
use crate::lane::{LANES, Lane, Many, Mask, Scalar};

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

impl Traversal {
    /// True if packets had better be of one octant. Small trees do not care, and where rays that go several ways walk as a stream
    /// they are best left as they come: those of neighbouring pixels meet the same boxes.
    pub fn wants_octants<B: Scalar>(self, bvh: &Bvh<B>) -> bool {
        !self.goes_box_by_box(bvh) && !Switches::of(self, bvh.together).streams
    }

    fn goes_box_by_box<B: Scalar>(self, bvh: &Bvh<B>) -> bool {
        self == Self::Auto && bvh.goes_box_by_box()
    }
}

/// When to walk how.
#[derive(Debug, Clone, Copy)]
struct Switches {
    /// Packets walk together if their directions, axis by axis, lie within this sum of widths.
    group_spread: f64,
    /// With fewer rays than this a packet's rays go singly.
    least_lanes: u32,
    /// Rays of packets that go several ways, or are wide, go as a stream.
    streams: bool,
}

impl Switches {
    /// (Single rays ask for none.)
    fn of(traversal: Traversal, together: bool) -> Self {
        match traversal {
            Traversal::Auto if together => {
                Self { group_spread: GROUP_SPREAD, least_lanes: 0, streams: false }
            }
            Traversal::Auto => {
                Self { group_spread: f64::INFINITY, least_lanes: LEAST_TOGETHER, streams: true }
            }
            Traversal::Packet => Self { group_spread: f64::INFINITY, least_lanes: 0, streams: false },
            Traversal::Hybrid | Traversal::Single => {
                Self { group_spread: -1.0, least_lanes: LEAST_TOGETHER, streams: false }
            }
        }
    }
}

/// See [`Switches::group_spread`].
const GROUP_SPREAD: f64 = 1.0;
/// Packets wider than this go as streams, and others of one octant together. (Mirror rays of the knot with 2 and groups no wider than 1: 0.90
/// of the speed; with 0.25 to 2, and groups of 2 and more, they differ by 2 %.)
const PACKET_SPREAD: f64 = 1.0;

/// Walks up to [`GROUP`] packets through the tree.
pub fn walk<B: Scalar>(
    bvh: &Bvh<B>,
    packets: &mut [Packet<B>],
    stack: &mut Stack<B>,
    visit: &mut impl Visit<B>,
    traversal: Traversal,
) {
    debug_assert!(packets.len() <= GROUP);
    if bvh.nodes.is_empty() {
        return;
    }
    if traversal.goes_box_by_box(bvh) {
        walk_small(bvh, packets, visit);
        return;
    }
    let (stack, rays) = stack.for_depth(bvh.depth);
    if traversal == Traversal::Single {
        for k in 0..packets.len() {
            walk_lanes(bvh, packets, k, packets[k].live(), stack, visit);
        }
        return;
    }
    let switches = Switches::of(traversal, bvh.together);
    // (Where few packets come to an instance, what bounds the others would cost as much as a node.)
    if packets.len() <= LANES {
        walk_eights::<B, B::Lane, 1>(bvh, packets, (stack, rays), visit, switches);
    } else {
        walk_eights::<B, B::Sixteen, HALVES>(bvh, packets, (stack, rays), visit, switches);
    }
}

/// Walks up to `N` times eight packets, a number for each of which is `M`.
fn walk_eights<B: Scalar, M: Many<Eight = B::Lane>, const N: usize>(
    bvh: &Bvh<B>,
    packets: &mut [Packet<B>],
    (stack, rays): Stacks<B>,
    visit: &mut impl Visit<B>,
    switches: Switches,
) {
    let alive = Alive::<B, N>::of(packets);
    let mut waiting = alive.packets;
    let mut bounds = Bounds::<B, N>::none();
    bounds.directions.bound(packets, &alive);
    let directions = &bounds.directions;
    let (backward, mixed) = directions.octants();
    let mut apart = waiting & mixed;
    if switches.streams {
        apart |= waiting & directions.wider_than(PACKET_SPREAD);
        // Where half of the packets go as a stream the others had better go along.
        if 2 * apart.count_ones() >= waiting.count_ones() {
            apart = waiting;
        }
        if apart != 0 {
            walk_stream((bvh, Child::ROOT), packets, apart, (stack, rays), visit);
        }
    } else {
        for k in each_packet(apart) {
            walk_mixed(bvh, packets, k, stack, visit, switches.least_lanes);
        }
    }
    waiting &= !apart;
    if waiting == 0 {
        return;
    }
    let (frame, pad) = match bounds.start_together(bvh, (packets, &alive), waiting) {
        Some(pad) => (Frame::Common, pad),
        None => {
            bounds.start_apart(packets, &alive);
            (Frame::Own, B::default())
        }
    };
    let directions = &bounds.directions;
    while waiting != 0 {
        let first = waiting.trailing_zeros();
        let (mut octant, mut group) = (0u8, waiting);
        for (axis, backward) in backward.into_iter().enumerate() {
            let negative = (backward >> first & 1) as u8;
            octant |= negative << axis;
            group &= if negative == 1 { backward } else { !backward };
        }
        // Packets of one octant go together, if they go much the same way.
        if switches.group_spread.is_finite() && directions.spread_of(group) > switches.group_spread {
            let candidates = group & !(1 << first);
            group = 1 << first;
            for k in each_packet(candidates) {
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
            streams: switches.streams,
            packets: group,
        };
        if frame == Frame::Common {
            walk_group::<B, M, N, false>(&group, packets, (stack, rays), visit);
        } else {
            walk_group::<B, M, N, true>(&group, packets, (stack, rays), visit);
        }
    }
}

/// A packet whose rays go several ways: octant by octant, a few rays singly.
fn walk_mixed<B: Scalar>(
    bvh: &Bvh<B>,
    packets: &mut [Packet<B>],
    number: usize,
    stack: &mut [Entry<B>],
    visit: &mut impl Visit<B>,
    least_lanes: u32,
) {
    let mut waiting = packets[number].live();
    while waiting != 0 {
        let first = waiting.trailing_zeros() as usize & (LANES - 1);
        let lanes = packets[number].first_octant_lanes(waiting);
        waiting &= !lanes;
        if lanes.count_ones() < least_lanes {
            walk_lanes(bvh, packets, number, lanes, stack, visit);
            continue;
        }
        // The other lanes sit this walk out.
        let others = Mask::<B::Lane>::from_bits(!lanes);
        let kept = packets[number].far;
        packets[number].far = others.select(B::Lane::lit(-1.0), kept);
        let interval = Interval::of(&packets[number], lanes);
        let octant = packets[number].octant_of(first);
        let start = Entry { near: B::default(), child: Child::ROOT, who: lanes.into() };
        let (frame, pad) = (Frame::Own, B::default());
        let how = OnePacket { bvh, number, frame, octant, interval, pad, least_lanes };
        walk_packet(&how, packets, start, stack, visit);
        packets[number].far = others.select(kept, packets[number].far);
    }
}
