//! Instances against packets: rays are moved to the own space of what stands there, and through its tree.

use super::hits::resolve;
use super::query::Query;
use crate::compile::{Geometry, Instance, NO_SURFACE, SurfaceId};
use crate::kernel::{Rays, Surfaces};
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3, each_lane, equal_lanes};

/// An instance as rays meet it.
pub struct Placed<'a, S: Scalar, B: Scalar> {
    instance: &'a Instance<S>,
    /// In its own space.
    pub prototype: &'a Geometry<S, B>,
}

impl<'a, S: Scalar, B: Scalar> Placed<'a, S, B> {
    /// Instance number `row` of `scene`.
    #[inline]
    pub fn of(scene: &'a Geometry<S, B>, row: u32) -> Self {
        let instance = &scene.instances.rows[row as usize];
        let prototype = &scene.instances.prototypes[instance.prototype as usize];
        Self { instance, prototype }
    }

    /// Those of the rays of `query` that are in `lanes`, in its own space; and how much longer each is there.
    #[inline]
    pub fn rays(&self, query: &Query<S::Lane>, lanes: u8) -> (Query<S::Lane>, S::Lane) {
        let (rays, length) = self.moved(&query.rays);
        (query.moved(rays, length, |surface| self.own(surface), lanes), length)
    }

    /// `rays` in its own space, and how much longer each is there.
    #[inline(always)]
    pub fn moved(&self, rays: &Rays<S::Lane>) -> (Rays<S::Lane>, S::Lane) {
        let rows = self.instance.to_own.map(Vec3::broadcast);
        let moved = |v: Vec3<S::Lane>| Vec3::new(rows[0].dot(v), rows[1].dot(v), rows[2].dot(v));
        let dir = moved(rays.dir);
        let length = dir.length();
        let origin = moved(rays.origin - Vec3::broadcast(self.instance.center));
        (Rays { origin, dir: dir * (S::Lane::lit(1.0) / length) }, length)
    }

    /// What the rays of `query` see that have met this instance: lanes `hits`.
    pub fn resolve(&self, query: &Query<S::Lane>, hits: u8) -> Surfaces<S::Lane> {
        let (mut moved, length) = self.rays(query, hits);
        moved.t = query.t * length;
        moved.surface = query.surface.map(|surface| self.own(surface));
        let found = resolve(self.prototype, &mut moved);
        let [x, y, z] = self.instance.to_scene.map(Vec3::<S::Lane>::broadcast);
        let point = Vec3::new(x.dot(found.point), y.dot(found.point), z.dot(found.point));
        // Normals are moved by the transpose of the map back.
        let [x, y, z] = self.instance.to_own.map(Vec3::<S::Lane>::broadcast);
        let normal = x * found.normal.x + y * found.normal.y + z * found.normal.z;
        let point = point + Vec3::broadcast(self.instance.center);
        Surfaces { point, normal: normal.normalize(), ..found }
    }

    /// What of the scene's surfaces rays have met, by those of the prototype.
    #[inline(always)]
    pub fn surfaces(&self, own: &[SurfaceId; LANES]) -> [SurfaceId; LANES] {
        each_lane(|k| self.surface(own[k]))
    }

    /// The scene's number of a surface of the prototype.
    #[inline(always)]
    pub fn surface(&self, own: SurfaceId) -> SurfaceId {
        self.instance.first.wrapping_add(own)
    }

    /// The number in the prototype of a surface of the scene, if it is one of this instance.
    #[inline(always)]
    pub fn own(&self, surface: SurfaceId) -> SurfaceId {
        let own = surface.wrapping_sub(self.instance.first);
        if own < self.prototype.ranks.rows().len() as u32 { own } else { NO_SURFACE }
    }
}

/// What eight rays see, some of which (`hits`) have met the instances `rows`.
#[cold]
pub fn resolve_instances<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    query: &Query<S::Lane>,
    rows: &[u32; LANES],
    hits: u8,
) -> Surfaces<S::Lane> {
    let (mut all, mut waiting) = (Surfaces::default(), hits);
    while waiting != 0 {
        let row = rows[waiting.trailing_zeros() as usize & (LANES - 1)];
        let same = equal_lanes(rows, row) & waiting;
        waiting &= !same;
        let found = Placed::of(scene, row).resolve(query, same);
        all.put(&found, Mask::from_bits(same));
    }
    all
}
