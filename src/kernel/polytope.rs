//! Boxes around what lies between planes, and around quadrics between such.

use super::Aabb;
use glam::{DMat3, DVec3};

/// What lies behind a plane: all `p` with `normal.dot(p) <= at`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfSpace {
    /// Of unit length, outward.
    pub normal: DVec3,
    /// How far along the normal the plane lies from the origin.
    pub at: f64,
}

/// A polytope reaches at most so many times as far as its farthest plane lies from its middle; one that is sharper is taken to have no end.
const SHARPEST: f64 = 4096.0;
/// What corners are off by, as a share of that reach, with room: some tens of roundings.
const ROOM: f64 = 1e-13;
/// Faces that come so near to the end of what was looked at (a share) have none.
const NEAR_END: f64 = 0.99;
/// What places far from the origin are off by, as a share of that, with room.
const FAR_ROOM: f64 = 1e-14;
/// Boxes around quadrics are wider by this share of their size, and by this of how far off they are: roots of sums of a dozen terms.
const QUADRIC_ROOM: f64 = 1e-6;
const QUADRIC_FAR_ROOM: f64 = 1e-9;
/// Quadrics whose determinants are smaller shares of what they could be are taken for flat.
const FLAT: f64 = 1e-9;
/// With more planes the first of them bound it well enough; time grows by the square of their number.
const MOST_PLANES: usize = 128;

impl HalfSpace {
    /// The six that a box is made of; fewer where it has no end.
    pub fn of_box(bounds: Aabb) -> impl Iterator<Item = Self> {
        let sides = [DVec3::X, DVec3::Y, DVec3::Z].into_iter().enumerate().flat_map(move |(k, axis)| {
            [Self { normal: axis, at: bounds.max[k] }, Self { normal: -axis, at: -bounds.min[k] }]
        });
        sides.filter(|side| side.at.is_finite())
    }
}

/// Around what lies in all of `half_spaces`: [`Aabb::INFINITE`] if that has no end, or none that is near.
pub fn bounds_of(half_spaces: &[HalfSpace]) -> Aabb {
    let planes = || half_spaces.iter().take(MOST_PLANES);
    // The point with the least squares of distances from all planes is as good a middle as any.
    let (mut normals, mut feet) = (DMat3::ZERO, DVec3::ZERO);
    for &HalfSpace { normal, at } in planes() {
        normals += DMat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z);
        feet += normal * at;
    }
    let middle = normals.inverse() * feet;
    if !middle.is_finite() {
        return Aabb::INFINITE;
    }
    let height =
        |plane: &HalfSpace, p: DVec3| plane.normal.dot(p - middle) - (plane.at - plane.normal.dot(middle));
    let farthest = planes().map(|plane| height(plane, middle).abs()).fold(0.0, f64::max);
    let reach = farthest * SHARPEST;
    let mut bounds = Aabb::EMPTY;
    for (number, plane) in planes().enumerate() {
        // Its face: a square around its foot, cut by all other planes.
        let foot = middle - plane.normal * height(plane, middle);
        let (u, v) = plane.normal.any_orthonormal_pair();
        let mut face: Vec<DVec3> =
            [u + v, v - u, -u - v, u - v].iter().map(|&corner| foot + corner * reach).collect();
        for (_, other) in planes().enumerate().filter(|(other, _)| *other != number) {
            face = cut(&face, |p| height(other, p) - reach * ROOM);
        }
        if !face.iter().all(|&p| (p - foot).length() < reach * NEAR_END) {
            return Aabb::INFINITE;
        }
        bounds = bounds.union(Aabb::of(face));
    }
    // If no face is left, it lies farther off than was looked.
    let room = reach * ROOM + middle.abs().max_element() * FAR_ROOM;
    match bounds.is_finite() {
        true => Aabb { min: bounds.min - room, max: bounds.max + room },
        false => Aabb::INFINITE,
    }
}

/// What is left of a convex polygon where `height` is not above 0 (Sutherland and Hodgman 1974, Reentrant polygon clipping).
fn cut(face: &[DVec3], height: impl Fn(DVec3) -> f64) -> Vec<DVec3> {
    let mut left = Vec::with_capacity(face.len() + 1);
    let Some(&last) = face.last() else { return left };
    let mut from = (last, height(last));
    for &p in face {
        let to = (p, height(p));
        if (from.1 > 0.0) != (to.1 > 0.0) {
            left.push(from.0 + (to.0 - from.0) * (from.1 / (from.1 - to.1)));
        }
        if to.1 <= 0.0 {
            left.push(p);
        }
        from = to;
    }
    left
}

/// `x^T A x + linear . x + constant`: where that is not above 0, it is inside.
#[derive(Debug, Clone, Copy)]
pub struct Quadric {
    /// `A`, symmetric.
    pub matrix: DMat3,
    /// Times `x`.
    pub linear: DVec3,
    /// What is left at the origin.
    pub constant: f64,
}

impl Quadric {
    /// Around what is inside, as far as that lies in the box `within`.
    pub fn bounds_in(&self, within: Aabb) -> Aabb {
        let mut bounds = within.intersection(self.bounds());
        // One axis tells of the others: of a paraboloid between two planes first how high, then how wide.
        for axis in [0, 1, 2, 0, 1, 2] {
            let (low, high) = self.along(axis, &bounds);
            bounds.min[axis] = bounds.min[axis].max(low);
            bounds.max[axis] = bounds.max[axis].min(high);
        }
        bounds
    }

    /// Of an ellipsoid.
    fn bounds(&self) -> Aabb {
        let Self { matrix: a, linear, constant } = *self;
        // By Sylvester's criterion, with room: what is almost flat is left to others.
        let size = a.x_axis.abs().max(a.y_axis.abs()).max(a.z_axis.abs()).max_element();
        let minor = a.x_axis.x * a.y_axis.y - a.x_axis.y * a.y_axis.x;
        let definite =
            a.x_axis.x > FLAT * size && minor > FLAT * size * size && a.determinant() > FLAT * size.powi(3);
        if !definite {
            return Aabb::INFINITE;
        }
        let inverse = a.inverse();
        let middle = inverse * linear * -0.5;
        let square = -(constant + 0.5 * linear.dot(middle));
        let half =
            DVec3::new(inverse.x_axis.x, inverse.y_axis.y, inverse.z_axis.z).map(|i| (i * square).sqrt());
        if !(half.is_finite() && middle.is_finite()) {
            return Aabb::INFINITE;
        }
        let room = QUADRIC_ROOM * half.max_element() + QUADRIC_FAR_ROOM * middle.abs().max_element();
        Aabb { min: middle - half - room, max: middle + half + room }
    }

    /// How far it reaches along an axis, in the box `within` along the others; only where that does not hang on where along them.
    fn along(&self, axis: usize, within: &Aabb) -> (f64, f64) {
        let none = (f64::NEG_INFINITY, f64::INFINITY);
        let Self { matrix: a, linear, constant } = *self;
        let [j, k] = [(axis + 1) % 3, (axis + 2) % 3];
        if a.col(axis)[j] != 0.0 || a.col(axis)[k] != 0.0 || a.col(j)[k] != 0.0 {
            return none;
        }
        let of = |i: usize| (a.col(i)[i], linear[i]);
        let rest = constant
            + least(of(j), (within.min[j], within.max[j]))
            + least(of(k), (within.min[k], within.max[k]));
        let (square, line) = of(axis);
        if square > 0.0 {
            let middle = -0.5 * line / square;
            let half = (middle * middle - rest / square).max(0.0).sqrt();
            let room = QUADRIC_ROOM * half + QUADRIC_FAR_ROOM * middle.abs();
            if half.is_finite() { (middle - half - room, middle + half + room) } else { none }
        } else if square == 0.0 && line != 0.0 && rest.is_finite() {
            let end = -rest / line;
            let room = QUADRIC_ROOM * end.abs();
            if line > 0.0 { (none.0, end + room) } else { (end - room, none.1) }
        } else {
            none
        }
    }
}

/// The least of `square x^2 + line x` where `x` is between two ends.
fn least((square, line): (f64, f64), (low, high): (f64, f64)) -> f64 {
    let at = |x: f64| match (square, line) {
        (0.0, 0.0) => 0.0,
        (0.0, _) => line * x,
        _ => (square * x + line) * x,
    };
    let bottom = if square > 0.0 { (-0.5 * line / square).clamp(low, high.max(low)) } else { low };
    let least = at(low).min(at(high)).min(at(bottom));
    if least.is_nan() { f64::NEG_INFINITY } else { least }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn plane(normal: DVec3, at: f64) -> HalfSpace {
        HalfSpace { normal: normal.normalize(), at }
    }

    #[test]
    fn boxes_are_around_polytopes_and_close() {
        let mut numbers = Random::new(5);
        for round in 0..200 {
            let middle = numbers.vector(1.0) * 10f64.powi(round % 5);
            let mut planes: Vec<HalfSpace> = (0..6 + round as usize % 20)
                .map(|_| {
                    let normal = numbers.vector(1.0).normalize();
                    HalfSpace { normal, at: normal.dot(middle) + 0.5 + 0.4 * numbers.between(-1.0, 1.0) }
                })
                .collect();
            // A cage, so that it has an end.
            planes.extend(HalfSpace::of_box(Aabb { min: middle - 3.0, max: middle + 3.0 }));
            let bounds = bounds_of(&planes);
            assert!(bounds.is_finite() && (bounds.max - bounds.min).max_element() < 6.1, "{bounds:?}");
            let (mut most, mut least) = (DVec3::NEG_INFINITY, DVec3::INFINITY);
            for _ in 0..4000 {
                // From the middle to where it ends: its corners are neared, never passed.
                let way = numbers.vector(1.0).normalize();
                let end = planes.iter().map(|p| (p.at - p.normal.dot(middle)) / p.normal.dot(way));
                let p = middle + way * end.filter(|t| *t > 0.0).fold(f64::INFINITY, f64::min);
                (most, least) = (most.max(p), least.min(p));
            }
            assert!(bounds.min.cmple(least).all() && bounds.max.cmpge(most).all());
            let loose = (bounds.max - most).max(least - bounds.min).max_element();
            assert!(loose < 0.7, "{loose} in round {round}");
        }
    }

    #[test]
    fn what_has_no_end_has_no_box() {
        let cage: Vec<_> = HalfSpace::of_box(Aabb { min: DVec3::splat(-1.0), max: DVec3::ONE }).collect();
        assert!(bounds_of(&cage).is_finite());
        for gone in 0..6 {
            let mut open = cage.clone();
            open.remove(gone);
            assert_eq!(bounds_of(&open), Aabb::INFINITE, "without side {gone}");
            // Closed again by slanting ones, if not too far off.
            let side = cage[gone];
            let slant = |by: DVec3| plane(side.normal + by, 2.0);
            let (u, v) = side.normal.any_orthonormal_pair();
            open.extend([slant(u), slant(v)]);
            assert!(bounds_of(&open).is_finite());
        }
        // A pyramid, and an endless one.
        let sides = [
            DVec3::new(1.0, 1.0, 0.0),
            DVec3::new(-1.0, 1.0, 0.0),
            DVec3::new(0.0, 1.0, 1.0),
            DVec3::new(0.0, 1.0, -1.0),
        ];
        let endless: Vec<_> = sides.map(|normal| plane(normal, 0.0)).into();
        assert_eq!(bounds_of(&endless), Aabb::INFINITE);
        let mut pyramid = endless;
        pyramid.push(plane(DVec3::NEG_Y, 2.0));
        let bounds = bounds_of(&pyramid);
        let apart =
            (bounds.min - DVec3::splat(-2.0)).abs().max((bounds.max - DVec3::new(2.0, 0.0, 2.0)).abs());
        assert!(apart.max_element() < 1e-6, "{bounds:?}");
        assert_eq!(bounds_of(&[]), Aabb::INFINITE);
    }

    #[test]
    fn a_box_without_some_ends_has_the_other_sides() {
        let tube = Aabb {
            min: DVec3::new(-1.0, f64::NEG_INFINITY, -2.0),
            max: DVec3::new(1.0, f64::INFINITY, f64::INFINITY),
        };
        let sides: Vec<_> = HalfSpace::of_box(tube).map(|side| (side.normal, side.at)).collect();
        assert_eq!(sides, [(DVec3::X, 1.0), (DVec3::NEG_X, 1.0), (DVec3::NEG_Z, 2.0)]);
    }

    #[test]
    fn quadrics_end_where_they_do() {
        let quadric = |squares: [f64; 3], linear: [f64; 3], constant: f64| Quadric {
            matrix: DMat3::from_diagonal(squares.into()),
            linear: linear.into(),
            constant,
        };
        let near = |a: DVec3, b: [f64; 3]| (a - DVec3::from_array(b)).abs().max_element() < 1e-4;
        // An ellipsoid about (1, 0, 0), turned: a sphere of radius 2 stretched along (1, 1, 0).
        let turned = quadric([1.0, 1.0, 0.25], [-2.0, 0.0, 0.0], -3.0);
        let bounds = turned.bounds_in(Aabb::INFINITE);
        assert!(near(bounds.min, [-1.0, -2.0, -4.0]) && near(bounds.max, [3.0, 2.0, 4.0]), "{bounds:?}");
        let (c, s) = (0.6, 0.8);
        let turn = DMat3::from_cols(DVec3::new(c, s, 0.0), DVec3::new(-s, c, 0.0), DVec3::Z);
        let slanting = Quadric {
            matrix: turn * DMat3::from_diagonal(DVec3::new(1.0, 0.25, 1.0)) * turn.transpose(),
            linear: DVec3::ZERO,
            constant: -1.0,
        };
        let bounds = slanting.bounds_in(Aabb::INFINITE);
        let wide = [(c * c + 4.0 * s * s).sqrt(), (s * s + 4.0 * c * c).sqrt(), 1.0];
        assert!(near(bounds.max, wide) && near(-bounds.min, wide), "{bounds:?}");
        // Inside out it is everywhere.
        let hollow = quadric([-1.0, -1.0, -1.0], [0.0; 3], 1.0);
        assert_eq!(hollow.bounds_in(Aabb::INFINITE), Aabb::INFINITE);

        let slab = Aabb {
            min: DVec3::new(f64::NEG_INFINITY, 0.0, f64::NEG_INFINITY),
            max: DVec3::new(f64::INFINITY, 3.0, f64::INFINITY),
        };
        // A cylinder, a cone, a paraboloid, a hyperboloid of one sheet between two planes.
        for (shape, width) in [
            (quadric([1.0, 0.0, 1.0], [0.0; 3], -4.0), 2.0),
            (quadric([1.0, -1.0, 1.0], [0.0; 3], 0.0), 3.0),
            (quadric([1.0, 0.0, 1.0], [0.0, -1.0, 0.0], 0.0), 3f64.sqrt()),
            (quadric([1.0, -1.0, 1.0], [0.0; 3], -1.0), 10f64.sqrt()),
        ] {
            let bounds = shape.bounds_in(slab);
            assert!(
                near(bounds.max, [width, 3.0, width]) && near(bounds.min, [-width, 0.0, -width]),
                "{bounds:?}"
            );
        }
        // Without planes a paraboloid has one end.
        let bounds = quadric([1.0, 0.0, 1.0], [0.0, -1.0, 0.0], 0.0).bounds_in(Aabb::INFINITE);
        assert!(
            bounds.min.y.abs() < 1e-9 && bounds.max == DVec3::INFINITY && bounds.min.x == f64::NEG_INFINITY
        );
    }
}
