//! Tori: ring, horn and spindle, always computed in f64.

use super::coin::{BOUND, Coin};
use super::frame::{Frames, narrowed, widened};
use super::quartic::{Pair, SETTLED, cubic, deflated, quartic, stays_above, stays_above_ahead};
use super::{Aabb, Block, Left, Lobe, Lobes, Looking, Rays, Screened, Solid, Surfaces, gather, permuted};
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3, f32x8, f64x8};
use crate::scene::Transform;
use glam::{DAffine3, DMat3, DVec3};
use smallvec::smallvec;

/// `n` tori, each by a frame and the columns `major` and `minor`.
///
/// In own space the axis is z and the two radii sum to 1, so the unit sphere holds the torus. The inside is what is
/// within `minor` of the ring, as in POV-Ray: where a spindle torus (`minor > major`) overlaps itself there is a
/// second, inner surface but no hollow.
#[derive(Debug, Clone, Default)]
pub struct Tori<S> {
    frames: Frames<S>,
    major: Vec<S>,
    minor: Vec<S>,
    /// What most rays miss.
    coins: Vec<Coin>,
}

/// Pairs of roots nearer to each other than twice the square root of this (of the torus' size) are decided and placed
/// on the tube itself. Anything between the quartic's error (1e-8) and 1 would be right; more costs time.
const NEAR: f64 = 1.0 / 16384.0;

/// The quartic is below this between two roots that count as near, or that nearly are: `-square` times the other two roots' factor there,
/// which is at most `p + 6 m^2` for a root's middle `m` up to 2, as `p` is up to 4 within the unit sphere.
const NEAR_VALUE: f64 = 32.0 * NEAR;

/// Newton steps at most; beyond, a tangent ray only walks about within its error.
const STEPS: usize = 4;

/// The longest step for a root that has no partner to keep clear of. The quartic gives half the digits or more.
const STRIDE: f64 = 1.0 / 1024.0;

/// A torus per lane.
#[derive(Debug, Clone, Copy)]
struct Ring {
    major: f64x8,
    minor: f64x8,
}

/// Half the squared distance from the ring less that of the tube, along a ray, with derivatives: the tube is where
/// `value` is 0.
#[derive(Debug, Clone, Copy)]
struct Tube {
    value: f64x8,
    slope: f64x8,
    curvature: f64x8,
    /// Distance from the axis.
    radius: f64x8,
}

/// A ray by its closest point to the middle (or any other), and its unit direction.
#[derive(Debug, Clone, Copy)]
struct Line {
    origin: Vec3<f64x8>,
    dir: Vec3<f64x8>,
}

/// Which crossings are wanted: those from `from` to `to`, counted as `s` of a [`Line`], in the lanes of `lanes`; with `first`
/// only the first of them, with `any` whether there is one: instead of where it is it may be told where the ray is within the tube.
/// Crossings that nobody wants are left out, or are where they are to half their digits.
#[derive(Debug, Clone, Copy)]
struct Wanted {
    from: f64x8,
    to: f64x8,
    lanes: Mask<f64x8>,
    first: bool,
    any: bool,
}

/// What is wanted is looked for this much beyond the ends: roots before they are polished are off by less.
const END_ROOM: f64 = 1.0 / 256.0;

impl Wanted {
    /// Everything.
    fn all() -> Self {
        let inf = f64x8::lit(f64::INFINITY);
        Self { from: -inf, to: inf, lanes: Mask::all_set(), first: false, any: false }
    }

    /// The first, or any, of what rays look for.
    #[inline(always)]
    fn first_of<L: Lane>(looking: &Looking<L>) -> Self {
        let (from, to) = (looking.from.to_f64s(), looking.to.to_f64s());
        Self { from, to, lanes: Mask::from_bits(looking.lanes), first: true, any: looking.any }
    }

    /// The same counted from `shift` on.
    #[inline(always)]
    fn shifted(&self, shift: f64x8) -> Self {
        Self { from: self.from - shift, to: self.to - shift, ..*self }
    }

    /// Where a root that is only about known may be wanted.
    #[inline(always)]
    fn about(&self, s: f64x8) -> Mask<f64x8> {
        let room = f64x8::lit(END_ROOM);
        s.ge(self.from - room) & s.le(self.to + room)
    }

    /// Where it surely is, and with it all that is asked for.
    #[inline(always)]
    fn settled_by(&self, s: f64x8) -> Mask<f64x8> {
        if self.first { s.ge(self.from + f64x8::lit(END_ROOM)) } else { Mask::none_set() }
    }
}

impl Ring {
    /// Crossings, NaN for none; `t` in units of `own.dir`. `wanted` by `t`.
    #[inline(always)]
    fn crossings(&self, own: &Rays<f64x8>, wanted: &Wanted) -> [f64x8; 4] {
        let none = f64x8::lit(f64::NAN);
        let length = own.dir.length();
        let inv = f64x8::lit(1.0) / length;
        let dir = own.dir * inv;
        // To the closest point, twice: the first step leaves the rounding of a far origin along the ray.
        let coarse = -own.origin.dot(dir);
        let near = own.origin + dir * coarse;
        let fine = -near.dot(dir);
        let line = Line { origin: near + dir * fine, dir };
        let square = line.origin.dot(line.origin);
        let half_chord = (f64x8::lit(BOUND) - square).sqrt(); // NaN beyond the sphere
        let reach = line.origin.z.abs() - dir.z.abs() * half_chord;
        let Wanted { from, to, .. } = *wanted;
        let wanted = Wanted { from: from * length, to: to * length, ..*wanted }.shifted(coarse + fine);
        let room = f64x8::lit(END_ROOM);
        let active = wanted.lanes
            & reach.le(self.minor + f64x8::lit(BOUND - 1.0))
            & half_chord.ge(wanted.from - room)
            & (-half_chord).le(wanted.to + room);
        if active.none() {
            return [none; 4];
        }
        let roots = self.solve(&line, square, &Wanted { lanes: active, ..wanted });
        roots.map(|s| (coarse + (fine + s)) * inv)
    }

    /// Roots along a line that starts at its closest point to the middle, `square` its distance squared.
    ///
    /// `F(s) = (|p|^2 + R^2 - r^2)^2 - 4 R^2 rho^2` is then depressed, `s^4 + p s^2 + q s + c`, and `c` is a product of
    /// two differences, so that thin tubes keep their digits.
    fn solve(&self, line: &Line, square: f64x8, wanted: &Wanted) -> [f64x8; 4] {
        let Ring { major, minor } = *self;
        let (o, d) = (line.origin, line.dir);
        let across = d.x * d.x + d.y * d.y;
        let radius = (o.x * o.x + o.y * o.y).sqrt();
        let four_rr = major * major * f64x8::lit(4.0);
        let k = square + (major - minor); // R^2 - r^2, as R + r = 1
        let p = k + k - four_rr * across;
        let q = four_rr * f64x8::lit(2.0) * o.z * d.z;
        let (inner, outer) = (radius - major, radius + major);
        let zz = o.z * o.z;
        let c = ((inner - minor) * (inner + minor) + zz) * ((outer - minor) * (outer + minor) + zz);
        let mut wanted = *wanted;
        // The roots take some ten times as long as this.
        wanted.lanes &= !stays_above(p, q * q, c, f64x8::lit(NEAR_VALUE));
        if wanted.lanes.none() {
            return [f64x8::lit(f64::NAN); 4];
        }
        let [low, high] = quartic(p, q, c, wanted.lanes);
        let [l0, l1] = self.place(line, low, &wanted);
        let settled = wanted.settled_by(l0);
        let [h0, h1] = self.place(line, high, &Wanted { lanes: wanted.lanes & !settled, ..wanted });
        [l0, l1, h0, h1]
    }

    /// Crossings of lanes that start on the torus: `t = 0`, and the roots of what remains of the quartic after
    /// dividing by `t`. `noise` bounds the rounding of the tube's slope at the start. `wanted` by `t`.
    fn crossings_left(&self, own: &Rays<f64x8>, wanted: &Wanted, noise: f64x8) -> [f64x8; 4] {
        let (Ring { major, minor }, none) = (*self, f64x8::lit(f64::NAN));
        let length = own.dir.length();
        let inv = f64x8::lit(1.0) / length;
        let mut wanted = Wanted { from: wanted.from * length, to: wanted.to * length, ..*wanted };
        let line = Line { origin: own.origin, dir: own.dir * inv };
        let at_start = self.tube(&line, f64x8::zero());
        let leaving = at_start.slope.gt(noise * inv);
        if wanted.first {
            // The outer half lies on the convex hull: what leaves it does not come back.
            wanted.lanes &= !(self.major.ge(self.minor) & at_start.radius.ge(self.major) & leaving);
            if wanted.lanes.none() {
                return [f64x8::zero(), none, none, none];
            }
        }
        let (o, d) = (line.origin, line.dir);
        let b = o.dot(d);
        let k = o.dot(o) + (major - minor);
        let four_rr = major * major * f64x8::lit(4.0);
        let b3 = b * f64x8::lit(4.0);
        let c3 = b * b3 + k + k - four_rr * (d.x * d.x + d.y * d.y);
        let d3 = b3 * k - (four_rr + four_rr) * (o.x * d.x + o.y * d.y);
        if wanted.first {
            // Nor does what passes through the hole without coming near to the tube again.
            wanted.lanes &= !(leaving & stays_above_ahead(b3, c3, d3, f64x8::lit(NEAR_VALUE)));
            if wanted.lanes.none() {
                return [f64x8::zero(), none, none, none];
            }
        }
        let wanted = &wanted;
        let (mut single, mut pair) = cubic(b3, c3, d3, wanted.lanes);
        single = self.polish(&line, single, f64x8::lit(STRIDE), wanted.lanes & wanted.about(single));
        // On which side of the tangent the ray leaves is below rounding: the start is a double root.
        let tangent = at_start.slope.abs().le(noise * inv);
        let touching = deflated(b3, c3, f64x8::zero());
        single = wanted.lanes.select(tangent.select(f64x8::zero(), single), none);
        pair.middle = tangent.select(touching.middle, pair.middle);
        pair.square = tangent.select(touching.square, pair.square);
        // Any of the three may be the first.
        let [low, high] = self.place(&line, pair, &Wanted { first: false, ..*wanted });
        [f64x8::zero(), single * inv, low * inv, high * inv]
    }

    /// The tube at `s` along a line. On the inner sheet of a spindle torus it is the tube of the ring's far side.
    #[inline(always)]
    fn tube(&self, line: &Line, s: f64x8) -> Tube {
        let p = line.origin + line.dir * s;
        let (zero, d) = (f64x8::zero(), line.dir);
        let radius = (p.x * p.x + p.y * p.y).sqrt();
        let major = self.major.copysign(p.dot(p) + (self.major - self.minor));
        let inv = radius.gt(zero).keep(f64x8::lit(1.0) / radius);
        let off = radius - major;
        let outward = (p.x * d.x + p.y * d.y) * inv;
        let across = d.x * d.x + d.y * d.y;
        Tube {
            // The difference of squares, so that a thin tube is compared with its own radius.
            value: ((off - self.minor) * (off + self.minor) + p.z * p.z) * f64x8::lit(0.5),
            slope: off * outward + p.z * d.z,
            curvature: f64x8::lit(1.0) - major * (across - outward * outward) * inv,
            radius,
        }
    }

    /// Newton's step at `s` along a line, `value / slope` of the [`Tube`] there in one division; NaN on the axis.
    #[inline(always)]
    fn step(&self, line: &Line, s: f64x8) -> f64x8 {
        let (p, d) = (line.origin + line.dir * s, line.dir);
        let radius = (p.x * p.x + p.y * p.y).sqrt();
        let off = radius - self.major.copysign(p.dot(p) + (self.major - self.minor));
        let value = (off - self.minor) * (off + self.minor) + p.z * p.z;
        let slope = off * (p.x * d.x + p.y * d.y) + p.z * d.z * radius;
        value * f64x8::lit(0.5) * radius / slope
    }

    /// The roots of a pair, placed on the tube; NaN where there are none.
    #[inline(always)]
    fn place(&self, line: &Line, pair: Pair, wanted: &Wanted) -> [f64x8; 2] {
        let (zero, none) = (f64x8::zero(), f64x8::lit(f64::NAN));
        if wanted.lanes.none() {
            return [none; 2];
        }
        let Pair { mut middle, mut square } = pair;
        let mut near = wanted.lanes & square.abs().le(f64x8::lit(NEAR));
        if near.any() {
            let widest = f64x8::lit(NEAR).sqrt();
            near &=
                wanted.about(wanted.to.min(middle + widest)) & wanted.about(wanted.from.max(middle - widest));
        }
        if near.any() {
            let refined = self.extremum(line, middle, near);
            middle = refined.1.select(refined.0.middle, middle);
            square = refined.1.select(refined.0.square, square);
        }
        let real = wanted.lanes & square.ge(zero);
        if real.none() {
            return [none; 2];
        }
        let half = square.sqrt();
        let (low, high) = (middle - half, middle + half);
        // Roots that lie apart keep apart; near ones may change places.
        let apart = half.ge(f64x8::lit(END_ROOM));
        let first = apart & wanted.settled_by(low);
        let low = self.polish(line, low, half, real & wanted.about(low));
        let high = self.polish(line, high, half, real & wanted.about(high) & !first);
        [real.select(low.min(high), none), real.select(high.max(low), none)]
    }

    /// Two near roots as the tube has them, and where that is to be believed: around the place where the ray is
    /// nearest to the ring (or, touching from within, farthest), at the height of the tube there.
    fn extremum(&self, line: &Line, start: f64x8, near: Mask<f64x8>) -> (Pair, Mask<f64x8>) {
        let reach = f64x8::lit(NEAR).sqrt();
        let mut middle = start;
        let mut moving = near;
        for _ in 0..STEPS {
            let tube = self.tube(line, middle);
            let step = tube.slope / tube.curvature;
            middle = (moving & step.abs().le(reach)).select(middle - step, middle);
            moving &= step.abs().gt(f64x8::lit(SETTLED));
            if moving.none() {
                break;
            }
        }
        let tube = self.tube(line, middle);
        let square = tube.value * f64x8::lit(-2.0) / tube.curvature;
        // Only where the tube is smooth over the gap: away from the axis, on rings that do not overlap themselves,
        // and bent enough to have a nearest place at all.
        let smooth = tube.radius.ge(reach * f64x8::lit(8.0))
            & self.major.ge(self.minor)
            & tube.curvature.abs().ge(reach)
            & (middle - start).abs().le(reach + reach)
            & square.le(f64x8::lit(4.0 * NEAR));
        (Pair { middle, square }, near & smooth)
    }

    /// Newton's steps on the tube, none longer than `stride`, until each active lane has settled.
    ///
    /// Lanes stop one by one, so what a lane gets does not depend on its neighbours.
    #[inline(always)]
    fn polish(&self, line: &Line, start: f64x8, stride: f64x8, active: Mask<f64x8>) -> f64x8 {
        let mut s = start;
        let mut moving = active;
        for _ in 0..STEPS {
            if moving.none() {
                break;
            }
            let step = self.step(line, s);
            // NaN, of a tangent met to the bit, stays: there is nowhere to go.
            let step = Lane::max(-stride, Lane::min(stride, step));
            let sound = step.equal(step);
            s = (moving & sound).select(s - step, s);
            moving &= step.abs().gt(f64x8::lit(SETTLED));
        }
        s
    }
}

/// The least of crossings in any order that lies beyond `from`, NaN where none does.
#[inline(always)]
fn least_beyond<L: Lane>(roots: &[L; 4], from: L) -> L {
    let none = L::lit(f64::NAN);
    // NaN loses to what it is compared with.
    let least = roots.iter().fold(none, |least, &t| t.gt(from).select(least.min(t), least));
    least.lt(L::lit(f64::INFINITY)).select(least, none)
}

/// Rising, NaN last.
#[inline(always)]
fn sorted(roots: [f64x8; 4]) -> [f64x8; 4] {
    let inf = f64x8::lit(f64::INFINITY);
    let [mut a, mut b, mut c, mut d] = roots.map(|t| t.min(inf));
    for (x, y) in [(&mut a, &mut b), (&mut c, &mut d)] {
        (*x, *y) = (x.min(*y), x.max(*y));
    }
    (a, c) = (a.min(c), a.max(c));
    (b, d) = (b.min(d), b.max(d));
    (b, c) = (b.min(c), b.max(c));
    [a, b, c, d].map(|t| t.lt(inf).select(t, f64x8::lit(f64::NAN)))
}

impl<S: Scalar> Tori<S> {
    /// Adds the image of a torus about the y axis. `major` at least 0, `minor` over 0.
    pub fn push(&mut self, world_from_object: &Transform, major: f64, minor: f64) {
        let size = major + minor;
        // Own z is the object's y, and own y its z.
        let swap = DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::Y);
        let object_from_own = Transform {
            forward: DAffine3::from_mat3(swap * size),
            inverse: DAffine3::from_mat3(swap * (1.0 / size)),
        };
        self.frames.push(&object_from_own.then(world_from_object));
        self.coins.push(Coin::new(world_from_object, major, minor));
        self.major.push(S::from_f64(major / size));
        self.minor.push(S::from_f64(minor / size));
    }

    fn ring(&self, i: usize) -> Ring {
        let [major, minor] =
            [&self.major, &self.minor].map(|column| f64x8::splat(column[i].to_f64()).in_register());
        Ring { major, minor }
    }

    /// What single precision tells of rays that do not start here. `ends` by `t`.
    #[inline(always)]
    fn screened(
        &self,
        i: usize,
        rays: &Rays<S::Lane>,
        ends: [f32x8; 2],
        (lanes, any): (Mask<f32x8>, bool),
    ) -> Screened {
        let coin = &self.coins[i];
        if !coin.sound {
            return Screened::unknown(lanes);
        }
        coin.look(&coin.own(rays, self.frames.center(i)), ends, lanes, (any, NEAR_VALUE))
    }

    /// Crossings in f64, NaN for none, with the rays of own space; `None` if there are none at all. `wanted` by `t`.
    #[inline(always)]
    fn crossings(
        &self,
        i: usize,
        rays: &Rays<S::Lane>,
        left: Option<&Left<S::Lane>>,
        wanted: &Wanted,
    ) -> Option<([f64x8; 4], Rays<f64x8>)> {
        let elsewhere = left.map_or(wanted.lanes, |left| wanted.lanes & !left.on.cast());
        // Neighbours mostly leave one surface together, and then there is no other ray to ask for.
        let screened = if left.is_some() && elsewhere.none() {
            Screened::unknown(Mask::none_set())
        } else {
            let ends = [wanted.from, wanted.to].map(f32x8::from_f64s);
            self.screened(i, rays, ends, (elsewhere.cast(), wanted.any))
        };
        let Some(left) = left else {
            return (!screened.is_missed()).then(|| self.crossings_screened(i, rays, screened, wanted));
        };
        let (mut roots, own) = self.crossings_screened(i, rays, screened, wanted);
        let (frame, ring) = (self.frames.at(i), self.ring(i));
        // The slope changes by the start's error, enlarged where the ring is bent, and by the direction's.
        let radius = (own.origin.x * own.origin.x + own.origin.y * own.origin.y).sqrt();
        let bend = f64x8::lit(1.0) + ring.major / radius;
        let noise = widened(frame.start_error(rays)).dot(own.dir.abs()) * bend
            + widened(frame.direction_error(rays)).dot(own.origin.abs());
        let on = left.on.cast();
        let [from, to] = [wanted.from, wanted.to].map(Lane::in_register);
        let others =
            ring.crossings_left(&own, &Wanted { from, to, lanes: on & wanted.lanes, ..*wanted }, noise);
        for (root, other) in roots.iter_mut().zip(others) {
            *root = on.select(other, *root);
        }
        Some((roots, own))
    }

    /// The same of rays of which single precision has told what it can, and which start elsewhere.
    #[inline(always)]
    fn crossings_screened(
        &self,
        i: usize,
        rays: &Rays<S::Lane>,
        Screened { may_meet, met_at }: Screened,
        wanted: &Wanted,
    ) -> ([f64x8; 4], Rays<f64x8>) {
        let own = self.frames.at(i).in_f64().rays(&rays.in_f64());
        let mut roots = match may_meet.any() {
            true => self.ring(i).crossings(&own, &Wanted { lanes: may_meet.cast(), ..*wanted }),
            false => [f64x8::lit(f64::NAN); 4],
        };
        let met_at: f64x8 = met_at.cast();
        roots[0] = met_at.equal(met_at).select(met_at, roots[0]);
        (roots, own)
    }

    /// All crossings of `lanes`, sorted, NaN last.
    #[inline(always)]
    fn all_crossings(
        &self,
        i: usize,
        rays: &Rays<S::Lane>,
        left: Option<&Left<S::Lane>>,
        lanes: Mask<f64x8>,
    ) -> ([f64x8; 4], Rays<f64x8>) {
        match self.crossings(i, rays, left, &Wanted { lanes, ..Wanted::all() }) {
            Some((roots, own)) => (sorted(roots), own),
            None => ([f64x8::lit(f64::NAN); 4], Rays::default()),
        }
    }
}

impl<S: Scalar> Block<S> for Tori<S> {
    const SKIN_IS_PARTIAL: bool = true;
    type Roots = [S::Lane; 4];

    fn len(&self) -> usize {
        self.major.len()
    }

    /// (Only of the lanes that look, but all of theirs.)
    #[inline]
    fn cross(
        &self,
        i: usize,
        rays: &Rays<S::Lane>,
        left: Option<&Left<S::Lane>>,
        looking: Option<&Looking<S::Lane>>,
        out: &mut Vec<S::Lane>,
    ) -> Mask<S::Lane> {
        let lanes = looking.map_or(Mask::all_set(), |looking| Mask::from_bits(looking.lanes));
        let (roots, _) = self.all_crossings(i, rays, left, lanes);
        out.extend(roots.map(|root| S::Lane::from_f64s(root).in_register()));
        self.starts_inside(i, rays)
    }

    /// Bounded by sphere and slab, then Ferrari at the closest point to the middle and Newton on the tube.
    #[inline]
    fn roots(&self, i: usize, rays: &Rays<S::Lane>, left: Option<&Left<S::Lane>>) -> [S::Lane; 4] {
        self.all_crossings(i, rays, left, Mask::all_set()).0.map(S::Lane::from_f64s)
    }

    #[inline(always)]
    fn first(
        &self,
        i: usize,
        rays: &Rays<S::Lane>,
        left: Option<&Left<S::Lane>>,
        looking: &Looking<S::Lane>,
    ) -> S::Lane {
        match self.crossings(i, rays, left, &Wanted::first_of(looking)) {
            Some((roots, _)) => least_beyond(&roots.map(S::Lane::from_f64s), looking.from),
            None => S::Lane::lit(f64::NAN),
        }
    }

    const SCREENED: bool = true;

    #[inline(always)]
    fn screen(&self, i: usize, rays: &Rays<S::Lane>, looking: &Looking<S::Lane>) -> Screened {
        let ends = [looking.from, looking.to].map(|t| t.cast());
        self.screened(i, rays, ends, (Mask::from_bits(looking.lanes), looking.any))
    }

    #[inline(always)]
    fn first_screened(
        &self,
        i: usize,
        rays: &Rays<S::Lane>,
        looking: &Looking<S::Lane>,
        screened: Screened,
    ) -> S::Lane {
        let (roots, _) = self.crossings_screened(i, rays, screened, &Wanted::first_of(looking));
        least_beyond(&roots.map(S::Lane::from_f64s), looking.from)
    }

    /// Rays that leave its outer half or pass through the hole.
    #[inline]
    fn left_behind(&self, i: usize, rays: &Rays<S::Lane>, left: &Left<S::Lane>) -> u8 {
        let coin = &self.coins[i];
        if !coin.sound || coin.major < coin.minor {
            return 0;
        }
        coin.leaves(&coin.own(rays, self.frames.center(i)), left.on.bits(), (S::UNIT_ROUNDOFF, NEAR_VALUE))
    }

    /// Without the inner sheet of a spindle torus.
    #[inline]
    fn boundary(&self, i: usize, rays: &Rays<S::Lane>, left: Option<&Left<S::Lane>>) -> [S::Lane; 4] {
        let ([a, b, c, d], own) = self.all_crossings(i, rays, left, Mask::all_set());
        let none = f64x8::lit(f64::NAN);
        // Between the second and third crossing lies the lens of the overlap, or a dimple outside: one question for
        // both, so that they stay a pair.
        let p = own.origin + own.dir * ((b + c) * f64x8::lit(0.5));
        let ring = self.ring(i);
        let lens = (p.dot(p) + (ring.major - ring.minor)).lt(f64x8::zero());
        let outer = [a, lens.select(d, b), lens.select(none, c), lens.select(none, d)];
        outer.map(S::Lane::from_f64s)
    }

    fn resolve(
        &self,
        index: &[u32; LANES],
        _active: Mask<S::Lane>,
        rays: &Rays<S::Lane>,
        t: S::Lane,
    ) -> Surfaces<S::Lane> {
        let frame = self.frames.gathered(index).in_f64();
        let own = frame.rays(&rays.in_f64());
        let ring =
            Ring { major: gather(&self.major, index).to_f64s(), minor: gather(&self.minor, index).to_f64s() };
        let p = own.origin + own.dir * t.to_f64s();
        let radius = (p.x * p.x + p.y * p.y).sqrt();
        let major = ring.major.copysign(p.dot(p) + (ring.major - ring.minor));
        // On the axis, where a horn or spindle torus has its points, any direction will do.
        let inv = f64x8::lit(1.0) / radius;
        let sound = radius.gt(f64x8::zero());
        let outward =
            Vec3::new(sound.select(p.x * inv, f64x8::lit(1.0)), sound.keep(p.y * inv), f64x8::zero());
        let center = outward * major;
        let normal = (p - center).normalize();
        let point = center + normal * ring.minor;
        Surfaces {
            point: self.frames.to_world(index, narrowed(point)),
            normal: narrowed(frame.normal(normal)),
            ..Default::default()
        }
    }

    /// Unless it overlaps itself: then there is an inner sheet.
    fn solid(&self, i: usize) -> Option<Solid> {
        (self.major[i] >= self.minor[i]).then_some(Solid::Other)
    }

    /// Around the ring's disc swept by the tube: as the union of the two discs that bound it along its axis.
    fn bounds(&self, i: usize) -> Aabb {
        let minor = self.minor[i].to_f64();
        let size = self.major[i].to_f64() + minor; // 1 but for the columns' rounding
        self.frames.disc_bounds(i, -minor, size).union(self.frames.disc_bounds(i, minor, size))
    }

    /// As for [`Block::bounds`].
    fn lobes(&self, i: usize) -> Option<Lobes> {
        let (space, minor) = (self.frames.own_space(i), self.minor[i].to_f64());
        let disc = |z: f64| Lobe::disc(&space, z, self.major[i].to_f64() + minor);
        Some(smallvec![disc(-minor), disc(minor)])
    }

    fn permute(&mut self, order: &[u32]) {
        self.frames.permute(order);
        for column in [&mut self.major, &mut self.minor] {
            *column = permuted(column, order);
        }
        self.coins = permuted(&self.coins, order);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lane::each_lane;
    use crate::random::Random;

    /// Tori of all shapes, turned, somewhat stretched, near the origin and far; rays at and past them from near and far, one in two past
    /// the tube by 10^-1 to 10^-9: with the coin and without, the same is met.
    #[test]
    fn what_single_precision_tells_is_so_in_double() {
        let mut numbers = Random::new(11);
        let (mut missed, mut met, mut of) = (0, 0, 0);
        for round in 0..4000 {
            let (major, minor) = (numbers.between(0.05, 1.0), numbers.between(0.02, 0.6));
            let axes = DVec3::from_array([(); 3].map(|()| numbers.between(0.5, 2.0)));
            let [z, x] = [(); 2].map(|()| numbers.between(0.0, 6.0));
            let turn = DAffine3::from_rotation_z(z) * DAffine3::from_rotation_x(x);
            let far = 10f64.powf(numbers.between(-1.0, 2.0));
            let place = DAffine3::from_translation(numbers.vector(far));
            let forward = place * turn * DAffine3::from_scale(axes);
            let mut tori = Tori::<f64>::default();
            tori.push(&Transform { forward, inverse: forward.inverse() }, major, minor);
            let lines = each_lane(|k| {
                let other = numbers.vector(1.0);
                let mut between = |low: f64, high: f64| numbers.between(low, high);
                // A place on the ring, and off it across the tube: nearly its radius, or anything.
                let (along, about, inward) = (between(0.0, 7.0), between(0.0, 7.0), between(0.0, 2.0));
                let nearly = 1.0 + 10f64.powf(between(-9.0, -1.0)).copysign(between(-1.0, 1.0));
                let out = minor * if k % 2 == 0 { nearly } else { inward };
                let radius = major + out * about.cos();
                let at = DVec3::new(radius * along.cos(), out * about.sin(), radius * along.sin());
                let normal = DVec3::new(along.cos() * about.cos(), about.sin(), along.sin() * about.cos());
                // Across the normal, mostly, and from there back.
                let way = if round % 3 == 0 { other } else { normal.cross(other) }.normalize();
                let away = 10f64.powf(between(-1.0, 2.0));
                let [from, to] = [at - way * away, at].map(|p| forward.transform_point3(p));
                (from, (to - from).normalize(), (to - from).length())
            });
            let rays = Rays { origin: Vec3::from_fn(|k| lines[k].0), dir: Vec3::from_fn(|k| lines[k].1) };
            // Up to there, beyond it, or nearly so far.
            let share = [1.0, 3.0, 0.999][round % 3];
            let to = f64x8::from_fn(|k| lines[k].2 * share);
            let looking = |any| Looking { from: f64x8::zero(), to, lanes: !0, any };
            let first = |tori: &Tori<f64>, any| tori.first(0, &rays, None, &looking(any)).to_array();
            assert!(tori.coins[0].sound);
            let coin = tori.coins[0];
            let own = coin.own(&rays, tori.frames.center(0));
            let ends = [f64x8::zero(), to].map(f32x8::from_f64s);
            let Screened { may_meet, met_at } = coin.look(&own, ends, Mask::all_set(), (true, NEAR_VALUE));
            let told = [first(&tori, false), first(&tori, true)];
            tori.coins[0].sound = false;
            let known = first(&tori, false);
            for k in 0..LANES {
                let before = known[k] < to.to_array()[k];
                assert_eq!(told[0][k] < to.to_array()[k], before, "{round} {k}");
                assert!(!before || told[0][k] == known[k], "{round} {k}: {} for {}", told[0][k], known[k]);
                assert_eq!(told[1][k] < to.to_array()[k], before, "{round} {k}");
                let inside = !met_at.to_array()[k].is_nan();
                met += u32::from(inside);
                missed += u32::from(!inside && may_meet.bits() >> k & 1 == 0);
                of += 1;
            }
        }
        // One ray in two all but touches.
        assert!(missed > of / 8 && met > of / 8, "{missed} told to miss and {met} to meet, of {of}");
    }
}
