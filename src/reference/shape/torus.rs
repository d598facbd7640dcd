//! Torus about the y axis: a quartic along the line, solved about the point nearest the middle.
//!
//! With `rho` the distance from the axis, the surface is `G = (rho - R)² + y² - r² = 0`. The quartic is `G H` with
//! `H = (rho + R)² + y² - r²`, whose zeros exist only if the tube is wider than the ring (`r > R`): the inner "lemon" of a
//! spindle torus, which is seen, but has the solid on both sides.

use super::{Line, Root, Roots};
use crate::reference::polynomial::roots_between;
use glam::DVec3;
use smallvec::SmallVec;

/// Parts of the surface: the zeros of `G` and those of `H`.
const OUTER: usize = 0;
const LEMON: usize = 1;

/// The bounding sphere in which roots are sought is this much too large, squared: a root exactly on it counts.
const BOUND_SQUARED: f64 = 1.01;

/// A Newton step longer than this, in units of `R + r`, has lost its root.
const LONGEST_STEP: f64 = 1e-3;

/// All meetings, up to four.
pub fn cross(major: f64, minor: f64, line: &Line) -> Roots {
    let size = major + minor;
    if !(minor > 0.0 && size.is_finite()) {
        return Roots::default();
    }
    // Everything in units of the size, along a unit direction.
    let length = line.dir.length();
    let torus = Torus { major: major / size, minor: minor / size };
    let (origin, u) = (line.origin / size, line.dir / length);
    let (base, list) = match line.left {
        Some(part) => (0.0, torus.roots_from_surface(origin, u, part)),
        None => {
            let nearest = -origin.dot(u);
            (nearest, torus.roots_along(origin + nearest * u, u))
        }
    };
    let scale = size / length;
    let mut list: SmallVec<[Root; 4]> = list
        .into_iter()
        .map(|s| {
            let (s, part) = torus.polish(origin + base * u, u, s);
            let p = origin + (base + s) * u;
            let center = torus.tube_center(p, part);
            let normal = (p - center) * (torus.minor / (p - center).length());
            let root = Root::new((base + s) * scale, (center + normal) * size, normal, part);
            Root { toggles: part == OUTER, ..root }
        })
        .collect();
    if let Some(part) = line.left {
        let normal = origin - torus.tube_center(origin, part);
        let root = Root::new(0.0, line.origin, normal, part).departing(line);
        list.push(Root { toggles: part == OUTER, ..root });
    }
    Roots::sorted(list)
}

/// Scaled so that `major + minor` is 1.
struct Torus {
    major: f64,
    minor: f64,
}

impl Torus {
    /// Roots along `q + s u`, where `q` is the point nearest the middle, so that the cubic term is 0.
    fn roots_along(&self, q: DVec3, u: DVec3) -> SmallVec<[f64; 4]> {
        let q2 = q.length_squared();
        if !(q2 < 1.0) {
            return SmallVec::new();
        }
        let (rr, k) = (self.major * self.major, q2 + self.major * self.major - self.minor * self.minor);
        let rho = q.x.hypot(q.z);
        // The constant term G H as products of differences: thin tubes do not cancel.
        let factor = |rho: f64| {
            let w = rho.hypot(q.y);
            (w - self.minor) * (w + self.minor)
        };
        let c0 = factor(rho - self.major) * factor(rho + self.major);
        let c1 = -8.0 * rr * (q.x * u.x + q.z * u.z);
        let c2 = 2.0 * k - 4.0 * rr * (u.x * u.x + u.z * u.z);
        let half = (BOUND_SQUARED - q2).sqrt();
        roots_between(&[c0, c1, c2, 0.0, 1.0], -half, half)
    }

    /// The other roots along `p + s u` from a point of the surface: the quartic divided by its root 0.
    fn roots_from_surface(&self, p: DVec3, u: DVec3, part: usize) -> SmallVec<[f64; 4]> {
        let (b, rr) = (p.dot(u), self.major * self.major);
        let k = p.length_squared() + rr - self.minor * self.minor;
        let rho = p.x.hypot(p.z);
        let flat = p.x * u.x + p.z * u.z;
        // The derivative at the point, from the normal: its sign is whether the ray leaves the tube or enters it.
        let ring = self.ring(part);
        let c1 = 8.0 * ring * ((rho - ring) * flat + rho * p.y * u.y);
        let c2 = 4.0 * b * b + 2.0 * k - 4.0 * rr * (u.x * u.x + u.z * u.z);
        let half = 2.0 * BOUND_SQUARED;
        roots_between(&[c1, c2, 4.0 * b, 1.0], -half, half)
    }

    /// Newton's method on the distance from the tube's middle line, which has no terms that cancel.
    fn polish(&self, base: DVec3, u: DVec3, mut s: f64) -> (f64, usize) {
        let distance = |p: DVec3, part: usize| (p.x.hypot(p.z) - self.ring(part)).hypot(p.y) - self.minor;
        let p = base + s * u;
        let part = if distance(p, LEMON).abs() < distance(p, OUTER).abs() { LEMON } else { OUTER };
        for _ in 0..2 {
            let p = base + s * u;
            let n = (p - self.tube_center(p, part)).normalize_or_zero();
            let step = -distance(p, part) / n.dot(u);
            let better = || distance(base + (s + step) * u, part).abs() < distance(p, part).abs();
            if step.abs() < LONGEST_STEP && better() {
                s += step;
            }
        }
        (s, part)
    }

    /// The signed radius of the tube's middle line: across the axis for the lemon.
    fn ring(&self, part: usize) -> f64 {
        if part == LEMON { -self.major } else { self.major }
    }

    /// The middle of the tube beside `p`; any side will do on the axis.
    fn tube_center(&self, p: DVec3, part: usize) -> DVec3 {
        self.ring(part) * DVec3::new(p.x, 0.0, p.z).try_normalize().unwrap_or(DVec3::X)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{distances, line};
    use super::*;

    fn close(roots: &Roots, expected: &[f64], bound: f64) {
        let got = distances(roots);
        assert_eq!(got.len(), expected.len(), "{got:?} for {expected:?}");
        for (got, expected) in got.iter().zip(expected) {
            assert!((got - expected).abs() <= bound, "{got:?} for {expected:?}");
        }
    }

    #[test]
    fn in_the_equator_thick_thin_far_and_small() {
        for (big, small, distance) in
            [(1.0, 0.25, 5.0), (1.0, 0.25, 1e4), (1.0, 1e-4, 1e3), (1e3, 1.0, 3e3), (1e-2, 2.5e-3, 0.05)]
        {
            let roots = cross(big, small, &line([-distance, 0.0, 0.0], [1.0, 0.0, 0.0]));
            let expected = [-big - small, -big + small, big - small, big + small].map(|x| distance + x);
            // Two roundings of numbers of the size of the distance, and the residue of the polish.
            close(&roots, &expected, 4.0 * f64::EPSILON * (distance + big));
        }
    }

    #[test]
    fn along_the_axis_and_through_the_tube() {
        assert!(cross(1.0, 0.25, &line([0.0, 5.0, 0.0], [0.0, -1.0, 0.0])).list.is_empty());
        close(&cross(1.0, 0.25, &line([1.0, 5.0, 0.0], [0.0, -1.0, 0.0])), &[4.75, 5.25], 1e-14);
        close(&cross(1.0, 0.25, &line([0.0, 5.0, -1.25 + 1e-6], [0.0, -1.0, 0.0])), &[5.0, 5.0], 1e-3);
    }

    #[test]
    fn tells_near_misses_from_near_hits() {
        for k in 3..=9 {
            let off = 0.25 * 10f64.powi(-k);
            let at = |y: f64| cross(1.0, 0.25, &line([1.0, y, -5.0], [1e-9, 0.0, 1.0])).list.len();
            assert!(at(0.25 - off) >= 2, "inside by 1e-{k}");
            assert_eq!(at(0.25 + off), 0, "outside by 1e-{k}");
        }
    }

    #[test]
    fn direction_of_any_length_and_far_centre() {
        let roots = cross(1.0, 0.25, &line([-1e6, 0.0, 0.0], [1e-3, 0.0, 0.0]));
        close(&roots, &[1e9 - 1.25e3, 1e9 - 0.75e3, 1e9 + 0.75e3, 1e9 + 1.25e3], 1e-6);
    }

    #[test]
    fn horn_spindle_and_empty() {
        assert_eq!(cross(1.0, 1.0, &line([-5.0, 0.5, 0.0], [1.0, 0.0, 0.0])).list.len(), 4);
        // The spindle's lemon is crossed within the solid.
        let roots = cross(0.5, 1.0, &line([-5.0, 0.0, 0.0], [1.0, 0.0, 0.0]));
        let parts: Vec<_> = roots.list.iter().map(|root| (root.part, root.toggles)).collect();
        assert_eq!(parts, [(OUTER, true), (LEMON, false), (LEMON, false), (OUTER, true)]);
        assert!(cross(1.0, 0.0, &line([-5.0, 0.0, 0.0], [1.0, 0.0, 0.0])).list.is_empty());
        assert!(cross(1.0, 0.5, &line([f64::NAN, 0.0, 0.0], [1.0, 0.0, 0.0])).list.is_empty());
    }

    #[test]
    fn from_the_surface_in_all_directions() {
        let (big, small) = (1.0, 0.25);
        for i in 0..400 {
            let (a, b, c, d) = (0.7 * i as f64, 1.3 * i as f64, 2.1 * i as f64, 0.9 * i as f64);
            let ring = DVec3::new(a.cos(), 0.0, a.sin());
            let n = b.cos() * ring + b.sin() * DVec3::Y;
            let p = big * ring + small * n;
            let dir = DVec3::new(c.cos() * d.cos(), d.sin(), c.sin() * d.cos());
            let roots = cross(big, small, &Line { origin: p, dir, left: Some(OUTER) });
            assert_eq!(roots.list.len() % 2, 0);
            let left = roots.list.iter().position(|root| root.left).expect("the point itself is a root");
            // Counting from outside, an even number of meetings lies before a root that enters.
            assert_eq!(left % 2 == 0, n.dot(dir) < 0.0, "direction {i}");
            for root in roots.list.iter().filter(|root| !root.left) {
                let p = p + root.t * dir;
                let off = (p.x.hypot(p.z) - big).hypot(p.y) - small;
                assert!(off.abs() < 1e-14, "off by {off:e}");
            }
        }
    }
}
