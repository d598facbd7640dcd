//! Noise at eight points at a time, to the bits that it comes to at each point alone ([`crate::scene::noise::sums_at`]).
//!
//! What takes the time is to look up the functions of eight corners. Eight points in one cell, as neighbours in a picture mostly
//! are where noise is coarse, look them up once, and share each number. Others look them up one by one: the four numbers of a
//! function stand side by side in the table, and those of two points are multiplied and summed up as one vector.

use crate::lane::{LANES, Lane, Mask, QUAD, columns, f64x2, f64x4, f64x8, rows};
use crate::scene::noise::{
    LATTICE, LATTICE_END, Within, added_up, aligned_function, cell_of, far_of, function, index, shifted,
};

/// Pairs of points.
const PAIRS: usize = LANES / 2;

/// As many points as are summed up at once. (AVX2 has no registers for the sums of eight; AVX-512 takes three times as long by halves.)
#[cfg(target_feature = "avx512f")]
type Register = f64x8;
#[cfg(not(target_feature = "avx512f"))]
type Register = f64x4;

/// Registers that hold all points.
const REGISTERS: usize = size_of::<f64x8>() / size_of::<Register>();

/// See [`crate::scene::number::Number::lattice`].
pub fn lattice<const N: usize>(p: [f64x8; 3]) -> [f64x8; N] {
    let cell = cell_of(p);
    let at = std::array::from_fn(|axis| p[axis] - cell[axis]);
    let sums = match shared(&cell) {
        Some(cell) => in_one_cell(at, cell),
        None => apart(at, cell),
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

/// The sums at points so far from the corner of one cell.
#[inline(always)]
fn in_one_cell<const N: usize>(at: [f64x8; 3], cell: [f64; 3]) -> [f64x8; N] {
    let mut functions = [0; 8];
    for (function, first) in functions.iter_mut().zip(LATTICE.corners_of(cell)) {
        *function = first;
    }
    let at: [[Register; REGISTERS]; 3] = at.map(bytemuck::cast);
    let parts: [[Register; N]; REGISTERS] = std::array::from_fn(|part| {
        let within = Within::new(at.map(|at| at[part]));
        let mut sums = [[Register::ZERO; QUAD]; N];
        for (corner, first) in functions.into_iter().enumerate() {
            let factors = within.factors(corner);
            for (n, sums) in sums.iter_mut().enumerate() {
                let numbers = function(first + QUAD * n);
                *sums = std::array::from_fn(|k| factors[k].mul_add(Register::splat(numbers[k]), sums[k]));
            }
        }
        sums.map(added_up)
    });
    std::array::from_fn(|n| bytemuck::cast(parts.map(|sums| sums[n])))
}

/// The sums at points so far from the corners of their cells.
#[inline(always)]
fn apart<const N: usize>(at: [f64x8; 3], cell: [f64x8; 3]) -> [f64x8; N] {
    let (lattice, cell) = (&*LATTICE, cell.map(|c| shifted(c).to_array()));
    let within = Within::new(at);
    // (Laid down once, in a loop.)
    let mut weights = [[f64x2::ZERO; PAIRS]; 8];
    for (corner, weights) in weights.iter_mut().enumerate() {
        *weights = bytemuck::cast(within.weight(corner));
    }
    let [x, y, z] = at;
    let points: [f64x8; PAIRS] = bytemuck::cast(rows([Lane::lit(0.5), x, y, z]));
    let mut sums = [[f64x8::ZERO; PAIRS]; N];
    for (pair, point) in points.into_iter().enumerate() {
        // (By reference: arrays that are mapped by value are copied for each lane.)
        let corners = |k: usize| lattice.corners(cell.each_ref().map(|c| index(c[2 * pair + k])));
        let mut own = [f64x8::ZERO; N];
        for (corner, (first, second)) in corners(0).zip(corners(1)).enumerate() {
            let [far_x, far_y, far_z] = far_of(corner);
            let far = f64x4::from([0.0, far_x, far_y, far_z]);
            let [a, b] = weights[corner][pair].to_array();
            // What [`Within::factors`] says.
            let factors = (point - beside(far, far)) * f64x8::from([a, a, a, a, b, b, b, b]);
            for (n, sum) in own.iter_mut().enumerate() {
                let numbers = beside(numbers::<N>(first + QUAD * n), numbers::<N>(second + QUAD * n));
                *sum = Lane::fused(factors, numbers, *sum);
            }
        }
        for (sums, own) in sums.iter_mut().zip(own) {
            sums[pair] = own;
        }
    }
    sums.map(|rows| added_up(columns(bytemuck::cast(rows))))
}

/// A function's numbers, where one of `N` is asked for at each corner.
#[inline(always)]
fn numbers<const N: usize>(first: usize) -> f64x4 {
    f64x4::from(if N > 1 { *aligned_function(first) } else { *function(first) })
}

/// One row beside another.
#[inline(always)]
fn beside(first: f64x4, second: f64x4) -> f64x8 {
    bytemuck::cast([first, second])
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
            let ([one], two, three) = (lattice(lanes), lattice::<2>(lanes), lattice::<3>(lanes));
            for (k, point) in points.into_iter().enumerate() {
                let of_three: [f64; 3] = sums_at(point);
                // All that is not a number is alike.
                let bits = |v: f64| if v.is_nan() { 0 } else { v.to_bits() };
                let lane = |v: f64x8| bits(v.lanes()[k]);
                let expected = of_three.map(bits);
                assert_eq!([lane(one), bits(sums_at::<1>(point)[0])], [expected[0]; 2], "{point:?}");
                assert_eq!(two.map(lane), expected[..2], "{point:?}");
                assert_eq!(three.map(lane), expected, "{point:?}");
            }
        }
    }
}
