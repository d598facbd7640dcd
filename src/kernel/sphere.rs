//! Spheres: centre and radius. (An ellipsoid is another kind.)

use super::fours::{Four, Fours};
use super::{
    Aabb, Block, Left, Looking, Ray, Rays, Solid, Surfaces, dot_four, first_beyond, less_four, next_to,
    one_row, typical,
};
use crate::lane::{LANES, Lane, Mask, Quad, Scalar, Vec3};
use glam::DVec3;

/// `n` spheres (`radius` at least 0): columns `center` (3) and `radius`, all in scene units.
///
/// In single precision four of them are a cache line.
#[derive(Debug, Clone, Default)]
pub struct Spheres<S> {
    rows: Fours<S, 4>,
}

impl<S: Scalar> Spheres<S> {
    /// Adds a row, rounded to the columns' precision.
    pub fn push(&mut self, center: DVec3, radius: f64) {
        self.rows.push([center.x, center.y, center.z, radius].map(S::from_f64));
    }

    /// Centres and radii of rows `index`.
    #[inline(always)]
    fn gathered(&self, index: &[u32; LANES]) -> (Vec3<S::Lane>, S::Lane) {
        let [x, y, z, radius] = if let Some(row) = one_row(index) {
            self.rows.row(row).map(S::Lane::splat)
        } else {
            [0, 1, 2, 3].map(|k| self.rows.gather(k, index))
        };
        (Vec3::new(x, y, z), radius)
    }
}

/// Where rays cross a sphere.
///
/// Takes the discriminant at the ray's closest point to the centre, so a small or far sphere does not cancel
/// (Haines, Günther, Akenine-Möller, Ray Tracing Gems, ch. 7), and the roots as `c/q` and `q/a`. Relative error
/// of `t` about 4 roundings, more near the silhouette.
#[inline(always)]
fn crossings<L: Lane>(center: Vec3<L>, radius: L, rays: &Rays<L>, left: Option<&Left<L>>) -> [L; 2] {
    let f = center - rays.origin;
    let b = f.dot(rays.dir);
    // l is the perpendicular from the centre to the ray.
    let l = f - rays.dir * b;
    // NaN on a miss, and so are both roots. A sphere of radius 0 is touched at most, by luck of rounding.
    let square = radius * radius - l.dot(l);
    if left.is_none() && !square.ge(L::zero()).any() {
        return [L::lit(f64::NAN); 2];
    }
    let half_chord = square.sqrt();
    let mut q = b + half_chord.copysign(b);
    let mut near = (f.dot(f) - radius * radius) / q;
    if let Some(left) = left {
        // The start lies on the sphere: one root is 0, the other is twice the way to the middle of the chord. It
        // is 0 too if the rounding of the start (4 units of its coordinates, 8 in the products and in the
        // normal that the caller compared with) hides on which side of the tangent the ray leaves.
        let reach = (rays.origin.abs() + center.abs()) * L::lit(4.0) + f.abs() * L::lit(8.0);
        let noise = reach.dot(rays.dir.abs()) * L::lit(L::Scalar::UNIT_ROUNDOFF);
        let chord = b.abs().gt(noise).keep(b + b);
        near = left.on.select(L::zero(), near);
        q = left.on.select(chord, q);
    }
    // Where q = 0 (a ray that starts on the sphere, tangent to it) `near` may be 0/0; then both are q.
    [near.min(q), near.max(q)]
}

/// [`crossings`] of one ray with four spheres: see [`Block::near_in_four`].
#[inline(always)]
fn near_crossings<S: Scalar>(four: &Four<S, 4>, ray: &Ray<S>, limits: (S, S), left: u8) -> (S::Quad, u8) {
    let [x, y, z, radius] = four.0.map(S::Quad::from_array);
    let f = less_four([x, y, z], ray.origin);
    let b = dot_four(f, ray.dir);
    if !goes_away(b, left) {
        return near_crossings_from_within(four, (ray.origin, ray.dir), limits, left);
    }
    let l = less_four(f, ray.dir.map(|d| d * b));
    let square = radius * radius - dot_four(l, l);
    if S::Quad::default().le(square).bits() & !left == 0 {
        return (S::Quad::default(), 0);
    }
    let (t, near) = nearest_root((f, b, radius, square), limits, |roots| roots);
    (t, near & !left)
}

/// The same of a ray that starts on one of the spheres, `left`, and goes on through it. (A call, which is handed copies: inlined, the
/// compiler makes what does not change ready for it before the loop over rows, and a ray that is lent is kept in memory.)
#[inline(never)]
fn near_crossings_from_within<S: Scalar>(
    four: &Four<S, 4>,
    (origin, dir): ([S::Quad; 3], [S::Quad; 3]),
    limits: (S, S),
    left: u8,
) -> (S::Quad, u8) {
    let [x, y, z, radius] = four.0.map(S::Quad::from_array);
    let center = [x, y, z];
    let f = less_four(center, origin);
    let b = dot_four(f, dir);
    let l = less_four(f, dir.map(|d| d * b));
    let square = radius * radius - dot_four(l, l);
    nearest_root((f, b, radius, square), limits, |[near, q]| {
        // As in `crossings`.
        let sum = |a: S::Quad, b: S::Quad| a.abs() + b.abs();
        let reach =
            [0, 1, 2].map(|k| sum(origin[k], center[k]) * S::Quad::lit(4.0) + f[k].abs() * S::Quad::lit(8.0));
        let noise = dot_four(reach, dir.map(S::Quad::abs)) * S::Quad::lit(S::UNIT_ROUNDOFF);
        let chord = b.abs().gt(noise) & (b + b);
        let on = S::Quad::from_array([0, 1, 2, 3].map(|k| S::from_f64(f64::from(left >> k & 1))));
        let on = on.gt(S::Quad::default());
        [on.choose(S::Quad::default(), near), on.choose(chord, q)]
    })
}

/// The first of two roots, as `known` has them, beyond the first limit; and the lanes where it is not beyond the second.
#[inline(always)]
fn nearest_root<S: Scalar>(
    (f, b, radius, square): ([S::Quad; 3], S::Quad, S::Quad, S::Quad),
    (t_min, t_max): (S, S),
    known: impl FnOnce([S::Quad; 2]) -> [S::Quad; 2],
) -> (S::Quad, u8) {
    let half_chord = square.sqrt();
    let q = b + half_chord.copysign(b);
    let [near, q] = known([(dot_four(f, f) - radius * radius) / q, q]);
    let (t_min, t_max) = (S::Quad::splat(t_min), S::Quad::splat(t_max));
    let (first, last) = (near.min(q), near.max(q));
    let t = first.gt(t_min).choose(first, last);
    (t, (t.gt(t_min) & t.le(t_max)).bits())
}

/// True if a ray does not come back to the spheres of `left`, which it starts on: their middles, `b` ahead, are not before it.
#[inline(always)]
fn goes_away<Q: Quad>(b: Q, left: u8) -> bool {
    left == 0 || b.gt(Q::default()).bits() & left == 0
}

/// What [`Block::first`] has of rays that ask for any crossing, if that can be told of all of them without roots.
#[inline(always)]
fn any_crossing<L: Lane>(
    center: Vec3<L>,
    radius: L,
    rays: &Rays<L>,
    &Looking { from, to, lanes, .. }: &Looking<L>,
) -> Option<L> {
    // As `crossings`.
    let f = center - rays.origin;
    let b = f.dot(rays.dir);
    let l = f - rays.dir * b;
    let none = L::lit(f64::NAN);
    let met = (radius * radius - l.dot(l)).ge(L::zero()).bits() & lanes;
    if met == 0 {
        return Some(none);
    }
    // The first crossing is at `(f^2 - r^2) / q`, where `q` is between `b` and `2 |f|`.
    let square = f.dot(f);
    let outside = square - radius * radius;
    let beyond = (outside * outside.abs()).gt(square * (from * from * L::lit(4.0 * ROOM)));
    let before = (b * to).gt(outside * L::lit(ROOM));
    let sure = beyond & before & Mask::from_bits(met);
    // It is before the middle of the chord.
    let place = b.lt(to).select(b, (from + to) * L::lit(0.5));
    (sure.bits() == met).then(|| sure.select(place, none))
}

/// See [`Block::told_in_four`].
#[inline(always)]
fn told<S: Scalar>(
    four: &Four<S, 4>,
    ray: &Ray<S>,
    (t_min, t_max): (S, S),
    (rows, left): (u8, u8),
) -> Option<bool> {
    let [x, y, z, radius] = four.0.map(S::Quad::from_array);
    // As `near_crossings`.
    let f = less_four([x, y, z], ray.origin);
    let b = dot_four(f, ray.dir);
    let l = less_four(f, ray.dir.map(|d| d * b));
    let met = S::Quad::default().le(radius * radius - dot_four(l, l)).bits() & rows;
    if met & !left == 0 && goes_away(b, left & rows) {
        return Some(false);
    }
    // The first crossing is at `(f^2 - r^2) / q`, where `q` is between `b` and `2 |f|`.
    let square = dot_four(f, f);
    let outside = square - radius * radius;
    let [t_min, t_max] = [t_min, t_max].map(S::Quad::splat);
    let beyond = (outside * outside.abs()).gt(square * (t_min * t_min * S::Quad::lit(4.0 * ROOM)));
    let before = (b * t_max).gt(outside * S::Quad::lit(ROOM));
    if met & !left & (beyond & before).bits() != 0 { Some(true) } else { None }
}

/// What spheres are like at `t` along rays.
#[inline(always)]
fn surfaces<L: Lane>((center, radius): (Vec3<L>, L), rays: &Rays<L>, t: L) -> Surfaces<L> {
    let normal = ((rays.origin - center) + rays.dir * t).normalize();
    Surfaces { point: center + normal * radius, normal, ..Default::default() }
}

/// More than the roundings of what is compared, as a factor.
const ROOM: f64 = 1.0 + 1.0 / 65536.0;

impl<S: Scalar> Block<S> for Spheres<S> {
    const SHORT: bool = true;
    type Roots = [S::Lane; 2];

    fn len(&self) -> usize {
        self.rows.len()
    }

    fn row_bytes(&self) -> usize {
        self.rows.row_bytes()
    }

    #[inline(always)]
    fn roots(&self, i: usize, rays: &Rays<S::Lane>, left: Option<&Left<S::Lane>>) -> [S::Lane; 2] {
        let [x, y, z, radius] = self.rows.row(i).map(S::Lane::splat);
        crossings(Vec3::new(x, y, z), radius, rays, left)
    }

    #[inline(always)]
    fn first(
        &self,
        i: usize,
        rays: &Rays<S::Lane>,
        left: Option<&Left<S::Lane>>,
        looking: &Looking<S::Lane>,
    ) -> S::Lane {
        let [x, y, z, radius] = self.rows.row(i).map(S::Lane::splat);
        let center = Vec3::new(x, y, z);
        if looking.any
            && left.is_none()
            && let Some(t) = any_crossing(center, radius, rays, looking)
        {
            return t;
        }
        first_beyond(crossings(center, radius, rays, left).into_iter(), looking.from)
    }

    /// What goes away from the middle.
    #[inline(always)]
    fn left_behind(&self, i: usize, rays: &Rays<S::Lane>, left: &Left<S::Lane>) -> u8 {
        let [x, y, z, _] = self.rows.row(i).map(S::Lane::splat);
        // As `crossings`, where the other root is then 0 or behind the start.
        let b = (Vec3::new(x, y, z) - rays.origin).dot(rays.dir);
        left.on.bits() & !b.gt(S::Lane::zero()).bits()
    }

    const ACROSS: bool = true;

    #[inline(always)]
    fn near_in_four(&self, four: usize, ray: &Ray<S>, limits: (S, S), left: u8) -> (S::Quad, u8) {
        near_crossings(self.rows.four(four), ray, limits, left)
    }

    #[inline(always)]
    fn told_in_four(&self, four: usize, ray: &Ray<S>, limits: (S, S), rows: (u8, u8)) -> Option<bool> {
        told(self.rows.four(four), ray, limits, rows)
    }

    fn blurred(&self) -> f64 {
        // From 1/300 of the radius on, if the ray comes from straight above.
        typical(self.rows.len(), |i| self.rows.row(i)[3].to_f64()) / 16.0
    }

    fn sharpened(&self, i: usize, origin: DVec3, dir: DVec3, t: f64) -> f64 {
        // As `crossings`.
        let [x, y, z, radius] = self.rows.row(i).map(S::to_f64);
        let f = DVec3::new(x, y, z) - origin;
        let b = f.dot(dir);
        let square = radius * radius - (f - dir * b).length_squared();
        let q = b + square.sqrt().copysign(b);
        let near = (f.dot(f) - radius * radius) / q;
        if (near - t).abs() < (q - t).abs() { near } else { q }
    }

    fn resolve(
        &self,
        index: &[u32; LANES],
        _active: Mask<S::Lane>,
        rays: &Rays<S::Lane>,
        t: S::Lane,
    ) -> Surfaces<S::Lane> {
        surfaces(self.gathered(index), rays, t)
    }

    #[inline(always)]
    fn resolve_next_to(
        &self,
        index: &[u32; LANES],
        loose: Mask<S::Lane>,
        rays: &Rays<S::Lane>,
        t: S::Lane,
        kept: impl Fn(S::Lane) -> S::Lane,
    ) -> (S::Lane, Surfaces<S::Lane>) {
        let (center, radius) = self.gathered(index);
        let t = loose.select(kept(next_to(&crossings(center, radius, rays, None), t)), t);
        (t, surfaces((center, radius), rays, t))
    }

    fn solid(&self, i: usize) -> Option<Solid> {
        let [x, y, z, radius] = self.rows.row(i).map(S::to_f64);
        Some(Solid::Ball { center: DVec3::new(x, y, z), radius })
    }

    /// From the rounded columns, grown by the roundings of the sums here.
    fn bounds(&self, i: usize) -> Aabb {
        let [x, y, z, radius] = self.rows.row(i).map(S::to_f64);
        let (center, radius) = (DVec3::new(x, y, z), DVec3::splat(radius));
        Aabb { min: center - radius, max: center + radius }.inflated(2.0 * f64::UNIT_ROUNDOFF)
    }

    fn permute(&mut self, order: &[u32]) {
        self.rows = self.rows.permuted(order);
    }
}
