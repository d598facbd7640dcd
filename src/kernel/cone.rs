//! Cylinders and cones, closed by their ends or open.

use super::frame::{Frame, Frames};
use super::slab::{interval, slab, slab_left};
use super::{Aabb, Block, Left, Rays, Solid, Surfaces, gather, next_to, permuted};
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3};
use crate::scene::Transform;
use glam::{DAffine3, DMat3, DVec3};

/// `n` cones or cylinders, each by a frame and a column `taper`.
///
/// In own space the axis is z from 0 to 1, the radius is 1 at z = 0 and falls by `taper` (0 to 1) to the other end:
/// 0 is a cylinder, 1 ends in a point. Parts are 0 side, 1 wider end, 2 narrower end.
///
/// With `TAPERED` off the taper is taken to be 0, which saves a cylinder a quarter of the work. With `OPEN` on, the
/// surface is the side only; the inside is that of the closed shape.
#[derive(Debug, Clone, Default)]
pub struct Cones<S, const TAPERED: bool, const OPEN: bool> {
    frames: Frames<S>,
    taper: Vec<S>,
}

/// Cylinders with their ends.
pub type Cylinders<S> = Cones<S, false, false>;
/// Cylinders without ends.
pub type OpenCylinders<S> = Cones<S, false, true>;
/// Cones with their ends.
pub type ClosedCones<S> = Cones<S, true, false>;
/// Cones without ends.
pub type OpenCones<S> = Cones<S, true, true>;

const SIDE: u8 = 0;
const WIDE_END: u8 = 1;
const NARROW_END: u8 = 2;

/// Directions closer to the cone's own slope than this share of their length (squared) take the roots as `c/q` and
/// `q/a`, which a vanishing `a` does not hurt; for the others the symmetric form is better near the silhouette.
/// Any value between 1/2 and the square root of a rounding would do.
const ALONG_SIDE: f64 = 1.0 / 16.0;

/// Where a ray is within the endless cone, and between the planes of the ends.
#[derive(Debug, Clone, Copy)]
struct Spans<L> {
    /// Within the side; NaN where the ray misses it, infinite where it runs on in the cone.
    side: [L; 2],
    /// Between the ends; NaN where the ray runs in the plane of one, in reverse order where it is outside of both.
    ends: [L; 2],
}

impl<L: Lane> Spans<L> {
    /// In and out of the solid.
    #[inline(always)]
    fn solid(&self, own: &Rays<L>) -> [L; 2] {
        // The operand order lets a NaN of the ends lose and a NaN of the side win.
        interval(self.ends[0].max(self.side[0]), self.ends[1].min(self.side[1]), own)
    }

    /// Crossings of the side between the ends, rims included.
    #[inline(always)]
    fn open(&self) -> [L; 2] {
        let none = L::lit(f64::NAN);
        let [enter, leave] = self.ends;
        let valid = |t: L| {
            let finite = t.abs().lt(L::lit(f64::INFINITY));
            (finite & !enter.gt(t) & !leave.lt(t)).select(t, none)
        };
        let [near, far] = self.side.map(valid);
        let none_near = !near.equal(near);
        [none_near.select(far, near), none_near.select(none, far)]
    }
}

/// A cone per lane, in its own space.
#[derive(Debug, Clone, Copy)]
struct Shape<L, const TAPERED: bool> {
    taper: L,
}

impl<L: Lane, const TAPERED: bool> Shape<L, TAPERED> {
    /// Radius at height `z`, also negative beyond the apex.
    #[inline(always)]
    fn radius(&self, z: L) -> L {
        if TAPERED { L::lit(1.0) - self.taper * z } else { L::lit(1.0) }
    }

    /// Change of the radius along a direction.
    #[inline(always)]
    fn slope(&self, dz: L) -> L {
        if TAPERED { -(self.taper * dz) } else { L::zero() }
    }

    /// Both spans.
    ///
    /// The polynomial is formed at the ray's closest point to the cone's middle, so that a far origin does not
    /// cancel, and its discriminant from cross products with the radius as third coordinate, so that a slim cone
    /// does not. Of the double cone only the half with positive radius counts: a ray steeper than the side crosses
    /// each half once and stays in the one it runs into.
    #[inline(always)]
    fn spans(&self, own: &Rays<L>) -> Spans<L> {
        let (o, d) = (own.origin, own.dir);
        let zero = L::zero();
        let one = L::lit(1.0);
        let dd = d.dot(d);
        let shift = -(o.x * d.x + o.y * d.y + (o.z - L::lit(0.5)) * d.z) / dd;
        let (x, y, z) = (o.x + d.x * shift, o.y + d.y * shift, o.z + d.z * shift);
        let (w, dw) = (self.radius(z), self.slope(d.z));
        let across = d.x * d.x + d.y * d.y;
        let twist = x * d.y - y * d.x;
        let (a, b, c, mut discriminant);
        if TAPERED {
            // Adding zero makes -0 into 0: with a = 0 the sign of q alone says where the infinite root lies.
            a = across - dw * dw + zero;
            b = x * d.x + y * d.y - w * dw;
            c = x * x + y * y - w * w;
            let (bend_x, bend_y) = (x * dw - w * d.x, y * dw - w * d.y);
            discriminant = bend_x * bend_x + bend_y * bend_y - twist * twist;
            // A direction inside the cone always crosses it twice; rounding must not deny that near the apex.
            discriminant = a.lt(zero).select(discriminant.max(zero), discriminant);
        } else {
            a = across;
            b = x * d.x + y * d.y;
            c = x * x + y * y - one;
            discriminant = across - twist * twist;
        }
        let root = discriminant.sqrt();
        let inv_a = one / a;
        let q = -(b + root.copysign(b));
        let (r1, r2) = (c / q, q * inv_a);
        let steep = a.ge(dd * L::lit(ALONG_SIDE));
        let mut low = steep.select((-b - root) * inv_a, r1.min(r2));
        let mut high = steep.select((root - b) * inv_a, r1.max(r2));
        if TAPERED {
            // Inside the slope: from the crossing of the right half on without end.
            let inside = a.lt(zero);
            let rising = dw.gt(zero);
            let inf = L::lit(f64::INFINITY);
            let (first, last) = (low, high);
            low = inside.select(rising.select(last, -inf), low);
            high = inside.select(rising.select(inf, first), high);
        } else {
            // Along the axis: all or nothing.
            let along = a.equal(zero);
            let within = c.le(zero);
            low = along.select(within.select(L::lit(f64::NEG_INFINITY), L::lit(f64::NAN)), low);
            high = along.select(within.select(L::lit(f64::INFINITY), L::lit(f64::NAN)), high);
        }
        let (enter, leave) = slab(zero, one, o.z, d.z);
        Spans { side: [low + shift, high + shift], ends: [enter, leave] }
    }

    /// The same for lanes that start on the part `left` names: there the crossing is exactly 0.
    #[cold]
    fn spans_left(&self, own: &Rays<L>, left: &Left<L>, frame: &Frame<L>, rays: &Rays<L>) -> Spans<L> {
        let mut spans = self.spans(own);
        let (o, d) = (own.origin, own.dir);
        let (zero, inf) = (L::zero(), L::lit(f64::INFINITY));
        let (w, dw) = (self.radius(o.z), self.slope(d.z));
        let a = d.x * d.x + d.y * d.y - dw * dw + zero;
        let b = o.x * d.x + o.y * d.y - w * dw;
        let (start, turn) = (frame.start_error(rays), frame.direction_error(rays));
        // First-order error of b from the start's and the direction's.
        let noise = (start.x * d.x.abs() + start.y * d.y.abs() + self.taper * start.z * dw.abs())
            + (turn.x * o.x.abs() + turn.y * o.y.abs() + self.taper * turn.z * w.abs());
        // Where rounding hides the side of the tangent on which the ray leaves, it touches at its start only.
        let other = b.abs().gt(noise).keep(-(b + b)) / a;
        let other = other.equal(other).select(other, zero);
        let inside = a.lt(zero);
        let rising = dw.gt(zero);
        let low = inside.select(rising.select(zero, -inf), other.min(zero));
        let high = inside.select(rising.select(inf, zero), other.max(zero));
        let on_side = left.on_part(SIDE);
        spans.side[0] = on_side.select(low, spans.side[0]);
        spans.side[1] = on_side.select(high, spans.side[1]);
        // The start lies on the closed solid, whatever rounding says, so it is within both spans.
        let on_end = left.on & !on_side;
        spans.side[0] = on_end.select(spans.side[0].min(zero), spans.side[0]);
        spans.side[1] = on_end.select(spans.side[1].max(zero), spans.side[1]);
        let (on_wide, on_narrow) = (left.on_part(WIDE_END), left.on_part(NARROW_END));
        spans.ends = slab_left([zero, L::lit(1.0)], o.z, d.z, turn.z, [on_wide, on_narrow], left.on);
        spans
    }
}

impl<S: Scalar, const TAPERED: bool, const OPEN: bool> Cones<S, TAPERED, OPEN> {
    /// Adds the image of a cone between two points with a radius at each. Neither end may have the other's place,
    /// and one radius must be over 0. Without `TAPERED` only the first radius counts.
    pub fn push(
        &mut self,
        world_from_object: &Transform,
        (base, base_radius): (DVec3, f64),
        (cap, cap_radius): (DVec3, f64),
    ) {
        let swap = TAPERED && cap_radius > base_radius;
        let (wide, radius, narrow, tip) =
            if swap { (cap, cap_radius, base, base_radius) } else { (base, base_radius, cap, cap_radius) };
        let axis = narrow - wide;
        let height = axis.length();
        let along = axis / height;
        let (u, v) = along.any_orthonormal_pair();
        let forward = DMat3::from_cols(u * radius, v * radius, axis);
        let inverse = DMat3::from_cols(u / radius, v / radius, along / height).transpose();
        let object_from_own = Transform {
            forward: DAffine3 { matrix3: forward, translation: wide },
            inverse: DAffine3 { matrix3: inverse, translation: -(inverse * wide) },
        };
        self.frames.push(&object_from_own.then(world_from_object));
        self.taper.push(S::from_f64(if TAPERED { (radius - tip) / radius } else { 0.0 }));
    }

    #[inline(always)]
    fn spans(
        &self,
        i: usize,
        rays: &Rays<S::Lane>,
        left: Option<&Left<S::Lane>>,
    ) -> (Spans<S::Lane>, Rays<S::Lane>) {
        let shape = Shape::<_, TAPERED> { taper: S::Lane::splat(self.taper[i]) };
        let own = self.frames.at(i).rays(rays);
        let spans = match left {
            None => shape.spans(&own),
            // (A frame that is handed on lies in memory: most rays are spared that.)
            Some(left) => shape.spans_left(&own, left, &self.frames.at(i), rays),
        };
        (spans, own)
    }
}

impl<S: Scalar, const TAPERED: bool, const OPEN: bool> Block<S> for Cones<S, TAPERED, OPEN> {
    const SKIN_IS_PARTIAL: bool = OPEN;
    type Roots = [S::Lane; 2];

    fn len(&self) -> usize {
        self.taper.len()
    }

    #[inline(always)]
    fn roots(&self, i: usize, rays: &Rays<S::Lane>, left: Option<&Left<S::Lane>>) -> [S::Lane; 2] {
        let (spans, own) = self.spans(i, rays, left);
        if OPEN { spans.open() } else { spans.solid(&own) }
    }

    /// Of the solid, ends included, also for the open kinds.
    #[inline(always)]
    fn boundary(&self, i: usize, rays: &Rays<S::Lane>, left: Option<&Left<S::Lane>>) -> [S::Lane; 2] {
        let (spans, own) = self.spans(i, rays, left);
        spans.solid(&own)
    }

    fn resolve(
        &self,
        index: &[u32; LANES],
        _active: Mask<S::Lane>,
        rays: &Rays<S::Lane>,
        t: S::Lane,
    ) -> Surfaces<S::Lane> {
        self.resolve_next_to(index, Mask::none_set(), rays, t, |t| t).1
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
        let frame = self.frames.gathered(index);
        let own = frame.rays(rays);
        let shape = Shape::<_, TAPERED> { taper: gather(&self.taper, index) };
        let spans = shape.spans(&own);
        let roots = if OPEN { spans.open() } else { spans.solid(&own) };
        let t = loose.select(kept(next_to(&roots, t)), t);
        let (zero, one) = (S::Lane::zero(), S::Lane::lit(1.0));
        let p = own.origin + own.dir * t;
        // The part is the one whose own crossing is nearest; at the rim the side wins.
        let gap = |span: [S::Lane; 2]| {
            (span[1] - t).abs().min((span[0] - t).abs().min(S::Lane::lit(f64::INFINITY)))
        };
        let on_end = if OPEN { Mask::none_set() } else { gap(spans.ends).lt(gap(spans.side)) };
        let narrow = p.z.gt(S::Lane::lit(0.5));
        let z = on_end.select(narrow.keep(one), p.z.max(zero).min(one));
        let radius = shape.radius(z);
        let distance = (p.x * p.x + p.y * p.y).sqrt();
        // The axis has no direction outward; only the apex and broken hits lie on it.
        let inv = distance.gt(zero).keep(one / distance);
        let scale = on_end.select((radius * inv).min(one), radius * inv);
        let point = Vec3::new(p.x * scale, p.y * scale, z);
        let pointed = inv.equal(zero);
        let side = Vec3::new(p.x * inv, p.y * inv, pointed.select(one, shape.taper));
        let end = Vec3::new(zero, zero, narrow.select(one, -one));
        let part = super::slab::parts(on_end.keep(narrow.select(S::Lane::lit(2.0), one)));
        let (point, normal) =
            (self.frames.to_world(index, point), frame.normal(Vec3::select(on_end, end, side)));
        (t, Surfaces { point, normal, part, ..Default::default() })
    }

    fn solid(&self, i: usize) -> Option<Solid> {
        let space = self.frames.own_space(i);
        match (OPEN, TAPERED) {
            (true, _) => None,
            (false, false) => Some(Solid::Cylinder(space)),
            (false, true) => Some(Solid::Cone { space, taper: self.taper[i].to_f64() }),
        }
    }

    /// Around the two ends.
    fn bounds(&self, i: usize) -> Aabb {
        let tip = if TAPERED { 1.0 - self.taper[i].to_f64() } else { 1.0 };
        self.frames.disc_bounds(i, 0.0, 1.0).union(self.frames.disc_bounds(i, 1.0, tip))
    }

    fn permute(&mut self, order: &[u32]) {
        self.frames.permute(order);
        self.taper = permuted(&self.taper, order);
    }
}
