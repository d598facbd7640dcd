//! Rays against the three slabs of a box: what axis-parallel and turned boxes share.

use super::{Left, Rays};
use crate::lane::{LANES, Lane, Mask, Vec3, f32x8};

/// A closed box per lane, in the space of the rays.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slabs<L> {
    /// Lowest corner.
    pub min: Vec3<L>,
    /// Highest corner; `min = max` in an axis is a flat box, with both faces.
    pub max: Vec3<L>,
}

/// Where a ray comes in and goes out along one axis.
///
/// A ray within the plane of a face, parallel to the axis' slab, gives NaN there (0 times infinity); the callers
/// order their operands so that NaN loses, which makes the slab closed. A component -0 counts as +0.
#[inline(always)]
pub(super) fn slab<L: Lane>(min: L, max: L, origin: L, dir: L) -> (L, L) {
    let inv = L::lit(1.0) / (dir + L::zero());
    let (low, high) = ((min - origin) * inv, (max - origin) * inv);
    let backward = inv.lt(L::zero());
    (backward.select(high, low), backward.select(low, high))
}

/// [`slab`] for lanes that start on a solid within it: the lanes `on_face` start on the low or the high face, where
/// `t` is then exactly 0; the lanes `on` start somewhere in the closed slab, whatever rounding says.
///
/// `noise` bounds the rounding of `dir`: a ray closer to the plane of its face than that touches the slab at its
/// start only.
pub(super) fn slab_left<L: Lane>(
    [min, max]: [L; 2],
    origin: L,
    dir: L,
    noise: L,
    on_face: [Mask<L>; 2],
    on: Mask<L>,
) -> [L; 2] {
    let zero = L::zero();
    let [low, high] = on_face;
    let origin = low.select(min, high.select(max, origin));
    let (enter, leave) = slab(min, max, origin, dir);
    let sliding = (low | high) & dir.abs().le(noise);
    let (enter, leave) = (on.select(enter.min(zero), enter), on.select(leave.max(zero), leave));
    [sliding.select(zero, enter), sliding.select(zero, leave)]
}

/// Where a convex body is entered and left, NaN where the interval is empty or the ray is not one (a NaN or
/// infinity in it).
#[inline(always)]
pub(super) fn interval<L: Lane>(near: L, far: L, rays: &Rays<L>) -> [L; 2] {
    let Rays { origin: o, dir: d } = rays;
    // 0 for every ray of numbers, else NaN: intervals that let NaN lose would take a broken ray for a hit.
    let poison = (((o.x + o.y) + (o.z + d.x)) + (d.y + d.z)) * L::zero();
    let hit = near.le(far + poison);
    let none = L::lit(f64::NAN);
    [hit.select(near, none), hit.select(far, none)]
}

impl<L: Lane> Slabs<L> {
    /// Entry and exit, `[NaN, NaN]` on a miss; a ray that only touches an edge or a face gets the same `t` twice.
    ///
    /// Closed comparisons throughout. Relative error of each `t` 3 roundings (Williams et al., JGT 10(1), 2005, with
    /// near and far chosen by sign).
    #[inline(always)]
    pub fn crossings(&self, rays: &Rays<L>) -> [L; 2] {
        let (o, d) = (rays.origin, rays.dir);
        let (near_x, far_x) = slab(self.min.x, self.max.x, o.x, d.x);
        let (near_y, far_y) = slab(self.min.y, self.max.y, o.y, d.y);
        let (near_z, far_z) = slab(self.min.z, self.max.z, o.z, d.z);
        let inf = L::lit(f64::INFINITY);
        let near = near_z.max(near_y.max(near_x.max(-inf)));
        let far = far_z.min(far_y.min(far_x.min(inf)));
        interval(near, far, rays)
    }

    /// The same for lanes that start on face `left.part`: that crossing is exactly 0, and of the others only the
    /// one through the other faces remains.
    ///
    /// `noise` bounds the rounding of each component of `rays.dir`; a ray closer to its face's plane than that runs
    /// in it, and touches the box at its start only.
    #[cold]
    pub fn crossings_left(&self, rays: &Rays<L>, left: &Left<L>, noise: Vec3<L>) -> [L; 2] {
        let (mut near, mut far) = (L::lit(f64::NEG_INFINITY), L::lit(f64::INFINITY));
        let (min, max) = ([self.min.x, self.min.y, self.min.z], [self.max.x, self.max.y, self.max.z]);
        let (o, d) = ([rays.origin.x, rays.origin.y, rays.origin.z], [rays.dir.x, rays.dir.y, rays.dir.z]);
        let noise = [noise.x, noise.y, noise.z];
        for axis in 0..3 {
            let on_face = [left.on_part(2 * axis as u8), left.on_part(2 * axis as u8 + 1)];
            let [enter, leave] =
                slab_left([min[axis], max[axis]], o[axis], d[axis], noise[axis], on_face, left.on);
            near = enter.max(near);
            far = leave.min(far);
        }
        interval(near, far, rays)
    }

    /// The face, its outward normal and the point on it for hits at `t`. Parts are 0 to 5: -x, +x, -y, +y, -z, +z.
    ///
    /// The face is the one whose own `t` is nearest (equal, in fact, unless the ray left the box itself); at an
    /// edge the first axis wins, and on a flat box the face that the ray meets from outside.
    #[inline(always)]
    pub fn face(&self, rays: &Rays<L>, t: L) -> (Vec3<L>, Vec3<L>, [u8; LANES]) {
        let (o, d) = (rays.origin, rays.dir);
        let slabs = [
            slab(self.min.x, self.max.x, o.x, d.x),
            slab(self.min.y, self.max.y, o.y, d.y),
            slab(self.min.z, self.max.z, o.z, d.z),
        ];
        let dirs = [d.x, d.y, d.z];
        let mut gap = L::lit(f64::INFINITY);
        let mut part = L::zero();
        for entering in [true, false] {
            for (axis, (enter, leave)) in slabs.iter().enumerate() {
                let this = ((if entering { *enter } else { *leave }) - t).abs();
                let closer = this.lt(gap);
                gap = closer.select(this, gap);
                // Entering forward goes through the low face, leaving forward through the high one.
                let forward = dirs[axis].ge(L::zero());
                let low = L::lit(2.0 * axis as f64);
                let high = L::lit(2.0 * axis as f64 + 1.0);
                let face = if entering { forward.select(low, high) } else { forward.select(high, low) };
                part = closer.select(face, part);
            }
        }
        let p = o + d * t;
        let (mut point, mut normal) = (p, Vec3::default());
        for (k, (coordinate, unit, low, high)) in [
            (&mut point.x, &mut normal.x, self.min.x, self.max.x),
            (&mut point.y, &mut normal.y, self.min.y, self.max.y),
            (&mut point.z, &mut normal.z, self.min.z, self.max.z),
        ]
        .into_iter()
        .enumerate()
        {
            let on_low = part.equal(L::lit(2.0 * k as f64));
            let on_high = part.equal(L::lit(2.0 * k as f64 + 1.0));
            let within = coordinate.max(low).min(high);
            *coordinate = on_low.select(low, on_high.select(high, within));
            *unit = on_low.select(L::lit(-1.0), on_high.keep(L::lit(1.0)));
        }
        (point, normal, parts(part))
    }
}

/// Small whole numbers in lanes as part numbers.
#[inline(always)]
pub(super) fn parts<L: Lane>(part: L) -> [u8; LANES] {
    part.cast::<f32x8>().fast_trunc_int().to_array().map(|x| x as u8)
}
