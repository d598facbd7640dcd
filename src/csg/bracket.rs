//! Where rays are within a convex body, bracketed in single precision: by crossings of the body grown a little and
//! of the body shrunk a little.
//!
//! Rays come in by their points nearest to a middle, so that every coordinate is about the size of what is there; what
//! the shapes are grown and shrunk by is several times what rounding can move a ray or a shape by. So a place outside of
//! the grown body is outside, one within the shrunk body is inside, and the true crossings lie between the two.

use super::quadric::ConvexQuadric;
use super::single::{GROWTH, LEAST_SIZE, least, most, rising_roots, single};
use crate::kernel::{Aabb, OwnSpace, Rays, Solid};
use crate::lane::{Lane, Many, Mask, Scalar, Sixteen, Vec3, f32x8, f32x16, f64x8};
use glam::DVec3;

/// Directions whose share across a cylinder's axis is less (squared) run along it: on the way through they move by less than
/// a rounding.
const ALONG_AXIS: f64 = 1e-15;

/// Inverses of directions are no larger than this: a ray that runs along a slab to this share of its length is within or without it all
/// along, and infinity times nothing does not come up.
const STEEPEST: f64 = (1u64 << 60) as f64;

/// What the square of a place's distance from a cone's axis, less that of the radius there, may be off by, in own space: by the
/// equation's numbers some 60 roundings, by its roots 80.
const CONE_EQUATION: f64 = 256.0 * f32::UNIT_ROUNDOFF;

/// A ray whose share across a cone's side is less (squared) is taken to run by so much across: what single precision can tell.
const ALONG_SIDE: f64 = f32::UNIT_ROUNDOFF;

/// In place of the inverse of nothing: larger than any square that matters, and finite when multiplied with one.
const ENDLESS: f64 = 1e30;

/// The box around what must be asked for its crossings is wider by this share of the composite's size, which is much more than rounding
/// may take away.
const BOX_ROOM: f64 = 1.0 / 4096.0;

/// Crossings from single precision are compared to those from double with so much room, of the size of the composite.
pub(super) const PAD: f64 = 16.0 * f32::UNIT_ROUNDOFF;

/// Where rays come in and go out, those of two packets or, in eight lanes, of one. Where they do not, that is NaN, or they go out
/// before they come in.
#[derive(Debug, Clone, Copy, Default)]
pub struct Bracket<L = f32x16> {
    /// Of the grown body.
    pub(super) outer: [L; 2],
    /// Of the shrunk one.
    pub(super) inner: [L; 2],
}

/// A convex body in single precision, relative to a middle; of each pair the first is grown, the second shrunk.
#[derive(Debug, Clone, Copy)]
pub enum Body {
    /// Of a sphere centre and squares of the radius.
    Ball([f32; 3], [f32; 2]),
    /// The same in its own space.
    Ellipsoid(Map, [f32; 2]),
    /// Middle and half edges.
    Box([f32; 3], [[f32; 3]; 2]),
    /// Half edges, in its own space around its middle.
    OrientedBox(Map, [[f32; 3]; 2]),
    /// Squares of the radius, and how far it goes beyond its ends.
    Cylinder(Map, [f32; 2], [f32; 2]),
    /// What the radius falls by to the other end, the radius, and how far it goes beyond its ends.
    Cone(Map, f32, [f32; 2], [f32; 2]),
    /// Normal and distance from the middle.
    HalfSpace([f32; 3], [f32; 2]),
    /// Convex, with or without an end.
    Quadric(ConvexQuadric),
    /// Not known in single precision, but for a box around it, by middle and half edges: its crossings must be asked for.
    Asked([f32; 3], [f32; 3]),
    /// The same without a box, and which rays come from inside, as it may have no end.
    AskedWhole,
}

/// The way to a body's own space.
#[derive(Debug, Clone, Copy)]
pub struct Map {
    pub(super) center: [f32; 3],
    pub(super) rows: [[f32; 3]; 3],
}

impl Map {
    fn new(space: &OwnSpace, middle: DVec3) -> Self {
        Self { center: single(space.center - middle), rows: [0, 1, 2].map(|k| single(space.map.row(k))) }
    }

    #[inline(always)]
    fn rays(&self, rays: &Rays<f32x16>) -> Rays<f32x16> {
        let rows = self.rows.map(Vec3::broadcast);
        Rays { origin: self.places(rays.origin), dir: rays.dir.fused_under(&rows) }
    }

    #[inline(always)]
    pub(super) fn places(&self, places: Vec3<f32x16>) -> Vec3<f32x16> {
        (places - Vec3::broadcast(self.center)).fused_under(&self.rows.map(Vec3::broadcast))
    }
}

impl Bracket {
    /// From where `ends` says that the grown body (0) and the shrunk one (1) are.
    #[inline(always)]
    fn of_ends(ends: impl Fn(usize) -> [f32x16; 2]) -> Self {
        Self { outer: ends(0), inner: ends(1) }
    }

    /// Those of packets, by number.
    pub(super) fn of_packets(packets: [Bracket<f32x8>; 2]) -> Self {
        let of =
            |ends: fn(&Bracket<f32x8>) -> &[f32x8; 2]| [0, 1].map(|k| f32x16::of(|n| ends(&packets[n])[k]));
        Self { outer: of(|packet| &packet.outer), inner: of(|packet| &packet.inner) }
    }
}

impl Bracket<f32x8> {
    /// Of rays that miss it, or do not matter.
    pub(super) fn missed() -> Self {
        let none = [f64::INFINITY, f64::NEG_INFINITY].map(f32x8::lit);
        Self { outer: none, inner: none }
    }

    /// From crossings in double precision, `shift` further on than here, rising, NaN last; what has four is not convex, and
    /// all is in doubt from first to last.
    pub(super) fn of_crossings(crossings: &[f64x8], shift: f64x8, pad: f32x8) -> Self {
        let none = f64x8::lit(f64::NAN);
        let at = |k: usize| crossings.get(k).copied().unwrap_or(none);
        let mut last = at(1);
        for &t in crossings.iter().skip(2) {
            last = t.equal(t).select(t, last);
        }
        Self::between([at(0), last], at(2).equal(at(2)).cast(), shift, pad)
    }

    /// The same of what may have no end, with the lanes that come from inside and NaN anywhere: what those leave and come back to is
    /// not convex, and all along in doubt.
    pub(super) fn of_endless(crossings: &[f64x8], from_inside: u8, shift: f64x8, pad: f32x8) -> Self {
        let none = f64x8::lit(f64::NAN);
        let (mut first, mut last) = (none, none);
        let (mut once, mut twice, mut more) = (Mask::none_set(), Mask::none_set(), Mask::none_set());
        let mut goes_inside = Mask::from_bits(from_inside);
        for &t in crossings {
            let is_there = t.equal(t);
            goes_inside = goes_inside ^ is_there;
            (once, twice, more) = (once | is_there, twice | (once & is_there), more | (twice & is_there));
            first = (is_there & !twice).select(t, first);
            last = is_there.select(t, last);
        }
        let Self { outer: [a, d], inner: [b, c] } = Self::between([first, last], more.cast(), shift, pad);
        let (once, twice, inside) = (once.cast(), twice.cast(), Mask::from_bits(from_inside));
        let (leaves, again) = (once & !twice & inside, twice & inside);
        // (What three crossings lead into has no end, either.)
        let goes_inside = goes_inside.cast();
        let (stays, inf) = (goes_inside & !twice, f32x8::lit(f64::INFINITY));
        let outer = [inside.select(-inf, a), (goes_inside | again).select(inf, leaves.select(b, d))];
        let inner = [
            again.select(inf, inside.select(-inf, b)),
            again.select(-inf, stays.select(inf, leaves.select(a, c))),
        ];
        Self { outer, inner }
    }

    /// Between two distances, `shift` further on than here; all along in doubt where there are `more`.
    #[inline(always)]
    fn between(ends: [f64x8; 2], more: Mask<f32x8>, shift: f64x8, pad: f32x8) -> Self {
        let [enter, leave] = ends.map(|t| f32x8::from_f64s(t - shift));
        let (inf, room) = (f32x8::lit(f64::INFINITY), |t: f32x8| t.abs() * f32x8::lit(PAD) + pad);
        let outer = [enter - room(enter), leave + room(leave)];
        let inner = [more.select(inf, enter + room(enter)), more.select(-inf, leave - room(leave))];
        Self { outer, inner }
    }
}

impl Body {
    /// As rays see it that start within `size` of `middle`; as far as that matters, it is within `bounds` (finite).
    pub fn new(solid: &Solid, bounds: Aabb, middle: DVec3, size: f64) -> Self {
        // What it is grown by in its own space, if that is little beside `least`.
        let growth = |center: DVec3, scale: f64, least: f64| {
            let reach = (center - middle).abs().max_element() + size;
            let by = GROWTH * scale * reach;
            (by * LEAST_SIZE <= least && GROWTH * LEAST_SIZE * reach <= size).then_some(by)
        };
        let scale =
            |space: &OwnSpace| (0..3).map(|k| space.map.row(k).abs().element_sum()).fold(0.0, f64::max);
        let squares = |radius: f64, by: f64| [radius + by, radius - by].map(|r| (r * r) as f32);
        let halves = |half: DVec3, by: f64| [half + DVec3::splat(by), half - DVec3::splat(by)].map(single);
        let grown = match solid {
            Solid::Ball { center, radius } => growth(*center, 1.0, *radius)
                .map(|by| Self::Ball(single(*center - middle), squares(*radius, by))),
            Solid::Ellipsoid(space) => growth(space.center, scale(space), 1.0)
                .map(|by| Self::Ellipsoid(Map::new(space, middle), squares(1.0, by))),
            Solid::Box { min, max } => {
                let reach = (*min - middle).abs().max((*max - middle).abs()) + middle;
                let (center, half) = ((*min + *max) * 0.5 - middle, (*max - *min) * 0.5);
                growth(reach, 1.0, half.min_element()).map(|by| Self::Box(single(center), halves(half, by)))
            }
            Solid::OrientedBox(space, half) => {
                growth(space.center, scale(space), half.min_element()).map(|by| {
                    let by = by + half.max_element() * GROWTH;
                    Self::OrientedBox(Map::new(space, middle), halves(*half, by))
                })
            }
            Solid::Cylinder(space) => growth(space.center, scale(space), 1.0)
                .map(|by| Self::Cylinder(Map::new(space, middle), squares(1.0, by), [by as f32, -by as f32])),
            Solid::Cone { space, taper } => {
                let (scale, tip) = (scale(space), 1.0 - taper);
                growth(space.center, scale, 1.0).and_then(|by| {
                    // What the equation is off by moves the side most at the narrow end.
                    let side = by + CONE_EQUATION / (2.0 * tip);
                    (side * LEAST_SIZE <= tip).then(|| {
                        let radii = [1.0 + side, 1.0 - side].map(|r| r as f32);
                        Self::Cone(Map::new(space, middle), *taper as f32, radii, [by as f32, -by as f32])
                    })
                })
            }
            Solid::HalfSpace { normal, foot } => {
                let at = normal.dot(*foot - middle);
                let by = GROWTH * (at.abs() + size);
                Some(Self::HalfSpace(single(*normal), [(at + by) as f32, (at - by) as f32]))
            }
            Solid::Other => None,
            Solid::Quadric(space, quadric) => {
                let convex = ConvexQuadric::new(space, quadric, middle, size);
                Some(convex.map_or(Self::AskedWhole, Self::Quadric))
            }
            Solid::Endless => Some(Self::AskedWhole),
        };
        grown.unwrap_or_else(|| {
            let half = (bounds.max - bounds.min) * 0.5 + DVec3::splat(size * BOX_ROOM);
            Self::Asked(single(bounds.center() - middle), single(half))
        })
    }

    /// Says where it is along rays; false if its crossings must be asked for. (One function for all who want to know: the kinds come in any
    /// order, and so do those who ask, who share what the machine has learned of them, and the room of the code.)
    #[inline(never)]
    pub(super) fn bracket(&self, rays: &Rays<f32x16>, bracket: &mut Bracket) -> bool {
        let Rays { origin, dir } = *rays;
        *bracket = match self {
            Self::Ball(center, squares) => {
                let toward = Vec3::broadcast(*center) - origin;
                let middle = toward.fused_dot(dir);
                let across = dir.fused(-middle, toward);
                let square = across.fused_dot(across);
                Bracket::of_ends(|k| chord(middle, f32x16::splat(squares[k]) - square))
            }
            Self::Ellipsoid(map, squares) => {
                let own = map.rays(rays);
                let inv = f32x16::constant(1.0) / own.dir.fused_dot(own.dir);
                let middle = -own.origin.fused_dot(own.dir) * inv;
                let across = own.dir.fused(middle, own.origin);
                let square = across.fused_dot(across);
                Bracket::of_ends(|k| chord(middle, (f32x16::splat(squares[k]) - square) * inv))
            }
            Self::Box(center, halves) => {
                Bracket::of_ends(slabs(Vec3::broadcast(*center) - origin, dir, halves))
            }
            Self::OrientedBox(map, halves) => {
                let own = map.rays(rays);
                Bracket::of_ends(slabs(-own.origin, own.dir, halves))
            }
            Self::Cylinder(map, squares, ends) => Bracket::of_ends(cylinder(&map.rays(rays), squares, ends)),
            Self::Cone(map, taper, radii, ends) => {
                Bracket::of_ends(cone(&map.rays(rays), *taper, radii, ends))
            }
            Self::HalfSpace(normal, ats) => {
                let (normal, zero, inf) =
                    (Vec3::broadcast(*normal), f32x16::default(), f32x16::constant(f64::INFINITY));
                let (start, climb) = (normal.fused_dot(origin), normal.fused_dot(dir) + zero);
                let down = climb.lt(zero);
                let ends = |k: usize| {
                    let t = (f32x16::splat(ats[k]) - start) / climb;
                    [down.select(t, -inf), down.select(inf, t)]
                };
                Bracket::of_ends(ends)
            }
            Self::Quadric(quadric) => Bracket::of_ends(quadric.ends(rays)),
            Self::Asked(..) | Self::AskedWhole => return false,
        };
        true
    }

    /// Those of `lanes` that may meet what must be asked for its crossings between two distances.
    #[inline(always)]
    pub(super) fn may_meet(&self, rays: &Rays<f32x16>, [from, to]: [f32x16; 2], lanes: u16) -> u16 {
        let Self::Asked(center, half) = self else { return lanes };
        let [enter, leave] = slabs(Vec3::broadcast(*center) - rays.origin, rays.dir, &[*half; 2])(0);
        lanes & most(enter, from).le(least(leave, to)).bits()
    }
}

/// Around the middle of a chord whose half has this square.
#[inline(always)]
fn chord(middle: f32x16, square: f32x16) -> [f32x16; 2] {
    let half = square.sqrt();
    [middle - half, middle + half]
}

/// Between the slabs of a box, `toward` its middle, by its half edges.
#[inline(always)]
fn slabs(toward: Vec3<f32x16>, dir: Vec3<f32x16>, halves: &[[f32; 3]; 2]) -> impl Fn(usize) -> [f32x16; 2] {
    let steepest = f32x16::constant(STEEPEST);
    let inv = dir.map(|d| most(least(f32x16::constant(1.0) / d, steepest), -steepest));
    let (middle, inv) = (toward.mul(inv), inv.map(f32x16::abs));
    move |k| {
        let half = Vec3::<f32x16>::broadcast(halves[k]);
        let end = |half: f32x16, inv: f32x16, middle: f32x16| {
            [(-half).times_plus(inv, middle), half.times_plus(inv, middle)]
        };
        let x = end(half.x, inv.x, middle.x);
        let y = end(half.y, inv.y, middle.y);
        let z = end(half.z, inv.z, middle.z);
        [most(most(x[0], y[0]), z[0]), least(least(x[1], y[1]), z[1])]
    }
}

/// Within a cylinder, in its own space.
#[inline(always)]
fn cylinder(own: &Rays<f32x16>, squares: &[f32; 2], ends: &[f32; 2]) -> impl Fn(usize) -> [f32x16; 2] {
    let Rays { origin: o, dir: d } = *own;
    let flat = d.x.times_plus(d.x, d.y * d.y);
    let slanted = (d.fused_dot(d) * f32x16::constant(ALONG_AXIS)).lt(flat);
    let inv = slanted.select(f32x16::constant(1.0) / flat, f32x16::constant(ENDLESS));
    let middle = slanted.keep(-o.x.times_plus(d.x, o.y * d.y) * inv);
    let (x, y) = (d.x.times_plus(middle, o.x), d.y.times_plus(middle, o.y));
    let square = x.times_plus(x, y * y);
    let between = between_ends(o.z, d.z, ends);
    move |k| {
        let half = ((f32x16::splat(squares[k]) - square) * inv).sqrt();
        between(k, [middle - half, middle + half])
    }
}

/// Within a cone, in its own space.
///
/// Its equation is that of the point nearest to the cone's middle, so that all numbers that matter are about 1, and its roots are taken
/// so that each is that of an equation whose numbers are off by some roundings of their own size, whatever cancels (Press and others
/// 1992, Numerical Recipes in C, section 5.6): that moves the side by no more than it is grown by. Beyond the apex, where the
/// radius is negative, nothing lies between the ends.
#[inline(always)]
fn cone(own: &Rays<f32x16>, taper: f32, radii: &[f32; 2], ends: &[f32; 2]) -> impl Fn(usize) -> [f32x16; 2] {
    let Rays { origin, dir: d } = *own;
    let (taper, zero, one) = (f32x16::splat(taper), f32x16::default(), f32x16::constant(1.0));
    let from_middle = Vec3::new(origin.x, origin.y, origin.z - f32x16::constant(0.5));
    let square = d.fused_dot(d);
    let shift = -from_middle.fused_dot(d) / square;
    let o = d.fused(shift, origin);
    let fall = taper * d.z;
    let across = (-fall).times_plus(fall, d.x.times_plus(d.x, d.y * d.y));
    let least_across = square * f32x16::constant(ALONG_SIDE);
    let a = across.abs().lt(least_across).select(least_across, across);
    // A ray that is steeper than the side runs into the cone and on, or comes and runs out of it.
    let (steep, widens, inv) = (a.lt(zero), fall.lt(zero), one / a);
    let (turn, reach) = (o.x.times_plus(d.x, o.y * d.y), o.x.times_plus(o.x, o.y * o.y));
    let between = between_ends(o.z, d.z, ends);
    move |k| {
        let radius = f32x16::splat(radii[k]) - taper * o.z;
        let (b, c) = (radius.times_plus(fall, turn), (-radius).times_plus(radius, reach));
        let discriminant = b.times_plus(b, -(a * c));
        // Steep rays cross it in any case, which rounding must not deny.
        let root = steep.select(most(discriminant, zero), discriminant).sqrt();
        let ([first, last], inf) = (rising_roots(inv, b, c, root), f32x16::constant(f64::INFINITY));
        let enter = steep.select(widens.select(last, -inf), first);
        let leave = steep.select(widens.select(inf, first), last);
        between(k, [enter, leave]).map(|t| t + shift)
    }
}

/// What of a stretch lies between the ends of a cylinder or cone, which go beyond 0 and 1 by `ends`.
#[inline(always)]
fn between_ends(z: f32x16, dz: f32x16, ends: &[f32; 2]) -> impl Fn(usize, [f32x16; 2]) -> [f32x16; 2] {
    let climb = f32x16::constant(1.0) / dz;
    move |k, [enter, leave]| {
        let end = f32x16::splat(ends[k]);
        let (low, high) = ((-end - z) * climb, (f32x16::constant(1.0) + end - z) * climb);
        // NaN of a ray that misses the side comes last, and stays.
        [most(least(low, high), enter), least(most(low, high), leave)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::{
        Block, Boxes, ClosedCones, Cylinders, Ellipsoids, OrientedBoxes, Planes, Polynomials, Spheres,
    };
    use crate::lane::LANES;
    use crate::random::Random;
    use crate::scene::{Polynomial, Transform};
    use std::sync::Arc;

    /// Crossings in double precision lie where the brackets say, and the brackets are narrow.
    fn check<B: Block<f64>>(push: impl Fn(&mut B, &mut Random, &Transform)) {
        let mut numbers = Random::new(1);
        let (mut crossed, mut wide) = (0, 0);
        for round in 0..400 {
            let place = Transform::rotate(numbers.vector(1.0) * 180.0)
                .then(&Transform::scale(numbers.vector(1.0) * 0.3 + DVec3::splat(0.5)))
                .then(&Transform::rotate(numbers.vector(1.0) * 180.0))
                .then(&Transform::translate(numbers.vector(1.0) + DVec3::splat(5.0)));
            let mut block = B::default();
            push(&mut block, &mut numbers, &place);
            let solid = block.solid(0).expect("a body");
            let (middle, size) = (DVec3::splat(5.0), 2.0);
            let body = Body::new(&solid, block.bounds(0), middle, size);
            let far = 10f64.powi(round % 4);
            let rays: Vec<(DVec3, DVec3)> = (0..LANES)
                .map(|lane| {
                    let dir = match lane {
                        0 => DVec3::X,
                        1 => place.vector(DVec3::Y).normalize(),
                        _ => numbers.vector(1.0).normalize(),
                    };
                    (middle + numbers.vector(1.0) - dir * far, dir)
                })
                .collect();
            let rays = Rays::<f64x8> {
                origin: Vec3::from_fn(|lane| rays[lane].0),
                dir: Vec3::from_fn(|lane| rays[lane].1),
            };
            let from = rays.origin - Vec3::splat(middle);
            let shift = -from.dot(rays.dir);
            // Beside others, in either place.
            let among_others = |place: usize| {
                let both = |v: Vec3<f32x8>| {
                    let both = |x: f32x8| f32x16::of(|k| if k == place { x } else { -x });
                    Vec3::new(both(v.x), both(v.y), both(v.z))
                };
                let origin = both((from + rays.dir * shift).cast());
                let (own, mut bracket) = (Rays { origin, dir: both(rays.dir.cast()) }, Bracket::default());
                assert!(body.bracket(&own, &mut bracket));
                [bracket.outer, bracket.inner].map(|ends| ends.map(|end| end.eight(place).to_array()))
            };
            let [outer, inner] = among_others(0);
            let bits = |ends: [[[f32; LANES]; 2]; 2]| ends.map(|ends| ends.map(|end| end.map(f32::to_bits)));
            assert_eq!(bits(among_others(1)), bits([outer, inner]));
            let roots = block.roots(0, &rays, None);
            let inside = block.starts_inside(0, &rays).bits();
            let here: Vec<_> = roots.as_ref().iter().map(|&t| (t - shift).to_array()).collect();
            let ends = |k: usize, ends: [[f32; LANES]; 2]| ends.map(|end| f64::from(end[k]));
            for k in 0..LANES {
                let ([a, d], [b, c]) = (ends(k, outer), ends(k, inner));
                let within = |t: f64| t.clamp(-size, size);
                // (What has no end is entered or left there.)
                let from = (inside >> k & 1 == 1).then_some(f64::NEG_INFINITY);
                let met = here.iter().map(|t| t[k]).filter(|t| !t.is_nan());
                let mut met = from.into_iter().chain(met).chain([f64::INFINITY]);
                let (Some(enter), Some(leave)) = (met.next(), met.next()) else {
                    assert!(!(b <= c), "{round} {k}: {b} {c} of a miss by {solid:?}");
                    continue;
                };
                let [a, b, c, d] = [a, b, c, d].map(within);
                let [enter, leave] = [enter, leave].map(within);
                assert!(a <= enter && leave <= d, "{round} {k}: {a} {enter} {leave} {d} of {solid:?}");
                assert!(!(b <= c) || enter <= b && c <= leave, "{round} {k}: {b} {enter} {leave} {c}");
                crossed += 1;
                wide += u32::from(b - a > 1e-3 || d - c > 1e-3);
            }
        }
        assert!(crossed > 100 && wide * 20 < crossed, "{wide} of {crossed} are wide");
    }

    #[test]
    fn what_must_be_asked_is_met_where_its_box_is() {
        let numbers = &mut Random::new(4);
        let (mut met, mut missed) = (0, 0);
        for _ in 0..300 {
            let (middle, size) = (numbers.vector(9.0), 2.0);
            let (corner, edges) = (middle + numbers.vector(0.8), numbers.vector(0.8).abs());
            let bounds = Aabb { min: corner, max: corner + edges };
            let body = Body::new(&Solid::Other, bounds, middle, size);
            let lines: Vec<(DVec3, DVec3)> =
                (0..2 * LANES).map(|_| (numbers.vector(0.8), numbers.vector(1.0).normalize())).collect();
            let axes = |of: fn(&(DVec3, DVec3)) -> DVec3| {
                let axis = |axis: usize| {
                    f32x16::of(|k| f32x8::from_fn(|lane| of(&lines[k * LANES + lane])[axis] as f32))
                };
                Vec3::new(axis(0), axis(1), axis(2))
            };
            let rays = Rays { origin: axes(|line| line.0), dir: axes(|line| line.1) };
            let mut bracket = Bracket::default();
            assert!(!body.bracket(&rays, &mut bracket), "it is not known where it is");
            let (from, to) = (numbers.between(-1.0, 0.0), numbers.between(0.0, 1.0));
            let lanes = 0xf7ff;
            let told = body.may_meet(&rays, [from, to].map(|t| f32x16::splat(t as f32)), lanes);
            for (k, (origin, dir)) in lines.iter().enumerate() {
                let is_in = |t: f64| {
                    let place = middle + *origin + *dir * t;
                    place.cmpge(bounds.min).all() && place.cmple(bounds.max).all()
                };
                let crossed = (0..=200).any(|s| is_in(from + (to - from) * f64::from(s) / 200.0));
                let told = told >> k & 1 == 1;
                assert!(told || !crossed || k == 11, "{k} of {bounds:?}");
                met += u32::from(crossed);
                missed += u32::from(!told);
            }
        }
        assert!(met > 100 && missed > 2000, "{met} are met, {missed} are told not to be");
    }

    #[test]
    fn crossings_are_within_their_brackets() {
        check::<Spheres<f64>>(|block, n, place| {
            block.push(place.point(DVec3::ZERO), 0.5 + 0.4 * n.between(-1.0, 1.0));
        });
        check::<Ellipsoids<f64>>(|block, _, place| block.push(place));
        check::<Boxes<f64>>(|block, n, place| {
            let half = DVec3::splat(0.5) + n.vector(1.0) * 0.4;
            let middle = place.point(DVec3::ZERO);
            block.push(middle - half, middle + half);
        });
        check::<OrientedBoxes<f64>>(|block, n, place| {
            let half = DVec3::splat(0.5) + n.vector(1.0) * 0.4;
            block.push(place, -half, half);
        });
        check::<Cylinders<f64>>(|block, n, place| {
            block.push(place, (n.vector(1.0) * 0.3, 0.4), (DVec3::Y * 0.8 + n.vector(1.0) * 0.3, 0.4));
        });
        check::<ClosedCones<f64>>(|block, n, place| {
            let (wide, narrow) = (n.between(0.3, 0.6), n.between(0.05, 0.25));
            let ends = (n.vector(1.0) * 0.3, DVec3::Y * 0.8 + n.vector(1.0) * 0.3);
            block.push(place, (ends.0, wide), (ends.1, narrow));
        });
        // One ray in eight runs along the side, as far as rounding lets it.
        check::<ClosedCones<f64>>(|block, n, place| {
            let (height, wide, narrow) = (0.8, n.between(0.3, 0.6), n.between(0.05, 0.25));
            let lean = (wide - narrow) / height;
            let outward = DVec3::X * (1.0 - lean * lean).sqrt() - DVec3::Y * lean;
            let base = n.vector(1.0) * 0.3;
            let cap = base + DVec3::Y * height + outward * (wide - narrow);
            block.push(place, (base, wide), (cap, narrow));
        });
        check::<Planes<f64>>(|block, n, place| {
            block.push(place, n.vector(1.0).normalize(), 0.2 * n.between(-1.0, 1.0))
        });
        // x^2 + a y^2 + b y + c z^2 + d z = e: ellipsoids, cylinders and paraboloids along y, along which a ray runs, and along z.
        let bodies = [
            [0.7, 0.0, 1.5, 0.1],
            [30.0, -20.0, 9.0, 0.1],
            [2.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 2.0, 0.0],
            [0.6, 0.0, 0.0, -1.0],
            [0.0, -1.0, 0.6, 0.0],
            [1.0, 0.0, 1e-3, 0.003],
        ];
        for [a, b, c, d] in bodies {
            check::<Polynomials<f64>>(|block, n, place| {
                let scale = 10f64.powf(n.between(-9.0, 9.0));
                let terms = [1.0, 0.0, 0.0, 0.0, a, 0.0, b, c, d, -n.between(0.2, 1.5)];
                let terms = terms.map(|term| term * scale).to_vec();
                block.push(place, &Arc::new(Polynomial::new(2, terms).expect("ten terms")));
            });
        }
    }
}
