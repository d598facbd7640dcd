//! Polynomial surfaces: the polynomial along the line term by term, and its roots by halving.

use super::{Line, Root, Roots};
use crate::reference::polynomial::roots_between;
use crate::scene::Polynomial;
use glam::DVec3;
use smallvec::{SmallVec, smallvec};

/// The one part of such a surface.
const SURFACE: usize = 0;

/// Crossings farther than this from the middle are not looked for.
const REACH: f64 = 1e7;

/// Roundings that a sum of terms is off by, in units of the sum of their magnitudes.
const ROUNDINGS: f64 = 64.0 * f64::EPSILON;

/// All meetings at which the polynomial changes its sign.
pub fn cross(polynomial: &Polynomial, line: &Line) -> Roots {
    let length = line.dir.length();
    let u = line.dir / length;
    let base = if line.left.is_some() { 0.0 } else { -line.origin.dot(u) };
    let origin = line.origin + base * u;
    let mut c = along(polynomial.order(), polynomial.coefficients().iter().copied(), origin, u);
    if c.iter().any(|c| !c.is_finite()) {
        return Roots::default();
    }
    let mut list: SmallVec<[Root; 4]> = smallvec![];
    let root = |s: f64| {
        let p = origin + s * u;
        let (value, normal) = gradient(polynomial, p);
        let square = normal.length_squared();
        let (step, normal) = if square > 0.0 { (value / square, normal) } else { (0.0, DVec3::X) };
        Root::new((base + s) / length, p - step * normal, normal, SURFACE)
    };
    let mut flips = false;
    if line.left.is_some() {
        // The start is a root, and where the slope is below its rounding a double one.
        let magnitudes = polynomial.coefficients().iter().map(|c| c.abs());
        let sums = along(polynomial.order(), magnitudes, origin.abs(), u.abs());
        list.push(root(0.0).departing(line));
        c.remove(0);
        if c[0].abs() <= ROUNDINGS * (sums[1] + 2.0 * sums[2]) {
            list.push(root(0.0));
            c.remove(0);
        } else {
            flips = true;
        }
    }
    let Some((lead, rest)) = c.split_last() else { return Roots::sorted(list) };
    let reach = (1.0 + rest.iter().fold(0.0, |most: f64, c| most.max(c.abs())) / lead.abs()).min(REACH);
    list.extend(roots_between(&c, -reach, reach).into_iter().map(root));
    let before = c.iter().rev().fold(0.0, |sum, c| sum * -reach + c);
    // Divided by its unknown, which is negative there, it has the other sign.
    Roots { starts_inside: (before < 0.0) != flips, ..Roots::sorted(list) }
}

/// Coefficients, from the constant term on, of the polynomial of position along `origin + s dir`.
fn along(order: usize, coefficients: impl Iterator<Item = f64>, origin: DVec3, dir: DVec3) -> Vec<f64> {
    let powers: [Vec<Vec<f64>>; 3] = [0, 1, 2].map(|axis| {
        let mut powers = vec![vec![1.0]];
        for k in 0..order {
            powers.push(product(&powers[k], &[origin[axis], dir[axis]]));
        }
        powers
    });
    let mut sum = vec![0.0; order.max(2) + 1];
    for ([i, j, k], c) in Polynomial::exponents(order).zip(coefficients) {
        if c != 0.0 {
            let term = product(&product(&powers[0][i], &powers[1][j]), &powers[2][k]);
            for (sum, x) in sum.iter_mut().zip(term) {
                *sum += c * x;
            }
        }
    }
    while sum.len() > 1 && sum.last() == Some(&0.0) {
        sum.pop();
    }
    sum.resize(sum.len().max(3), 0.0);
    sum
}

fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; a.len() + b.len() - 1];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            out[i + j] += x * y;
        }
    }
    out
}

/// Value and gradient, term by term.
fn gradient(polynomial: &Polynomial, p: DVec3) -> (f64, DVec3) {
    let order = polynomial.order();
    let mut value = 0.0;
    let mut slope = DVec3::ZERO;
    for (powers, &c) in Polynomial::exponents(order).zip(polynomial.coefficients()) {
        if c == 0.0 {
            continue;
        }
        let factor: [f64; 3] = [0, 1, 2].map(|axis| p[axis].powi(powers[axis] as i32));
        value += c * factor[0] * factor[1] * factor[2];
        for axis in 0..3 {
            if powers[axis] > 0 {
                let others = factor[(axis + 1) % 3] * factor[(axis + 2) % 3];
                slope[axis] += c * powers[axis] as f64 * p[axis].powi(powers[axis] as i32 - 1) * others;
            }
        }
    }
    (value, slope)
}

#[cfg(test)]
mod tests {
    use super::super::{distances, line};
    use super::*;

    /// `x^4 - x^3 + y^2 + z^2`: a drop from 0 to 1 along x.
    fn piriform() -> Polynomial {
        let mut c = vec![0.0; Polynomial::terms(4)];
        for (powers, value) in [([4, 0, 0], 1.0), ([3, 0, 0], -1.0), ([0, 2, 0], 1.0), ([0, 0, 2], 1.0)] {
            c[Polynomial::place(4, powers)] = value;
        }
        Polynomial::new(4, c).expect("sound")
    }

    #[test]
    fn a_drop_is_met_where_its_radius_says() {
        // At x = 1/2 the radius is sqrt(1/8 - 1/16) = 1/4.
        let roots = cross(&piriform(), &line([0.5, 0.0, -3.0], [0.0, 0.0, 2.0]));
        assert!(!roots.starts_inside);
        for (found, expected) in distances(&roots).iter().zip([1.375, 1.625]) {
            assert!((found - expected).abs() < 1e-14, "{found} for {expected}");
        }
        assert!(cross(&piriform(), &line([0.5, 0.26, -3.0], [0.0, 0.0, 1.0])).list.is_empty());
    }

    #[test]
    fn from_the_surface_only_the_other_side_is_left() {
        let start = Line { origin: DVec3::new(0.5, 0.0, -0.25), dir: DVec3::Z, left: Some(SURFACE) };
        let roots = cross(&piriform(), &start);
        assert!(!roots.starts_inside);
        assert_eq!(roots.list[0].t, 0.0);
        assert!((roots.list[1].t - 0.5).abs() < 1e-14);
    }
}
