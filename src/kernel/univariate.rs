//! Polynomials in one unknown, eight at a time: what a polynomial surface is along rays, and its roots.

use super::quartic::{SETTLED, cubic};
use crate::lane::{Lane, Mask, Scalar, Vec3, f64x8};
use crate::scene::Polynomial;

/// A cubic whose coefficients are larger than this many times the first is left to brackets: solved as it stands it
/// would lose more than a third of its digits.
const STEEPEST: f64 = (1u64 << 18) as f64;

/// Quartics that are positive by less than this share of their terms are left to brackets: far more than rounding.
const SURE_ROOM: f64 = 1.0 / (1u64 << 30) as f64;

/// Steps at most in a bracket: every second step halves it at least, and it holds 53 bits.
const STEPS: usize = 110;

/// A step of a Horner scheme in z within one in y within one in x, which leaves out what is zero: most coefficients are.
#[derive(Debug, Clone, Copy)]
pub(super) enum Step {
    /// Adds to what is in z,
    ConstantZ(f64),
    /// or at once to what is in y or x, where nothing else would come with it.
    ConstantY(f64),
    ConstantX(f64),
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
pub(super) fn steps(polynomial: &Polynomial) -> Vec<Step> {
    let (order, mut coefficients) = (polynomial.order(), polynomial.coefficients().iter());
    let mut steps = Vec::new();
    let mut any_x = false;
    for i in 0..=order {
        if any_x {
            steps.push(Step::TimesX);
        }
        let (mut any_y, first) = (false, steps.len());
        for j in 0..=i {
            if any_y {
                steps.push(Step::TimesY);
            }
            let (mut any_z, first) = (false, steps.len());
            for _ in 0..=j {
                if any_z {
                    steps.push(Step::TimesZ);
                }
                if let Some(&c) = coefficients.next().filter(|c| **c != 0.0) {
                    steps.push(Step::ConstantZ(c));
                    any_z = true;
                }
            }
            if any_z {
                match steps[first..] {
                    [Step::ConstantZ(c)] => steps[first] = Step::ConstantY(c),
                    _ => steps.push(Step::ToY),
                }
                any_y = true;
            }
        }
        if any_y {
            match steps[first..] {
                [Step::ConstantY(c)] => steps[first] = Step::ConstantX(c),
                _ => steps.push(Step::ToX),
            }
            any_x = true;
        }
    }
    steps
}

/// What a polynomial is summed up in.
pub(super) trait Sum: Sized {
    /// What x, y and z are.
    type Unknown: Copy;

    /// Adds a constant.
    fn add(&mut self, c: f64);

    /// Times an unknown.
    fn times(&mut self, unknown: Self::Unknown);

    /// Adds another, of which nothing is left.
    fn take(&mut self, other: &mut Self);
}

/// Sums up a polynomial of x, y and z in the first of three sums of which there is nothing yet; constants by way of `signed`.
#[inline(always)]
pub(super) fn sum_up<S: Sum>(
    steps: &[Step],
    [x, y, z]: [S::Unknown; 3],
    in_x: &mut S,
    [mut in_y, mut in_z]: [S; 2],
    signed: impl Fn(f64) -> f64,
) {
    for step in steps {
        match *step {
            Step::ConstantZ(c) => in_z.add(signed(c)),
            Step::ConstantY(c) => in_y.add(signed(c)),
            Step::ConstantX(c) => in_x.add(signed(c)),
            Step::TimesZ => in_z.times(z),
            Step::TimesY => in_y.times(y),
            Step::TimesX => in_x.times(x),
            Step::ToY => in_y.take(&mut in_z),
            Step::ToX => in_x.take(&mut in_y),
        }
    }
}

/// A polynomial in one unknown per lane: `c[k]` belongs to the `k`th power, `len` of them are in use.
#[derive(Debug, Clone, Copy)]
pub(super) struct Univariate<const N: usize> {
    pub(super) c: [f64x8; N],
    pub(super) len: usize,
}

impl<const N: usize> Sum for Univariate<N> {
    /// `origin + s dir`, by those two.
    type Unknown = (f64x8, f64x8);

    #[inline(always)]
    fn add(&mut self, c: f64) {
        let c = f64x8::splat(c);
        self.c[0] = if self.len > 0 { self.c[0] + c } else { c };
        self.len = self.len.max(1);
    }

    #[inline(always)]
    fn times(&mut self, (origin, dir): Self::Unknown) {
        // Loops of known length are laid out flat, and most are short.
        match self.len {
            0 => {}
            1 => self.times_up_to(1, origin, dir),
            2 => self.times_up_to(2, origin, dir),
            3 => self.times_up_to(3, origin, dir),
            4 => self.times_up_to(4, origin, dir),
            len => self.times_up_to(len, origin, dir),
        }
    }

    #[inline(always)]
    fn take(&mut self, other: &mut Self) {
        for k in 0..other.len {
            self.c[k] = if k < self.len { self.c[k] + other.c[k] } else { other.c[k] };
        }
        self.len = self.len.max(other.len);
        other.len = 0;
    }
}

impl<const N: usize> Univariate<N> {
    pub(super) fn zero() -> Self {
        Self { c: [f64x8::zero(); N], len: 0 }
    }

    /// A constant, a slope and a square.
    #[inline(always)]
    pub(super) fn quadratic(three: [f64x8; 3]) -> Self {
        let mut c = [f64x8::zero(); N];
        for (c, of_power) in c.iter_mut().zip(three) {
            *c = of_power.in_register();
        }
        Self { c, len: 3 }
    }

    #[inline(always)]
    fn times_up_to(&mut self, len: usize, origin: f64x8, dir: f64x8) {
        self.c[len] = self.c[len - 1] * dir;
        for k in (1..len).rev() {
            self.c[k] = self.c[k].fused(origin, self.c[k - 1] * dir);
        }
        self.c[0] *= origin;
        self.len = len + 1;
    }

    /// Becomes, from nothing, a polynomial along the line, or what its terms' magnitudes sum to.
    pub(super) fn go_along(
        &mut self,
        steps: &[Step],
        origin: Vec3<f64x8>,
        dir: Vec3<f64x8>,
        magnitudes: bool,
    ) {
        let unknowns = [(origin.x, dir.x), (origin.y, dir.y), (origin.z, dir.z)];
        let signed = |c: f64| if magnitudes { c.abs() } else { c };
        sum_up(steps, unknowns, self, [Self::zero(); 2], signed);
    }

    /// Lanes in which a quadratic or a quartic is surely of one sign: most rays miss. Of a quartic, with the sign of its first
    /// coefficient, `c0 + c1 s + a s^2` and `b s^2 + c3 s^3 + c4 s^4` are both positive if `c1^2 < 4 a c0` and `c3^2 < 4 b c4`, and
    /// `a + b` may be up to `c2`.
    pub(super) fn has_one_sign(&self) -> Mask<f64x8> {
        if self.len == 3 {
            let needed = self.c[1] * self.c[1];
            return needed.lt(self.c[0] * self.c[2] * f64x8::lit(4.0 * (1.0 - SURE_ROOM)));
        }
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
    pub(super) fn divide(&mut self, lanes: Mask<f64x8>) {
        for k in 0..self.len {
            let next = if k + 1 < self.len { self.c[k + 1] } else { f64x8::zero() };
            self.c[k] = lanes.select(next, self.c[k]);
        }
    }

    /// Its `r`th derivative, divided by the factorial of `r`.
    pub(super) fn derivative(&self, r: usize) -> Self {
        let mut out = Self { c: [f64x8::zero(); N], len: self.len - r };
        let mut binomial = 1.0;
        for k in 0..out.len {
            out.c[k] = self.c[k + r] * f64x8::lit(binomial);
            binomial *= (k + r + 1) as f64 / (k + 1) as f64;
        }
        out
    }

    #[inline(always)]
    pub(super) fn value(&self, s: f64x8) -> f64x8 {
        self.c[..self.len].iter().rev().fold(f64x8::zero(), |sum, &c| sum.fused(s, c))
    }

    #[inline(always)]
    pub(super) fn value_and_slope(&self, s: f64x8) -> (f64x8, f64x8) {
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
    pub(super) fn bracketed(
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
            // A step below rounding is the last one, though it leads to an end: the middle would lead away again.
            let good = newton.equal(s) | (newton.gt(low) & newton.lt(high) & (step + step).abs().le(before));
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
    pub(super) fn guess(&self, [low, high]: [f64x8; 2], [at_low, at_high]: [f64x8; 2]) -> f64x8 {
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

    /// A quadratic's two roots, in no order; NaN where there is none. Neither cancels: one is over the quadratic's coefficient, one
    /// under its constant term.
    #[inline(always)]
    fn pair(&self) -> [f64x8; 2] {
        let [c, b, a] = [self.c[0], self.c[1], self.c[2]];
        let discriminant = b * b - a * c * f64x8::lit(4.0);
        let q = (b + discriminant.sqrt().copysign(b)) * f64x8::lit(-0.5);
        [q / a, c / q]
    }

    /// [`Univariate::roots`] of a quadratic, or in some lanes of less.
    #[inline(always)]
    fn pair_within(
        &self,
        [low, high]: [f64x8; 2],
        mut lanes: Mask<f64x8>,
        mut go_on: impl FnMut(f64x8, Mask<f64x8>) -> Mask<f64x8>,
    ) -> [f64x8; N] {
        let [x, y] = self.pair();
        // (Where both are one place nothing is crossed.)
        let (down, crossed) = (y.lt(x), !y.equal(x));
        let mut found = [f64x8::lit(f64::NAN); N];
        for (found, root) in found.iter_mut().zip([down.select(y, x), down.select(x, y)]) {
            let here = crossed & root.ge(low) & root.le(high) & lanes;
            *found = here.select(root, *found);
            if here.any() {
                lanes &= go_on(root, here);
                if lanes.none() {
                    break;
                }
            }
        }
        found
    }

    /// Where a quadratic parts the line into pieces of one sign: its roots, rising, or ends of the stretch.
    pub(super) fn parted(&self, [low, high]: [f64x8; 2]) -> [f64x8; 2] {
        // NaN, where there is no root, becomes the far end: it loses every comparison.
        let [x, y] = self.pair().map(|x| low.max(x.min(high)));
        [x.min(y), x.max(y)]
    }

    /// Where a cubic parts the line into pieces of one sign: its roots, rising, or ends of the stretch; `None` if some lane's
    /// is hardly one.
    pub(super) fn parted_by_cubic(&self, [low, high]: [f64x8; 2], lanes: Mask<f64x8>) -> Option<[f64x8; 3]> {
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
    pub(super) fn roots(
        &self,
        ends: [f64x8; 2],
        grain: f64x8,
        lanes: Mask<f64x8>,
        mut go_on: impl FnMut(f64x8, Mask<f64x8>) -> Mask<f64x8>,
    ) -> [f64x8; N] {
        let none = f64x8::lit(f64::NAN);
        let degree = self.len.saturating_sub(1);
        if degree == 2 {
            return self.pair_within(ends, lanes, go_on);
        }
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
    fn quadratics_have_their_roots_within_the_ends() {
        let (all, open) = (Mask::all_set(), |_, _| Mask::all_set());
        let ends = [f64x8::lit(-2.0), f64x8::lit(2.0)];
        for k in 0..5000 {
            let digit = |n: u32| f64::from(k / 9u32.pow(n) % 9) * 0.5 - 2.25;
            // (All of it exact, also where the two are one.)
            let (a, b, scale) = (digit(0), digit(1), if k % 2 == 0 { 4.0 } else { -0.25 });
            // scale (s - a) (s - b); every third one linear: scale (s - a).
            let c = if k % 3 == 0 { [-a, 1.0, 0.0] } else { [a * b, -a - b, 1.0] };
            let along = Univariate::<3>::quadratic(c.map(|c| f64x8::splat(c * scale)));
            let found = along.roots(ends, f64x8::lit(1.0), all, open).map(|root| root.to_array()[5]);
            let mut expected = if k % 3 == 0 { vec![a] } else { vec![a.min(b), a.max(b)] };
            // What is touched is not crossed.
            expected.retain(|root| root.abs() <= 2.0 && (k % 3 == 0 || a != b));
            let found: Vec<f64> = found.into_iter().filter(|root| !root.is_nan()).collect();
            assert_eq!(found.len(), expected.len(), "{a} {b}: {found:?}");
            assert!(
                found.iter().zip(&expected).all(|(x, y)| (x - y).abs() < 1e-15 * 8.0),
                "{a} {b}: {found:?}"
            );
        }
        // What misses is told from its coefficients.
        let miss = Univariate::<3>::quadratic([1.0, -1.9, 1.0].map(f64x8::lit));
        let graze = Univariate::<3>::quadratic([1.0, -2.0, 1.0].map(f64x8::lit));
        assert!(miss.has_one_sign().all() && graze.has_one_sign().none());
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
                let mut along = Univariate::<5>::zero();
                along.go_along(&steps(&polynomial), Vec3::splat(origin), Vec3::splat(dir), false);
                let expected = 8.0 - 0.5 * 3f64.powi(j as i32) * 2f64.powi(k as i32);
                assert_eq!(along.value(f64x8::lit(1.0)).to_array()[0], expected, "x^{i} y^{j} z^{k}");
            }
        }
    }
}
