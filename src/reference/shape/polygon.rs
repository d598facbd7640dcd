//! Flat polygon of one or more outlines, filled by the even-odd rule.

use super::{Line, Root, Roots};
use glam::{DVec2, DVec3};
use smallvec::smallvec;

/// The one part of the surface.
const SURFACE: usize = 0;

/// The meeting with the polygon's plane, if it lies within an odd number of outlines.
pub fn cross(outlines: &[Vec<DVec3>], line: &Line) -> Roots {
    let Some((corner, n)) = plane(outlines) else { return Roots::default() };
    let departing = line.left.is_some();
    let t = if departing { 0.0 } else { n.dot(corner - line.origin) / n.dot(line.dir) };
    let p = line.at(t);
    let p = p - n * n.dot(p - corner);
    if !(p.is_finite() && (departing || is_within(outlines, n, p))) {
        return Roots::default();
    }
    let root = Root { toggles: false, ..Root::new(t, p, n, SURFACE) };
    Roots { starts_inside: false, list: smallvec![root.departing(line)] }
}

/// A corner and the unit normal: that of the largest triangle in a fan over the outlines, which no repeated or aligned
/// corners spoil, on the side of the first one that has an area (POV-Ray's front).
fn plane(outlines: &[Vec<DVec3>]) -> Option<(DVec3, DVec3)> {
    let corner = *outlines.first()?.first()?;
    let fans = outlines.iter().flat_map(|outline| outline.windows(2));
    let mut normals = fans.map(|edge| (edge[0] - corner).cross(edge[1] - corner));
    let first = normals.find(|n| *n != DVec3::ZERO)?;
    let largest =
        normals.fold(first, |best, n| if n.length_squared() > best.length_squared() { n } else { best });
    let n = largest.try_normalize()?;
    Some((corner, if n.dot(first) < 0.0 { -n } else { n }))
}

/// Counts the edges to one side of `p`, seen along the normal's largest axis. An edge owns its lower end only, so a ray
/// through a corner counts it once.
fn is_within(outlines: &[Vec<DVec3>], n: DVec3, p: DVec3) -> bool {
    let flat = |v: DVec3| {
        let (v, n) = (v - p, n.abs());
        if n.x > n.y && n.x > n.z {
            DVec2::new(v.y, v.z)
        } else if n.y > n.z {
            DVec2::new(v.z, v.x)
        } else {
            DVec2::new(v.x, v.y)
        }
    };
    let mut inside = false;
    for outline in outlines {
        for (i, a) in outline.iter().enumerate() {
            let (a, b) = (flat(*a), flat(outline[(i + 1) % outline.len()]));
            if (a.y > 0.0) != (b.y > 0.0) && (a.x * b.y < a.y * b.x) == (b.y > a.y) {
                inside = !inside;
            }
        }
    }
    inside
}

#[cfg(test)]
mod tests {
    use super::super::line;
    use super::*;

    fn square(half: f64) -> Vec<DVec3> {
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| DVec3::new(x, y, 0.0) * half)
            .to_vec()
    }

    fn met(outlines: &[Vec<DVec3>], x: f64, y: f64) -> bool {
        !cross(outlines, &line([x, y, -1.0], [0.0, 0.0, 1.0])).list.is_empty()
    }

    #[test]
    fn square_with_a_hole() {
        let frame = [square(2.0), square(1.0)];
        for (x, y, expected) in
            [(0.0, 0.0, false), (1.5, 0.0, true), (-1.5, 1.0, true), (2.5, 0.0, false), (0.0, -1.5, true)]
        {
            assert_eq!(met(&frame, x, y), expected, "({x}, {y})");
        }
    }

    #[test]
    fn repeated_and_aligned_corners_change_nothing() {
        let mut outline = square(1.0);
        outline.insert(1, DVec3::new(0.0, -1.0, 0.0));
        outline.insert(0, outline[0]);
        for (x, y) in [(0.0, 0.0), (0.0, -0.5), (-0.9, 0.9)] {
            assert!(met(&[outline.clone()], x, y));
        }
        assert!(!met(&[outline], 1.1, 0.0));
    }

    #[test]
    fn five_pointed_star_has_an_empty_middle() {
        let star = (0..5)
            .map(|i| (i as f64 * 0.8 * std::f64::consts::PI).sin_cos())
            .map(|(x, y)| DVec3::new(x, y, 0.0));
        let star = [star.collect()];
        assert!(!met(&star, 0.0, 0.0));
        assert!(met(&star, 0.0, 0.8));
    }

    #[test]
    fn no_area_is_no_polygon() {
        assert!(!met(&[], 0.0, 0.0));
        assert!(!met(&[vec![]], 0.0, 0.0));
        assert!(!met(&[vec![DVec3::ZERO, DVec3::X, DVec3::X * 2.0]], 0.5, 0.0));
    }
}
