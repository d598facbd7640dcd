//! Noise at eight points at a time, to the bits that it comes to at each point alone ([`crate::scene::noise::sums_at`]).
//!
//! What takes the time is to look up the functions of eight corners. Eight points in one cell, as neighbours in a picture mostly
//! are where noise is coarse, look them up once, and share each number. Others look them up one by one: three functions of a corner stand
//! side by side in a table of their own, so that they are one sum of vectors without anything to be put in order; single ones are
//! turned, four points at a time.

use crate::lane::{LANES, Lane, Mask, columns, each_lane, f64x4, f64x8};
use crate::scene::noise::{LATTICE, LATTICE_END, NOISE_TABLE, Within, cell_of, index, of_corner, shifted};
use std::sync::LazyLock;

/// Numbers of the functions that a corner's may begin at.
const FIRST: usize = 256;

/// The functions that begin at a number. As vectors, since of plain numbers the compiler would make vectors anew, one by one.
struct Functions {
    /// Of a single one half of its constant, and its slopes along x, y and z. (The third of three begins 8 later than the first.)
    single: [f64x4; FIRST + 8],
    /// Of three functions (the fourth lane is idle) halves of the constants,
    constants: [f64x4; FIRST],
    /// and the slopes: neighbours overlap, the one along x of one is that along y of the one before.
    slopes: [f64x4; FIRST + 3],
}

static FUNCTIONS: LazyLock<Box<Functions>> = LazyLock::new(|| {
    let number = |n: usize| NOISE_TABLE.get(n).copied().unwrap_or(0.0);
    let three = |first: usize| [0, 4, 8].map(|n| number(first + n));
    let four = |[a, b, c]: [f64; 3]| f64x4::from([a, b, c, 0.0]);
    Box::new(Functions {
        // (To halve is exact.)
        single: std::array::from_fn(|n| {
            f64x4::from([number(n) * 0.5, number(n + 1), number(n + 2), number(n + 3)])
        }),
        constants: std::array::from_fn(|first| four(three(first).map(|constant| constant * 0.5))),
        slopes: std::array::from_fn(|first| four(three(first))),
    })
});

/// See [`crate::scene::number::Number::lattice`].
pub fn lattice(p: [f64x8; 3]) -> f64x8 {
    let cell = cell_of(p);
    let within = Within::new(p, cell);
    let [sum] = match shared(&cell) {
        Some(cell) => in_one_cell(cell, &within),
        None => [one_apart(cell, &within)],
    };
    there(&cell).select(sum, Lane::lit(f64::NAN))
}

/// See [`crate::scene::number::Number::lattices`].
pub fn lattices(p: [f64x8; 3]) -> [f64x8; 3] {
    let cell = cell_of(p);
    let within = Within::new(p, cell);
    let sums = match shared(&cell) {
        Some(cell) => in_one_cell(cell, &within),
        None => three_apart(cell, &within),
    };
    let there = there(&cell);
    sums.map(|sum| there.select(sum, Lane::lit(f64::NAN)))
}

/// Lanes in which there is noise.
#[inline(always)]
fn there(cell: &[f64x8; 3]) -> Mask<f64x8> {
    let [x, y, z] = cell.map(|c| Lane::abs(c).lt(Lane::lit(LATTICE_END)));
    x & y & z
}

/// The cell, if all points are in one.
#[inline(always)]
fn shared(cell: &[f64x8; 3]) -> Option<[f64; 3]> {
    let first = cell.map(|c| c.lanes()[0]);
    let [x, y, z]: [_; 3] = std::array::from_fn(|axis| cell[axis].equal(Lane::splat(first[axis])));
    (x & y & z).all().then_some(first)
}

#[inline(always)]
fn in_one_cell<const N: usize>(cell: [f64; 3], within: &Within<f64x8>) -> [f64x8; N] {
    let functions = &**FUNCTIONS;
    let mut sums = [f64x8::ZERO; N];
    for (corner, first) in LATTICE.corners_of(cell).into_iter().enumerate() {
        let ([x, y, z], weight) = (within.from_corner(corner), within.weight(corner));
        for (n, sum) in sums.iter_mut().enumerate() {
            let [half, a, b, c] = functions.single[usize::from(first) + 4 * n].to_array();
            *sum += weight * (<f64x8 as Lane>::splat(half) + x * a + y * b + z * c);
        }
    }
    sums
}

/// Where the functions of the corners begin: lane by lane, by corner.
#[inline(always)]
fn corners(cell: [f64x8; 3]) -> [[u8; 8]; LANES] {
    let (lattice, [x, y, z]) = (&*LATTICE, cell.map(|c| shifted(c).to_array()));
    each_lane(|k| lattice.corners([index(x[k]), index(y[k]), index(z[k])]))
}

#[inline(always)]
fn three_apart(cell: [f64x8; 3], within: &Within<f64x8>) -> [f64x8; 3] {
    let (corners, functions) = (corners(cell), &**FUNCTIONS);
    // (Laid down once, in loops: what is handed on by value, or mapped, is copied for each lane.)
    let (mut from, mut weights) = ([[[0.0; LANES]; 2]; 3], [[0.0; LANES]; 8]);
    for (from, sides) in from.iter_mut().flatten().zip(within.from.iter().flatten()) {
        *from = sides.to_array();
    }
    for (corner, weights) in weights.iter_mut().enumerate() {
        *weights = within.weight(corner).to_array();
    }
    let mut rows = [f64x4::ZERO; LANES];
    for (k, sum) in rows.iter_mut().enumerate() {
        let sides = |axis: usize| [0, 1].map(|side| f64x4::splat(from[axis][side][k]));
        let from = [sides(0), sides(1), sides(2)];
        for corner in 0..8 {
            let first = usize::from(corners[k][corner]);
            let [x, y, z] = of_corner(&from, corner);
            let [a, b, c] = [1, 2, 3].map(|n| functions.slopes[first + n]);
            *sum += f64x4::splat(weights[corner][k]) * (functions.constants[first] + a * x + b * y + c * z);
        }
    }
    let [x, y, z, _] = columns(rows);
    [x, y, z]
}

#[inline(always)]
fn one_apart(cell: [f64x8; 3], within: &Within<f64x8>) -> f64x8 {
    let (corners, functions) = (corners(cell), &**FUNCTIONS);
    let function = |k: usize, corner: usize| functions.single[usize::from(corners[k][corner])];
    let mut sum = f64x8::ZERO;
    for corner in 0..8 {
        let [x, y, z] = within.from_corner(corner);
        let [half, a, b, c] = columns(each_lane(|k| function(k, corner)));
        sum += within.weight(corner) * (half + a * x + b * y + c * z);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::scene::noise::sums_at;

    /// Points far apart, in one cell, on the borders of cells, and beyond the lattice.
    #[test]
    fn eight_points_have_the_noise_of_each() {
        let mut numbers = Random::new(5);
        for round in 0..2000 {
            let spread = [1e-3, 0.3, 3.0, 1e4, 1e9][round % 5];
            let middle = numbers.vector(1.0) * [1.0, 1e3, 1e6][round % 3];
            let points: [[f64; 3]; LANES] = std::array::from_fn(|k| {
                let mut point = (middle + numbers.vector(1.0) * spread).to_array();
                if (round + k) % 7 == 0 {
                    point[k % 3] = point[k % 3].round() + [0.0, 1e-12, -1e-12][round % 3];
                }
                if round % 11 == 0 && k % 3 == 1 {
                    point[round % 3] = [f64::NAN, f64::INFINITY, 1e300, -1e15, -1e16][round % 5];
                }
                point
            });
            let lanes: [f64x8; 3] = std::array::from_fn(|axis| f64x8::from_fn(|k| points[k][axis]));
            let (one, three) = (lattice(lanes).to_array(), lattices(lanes).map(Lane::to_array));
            for (k, point) in points.into_iter().enumerate() {
                let bits = f64::to_bits;
                let ([of_one], of_three) = (sums_at(point), sums_at::<3>(point));
                if of_one.is_nan() {
                    assert!(one[k].is_nan() && three.iter().all(|sum| sum[k].is_nan()), "{point:?}");
                    continue;
                }
                assert_eq!(bits(one[k]), bits(of_one), "{point:?}");
                assert_eq!(three.map(|sum| bits(sum[k])), of_three.map(bits), "{point:?}");
            }
        }
    }
}
