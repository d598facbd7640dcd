//! What the kernel tests share: rays by hand, random numbers, lanes as plain numbers.

use glam::{DMat3, DVec3};
use octray::kernel::{Block, Left, Rays, Surfaces};
use octray::lane::{LANES, Lane, Mask, Scalar, Vec3};
use octray::scene::Transform;

/// One ray in all eight lanes; `dir` is taken to length 1 and then to the lanes' precision.
pub fn ray<L: Lane>(origin: [f64; 3], dir: [f64; 3]) -> Rays<L> {
    Rays { origin: Vec3::splat(origin.into()), dir: Vec3::splat(DVec3::from(dir).normalize()) }
}

/// Eight rays from (origin, direction); directions are taken to length 1 in f64 and then rounded.
pub fn packet<L: Lane>(rays: &[(DVec3, DVec3)]) -> Rays<L> {
    let lane = |k: usize| rays[k.min(rays.len() - 1)];
    Rays { origin: Vec3::from_fn(|k| lane(k).0), dir: Vec3::from_fn(|k| lane(k).1.normalize()) }
}

/// All crossings of lane `k` that are numbers.
pub fn lane_roots<L: Lane>(roots: &[L], k: usize) -> Vec<f64> {
    roots.iter().map(|t| t.to_array()[k].to_f64()).filter(|t| !t.is_nan()).collect()
}

/// Lane 0 of all crossings that are numbers.
pub fn crossings<S: Scalar, B: Block<S>>(
    block: &B,
    i: usize,
    rays: &Rays<S::Lane>,
    left: Option<&Left<S::Lane>>,
) -> Vec<f64> {
    lane_roots(block.roots(i, rays, left).as_ref(), 0)
}

/// All lanes start on part `part`.
pub fn left_part<L: Lane>(part: u8) -> Left<L> {
    Left { on: Mask::all_set(), part: [part; LANES] }
}

/// The surface of primitive 0 at `t`.
pub fn surface<S: Scalar, B: Block<S>>(block: &B, rays: &Rays<S::Lane>, t: f64) -> Surfaces<S::Lane> {
    block.resolve(&[0; LANES], Mask::all_set(), rays, S::Lane::lit(t))
}

/// The map as columns of this precision hold it.
pub fn rounded<S: Scalar>(t: &Transform) -> Transform {
    let round = |x: f64| S::from_f64(x).to_f64();
    let mut t = *t;
    for affine in [&mut t.forward, &mut t.inverse] {
        affine.matrix3 = DMat3::from_cols_array(&affine.matrix3.to_cols_array().map(round));
        affine.translation = affine.translation.map(round);
    }
    t
}

/// Random numbers that are the same everywhere (Steele, Lea, Flood, OOPSLA 2014).
pub struct Rng(pub u64);

impl Rng {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// 0 to 1.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn angle(&mut self) -> f64 {
        self.unit() * std::f64::consts::TAU
    }

    /// Each coordinate from -1 to 1.
    pub fn cube(&mut self) -> DVec3 {
        DVec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }

    /// A random unit vector.
    pub fn direction(&mut self) -> DVec3 {
        loop {
            let v = self.cube();
            if (0.01..1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }
}
