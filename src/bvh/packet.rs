//! Eight rays as the tree sees them, and what bounds several of them.

use super::Bvh;
use crate::lane::{Lane, Mask, Scalar, Vec3};

/// Eight rays as the boxes see them: relative to the tree's origin, started at the tree's bounds, in precision `B`.
#[derive(Debug, Clone, Copy)]
pub struct Packet<B: Scalar> {
    pub(super) origin: [B::Lane; 3],
    pub(super) inverse: [B::Lane; 3],
    /// `-origin * inverse`.
    pub(super) offset: [B::Lane; 3],
    /// How far along each ray (from its moved start) a box still matters; negative in lanes without a ray, or whose
    /// ray is done.
    pub far: B::Lane,
    /// How far the start was moved, in scene units.
    start: B::Lane,
}

/// Roundings of `B` that a distance may be off by, with room: it decides where a ray enters the bounds and how far it
/// still looks.
const DISTANCE_ROUNDINGS: f64 = 8.0;

/// Each lane rounded to another precision.
#[inline(always)]
fn cast<L: Lane, M: Lane>(x: L) -> M {
    M::from_f64s(x.to_f64s())
}

impl<B: Scalar> Packet<B> {
    /// Rays up to distance `t_far` in lanes `active`; the others hold no ray.
    #[inline]
    pub fn new<L: Lane>(bvh: &Bvh<B>, origin: Vec3<L>, dir: Vec3<L>, t_far: L, active: u8) -> Self {
        let origin = origin - Vec3::splat(bvh.origin);
        let inverse = dir.cast::<B::Lane>().slab_inverse();
        let inverse = [inverse.x, inverse.y, inverse.z];
        let mut own = [origin.x, origin.y, origin.z].map(cast::<L, B::Lane>);
        let slack = Bvh::<B>::slack(&bvh.moved_bounds());
        let (min, max) = (bvh.moved_bounds().min - slack, bvh.moved_bounds().max + slack);
        // Where the ray enters the bounds: it starts there, so that a far eye is no less exact than a near one.
        let (mut t_in, mut t_out) = (B::Lane::zero(), B::Lane::lit(f64::INFINITY));
        for axis in 0..3 {
            let (min, max) = (B::Lane::lit(min[axis]), B::Lane::lit(max[axis]));
            let (a, b) = ((min - own[axis]) * inverse[axis], (max - own[axis]) * inverse[axis]);
            t_in = a.min(b).max(t_in);
            t_out = a.max(b).min(t_out);
        }
        let roundings = DISTANCE_ROUNDINGS * B::UNIT_ROUNDOFF;
        let start = t_in * B::Lane::lit(1.0 - roundings);
        if start.gt(B::Lane::zero()).any() {
            let t = start.to_f64s();
            let moved = |o: L, d: L| B::Lane::from_f64s(o.to_f64s() + d.to_f64s() * t);
            own = [moved(origin.x, dir.x), moved(origin.y, dir.y), moved(origin.z, dir.z)];
        }
        let offset = [0, 1, 2].map(|axis| -(own[axis] * inverse[axis]));
        let mut packet = Self { origin: own, inverse, offset, far: B::Lane::lit(-1.0), start };
        let far = packet.far_of(t_far);
        let meets = start.le(t_out * B::Lane::lit(1.0 + roundings));
        packet.far = (meets & Mask::from_bits(active)).select(far, packet.far);
        packet
    }

    /// No rays.
    #[inline]
    pub fn idle() -> Self {
        let none = [B::Lane::zero(); 3];
        Self { origin: none, inverse: none, offset: none, far: B::Lane::lit(-1.0), start: B::Lane::zero() }
    }

    /// A distance along the rays as this packet's boxes count it, rounded up.
    #[inline(always)]
    pub fn far_of<L: Lane>(&self, t: L) -> B::Lane {
        let t = cast::<L, B::Lane>(t);
        (t - self.start) + t * B::Lane::lit(DISTANCE_ROUNDINGS * B::UNIT_ROUNDOFF)
    }

    /// The same for one lane.
    #[inline(always)]
    pub fn far_of_lane(&self, t: f64, lane: usize) -> B {
        let roundings = DISTANCE_ROUNDINGS * B::UNIT_ROUNDOFF;
        B::from_f64((t - self.start.lanes()[lane].to_f64()) + t * roundings)
    }

    /// Lanes with a ray that is not done.
    #[inline(always)]
    pub fn live(&self) -> u8 {
        self.far.ge(B::Lane::zero()).bits()
    }

    /// Bit `axis` for each lane's negative direction components.
    #[inline(always)]
    fn signs(&self) -> [u8; 3] {
        self.inverse.map(|i| i.lt(B::Lane::zero()).bits())
    }

    /// The octant all live lanes share, if they do: bit `axis` set where directions are negative.
    pub(super) fn octant(&self) -> Option<u8> {
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
    pub(super) fn first_octant_lanes(&self, live: u8) -> u8 {
        let first = live.trailing_zeros();
        self.signs()
            .into_iter()
            .fold(live, |lanes, signs| lanes & if signs >> first & 1 == 1 { signs } else { !signs })
    }

    /// What bounds the live rays, which share an octant.
    pub(super) fn interval(&self) -> Interval<B> {
        let live = self.far.ge(B::Lane::zero());
        let (inf, neg) = (B::Lane::lit(f64::INFINITY), B::Lane::lit(f64::NEG_INFINITY));
        let least = |x: B::Lane| fold(live.select(x, inf), |a, b| if b < a { b } else { a });
        let most = |x: B::Lane| fold(live.select(x, neg), |a, b| if b > a { b } else { a });
        Interval {
            origin: self.origin.map(|x| [least(x), most(x)]),
            inverse: self.inverse.map(|x| [least(x), most(x)]),
        }
    }
}

#[inline(always)]
fn fold<L: Lane>(x: L, f: impl Fn(L::Scalar, L::Scalar) -> L::Scalar) -> L::Scalar {
    let lanes = x.to_array();
    let four = [f(lanes[0], lanes[4]), f(lanes[1], lanes[5]), f(lanes[2], lanes[6]), f(lanes[3], lanes[7])];
    f(f(four[0], four[2]), f(four[1], four[3]))
}

/// Bounds of several rays of one octant, by axis: least and most.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Interval<B> {
    origin: [[B; 2]; 3],
    inverse: [[B; 2]; 3],
}

/// A plane's crossing is `plane * .0 + .1`.
type Crossing<L> = (L, L);

impl<B: Scalar> Interval<B> {
    /// Around both.
    pub fn union(&self, other: &Self) -> Self {
        let join = |a: [[B; 2]; 3], b: [[B; 2]; 3]| {
            [0, 1, 2].map(|k| {
                let least = if b[k][0] < a[k][0] { b[k][0] } else { a[k][0] };
                let most = if b[k][1] > a[k][1] { b[k][1] } else { a[k][1] };
                [least, most]
            })
        };
        Self { origin: join(self.origin, other.origin), inverse: join(self.inverse, other.inverse) }
    }

    /// How far apart directions are: the widths of their components, summed.
    pub fn spread(&self) -> f64 {
        self.inverse.iter().map(|[a, b]| (1.0 / a.to_f64() - 1.0 / b.to_f64()).abs()).sum()
    }

    /// By axis: crossings no ray of the group has before, and none after. (Where they are negative the planes lie behind
    /// some ray, and only the sign holds; more is not asked of them.)
    #[allow(clippy::type_complexity)]
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
