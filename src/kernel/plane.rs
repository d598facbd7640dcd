//! Planes: a unit normal and a point; the half space behind the normal is the inside.

use super::{Aabb, Block, Left, Looking, Rays, Solid, Surfaces, first_beyond, gather_vectors, permuted};
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3};
use crate::scene::Transform;
use glam::DVec3;

/// Roundings by which the face of something that stands on a plane may be nearer than the plane: three differences, products and
/// quotients of either, twice as many to be sure. What is farther off than that in truth is seen as it stands.
const PLANES_FIRST: f64 = 16.0;

/// `n` planes: columns `normal` (3) and `foot` (3), the plane's point nearest to the world's origin.
#[derive(Debug, Clone, Default)]
pub struct Planes<S> {
    normal: [Vec<S>; 3],
    foot: [Vec<S>; 3],
}

impl<S: Scalar> Planes<S> {
    /// Adds the plane `normal . p = distance` of an own space; its image under any affine map is a plane again.
    pub fn push(&mut self, world_from_own: &Transform, normal: DVec3, distance: f64) {
        let n = world_from_own.normal(normal).normalize();
        let foot = n * n.dot(world_from_own.point(normal * (distance / normal.length_squared())));
        for k in 0..3 {
            self.normal[k].push(S::from_f64(n[k]));
            self.foot[k].push(S::from_f64(foot[k]));
        }
    }

    #[inline(always)]
    fn at(&self, i: usize) -> (Vec3<S::Lane>, Vec3<S::Lane>) {
        let splat = |c: &[Vec<S>; 3]| {
            Vec3::new(S::Lane::splat(c[0][i]), S::Lane::splat(c[1][i]), S::Lane::splat(c[2][i]))
        };
        (splat(&self.normal), splat(&self.foot))
    }
}

impl<S: Scalar> Block<S> for Planes<S> {
    const SHORT: bool = true;
    type Roots = [S::Lane; 1];

    fn len(&self) -> usize {
        self.normal[0].len()
    }

    /// One crossing, or none if the ray is parallel. A half space has no pair of crossings: the ray is inside it
    /// before the crossing if it runs along the normal, after it otherwise (see [`Block::starts_inside`]).
    #[inline(always)]
    fn roots(&self, i: usize, rays: &Rays<S::Lane>, left: Option<&Left<S::Lane>>) -> [S::Lane; 1] {
        let (normal, foot) = self.at(i);
        let mut t = crossing(normal, foot, rays);
        if let Some(left) = left {
            t = left.on.select(t * S::Lane::zero(), t);
        }
        [finite(t)]
    }

    /// Nearer by some roundings than it is: what stands on a plane has a face there too, and POV-Ray, which tries objects without
    /// bounds before all others, shows the plane.
    #[inline(always)]
    fn first(
        &self,
        i: usize,
        rays: &Rays<S::Lane>,
        left: Option<&Left<S::Lane>>,
        looking: &Looking<S::Lane>,
    ) -> S::Lane {
        let nearer = S::Lane::lit(1.0 - PLANES_FIRST * S::UNIT_ROUNDOFF);
        first_beyond(self.roots(i, rays, left).into_iter().map(|t| t * nearer), looking.from)
    }

    #[inline(always)]
    fn starts_inside(&self, i: usize, rays: &Rays<S::Lane>) -> Mask<S::Lane> {
        let (normal, foot) = self.at(i);
        half_space_at_start(normal.dot(rays.origin - foot), normal.dot(rays.dir))
    }

    /// All: a plane is met once.
    #[inline(always)]
    fn left_behind(&self, _i: usize, _rays: &Rays<S::Lane>, left: &Left<S::Lane>) -> u8 {
        left.on.bits()
    }

    fn resolve(
        &self,
        index: &[u32; LANES],
        _active: Mask<S::Lane>,
        rays: &Rays<S::Lane>,
        _t: S::Lane,
    ) -> Surfaces<S::Lane> {
        let (normal, foot) = (gather_vectors(&self.normal, index), gather_vectors(&self.foot, index));
        // Not where `first` has put it.
        let p = rays.origin + rays.dir * crossing(normal, foot, rays);
        Surfaces { point: p - normal * normal.dot(p - foot), normal, ..Default::default() }
    }

    fn solid(&self, i: usize) -> Option<Solid> {
        let at = |c: &[Vec<S>; 3]| DVec3::from_array(std::array::from_fn(|k| c[k][i].to_f64()));
        Some(Solid::HalfSpace { normal: at(&self.normal), foot: at(&self.foot) })
    }

    fn bounds(&self, _i: usize) -> Aabb {
        Aabb::INFINITE
    }

    fn permute(&mut self, order: &[u32]) {
        for column in self.normal.iter_mut().chain(&mut self.foot) {
            *column = permuted(column, order);
        }
    }
}

/// Where rays cross the plane through `foot`: infinite or NaN if they run along it.
#[inline(always)]
fn crossing<L: Lane>(normal: Vec3<L>, foot: Vec3<L>, rays: &Rays<L>) -> L {
    normal.dot(foot - rays.origin) / normal.dot(rays.dir)
}

/// `t` where it is a number, NaN where it is infinite or none.
#[inline(always)]
pub(super) fn finite<L: Lane>(t: L) -> L {
    t.abs().lt(L::lit(f64::INFINITY)).select(t, L::lit(f64::NAN))
}

/// Whether the far end of a line, where `t` is minus infinity, lies in the half space `height <= 0`; `height` is the
/// start's and `climb` its change per `t`. A parallel ray (no finite crossing) lies where it starts; the boundary
/// is inside.
#[inline(always)]
pub(super) fn half_space_at_start<L: Lane>(height: L, climb: L) -> Mask<L> {
    let crosses = (height / climb).abs().lt(L::lit(f64::INFINITY));
    (crosses & climb.gt(L::zero())) | (!crosses & height.le(L::zero()))
}
