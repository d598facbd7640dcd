//! What bounds several rays: those of a packet, and a group's, packet by packet.

use super::eights::{ByPacket, Packets, by_eights, each_packet, eight_of};
use super::packet::{Crossing, Packet, Units};
use super::stack::Sides;
use super::{Bvh, Node};
use crate::lane::{LANES, Lane, Many, Mask, Scalar, first_and_last, folded, highest, lowest};

/// Which rays of a group's packets are alive.
pub(super) struct Alive<B: Scalar, const N: usize> {
    live: [[Mask<B::Lane>; LANES]; N],
    /// The lane of the first.
    first: [[usize; LANES]; N],
    /// Packets with one at least.
    pub packets: Packets,
    /// All rays of all packets are.
    all: bool,
}

impl<B: Scalar, const N: usize> Alive<B, N> {
    #[inline(always)]
    pub fn of(packets: &[Packet<B>]) -> Self {
        let (live, first) = ([[Mask::all_set(); LANES]; N], [[0; LANES]; N]);
        let mut alive = Self { live, first, packets: 0, all: true };
        for (half, eight) in packets.chunks(LANES).enumerate().take(N) {
            for (k, packet) in eight.iter().enumerate() {
                let live = packet.far.ge(B::Lane::zero());
                alive.live[half][k] = live;
                alive.first[half][k] = live.bits().trailing_zeros() as usize & (LANES - 1);
                alive.packets |= Packets::from(live.any()) << (LANES * half + k);
                alive.all &= live.all();
            }
        }
        alive
    }

    /// The least and the most of a number over the live rays of each packet. Lanes of packets without a live ray hold anything.
    #[inline(always)]
    fn ends(&self, packets: &[Packet<B>], column: impl Fn(&Packet<B>) -> &B::Lane) -> Ends<B, N> {
        let [mut least, mut most] = [[B::Lane::zero(); N]; 2];
        for half in 0..N {
            // (Asked once of the group: in which of its packets all rays live would be guessed.)
            let columns = if self.all {
                columns(packets, half, |_, packet| *column(packet))
            } else {
                columns(packets, half, |k, packet| {
                    let x = column(packet);
                    self.live[half][k].select(*x, B::Lane::splat(x.lanes()[self.first[half][k]]))
                })
            };
            least[half] = folded(columns, B::Lane::min);
            most[half] = folded(columns, B::Lane::max);
        }
        [least, most]
    }

    /// By axis, the least and the most of where the live rays of the packets of `which` really start.
    #[inline(always)]
    fn eyes(&self, packets: &[Packet<B>], which: Packets) -> [[f64; 2]; 3] {
        let [mut least, mut most] = [f64::INFINITY, f64::NEG_INFINITY].map(|x| [B::Lane::lit(x); 3]);
        for k in each_packet(which) {
            let (live, eye) = (&self.live[k / LANES][k % LANES], &packets[k].eye);
            for ((least, most), &x) in least.iter_mut().zip(&mut most).zip(eye) {
                let (low, high) = (least.min(x), most.max(x));
                (*least, *most) =
                    if self.all { (low, high) } else { (live.select(low, *least), live.select(high, *most)) };
            }
        }
        [0, 1, 2].map(|axis| [lowest(least[axis]), highest(most[axis])].map(B::to_f64))
    }
}

/// Eight numbers of each of eight packets, of which `row` has those of packet `k`, a packet a lane. Packets that are not there are the
/// last: how many there are would be guessed.
#[inline(always)]
pub(super) fn columns<B: Scalar>(
    packets: &[Packet<B>],
    half: usize,
    row: impl Fn(usize, &Packet<B>) -> B::Lane,
) -> [B::Lane; LANES] {
    let last = packets.len().saturating_sub(1);
    let mut rows = [B::Lane::zero(); LANES];
    for (k, all) in rows.iter_mut().enumerate() {
        *all = row(k, &packets[(LANES * half + k).min(last)]);
    }
    B::Lane::transpose(rows)
}

/// The least and the most of a number, packet by packet.
type Ends<B, const N: usize> = [ByPacket<<B as Scalar>::Lane, N>; 2];

/// What bounds the directions of a group's packets; by axis, least and most.
#[derive(Debug, Clone, Copy)]
pub(super) struct Directions<B: Scalar, const N: usize> {
    inverse: [Ends<B, N>; 3],
}

impl<B: Scalar, const N: usize> Directions<B, N> {
    /// Become those of `packets`, at least one.
    pub fn bound(&mut self, packets: &[Packet<B>], alive: &Alive<B, N>) {
        for (axis, ends) in self.inverse.iter_mut().enumerate() {
            *ends = alive.ends(packets, |packet| &packet.inverse[axis]);
        }
    }

    /// By axis, the packets all of whose rays go backward; and packets whose rays go several ways.
    pub fn octants(&self) -> ([Packets; 3], Packets) {
        let negative = |of: ByPacket<B::Lane, N>| by_eights::<N>(|half| of[half].lt(B::Lane::zero()).bits());
        let backward = self.inverse.map(|[_, most]| negative(most));
        let [x, y, z] = [0, 1, 2].map(|axis| negative(self.inverse[axis][0]) & !backward[axis]);
        (backward, x | y | z)
    }

    /// Packets whose directions are farther apart than `spread`: see [`Directions::spread_of`].
    pub fn wider_than(&self, spread: f64) -> Packets {
        let one = B::Lane::lit(1.0);
        by_eights::<N>(|half| {
            let [x, y, z] = self.inverse.map(|[a, b]| (one / a[half] - one / b[half]).abs());
            (!(x + y + z).le(B::Lane::lit(spread))).bits()
        })
    }

    /// How far apart the directions of the packets of `which` are: the widths of their components, summed.
    pub fn spread_of(&self, which: Packets) -> f64 {
        spread(self.inverse.map(|both| around(which, both)))
    }
}

/// The widths of directions' components, summed, by the least and the most of their inverses.
#[inline(always)]
fn spread<B: Scalar>(inverse: [[B; 2]; 3]) -> f64 {
    inverse.iter().map(|[a, b]| (1.0 / a.to_f64() - 1.0 / b.to_f64()).abs()).sum()
}

/// What bounds the live rays of a group's packets; by axis, least and most.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds<B: Scalar, const N: usize> {
    origin: [Ends<B, N>; 3],
    pub directions: Directions<B, N>,
}

/// Starts that lie within so many roundings of their coordinates and of the bounds' widths are one: then bounds over a
/// packet are so close that its rays need not be asked. [`Bvh::slack`] reckons with 7.5 for starts within the bounds; all
/// boxes are widened by this for common ones, which lie further off. (Starts that are only near each other are not enough:
/// a vase in a stadium. The other end of shadow rays, a light, was tried too: such bounds hold the surface that the
/// rays start on, which are four times the tests.)
const COMMON_ROUNDINGS: f64 = 16.0;

impl<B: Scalar, const N: usize> Bounds<B, N> {
    /// Of no rays. (It is large, and so filled in in place.)
    #[inline(always)]
    pub fn none() -> Self {
        let none = [[[B::Lane::zero(); N]; 2]; 3];
        Self { origin: none, directions: Directions { inverse: none } }
    }

    /// Takes packets by their own starts.
    pub fn start_apart(&mut self, packets: &[Packet<B>], alive: &Alive<B, N>) {
        for (axis, ends) in self.origin.iter_mut().enumerate() {
            *ends = alive.ends(packets, |packet| &packet.origin[axis]);
        }
    }

    /// Takes the packets of `which` by the start that they have in common, if they do: how far off that may be.
    pub fn start_together(
        &mut self,
        bvh: &Bvh<B>,
        (packets, alive): (&[Packet<B>], &Alive<B, N>),
        which: Packets,
    ) -> Option<B> {
        let width = (bvh.bounds.max - bvh.bounds.min).max_element();
        // Rays that are no camera's mostly start far apart, which the first and the last tell.
        let (first, last) = (which.trailing_zeros() as usize, which.checked_ilog2()? as usize);
        let (one, other) = (packets.get(first)?, packets.get(last)?);
        let one = one.eye_of(first_and_last(one.live()).0);
        let other = other.eye_of(first_and_last(other.live()).1);
        let reach = one.abs().max(other.abs()).max_element();
        if (one - other).abs().max_element() > (reach + width) * (2.0 * COMMON_ROUNDINGS * B::UNIT_ROUNDOFF) {
            return None;
        }
        let eye = alive.eyes(packets, which);
        let reach = eye.iter().fold(0.0f64, |reach, [a, b]| reach.max(a.abs()).max(b.abs()));
        let pad = (reach + width) * (COMMON_ROUNDINGS * B::UNIT_ROUNDOFF);
        if !eye.iter().all(|[least, most]| most - least <= pad) {
            return None;
        }
        let pad = B::from_f64(pad);
        let lanes = B::Lane::splat(pad);
        self.origin = eye.map(|ends| {
            let [least, most] = ends.map(|x| B::Lane::splat(B::from_f64(x)));
            [[least - lanes; N], [most + lanes; N]]
        });
        Some(pad)
    }

    /// Around the packets whose bit is set.
    pub fn around(&self, which: Packets) -> Interval<B> {
        let both = |ends| around(which, ends);
        Interval { origin: self.origin.map(both), inverse: self.directions.inverse.map(both) }
    }

    /// One packet's.
    pub fn lane(&self, packet: usize) -> Interval<B> {
        let both = |ends: Ends<B, N>| ends.map(|x| x[packet / LANES].lanes()[packet % LANES]);
        Interval { origin: self.origin.map(both), inverse: self.directions.inverse.map(both) }
    }

    /// The packets as what is held against boxes.
    pub fn units<M: Many<Eight = B::Lane>>(&self, octant: u8) -> Units<M> {
        let line = |axis: usize, late: bool| {
            let negative = octant >> axis & 1 == 1;
            let origin = &self.origin[axis][usize::from(negative == late)];
            let inverse = &self.directions.inverse[axis][usize::from(negative != late)];
            (M::of(|half| inverse[half]), M::of(|half| -(origin[half] * inverse[half])))
        };
        Units { soon: [0, 1, 2].map(|axis| line(axis, false)), late: [0, 1, 2].map(|axis| line(axis, true)) }
    }
}

/// The least and the most over the packets, or rays of one, whose bit is set.
#[inline(always)]
fn around<L: Lane, const N: usize>(which: Packets, [least, most]: [[L; N]; 2]) -> [L::Scalar; 2] {
    let mut ends = [L::lit(f64::INFINITY), L::lit(f64::NEG_INFINITY)];
    for half in 0..N {
        let which = Mask::<L>::from_bits(eight_of(which, half));
        ends[0] = which.select(least[half], ends[0]).min(ends[0]);
        ends[1] = which.select(most[half], ends[1]).max(ends[1]);
    }
    [lowest(ends[0]), highest(ends[1])]
}

/// Bounds of several rays of one octant, by axis: least and most.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Interval<B> {
    origin: [[B; 2]; 3],
    inverse: [[B; 2]; 3],
}

impl<B: Scalar> Interval<B> {
    /// Of the rays `lanes` of one packet, at least one.
    pub fn of(packet: &Packet<B>, lanes: u8) -> Self {
        let both = |x: B::Lane| around(lanes.into(), [[x], [x]]);
        Self { origin: packet.origin.map(both), inverse: packet.inverse.map(both) }
    }

    /// By axis: crossings no ray of the group has before, and none after. (Where they are negative the planes lie behind
    /// some ray, and only the sign holds; more is not asked of them.)
    #[allow(clippy::type_complexity, reason = "a pair of threes has no better name")]
    pub fn ends(&self, octant: u8) -> ([Crossing<B::Lane>; 3], [Crossing<B::Lane>; 3]) {
        let line = |axis: usize, late: bool| {
            let negative = octant >> axis & 1 == 1;
            // Soonest: the ray that starts furthest along its direction, and goes fastest.
            let origin = B::Lane::splat(self.origin[axis][usize::from(negative == late)]);
            let inverse = B::Lane::splat(self.inverse[axis][usize::from(negative != late)]);
            (inverse, -(origin * inverse))
        };
        ([0, 1, 2].map(|axis| line(axis, false)), [0, 1, 2].map(|axis| line(axis, true)))
    }
}

/// Bounds of several rays as eight boxes are held against them.
pub(super) struct Culls<B: Scalar> {
    pub sides: Sides,
    soon: [Crossing<B::Lane>; 3],
    late: [Crossing<B::Lane>; 3],
}

impl<B: Scalar> Culls<B> {
    /// Of rays of one octant.
    #[inline(always)]
    pub fn of(interval: &Interval<B>, octant: u8) -> Self {
        let (soon, late) = interval.ends(octant);
        Self { sides: Sides::of(octant), soon, late }
    }

    /// Where a node's children are entered at the soonest, and those that rays may meet that look no farther than `farthest`.
    #[inline(always)]
    pub fn meet(&self, node: &Node<B>, farthest: B) -> (B::Lane, u8) {
        let (mut t_in, mut t_out) = (B::Lane::zero(), B::Lane::splat(farthest));
        for axis in 0..3 {
            let ((inverse, offset), (late_inverse, late_offset)) = (self.soon[axis], self.late[axis]);
            t_in = self.sides.near(node, axis).fused(inverse, offset).later(t_in);
            t_out = self.sides.far(node, axis).fused(late_inverse, late_offset).sooner(t_out);
        }
        (t_in, !t_in.beyond(t_out))
    }
}

/// What bounds all live rays of some packets, which may go several ways, as boxes are held against it.
pub(super) struct Hull<B: Scalar> {
    culls: Culls<B>,
    /// The farthest that a ray looks.
    far: B,
}

impl<B: Scalar> Hull<B> {
    /// Of the packets `live`, at least one, each with a live ray.
    pub fn of(packets: &[Packet<B>], live: Packets) -> Self {
        let [mut least, mut most] = [f64::INFINITY, f64::NEG_INFINITY].map(|x| [B::Lane::lit(x); 6]);
        let mut far = B::Lane::lit(-1.0);
        for k in each_packet(live) {
            let Packet { origin: [a, b, c], inverse: [d, e, f], far: looks, .. } = &packets[k];
            let mut columns = [*a, *b, *c, *d, *e, *f];
            let alive = looks.ge(B::Lane::zero());
            if !alive.all() {
                let first = alive.bits().trailing_zeros() as usize & (LANES - 1);
                columns = columns.map(|x| alive.select(x, B::Lane::splat(x.lanes()[first])));
            }
            for ((least, most), x) in least.iter_mut().zip(&mut most).zip(columns) {
                (*least, *most) = (least.min(x), most.max(x));
            }
            far = far.max(*looks);
        }
        let ends = |n: usize| [lowest(least[n]), highest(most[n])];
        let interval = Interval { origin: [0, 1, 2].map(ends), inverse: [3, 4, 5].map(ends) };
        let negative = |axis: usize, end: usize| interval.inverse[axis][end] < B::default();
        let octant = (0..3).fold(0, |octant, axis| octant | u8::from(negative(axis, 1)) << axis);
        let mut culls = Culls::of(&interval, octant);
        for axis in 0..3 {
            // Of an axis along which rays go either way nothing is asked.
            if negative(axis, 0) != negative(axis, 1) {
                culls.soon[axis] = (B::Lane::zero(), B::Lane::zero());
                culls.late[axis] = (B::Lane::zero(), B::Lane::lit(f64::INFINITY));
            }
        }
        Self { culls, far: highest(far) }
    }

    /// The children of a node that rays may meet. (And any that are not there.)
    #[inline(always)]
    pub fn meets(&self, node: &Node<B>) -> u8 {
        self.culls.meet(node, self.far).1
    }
}
