//! POV-Ray's noise: random but smooth functions of space, the stuff of bozo, granite, turbulence and `f_noise3d`.
//!
//! A lattice of unit cubes; each corner gives a random linear function of the point's place relative to it, and these are blended
//! by a smooth weight (Perlin 1985). The corners' numbers come from a table of constants, recovered by measuring
//! `f_noise3d` and `turbulence`; the permutation that spreads them is computed.

use super::number::Number;
use std::ops::{Add, Mul, Neg, Sub};
use std::sync::LazyLock;

/// The random linear functions: four neighbours of this table are a constant and three slopes.
#[rustfmt::skip]
static NOISE_TABLE: [f64; 267] = [
    -1.0, 0.604974, -0.937102, 0.414115, 0.576226, -0.0161593, 0.432334, 0.103685, 0.590539, 0.0286412,
    0.46981, -0.84622, -0.0734112, -0.304097, -0.40206, -0.210132, -0.919127, 0.652033, -0.83151, -0.183948,
    -0.671107, 0.852476, 0.043595, -0.404532, 0.75494, -0.335653, 0.618433, 0.605707, 0.708583, -0.477195,
    0.899474, 0.490623, 0.221729, -0.400381, -0.853727, -0.932586, 0.659113, 0.961303, 0.325948, -0.750851,
    0.842466, 0.734401, -0.649866, 0.394491, -0.466056, -0.434073, 0.109026, 0.0847028, -0.738857, 0.241505,
    0.16228, -0.71426, -0.883665, -0.150408, -0.90396, -0.686549, -0.785214, 0.488548, 0.0246433, 0.142473,
    -0.602136, 0.375845, -0.0077974, 0.498955, -0.268147, 0.856382, -0.386007, -0.596094, -0.867735,
    -0.570977, -0.914366, 0.28896, 0.672206, -0.233783, 0.94815, 0.895262, 0.343252, -0.173388, -0.767971,
    -0.314748, 0.824308, -0.342092, 0.721431, -0.24004, -0.63653, 0.553277, 0.376272, 0.158984, -0.452659,
    0.396323, -0.420676, -0.454154, 0.122179, 0.295857, 0.0664225, -0.202075, -0.724788, 0.453513, 0.224567,
    -0.908812, 0.176349, -0.320516, -0.697139, 0.742702, -0.900786, 0.471489, -0.133532, 0.119127, -0.889769,
    -0.23183, -0.669673, -0.046891, -0.803433, -0.966735, 0.475578, -0.652644, 0.0112459, -0.730007, 0.128283,
    0.145647, -0.619318, 0.272023, 0.392966, 0.646418, -0.0207675, -0.315908, 0.480797, 0.535668, -0.250172,
    -0.83093, -0.653773, -0.443809, 0.119982, -0.897642, 0.89453, 0.165789, 0.633875, -0.886839, 0.930877,
    -0.537194, 0.587732, 0.722011, -0.209461, -0.0424659, -0.814267, -0.919432, 0.280262, -0.66302, -0.558099,
    -0.537469, -0.598779, 0.929656, -0.170794, -0.537163, 0.312581, 0.959442, 0.722652, 0.499931, 0.175616,
    -0.534874, -0.685115, 0.444999, 0.17171, 0.108202, -0.768704, -0.463828, 0.254231, 0.546014, 0.869474,
    0.875212, -0.944427, 0.130724, -0.110185, 0.312184, -0.33138, -0.629206, 0.0606546, 0.722866, -0.0979477,
    0.821561, 0.0931258, -0.972808, 0.0318151, -0.867033, -0.387228, 0.280995, -0.218189, -0.539178,
    -0.427359, -0.602075, 0.311971, 0.277974, 0.773159, 0.592493, -0.0331884, -0.630854, -0.269947, 0.339132,
    0.581079, 0.209461, -0.317433, -0.284993, 0.181323, 0.341634, 0.804959, -0.229572, -0.758907, -0.336721,
    0.605463, -0.991272, -0.0188754, -0.300191, 0.368307, -0.176135, -0.3832, -0.749569, 0.62356, -0.573938,
    0.278309, -0.971313, 0.839994, -0.830686, 0.439078, 0.66128, 0.694514, 0.0565042, 0.54342, -0.438804,
    -0.0228428, -0.687068, 0.857267, 0.301991, -0.494255, -0.941039, 0.775509, 0.410575, -0.362081, -0.671534,
    -0.348379, 0.932433, 0.886442, 0.868681, -0.225666, -0.062211, -0.0976425, -0.641444, -0.848112, 0.724697,
    0.473503, 0.998749, 0.174701, 0.559625, -0.029099, -0.337392, -0.958129, -0.659785, 0.236042, -0.246937,
    0.659449, -0.0275121, 0.821897, -0.2262149, 0.0181737, 0.5004811, -0.420127, -0.427878, 0.566186,
];

/// Cells of the lattice along an axis, after which it repeats.
const PERIOD: usize = 4096;

/// As many entries as there are numbers of 16 bits, so that none is without one: no index is to be checked. Only the first 8192
/// are ever asked for, and the second half of these hardly ever.
const ENTRIES: usize = 1 << 16;

/// The permutation that spreads the corners' numbers: a shuffled `0..PERIOD`, again and again.
#[derive(Debug)]
pub struct Lattice {
    hash: Box<[u16; ENTRIES]>,
    /// The lowest eight bits of it: where a corner's functions begin in [`NOISE_TABLE`].
    first: Box<[u8; ENTRIES]>,
}

/// The one there is.
pub static LATTICE: LazyLock<Lattice> = LazyLock::new(|| {
    let mut period: [_; PERIOD] = std::array::from_fn(|i| i as u16);
    let mut state = 0u32;
    for i in (0..PERIOD).rev() {
        state = state.wrapping_mul(1_812_433_253).wrapping_add(12_345);
        period.swap(i, usize::from((state >> 16) as u16 & 0x7fff) % PERIOD);
    }
    let mut lattice = Lattice { hash: Box::new([0; ENTRIES]), first: Box::new([0; ENTRIES]) };
    for (i, number) in period.into_iter().cycle().take(ENTRIES).enumerate() {
        (lattice.hash[i], lattice.first[i]) = (number, number as u8);
    }
    lattice
});

/// Coordinates are shifted by this before they become indices of the lattice.
const LATTICE_SHIFT: f64 = 10_000.0;
/// Added to a whole number below 2^51, it leaves that in the last bits of the sum (and is none of it in the lowest 51).
const IN_LAST_BITS: f64 = (3u64 << 51) as f64;
/// Negative coordinates within this of an integer count as that integer.
const LATTICE_EDGE: f64 = 1.0 - 1e-10;
/// Cells from here on have no noise: their numbers would overflow, and coordinates have no fraction left anyway.
pub const LATTICE_END: f64 = 1e15;

/// A cell's coordinate along an axis so that [`index`] finds it.
#[inline(always)]
pub fn shifted<T: Number>(cell: T) -> T {
    cell + (LATTICE_SHIFT + IN_LAST_BITS)
}

/// The index of a cell's [`shifted`] coordinate, `0..PERIOD`.
#[inline(always)]
pub fn index(shifted: f64) -> u32 {
    shifted.to_bits() as u32 % PERIOD as u32
}

impl Lattice {
    /// Where in the table the functions of a cell's corners begin ([`function`]), given the cell's [`index`] by axis: eight numbers below
    /// 256, of which that of the corner that is far along an axis has its bit (1 for x, 2 for y, 4 for z) in its place. (Of a cell beyond
    /// [`LATTICE_END`] anything. One by one, as eight bytes would be packed and taken apart again.)
    #[inline(always)]
    pub fn corners(&self, [x, y, z]: [u32; 3]) -> impl Iterator<Item = usize> {
        // The cell's four edges along z.
        let along_x = [self.hash(x), self.hash(x + 1)];
        let edges: [u32; 4] = std::array::from_fn(|k| self.hash(along_x[k & 1] ^ (y + (k as u32 >> 1))));
        (0..8).map(move |corner| {
            let number = edges[corner & 3] ^ (z + (corner as u32 >> 2));
            usize::from(self.first[usize::from(number as u16)])
        })
    }

    /// The same of a cell by its coordinates.
    #[inline(always)]
    pub fn corners_of(&self, cell: [f64; 3]) -> impl Iterator<Item = usize> {
        self.corners(cell.map(|c| index(shifted(c))))
    }

    /// (In 32 bits: what is read from the table needs no widening before it is the next index.)
    #[inline(always)]
    fn hash(&self, number: u32) -> u32 {
        u32::from(self.hash[usize::from(number as u16)])
    }
}

/// Range correction of noise generator 2, the default: `(noise + offset) * scale` lies in 0..1.
const RANGE_OFFSET: f64 = 1.05242;
/// See [`RANGE_OFFSET`].
const RANGE_SCALE: f64 = 0.48985582;

/// How turbulence is summed up: `octaves` of noise, each `lambda` times as fine and `omega` times as strong as the one before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Octaves {
    /// At least 1.
    pub count: u32,
    /// Strength ratio.
    pub omega: f64,
    /// Fineness ratio: see [`Octaves::kept`].
    pub lambda: f64,
}

impl Octaves {
    /// A `lambda` as POV-Ray keeps it, in single precision (measured by `vturbulence`; `omega` is kept whole): its ninth power tells.
    pub fn kept(lambda: f64) -> f64 {
        f64::from(lambda as f32)
    }
}

impl Default for Octaves {
    fn default() -> Self {
        Self { count: 6, omega: 0.5, lambda: 2.0 }
    }
}

/// Which noise is made of the lattice (manual section 3.2.5.6 noise_generator; Perlin's own, the third, is not modelled).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Generator {
    /// 1, that of POV-Ray before 3.5: about a half, cut off at 0 and 1.
    Original,
    /// 2, corrected to fill 0 to 1.
    #[default]
    Corrected,
}

impl Generator {
    /// The one that scenes call by this number; `None` for those that are not modelled.
    pub fn numbered(number: u8) -> Option<Self> {
        match number {
            1 => Some(Self::Original),
            2 => Some(Self::Corrected),
            _ => None,
        }
    }

    /// Its number.
    pub fn number(self) -> u8 {
        match self {
            Self::Original => 1,
            Self::Corrected => 2,
        }
    }

    /// Noise in 0..1.
    pub fn noise<T: Number>(self, p: [T; 3]) -> T {
        match self {
            Self::Original => original_noise(p),
            Self::Corrected => noise(p),
        }
    }

    /// What is summed up for turbulence and wrinkles: with either generator about as much.
    pub fn octave<T: Number>(self, p: [T; 3]) -> T {
        match self {
            Self::Original => original_noise(p),
            Self::Corrected => noise(p) * 2.0 - 0.5,
        }
    }

    /// What granite is grained by: 0 where noise is in its middle.
    pub fn grain<T: Number>(self, p: [T; 3]) -> T {
        match self {
            Self::Original => T::lit(0.5) - original_noise(p),
            Self::Corrected => T::lit(1.0) - noise(p) * 2.0,
        }
    }
}

/// Noise in 0..1 (generator 2). NaN where a coordinate is not finite or beyond 10^15.
pub fn noise<T: Number>(p: [T; 3]) -> T {
    let [sum] = T::lattice(p);
    ((sum + RANGE_OFFSET) * RANGE_SCALE).unit()
}

/// Noise of generator 1, that of POV-Ray before 3.5.
fn original_noise<T: Number>(p: [T; 3]) -> T {
    let [sum] = T::lattice(p);
    (sum + 0.5).unit()
}

/// Noises of falling size added up, about 0..1.
pub fn turbulence<T: Number>(p: [T; 3], octaves: &Octaves, generator: Generator) -> T {
    let mut sum = generator.octave(p).unit();
    let (mut strength, mut fineness) = (octaves.omega, octaves.lambda);
    for _ in 1..octaves.count {
        sum = sum + generator.octave(p.map(|v| v * fineness)) * strength;
        strength *= octaves.omega;
        fineness *= octaves.lambda;
    }
    sum
}

/// The same of [`Number::lattice`], by axis, for as many axes as are wanted: `vturbulence`, and what `turbulence` moves a pattern's
/// point by.
pub fn turbulence_vector<T: Number, const N: usize>(p: [T; 3], octaves: &Octaves) -> [T; N] {
    let mut sum = T::lattice(p);
    let (mut strength, mut fineness) = (octaves.omega, octaves.lambda);
    for _ in 1..octaves.count {
        let more: [T; N] = T::lattice(p.map(|v| v * fineness));
        sum = std::array::from_fn(|axis| sum[axis] + more[axis] * strength);
        strength *= octaves.omega;
        fineness *= octaves.lambda;
    }
    sum
}

/// The cell about a point, by its corner nearest to the origin (on the negative side farthest).
#[inline(always)]
pub fn cell_of<T: Number>(p: [T; 3]) -> [T; 3] {
    let zero = T::lit(0.0);
    p.map(|v| (v - v.if_less(zero, T::lit(LATTICE_EDGE), zero)).whole())
}

/// By axis, 1 if a corner of a cell, numbered as [`Lattice::corners`] does, is the far one, 0 if it is the near one.
#[inline(always)]
pub fn far_of(corner: usize) -> [f64; 3] {
    std::array::from_fn(|axis| f64::from((corner >> axis & 1) as u8))
}

/// Constant and slopes of the random linear function that begins at a number: one of [`Lattice::corners`], or 4 or 8 above.
#[inline(always)]
pub fn function(first: usize) -> &'static [f64; 4] {
    NOISE_TABLE[first..].first_chunk().expect("the table goes on for twelve numbers")
}

/// The same, of a table in which none lies across two lines of the cache. (It takes a shift more to find one.)
#[inline(always)]
pub fn aligned_function(first: usize) -> &'static [f64; 4] {
    &ALIGNED.0[first]
}

#[repr(align(64))]
struct Aligned([[f64; 4]; NOISE_TABLE.len() - 3]);

static ALIGNED: Aligned = {
    let mut functions = [[0.0; 4]; NOISE_TABLE.len() - 3];
    let mut k = 0;
    while k < 4 * functions.len() {
        functions[k / 4][k % 4] = NOISE_TABLE[k / 4 + k % 4];
        k += 1;
    }
    Aligned(functions)
};

/// A point in its cell.
#[derive(Debug, Clone, Copy)]
pub struct Within<T> {
    /// By axis, where it is from the near and from the far corner.
    from: [[T; 2]; 3],
    /// By axis, the weights of the near and of the far corner.
    weights: [[T; 2]; 3],
}

impl<T> Within<T>
where
    T: Copy + Neg<Output = T> + Add<f64, Output = T> + Sub<f64, Output = T>,
    T: Mul<Output = T> + Mul<f64, Output = T>,
{
    /// Of a point that is so far from the near corner.
    #[inline(always)]
    pub fn new(at: [T; 3]) -> Self {
        let weights = at.map(|at| {
            let far = at * at * (-(at * 2.0) + 3.0);
            [-far + 1.0, far]
        });
        Self { from: at.map(|at| [at, at - 1.0]), weights }
    }

    /// The weight of a corner.
    #[inline(always)]
    pub fn weight(&self, corner: usize) -> T {
        let [x, y, z] = of_corner(&self.weights, corner);
        x * y * z
    }

    /// What a corner's [`function`] is to be multiplied by, number by number.
    #[inline(always)]
    pub fn factors(&self, corner: usize) -> [T; 4] {
        let ([x, y, z], weight) = (of_corner(&self.from, corner), self.weight(corner));
        [weight * 0.5, x * weight, y * weight, z * weight]
    }
}

/// Of what is said of the near and the far sides of a cell, by axis, what holds of a corner.
#[inline(always)]
fn of_corner<V: Copy>(sides: &[[V; 2]; 3], corner: usize) -> [V; 3] {
    std::array::from_fn(|axis| sides[axis][corner >> axis & 1])
}

/// The sum of what a function's four numbers come to.
#[inline(always)]
pub fn added_up<T: Add<Output = T>>([constant, x, y, z]: [T; 4]) -> T {
    (constant + x) + (y + z)
}

/// `a * b + c`, rounded as lanes round it: once where the machine can, else twice.
#[inline(always)]
fn fused(a: f64, b: f64, c: f64) -> f64 {
    if cfg!(any(target_feature = "fma", target_arch = "aarch64")) { a.mul_add(b, c) } else { a * b + c }
}

/// `N` sums over the eight corners of the cell about `p`, each of the next of their functions. NaN where there is no noise.
///
/// This order of operations is the law for all kinds of numbers: they come to the same bits. The functions' numbers are summed up
/// apart from each other, so that the four of a function can be one vector.
pub fn sums_at<const N: usize>(p: [f64; 3]) -> [f64; N] {
    let cell = cell_of(p);
    if !cell.iter().all(|c| c.abs() < LATTICE_END) {
        return [f64::NAN; N];
    }
    let within = Within::new(std::array::from_fn(|axis| p[axis] - cell[axis]));
    let mut sums = [[0.0; 4]; N];
    for (corner, first) in LATTICE.corners_of(cell).enumerate() {
        let factors = within.factors(corner);
        for (n, sums) in sums.iter_mut().enumerate() {
            let numbers = function(first + 4 * n);
            *sums = std::array::from_fn(|k| fused(factors[k], numbers[k], sums[k]));
        }
    }
    sums.map(added_up)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// What `vturbulence` gives in POV-Ray 3.7; it prints twelve digits, the table has seven.
    #[test]
    fn turbulence_is_pov_ray_s() {
        let octaves = Octaves { count: 6, omega: 0.5, lambda: 2.0 };
        let found = DVec3::from(turbulence_vector([1.1, 2.2, 3.3], &octaves));
        let expected = DVec3::new(-0.492049152430, -0.251253908050, 0.422430532175);
        assert!((found - expected).abs().max_element() < 1e-6, "{found}");
        let octaves = Octaves { count: 3, omega: 0.4, lambda: 3.0 };
        let found = DVec3::from(turbulence_vector([-1.1, 2.2, 3.3], &octaves));
        let expected = DVec3::new(-0.283286205252, 0.015001616261, -0.111097817795);
        assert!((found - expected).abs().max_element() < 1e-6, "{found}");
    }

    #[test]
    fn the_finest_octave_is_where_pov_ray_has_it() {
        let octaves = Octaves { count: 10, omega: 0.7, lambda: Octaves::kept(2.2) };
        let found = DVec3::from(turbulence_vector([11.1, 22.2, 33.3], &octaves));
        let expected = DVec3::new(-0.192874536454, -0.344525379622, 0.020094288851);
        // (With 2.2 itself it would be 7e-5 off.)
        assert!((found - expected).abs().max_element() < 1e-6, "{found}");
    }

    #[test]
    fn noise_of_nonsense_is_no_number() {
        assert!(noise([f64::NAN; 3]).is_nan() && noise([1e300; 3]).is_nan());
    }
}
