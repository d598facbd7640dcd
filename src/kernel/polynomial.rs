//! Polynomial surfaces (`quadric`, `cubic`, `quartic`, `poly`), always computed in f64.
//!
//! Along a ray the surface is a polynomial in one unknown. Between the roots of its derivative it is monotone, so it
//! has one root there or none: from the highest derivative, which is linear, down to the polynomial itself every root is
//! alone in a bracket, where Newton's method cannot leave it (Yuksel 2022, High-performance polynomial root finding for
//! graphics, sections 3 and 4). The unknown is counted from the ray's closest point to the middle, which keeps the
//! coefficients of the size of the shape.

use super::frame::{Frames, narrowed, widened};
use super::quartic::{SETTLED, cubic};
use super::{Aabb, Block, Left, Looking, Rays, Surfaces, View, first_beyond, permuted};
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3, f64x8};
use crate::scene::{Polynomial, Transform};
use smallvec::SmallVec;
use std::sync::Arc;

/// `n` polynomial surfaces: each a frame, a polynomial that may be shared, and a box that the scene vouches for.
#[derive(Debug, Clone, Default)]
pub struct Polynomials<S> {
    frames: Frames<S>,
    polynomial: Vec<Arc<Polynomial>>,
    /// How each is summed up along rays.
    steps: Vec<Arc<[Step]>>,
    bounds: Vec<Aabb>,
}

/// Crossings farther than this from the closest point to the middle, in own space, are not looked for (POV-Ray's
/// greatest distance).
const REACH: f64 = 1e7;

/// A cubic whose coefficients are larger than this many times the first is left to brackets: solved as it stands it
/// would lose more than a third of its digits.
const STEEPEST: f64 = (1u64 << 18) as f64;

/// Quartics that are positive by less than this share of their terms are left to brackets: far more than rounding.
const SURE_ROOM: f64 = 1.0 / (1u64 << 30) as f64;

/// Rounding of the ends between which roots are looked for, with room; they only save work.
const RANGE_ROUNDINGS: f64 = 64.0;

/// Steps at most in a bracket: every second step halves it at least, and it holds 53 bits.
const STEPS: usize = 110;

/// A step of a Horner scheme in z within one in y within one in x, which leaves out what is zero: most coefficients are.
#[derive(Debug, Clone, Copy)]
enum Step {
    /// Adds to what is in z.
    Constant(f64),
    /// Times the unknown that it is in.
    TimesZ,
    TimesY,
    TimesX,
    /// Adds what is in z to what is in y, and begins anew in z.
    ToY,
    /// The same of y and x.
    ToX,
}

/// How a polynomial is summed up.
fn steps(polynomial: &Polynomial) -> Vec<Step> {
    let (order, mut coefficients) = (polynomial.order(), polynomial.coefficients().iter());
    let mut steps = Vec::new();
    let mut any_x = false;
    for i in 0..=order {
        if any_x {
            steps.push(Step::TimesX);
        }
        let mut any_y = false;
        for j in 0..=i {
            if any_y {
                steps.push(Step::TimesY);
            }
            let mut any_z = false;
            for _ in 0..=j {
                if any_z {
                    steps.push(Step::TimesZ);
                }
                if let Some(&c) = coefficients.next().filter(|c| **c != 0.0) {
                    steps.push(Step::Constant(c));
                    any_z = true;
                }
            }
            if any_z {
                steps.push(Step::ToY);
                any_y = true;
            }
        }
        if any_y {
            steps.push(Step::ToX);
            any_x = true;
        }
    }
    steps
}

/// A polynomial in one unknown per lane: `c[k]` belongs to the `k`th power, `len` of them are in use.
#[derive(Debug, Clone, Copy)]
struct Univariate<const N: usize> {
    c: [f64x8; N],
    len: usize,
}

impl<const N: usize> Univariate<N> {
    fn zero() -> Self {
        Self { c: [f64x8::zero(); N], len: 0 }
    }

    /// Times `origin + s dir`.
    #[inline(always)]
    fn times(&mut self, origin: f64x8, dir: f64x8) {
        if self.len == 0 {
            return;
        }
        self.c[self.len] = self.c[self.len - 1] * dir;
        for k in (1..self.len).rev() {
            self.c[k] = self.c[k].fused(origin, self.c[k - 1] * dir);
        }
        self.c[0] *= origin;
        self.len += 1;
    }

    /// Adds another, of which nothing is left.
    #[inline(always)]
    fn take(&mut self, other: &mut Self) {
        for k in 0..other.len {
            self.c[k] = if k < self.len { self.c[k] + other.c[k] } else { other.c[k] };
        }
        self.len = self.len.max(other.len);
        other.len = 0;
    }

    /// A polynomial along the line, or what its terms' magnitudes sum to.
    fn along(steps: &[Step], origin: Vec3<f64x8>, dir: Vec3<f64x8>, magnitudes: bool) -> Self {
        let (mut in_x, mut in_y, mut in_z) = (Self::zero(), Self::zero(), Self::zero());
        for step in steps {
            match *step {
                Step::Constant(c) => {
                    let c = f64x8::splat(if magnitudes { c.abs() } else { c });
                    in_z.c[0] = if in_z.len > 0 { in_z.c[0] + c } else { c };
                    in_z.len = in_z.len.max(1);
                }
                Step::TimesZ => in_z.times(origin.z, dir.z),
                Step::TimesY => in_y.times(origin.y, dir.y),
                Step::TimesX => in_x.times(origin.x, dir.x),
                Step::ToY => in_y.take(&mut in_z),
                Step::ToX => in_x.take(&mut in_y),
            }
        }
        in_x
    }

    /// Lanes in which a quartic is surely of one sign: most rays miss. With the sign of its first coefficient, `c0 + c1 s + a s^2` and
    /// `b s^2 + c3 s^3 + c4 s^4` are both positive if `c1^2 < 4 a c0` and `c3^2 < 4 b c4`, and `a + b` may be up to `c2`.
    fn has_one_sign(&self) -> Mask<f64x8> {
        if N < 5 || self.len != 5 {
            return Mask::none_set();
        }
        let [c0, c1, c2, c3, c4] = [0, 1, 2, 3, 4].map(|k| self.c[k]);
        let (zero, quarter) = (f64x8::zero(), f64x8::lit(0.25));
        let sign = c4.lt(zero);
        let signed = |c: f64x8| sign.select(-c, c);
        let (c0, c2, c4) = (signed(c0), signed(c2), signed(c4));
        let needed = (c1 * c1 / c0 + c3 * c3 / c4) * quarter;
        c0.gt(zero) & c4.gt(zero) & needed.lt(c2 * f64x8::lit(1.0 - SURE_ROOM))
    }

    /// Divided by its unknown, in the lanes given, where its constant term counts as 0.
    fn divide(&mut self, lanes: Mask<f64x8>) {
        for k in 0..self.len {
            let next = if k + 1 < self.len { self.c[k + 1] } else { f64x8::zero() };
            self.c[k] = lanes.select(next, self.c[k]);
        }
    }

    /// Its `r`th derivative, divided by the factorial of `r`.
    fn derivative(&self, r: usize) -> Self {
        let mut out = Self { c: [f64x8::zero(); N], len: self.len - r };
        let mut binomial = 1.0;
        for k in 0..out.len {
            out.c[k] = self.c[k + r] * f64x8::lit(binomial);
            binomial *= (k + r + 1) as f64 / (k + 1) as f64;
        }
        out
    }

    #[inline(always)]
    fn value(&self, s: f64x8) -> f64x8 {
        self.c[..self.len].iter().rev().fold(f64x8::zero(), |sum, &c| sum.fused(s, c))
    }

    #[inline(always)]
    fn value_and_slope(&self, s: f64x8) -> (f64x8, f64x8) {
        let mut value = f64x8::zero();
        let mut slope = f64x8::zero();
        for &c in self.c[..self.len].iter().rev() {
            slope = slope.fused(s, value);
            value = value.fused(s, c);
        }
        (value, slope)
    }

    /// The root between `low` and `high`, at which the values' signs differ, in the active lanes.
    ///
    /// Newton's steps where they stay in the bracket and halve the step before, else its middle (Press et al.,
    /// Numerical Recipes, section 9.4). Lanes stop one by one, so what a lane gets does not depend on its neighbours.
    fn bracketed(
        &self,
        [low, high]: [f64x8; 2],
        [at_low, at_high]: [f64x8; 2],
        grain: f64x8,
        active: Mask<f64x8>,
    ) -> f64x8 {
        let low_is_negative = at_low.lt(f64x8::zero());
        let (mut low, mut high, half) = (low, high, f64x8::lit(0.5));
        let guess = self.guess([low, high], [at_low, at_high]);
        let inside = guess.gt(low) & guess.lt(high);
        let mut s = inside.select(guess, (low + high) * half);
        let (mut before, mut moving) = (high - low, active);
        for _ in 0..STEPS {
            let (value, slope) = self.value_and_slope(s);
            let on_low_side = !(value.lt(f64x8::zero()) ^ low_is_negative);
            low = on_low_side.select(s, low);
            high = on_low_side.select(high, s);
            let step = value / slope;
            let newton = s - step;
            let good = newton.gt(low) & newton.lt(high) & (step + step).abs().le(before);
            let next = good.select(newton, (low + high) * half);
            before = (next - s).abs();
            s = moving.select(next, s);
            let enough = good.select(f64x8::lit(SETTLED), f64x8::lit(f64::UNIT_ROUNDOFF));
            moving &= before.gt((s.abs() + grain) * enough);
            if moving.none() {
                break;
            }
        }
        s
    }

    /// A first guess at the root in a bracket: that of the parabola which touches at the bracket's end where the value is
    /// smaller. Ends are places where the slope is 0, mostly, so that Newton's method could not start from there.
    #[inline(always)]
    fn guess(&self, [low, high]: [f64x8; 2], [at_low, at_high]: [f64x8; 2]) -> f64x8 {
        let from_low = at_low.abs().le(at_high.abs());
        let (end, value) = (from_low.select(low, high), from_low.select(at_low, at_high));
        let (mut c, mut b, mut a) = (f64x8::zero(), f64x8::zero(), f64x8::zero());
        for &k in self.c[..self.len].iter().rev() {
            a = a.fused(end, b);
            b = b.fused(end, c);
            c = c.fused(end, k);
        }
        // Of the two roots that on the bracket's side: up from the low end, down from the high one.
        let root = (b * b - a * value * f64x8::lit(4.0)).sqrt();
        let toward = from_low.select(-value, value);
        end - (value + value) / (b + root.copysign(toward))
    }

    /// Where a quadratic parts the line into pieces of one sign: its roots, rising, or ends of the stretch.
    fn parted(&self, [low, high]: [f64x8; 2]) -> [f64x8; 2] {
        let [c, b, a] = [self.c[0], self.c[1], self.c[2]];
        let discriminant = b * b - a * c * f64x8::lit(4.0);
        // Of the two roots neither cancels: one over the quadratic's coefficient, one under its constant term.
        let q = (b + discriminant.sqrt().copysign(b)) * f64x8::lit(-0.5);
        // NaN, where there is no root, becomes the far end: it loses every comparison.
        let within = |x: f64x8| low.max(x.min(high));
        let (x, y) = (within(q / a), within(c / q));
        [x.min(y), x.max(y)]
    }

    /// Where a cubic parts the line into pieces of one sign: its roots, rising, or ends of the stretch; `None` if some lane's
    /// is hardly one.
    fn parted_by_cubic(&self, [low, high]: [f64x8; 2], lanes: Mask<f64x8>) -> Option<[f64x8; 3]> {
        let lead = self.c[3];
        let most = self.c[0].abs().max(self.c[1].abs()).max(self.c[2].abs());
        if (lanes & !most.le(lead.abs() * f64x8::lit(STEEPEST))).any() {
            return None;
        }
        let inv = f64x8::lit(1.0) / lead;
        let (far, pair) = cubic(self.c[2] * inv, self.c[1] * inv, self.c[0] * inv, lanes);
        let half = pair.square.sqrt(); // NaN where the cubic has one root.
        let placed = [far, pair.middle - half, pair.middle + half].map(|s| {
            // One more step, since at a gap of g between roots their rounding is divided by g.
            let (value, slope) = self.value_and_slope(s);
            let next = s - value / slope;
            let better = (next - s).abs().le((s.abs() + f64x8::lit(1.0)) * f64x8::lit(SETTLED).sqrt());
            // NaN loses every comparison: no root is the far end.
            low.max(better.select(next, s).min(high))
        });
        let [a, b, c] = placed;
        let (a, b) = (a.min(b), a.max(b));
        let (b, c) = (b.min(c), b.max(c));
        Some([a.min(b), a.max(b), c])
    }

    /// The real roots between the two `ends`, rising, as many as the degree, NaN where there is none. Roots of even
    /// multiplicity are no crossings and are left out. `grain` is what a root's rounding is measured by beside the root.
    /// Each is shown to `go_on` with the lanes that have it, which says in which lanes more are wanted.
    fn roots(
        &self,
        ends: [f64x8; 2],
        grain: f64x8,
        lanes: Mask<f64x8>,
        mut go_on: impl FnMut(f64x8, Mask<f64x8>) -> Mask<f64x8>,
    ) -> [f64x8; N] {
        let none = f64x8::lit(f64::NAN);
        let degree = self.len.saturating_sub(1);
        // Roots of the derivative before, or the ends of the brackets that have none: they part the line all the same.
        let mut points = [none; N];
        let mut first = 1;
        if degree > 3
            && let Some(parted) = self.derivative(degree - 3).parted_by_cubic(ends, lanes)
        {
            points[..3].copy_from_slice(&parted);
            first = 4;
        } else if degree > 2 {
            points[..2].copy_from_slice(&self.derivative(degree - 2).parted(ends));
            first = 3;
        }
        let mut lanes = lanes;
        for m in first..=degree {
            let derivative = self.derivative(degree - m);
            let mut found = [none; N];
            let mut low = ends[0];
            let mut at_low = derivative.value(low);
            for k in 0..m {
                let high = if k + 1 == m { ends[1] } else { points[k] };
                let at_high = derivative.value(high);
                let crosses = (at_low.lt(f64x8::zero()) ^ at_high.lt(f64x8::zero())) & lanes;
                let mut root = high;
                if crosses.any() {
                    root = derivative.bracketed([low, high], [at_low, at_high], grain, crosses);
                }
                found[k] = crosses.select(root, if m == degree { none } else { high });
                if m == degree && crosses.any() {
                    lanes &= go_on(root, crosses);
                    if lanes.none() {
                        break;
                    }
                }
                (low, at_low) = (high, at_high);
            }
            points = found;
        }
        points
    }
}

/// Value and gradient of a polynomial.
fn gradient(polynomial: &Polynomial, p: Vec3<f64x8>) -> (f64x8, Vec3<f64x8>) {
    let zero = f64x8::zero();
    let (order, mut coefficients) = (polynomial.order(), polynomial.coefficients().iter());
    // A Horner scheme in each unknown, with the derivatives carried along.
    let (mut f, mut f_x, mut f_y, mut f_z) = (zero, zero, zero, zero);
    for i in 0..=order {
        let (mut g, mut g_y, mut g_z) = (zero, zero, zero);
        for j in 0..=i {
            let (mut h, mut h_z) = (zero, zero);
            for _ in 0..=j {
                h_z = h_z.fused(p.z, h);
                h = h.fused(p.z, f64x8::splat(coefficients.next().copied().unwrap_or_default()));
            }
            g_y = g_y.fused(p.y, g);
            g_z = g_z.fused(p.y, h_z);
            g = g.fused(p.y, h);
        }
        f_x = f_x.fused(p.x, f);
        f_y = f_y.fused(p.x, g_y);
        f_z = f_z.fused(p.x, g_z);
        f = f.fused(p.x, g);
    }
    (f, Vec3::new(f_x, f_y, f_z))
}

/// A ray's polynomial and where its unknown is 0.
struct Ray<const N: usize> {
    along: Univariate<N>,
    /// Distance from the ray's start to the place where the unknown is 0.
    base: f64x8,
    /// Length of one unit of `t` in own space, inverted.
    inv: f64x8,
    /// No root lies farther from 0.
    reach: f64x8,
    /// The size of the coordinates at 0.
    grain: f64x8,
    sound: Mask<f64x8>,
}

impl<S: Scalar> Polynomials<S> {
    /// Adds the image of a surface.
    pub fn push(&mut self, world_from_object: &Transform, polynomial: &Arc<Polynomial>) {
        self.frames.push(world_from_object);
        // Copies of one surface mostly come one after the other.
        let steps = match (self.polynomial.last(), self.steps.last()) {
            (Some(last), Some(steps)) if Arc::ptr_eq(last, polynomial) => steps.clone(),
            _ => steps(polynomial).into(),
        };
        self.steps.push(steps);
        self.polynomial.push(polynomial.clone());
        self.bounds.push(Aabb::INFINITE);
    }

    /// The scene vouches for the bounds of the last row.
    pub fn bound_last(&mut self, bounds: Aabb) {
        if let Some(last) = self.bounds.last_mut() {
            *last = bounds;
        }
    }

    fn own_rays(&self, i: usize, rays: &Rays<S::Lane>) -> Rays<f64x8> {
        self.frames.at(i).in_f64().rays(&rays.in_f64())
    }

    /// The polynomial along the rays, from their starts in the lanes of `on` and else from the closest point to the middle.
    fn ray<const N: usize>(&self, i: usize, own: &Rays<f64x8>, on: Mask<f64x8>) -> Ray<N> {
        let inv = f64x8::lit(1.0) / own.dir.length();
        let dir = own.dir * inv;
        // Twice: the first step leaves the rounding of a far start along the ray.
        let coarse = -own.origin.dot(dir);
        let near = own.origin + dir * coarse;
        let fine = -near.dot(dir);
        let origin = Vec3::select(on, own.origin, near + dir * fine);
        let base = on.select(f64x8::zero(), coarse + fine);
        let along = Univariate::along(&self.steps[i], origin, dir, false);
        // Cauchy's bound of the roots.
        let (lead, rest) = along.c[..along.len].split_last().unwrap_or((&origin.x, &[]));
        let most = rest.iter().fold(f64x8::zero(), |most, c| c.abs().max(most));
        let reach = f64x8::lit(REACH).min(f64x8::lit(1.0) + most / lead.abs());
        let sound = (base + most + lead.abs()).abs().lt(f64x8::lit(f64::INFINITY));
        Ray { along, base, inv, reach, grain: origin.abs().max_element(), sound }
    }

    /// Crossings, rising; with `looking` only the first of them is sure to be there, and it is the last that is.
    fn crossings<const N: usize>(
        &self,
        i: usize,
        rays: &Rays<S::Lane>,
        left: Option<&Left<S::Lane>>,
        looking: Option<&Looking<S::Lane>>,
    ) -> SmallVec<[S::Lane; 4]> {
        let own = self.own_rays(i, rays);
        let on = left.map_or(Mask::none_set(), |left| left.on.cast());
        let mut ray = self.ray::<N>(i, &own, on);
        let (mut ends, mut lanes) = ([-ray.reach, ray.reach], ray.sound);
        if let Some(looking) = looking {
            // Wider by more than the roundings of this and of the distance that comes of a root.
            let [near, far] = [looking.from, looking.to].map(|t| t.to_f64s() / ray.inv);
            let room =
                |s: f64x8| (s.abs() + ray.base.abs()) * f64x8::lit(RANGE_ROUNDINGS * f64::UNIT_ROUNDOFF);
            ends[0] = ((near - ray.base) - room(near)).max(ends[0]);
            ends[1] = ((far - ray.base) + room(far)).min(ends[1]);
            lanes &= Mask::from_bits(looking.lanes) & ends[0].le(ends[1]);
            if lanes.none() {
                return SmallVec::new();
            }
        }
        let most = ray.along.len.saturating_sub(1);
        if looking.is_some() {
            // (Not so where the start is a root.)
            lanes &= !ray.along.has_one_sign() | on;
            if lanes.none() {
                return SmallVec::new();
            }
        }
        let mut starts = [f64x8::lit(f64::NAN); 2];
        if on.any() {
            // The start is a root, and where the slope there is below its rounding it is a double one.
            let noise = self.slope_noise::<N>(i, rays, &own);
            ray.along.divide(on);
            let tangent = on & ray.along.c[0].abs().le(noise);
            ray.along.divide(tangent);
            starts = [on.select(f64x8::zero(), starts[0]), tangent.select(f64x8::zero(), starts[1])];
            if (on | !lanes).all() {
                // All have one root less.
                ray.along.len = most;
            }
        }
        let seen = |root: f64x8| {
            let t = S::Lane::from_f64s((ray.base + root) * ray.inv);
            looking.map_or(Mask::none_set(), |looking| t.gt(looking.from).cast())
        };
        let roots = ray.along.roots(ends, ray.grain, lanes, |root, crosses| !(crosses & seen(root)));
        let degree = ray.along.len.saturating_sub(1);
        let mut all: SmallVec<[f64x8; 4]> =
            roots[..degree].iter().map(|&s| (ray.base + s) * ray.inv).collect();
        if on.any() {
            for start in starts {
                insert(&mut all, start);
            }
            all.truncate(most);
        }
        all.into_iter().map(S::Lane::from_f64s).collect()
    }

    /// Where the polynomial is negative before all its roots.
    fn negative_far_back<const N: usize>(&self, i: usize, rays: &Rays<S::Lane>) -> Mask<S::Lane> {
        let ray = self.ray::<N>(i, &self.own_rays(i, rays), Mask::none_set());
        (ray.along.value(-ray.reach).lt(f64x8::zero()) & ray.sound).cast()
    }

    /// Bounds the rounding of the polynomial's slope at the rays' starts, along unit directions in own space: what the
    /// rounding of start and direction make of it, by the magnitudes of its terms.
    fn slope_noise<const N: usize>(&self, i: usize, rays: &Rays<S::Lane>, own: &Rays<f64x8>) -> f64x8 {
        let frame = self.frames.at(i);
        let inv = f64x8::lit(1.0) / own.dir.length();
        let tiny = f64x8::lit(f64::MIN_POSITIVE);
        let start: Vec3<f64x8> = widened(frame.start_error(rays));
        let turn: Vec3<f64x8> = widened(frame.direction_error(rays)) * inv;
        let (most, most_turn) = (start.max_element().max(tiny), turn.max_element().max(tiny));
        // Along the direction, the start's error and the direction's at once, each of about unit length: of the terms that
        // come of it, those wanted are some and none is negative.
        let dir =
            own.dir.abs() * inv + start * (f64x8::lit(1.0) / most) + turn * (f64x8::lit(1.0) / most_turn);
        let terms = Univariate::<N>::along(&self.steps[i], own.origin.abs(), dir, true);
        // The sums themselves: as many roundings as a term has factors, and some.
        let roundings = f64x8::lit(8.0 * terms.len as f64 * f64::UNIT_ROUNDOFF);
        terms.c[2] * most + terms.c[1] * (most_turn + roundings)
    }
}

/// Puts `x` in its place among rising numbers, NaN last, lane by lane.
fn insert(rising: &mut SmallVec<[f64x8; 4]>, mut x: f64x8) {
    let inf = f64x8::lit(f64::INFINITY);
    x = x.min(inf); // NaN counts as infinity.
    for y in rising.iter_mut() {
        let here = y.min(inf);
        (*y, x) = (here.min(x), here.max(x));
    }
    rising.push(x);
    for y in rising.iter_mut() {
        *y = y.lt(inf).select(*y, f64x8::lit(f64::NAN));
    }
}

/// Coefficients along a ray up to order 4, which most surfaces have, and up to the highest.
const FEW: usize = 5;
const MANY: usize = Polynomial::MAX_ORDER + 1;

impl<S: Scalar> Block<S> for Polynomials<S> {
    type Roots = SmallVec<[S::Lane; 4]>;

    fn len(&self) -> usize {
        self.polynomial.len()
    }

    #[inline]
    fn roots(&self, i: usize, rays: &Rays<S::Lane>, left: Option<&Left<S::Lane>>) -> Self::Roots {
        match self.polynomial[i].order() < FEW {
            true => self.crossings::<FEW>(i, rays, left, None),
            false => self.crossings::<MANY>(i, rays, left, None),
        }
    }

    #[inline]
    fn first(
        &self,
        i: usize,
        rays: &Rays<S::Lane>,
        _view: &View<S::Lane>,
        left: Option<&Left<S::Lane>>,
        looking: &Looking<S::Lane>,
    ) -> S::Lane {
        let roots = match self.polynomial[i].order() < FEW {
            true => self.crossings::<FEW>(i, rays, left, Some(looking)),
            false => self.crossings::<MANY>(i, rays, left, Some(looking)),
        };
        first_beyond(&roots, looking.from)
    }

    /// Where the polynomial is negative, farther out than all its roots.
    fn starts_inside(&self, i: usize, rays: &Rays<S::Lane>) -> Mask<S::Lane> {
        match self.polynomial[i].order() < FEW {
            true => self.negative_far_back::<FEW>(i, rays),
            false => self.negative_far_back::<MANY>(i, rays),
        }
    }

    fn resolve(
        &self,
        index: &[u32; LANES],
        active: Mask<S::Lane>,
        rays: &Rays<S::Lane>,
        t: S::Lane,
    ) -> Surfaces<S::Lane> {
        let frame = self.frames.gathered(index).in_f64();
        let own = frame.rays(&rays.in_f64());
        let p = own.origin + own.dir * t.to_f64s();
        let (mut value, mut slope) = (f64x8::zero(), Vec3::<f64x8>::default());
        let mut waiting = active.bits();
        while waiting != 0 {
            let first = index[waiting.trailing_zeros() as usize];
            let same = index.iter().enumerate().fold(0u8, |same, (k, &i)| same | u8::from(i == first) << k);
            waiting &= !same;
            let mask = Mask::<f64x8>::from_bits(same);
            let (v, g) = gradient(&self.polynomial[first as usize], p);
            value = mask.select(v, value);
            slope = Vec3::select(mask, g, slope);
        }
        // A Newton step along the gradient puts the point on the surface. Where there is no gradient, at a cusp or where
        // sheets cross, any normal will do.
        let square = slope.dot(slope);
        let smooth = square.gt(f64x8::zero()) & square.lt(f64x8::lit(f64::INFINITY));
        let step = smooth.keep(value / square);
        let any = Vec3::new(f64x8::lit(1.0), f64x8::zero(), f64x8::zero());
        let normal = Vec3::select(smooth, slope, any);
        Surfaces {
            point: self.frames.to_world(index, narrowed(p - slope * step)),
            normal: narrowed(frame.normal(normal)),
            ..Default::default()
        }
    }

    fn bounds(&self, i: usize) -> Aabb {
        self.bounds[i]
    }

    fn permute(&mut self, order: &[u32]) {
        self.frames.permute(order);
        self.polynomial = order.iter().map(|&i| self.polynomial[i as usize].clone()).collect();
        self.steps = order.iter().map(|&i| self.steps[i as usize].clone()).collect();
        self.bounds = permuted(&self.bounds, order);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn quartics_of_one_sign_have_no_roots() {
        // ((s - a)^2 + u) ((s - b)^2 + v): roots where u or v is negative.
        let (mut told, mut open) = (0, 0);
        for k in 0..4000 {
            let digit = |n: u32| f64::from(k / 5u32.pow(n) % 5);
            let (a, b) = (digit(0) * 0.5 - 1.0, digit(1) * 0.3);
            let (u, v) = (digit(2) * 0.4 - 0.8, digit(3) * 0.4 - 0.3);
            let scale = if k % 2 == 0 { 3.0 } else { -0.2 };
            let (p, q) = ([a * a + u, -2.0 * a, 1.0], [b * b + v, -2.0 * b, 1.0]);
            let mut c = [f64x8::zero(); 5];
            for (i, x) in p.iter().enumerate() {
                for (j, y) in q.iter().enumerate() {
                    c[i + j] += f64x8::splat(x * y * scale);
                }
            }
            let one_sign = Univariate::<5> { c, len: 5 }.has_one_sign().bits();
            assert!(one_sign == 0 || (u > 0.0 && v > 0.0), "{a} {u} {b} {v}");
            told += u32::from(one_sign != 0);
            open += u32::from(u > 0.0 && v > 0.0 && one_sign == 0);
        }
        assert!(told > open, "{told} told, {open} left open");
    }

    #[test]
    fn what_is_left_out_is_zero() {
        // Every coefficient by itself: along (s, 2 s + 1, 3 s - 1) at s = 1 the powers of 1, 3 and 2.
        for order in [1, 2, 4] {
            for (place, [i, j, k]) in Polynomial::exponents(order).enumerate() {
                let mut coefficients = vec![0.0; Polynomial::terms(order)];
                coefficients[place] = -0.5;
                *coefficients.last_mut().expect("a constant") += 8.0;
                let polynomial = Polynomial::new(order, coefficients).expect("sound");
                let (origin, dir) = (DVec3::new(0.0, 1.0, -1.0), DVec3::new(1.0, 2.0, 3.0));
                let along =
                    Univariate::<5>::along(&steps(&polynomial), Vec3::splat(origin), Vec3::splat(dir), false);
                let expected = 8.0 - 0.5 * 3f64.powi(j as i32) * 2f64.powi(k as i32);
                assert_eq!(along.value(f64x8::lit(1.0)).to_array()[0], expected, "x^{i} y^{j} z^{k}");
            }
        }
    }
}
