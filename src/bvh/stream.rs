//! Rays that go all ways, through the tree together.
//!
//! A node is fetched, and its children are put in order, once for all rays that come to it. Each of them is held against the
//! eight boxes at once, one after the other and without a branch in between, so that none waits for another's answer: a ray
//! that walks alone waits for each of its own (Barringer and Akenine-Möller 2014, Dynamic ray stream traversal, ACM
//! Transactions on Graphics 33(4)). Where few rays are left they go on singly.

use super::eights::{
    GROUP, GroupRays, HALVES, Packets, by_eights, bytes_in_use, bytes_of_three, each_packet,
};
use super::packet::Packet;
use super::single::{LEAST_TOGETHER, walk_single};
use super::stack::{Entry, Stacks, farther_than};
use super::visit::Visit;
use super::{Bvh, Child, Node, Run};
use crate::lane::{LANES, Lane, Scalar, bits, bits_of_many};

/// Rays of eight packets.
const RAYS: usize = LANES * LANES;

/// Walks the live rays of the packets `which` through what is below `start`.
pub(super) fn walk_stream<B: Scalar>(
    (bvh, start): (&Bvh<B>, Child),
    packets: &mut [Packet<B>],
    which: Packets,
    (stack, waiting): Stacks<B>,
    visit: &mut impl Visit<B>,
) {
    let mut who = [0; HALVES];
    for number in each_packet(which) {
        who[number / LANES] |= u64::from(packets[number].live()) << (LANES * (number % LANES));
    }
    waiting[0] = Entry { near: B::default(), child: start, who };
    let mut top = 1;
    let mut rays = StreamRays::of(packets, which);
    let fetches = visit.prefetches();
    while top > 0 {
        top -= 1;
        // (Some of the rays do not look as far any more. To find them here would take longer than to test them in vain.)
        let Entry { near, child, who } = waiting[top];
        if child.is_leaf() {
            bvh.for_each_run(child, |run| {
                if visit.wants(run.class) {
                    test(run, (who, near), (packets, &mut rays), visit);
                }
            });
            continue;
        }
        if count(who) < LEAST_TOGETHER {
            for (number, lane) in each_ray(who) {
                if packets[number].far.lanes()[lane] >= near {
                    walk_single(bvh, &mut packets[number], number, lane, child, stack, visit);
                    rays.look_again(&packets[number], (number, lane));
                }
            }
            continue;
        }
        let node = &bvh.nodes[child.index()];
        let (met_by, nearest) = meet(node, who, &rays, visit);
        let met = nearest.lt(B::Lane::lit(f64::INFINITY)).bits() & node.present();
        for c in bits(met) {
            bvh.prefetch(node.child[c], fetches, |run| visit.prefetch(run));
            let entry = Entry { near: nearest.lanes()[c], child: node.child[c], who: met_by.rays(c) };
            waiting[top + farther_than(nearest, met, c)] = entry;
        }
        top += met.count_ones() as usize;
    }
}

/// How many rays these are.
#[inline(always)]
fn count(who: GroupRays) -> u32 {
    who.iter().map(|who| who.count_ones()).sum()
}

/// Packet and lane of a ray.
#[inline(always)]
fn place_of(half: usize, ray: usize) -> (usize, usize) {
    (LANES * half + ray / LANES, ray % LANES)
}

/// Packets and lanes of rays.
#[inline(always)]
fn each_ray([mut first, mut second]: GroupRays) -> impl Iterator<Item = (usize, usize)> {
    // (One loop, as where each of two ends would have to be guessed.)
    std::iter::from_fn(move || {
        (first | second != 0).then(|| {
            let (half, next) = if first != 0 { (0, first) } else { (1, second) };
            second &= if first == 0 { second.wrapping_sub(1) } else { !0 };
            first &= first.wrapping_sub(1);
            place_of(half, next.trailing_zeros() as usize % RAYS)
        })
    })
}

/// The rays of a stream as boxes are held against them, each with its numbers side by side.
struct StreamRays<B: Scalar> {
    /// By ray: by axis its inverse direction, by axis the offset of its crossings, and at [`FAR`] how far it looks.
    lines: [B::Lane; GROUP * LANES],
}

/// Place among a ray's numbers.
const FAR: usize = 6;

impl<B: Scalar> StreamRays<B> {
    /// Of the packets `which`.
    #[inline(always)]
    fn of(packets: &[Packet<B>], which: Packets) -> Self {
        let zero = B::Lane::zero();
        let mut rays = Self { lines: [zero; GROUP * LANES] };
        for number in each_packet(which) {
            let &Packet { inverse: [x, y, z], offset: [u, v, w], far, .. } = &packets[number];
            let lines = B::Lane::transpose([x, y, z, u, v, w, far, zero]);
            rays.lines[LANES * number..][..LANES].copy_from_slice(&lines);
        }
        rays
    }

    /// A ray may look less far than it did.
    #[inline(always)]
    fn look_again(&mut self, packet: &Packet<B>, (number, lane): (usize, usize)) {
        self.lines[LANES * number + lane].lanes_mut()[FAR] = packet.far.lanes()[lane];
    }
}

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

/// Which rays meet the children of a node: by half, a child a lane, the rays' bits in two numbers. (Read child by child where they
/// stand: to put together those of all children takes longer than to test a ray.)
struct MetBy<B: Scalar>([[B::Lane; 2]; HALVES]);

impl<B: Scalar> MetBy<B> {
    /// Those of one child.
    #[inline(always)]
    fn rays(&self, child: usize) -> GroupRays {
        let bits = |numbers: &B::Lane| u64::from(numbers.lanes()[child & (LANES - 1)].as_bits());
        self.0.each_ref().map(|[low, high]| bits(low) | bits(high) << 32)
    }
}

/// Holds the rays `who` against a node's boxes: child by child, which rays meet it, and where the first of them does: infinitely
/// far off if none does. (Of children that are not there, too.)
#[inline(always)]
fn meet<B: Scalar>(
    node: &Node<B>,
    who: GroupRays,
    rays: &StreamRays<B>,
    visit: &mut impl Visit<B>,
) -> (MetBy<B>, B::Lane) {
    let mut met_by = MetBy([[B::Lane::zero(); 2]; HALVES]);
    let mut nearest = B::Lane::lit(f64::INFINITY);
    for (half, who) in who.into_iter().enumerate() {
        if who == 0 {
            continue;
        }
        // A ray's bit in the lanes of the children that it meets.
        let mut met_here = [B::Lane::zero(); 2];
        for ray in bits_of_many::<RAYS>(who) {
            // Numbers are read where they stand: to move eight of them for one costs a stall.
            let &[x, y, z, u, v, w, far, _] = rays.lines[RAYS * half + ray].lanes();
            let (mut t_in, mut t_out) = (B::Lane::zero(), B::Lane::splat(far));
            for (axis, (inverse, offset)) in [(x, u), (y, v), (z, w)].into_iter().enumerate() {
                let (inverse, offset) = (B::Lane::splat(inverse), B::Lane::splat(offset));
                // Which comes first is told from the two: to look up which planes do takes a ray six indices.
                let [a, b] =
                    [axis, 3 + axis].map(|k| B::Lane::from_array(node.planes[k]).fused(inverse, offset));
                t_in = Lane::min(a, b).later(t_in);
                t_out = Lane::max(a, b).sooner(t_out);
            }
            visit.boxes(node.children());
            let met = t_in.le(t_out);
            nearest = met.or_never(t_in).sooner(nearest);
            for (met_here, bits) in met_here.iter_mut().zip(BIT_OF[ray]) {
                *met_here = *met_here | met.keep(B::Lane::splat(B::of_bits(bits)));
            }
        }
        met_by.0[half] = met_here;
    }
    (met_by, nearest)
}

/// Tests the primitives of `run` against those of the rays `who` that look as far as `near`.
#[inline(always)]
fn test<B: Scalar>(
    run: &Run,
    (who, near): (GroupRays, B),
    (packets, rays): (&mut [Packet<B>], &mut StreamRays<B>),
    visit: &mut impl Visit<B>,
) {
    // Three rays of one packet are tested as a packet: eight rays against a row take as long as three or less against four rows each.
    let together = who.map(bytes_of_three);
    let whole: Packets = by_eights::<HALVES>(|half| bytes_in_use(together[half]));
    let lone: GroupRays = std::array::from_fn(|half| who[half] & !together[half]);
    if whole != 0 {
        for number in each_packet(visit.packets(run, whole, packets)) {
            for lane in 0..LANES {
                rays.look_again(&packets[number], (number, lane));
            }
        }
    }
    for (number, lane) in each_ray(lone) {
        let known = packets[number].far.lanes()[lane];
        // (One that any hit ends may be done by now, and looks nowhere.)
        if known >= near {
            let (packet, lone) = (&mut packets[number], visit.lone(number, lane));
            let far = visit.single(run, &lone, packet, known);
            packet.shorten(lane, far);
            rays.look_again(packet, (number, lane));
        }
    }
}
