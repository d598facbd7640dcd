//! Spheres: centre and radius. (An ellipsoid is another kind.)

use super::{Aabb, Block, Left, Rays, Surfaces, gather, permuted};
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3};
use glam::DVec3;

/// `n` spheres: columns `cx, cy, cz` (centres) and `radius`, all in scene units.
#[derive(Debug, Clone, Default)]
pub struct Spheres<S> {
    cx: Vec<S>,
    cy: Vec<S>,
    cz: Vec<S>,
    radius: Vec<S>,
}

impl<S: Scalar> Spheres<S> {
    /// Adds a row, rounded to the columns' precision.
    pub fn push(&mut self, center: DVec3, radius: f64) {
        self.cx.push(S::from_f64(center.x));
        self.cy.push(S::from_f64(center.y));
        self.cz.push(S::from_f64(center.z));
        self.radius.push(S::from_f64(radius));
    }
}

impl<S: Scalar> Block<S> for Spheres<S> {
    const ROOTS: usize = 2;
    type Roots = [S::Lane; 2];

    fn len(&self) -> usize {
        self.radius.len()
    }

    /// Takes the discriminant at the ray's closest point to the centre, so a small or far sphere does not cancel
    /// (Haines, Günther, Akenine-Möller, Ray Tracing Gems, ch. 7), and the roots as `c/q` and `q/a`. Relative error
    /// of `t` about 4 roundings, more near the silhouette.
    #[inline(always)]
    fn roots(&self, i: usize, rays: &Rays<S::Lane>, left: Option<&Left<S::Lane>>) -> [S::Lane; 2] {
        let center =
            Vec3::new(S::Lane::splat(self.cx[i]), S::Lane::splat(self.cy[i]), S::Lane::splat(self.cz[i]));
        let radius = S::Lane::splat(self.radius[i]);
        let f = center - rays.origin;
        let b = f.dot(rays.dir);
        // l is the perpendicular from the centre to the ray.
        let l = f - rays.dir * b;
        let half_chord = (radius * radius - l.dot(l)).sqrt(); // NaN on a miss, and so are both roots
        let q = b + half_chord.copysign(b);
        let mut near = f.dot(f) - radius * radius;
        near = near / q;
        if let Some(left) = left {
            // The start lies on the sphere, c = 0 but for rounding: of the two roots, c/q is the start itself.
            near = left.on.select(S::Lane::zero(), near);
        }
        // Twice the zero would be q = 0: a ray that starts on the sphere and is tangent to it.
        [near.min(q), near.max(q)]
    }

    fn resolve(
        &self,
        index: &[u32; LANES],
        _active: Mask<S::Lane>,
        rays: &Rays<S::Lane>,
        t: S::Lane,
    ) -> Surfaces<S::Lane> {
        let center = Vec3::new(gather(&self.cx, index), gather(&self.cy, index), gather(&self.cz, index));
        let radius = gather(&self.radius, index);
        let from_center = (rays.origin - center) + rays.dir * t;
        let normal = from_center.normalize();
        Surfaces { point: center + normal * radius, normal, ..Default::default() }
    }

    fn bounds(&self, i: usize) -> Aabb {
        let center = DVec3::new(self.cx[i].to_f64(), self.cy[i].to_f64(), self.cz[i].to_f64());
        let radius = DVec3::splat(self.radius[i].to_f64());
        Aabb { min: center - radius, max: center + radius }
    }

    fn permute(&mut self, order: &[u32]) {
        for column in [&mut self.cx, &mut self.cy, &mut self.cz, &mut self.radius] {
            *column = permuted(column, order);
        }
    }
}
