//! Sphere (Haines, Günther, Akenine-Möller, Precision Improvements for Ray/Sphere Intersection, Ray Tracing Gems ch. 7).

use super::{Line, Root, Roots};
use crate::reference::polynomial::stable_pair;
use glam::DVec3;
use smallvec::smallvec;

/// The one part of a sphere's surface.
const SURFACE: usize = 0;

/// Both meetings, or none; a tangent does not meet, so a sphere of radius 0 is never seen.
///
/// The discriminant is taken at the point of the line nearest the centre, as `(r - l)(r + l)`: a small or far sphere does
/// not cancel. From the surface itself one root is 0, and the other follows from the sum of the roots.
pub fn cross(center: DVec3, radius: f64, line: &Line) -> Roots {
    let f = line.origin - center;
    let dd = line.dir.length_squared();
    let middle = -f.dot(line.dir) / dd;
    let (near, far) = if line.left.is_some() {
        (0f64.min(2.0 * middle), 0f64.max(2.0 * middle))
    } else {
        let l = (f + middle * line.dir).length();
        let half_squared = (radius - l) * (radius + l) / dd;
        if !(half_squared > 0.0) {
            return Roots::default();
        }
        let length = f.length();
        stable_pair(middle, half_squared.sqrt(), (length - radius) * (length + radius) / dd)
    };
    let root = |t: f64| {
        let n = line.at(t) - center;
        let n = n * (radius / n.length());
        Root::new(t, center + n, n, SURFACE).departing(line)
    };
    Roots { starts_inside: false, list: smallvec![root(near), root(far)] }
}

#[cfg(test)]
mod tests {
    use super::super::{distances, line};
    use super::*;

    fn unit(origin: [f64; 3], dir: [f64; 3]) -> Vec<f64> {
        distances(&cross(DVec3::ZERO, 1.0, &line(origin, dir)))
    }

    #[test]
    fn far_and_small_spheres_keep_their_digits() {
        // Through the middle: the exact roots are distance ± radius.
        for (distance, radius) in [(1e2, 1.0), (1e6, 1.0), (1e6, 1e-3), (1.0, 1e-9)] {
            let roots = distances(&cross(DVec3::ZERO, radius, &line([0.0, 0.0, -distance], [0.0, 0.0, 1.0])));
            // One rounding of a number of the size of the distance.
            let bound = distance * f64::EPSILON;
            assert!((roots[0] - (distance - radius)).abs() <= bound, "{roots:?}");
            assert!((roots[1] - (distance + radius)).abs() <= bound, "{roots:?}");
        }
    }

    #[test]
    fn planet_seen_from_a_man_s_height() {
        // Looking down: 1.7 above a planet of 6.4e6. Rounding the origin alone costs half an ulp of 6.4e6, 4.7e-10.
        let roots = distances(&cross(DVec3::ZERO, 6.4e6, &line([0.0, 6.4e6 + 1.7, 0.0], [0.0, -1.0, 0.0])));
        assert!((roots[0] - 1.7).abs() < 1e-9, "{roots:?}");
    }

    #[test]
    fn tells_near_misses_from_near_hits() {
        for k in 3..=15 {
            let off = 10f64.powi(-k);
            assert_eq!(unit([1.0 - off, 0.0, -5.0], [0.0, 0.0, 1.0]).len(), 2, "1 - 1e-{k}");
            assert_eq!(unit([1.0 + off, 0.0, -5.0], [0.0, 0.0, 1.0]).len(), 0, "1 + 1e-{k}");
        }
    }

    #[test]
    fn from_the_surface_one_root_is_exactly_zero() {
        let p = DVec3::new(0.6, 0.0, -0.8);
        for (dir, other) in [([0.0, 0.0, 1.0], 1.6), ([0.0, 0.0, -1.0], -1.6), ([0.8, 0.0, 0.6], 0.0)] {
            let line = Line { origin: p, dir: dir.into(), left: Some(SURFACE) };
            let roots = cross(DVec3::ZERO, 1.0, &line);
            assert!(roots.list.iter().any(|root| root.left && root.t == 0.0));
            assert!(roots.list.iter().any(|root| (root.t - other).abs() < 1e-15), "{roots:?}");
        }
    }

    #[test]
    fn inside_and_centre_and_behind() {
        assert_eq!(unit([0.0; 3], [0.0, 1.0, 0.0]), [-1.0, 1.0]);
        assert_eq!(unit([0.0, 0.5, 0.0], [0.0, 1.0, 0.0]), [-1.5, 0.5]);
        assert_eq!(unit([0.0, 0.0, 5.0], [0.0, 0.0, 1.0]), [-6.0, -4.0]);
    }

    #[test]
    fn nothing_is_met_by_a_point_or_by_nan() {
        let z = [0.0, 0.0, 1.0];
        assert!(cross(DVec3::ZERO, 0.0, &line([0.0, 0.0, -5.0], z)).list.is_empty());
        assert!(cross(DVec3::ZERO, 1.0, &line([f64::NAN, 0.0, -5.0], z)).list.is_empty());
    }
}
