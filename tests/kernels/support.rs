//! What the kernel tests share: rays by hand, random numbers, lanes as plain numbers.

use glam::DVec3;
use octray::kernel::{Block, Left, Rays, Surfaces};
use octray::lane::{LANES, Lane, Mask, Scalar, Vec3};

/// One ray in all eight lanes; `dir` is taken to length 1 and then to the lanes' precision.
pub fn ray<L: Lane>(origin: [f64; 3], dir: [f64; 3]) -> Rays<L> {
    Rays { origin: Vec3::splat(origin.into()), dir: Vec3::splat(DVec3::from(dir).normalize()) }
}

/// Lane 0 of all crossings that are numbers.
pub fn crossings<S: Scalar, B: Block<S>>(
    block: &B,
    i: usize,
    rays: &Rays<S::Lane>,
    left: Option<&Left<S::Lane>>,
) -> Vec<f64> {
    let roots = block.roots(i, rays, left);
    roots.as_ref().iter().map(|t| t.to_array()[0].to_f64()).filter(|t| !t.is_nan()).collect()
}

/// All lanes start on part `part`.
pub fn left_part<L: Lane>(part: u8) -> Left<L> {
    Left { on: Mask::all_set(), part: [part; LANES] }
}

/// The surface of primitive 0 at `t`.
pub fn surface<S: Scalar, B: Block<S>>(block: &B, rays: &Rays<S::Lane>, t: f64) -> Surfaces<S::Lane> {
    block.resolve(&[0; LANES], Mask::all_set(), rays, S::Lane::lit(t))
}
