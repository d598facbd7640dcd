//! Discs and rings.

use super::frame::Frames;
use super::plane::{finite, half_space_at_start};
use super::{Aabb, Block, Left, Rays, Surfaces, gather, permuted};
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3};
use crate::scene::Transform;
use glam::{DAffine3, DMat3, DVec3};

/// `n` discs, each by a frame in which it is the unit disc across z, and a column `hole`, the share of the radius
/// that is missing in the middle.
///
/// The inside is the whole half space behind the normal, though the surface is a part of its plane: the bounds are
/// the surface's.
#[derive(Debug, Clone, Default)]
pub struct Discs<S> {
    frames: Frames<S>,
    hole: Vec<S>,
}

impl<S: Scalar> Discs<S> {
    /// Adds the image of a disc: `normal` of any length, `radius` over 0, `hole` from 0 to `radius`.
    pub fn push(
        &mut self,
        world_from_object: &Transform,
        center: DVec3,
        normal: DVec3,
        radius: f64,
        hole: f64,
    ) {
        let n = normal.normalize();
        let (u, v) = n.any_orthonormal_pair();
        let turn = DMat3::from_cols(u, v, n);
        let inverse = turn.transpose() * (1.0 / radius);
        let object_from_own = Transform {
            forward: DAffine3 { matrix3: turn * radius, translation: center },
            inverse: DAffine3 { matrix3: inverse, translation: -(inverse * center) },
        };
        self.frames.push(&object_from_own.then(world_from_object));
        self.hole.push(S::from_f64(hole / radius));
    }
}

impl<S: Scalar> Block<S> for Discs<S> {
    const SKIN_IS_PARTIAL: bool = true;
    type Roots = [S::Lane; 1];

    fn len(&self) -> usize {
        self.hole.len()
    }

    #[inline(always)]
    fn roots(&self, i: usize, rays: &Rays<S::Lane>, left: Option<&Left<S::Lane>>) -> [S::Lane; 1] {
        let Rays { origin: o, dir: d } = self.frames.at(i).rays(rays);
        let mut t = finite(-o.z / d.z);
        let (x, y) = (o.x + d.x * t, o.y + d.y * t);
        let square = x * x + y * y;
        let hole = S::Lane::splat(self.hole[i]);
        // Closed on both rims; NaN fails.
        let on = square.le(S::Lane::lit(1.0)) & square.ge(hole * hole);
        t = on.select(t, S::Lane::lit(f64::NAN));
        if let Some(left) = left {
            // As for `boundary`: nothing if the ray runs in the plane.
            let start = finite(-o.z / d.z) * S::Lane::zero();
            t = left.on.select(start, t);
        }
        [t]
    }

    /// The whole plane.
    #[inline(always)]
    fn boundary(&self, i: usize, rays: &Rays<S::Lane>, left: Option<&Left<S::Lane>>) -> [S::Lane; 1] {
        let Rays { origin: o, dir: d } = self.frames.at(i).rays(rays);
        let mut t = finite(-o.z / d.z);
        if let Some(left) = left {
            t = left.on.select(t * S::Lane::zero(), t);
        }
        [t]
    }

    #[inline(always)]
    fn starts_inside(&self, i: usize, rays: &Rays<S::Lane>) -> Mask<S::Lane> {
        let Rays { origin: o, dir: d } = self.frames.at(i).rays(rays);
        half_space_at_start(o.z, d.z)
    }

    fn resolve(
        &self,
        index: &[u32; LANES],
        _active: Mask<S::Lane>,
        rays: &Rays<S::Lane>,
        t: S::Lane,
    ) -> Surfaces<S::Lane> {
        let frame = self.frames.gathered(index);
        let Rays { origin: o, dir: d } = frame.rays(rays);
        let (zero, one) = (S::Lane::zero(), S::Lane::lit(1.0));
        let (x, y) = (o.x + d.x * t, o.y + d.y * t);
        let distance = (x * x + y * y).sqrt();
        let hole = gather(&self.hole, index);
        // Within the ring to the last bit; a hole of 0 keeps the middle where it is.
        let scale = distance.gt(zero).select(distance.max(hole).min(one) / distance, one);
        Surfaces {
            point: self.frames.to_world(index, Vec3::new(x * scale, y * scale, zero)),
            normal: frame.normal(Vec3::new(zero, zero, one)),
            ..Default::default()
        }
    }

    /// Around the surface, not the half space.
    fn bounds(&self, i: usize) -> Aabb {
        self.frames.disc_bounds(i, 0.0, 1.0)
    }

    fn permute(&mut self, order: &[u32]) {
        self.frames.permute(order);
        self.hole = permuted(&self.hole, order);
    }
}
