//! Ellipsoids: the unit sphere under an affine map.

use super::frame::Frames;
use super::{Aabb, Block, Left, Rays, Solid, Surfaces};
use crate::lane::{LANES, Lane, Mask, Scalar};
use crate::scene::Transform;

/// `n` ellipsoids, each by the frame in which it is the unit sphere.
#[derive(Debug, Clone, Default)]
pub struct Ellipsoids<S> {
    frames: Frames<S>,
}

impl<S: Scalar> Ellipsoids<S> {
    /// Adds the image of the unit sphere, rounded to the columns' precision.
    pub fn push(&mut self, world_from_own: &Transform) {
        self.frames.push(world_from_own);
    }
}

impl<S: Scalar> Block<S> for Ellipsoids<S> {
    type Roots = [S::Lane; 2];

    fn len(&self) -> usize {
        self.frames.len()
    }

    /// As for spheres, from the closest point to the centre in own space, with a direction that is not of unit
    /// length.
    #[inline(always)]
    fn roots(&self, i: usize, rays: &Rays<S::Lane>, left: Option<&Left<S::Lane>>) -> [S::Lane; 2] {
        let frame = self.frames.at(i);
        let Rays { origin, dir } = frame.rays(rays);
        let one = S::Lane::lit(1.0);
        let inv_a = one / dir.dot(dir);
        let toward = -origin.dot(dir);
        let mut b = toward * inv_a;
        // l is the perpendicular from the centre to the ray.
        let l = origin + dir * b;
        let half_chord = ((one - l.dot(l)) * inv_a).sqrt(); // NaN on a miss, and so are both roots
        let mut q = b + half_chord.copysign(b);
        let mut near = (origin.dot(origin) - one) * inv_a / q;
        if let Some(left) = left {
            // The start lies on the surface: one root is 0, the other is twice the way to the middle of the chord,
            // or also 0 if rounding hides on which side of the tangent the ray leaves.
            let noise =
                frame.start_error(rays).dot(dir.abs()) + origin.abs().dot(frame.direction_error(rays));
            b = toward.abs().gt(noise).keep(b);
            near = left.on.select(S::Lane::zero(), near);
            q = left.on.select(b + b, q);
        }
        [near.min(q), near.max(q)]
    }

    fn resolve(
        &self,
        index: &[u32; LANES],
        _active: Mask<S::Lane>,
        rays: &Rays<S::Lane>,
        t: S::Lane,
    ) -> Surfaces<S::Lane> {
        let frame = self.frames.gathered(index);
        let own = frame.rays(rays);
        let on_sphere = (own.origin + own.dir * t).normalize();
        Surfaces {
            point: self.frames.to_world(index, on_sphere),
            normal: frame.normal(on_sphere),
            ..Default::default()
        }
    }

    fn solid(&self, i: usize) -> Option<Solid> {
        Some(Solid::Ellipsoid(self.frames.own_space(i)))
    }

    fn bounds(&self, i: usize) -> Aabb {
        self.frames.ball_bounds(i)
    }

    fn permute(&mut self, order: &[u32]) {
        self.frames.permute(order);
    }
}
