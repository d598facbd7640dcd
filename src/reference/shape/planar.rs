//! Plane and disc: half spaces, of which the disc shows only a ring.

use super::{Line, Root, Roots};
use glam::DVec3;
use smallvec::smallvec;

/// The one part of the surface.
const SURFACE: usize = 0;

/// Where the line enters or leaves the half space `normal . p <= distance`.
///
/// A line along the plane does not meet it and is inside all its way or nowhere.
pub fn plane(normal: DVec3, distance: f64, line: &Line) -> Roots {
    let above = if line.left.is_some() { 0.0 } else { normal.dot(line.origin) - distance };
    half_space(normal, above, line, |p| p - normal * (normal.dot(p) - distance))
}

/// The same half space through `center`, visible from `hole` to `radius` from it, both included.
pub fn disc(center: DVec3, normal: DVec3, radius: f64, hole: f64, line: &Line) -> Roots {
    let above = if line.left.is_some() { 0.0 } else { normal.dot(line.origin - center) };
    let mut roots = half_space(normal, above, line, |p| p - normal * normal.dot(p - center));
    for root in &mut roots.list {
        let r = root.point.distance(center);
        root.visible = hole <= r && r <= radius;
    }
    roots
}

/// `above` is the origin's height over the plane, `snap` puts a point on it.
fn half_space(normal: DVec3, above: f64, line: &Line, snap: impl Fn(DVec3) -> DVec3) -> Roots {
    let rise = normal.dot(line.dir);
    let t = -above / rise;
    if rise == 0.0 || !t.is_finite() {
        return Roots { starts_inside: above <= 0.0, list: smallvec![] };
    }
    let root = Root::new(t + 0.0, snap(line.at(t)), normal, SURFACE).departing(line);
    Roots { starts_inside: rise > 0.0, list: smallvec![root] }
}

#[cfg(test)]
mod tests {
    use super::super::{distances, line};
    use super::*;

    #[test]
    fn inside_is_below_the_normal() {
        let down = plane(DVec3::Y, 1.0, &line([0.0, 3.0, 0.0], [0.0, -1.0, 0.0]));
        assert_eq!((down.starts_inside, distances(&down)), (false, vec![2.0]));
        let up = plane(DVec3::Y, 1.0, &line([0.0, 3.0, 0.0], [0.0, 1.0, 0.0]));
        assert_eq!((up.starts_inside, distances(&up)), (true, vec![-2.0]));
    }

    #[test]
    fn line_along_the_plane_meets_nothing_and_knows_its_side() {
        let x = [1.0, 0.0, 0.0];
        for (y, inside) in [(-1e-300, true), (0.0, true), (1e-300, false)] {
            let roots = plane(DVec3::Y, 0.0, &line([0.0, y, 0.0], x));
            assert_eq!((roots.starts_inside, roots.list.len()), (inside, 0), "at height {y}");
        }
    }

    #[test]
    fn grazing_sight_stays_on_the_plane() {
        let roots = plane(DVec3::Y, 0.0, &line([0.0, 1.0, 0.0], [1.0, -1e-8, 0.0]));
        assert_eq!(roots.list[0].point.y, 0.0);
        assert!((roots.list[0].t - 1e8).abs() <= 1e8 * f64::EPSILON);
    }

    #[test]
    fn plane_that_was_left_is_not_met_again() {
        let line = Line { origin: DVec3::new(3.0, 0.1, 0.0), dir: DVec3::Y, left: Some(SURFACE) };
        let roots = plane(DVec3::Y, 0.1, &line);
        assert!(roots.list[0].left);
        assert_eq!(roots.list[0].t, 0.0);
    }

    #[test]
    fn disc_shows_its_ring_but_divides_all_space() {
        for (x, visible) in [(0.0, false), (0.5, true), (0.75, true), (1.0, true), (1.001, false)] {
            let roots = disc(DVec3::ZERO, DVec3::Y, 1.0, 0.5, &line([x, 1.0, 0.0], [0.0, -1.0, 0.0]));
            assert_eq!((roots.list[0].visible, roots.list[0].toggles), (visible, true), "at {x}");
        }
    }
}
