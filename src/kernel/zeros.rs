//! A box around all zeros of a polynomial in x, y and z, where it can be proven that they have an end.
//!
//! A scene need not say how far a polynomial surface reaches, and where it does the box it gives is mostly far too large: of a
//! piriform in the middle of a box from -1.05 to 1.05 the surface takes a twentieth. Each ray that meets that box has the
//! polynomial summed up along it, to find no root.

use super::Aabb;
use super::univariate::{Step, Sum, sum_up};
use crate::lane::{LANES, Lane, Vec3, bits, f64x8};
use crate::scene::Polynomial;
use glam::DVec3;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Boxes are made no closer than to so many parts of what was known before,
const PARTS: f64 = 64.0;

/// by looking into so many boxes for each side, at most,
const MOST_BOXES: usize = 512;

/// and into fewer where there are more steps than these to be summed up in each: some milliseconds in all.
const MOST_STEPS: usize = 1 << 14;

/// Sums of intervals may be off by this share of the sum of their terms' magnitudes: thousands of roundings.
const SUM_ROOM: f64 = 1e-12;

/// What is added to a box on each side, as a share of its reach.
const ROOM: f64 = 1.0 / (1u64 << 20) as f64;

/// Sizes between which a first box is looked for.
const SIZES: [f64; 2] = [1e-30, 1e30];

/// Around all that is inside the surface, or on it; infinite where that is not known. `steps` are how the polynomial is summed up.
pub(super) fn around_zeros(polynomial: &Polynomial, steps: &[Step]) -> Aabb {
    let Some(half) = dominated(polynomial) else { return Aabb::INFINITE };
    let mut around = Aabb { min: -half, max: half };
    // Where numbers overflow nothing is proven.
    if !Range::of(steps, &[around; LANES]).size.to_array()[0].is_finite() {
        return Aabb::INFINITE;
    }
    let boxes = MOST_BOXES.min(MOST_STEPS / steps.len().max(1));
    for axis in 0..3 {
        // Where nothing is to be seen a box would have no place.
        let Some(highest) = farthest(steps, &around, boxes, |within| within.max[axis]) else {
            return Aabb::INFINITE;
        };
        around.max[axis] = highest;
        let Some(lowest) = farthest(steps, &around, boxes, |within| -within.min[axis]) else {
            return Aabb::INFINITE;
        };
        around.min[axis] = -lowest;
    }
    around.inflated(ROOM)
}

/// How far from the origin, along each axis, a polynomial may be 0 or below, if its highest powers of x, y and z alone are even, with
/// positive coefficients, and so strong that all else is small beside them, far out.
///
/// With `u = A x^a + B y^b + C z^c` no term `x^i y^j z^k` is larger than `u^s / (A^(i/a) B^(j/b) C^(k/c))`, where
/// `s = i/a + j/b + k/c`: if all `s` are below 1, and the coefficients of those with 1 are small enough, the sum is positive
/// from some `u` on. Terms that are nowhere negative can be left out.
fn dominated(polynomial: &Polynomial) -> Option<DVec3> {
    let terms: Vec<([usize; 3], f64)> = Polynomial::exponents(polynomial.order())
        .zip(polynomial.coefficients().iter().copied())
        .filter(|(_, c)| *c != 0.0)
        .collect();
    let mut lead = [(0, 0.0); 3];
    for (axis, lead) in lead.iter_mut().enumerate() {
        let pure = |powers: &[usize; 3]| powers.iter().sum::<usize>() == powers[axis];
        *lead = terms
            .iter()
            .filter(|(powers, _)| pure(powers))
            .map(|(powers, c)| (powers[axis], *c))
            .max_by_key(|l| l.0)?;
        if lead.0 == 0 || lead.0 % 2 != 0 || lead.1 <= 0.0 {
            return None;
        }
    }
    // In whole numbers, as it matters whether `s` is 1.
    let whole: usize = lead.iter().map(|l| l.0).product();
    let (mut level, mut lower) = (0.0, Vec::new());
    for (powers, c) in terms {
        if c > 0.0 && powers.iter().all(|power| power % 2 == 0) {
            continue;
        }
        let share: usize = powers.iter().zip(lead).map(|(power, l)| power * (whole / l.0)).sum();
        let strength = powers.iter().zip(lead).fold(c.abs(), |strength, (&power, (highest, a))| {
            strength * a.powf(-(power as f64) / highest as f64)
        });
        match share.cmp(&whole) {
            Ordering::Less => lower.push((strength, share as f64 / whole as f64)),
            Ordering::Equal => level += strength,
            Ordering::Greater => return None,
        }
    }
    // What all else is, as a share of `u`: the larger that is, the less.
    let rest = |u: f64| level + lower.iter().map(|(strength, s)| strength * u.powf(s - 1.0)).sum::<f64>();
    let [mut low, mut high] = SIZES;
    let small = 1.0 - SUM_ROOM;
    if !(rest(high) < small && rest(low) >= small) {
        return None;
    }
    while high > low * (1.0 + ROOM) {
        let middle = (low * high).sqrt();
        *if rest(middle) < small { &mut high } else { &mut low } = middle;
    }
    let half = lead.map(|(highest, a)| (high / a).powf(1.0 / highest as f64));
    Some(DVec3::from(half) * (1.0 + ROOM)).filter(|half| half.is_finite())
}

/// What a polynomial may be in eight boxes.
#[derive(Debug, Clone, Copy, Default)]
struct Range {
    low: f64x8,
    high: f64x8,
    /// The sum of its terms' magnitudes.
    size: f64x8,
}

impl Sum for Range {
    /// The two ends that it lies between.
    type Unknown = [f64x8; 2];

    fn add(&mut self, c: f64) {
        let (c, magnitude) = (f64x8::splat(c), f64x8::splat(c.abs()));
        (self.low, self.high, self.size) = (self.low + c, self.high + c, self.size + magnitude);
    }

    fn times(&mut self, [from, to]: Self::Unknown) {
        let ends = [self.low * from, self.low * to, self.high * from, self.high * to];
        self.low = Lane::min(Lane::min(ends[0], ends[1]), Lane::min(ends[2], ends[3]));
        self.high = Lane::max(Lane::max(ends[0], ends[1]), Lane::max(ends[2], ends[3]));
        self.size *= Lane::max(Lane::abs(from), Lane::abs(to));
    }

    fn take(&mut self, other: &mut Self) {
        let Self { low, high, size } = std::mem::take(other);
        (self.low, self.high, self.size) = (self.low + low, self.high + high, self.size + size);
    }
}

impl Range {
    /// Of the polynomial that `steps` sum up.
    fn of(steps: &[Step], boxes: &[Aabb; LANES]) -> Self {
        let [low, high] = [Vec3::from_fn(|k| boxes[k].min), Vec3::from_fn(|k| boxes[k].max)];
        let unknowns = [[low.x, high.x], [low.y, high.y], [low.z, high.z]];
        let mut range = Self::default();
        sum_up(steps, unknowns, &mut range, [Self::default(); 2], |c| c);
        range
    }

    /// Boxes in which the polynomial is surely above or below 0 all over.
    fn is_not_zero(&self) -> u8 {
        let room = self.size * f64x8::lit(SUM_ROOM);
        (self.low.gt(room) | self.high.lt(-room)).bits()
    }
}

/// A box in which there may be zeros, by how far it reaches.
#[derive(Debug)]
struct Waiting {
    reach: f64,
    within: Aabb,
}

impl Ord for Waiting {
    fn cmp(&self, other: &Self) -> Ordering {
        self.reach.total_cmp(&other.reach)
    }
}

impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Waiting {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Waiting {}

/// How far zeros in a box may reach, as `reach` tells it of boxes; `None` if there are none. The boxes that reach farthest are cut
/// into eight, and those of these without a zero left out, `most` times or until the farthest is small.
fn farthest(steps: &[Step], around: &Aabb, most: usize, reach: impl Fn(&Aabb) -> f64) -> Option<f64> {
    let enough = (around.max - around.min) * (1.0 / PARTS);
    let waiting = |within: Aabb| Waiting { reach: reach(&within), within };
    let mut boxes = BinaryHeap::from([waiting(*around)]);
    for _ in 0..most {
        let Waiting { reach, within } = boxes.pop()?;
        if (within.max - within.min).cmple(enough).all() {
            return Some(reach);
        }
        let middle = within.center();
        let mut eight = [within; LANES];
        for (part, corner) in eight.iter_mut().zip(within.corners()) {
            *part = Aabb::of([middle, corner]);
        }
        let left = !Range::of(steps, &eight).is_not_zero();
        boxes.extend(bits(left).map(|k| waiting(eight[k & (LANES - 1)])));
    }
    boxes.peek().map(|farthest| farthest.reach)
}

#[cfg(test)]
mod tests {
    use super::super::univariate::steps;
    use super::*;
    use crate::random::Random;

    fn polynomial(order: usize, terms: &[([usize; 3], f64)]) -> Polynomial {
        let mut coefficients = vec![0.0; Polynomial::terms(order)];
        for &(powers, c) in terms {
            coefficients[Polynomial::place(order, powers)] += c;
        }
        Polynomial::new(order, coefficients).expect("as many as there are to be")
    }

    fn around(order: usize, terms: &[([usize; 3], f64)]) -> Aabb {
        let polynomial = polynomial(order, terms);
        around_zeros(&polynomial, &steps(&polynomial))
    }

    /// The box is around this one, and no farther off than a few parts in `PARTS` of `size`.
    fn assert_close(found: Aabb, min: [f64; 3], max: [f64; 3], size: f64) {
        for axis in 0..3 {
            let off = [min[axis] - found.min[axis], found.max[axis] - max[axis]];
            assert!(
                off.iter().all(|off| (0.0..size * 3.0 / PARTS).contains(off)),
                "{axis}: {off:?} of {found:?}"
            );
        }
    }

    #[test]
    fn boxes_are_close_around_surfaces() {
        // x^4 - x^3 + y^2 + z^2: y^2 + z^2 is at most 27/256.
        let piriform = [([4, 0, 0], 1.0), ([3, 0, 0], -1.0), ([0, 2, 0], 1.0), ([0, 0, 2], 1.0)];
        let wide = (27.0f64 / 256.0).sqrt();
        assert_close(around(4, &piriform), [0.0, -wide, -wide], [1.0, wide, wide], 2.0);
        // x^4 - x^2 + y^2 + z^2.
        let gerono = [([4, 0, 0], 1.0), ([2, 0, 0], -1.0), ([0, 2, 0], 1.0), ([0, 0, 2], 1.0)];
        assert_close(around(4, &gerono), [-1.0, -0.5, -0.5], [1.0, 0.5, 0.5], 2.0);
        // A torus about y of radii 2 and 1/2: (x^2 + y^2 + z^2 + 15/4)^2 = 16 (x^2 + z^2).
        let mut torus = vec![([0, 0, 0], 225.0 / 16.0), ([2, 0, 0], -16.0), ([0, 0, 2], -16.0)];
        for i in 0..3 {
            let square = |k: usize| [0, 1, 2].map(|axis| 2 * usize::from(axis == k));
            torus.push((square(i), 7.5));
            for j in 0..3 {
                torus.push(([0, 1, 2].map(|axis| square(i)[axis] + square(j)[axis]), 1.0));
            }
        }
        assert_close(around(4, &torus), [-2.5, -0.5, -2.5], [2.5, 0.5, 2.5], 10.0);
    }

    #[test]
    fn what_has_no_end_has_no_box() {
        let saddle = [([3, 0, 0], 1.0), ([1, 2, 0], -3.0), ([0, 0, 1], -1.0)];
        let cylinder = [([4, 0, 0], 1.0), ([0, 4, 0], 1.0), ([0, 0, 0], -1.0)];
        // Grows along x = y = z, though its highest powers do not.
        let star =
            [([4, 0, 0], 1.0), ([0, 4, 0], 1.0), ([0, 0, 4], 1.0), ([2, 2, 0], -3.0), ([0, 0, 0], -1.0)];
        // All of space is within but a ball.
        let hollow = [([4, 0, 0], -1.0), ([0, 4, 0], -1.0), ([0, 0, 4], -1.0), ([0, 0, 0], 1.0)];
        // Nothing is.
        let nothing =
            [([4, 0, 0], 1.0), ([0, 4, 0], 1.0), ([0, 0, 4], 1.0), ([0, 0, 0], 1.0), ([1, 1, 1], 1e-3)];
        for terms in [&saddle[..], &cylinder, &star, &hollow, &nothing] {
            assert_eq!(around(4, terms), Aabb::INFINITE, "{terms:?}");
        }
    }

    /// Polynomials of random terms are positive everywhere outside of their boxes, if they have any.
    #[test]
    fn nothing_is_inside_beyond_the_box() {
        let mut numbers = Random::new(3);
        let mut boxes = 0;
        for _ in 0..200 {
            let order = if numbers.between(0.0, 1.0) < 0.5 { 4 } else { 6 };
            let mut terms: Vec<_> = (0..3)
                .map(|axis| {
                    let highest = if numbers.between(0.0, 1.0) < 0.3 { 2 } else { order };
                    ([0, 1, 2].map(|k| if k == axis { highest } else { 0 }), numbers.between(0.2, 2.0))
                })
                .collect();
            for powers in Polynomial::exponents(order) {
                if numbers.between(0.0, 1.0) < 0.2 {
                    terms.push((powers, numbers.between(-0.6, 0.3)));
                }
            }
            let polynomial = polynomial(order, &terms);
            let steps = steps(&polynomial);
            let around = around_zeros(&polynomial, &steps);
            if around == Aabb::INFINITE {
                continue;
            }
            boxes += 1;
            let value = |p: DVec3| Range::of(&steps, &[Aabb { min: p, max: p }; LANES]).low.to_array()[0];
            let size = around.max - around.min;
            for round in 0..2000 {
                let far = [0.6, 1.0, 10.0, 1e3][round % 4];
                let p = around.center() + numbers.vector(1.0) * size * far;
                let inside = p.cmpge(around.min).all() && p.cmple(around.max).all();
                assert!(inside || value(p) > 0.0, "{} at {p} beyond {around:?}", value(p));
            }
        }
        assert!(boxes > 20, "{boxes}");
    }
}
