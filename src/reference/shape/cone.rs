//! Cylinder and cone between two points, with or without their ends; a cylinder is a cone with two equal radii.

use super::{Line, Root, Roots};
use crate::reference::polynomial::stable_pair;
use glam::DVec3;
use smallvec::smallvec;

/// Parts of the surface.
const SIDE: usize = 0;
const BASE: usize = 1;
const CAP: usize = 2;

/// The points between two planes whose distance from the axis is at most `r(z) = base_radius + slope z`.
///
/// z runs along the axis from the base. The solid is convex, so a line is in it for one interval: that within the cone,
/// cut by that between the planes. The rim belongs to both, so no ray slips through between side and end.
pub struct Cone {
    base: DVec3,
    /// Unit, from base to cap.
    axis: DVec3,
    length: f64,
    base_radius: f64,
    slope: f64,
    open: bool,
}

/// One end of an interval, and the part of the surface that made it.
type End = (f64, usize);

impl Cone {
    /// `None` if it has no length or no width.
    pub fn new(base: DVec3, base_radius: f64, cap: DVec3, cap_radius: f64, open: bool) -> Option<Self> {
        let length = (cap - base).length();
        if !(length > 0.0 && base_radius.max(cap_radius) > 0.0) {
            return None;
        }
        let (axis, slope) = ((cap - base) / length, (cap_radius - base_radius) / length);
        Some(Self { base, axis, length, base_radius, slope, open })
    }

    /// Where the line enters and leaves. The ends of an open cone are left and entered without being seen.
    pub fn cross(&self, line: &Line) -> Roots {
        let Some((enter, leave)) = self.interval(line) else { return Roots::default() };
        Roots { starts_inside: false, list: smallvec![self.root(enter, line), self.root(leave, line)] }
    }

    fn root(&self, (t, part): End, line: &Line) -> Root {
        let (z, p) = self.split(line.at(t));
        let (point, normal) = match part {
            SIDE => {
                let z = z.clamp(0.0, self.length);
                let radius = self.base_radius + self.slope * z;
                let out = p.normalize_or_zero();
                // At the apex every direction is outward; the axis is as good as any.
                let normal = if out == DVec3::ZERO {
                    -self.slope.signum() * self.axis
                } else {
                    out - self.slope * self.axis
                };
                (self.base + z * self.axis + radius * out, normal)
            }
            BASE => (self.base + p, -self.axis),
            _ => (self.base + self.length * self.axis + p, self.axis),
        };
        let root = Root::new(t + 0.0, point, normal, part).departing(line);
        Root { visible: part == SIDE || !self.open, ..root }
    }

    /// Height along the axis, and the vector from the axis to the point.
    fn split(&self, p: DVec3) -> (f64, DVec3) {
        let p = p - self.base;
        let z = p.dot(self.axis);
        (z, p - z * self.axis)
    }

    /// The one interval within both: past the apex the other half of the double cone may touch the slab in a point, so
    /// the longer of two is meant.
    fn interval(&self, line: &Line) -> Option<(End, End)> {
        let (first, last) = self.slab(line)?;
        let cut = |(enter, leave): (f64, f64)| {
            let enter = if first.0 >= enter { first } else { (enter, SIDE) };
            let leave = if last.0 <= leave { last } else { (leave, SIDE) };
            (enter.0 <= leave.0 && enter.0.is_finite() && leave.0.is_finite()).then_some((enter, leave))
        };
        let length = |(enter, leave): &(End, End)| leave.0 - enter.0;
        self.within(line).into_iter().flatten().filter_map(cut).max_by(|a, b| length(a).total_cmp(&length(b)))
    }

    /// The interval between the two end planes.
    fn slab(&self, line: &Line) -> Option<(End, End)> {
        let rise = line.dir.dot(self.axis);
        let z = (line.origin - self.base).dot(self.axis);
        if rise == 0.0 {
            let between = 0.0 <= z && z <= self.length;
            return between.then_some(((f64::NEG_INFINITY, BASE), (f64::INFINITY, CAP)));
        }
        let t = |height: f64, part: usize| if line.left == Some(part) { 0.0 } else { (height - z) / rise };
        let (base, cap) = ((t(0.0, BASE), BASE), (t(self.length, CAP), CAP));
        Some(if rise > 0.0 { (base, cap) } else { (cap, base) })
    }

    /// The intervals within the endless double cone `Q(t) = |p|² - r(z)² <= 0`: one, or two with a gap between.
    fn within(&self, line: &Line) -> [Option<(f64, f64)>; 2] {
        let (dz, dp) = self.split(self.base + line.dir);
        let dp2 = dp.length_squared();
        let dr = self.slope * dz;
        // Q(t) = a t² + 2 b t + c.
        let a = (dp2.sqrt() - dr.abs()) * (dp2.sqrt() + dr.abs());
        let (z, p) = self.split(line.origin);
        let r = self.base_radius + self.slope * z;
        let b = p.dot(dp) - r * dr;
        if line.left == Some(SIDE) {
            // One root is 0; their sum gives the other.
            let other = -2.0 * b / a;
            return if a > 0.0 {
                [Some((other.min(0.0), other.max(0.0))), None]
            } else if a < 0.0 {
                [Some((f64::NEG_INFINITY, other.min(0.0))), Some((other.max(0.0), f64::INFINITY))]
            } else if b > 0.0 {
                [Some((f64::NEG_INFINITY, 0.0)), None]
            } else {
                [Some((0.0, f64::INFINITY)), None]
            };
        }
        // The discriminant at the point nearest the axis, where it does not cancel: |dp|² (r - |p|)(r + |p|) + (|p| dr)².
        let middle = if dp2 > 0.0 { -p.dot(dp) / dp2 } else { 0.0 };
        let near = (p + middle * dp).length();
        let near_r = r + middle * dr;
        let disc = dp2 * (near_r - near) * (near_r + near) + (near * dr) * (near * dr);
        let c = (p.length() - r) * (p.length() + r);
        if !(disc >= 0.0) {
            // Never on the surface: all within (looking down a steep cone) or all without.
            let all = a < 0.0 || (a == 0.0 && c <= 0.0);
            return [all.then_some((f64::NEG_INFINITY, f64::INFINITY)), None];
        }
        if a == 0.0 {
            // Along a generator or along a cylinder's axis: Q is a straight line.
            let t = -c / (2.0 * b);
            return match b {
                _ if b > 0.0 => [Some((f64::NEG_INFINITY, t)), None],
                _ if b < 0.0 => [Some((t, f64::INFINITY)), None],
                _ => [(c <= 0.0).then_some((f64::NEG_INFINITY, f64::INFINITY)), None],
            };
        }
        let (lo, hi) = stable_pair(-b / a, disc.sqrt() / a.abs(), c / a);
        if a > 0.0 {
            [Some((lo, hi)), None]
        } else {
            [Some((f64::NEG_INFINITY, lo)), Some((hi, f64::INFINITY))]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{distances, line};
    use super::*;

    /// Apex up at y = 1, base radius 1 at y = 0.
    fn pointed() -> Cone {
        Cone::new(DVec3::ZERO, 1.0, DVec3::Y, 0.0, false).unwrap()
    }

    fn cylinder(radius: f64, length: f64) -> Cone {
        Cone::new(DVec3::ZERO, radius, DVec3::Y * length, radius, false).unwrap()
    }

    fn close(got: &[f64], expected: &[f64], bound: f64) {
        assert_eq!(got.len(), expected.len(), "{got:?} for {expected:?}");
        for (got, expected) in got.iter().zip(expected) {
            assert!((got - expected).abs() <= bound, "{got:?} for {expected:?}");
        }
    }

    #[test]
    fn apex_is_met_from_the_side_and_from_above() {
        for below in [1e-4, 1e-8, 1e-12, 0.0] {
            let roots = pointed().cross(&line([0.0, 1.0 - below, -5.0], [0.0, 0.0, 1.0]));
            close(&distances(&roots), &[5.0 - below, 5.0 + below], 1e-14);
        }
        assert!(pointed().cross(&line([0.0, 1.0 + 1e-12, -5.0], [0.0, 0.0, 1.0])).list.is_empty());
        close(&distances(&pointed().cross(&line([0.0, 3.0, 0.0], [0.0, -1.0, 0.0]))), &[2.0, 3.0], 0.0);
    }

    #[test]
    fn along_a_generator_axis_and_cap() {
        // Parallel to the generator from (1, 0) to (0, 1), half a unit inside it.
        let roots = pointed().cross(&line([-0.5, 0.0, 0.0], [-1.0, 1.0, 0.0]));
        assert_eq!(roots.list[0].part, BASE);
        let roots = pointed().cross(&line([0.25, 0.5, 0.0], [-1.0, 1.0, 0.0]));
        close(&distances(&roots), &[-0.5, 0.375], 1e-15);
        close(
            &distances(&cylinder(1.0, 2.0).cross(&line([0.5, -1.0, 0.0], [0.0, 1.0, 0.0]))),
            &[1.0, 3.0],
            0.0,
        );
        assert!(cylinder(1.0, 2.0).cross(&line([1.5, -1.0, 0.0], [0.0, 1.0, 0.0])).list.is_empty());
        // In the plane of the end, and along the rim's tangent line.
        close(
            &distances(&cylinder(1.0, 2.0).cross(&line([-5.0, 2.0, 0.0], [1.0, 0.0, 0.0]))),
            &[4.0, 6.0],
            1e-15,
        );
    }

    #[test]
    fn rim_is_never_lost() {
        for i in 0..100 {
            let (sin, cos) = (0.1 + i as f64).sin_cos();
            let rim = DVec3::new(cos, 2.0, sin);
            let origin = DVec3::new(3.0 * cos, 5.0, 3.0 * sin);
            let roots = cylinder(1.0, 2.0).cross(&Line { origin, dir: rim - origin, left: None });
            // Aimed at the rim from outside and above: within rounding it is hit or just missed, but when hit, there.
            if let [enter, leave] = roots.list.as_slice() {
                assert!((enter.t - 1.0).abs() < 1e-12 || (leave.t - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn hair_at_a_distance() {
        let hair = cylinder(1e-6, 1e3);
        close(
            &distances(&hair.cross(&line([0.0, 500.0, -1e3], [0.0, 0.0, 1.0]))),
            &[1e3 - 1e-6, 1e3 + 1e-6],
            1e-12,
        );
        assert!(hair.cross(&line([2e-6, 500.0, -1e3], [0.0, 0.0, 1.0])).list.is_empty());
    }

    #[test]
    fn almost_a_cylinder_is_almost_a_cylinder() {
        let cone = Cone::new(DVec3::ZERO, 1.0, DVec3::Y, 1.0 + 1e-9, false).unwrap();
        close(&distances(&cone.cross(&line([0.0, 0.5, -5.0], [0.0, 0.0, 1.0]))), &[4.0, 6.0], 1e-9);
    }

    #[test]
    fn open_ends_divide_space_unseen() {
        let open = Cone::new(DVec3::ZERO, 1.0, DVec3::Y, 1.0, true).unwrap();
        let roots = open.cross(&line([0.2, 3.0, 0.0], [0.0, -1.0, 0.0]));
        close(&distances(&roots), &[2.0, 3.0], 0.0);
        assert!(roots.list.iter().all(|root| root.toggles && !root.visible));
    }

    #[test]
    fn steep_and_flat_cones() {
        for (radius, height) in [(1e-6, 1.0), (1.0, 1e-6)] {
            let cone = Cone::new(DVec3::ZERO, radius, DVec3::Y * height, 0.0, false).unwrap();
            let roots = cone.cross(&line([0.0, height / 2.0, -5.0], [0.0, 0.0, 1.0]));
            close(&distances(&roots), &[5.0 - radius / 2.0, 5.0 + radius / 2.0], 1e-14);
        }
    }

    #[test]
    fn side_that_was_left_is_not_met_again() {
        let cone = pointed();
        let first = cone.cross(&line([0.3, 0.2, -5.0], [0.0, 0.0, 1.0])).list[0];
        for dir in [DVec3::Z, DVec3::NEG_Z, DVec3::Y, DVec3::new(0.1, -0.5, 0.7)] {
            let roots = cone.cross(&Line { origin: first.point, dir, left: Some(SIDE) });
            let others =
                roots.list.iter().filter(|root| !root.left && root.part == SIDE && root.t.abs() < 1e-9);
            assert_eq!(others.count(), 0, "{dir}");
        }
    }
}
