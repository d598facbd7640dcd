//! Boxes in a space of their own: turned, sheared or stretched in any way.

use super::frame::Frames;
use super::slab::Slabs;
use super::{Aabb, Block, Left, Rays, Solid, Surfaces, gather_vectors, next_to, permuted};
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3};
use crate::scene::Transform;
use glam::{DAffine3, DVec3};

/// `n` boxes, each by a frame with its origin in the box's middle, and `half` (3), half its edges in own space.
/// Parts 0 to 5 are the faces -x, +x, -y, +y, -z, +z of own space.
#[derive(Debug, Clone, Default)]
pub struct OrientedBoxes<S> {
    frames: Frames<S>,
    half: [Vec<S>; 3],
}

impl<S: Scalar> OrientedBoxes<S> {
    /// Adds the image of the box between `min` and `max` (`min <= max`; equal coordinates make a flat box).
    pub fn push(&mut self, world_from_object: &Transform, min: DVec3, max: DVec3) {
        let middle = min * 0.5 + max * 0.5;
        let mut frame = *world_from_object;
        frame.forward = DAffine3 { translation: frame.point(middle), ..frame.forward };
        self.frames.push(&frame);
        for (k, column) in self.half.iter_mut().enumerate() {
            column.push(S::from_f64(max[k] * 0.5 - min[k] * 0.5));
        }
    }

    #[inline(always)]
    fn at(&self, i: usize) -> Slabs<S::Lane> {
        let h = |k: usize| S::Lane::splat(self.half[k][i]);
        let half = Vec3::new(h(0), h(1), h(2));
        Slabs { min: -half, max: half }
    }

    fn half_of(&self, i: usize) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|k| self.half[k][i].to_f64()))
    }
}

impl<S: Scalar> Block<S> for OrientedBoxes<S> {
    type Roots = [S::Lane; 2];

    fn len(&self) -> usize {
        self.frames.len()
    }

    #[inline(always)]
    fn roots(&self, i: usize, rays: &Rays<S::Lane>, left: Option<&Left<S::Lane>>) -> [S::Lane; 2] {
        let frame = self.frames.at(i);
        let own = frame.rays(rays);
        match left {
            None => self.at(i).crossings(&own),
            Some(left) => self.at(i).crossings_left(&own, left, frame.direction_error(rays)),
        }
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
        let frame = self.frames.gathered(index);
        let half = gather_vectors(&self.half, index);
        let (own, slabs) = (frame.rays(rays), Slabs { min: -half, max: half });
        let t = loose.select(kept(next_to(&slabs.crossings(&own), t)), t);
        let (point, normal, part) = slabs.face(&own, t);
        let (point, normal) = (self.frames.to_world(index, point), frame.normal(normal));
        (t, Surfaces { point, normal, part, ..Default::default() })
    }

    fn solid(&self, i: usize) -> Option<Solid> {
        Some(Solid::OrientedBox(self.frames.own_space(i), self.half_of(i)))
    }

    fn bounds(&self, i: usize) -> Aabb {
        self.frames.bounds(i, DVec3::ZERO, self.half_of(i))
    }

    fn permute(&mut self, order: &[u32]) {
        self.frames.permute(order);
        for column in &mut self.half {
            *column = permuted(column, order);
        }
    }
}
