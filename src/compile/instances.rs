//! Meshes that stand in several places: one tree for all of them, in the mesh's own space, which rays are moved to (Rubin and
//! Whitted 1980, A 3-dimensional representation for fast rendering of complex scenes).
//!
//! A mesh that stands once, or is small, has its triangles in the scene's own columns: a ray is through with those sooner.

use super::{Geometry, SurfaceId, Tag};
use crate::kernel::Aabb;
use crate::lane::Scalar;
use crate::scene::{CsgOp, Mesh, Object, Scene, Shape, Texture, Transform};
use glam::{DMat3, DVec3};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// Which meshes have one tree for all places where they stand. The picture is the same, but for roundings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Instancing {
    /// Those of which that saves more than it costs.
    #[default]
    Auto,
    /// All that stand in several places.
    Always,
    /// None.
    Never,
}

/// Triangles that are spared by sharing a mesh, from which on it is shared.
const WORTH_SHARING: usize = 1 << 16;
/// Smaller meshes are not: to go into one costs as much as to test it.
const LEAST_TRIANGLES: usize = 64;
/// All surfaces have numbers in 32 bits, some of which mean something else: what goes beyond has its triangles in the scene's columns, as
/// far as there is room.
const MOST_SURFACES: u64 = 1 << 31;

/// Meshes that are shared, and where they stand.
pub struct Instances<S: Scalar, B: Scalar> {
    /// Each in its own space.
    pub meshes: Vec<Geometry<S, B>>,
    /// In the order of the tree's leaves.
    pub rows: Vec<Instance<S>>,
    /// By look of an instance's mesh, its owner: see [`Instance::owners`].
    owners: Vec<u32>,
}

/// A mesh in one of its places.
#[derive(Debug, Clone)]
pub struct Instance<S> {
    /// Which mesh.
    pub mesh: u32,
    /// The first of its surfaces, which are in the order of its mesh's.
    pub first: SurfaceId,
    /// Where the zero of the mesh's columns lies, in those of the scene.
    pub center: [S; 3],
    /// Rows of the linear map from the scene's space to the mesh's,
    pub to_mesh: [[S; 3]; 3],
    /// and back.
    pub to_scene: [[S; 3]; 3],
    /// Around it.
    pub bounds: Aabb,
    /// Place of its first look's owner.
    owners: u32,
}

impl<S: Scalar, B: Scalar> Default for Instances<S, B> {
    fn default() -> Self {
        Self { meshes: Vec::new(), rows: Vec::new(), owners: Vec::new() }
    }
}

impl<S: Scalar, B: Scalar> Instances<S, B> {
    /// Of `placed` meshes in the `order` of the tree's leaves, whose surfaces are numbered from `first` on.
    pub(super) fn new(
        meshes: Vec<Geometry<S, B>>,
        placed: &[PlacedMesh],
        order: &[u32],
        mut first: SurfaceId,
    ) -> Self {
        let mut all = Self { meshes, rows: Vec::new(), owners: Vec::new() };
        for &number in order {
            let PlacedMesh { mesh, place, owners, bounds, .. } = &placed[number as usize];
            let geometry = &all.meshes[*mesh as usize];
            let single = |v: DVec3| v.to_array().map(S::from_f64);
            let rows = |m: DMat3| [0, 1, 2].map(|k| single(m.row(k)));
            all.rows.push(Instance {
                mesh: *mesh,
                first,
                center: single(place.point(geometry.origin)),
                to_mesh: rows(place.inverse.matrix3),
                to_scene: rows(place.forward.matrix3),
                bounds: *bounds,
                owners: all.owners.len() as u32,
            });
            first += geometry.owner.len() as u32;
            all.owners.extend_from_slice(owners);
        }
        all
    }

    /// True without any.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Bytes of the meshes and of their places.
    pub(super) fn bytes(&self) -> usize {
        let meshes: usize = self.meshes.iter().map(Geometry::bytes).sum();
        meshes + size_of_val(&self.rows[..]) + size_of_val(&self.owners[..])
    }

    /// Whose a surface of an instance is.
    pub(super) fn owner_of(&self, row: usize, surface: SurfaceId) -> u32 {
        let Instance { mesh, first, owners, .. } = self.rows[row];
        let look = self.meshes[mesh as usize].owner[(surface - first) as usize];
        self.owners[(owners + look) as usize]
    }

    /// A surface's place among those of its instance.
    pub(super) fn place_of(&self, row: usize, surface: SurfaceId) -> u32 {
        let Instance { mesh, first, .. } = self.rows[row];
        self.meshes[mesh as usize].ranks.of(surface - first)
    }
}

/// A shared mesh in one of its places, before there is a tree.
#[derive(Debug, Clone)]
pub(super) struct PlacedMesh {
    /// Its number.
    pub mesh: u32,
    /// From its own space to that of the scene's columns.
    pub place: Transform,
    /// That of its first triangle.
    pub tag: Tag,
    /// By look.
    pub owners: Vec<u32>,
    /// Around it.
    pub bounds: Aabb,
}

/// The meshes of a scene that are shared.
#[derive(Debug, Default)]
pub(super) struct SharedMeshes {
    pub all: Vec<SharedMesh>,
    /// By the mesh's address.
    number: FxHashMap<usize, u32>,
    /// Surfaces that have been given numbers.
    surfaces: u64,
}

/// A mesh that stands in several places.
#[derive(Debug)]
pub(super) struct SharedMesh {
    pub mesh: Arc<Mesh>,
    pub looks: Arc<MeshLooks>,
    /// Together around all corners.
    boxes: Vec<Aabb>,
}

impl SharedMeshes {
    /// Those of `scene`.
    pub fn of(scene: &Scene, instancing: Instancing) -> Self {
        if instancing == Instancing::Never {
            return Self::default();
        }
        let always = instancing == Instancing::Always;
        let mut meshes = Self::default();
        for Use { mesh, places } in Uses::of(scene, u64::MAX).meshes {
            let is_wanted = places > 1 && (always || is_worth_sharing(mesh, places));
            if !is_wanted || mesh.triangles.is_empty() {
                continue;
            }
            let boxes = boxes_about(&mesh.vertices);
            if boxes.iter().all(Aabb::is_finite) {
                meshes.number.insert(address(mesh), meshes.all.len() as u32);
                let looks = Arc::new(MeshLooks::of(mesh));
                meshes.all.push(SharedMesh { mesh: mesh.clone(), looks, boxes });
            }
        }
        meshes
    }

    /// The number of a mesh if it is shared, and a box around it in its `place`; its surfaces are given numbers.
    pub fn place(&mut self, mesh: &Arc<Mesh>, place: &Transform) -> Option<(u32, Aabb)> {
        let number = *self.number.get(&address(mesh))?;
        let surfaces = self.surfaces + mesh.triangles.len() as u64;
        if surfaces > MOST_SURFACES {
            return None;
        }
        self.surfaces = surfaces;
        let corners = self.all[number as usize].boxes.iter().flat_map(Aabb::corners);
        let bounds = Aabb::of(corners.map(|corner| place.point(corner))).inflated(BOUNDS_ROUNDINGS);
        // (What is moved beyond all measure is asked by every ray, and met by none.)
        Some((number, if bounds.is_finite() { bounds } else { Aabb::INFINITE }))
    }
}

impl PlacedMesh {
    /// True if lengths change so much on the way to the mesh's space or back that their squares may be beyond single precision.
    pub fn is_extreme(&self) -> bool {
        let Transform { forward, inverse } = &self.place;
        let numbers = [forward, inverse].map(|map| map.matrix3.to_cols_array());
        numbers.as_flattened().iter().any(|x| x.abs() > LARGEST)
    }
}

/// See [`PlacedMesh::is_extreme`].
const LARGEST: f64 = 1e12;

/// What corners are off by that were moved, as a share of the box around them.
const BOUNDS_ROUNDINGS: f64 = 16.0 * f64::EPSILON;

/// How many shapes a scene is when it is rendered, where shared meshes count once: `most` and more if they are more than `most`.
pub fn kept_shapes(scene: &Scene, most: u64) -> u64 {
    let Uses { meshes, mut shapes, .. } = Uses::of(scene, most);
    let mut surfaces = 0u64;
    for Use { mesh, places } in meshes {
        let (one, all) = (mesh.triangles.len() as u64, mesh.triangles.len() as u64 * places as u64);
        let is_shared = is_worth_sharing(mesh, places);
        shapes = shapes.saturating_add(if is_shared { one } else { all });
        surfaces = surfaces.saturating_add(if is_shared { all } else { 0 });
    }
    shapes.saturating_add(surfaces.saturating_sub(MOST_SURFACES))
}

/// True if one tree for so many places of a mesh is worth what rays lose by it.
fn is_worth_sharing(mesh: &Mesh, places: usize) -> bool {
    let triangles = mesh.triangles.len();
    triangles >= LEAST_TRIANGLES && places.saturating_sub(1).saturating_mul(triangles) >= WORTH_SHARING
}

/// True if a mesh with its object's `texture` can be shared where it stands by itself.
///
/// It stops all light, or rays would have to be told which surfaces of a place they have gone through; it is no solid, whose triangles
/// are asked one by one whether the eye is in it; and it has a look.
pub(super) fn can_be_shared(mesh: &Mesh, texture: Option<&Texture>) -> bool {
    texture.is_some() && mesh.blocks_light(texture) && mesh.inside_vector.is_none()
}

/// What a scene is made of, as [`flatten`](super::flatten::flatten) finds it.
#[derive(Default)]
struct Uses<'a> {
    /// What can be shared, in the order in which it comes up.
    meshes: Vec<Use<'a>>,
    /// By the mesh's address.
    number: FxHashMap<usize, usize>,
    /// All else, and places of these meshes.
    shapes: u64,
    /// No more than these are counted.
    most: u64,
}

/// Where a mesh stands that can be shared there.
struct Use<'a> {
    mesh: &'a Arc<Mesh>,
    places: usize,
}

impl<'a> Uses<'a> {
    fn of(scene: &'a Scene, most: u64) -> Self {
        let mut uses = Self { most, ..Self::default() };
        scene.objects.iter().for_each(|object| uses.count(object, None, false));
        uses
    }

    /// Counts an object with the `texture` of what it stands in, `cut` if that has surfaces which depend on each other.
    fn count(&mut self, object: &'a Object, texture: Option<&'a Texture>, cut: bool) {
        if self.shapes > self.most {
            return;
        }
        let texture = object.texture.as_deref().or(texture);
        let mut cut = cut || !object.clipped_by().is_empty();
        match &object.shape {
            Shape::Mesh(mesh) if !cut && can_be_shared(mesh, texture) => {
                let number = *self.number.entry(address(mesh)).or_insert(self.meshes.len());
                if number == self.meshes.len() {
                    self.meshes.push(Use { mesh, places: 0 });
                }
                self.meshes[number].places += 1;
                self.shapes += 1;
            }
            Shape::Mesh(mesh) => self.shapes = self.shapes.saturating_add(mesh.triangles.len() as u64),
            Shape::Csg { op, children, .. } => {
                cut |= *op != CsgOp::Union || object.flags.is_turned();
                self.shapes += 1;
                children.iter().for_each(|child| self.count(child, texture, cut));
            }
            _ => self.shapes += 1,
        }
        object.clipped_by().iter().for_each(|clip| self.count(clip, texture, true));
    }
}

/// What tells meshes apart.
fn address(mesh: &Arc<Mesh>) -> usize {
    Arc::as_ptr(mesh) as usize
}

/// The cells along each axis by which corners are boxed.
const CELLS: usize = 4;

/// Boxes that together hold all corners: moved one by one they are closer around a moved mesh than its own box would be.
fn boxes_about(corners: &[DVec3]) -> Vec<Aabb> {
    let whole = Aabb::of(corners.iter().copied());
    let scale = CELLS as f64 / (whole.max - whole.min);
    let cell = |x: f64| (x as usize).min(CELLS - 1); // (NaN, of a flat mesh, is 0.)
    let mut boxes = vec![Aabb::EMPTY; CELLS * CELLS * CELLS];
    for &corner in corners {
        let [x, y, z] = ((corner - whole.min) * scale).to_array().map(cell);
        let around = &mut boxes[(x * CELLS + y) * CELLS + z];
        *around = around.union(Aabb { min: corner, max: corner });
    }
    boxes.retain(|around| !around.is_empty());
    boxes
}

/// The looks of a mesh's triangles: number 0 is that of the mesh.
#[derive(Debug, Default)]
pub(super) struct MeshLooks {
    /// By look from 1 on: which of the mesh's textures its corners have.
    pub textures: Vec<[u32; 3]>,
    /// By triangle; nothing if all look as the mesh does.
    of: Vec<u32>,
}

impl MeshLooks {
    /// Those of `mesh`.
    pub fn of(mesh: &Mesh) -> Self {
        let mut looks = Self::default();
        if mesh.textures.is_empty() {
            return looks;
        }
        let mut numbers = FxHashMap::default();
        for triangle in &mesh.triangles {
            looks.of.push(triangle.textures.map_or(0, |corners| {
                *numbers.entry(corners).or_insert_with(|| {
                    looks.textures.push(corners);
                    looks.textures.len() as u32
                })
            }));
        }
        looks
    }

    /// That of a triangle.
    pub fn of_triangle(&self, triangle: u32) -> u32 {
        self.of.get(triangle as usize).copied().unwrap_or(0)
    }
}
