//! Noise at eight points at a time, to the bits that it comes to at each point alone ([`crate::scene::noise::sums_at`]).
//!
//! What takes the time is to look up the functions of eight corners. Eight points in one cell, as neighbours in a picture mostly
//! are where noise is coarse, look them up once, and share each number. Others look them up one by one: three functions of a corner stand
//! side by side in a table of their own, so that they are one sum of vectors without anything to be put in order; single ones are
//! turned, four points at a time.

use crate::lane::{LANES, Lane, Mask, QUAD, columns, f64x4, f64x8};
use crate::scene::noise::{LATTICE, LATTICE_END, NOISE_TABLE, Within, cell_of, function, of_corner};
use std::sync::LazyLock;

/// Numbers of the functions that a corner's may begin at.
const FIRST: usize = 256;

/// The functions that begin at a number: half of their constants, and their slopes along x, y and z, each of three functions (the
/// fourth lane is idle). Aligned, so that none of them lies across two lines of a cache.
#[repr(align(64))]
struct Threes {
    constants: [[f64; QUAD]; FIRST],
    /// Neighbours overlap: the slope along x of one is that along y of the one before.
    slopes: [[f64; QUAD]; FIRST + 3],
}

static THREES: LazyLock<Threes> = LazyLock::new(|| {
    let three = |first: usize| [0, 4, 8].map(|n| NOISE_TABLE.get(first + n).copied().unwrap_or(0.0));
    let four = |[a, b, c]: [f64; 3]| [a, b, c, 0.0];
    Threes {
        // (To halve is exact.)
        constants: std::array::from_fn(|first| four(three(first).map(|constant| constant * 0.5))),
        slopes: std::array::from_fn(|first| four(three(first))),
    }
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
    let mut sums = [f64x8::ZERO; N];
    for (corner, first) in LATTICE.corners(cell).into_iter().enumerate() {
        let ([x, y, z], weight) = (within.from_corner(corner), within.weight(corner));
        for (n, sum) in sums.iter_mut().enumerate() {
            let [constant, a, b, c] = function(usize::from(first) + 4 * n);
            *sum += weight * (<f64x8 as Lane>::splat(constant * 0.5) + x * a + y * b + z * c);
        }
    }
    sums
}

/// By lane, where the functions of the corners begin.
#[inline(always)]
fn corners(cell: [f64x8; 3]) -> [[u8; 8]; LANES] {
    let cell = cell.map(Lane::to_array);
    let lattice = &*LATTICE;
    let mut corners = [[0; 8]; LANES];
    let (mut last, mut known) = ([f64::NAN; 3], [0; 8]);
    for (k, corners) in corners.iter_mut().enumerate() {
        // Neighbours in a row are mostly neighbours in the picture: some in one cell, the others in the next.
        let here = cell.map(|lanes| lanes[k]);
        if here != last {
            (last, known) = (here, lattice.corners(here));
        }
        *corners = known;
    }
    corners
}

#[inline(always)]
fn three_apart(cell: [f64x8; 3], within: &Within<f64x8>) -> [f64x8; 3] {
    let (corners, threes) = (corners(cell), &*THREES);
    let from = within.from.map(|sides| sides.map(Lane::to_array));
    let weights: [_; 8] = std::array::from_fn(|corner| within.weight(corner).to_array());
    let mut rows = [f64x4::ZERO; LANES];
    for (k, (sum, corners)) in rows.iter_mut().zip(corners).enumerate() {
        let from = from.map(|sides| sides.map(|side| f64x4::splat(side[k])));
        for (corner, first) in corners.into_iter().map(usize::from).enumerate() {
            let [x, y, z] = of_corner(&from, corner);
            let [a, b, c] = [1, 2, 3].map(|n| f64x4::from(threes.slopes[first + n]));
            let constant = f64x4::from(threes.constants[first]);
            *sum += f64x4::splat(weights[corner][k]) * (constant + a * x + b * y + c * z);
        }
    }
    let [x, y, z, _] = columns(rows);
    [x, y, z]
}

#[inline(always)]
fn one_apart(cell: [f64x8; 3], within: &Within<f64x8>) -> f64x8 {
    let corners = corners(cell);
    let mut sum = f64x8::ZERO;
    for corner in 0..8 {
        let [x, y, z] = within.from_corner(corner);
        let rows = corners.map(|corners| f64x4::from(function(usize::from(corners[corner]))));
        let [constant, a, b, c] = columns(rows);
        sum += within.weight(corner) * (constant * 0.5 + a * x + b * y + c * z);
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
