//! Spheres: centre and radius. (An ellipsoid is another kind.)

use super::{Aabb, Block, Left, Rays, Surfaces, View, gather, permuted};
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3};
use glam::DVec3;

/// `n` spheres (`radius` at least 0): columns `cx, cy, cz` (centres) and `radius`, all in scene units.
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

/// Where rays cross a sphere.
///
/// Takes the discriminant at the ray's closest point to the centre, so a small or far sphere does not cancel
/// (Haines, Günther, Akenine-Möller, Ray Tracing Gems, ch. 7), and the roots as `c/q` and `q/a`. Relative error
/// of `t` about 4 roundings, more near the silhouette.
#[inline(always)]
fn crossings<L: Lane>(center: Vec3<L>, radius: L, rays: &Rays<L>, left: Option<&Left<L>>) -> [L; 2] {
    let f = center - rays.origin;
    let b = f.dot(rays.dir);
    // l is the perpendicular from the centre to the ray.
    let l = f - rays.dir * b;
    // NaN on a miss, and so are both roots. A sphere of radius 0 is touched at most, by luck of rounding.
    let square = radius * radius - l.dot(l);
    if left.is_none() && !square.ge(L::zero()).any() {
        return [L::lit(f64::NAN); 2];
    }
    let half_chord = square.sqrt();
    let mut q = b + half_chord.copysign(b);
    let mut near = (f.dot(f) - radius * radius) / q;
    if let Some(left) = left {
        // The start lies on the sphere: one root is 0, the other is twice the way to the middle of the chord. It
        // is 0 too if the rounding of the start (4 units of its coordinates, 8 in the products and in the
        // normal that the caller compared with) hides on which side of the tangent the ray leaves.
        let reach = (rays.origin.abs() + center.abs()) * L::lit(4.0) + f.abs() * L::lit(8.0);
        let noise = reach.dot(rays.dir.abs()) * L::lit(L::Scalar::UNIT_ROUNDOFF);
        let chord = b.abs().gt(noise).keep(b + b);
        near = left.on.select(L::zero(), near);
        q = left.on.select(chord, q);
    }
    // Where q = 0 (a ray that starts on the sphere, tangent to it) `near` may be 0/0; then both are q.
    [near.min(q), near.max(q)]
}

impl<S: Scalar> Block<S> for Spheres<S> {
    type Roots = [S::Lane; 2];

    fn len(&self) -> usize {
        self.radius.len()
    }

    fn row_bytes(&self) -> usize {
        4 * size_of::<S>()
    }

    #[inline(always)]
    fn roots(&self, i: usize, rays: &Rays<S::Lane>, left: Option<&Left<S::Lane>>) -> [S::Lane; 2] {
        let center =
            Vec3::new(S::Lane::splat(self.cx[i]), S::Lane::splat(self.cy[i]), S::Lane::splat(self.cz[i]));
        crossings(center, S::Lane::splat(self.radius[i]), rays, left)
    }

    const ACROSS: u32 = 1;

    #[inline(always)]
    fn roots_across(
        &self,
        (first, _): (usize, usize),
        rays: &Rays<S::Lane>,
        _view: &View<S::Lane>,
        left: Option<&Left<S::Lane>>,
    ) -> [S::Lane; 2] {
        let eight = |column: &[S]| match column.get(first..first + LANES) {
            Some(rows) => S::Lane::from_fn(|k| rows[k]),
            None => S::Lane::from_fn(|k| column[(first + k).min(column.len() - 1)]),
        };
        let center = Vec3::new(eight(&self.cx), eight(&self.cy), eight(&self.cz));
        crossings(center, eight(&self.radius), rays, left)
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

    /// From the rounded columns, grown by the roundings of the sums here.
    fn bounds(&self, i: usize) -> Aabb {
        let center = DVec3::new(self.cx[i].to_f64(), self.cy[i].to_f64(), self.cz[i].to_f64());
        let radius = DVec3::splat(self.radius[i].to_f64());
        Aabb { min: center - radius, max: center + radius }.inflated(2.0 * f64::UNIT_ROUNDOFF)
    }

    fn permute(&mut self, order: &[u32]) {
        for column in [&mut self.cx, &mut self.cy, &mut self.cz, &mut self.radius] {
            *column = permuted(column, order);
        }
    }
}
