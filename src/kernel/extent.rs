//! Where in a box a polynomial may be zero, by interval arithmetic (Moore 1966, Interval Analysis): a box that a scene gives is mostly larger
//! than what is in it.

use super::Aabb;
use super::univariate::Step;

/// Halvings of the box, axis by axis: a 32nd of each edge is told from the next.
const HALVINGS: u32 = 15;

/// Steps taken at most: a surface takes about a thousand sums, and one of many terms is left as it is.
const MOST_STEPS: usize = 1 << 15;

/// Roundings of a sum, of the sum of its terms' magnitudes: a few for each power, with room.
const ROUNDINGS: f64 = 1024.0 * f64::EPSILON;

/// All numbers between two.
#[derive(Debug, Clone, Copy)]
struct Interval(f64, f64);

impl Interval {
    fn plus(self, x: Self) -> Self {
        Self(self.0 + x.0, self.1 + x.1)
    }

    fn times(self, x: Self) -> Self {
        let [a, b, c, d] = [self.0 * x.0, self.0 * x.1, self.1 * x.0, self.1 * x.1];
        Self(a.min(b).min(c.min(d)), a.max(b).max(c.max(d)))
    }
}

/// What a sum may come to in a box, but for roundings.
fn range(steps: &[Step], [x, y, z]: [Interval; 3], coefficient: impl Fn(f64) -> f64) -> Interval {
    let none = Interval(0.0, 0.0);
    let (mut in_x, mut in_y, mut in_z) = (none, none, none);
    for step in steps {
        match *step {
            Step::Constant(c) => in_z = in_z.plus(Interval(coefficient(c), coefficient(c))),
            Step::TimesZ => in_z = in_z.times(z),
            Step::TimesY => in_y = in_y.times(y),
            Step::TimesX => in_x = in_x.times(x),
            Step::ToY => (in_y, in_z) = (in_y.plus(in_z), none),
            Step::ToX => (in_x, in_y) = (in_x.plus(in_y), none),
        }
    }
    in_x
}

/// A search for zeros.
struct Search<'a> {
    steps: &'a [Step],
    /// What a sum may be off by.
    slack: f64,
    /// Around what was found.
    found: Aabb,
    /// Sums that may still be taken.
    left: usize,
}

impl Search<'_> {
    /// Looks through a box; false if that takes too long.
    fn look(&mut self, part: Aabb, halvings: u32) -> bool {
        if part.min.cmpge(self.found.min).all() && part.max.cmple(self.found.max).all() {
            return true;
        }
        if self.left == 0 {
            return false;
        }
        self.left -= 1;
        let axes = [0, 1, 2].map(|axis| Interval(part.min[axis], part.max[axis]));
        let Interval(low, high) = range(self.steps, axes, |c| c);
        if low > self.slack || high < -self.slack {
            return true;
        }
        if halvings == 0 {
            self.found = self.found.union(part);
            return true;
        }
        let (axis, middle) = (halvings as usize % 3, part.center());
        let (mut lower, mut upper) = (part, part);
        (lower.max[axis], upper.min[axis]) = (middle[axis], middle[axis]);
        self.look(lower, halvings - 1) && self.look(upper, halvings - 1)
    }
}

/// A box around all zeros that a polynomial has `within` a box, if none is on the sides of that, and it does not take too long to find.
pub(super) fn zeros(steps: &[Step], within: Aabb) -> Option<Aabb> {
    let far = within.min.abs().max(within.max.abs());
    let sums = range(steps, [0, 1, 2].map(|axis| Interval(far[axis], far[axis])), f64::abs);
    let left = MOST_STEPS / steps.len().max(1);
    let mut search = Search { steps, slack: sums.1 * ROUNDINGS, found: Aabb::EMPTY, left };
    if !search.look(within, HALVINGS) {
        return None;
    }
    let found = search.found;
    for axis in 0..3 {
        let (mut low, mut high) = (within, within);
        (low.max[axis], high.min[axis]) = (within.min[axis], within.max[axis]);
        let reached = [found.min[axis] <= within.min[axis], found.max[axis] >= within.max[axis]];
        for (side, _) in [low, high].into_iter().zip(reached).filter(|(_, reached)| *reached) {
            search.found = Aabb::EMPTY;
            if !search.look(side, HALVINGS) || search.found != Aabb::EMPTY {
                return None;
            }
        }
    }
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::super::univariate::steps;
    use super::*;
    use crate::scene::Polynomial;
    use glam::DVec3;

    /// `x^4 - x^3 + y^2 + z^2`, from 0 to 1 along x and up to `sqrt(27) / 16` from that axis.
    fn piriform() -> Vec<Step> {
        let mut coefficients = vec![0.0; Polynomial::terms(4)];
        for (exponents, c) in [([4, 0, 0], 1.0), ([3, 0, 0], -1.0), ([0, 2, 0], 1.0), ([0, 0, 2], 1.0)] {
            coefficients[Polynomial::place(4, exponents)] = c;
        }
        steps(&Polynomial::new(4, coefficients).expect("a polynomial"))
    }

    #[test]
    fn a_closed_surface_is_found() {
        let corner = DVec3::new(1.05, 1.7, 1.5);
        let Aabb { min, max } = zeros(&piriform(), Aabb { min: -corner, max: corner }).expect("a box");
        let radius = 27f64.sqrt() / 16.0;
        assert!(min.cmple(DVec3::new(0.0, -radius, -radius)).all(), "{min}");
        assert!(max.cmpge(DVec3::new(1.0, radius, radius)).all(), "{max}");
        let room = DVec3::splat(0.3);
        assert!((max - min).cmple(DVec3::new(1.0, 2.0 * radius, 2.0 * radius) + room).all(), "{min} {max}");
    }

    #[test]
    fn what_goes_on_beyond_the_box_is_left() {
        let corner = DVec3::splat(0.9);
        assert!(zeros(&piriform(), Aabb { min: -corner, max: corner }).is_none());
    }
}
