//! Axis-parallel box by slabs (Kay and Kajiya 1986). Its sides are included: a ray along an edge or in a face meets it.

use super::{Line, Root, Roots};
use glam::DVec3;
use smallvec::smallvec;

/// Where the line enters and leaves; part `2 axis + 1` is the face at `max`, part `2 axis` the one at `min`.
///
/// A flat box (`min == max` in an axis) is entered and left at the same `t`. Points are set exactly on their face.
pub fn cross(min: DVec3, max: DVec3, line: &Line) -> Roots {
    let (mut enter, mut enter_part) = (f64::NEG_INFINITY, None);
    let (mut leave, mut leave_part) = (f64::INFINITY, None);
    for axis in 0..3 {
        let (o, d) = (line.origin[axis], line.dir[axis]);
        if d == 0.0 {
            if !(min[axis] <= o && o <= max[axis]) {
                return Roots::default();
            }
            continue;
        }
        let rising = d > 0.0;
        let (first, last) = if rising { (min[axis], max[axis]) } else { (max[axis], min[axis]) };
        let (t_first, t_last) = ((first - o) / d, (last - o) / d);
        // A NaN on either side loses both comparisons and leaves the box without a way in.
        if t_first > enter {
            (enter, enter_part) = (t_first, Some(2 * axis + usize::from(!rising)));
        }
        if t_last < leave {
            (leave, leave_part) = (t_last, Some(2 * axis + usize::from(rising)));
        }
    }
    let (Some(enter_part), Some(leave_part)) = (enter_part, leave_part) else { return Roots::default() };
    if !(enter <= leave) {
        return Roots::default();
    }
    let root = |t: f64, part: usize| {
        let (axis, high) = (part / 2, part % 2 == 1);
        let mut point = line.at(t).clamp(min, max);
        point[axis] = if high { max[axis] } else { min[axis] };
        let mut normal = DVec3::ZERO;
        normal[axis] = if high { 1.0 } else { -1.0 };
        Root::new(t + 0.0, point, normal, part).departing(line)
    };
    Roots { starts_inside: false, list: smallvec![root(enter, enter_part), root(leave, leave_part)] }
}

#[cfg(test)]
mod tests {
    use super::super::{distances, line};
    use super::*;

    fn unit(origin: [f64; 3], dir: [f64; 3]) -> Vec<f64> {
        distances(&cross(DVec3::NEG_ONE, DVec3::ONE, &line(origin, dir)))
    }

    #[test]
    fn axis_parallel_rays_meet_faces_edges_and_corners() {
        for x in [-1.0, -0.3, 0.0, 1.0] {
            for zero in [0.0, -0.0] {
                assert_eq!(unit([x, 1.0, -3.0], [zero, zero, 1.0]), [2.0, 4.0], "x = {x}, d = {zero}");
            }
        }
        assert!(unit([1.0000000000000002, 0.0, -3.0], [0.0, 0.0, 1.0]).is_empty());
        assert!(unit([0.0, f64::NAN, -3.0], [0.0, 0.0, 1.0]).is_empty());
    }

    #[test]
    fn almost_parallel_ray_does_not_divide_itself_into_nan() {
        assert_eq!(unit([0.0, 0.0, -3.0], [1e-310, -1e-310, 1.0]), [2.0, 4.0]);
    }

    #[test]
    fn flat_box_is_met_twice_at_once() {
        let roots = cross(
            DVec3::new(-1.0, 0.0, -1.0),
            DVec3::new(1.0, 0.0, 1.0),
            &line([0.2, 2.0, 0.1], [0.0, -1.0, 0.0]),
        );
        assert_eq!(distances(&roots), [2.0, 2.0]);
        assert_eq!((roots.list[0].normal, roots.list[1].normal), (DVec3::Y, DVec3::NEG_Y));
    }

    #[test]
    fn inside_of_a_huge_box() {
        let roots = cross(DVec3::splat(-1e9), DVec3::splat(1e9), &line([0.0; 3], [0.6, 0.8, 0.0]));
        assert_eq!(roots.list[1].point.y, 1e9);
        assert!(roots.list[0].t < 0.0);
    }

    #[test]
    fn face_that_was_left_is_marked() {
        // 0.1 + 0.2 and such: the face is not a round number, its point is on it exactly all the same.
        let max = DVec3::splat(0.1 + 0.2);
        let origin = DVec3::new(0.1, max.y, 0.05);
        let roots = cross(DVec3::ZERO, max, &Line { origin, dir: DVec3::new(0.3, -0.9, 0.1), left: Some(3) });
        assert!(roots.list[0].left && !roots.list[1].left);
    }
}
