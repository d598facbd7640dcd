//! Double-double arithmetic: a number as the unevaluated sum of two f64, about 106 bits (Dekker 1971; Joldes, Muller,
//! Popescu, TOMS 44(2), 2017). Small and slow: what the kernels are held against.

use std::cmp::Ordering;
use std::ops::{Add, Div, Mul, Neg, Sub};

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dd {
    pub hi: f64,
    pub lo: f64,
}

pub const ZERO: Dd = Dd { hi: 0.0, lo: 0.0 };

impl From<f64> for Dd {
    fn from(hi: f64) -> Self {
        Self { hi, lo: 0.0 }
    }
}

/// `a + b` exactly.
fn two_sum(a: f64, b: f64) -> Dd {
    let hi = a + b;
    let bb = hi - a;
    Dd { hi, lo: (a - (hi - bb)) + (b - bb) }
}

/// The same where `|a| >= |b|`.
fn quick_two_sum(a: f64, b: f64) -> Dd {
    let hi = a + b;
    Dd { hi, lo: b - (hi - a) }
}

impl Add for Dd {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        let (s, t) = (two_sum(self.hi, o.hi), two_sum(self.lo, o.lo));
        let s = quick_two_sum(s.hi, s.lo + t.hi);
        quick_two_sum(s.hi, s.lo + t.lo)
    }
}

impl Neg for Dd {
    type Output = Self;
    fn neg(self) -> Self {
        Self { hi: -self.hi, lo: -self.lo }
    }
}

impl Sub for Dd {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        self + -o
    }
}

impl Mul for Dd {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        let hi = self.hi * o.hi;
        let error = self.hi.mul_add(o.hi, -hi);
        quick_two_sum(hi, error + (self.hi * o.lo + self.lo * o.hi))
    }
}

impl Div for Dd {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        let q1 = self.hi / o.hi;
        if !q1.is_finite() {
            return q1.into();
        }
        let rest = self - o * q1.into();
        let q2 = rest.hi / o.hi;
        let rest = rest - o * q2.into();
        Dd::from(q1) + q2.into() + (rest.hi / o.hi).into()
    }
}

impl PartialOrd for Dd {
    fn partial_cmp(&self, o: &Self) -> Option<Ordering> {
        self.hi.partial_cmp(&o.hi).map(|order| order.then_with(|| self.lo.total_cmp(&o.lo)))
    }
}

impl Dd {
    /// Square root; the caller has made sure that it is of a number not below 0.
    pub fn sqrt(self) -> Self {
        if self.hi <= 0.0 {
            return ZERO;
        }
        let x = self.hi.sqrt();
        let rest = self - Dd::from(x) * x.into();
        let once = quick_two_sum(x, rest.hi / (2.0 * x));
        let rest = self - once * once;
        once + (rest.hi / (2.0 * x)).into()
    }

    pub fn abs(self) -> Self {
        if self.hi < 0.0 { -self } else { self }
    }

    pub fn f64(self) -> f64 {
        self.hi
    }
}

/// Three numbers.
pub type V = [Dd; 3];

pub fn dot(a: V, b: V) -> Dd {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The point at `t` on a ray.
pub fn at(o: V, d: V, t: Dd) -> V {
    [o[0] + d[0] * t, o[1] + d[1] * t, o[2] + d[2] * t]
}

/// Real roots of `a t^2 + 2 b t + c`, rising; a double root twice.
pub fn quadratic(a: Dd, b: Dd, c: Dd) -> Vec<Dd> {
    if a == ZERO {
        return if b == ZERO { vec![] } else { vec![-c / (b + b)] };
    }
    let discriminant = b * b - a * c;
    if discriminant < ZERO {
        return vec![];
    }
    let root = discriminant.sqrt();
    let q = if b < ZERO { root - b } else { -(b + root) };
    let mut roots = if q == ZERO { vec![ZERO, ZERO] } else { vec![c / q, q / a] };
    roots.sort_by(|x, y| x.partial_cmp(y).unwrap());
    roots
}

/// Real roots of a polynomial (coefficients from the constant on) between `-reach` and `reach`, by the roots of its
/// derivative: between two of them it is monotonic. A double root is found twice if its value is of either sign.
pub fn polynomial(p: &[Dd], reach: Dd) -> Vec<Dd> {
    let value = |t: Dd| p.iter().rev().fold(ZERO, |sum, &c| sum * t + c);
    if p.len() == 2 {
        let t = -p[0] / p[1];
        return if t.abs() <= reach { vec![t] } else { vec![] };
    }
    let derivative: Vec<Dd> = p.iter().enumerate().skip(1).map(|(k, &c)| c * (k as f64).into()).collect();
    let slope = |t: Dd| derivative.iter().rev().fold(ZERO, |sum, &c| sum * t + c);
    let mut ends = vec![-reach];
    ends.extend(polynomial(&derivative, reach));
    ends.push(reach);
    let mut roots = Vec::new();
    for pair in ends.windows(2) {
        let (mut low, mut high) = (pair[0], pair[1]);
        let (at_low, at_high) = (value(low), value(high));
        if (at_low < ZERO) == (at_high < ZERO) {
            continue;
        }
        let mut t = (low + high) * 0.5.into();
        for _ in 0..200 {
            let v = value(t);
            if (v < ZERO) == (at_low < ZERO) {
                low = t
            } else {
                high = t
            }
            let newton = t - v / slope(t);
            let within = newton > low && newton < high;
            let next = if within { newton } else { (low + high) * 0.5.into() };
            let done = (next - t).abs().f64() <= 1e-30 * reach.f64();
            t = next;
            if done || (high - low).f64() <= 1e-30 * reach.f64() {
                break;
            }
        }
        roots.push(t);
    }
    roots
}
