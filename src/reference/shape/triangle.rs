//! One triangle, and the watertight test that meshes share (Woop, Benthin, Wald, Watertight Ray/Triangle Intersection,
//! JCGT 2(1), 2013).

use super::{Line, Root, Roots};
use glam::{DVec2, DVec3};
use std::cmp::Ordering;

/// Meets a lone triangle.
pub fn cross(corners: &[DVec3; 3], normals: Option<&[DVec3; 3]>, line: &Line) -> Roots {
    let sheared = Sheared::new(line);
    let root =
        sheared.meet(corners.map(|corner| sheared.project(corner)), || (*corners, normals.copied()), 0);
    Roots { starts_inside: false, list: root.into_iter().collect() }
}

/// A line, and the shear that lays it along the z axis of permuted coordinates: the test is then a plane one, whether
/// the origin is within the projected triangle.
///
/// A corner's projection depends on nothing but the corner and the line, and the sign of an edge is found exactly, so two
/// triangles that share an edge cannot disagree about its side: every line through a closed mesh meets it an even number of times.
pub struct Sheared<'a> {
    line: &'a Line,
    /// Axes: the direction's largest last.
    axes: [usize; 3],
    shear: DVec2,
}

impl<'a> Sheared<'a> {
    /// Prepares `line`.
    pub fn new(line: &'a Line) -> Self {
        let d = line.dir.abs();
        let z = if d.x > d.y && d.x > d.z {
            0
        } else if d.y > d.z {
            1
        } else {
            2
        };
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        let shear = DVec2::new(line.dir[x], line.dir[y]) / line.dir[z];
        Self { line, axes: [x, y, z], shear }
    }

    /// A corner as seen along the line, which is at the origin.
    pub fn project(&self, corner: DVec3) -> DVec2 {
        let v = corner - self.line.origin;
        let [x, y, z] = self.axes;
        DVec2::new(v[x], v[y]) - self.shear * v[z]
    }

    /// The meeting with a triangle, given its corners as [projected](Self::project); only if it is met are corners and
    /// normals asked for. It becomes part `part` of a surface.
    ///
    /// `t` is taken from the normal, which stays exact on huge triangles where Woop's interpolated depth does not.
    #[inline]
    pub fn meet(
        &self,
        [a, b, c]: [DVec2; 3],
        triangle: impl FnOnce() -> ([DVec3; 3], Option<[DVec3; 3]>),
        part: usize,
    ) -> Option<Root> {
        let departing = self.line.left == Some(part);
        if !departing {
            let side = edge_side(a, b);
            if side == Ordering::Equal || side != edge_side(b, c) || side != edge_side(c, a) {
                return None;
            }
        }
        let (corners, normals) = triangle();
        // POV-Ray's front is where the corners run clockwise in its left-handed space.
        let n = (corners[2] - corners[0]).cross(corners[1] - corners[0]);
        let (t, point) = if departing {
            (0.0, self.line.origin)
        } else {
            let t = n.dot(corners[0] - self.line.origin) / n.dot(self.line.dir);
            let p = self.line.at(t);
            (t, p - n * (n.dot(p - corners[0]) / n.length_squared()))
        };
        if !(t.is_finite() && point.is_finite()) {
            return None;
        }
        let shares = shares(&corners, n, point);
        let smooth = normals.map(|normals| (0..3).map(|i| shares[i] * normals[i]).sum());
        let root = Root { smooth, corners: shares, toggles: false, ..Root::new(t, point, n, part) };
        Some(root.departing(self.line))
    }
}

/// Barycentric coordinates of a point in the triangle's plane.
fn shares(corners: &[DVec3; 3], n: DVec3, p: DVec3) -> [f64; 3] {
    let [a, b, c] = corners.map(|corner| corner - p);
    let area = n.length_squared();
    let (u, v) = (n.dot(c.cross(b)) / area, n.dot(a.cross(c)) / area);
    [u, v, 1.0 - u - v]
}

/// On which side of the edge from `a` to `b` the origin lies; `Equal` only if the edge has no length.
///
/// The sign of `a × b`, exact. An origin exactly on the edge is taken to lie a little off it, always in the same direction,
/// so that of the triangles round an edge or corner exactly one (or a consistent few) are met.
#[inline]
fn edge_side(a: DVec2, b: DVec2) -> Ordering {
    let (ab, ba) = (a.x * b.y, a.y * b.x);
    let plain = ab - ba;
    // Beyond four roundings of the products the plain sign is certain; else Kahan's difference of products decides.
    let order = |x: f64, y: f64| x.partial_cmp(&y).unwrap_or(Ordering::Equal);
    if plain.abs() > 4.0 * f64::EPSILON * (ab.abs() + ba.abs()) {
        return order(plain, 0.0);
    }
    let exact = a.x.mul_add(b.y, -ba) + (-a.y).mul_add(b.x, ba);
    order(exact, 0.0).then(order(a.y, b.y)).then(order(b.x, a.x))
}

#[cfg(test)]
mod tests {
    use super::super::line;
    use super::*;

    const CORNERS: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y];

    fn met(corners: &[DVec3; 3], origin: [f64; 3], dir: [f64; 3]) -> Option<f64> {
        cross(corners, None, &line(origin, dir)).list.first().map(|root| root.t)
    }

    #[test]
    fn meets_from_both_sides_and_not_beside() {
        assert_eq!(met(&CORNERS, [0.25, 0.25, -2.0], [0.0, 0.0, 1.0]), Some(2.0));
        assert_eq!(met(&CORNERS, [0.25, 0.25, 2.0], [0.0, 0.0, -0.5]), Some(4.0));
        assert_eq!(met(&CORNERS, [0.75, 0.75, -2.0], [0.0, 0.0, 1.0]), None);
        assert_eq!(met(&CORNERS, [0.25, 0.25, -2.0], [1.0, 0.0, 0.0]), None);
    }

    #[test]
    fn degenerate_triangles_are_never_met() {
        for corners in
            [[DVec3::ZERO; 3], [DVec3::ZERO, DVec3::X, DVec3::X * 2.0], [DVec3::ZERO, DVec3::X, DVec3::X]]
        {
            assert_eq!(met(&corners, [0.5, 0.0, -1.0], [0.0, 0.0, 1.0]), None);
        }
        assert_eq!(met(&CORNERS, [f64::NAN, 0.2, -1.0], [0.0, 0.0, 1.0]), None);
    }

    #[test]
    fn shared_edge_is_met_exactly_once() {
        // A square cut along its diagonal; rays aimed exactly at points of the diagonal from awkward places.
        let (a, b, c, d) = (DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.3), DVec3::Y);
        for i in 1..1000 {
            let target = a.lerp(c, i as f64 / 1000.0);
            let origin = DVec3::new(
                0.1 + (i as f64).sin(),
                0.2 + (1.7 * i as f64).cos(),
                -3.0 - (0.3 * i as f64).sin(),
            );
            let line = Line { origin, dir: target - origin, left: None };
            let count = cross(&[a, b, c], None, &line).list.len() + cross(&[a, c, d], None, &line).list.len();
            assert_eq!(count, 1, "point {i} of the diagonal");
        }
    }

    #[test]
    fn huge_triangle_keeps_its_depth() {
        let huge = [DVec3::new(-1e6, 0.0, -1e6), DVec3::new(1e6, 0.0, -1e6), DVec3::new(0.0, 0.0, 2e6)];
        let t = met(&huge, [3.0, 1.7, -4.0], [0.6, -0.1, 0.8]).unwrap();
        assert!((t - 17.0).abs() < 1e-13, "{t}");
    }

    #[test]
    fn smooth_normal_is_the_corners_at_the_corners() {
        let normals =
            [DVec3::NEG_Z, DVec3::new(1.0, 0.0, -1.0).normalize(), DVec3::new(0.0, 1.0, -1.0).normalize()];
        let roots = cross(&CORNERS, Some(&normals), &line([0.5, 0.25, -2.0], [0.0, 0.0, 1.0]));
        let expected = 0.25 * normals[0] + 0.5 * normals[1] + 0.25 * normals[2];
        assert!(roots.list[0].smooth.unwrap().distance(expected) < 1e-15);
    }
}
