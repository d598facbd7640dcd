//! Real roots of quadratics and of small polynomials. Knows no geometry.

use smallvec::SmallVec;

/// The two numbers `middle - half` and `middle + half`, rising, given also their product.
///
/// Where the two terms cancel, the number is taken as `product / other` instead: the stable form of the quadratic formula
/// (Press et al., Numerical Recipes, section 5.6). `half` must not be negative.
pub fn stable_pair(middle: f64, half: f64, product: f64) -> (f64, f64) {
    let large = if middle < 0.0 { middle - half } else { middle + half };
    if large == 0.0 {
        return (0.0, 0.0);
    }
    let small = product / large;
    if small < large { (small, large) } else { (large, small) }
}

/// Halvings of an interval: one more than the bits of an f64, so the root is found to the last bit of the interval's size.
const HALVINGS: usize = 54;

/// Rising roots in `lo..hi` at which the polynomial `c[0] + c[1] x + c[2] x² + …` changes sign.
///
/// Between neighbouring roots of its derivative a polynomial is monotone, so each root is alone in such a piece and
/// halving finds it (Yuksel, High-Performance Polynomial Root Finding, 2022, in its plainest form). Roots are good to about
/// 1e-16 of `hi - lo`, if the coefficients are; roots of even multiplicity are no sign change and are not reported.
pub fn roots_between(c: &[f64], lo: f64, hi: f64) -> SmallVec<[f64; 4]> {
    let mut roots = SmallVec::new();
    if c.len() < 2 {
        return roots;
    }
    let derivative: SmallVec<[f64; 4]> = c.iter().enumerate().skip(1).map(|(i, c)| i as f64 * c).collect();
    let mut from = lo;
    for to in roots_between(&derivative, lo, hi).into_iter().chain([hi]) {
        if (value(c, from) < 0.0) != (value(c, to) < 0.0) {
            roots.push(halve(c, from, to));
        }
        from = to;
    }
    roots
}

fn value(c: &[f64], x: f64) -> f64 {
    c.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

fn halve(c: &[f64], mut lo: f64, mut hi: f64) -> f64 {
    let negative = value(c, lo) < 0.0;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (lo + hi);
        if (value(c, middle) < 0.0) == negative {
            lo = middle;
        } else {
            hi = middle;
        }
    }
    0.5 * (lo + hi)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cancelling_root_keeps_its_digits() {
        // x² - 2e8 x + 1: the small root is 5e-9 and the plain formula gives 0 or 7e-9.
        let (small, large) = stable_pair(1e8, (1e16f64 - 1.0).sqrt(), 1.0);
        assert_eq!((small, large), (1.0 / 2e8, 2e8));
    }

    #[test]
    fn finds_all_simple_roots_of_a_quartic() {
        // (x + 2)(x + 1/2)(x - 1)(x - 3), expanded.
        let roots = roots_between(&[3.0, 3.5, -6.0, -1.5, 1.0], -10.0, 10.0);
        let expected = [-2.0, -0.5, 1.0, 3.0];
        assert_eq!(roots.len(), 4);
        for (root, expected) in roots.iter().zip(expected) {
            assert!((root - expected).abs() < 1e-14, "{root} for {expected}");
        }
    }

    #[test]
    fn ends_and_double_roots_are_no_sign_change() {
        assert!(roots_between(&[1.0, -2.0, 1.0], -5.0, 4.0).is_empty());
        assert!(roots_between(&[1.0, 0.0, 1.0], -5.0, 5.0).is_empty());
        assert!(roots_between(&[1.0], -5.0, 5.0).is_empty());
    }
}
