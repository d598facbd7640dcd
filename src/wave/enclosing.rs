//! What the camera stands in: POV-Ray's rays start with the interiors of all solids around the eye.

use super::composite::Parts;
use super::instances::Placed;
use super::medium::Media;
use crate::compile::{COMPOSITE, Compiled, Geometry, INSTANCE, Kind, NO_SURFACE, SurfaceId, WithBlock};
use crate::csg::Scratch;
use crate::kernel::{Aabb, Block, Rays};
use crate::lane::{LANES, Lane, Scalar, Vec3, f64x8};
use crate::scene::{Camera, Projection};
use glam::DVec3;
use smallvec::SmallVec;

/// Solids that the eye may be in, in order of declaration.
#[derive(Debug, Default)]
pub struct Enclosing {
    solids: Vec<Enclosure>,
    meshes: Vec<MeshAround>,
    /// What the only eye is in: a mesh around it is asked once, triangle by triangle, and not by every tile.
    eye: Option<Interiors>,
}

/// Numbers of interiors, one in the other.
type Interiors = SmallVec<[u32; 4]>;

/// A mesh that the eye may be in.
#[derive(Debug)]
struct MeshAround {
    triangles: Vec<SurfaceId>,
    inverse: bool,
}

/// Kind number of meshes among enclosures: `row` counts them.
const MESH: u8 = INSTANCE + 1;

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Enclosure {
    rank: u32,
    kind: u8,
    row: u32,
    interior: u32,
    /// Of [`Compiled::bodies`], the one whose part it is.
    body: Option<u32>,
}

impl Enclosing {
    /// The solids of `scene` that the eye may be in: none where no interior matters.
    pub fn new<S: Scalar, B: Scalar>(scene: &Compiled<S, B>) -> Self {
        let mut solids = Vec::new();
        if scene.interiors.len() < 2 {
            return Self::default();
        }
        let eyes = eyes(&scene.camera, scene.geometry.origin);
        let enclosure = |surface: u32, kind: u8, row: u32, interior: u32| {
            let rank = scene.geometry.ranks.of(surface);
            let body = scene.bodies.partition_point(|body| body.ranks.end <= rank);
            let body = scene.bodies.get(body).filter(|body| body.ranks.contains(&rank)).map(|_| body as u32);
            let interior = body.map_or(interior, |body| scene.bodies[body as usize].interior);
            Enclosure { rank, kind, row, interior, body }
        };
        // POV-Ray asks only objects in whose box the eye is, and the box of a disc is flat.
        let flat = [Kind::Disc, Kind::Triangle, Kind::SmoothTriangle, Kind::Polygon];
        for &kind in Kind::ALL.iter().filter(|kind| !flat.contains(kind)) {
            for row in 0..scene.geometry.columns.len(kind) as u32 {
                let surface = scene.geometry.base[kind as usize] + row;
                let owner = &scene.owners[scene.geometry.owner[surface as usize] as usize];
                if owner.inverse || scene.geometry.columns.bounds(kind, row as usize).meets(&eyes) {
                    solids.push(enclosure(surface, kind as u8, row, owner.interior));
                }
            }
        }
        for (number, composite) in scene.geometry.csg.composites.iter().enumerate() {
            if composite.parts.is_empty() {
                continue;
            }
            let surface = scene.geometry.first_part + composite.parts.start;
            solids.push(enclosure(surface, COMPOSITE, number as u32, composite.surroundings.interior));
        }
        for (number, instance) in scene.geometry.instances.rows.iter().enumerate() {
            let is_mesh = scene.geometry.instances.prototypes[instance.prototype as usize].has_triangles();
            if let Some(interior) = instance.interior
                && (!is_mesh || instance.bounds.meets(&eyes))
            {
                solids.push(enclosure(instance.first, INSTANCE, number as u32, interior));
            }
        }
        let mut meshes = Vec::new();
        for (mesh, triangles) in scene.mesh_bodies.iter().zip(triangles_of_bodies(scene)) {
            let bounds = triangles.iter().map(|&triangle| {
                let (kind, row) = scene.geometry.row_of(triangle);
                scene.geometry.columns.bounds(Kind::ALL[usize::from(kind)], row as usize)
            });
            if let Some(&first) = triangles.first()
                && (mesh.inverse || bounds.fold(Aabb::EMPTY, Aabb::union).meets(&eyes))
            {
                solids.push(enclosure(first, MESH, meshes.len() as u32, mesh.interior));
                meshes.push(MeshAround { triangles, inverse: mesh.inverse });
            }
        }
        solids.sort_unstable();
        let mut found = Self { solids, meshes, eye: None };
        if scene.camera.projection == Projection::Perspective && !found.solids.is_empty() {
            let eye = Vec3::splat(scene.camera.location - scene.geometry.origin);
            let [around, ..] = found.around(scene, eye, &mut Scratch::default());
            found.eye = Some(around);
        }
        found
    }

    /// The lists of interiors around eight points (compiled space), where the camera's rays start.
    pub fn media<S: Scalar, B: Scalar>(
        &self,
        scene: &Compiled<S, B>,
        points: Vec3<f64x8>,
        media: &mut Media,
        scratch: &mut Scratch,
    ) -> [u32; LANES] {
        if self.solids.is_empty() {
            return [0; LANES];
        }
        if let Some(eye) = &self.eye {
            return [media.number(eye.clone()); LANES];
        }
        self.around(scene, points, scratch).map(|list| media.number(list))
    }

    /// The interiors around each of eight points.
    fn around<S: Scalar, B: Scalar>(
        &self,
        scene: &Compiled<S, B>,
        points: Vec3<f64x8>,
        scratch: &mut Scratch,
    ) -> [Interiors; LANES] {
        let mut lists: [Interiors; LANES] = Default::default();
        // Any direction will do; one along no axis and in no plane of a usual scene meets the fewest special cases.
        let dir = Vec3::splat(DVec3::new(0.36, 0.48, 0.8));
        let rays = Rays { origin: points, dir };
        for solids in self.solids.chunk_by(|a, b| a.body.is_some() && a.body == b.body) {
            let within = |solid: &Enclosure| match solid.kind {
                MESH => self.meshes[solid.row as usize].contains(scene, &rays),
                _ => solid.contains(scene, &rays, scratch),
            };
            let inside = solids.iter().map(within).fold(0, |inside, these| inside | these);
            let interior = solids[0].interior;
            for (k, list) in lists.iter_mut().enumerate() {
                // The air of opaque solids, number 0 of them all, is never left: only its place among the others counts.
                let counts = interior != 0 || list.last() != Some(&0);
                if inside >> k & 1 == 1 && counts {
                    list.push(interior);
                }
            }
        }
        lists
    }
}

/// The triangles of each of [`Compiled::mesh_bodies`].
fn triangles_of_bodies<S: Scalar, B: Scalar>(scene: &Compiled<S, B>) -> Vec<Vec<SurfaceId>> {
    let bodies = &scene.mesh_bodies;
    let mut triangles = vec![Vec::new(); bodies.len()];
    if bodies.is_empty() {
        return triangles;
    }
    // (In a union that is one object ranks are turned round, and bodies are not.)
    let mut by_rank: Vec<usize> = (0..bodies.len()).collect();
    by_rank.sort_unstable_by_key(|&body| bodies[body].ranks.start);
    for kind in [Kind::Triangle, Kind::SmoothTriangle] {
        let base = scene.geometry.base[kind as usize];
        for surface in base..base + scene.geometry.columns.len(kind) as u32 {
            let rank = scene.geometry.ranks.of(surface);
            let body = by_rank.partition_point(|&body| bodies[body].ranks.end <= rank);
            if let Some(&body) = by_rank.get(body)
                && bodies[body].ranks.contains(&rank)
            {
                triangles[body].push(surface);
            }
        }
    }
    triangles
}

impl Enclosure {
    /// Lanes whose rays start in it.
    fn contains<S: Scalar, B: Scalar>(
        &self,
        scene: &Compiled<S, B>,
        rays: &Rays<f64x8>,
        scratch: &mut Scratch,
    ) -> u8 {
        let &Self { kind, row, .. } = self;
        if kind == COMPOSITE {
            return in_composite(&scene.geometry, row as usize, rays, scratch);
        }
        let rays = Rays { origin: rays.origin.cast(), dir: rays.dir.cast() };
        if kind == INSTANCE {
            let placed = Placed::of(&scene.geometry, row);
            let (Rays { origin, dir }, _) = placed.moved(&rays);
            let rays = Rays { origin: origin.cast(), dir: dir.cast() };
            return in_prototype(placed.prototype, &rays, scratch);
        }
        let surface = scene.geometry.base[usize::from(kind)] + row;
        let inverse = scene.owners[scene.geometry.owner[surface as usize] as usize].inverse;
        let inside = scene.geometry.columns.with(kind, Contains { row: row as usize, rays: &rays });
        if inverse { !inside } else { inside }
    }
}

/// Lanes whose rays start in composite `number`.
fn in_composite<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    number: usize,
    rays: &Rays<f64x8>,
    scratch: &mut Scratch,
) -> u8 {
    let source = Parts { scene, left: &[NO_SURFACE; LANES], part: &[0; LANES], starts: true };
    scene.csg.surrounds(&scene.csg.composites[number], rays, &source, scratch)
}

/// Lanes whose rays start in a prototype, which is a composite or a mesh.
fn in_prototype<S: Scalar, B: Scalar>(
    prototype: &Geometry<S, B>,
    rays: &Rays<f64x8>,
    scratch: &mut Scratch,
) -> u8 {
    if !prototype.csg.composites.is_empty() {
        return in_composite(prototype, 0, rays, scratch);
    }
    let triangles = [Kind::Triangle, Kind::SmoothTriangle].into_iter();
    odd_of(prototype, triangles.flat_map(|kind| rows_of(prototype, kind)), rays)
}

/// Lanes whose lines meet an odd number of triangles, given by kind and row, behind their start.
fn odd_of<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    triangles: impl Iterator<Item = (u8, u32)>,
    rays: &Rays<f64x8>,
) -> u8 {
    let rays = Rays { origin: rays.origin.cast(), dir: rays.dir.cast() };
    triangles.fold(0, |odd, (kind, row)| {
        odd ^ scene.columns.with(kind, MetBehind { row: row as usize, rays: &rays })
    })
}

/// All rows of a kind, with it.
fn rows_of<S: Scalar, B: Scalar>(scene: &Geometry<S, B>, kind: Kind) -> impl Iterator<Item = (u8, u32)> {
    (0..scene.columns.len(kind) as u32).map(move |row| (kind as u8, row))
}

impl MeshAround {
    /// Lanes whose rays start in it: they leave it once more than they enter it.
    fn contains<S: Scalar, B: Scalar>(&self, scene: &Compiled<S, B>, rays: &Rays<f64x8>) -> u8 {
        let triangles = self.triangles.iter().map(|&triangle| scene.geometry.row_of(triangle));
        let odd = odd_of(&scene.geometry, triangles, rays);
        if self.inverse { !odd } else { odd }
    }
}

/// Where rays start (compiled space): the eye, or the window.
fn eyes(camera: &Camera, origin: DVec3) -> Aabb {
    let middle = camera.location - origin;
    match camera.projection {
        Projection::Perspective => Aabb::of([middle]),
        Projection::Orthographic => {
            let corner = |s: f64, t: f64| middle + (camera.right * s + camera.up * t) * 0.5;
            let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)];
            Aabb::of(corners).inflated(4.0 * f64::EPSILON)
        }
    }
}

/// Lanes that have an odd number of crossings behind their start.
fn odd_behind<L: Lane>(crossings: &[L]) -> u8 {
    crossings.iter().fold(0, |odd, crossing| odd ^ crossing.lt(L::zero()).bits())
}

/// Lanes whose line meets a triangle behind its start: the odd ones, as for [`Contains`].
struct MetBehind<'a, L> {
    row: usize,
    rays: &'a Rays<L>,
}

impl<S: Scalar> WithBlock<S> for MetBehind<'_, S::Lane> {
    type Output = u8;

    fn block<K: Block<S>>(self, block: &K) -> u8 {
        odd_behind(block.roots(self.row, self.rays, None).as_ref())
    }
}

/// Lanes whose start lies inside a primitive.
struct Contains<'a, L> {
    row: usize,
    rays: &'a Rays<L>,
}

impl<S: Scalar> WithBlock<S> for Contains<'_, S::Lane> {
    type Output = u8;

    fn block<K: Block<S>>(self, block: &K) -> u8 {
        let starts_inside = block.starts_inside(self.row, self.rays).bits();
        starts_inside ^ odd_behind(block.boundary(self.row, self.rays, None).as_ref())
    }
}
