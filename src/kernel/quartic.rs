//! Roots of cubics and quartics whose coefficients are of the order of 1, eight at a time, always in f64.
//!
//! What comes out is good to the square root of a rounding at worst (a double root) and is meant to be polished on
//! the shape itself.

use crate::lane::{Lane, Mask, f32x8, f64x8};

/// A Newton step below this, of shapes and roots of about 1, was the last one that mattered: its square is below a rounding,
/// even when the slope is some thousand times smaller than the curvature.
pub(super) const SETTLED: f64 = 1.0 / (1u64 << 40) as f64;

/// The root `C` of `4 C^3 - 3 C = w` from 0.866 to 1, by the powers of `w` from 0 to 1: right to 2e-4.
const SIXTH_OF_ANGLE: [f64; 4] = [0.8660254, 0.1667, -0.0425, 0.0098];

/// Two roots, `middle - sqrt(square)` and `middle + sqrt(square)`: none if `square` is negative or NaN.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair {
    /// Half their sum.
    pub middle: f64x8,
    /// The square of half their distance.
    pub square: f64x8,
}

/// The largest real root of `x^3 - 3 m x - 2 n` in the lanes given, to single precision: whoever asks goes on by Newton's steps, and
/// roots and quotients of doubles are slow.
fn largest_cubic_root(m: f64x8, n: f64x8, lanes: Mask<f64x8>) -> f64x8 {
    // What cancels is taken in double precision.
    let discriminant: f32x8 = (n * n - m * m * m).cast();
    let (m, n): (f32x8, f32x8) = (m.cast(), n.cast());
    let (zero, one) = (f32x8::zero(), f32x8::lit(1.0));
    let three = discriminant.lt(zero);
    // Three real roots: 2 sqrt(m) cos(arccos(z) / 3) with z = n / m^1.5. The half angle's cosine w avoids the infinite slope at
    // z = -1, where the largest root is double, and solving 4 C^3 - 3 C = w for C = cos(angle / 6), 0.86 to 1, replaces the
    // arc cosine: from a cubic that is right to 2e-4, a Newton step is right to 1e-7.
    let root_m = m.sqrt();
    let power = m * root_m;
    let sum = n.lt(zero).select(discriminant / (n - power), n + power);
    let w = Lane::min(Lane::max(sum / (power + power), zero), one).sqrt();
    let [a0, a1, a2, a3] = SIXTH_OF_ANGLE.map(f32x8::lit);
    let c = ((w * a3 + a2) * w + a1) * w + a0;
    let cc = c * c;
    let c =
        c - (c * (cc * f32x8::lit(4.0) - f32x8::lit(3.0)) - w) / (cc * f32x8::lit(12.0) - f32x8::lit(3.0));
    let trigonometric = root_m * (c * c * f32x8::lit(4.0) - f32x8::lit(2.0));
    if (three | !lanes.cast()).all() {
        return trigonometric.cast::<f64x8>().in_register();
    }
    // One real root, by Cardano: the cube root whose radicand does not cancel, and m over it.
    let cube = (n.abs() + Lane::max(discriminant, zero).sqrt()).cbrt();
    let cardano = cube.gt(zero).keep((cube + m / cube).copysign(n));
    three.select(trigonometric, cardano).cast::<f64x8>().in_register()
}

/// The real roots of `s^4 + p s^2 + q s + c` in the lanes given, in two pairs: the lower two and the upper two where all are real.
///
/// Ferrari's factors `(s^2 + a s + b1) (s^2 - a s + b2)` with the largest root `a^2` of the resolvent, which belongs
/// to neighbouring roots and is then simple where the quartic has a double root at an end.
pub(super) fn quartic(p: f64x8, q: f64x8, c: f64x8, lanes: Mask<f64x8>) -> [Pair; 2] {
    let (zero, half) = (f64x8::zero(), f64x8::lit(0.5));
    // Resolvent y^3 + 2 p y^2 + k y - q^2, and the same in x = y + 2 p / 3.
    let k = p * p - c * f64x8::lit(4.0);
    let m = p * p * f64x8::lit(1.0 / 9.0) + c * f64x8::lit(4.0 / 3.0);
    let n = p * (p * p * f64x8::lit(1.0 / 27.0) - c * f64x8::lit(4.0 / 3.0)) + q * q * half;
    let two_p = p + p;
    let mut y = (largest_cubic_root(m, n, lanes) - two_p * f64x8::lit(1.0 / 3.0)).max(zero);
    for _ in 0..2 {
        // The subtraction above cancels where y is small; the resolvent itself does not.
        let value = ((y + two_p) * y + k) * y - q * q;
        let slope = (y * f64x8::lit(3.0) + two_p * f64x8::lit(2.0)) * y + k;
        let next = y - value / slope;
        // False on NaN: at a double root the step is 0/0, and y stays.
        y = (next.ge(zero) & next.le(y + y + q.abs())).select(next, y);
    }
    let a = y.sqrt();
    let sum = p + y; // b1 + b2
    // b2 - b1, from b1 b2 = c where that does not cancel, else from the factors' product at s^1. The latter divides by a,
    // which vanishes with q: across the plane of a ring, where only the former tells a thin tube's hit from a miss.
    let squared = sum * sum - c * f64x8::lit(4.0);
    let apart = squared.ge(sum * sum * half);
    let difference = apart.select(squared.sqrt().copysign(q), q / a);
    let quarter = y * f64x8::lit(0.25);
    [
        Pair { middle: -(a * half), square: quarter - (sum - difference) * half },
        Pair { middle: a * half, square: quarter - (sum + difference) * half },
    ]
}

/// About where `s^4 + p s^2 + q s + c` has its least: a Newton step from where it has that for `q = 0`.
#[inline(always)]
pub(super) fn low_place(p: f32x8, q: f32x8) -> f32x8 {
    let zero = f32x8::zero();
    let start = Lane::max(p * f32x8::lit(-0.5), zero).sqrt().copysign(-q);
    // There the slope is q.
    let bend = p.lt(zero).select(p * f32x8::lit(-4.0), p + p);
    start - q / bend
}

/// Lanes in which `s^4 + p s^2 + q s + c` is above `room` for every `s`, from the square of `q`.
///
/// What is above 0 is a sum of squares, `(s^2 + y)^2 + (p - 2 y) s^2 + q s + c - y^2` with some `y`: that of which the latter three
/// have the least discriminant, `q^2 - 4 (p - 2 y) (c - y^2)`, where the derivative of that is 0.
#[inline(always)]
pub(super) fn stays_above<L: Lane>(p: L, qq: L, c: L, room: L) -> Mask<L> {
    let c = c - room;
    let y = (p - (p * p + c * L::lit(12.0)).sqrt()) * L::lit(1.0 / 6.0); // NaN: below 0 at 0.
    let (square, rest) = (p - (y + y), c - y * y);
    square.gt(L::zero()) & rest.gt(L::zero()) & (square * rest * L::lit(4.0)).gt(qq)
}

/// Lanes in which `s^3 + b s^2 + c s + d` is above `room` for every `s` from 0 on: there and where it has its least.
#[inline(always)]
pub(super) fn stays_above_ahead<L: Lane>(b: L, c: L, d: L, room: L) -> Mask<L> {
    let least = ((b * b - c * L::lit(3.0)).sqrt() - b) * L::lit(1.0 / 3.0); // NaN: it rises all along.
    let s = least.gt(L::zero()).keep(least);
    d.gt(room) & (((s + b) * s + c) * s + d).gt(room)
}

/// The real roots of `s^3 + b s^2 + c s + d` in the lanes given: the one farthest from their mean, and the other two.
pub(super) fn cubic(b: f64x8, c: f64x8, d: f64x8, lanes: Mask<f64x8>) -> (f64x8, Pair) {
    let third = b * f64x8::lit(1.0 / 3.0);
    let m = third * third - c * f64x8::lit(1.0 / 3.0);
    let n = (third * c - d) * f64x8::lit(0.5) - third * third * third;
    let mut s = largest_cubic_root(m, n.abs(), lanes).copysign(n) - third;
    for _ in 0..2 {
        let value = ((s + b) * s + c) * s + d;
        let slope = (s * f64x8::lit(3.0) + b * f64x8::lit(2.0)) * s + c;
        let next = s - value / slope;
        s = next.abs().lt(f64x8::lit(f64::INFINITY)).select(next, s);
    }
    (s, deflated(b, c, s))
}

/// The other two roots of `s^3 + b s^2 + c s + d`, of which one is known.
pub(super) fn deflated(b: f64x8, c: f64x8, root: f64x8) -> Pair {
    let e = b + root;
    let middle = e * f64x8::lit(-0.5);
    Pair { middle, square: middle * middle - (c + root * e) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The quartic with the given roots, shifted so that they sum to 0.
    fn depressed(roots: [f64; 4]) -> ([f64; 4], [f64; 3]) {
        let mean = roots.iter().sum::<f64>() / 4.0;
        let r = roots.map(|x| x - mean);
        let pairs = r[0] * r[1] + (r[0] + r[1]) * (r[2] + r[3]) + r[2] * r[3];
        let triples = r[0] * r[1] * (r[2] + r[3]) + (r[0] + r[1]) * r[2] * r[3];
        (r, [pairs, -triples, r.iter().product()])
    }

    #[test]
    fn real_roots_come_in_neighbouring_pairs() {
        for roots in [
            [-2.0, -1.0, 0.5, 0.75],
            [-1.0, -1.0 + 1e-6, 0.5, 0.75],
            [-1.0, 0.2, 0.2 + 1e-6, 0.75],
            [-1.0, -0.3, 0.3, 1.0],
            [-1.0, -0.3, 0.0, 1.0],
        ] {
            let (expected, [p, q, c]) = depressed(roots);
            let pairs = quartic(f64x8::lit(p), f64x8::lit(q), f64x8::lit(c), Mask::all_set());
            let found = pairs.map(|pair| {
                let (middle, root) = (pair.middle.to_array()[0], pair.square.to_array()[0].sqrt());
                [middle - root, middle + root]
            });
            for (expected, found) in expected.iter().zip(found.as_flattened()) {
                // A gap of g between roots divides the rounding of the coefficients: 1e-15 / 1e-6.
                assert!((expected - found).abs() < 1e-8, "{expected} {found} of {roots:?}");
            }
        }
    }

    #[test]
    fn a_linear_term_of_almost_nothing_changes_nothing() {
        // s^4 + p s^2 + q s + c with p = 4 and a small c: the pair near 0 has the square -c / p, to c's own digits.
        for q in [0.0, 1e-12, 1e-17, 8e-22, -8e-22, 1e-30, 5e-324] {
            for c in [1.4e-10, -1.4e-10] {
                let pairs = quartic(f64x8::lit(4.0), f64x8::lit(q), f64x8::lit(c), Mask::all_set());
                let squares = pairs.map(|pair| pair.square.to_array()[0]);
                let near = squares[0].max(squares[1]);
                // Cancelled from numbers of the order of 4, and off by (q / p)^2 / 4.
                assert!((near + c / 4.0).abs() < 4e-15, "{squares:?} for {q:e} {c:e}");
                assert!((squares[0].min(squares[1]) + 4.0).abs() < 1e-9, "{squares:?}");
            }
        }
    }

    #[test]
    fn complex_roots_are_not_found() {
        // (s^2 + 1) (s^2 - 1/4), where a = 0, and (s^2 + s + 1) (s^2 - s + 2).
        let [low, high] = quartic(f64x8::lit(0.75), f64x8::zero(), f64x8::lit(-0.25), Mask::all_set());
        let squares = [low, high].map(|pair| pair.square.to_array()[0]);
        assert!(squares.contains(&0.25) && squares.contains(&-1.0), "{squares:?}");
        let [low, high] = quartic(f64x8::lit(2.0), f64x8::lit(1.0), f64x8::lit(2.0), Mask::all_set());
        assert!(low.square.lt(f64x8::zero()).all() && high.square.lt(f64x8::zero()).all());
    }

    #[test]
    fn what_stays_above_has_no_roots() {
        // (s^2 + 2 a s + a^2 + u) (s^2 - 2 a s + a^2 + v), and how far down it goes.
        let (mut told, mut open) = (0, 0);
        for k in 0..2000 {
            let digit = |n: u32| f64::from(k / 5u32.pow(n) % 5);
            let (a, u, v) = (digit(0) * 0.25, digit(1) * 0.2 - 0.39, digit(2) * 0.2 - 0.19);
            let room = digit(3) * 0.02;
            let (p, q, c) = (u + v - 2.0 * a * a, 2.0 * a * (v - u), (a * a + u) * (a * a + v));
            let value = |s: f64| ((s * s + p) * s + q) * s + c;
            let least = (-3000..3000).map(|s| value(f64::from(s) * 1e-3)).fold(f64::INFINITY, f64::min);
            let [p, q, c, room] = [p, q, c, room].map(f64x8::lit);
            let above = stays_above(p, q * q, c, room).bits() != 0;
            let room = room.to_array()[0];
            // Between two of those places it is lower by 1e-5 at most.
            assert!(!above || least > room, "{least} for {a} {u} {v}");
            assert!(above || least < room + 1e-5, "{least} for {a} {u} {v}");
            told += u32::from(above);
            open += u32::from(!above);
        }
        assert!(told > 300 && open > 300, "{told} told, {open} not");
    }

    #[test]
    fn what_stays_above_ahead_has_no_roots_there() {
        let (mut told, mut open) = (0, 0);
        for k in 0..1000 {
            let digit = |n: u32| f64::from(k / 10u32.pow(n) % 10) * 0.4 - 1.9;
            let (b, c, d) = (digit(0), digit(1), digit(2));
            let value = |s: f64| ((s + b) * s + c) * s + d;
            let least = (0..4000).map(|s| value(f64::from(s) * 1e-3)).fold(f64::INFINITY, f64::min);
            let above = stays_above_ahead(f64x8::lit(b), f64x8::lit(c), f64x8::lit(d), f64x8::lit(0.01));
            // Between two of those places it is lower by 1e-5 at most.
            assert!(above.none() || least > 0.01, "{least} for {b} {c} {d}");
            assert!(above.any() || least < 0.01 + 1e-5, "{least} for {b} {c} {d}");
            told += u32::from(above.any());
            open += u32::from(above.none());
        }
        assert!(told > 100 && open > 100, "{told} told, {open} not");
    }

    #[test]
    fn cubic_roots_are_found_also_when_double() {
        for roots in [[-1.0, 0.25, 0.5], [-1.0, 0.5, 0.5], [-1.0, -1.0, 0.5], [0.1, 0.2, 0.3]] {
            let [x, y, z] = roots;
            let (b, c, d) = (-(x + y + z), x * y + y * z + z * x, -(x * y * z));
            let (far, pair) = cubic(f64x8::lit(b), f64x8::lit(c), f64x8::lit(d), Mask::all_set());
            let far = far.to_array()[0];
            let (middle, square) = (pair.middle.to_array()[0], pair.square.to_array()[0]);
            let root = square.max(0.0).sqrt();
            let mut found = [far, middle - root, middle + root];
            found.sort_by(f64::total_cmp);
            for (expected, found) in roots.iter().zip(found) {
                // The square root of a rounding, a few times, at double roots.
                assert!((expected - found).abs() < 1e-7, "{expected} {found} of {roots:?}");
            }
        }
    }
}
