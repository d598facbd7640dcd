//! Boxes around what of a ball lies behind a plane or in another ball: domes and lenses.

use super::{Aabb, HalfSpace};
use glam::DVec3;

/// What is within `radius` of `center`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Its middle.
    pub center: DVec3,
    /// How far it goes, over 0.
    pub radius: f64,
}

/// Planes that cut balls are moved outward by this share of the largest coordinate at hand: a thousand times what their places are off
/// by, and what is on a surface to a few roundings is still in the box.
const ROOM: f64 = 1e-12;

impl Ball {
    /// Around what of it lies behind `plane`: in each direction the ball's own end if that does, otherwise the end of the circle where
    /// the plane cuts it.
    pub fn bounds_behind(&self, plane: &HalfSpace) -> Aabb {
        let (&Self { center, radius }, own) = (self, self.bounds());
        let reach = center.abs().max_element() + radius + plane.at.abs();
        let at = plane.at + reach * ROOM;
        // How far the middle lies before the plane.
        let height = plane.normal.dot(center) - at;
        if height >= radius {
            return Aabb::EMPTY;
        }
        if height <= -radius {
            return own;
        }
        let circle = ((radius - height) * (radius + height)).sqrt();
        let (middle, wide) =
            (center - plane.normal * height, (1.0 - plane.normal * plane.normal).max(DVec3::ZERO));
        let wide = DVec3::from_array(wide.to_array().map(f64::sqrt)) * circle;
        // The ball's ends: `radius` along an axis, forward and backward.
        let sinks = plane.normal * radius + height;
        let rises = plane.normal * radius - height;
        Aabb {
            min: DVec3::select(rises.cmpge(DVec3::ZERO), own.min, middle - wide),
            max: DVec3::select(sinks.cmple(DVec3::ZERO), own.max, middle + wide),
        }
    }

    /// Around what it has in common with `other`: a dome of each, on the circle where their surfaces meet. [`Aabb::INFINITE`] if they have one
    /// middle.
    pub fn bounds_with(&self, other: &Self) -> Aabb {
        let apart = other.center - self.center;
        let distance = apart.length();
        let normal = apart / distance;
        if !normal.is_finite() {
            return Aabb::INFINITE;
        }
        // How far off the circle lies. (The squares of radii that differ little are not subtracted.)
        let (sum, difference) = (self.radius + other.radius, self.radius - other.radius);
        let height = 0.5 * (distance + sum * difference / distance);
        let at = normal.dot(self.center) + height;
        let (near, far) = (HalfSpace { normal, at }, HalfSpace { normal: -normal, at: -at });
        self.bounds_behind(&far).union(other.bounds_behind(&near))
    }

    /// Around all of it.
    fn bounds(&self) -> Aabb {
        Aabb { min: self.center - self.radius, max: self.center + self.radius }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    const POINTS: usize = 4000;

    /// Holds points of `ball` that are in something else against the box around these: none lies outside, and on no side does
    /// it reach much farther than they do.
    fn check(
        ball: &Ball,
        others: &[Ball],
        is_in: impl Fn(DVec3) -> bool,
        bounds: Aabb,
        numbers: &mut Random,
    ) {
        let mut found = Aabb::EMPTY;
        for &Ball { center, radius } in [ball].into_iter().chain(others) {
            for k in 0..POINTS {
                // On surfaces, and somewhere inside.
                let p = numbers.vector(1.0).normalize()
                    * if k % 4 == 0 { numbers.between(0.0, 1.0) } else { 1.0 };
                let p = center + p * radius * (1.0 - 1e-15);
                if is_in(p) && (p - ball.center).length() <= ball.radius {
                    found = found.union(Aabb::of([p]));
                }
            }
        }
        if found.is_empty() {
            return;
        }
        let smallest = others.iter().map(|other| other.radius).fold(ball.radius, f64::min);
        // (Of a surface that bends little a side's end is met by one point in many.)
        assert!((found.min - bounds.min).min_element() >= 0.0, "{found:?} {bounds:?}");
        assert!((bounds.max - found.max).min_element() >= 0.0, "{found:?} {bounds:?}");
        let loose = (found.min - bounds.min).max(bounds.max - found.max).max_element();
        assert!(loose < 0.2 * smallest, "{loose} {smallest} {found:?} {bounds:?}");
    }

    fn some_ball(numbers: &mut Random) -> Ball {
        Ball { center: numbers.vector(1.0), radius: numbers.between(0.2, 1.5) }
    }

    #[test]
    fn domes_lie_in_their_boxes() {
        let mut numbers = Random::new(11);
        for round in 0..300 {
            let ball = some_ball(&mut numbers);
            // One in three along an axis.
            let normal =
                if round % 3 == 0 { DVec3::AXES[round % 9 / 3] } else { numbers.vector(1.0).normalize() };
            let at = normal.dot(ball.center) + ball.radius * numbers.between(-0.95, 1.2);
            let plane = HalfSpace { normal, at };
            check(&ball, &[], |p| normal.dot(p) <= at, ball.bounds_behind(&plane), &mut numbers);
        }
    }

    #[test]
    fn lenses_lie_in_their_boxes() {
        let mut numbers = Random::new(12);
        for _ in 0..300 {
            let (a, b) = (some_ball(&mut numbers), some_ball(&mut numbers));
            let bounds = a.bounds_with(&b);
            if (b.center - a.center).length() > 0.95 * (a.radius + b.radius) {
                continue;
            }
            check(&a, &[b], |p| (p - b.center).length() <= b.radius, bounds, &mut numbers);
        }
    }

    #[test]
    fn a_ball_in_another_and_balls_apart_are_known() {
        let (small, large) =
            (Ball { center: DVec3::X, radius: 0.5 }, Ball { center: DVec3::ZERO, radius: 2.0 });
        assert_eq!(small.bounds_with(&large), small.bounds());
        assert_eq!(large.bounds_with(&small), small.bounds());
        assert_eq!(large.bounds_with(&large), Aabb::INFINITE);
        let far = Ball { center: DVec3::Y * 9.0, radius: 1.0 };
        assert!(far.bounds_with(&large).is_empty());
        // A dome of which only the top is left.
        let top = HalfSpace { normal: -DVec3::Y, at: -1.9 };
        let bounds = large.bounds_behind(&top);
        let wide = (4.0f64 - 1.9 * 1.9).sqrt();
        let expected = Aabb { min: DVec3::new(-wide, 1.9, -wide), max: DVec3::new(wide, 2.0, wide) };
        assert!((bounds.min - expected.min).abs().max_element() < 1e-10, "{bounds:?}");
        assert!((bounds.max - expected.max).abs().max_element() < 1e-10, "{bounds:?}");
    }
}
