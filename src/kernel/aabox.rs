//! Boxes whose edges are parallel to the world's axes.

use super::slab::Slabs;
use super::{Aabb, Block, Left, Rays, Solid, Surfaces, gather_vectors, next_to, permuted};
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3};
use glam::DVec3;

/// `n` axis-parallel boxes: columns `min` and `max` (3 each), in scene units. Parts 0 to 5 are the faces -x, +x, -y,
/// +y, -z, +z.
#[derive(Debug, Clone, Default)]
pub struct Boxes<S> {
    min: [Vec<S>; 3],
    max: [Vec<S>; 3],
}

impl<S: Scalar> Boxes<S> {
    /// Adds a row, rounded to the columns' precision; needs `min <= max`, and equal coordinates make a flat box.
    pub fn push(&mut self, min: DVec3, max: DVec3) {
        for k in 0..3 {
            self.min[k].push(S::from_f64(min[k]));
            self.max[k].push(S::from_f64(max[k]));
        }
    }

    #[inline(always)]
    fn at(&self, i: usize) -> Slabs<S::Lane> {
        let splat = |c: &[Vec<S>; 3]| {
            Vec3::new(S::Lane::splat(c[0][i]), S::Lane::splat(c[1][i]), S::Lane::splat(c[2][i]))
        };
        Slabs { min: splat(&self.min), max: splat(&self.max) }
    }
}

impl<S: Scalar> Block<S> for Boxes<S> {
    const SHORT: bool = true;
    type Roots = [S::Lane; 2];

    fn len(&self) -> usize {
        self.min[0].len()
    }

    #[inline(always)]
    fn roots(&self, i: usize, rays: &Rays<S::Lane>, left: Option<&Left<S::Lane>>) -> [S::Lane; 2] {
        match left {
            None => self.at(i).crossings(rays),
            // Faces and normals are exact here, so no direction is doubtful.
            Some(left) => self.at(i).crossings_left(rays, left, Vec3::default()),
        }
    }

    /// Lanes that start on the face of the first of them, and go outward from it.
    #[inline(always)]
    fn left_behind(&self, _i: usize, rays: &Rays<S::Lane>, left: &Left<S::Lane>) -> u8 {
        let part = left.part[left.on.bits().trailing_zeros() as usize & (LANES - 1)];
        let dir = *[&rays.dir.x, &rays.dir.y, &rays.dir.z][usize::from(part >> 1) % 3];
        let zero = S::Lane::zero();
        let outward = if part & 1 == 1 { dir.gt(zero) } else { dir.lt(zero) };
        (left.on_part(part) & outward).bits()
    }

    fn resolve(
        &self,
        index: &[u32; LANES],
        _active: Mask<S::Lane>,
        rays: &Rays<S::Lane>,
        t: S::Lane,
    ) -> Surfaces<S::Lane> {
        self.resolve_next_to(index, Mask::none_set(), rays, t, |t| t).1
    }

    #[inline(always)]
    fn resolve_next_to(
        &self,
        index: &[u32; LANES],
        loose: Mask<S::Lane>,
        rays: &Rays<S::Lane>,
        t: S::Lane,
        kept: impl Fn(S::Lane) -> S::Lane,
    ) -> (S::Lane, Surfaces<S::Lane>) {
        let slabs = Slabs { min: gather_vectors(&self.min, index), max: gather_vectors(&self.max, index) };
        let t = loose.select(kept(next_to(&slabs.crossings(rays), t)), t);
        let (point, normal, part) = slabs.face(rays, t);
        (t, Surfaces { point, normal, part, ..Default::default() })
    }

    fn solid(&self, i: usize) -> Option<Solid> {
        let Aabb { min, max } = self.bounds(i);
        Some(Solid::Box { min, max })
    }

    /// Exact: the columns themselves.
    fn bounds(&self, i: usize) -> Aabb {
        let at = |c: &[Vec<S>; 3]| DVec3::from_array(std::array::from_fn(|k| c[k][i].to_f64()));
        Aabb { min: at(&self.min), max: at(&self.max) }
    }

    fn permute(&mut self, order: &[u32]) {
        for column in self.min.iter_mut().chain(&mut self.max) {
            *column = permuted(column, order);
        }
    }
}
