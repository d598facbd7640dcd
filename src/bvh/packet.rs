//! Eight rays as the tree sees them.

use super::Bvh;
use crate::kernel::Rays;
use crate::lane::{Lane, Mask, Scalar, Vec3};
use glam::DVec3;

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
    /// Where the rays really start.
    pub(super) eye: [B::Lane; 3],
}

/// From where distances along rays are counted when boxes are held against several of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Frame {
    /// From each ray's own start at the tree's bounds.
    Own,
    /// From the start that all of them share, as far off as it may be.
    Common,
}

/// Roundings of `B` that a distance may be off by, with room: it decides where a ray enters the bounds and how far it
/// still looks.
const DISTANCE_ROUNDINGS: f64 = 8.0;

impl<B: Scalar> Packet<B> {
    /// Becomes rays up to distance `t_far` in lanes `active`; the others hold no ray. (In place: packets are large, and
    /// to move one costs as much as a test.)
    #[inline]
    pub fn aim<L: Lane>(&mut self, bvh: &Bvh<B>, rays: &Rays<L>, t_far: L, active: u8) {
        let (origin, dir) = (rays.origin - Vec3::splat(bvh.origin), &rays.dir);
        let inverse = dir.cast::<B::Lane>().slab_inverse();
        let inverse = [inverse.x, inverse.y, inverse.z];
        let mut own = [origin.x, origin.y, origin.z].map(L::cast::<B::Lane>);
        self.eye = own;
        let [min, max] = bvh.entry;
        // Where the ray enters the bounds: it starts there, so that a far eye is no less exact than a near one.
        let (mut t_in, mut t_out) = (B::Lane::zero(), B::Lane::lit(f64::INFINITY));
        for axis in 0..3 {
            let (min, max) = (B::Lane::splat(min[axis]), B::Lane::splat(max[axis]));
            let (a, b) = ((min - own[axis]) * inverse[axis], (max - own[axis]) * inverse[axis]);
            t_in = a.min(b).max(t_in);
            t_out = a.max(b).min(t_out);
        }
        let roundings = DISTANCE_ROUNDINGS * B::UNIT_ROUNDOFF;
        let start = t_in * B::Lane::lit(1.0 - roundings);
        if start.gt(B::Lane::zero()).any() {
            // (Where the machine multiplies and adds at once nothing but the sum is rounded.)
            let at_once = cfg!(target_feature = "fma") && L::Scalar::UNIT_ROUNDOFF == B::UNIT_ROUNDOFF;
            let moved = |o: L, d: L| {
                if at_once {
                    d.cast::<B::Lane>().fused(start, o.cast())
                } else {
                    B::Lane::from_f64s(o.to_f64s() + d.to_f64s() * start.to_f64s())
                }
            };
            own = [moved(origin.x, dir.x), moved(origin.y, dir.y), moved(origin.z, dir.z)];
        }
        self.offset = [0, 1, 2].map(|axis| -(own[axis] * inverse[axis]));
        self.origin = own;
        self.inverse = inverse;
        self.start = start;
        // What is beyond all measure meets nothing: by NaN it would meet what is not there.
        let [x, y, z] = self.offset;
        let finite = (x + y + z).abs().lt(B::Lane::lit(f64::INFINITY));
        let meets = start.le(t_out * B::Lane::lit(1.0 + roundings)) & finite & Mask::from_bits(active);
        self.far = meets.select(self.far_of(t_far), B::Lane::lit(-1.0));
    }

    /// No rays.
    #[inline]
    pub fn idle() -> Self {
        let none = [B::Lane::zero(); 3];
        let (far, start) = (B::Lane::lit(-1.0), B::Lane::zero());
        Self { origin: none, inverse: none, offset: none, far, start, eye: none }
    }

    /// Rays `lanes` that look, for who asks no boxes.
    #[inline]
    pub fn looking(lanes: u8) -> Self {
        let idle = Self::idle();
        Self { far: Mask::from_bits(lanes).select(B::Lane::zero(), idle.far), ..idle }
    }

    /// A distance along the rays as this packet's boxes count it, rounded up.
    #[inline(always)]
    pub fn far_of<L: Lane>(&self, t: L) -> B::Lane {
        let t = t.cast::<B::Lane>();
        (t - self.start) + t * B::Lane::lit(DISTANCE_ROUNDINGS * B::UNIT_ROUNDOFF)
    }

    /// The same for one lane.
    #[inline(always)]
    pub fn far_of_lane(&self, t: f64, lane: usize) -> B {
        let roundings = DISTANCE_ROUNDINGS * B::UNIT_ROUNDOFF;
        B::from_f64((t - self.start.lanes()[lane].to_f64()) + t * roundings)
    }

    /// Rays `lanes` have found something at distance `t`: they look no farther, or, if anything will do, not at all.
    #[inline(always)]
    pub fn found<L: Lane>(&mut self, lanes: u8, t: L, any: bool) {
        let far = if any { B::Lane::lit(-1.0) } else { self.far_of(t) };
        self.far = Mask::from_bits(lanes).select(far, self.far);
    }

    /// The ray in a lane looks no farther than `far`: whether it did before. (A number is written where eight will be read, who then
    /// wait for it: not where nothing has changed.)
    #[inline(always)]
    pub(super) fn shorten(&mut self, lane: usize, far: B) -> bool {
        let shorter = far != self.far.lanes()[lane];
        if shorter {
            self.far.lanes_mut()[lane] = far;
        }
        shorter
    }

    /// Where the ray in a lane really starts.
    #[inline(always)]
    pub(super) fn eye_of(&self, lane: usize) -> DVec3 {
        DVec3::from_array(self.eye.map(|x| x.lanes()[lane].to_f64()))
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

    /// The octant of a lane: bit `axis` set where its direction is negative.
    pub(super) fn octant_of(&self, lane: usize) -> u8 {
        self.signs()
            .into_iter()
            .enumerate()
            .fold(0, |octant, (axis, signs)| octant | (signs >> lane & 1) << axis)
    }

    /// The live lanes that share the octant of the first live lane.
    pub(super) fn first_octant_lanes(&self, live: u8) -> u8 {
        let first = live.trailing_zeros();
        self.signs()
            .into_iter()
            .fold(live, |lanes, signs| lanes & if signs >> first & 1 == 1 { signs } else { !signs })
    }

    /// How far the live rays look, counted as `frame` has it; negative for others.
    #[inline(always)]
    pub(super) fn far_in(&self, frame: Frame) -> B::Lane {
        let live = self.far.ge(B::Lane::zero());
        match frame {
            Frame::Own => self.far,
            // The sum is rounded; what it is made of has been padded for more.
            Frame::Common => live.select(self.far + self.start, B::Lane::lit(-1.0)),
        }
    }

    /// The rays themselves as what is held against boxes.
    #[inline(always)]
    pub(super) fn units(&self, frame: Frame, octant: u8, pad: B) -> Units<B::Lane> {
        if frame == Frame::Own {
            let lines = [0, 1, 2].map(|axis| (self.inverse[axis], self.offset[axis]));
            return Units { soon: lines, late: lines };
        }
        let (inverse, origin) = (self.inverse, self.eye);
        let pad = B::Lane::splat(pad);
        let line = |axis: usize, late: bool| {
            let negative = octant >> axis & 1 == 1;
            let origin = if negative == late { origin[axis] + pad } else { origin[axis] - pad };
            (inverse[axis], -(origin * inverse[axis]))
        };
        Units { soon: [0, 1, 2].map(|axis| line(axis, false)), late: [0, 1, 2].map(|axis| line(axis, true)) }
    }
}

/// What boxes are held against: the rays of a packet, or packets by their bounds. By axis, the soonest and the latest crossing that a
/// unit has of a plane.
#[derive(Debug, Clone, Copy)]
pub(super) struct Units<M> {
    pub soon: [Crossing<M>; 3],
    pub late: [Crossing<M>; 3],
}

/// A plane's crossing is `plane * .0 + .1`.
pub(super) type Crossing<L> = (L, L);
