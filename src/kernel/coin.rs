//! A torus in single precision: whether rays surely miss it, surely meet it, or leave it for good.
//!
//! Of packets that go on to double precision nine in ten have roots to be found there (the bench's frame of tori).

use super::quartic::{low_place, stays_above, stays_above_ahead};
use super::{Rays, Screened};
use crate::lane::{Lane, Mask, Scalar, Vec3, f32x8};
use crate::scene::Transform;
use glam::DMat3;

/// A torus in single precision, by its bounds: its bounding sphere between two planes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Coin {
    /// The map into own space.
    rows: [[f32; 3]; 3],
    pub(super) major: f32,
    pub(super) minor: f32,
    /// The map is so little stretched, and the middle so near, that single precision tells.
    pub(super) sound: bool,
    /// What a start and, by its length, a direction are off by together in own space, in roundings of whoever rounded them: at most what
    /// [`start_error`](super::frame::Frame::start_error) and [`direction_error`](super::frame::Frame::direction_error) make of these.
    blur: f32,
}

/// Maps stretched by more than this (Frobenius norms of map and inverse multiplied, 3 of one that is not stretched) are left to
/// double precision, and so are tori farther from the origin than [`FARTHEST`] times their size.
const STRETCH: f64 = 64.0;

/// See [`STRETCH`]. What double precision makes of a start is then off by less than 2^-24.
const FARTHEST: f64 = (1u64 << 24) as f64;

/// What a coin is wider by than the bounds in double precision, squared: [`ROOM`], and this share of the start's distance `M`,
/// squared. Places near the middle are off by up to `(6 STRETCH + 10) u M`; what is added is at least `0.7 sqrt(u) M`, seven
/// times as much.
const ROUNDINGS: f64 = 64.0 * f32::UNIT_ROUNDOFF;

/// Rays that leave the outer half of a torus by more than this (places and directions of length 1, in own space) leave it also in
/// double precision: several times what [`STRETCH`] makes of roundings.
const LEAVING: f64 = 1.0 / 8192.0;

/// Rays through the hole are told only where they start this far from the axis, leave by more than this, and keep the cubic of what is
/// ahead above this. Places and unit directions are off by `e = 5e-5` at most (see [`STRETCH`]), which makes up to [`OF_SLOPE`] times that
/// of the slope, and of the cubic up to [`OF_CUBIC`] times.
const HOLE: [f64; 3] = [0.25, 1.0 / 1024.0, 1.0 / 32.0];

/// What a place and a direction that are off by `e` make of a tube's slope: `e (1 + major / radius)`, and `e`, where the radius is
/// at least [`HOLE`]'s.
const OF_SLOPE: f64 = 6.0;

/// And of the cubic where it has its least: distances and coordinates are about 1, and that is at 3 or before.
const OF_CUBIC: f64 = 400.0;

/// See [`ROUNDINGS`].
const ROOM: f64 = 1.0 / 512.0;

/// What the quartic may be off by: as a share of the start's distance `M`, and besides. Places near the middle are off by up to
/// `(6 STRETCH + 10) u M`, from there on by `6 STRETCH u` within the unit sphere, where the quartic changes by 16 for each unit
/// of way: `3.8e-4 M + 3.7e-4`. Its own roundings are of some `1e-5`; the rest is room.
const OFF: [f64; 2] = [1.0 / 1024.0, 1.0 / 512.0];

/// What is told to be within the tube is so far from both ends of a ray, in sizes of the torus.
const CLEAR: f64 = 1.0 / 256.0;

impl Coin {
    pub(super) fn new(world_from_object: &Transform, major: f64, minor: f64) -> Self {
        let size = major + minor;
        let map = world_from_object.inverse.matrix3 * (1.0 / size);
        let norm = |m: DMat3| (0..3).map(|k| m.row(k).length_squared()).sum::<f64>().sqrt();
        let stretch = norm(map) * norm(world_from_object.forward.matrix3 * size);
        let distance = norm(map) * world_from_object.forward.translation.length();
        Self {
            // As in own space: the object's y and z change places.
            rows: [0, 2, 1].map(|k| map.row(k).to_array().map(|x| x as f32)),
            major: (major / size) as f32,
            minor: (minor / size) as f32,
            sound: stretch <= STRETCH && distance <= FARTHEST,
            blur: (8.0 * distance + 12.0 * stretch) as f32,
        }
    }

    /// Rays in own space that are given from the middle.
    #[inline(always)]
    pub(super) fn own<L: Lane>(&self, rays: &Rays<L>, middle: Vec3<L>) -> Rays<f32x8> {
        let rows = self.rows.map(Vec3::<f32x8>::broadcast);
        let (origin, dir) = ((rays.origin - middle).cast::<f32x8>(), rays.dir.cast::<f32x8>());
        Rays { origin: origin.fused_under(&rows), dir: dir.fused_under(&rows) }
    }

    /// Lanes of `on`, which start on it, that leave it for good: from the outer half, which is on the convex hull, or through the
    /// hole and past all of the tube. Rays were rounded with `roundoff` before they came here; `above` is what the tube's cubic must stay
    /// above in double precision.
    #[inline(always)]
    pub(super) fn leaves(&self, own: &Rays<f32x8>, on: u8, (roundoff, above): (f64, f64)) -> u8 {
        // (What leaves by less than this, the crossings may have turn back.)
        let blur = f32x8::splat(self.blur * roundoff as f32);
        let Rays { origin: o, dir: d } = *own;
        let radius = o.x.fused(o.x, o.y * o.y).sqrt();
        let (off, length) = (radius - f32x8::splat(self.major), d.fused_dot(d).sqrt());
        let sideways = o.x.fused(d.x, o.y * d.y);
        let slope = off * sideways / radius + o.z * d.z;
        let room = blur.fused(f32x8::lit(OF_SLOPE), f32x8::lit(LEAVING));
        let outer = (off.gt(room) & slope.gt(length * room)).bits() & on;
        if outer == on {
            return outer;
        }
        // As [`super::torus`] has the cubic that remains of the quartic at a start.
        let [farther, steeper, higher] = HOLE;
        let inv = f32x8::lit(1.0) / length;
        let four_rr = f32x8::splat(self.major * self.major * 4.0);
        let (b, across) = (o.fused_dot(d) * inv, d.x.fused(d.x, d.y * d.y) * inv * inv);
        let (b4, k) = (b * f32x8::lit(4.0), o.fused_dot(o) + f32x8::splat(self.major - self.minor));
        let c = b.fused(b4, k + k) - four_rr * across;
        let d = b4 * k - (four_rr + four_rr) * sideways * inv;
        let hole = radius.gt(f32x8::lit(farther))
            & slope.gt(length * blur.fused(f32x8::lit(OF_SLOPE), f32x8::lit(steeper)))
            & stays_above_ahead(b4, c, d, blur.fused(f32x8::lit(OF_CUBIC), f32x8::lit(above + higher)));
        outer | hole.bits() & on
    }

    /// Those of `lanes` that may meet it between two distances. With `any`, those that surely do are left out, and where they are
    /// within the tube is told beside. Whoever has the quartic above `above` misses in double precision.
    #[inline(always)]
    pub(super) fn look(
        &self,
        own: &Rays<f32x8>,
        [from, to]: [f32x8; 2],
        lanes: Mask<f32x8>,
        (any, above): (bool, f64),
    ) -> Screened {
        let Rays { origin: o, dir: d } = *own;
        let inv = f32x8::lit(1.0) / d.fused_dot(d);
        let closest = -o.fused_dot(d) * inv;
        let near = d.fused(closest, o);
        let (distance, square) = (o.fused_dot(o), near.fused_dot(near)); // squared, of start and closest point
        let room = distance.fused(f32x8::lit(ROUNDINGS), f32x8::lit(ROOM));
        let half_chord = ((f32x8::lit(BOUND) + room - square) * inv).sqrt(); // NaN beyond the sphere
        let reach = near.z.abs() - d.z.abs() * half_chord;
        let mut may_meet = lanes
            & reach.le(f32x8::splat(self.minor) + room)
            & (closest + half_chord).ge(from)
            & (closest - half_chord).le(to);
        let mut met_at = f32x8::lit(f64::NAN);
        if may_meet.none() {
            return Screened { may_meet, met_at };
        }
        // As [`super::torus`] has the quartic, along the ray from its closest point, by length.
        let four_rr = f32x8::splat(self.major * self.major * 4.0);
        let [across, radius] = [&d, &near].map(|v| v.x.fused(v.x, v.y * v.y));
        let k = square + f32x8::splat(self.major - self.minor);
        let p = k + k - four_rr * across * inv;
        let inv_length = inv.sqrt();
        let q = (four_rr + four_rr) * near.z * d.z * inv_length;
        let c = k * k - four_rr * radius;
        let off = distance.sqrt().fused(f32x8::lit(OFF[0]), f32x8::lit(OFF[1]));
        if any {
            // Most of what is met at all is met deep within the tube.
            let value = |s: f32x8| s.fused(s, p).fused(s, q).fused(s, c);
            let (low, length) = (low_place(p, q), f32x8::lit(1.0) / inv_length);
            let [start, end] = [from, to].map(|t| (t - closest) * length);
            let room = f32x8::lit(CLEAR);
            let between = low.ge(start + room) & low.le(end - room);
            let met = may_meet & between & value(low).le(-off) & value(start).ge(off);
            met_at = met.select(low.fused(inv_length, closest), met_at);
            may_meet &= !met;
        }
        may_meet &= !stays_above(p, q * q, c, off + f32x8::lit(above));
        Screened { may_meet, met_at }
    }
}

/// A ray is culled if it stays farther from the middle than this, squared, or from the torus' plane than `minor` and
/// this less 1: enough above 1 that a ray through a tangent point, which is a root on the bounding sphere, is not
/// lost to rounding. It costs time only.
pub(super) const BOUND: f64 = 1.0 + 1.0 / 1024.0;
