//! What stands in several places, meshes and composites: one tree for all of them, in a space of its own, which rays are moved to (Rubin
//! and Whitted 1980, A 3-dimensional representation for fast rendering of complex scenes).
//!
//! What stands once, or is small, has its primitives in the scene's own columns: a ray is through with those sooner.

use super::composites::Extents;
use super::tag::Tag;
use super::{Geometry, SurfaceId};
use crate::kernel::Aabb;
use crate::lane::Scalar;
use crate::scene::{CsgOp, Flags, Mesh, Object, Scene, Shape, Texture, Transform};
use glam::{DMat3, DVec3};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// What has one tree for all places where it stands. The picture is the same, but for roundings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Instancing {
    /// That of which it saves more than it costs.
    #[default]
    Auto,
    /// All that stands in several places.
    Always,
    /// Nothing.
    Never,
}

/// Surfaces that are spared by sharing something, from which on it is shared.
const WORTH_SHARING: u64 = 1 << 16;
/// What has fewer is not: to go into it costs as much as to test it.
const LEAST_SURFACES: u64 = 64;
/// All surfaces have numbers in 32 bits, some of which mean something else: what goes beyond has its primitives in the scene's columns,
/// as far as there is room.
const MOST_SURFACES: u64 = 1 << 31;

/// What is shared, and where it stands.
pub struct Instances<S: Scalar, B: Scalar> {
    /// Each in its own space.
    pub prototypes: Vec<Geometry<S, B>>,
    /// In the order of the tree's leaves.
    pub rows: Vec<Instance<S>>,
    /// By look of an instance's prototype, its owner: see [`Instance::owners`].
    owners: Vec<u32>,
}

/// A prototype in one of its places.
#[derive(Debug, Clone)]
pub struct Instance<S> {
    /// Which.
    pub prototype: u32,
    /// The first of its surfaces, which are in the order of its prototype's.
    pub first: SurfaceId,
    /// Where the zero of the prototype's columns lies, in those of the scene.
    pub center: [S; 3],
    /// Rows of the linear map from the scene's space to the prototype's,
    pub to_own: [[S; 3]; 3],
    /// and back.
    pub to_scene: [[S; 3]; 3],
    /// Around it.
    pub bounds: Aabb,
    /// What an eye is in that is in it, if it has an inside.
    pub interior: Option<u32>,
    /// Place of its first look's owner.
    owners: u32,
}

impl<S: Scalar, B: Scalar> Default for Instances<S, B> {
    fn default() -> Self {
        Self { prototypes: Vec::new(), rows: Vec::new(), owners: Vec::new() }
    }
}

impl<S: Scalar, B: Scalar> Instances<S, B> {
    /// Of `placed` prototypes in the `order` of the tree's leaves, whose surfaces are numbered from `first` on.
    pub(super) fn new(
        prototypes: Vec<Geometry<S, B>>,
        placed: &[PlacedPrototype],
        order: &[u32],
        mut first: SurfaceId,
    ) -> Self {
        let mut all = Self { prototypes, rows: Vec::new(), owners: Vec::new() };
        for &row in order {
            let PlacedPrototype { number, place, owners, bounds, interior, .. } = &placed[row as usize];
            let geometry = &all.prototypes[*number as usize];
            let single = |v: DVec3| v.to_array().map(S::from_f64);
            let rows = |m: DMat3| [0, 1, 2].map(|k| single(m.row(k)));
            all.rows.push(Instance {
                prototype: *number,
                first,
                center: single(place.point(geometry.origin)),
                to_own: rows(place.inverse.matrix3),
                to_scene: rows(place.forward.matrix3),
                bounds: *bounds,
                interior: *interior,
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

    /// Bytes of the prototypes and of their places.
    pub(super) fn bytes(&self) -> usize {
        let prototypes: usize = self.prototypes.iter().map(Geometry::bytes).sum();
        prototypes + size_of_val(&self.rows[..]) + size_of_val(&self.owners[..])
    }

    /// Whose a surface of an instance is.
    pub(super) fn owner_of(&self, row: usize, surface: SurfaceId) -> u32 {
        let look = self.prototype_of(row).owner[self.own(row, surface)];
        self.owners[(self.rows[row].owners + look) as usize]
    }

    /// A surface's place among those of its instance.
    pub(super) fn place_of(&self, row: usize, surface: SurfaceId) -> u32 {
        self.prototype_of(row).ranks.of(self.own(row, surface) as SurfaceId)
    }

    /// True of a surface that is part of a composite and turned inside out there; `None` of what is no part of one.
    pub(super) fn is_inverted(&self, row: usize, surface: SurfaceId) -> Option<bool> {
        let prototype = self.prototype_of(row);
        let part = prototype.part_of(self.own(row, surface) as SurfaceId)?;
        Some(prototype.csg.parts[part as usize].inverted)
    }

    fn prototype_of(&self, row: usize) -> &Geometry<S, B> {
        &self.prototypes[self.rows[row].prototype as usize]
    }

    /// The number that a surface of an instance has in its prototype.
    fn own(&self, row: usize, surface: SurfaceId) -> usize {
        (surface - self.rows[row].first) as usize
    }
}

/// A prototype in one of its places, before there is a tree.
#[derive(Debug, Clone)]
pub(super) struct PlacedPrototype {
    /// Which.
    pub number: u32,
    /// From its own space to that of the scene's columns.
    pub place: Transform,
    /// That of its first surface.
    pub tag: Tag,
    /// By look.
    pub owners: Vec<u32>,
    /// Around it.
    pub bounds: Aabb,
    /// See [`Instance::interior`].
    pub interior: Option<u32>,
}

/// What of a scene is shared.
#[derive(Debug, Default)]
pub(super) struct Prototypes {
    pub all: Vec<Prototype>,
    /// By [`Original::address`].
    number: FxHashMap<usize, u32>,
    /// Surfaces that have been given numbers.
    surfaces: u64,
}

/// What stands in several places and is kept once.
#[derive(Debug)]
pub(super) struct Prototype {
    pub original: Original,
    /// How many looks it has: those of its parts, or of a mesh's triangles.
    pub looks: u32,
    /// Ranks that its surfaces take, one each at least.
    pub ranks: u32,
    /// Together around all its surfaces, in its own space.
    boxes: Vec<Aabb>,
}

/// Of what there are several.
#[derive(Debug, Clone)]
pub(super) enum Original {
    Mesh(Arc<Mesh>),
    /// Of which only the shape is meant: places and looks differ.
    Composite(Arc<Object>),
}

impl Original {
    /// Where it is looked up: the address of a mesh, or of a composite's first child.
    fn address(&self) -> usize {
        match self {
            Self::Mesh(mesh) => address(mesh),
            Self::Composite(object) => first_child(object).map_or(0, address),
        }
    }

    /// True if a mesh is this one.
    fn is_mesh(&self, mesh: &Arc<Mesh>) -> bool {
        matches!(self, Self::Mesh(original) if Arc::ptr_eq(original, mesh))
    }

    /// True if a composite is made of the same parts in the same way.
    fn is_shape_of(&self, object: &Object) -> bool {
        let Self::Composite(original) = self else { return false };
        match (&original.shape, &object.shape) {
            (Shape::Csg { op, children, .. }, Shape::Csg { op: other, children: others, .. }) => {
                let same = |(a, b)| Arc::ptr_eq(a, b);
                op == other && children.len() == others.len() && children.iter().zip(others).all(same)
            }
            _ => false,
        }
    }
}

fn first_child(object: &Object) -> Option<&Arc<Object>> {
    if let Shape::Csg { children, .. } = &object.shape { children.first() } else { None }
}

fn address<T>(of: &Arc<T>) -> usize {
    Arc::as_ptr(of) as usize
}

impl Prototypes {
    /// Those of `scene`.
    pub fn of(scene: &Scene, instancing: Instancing, meshes: &mut LooksOfMeshes) -> Self {
        if instancing == Instancing::Never {
            return Self::default();
        }
        let always = instancing == Instancing::Always;
        let mut prototypes = Self::default();
        for used in Uses::of(scene, u64::MAX).all {
            if used.places < 2 || used.size.shapes == 0 || !(always || used.is_worth_sharing()) {
                continue;
            }
            let prototype = Prototype::of(used.original, meshes);
            if prototype.boxes.iter().all(Aabb::is_finite) {
                prototypes.number.insert(prototype.original.address(), prototypes.all.len() as u32);
                prototypes.all.push(prototype);
            }
        }
        prototypes
    }

    /// The number of a mesh, if it is shared.
    pub fn mesh(&self, mesh: &Arc<Mesh>) -> Option<u32> {
        let number = *self.number.get(&address(mesh))?;
        self.all[number as usize].original.is_mesh(mesh).then_some(number)
    }

    /// That of a composite's shape.
    pub fn composite(&self, object: &Object) -> Option<u32> {
        let number = *self.number.get(&address(first_child(object)?))?;
        self.all[number as usize].original.is_shape_of(object).then_some(number)
    }

    /// A box around a prototype in its `place`, and the ranks that its surfaces take; they are given numbers, if there are any left.
    pub fn place(&mut self, number: u32, place: &Transform) -> Option<(Aabb, u32)> {
        let Prototype { ranks, boxes, .. } = &self.all[number as usize];
        let surfaces = self.surfaces + u64::from(*ranks);
        if surfaces > MOST_SURFACES {
            return None;
        }
        self.surfaces = surfaces;
        let corners = boxes.iter().flat_map(Aabb::corners);
        let bounds = Aabb::of(corners.map(|corner| place.point(corner))).inflated(BOUNDS_ROUNDINGS);
        // (What is moved beyond all measure is asked by every ray, and met by none.)
        Some((if bounds.is_finite() { bounds } else { Aabb::INFINITE }, *ranks))
    }
}

impl Prototype {
    /// Around all its surfaces, in its own space.
    pub fn bounds(&self) -> Aabb {
        self.boxes.iter().fold(Aabb::EMPTY, |all, one| all.union(*one))
    }

    fn of(original: Original, meshes: &mut LooksOfMeshes) -> Self {
        match &original {
            Original::Mesh(mesh) => {
                let (looks, ranks) = (meshes.of(mesh).count() as u32, mesh.triangles.len() as u32);
                let boxes = boxes_about(mesh.vertices.iter().map(|&at| Aabb { min: at, max: at }));
                Self { original, looks, ranks, boxes }
            }
            Original::Composite(object) => {
                let looks = count_looks(object, meshes);
                let Extents { bounds, parts, ranks } = Extents::of(object, looks, meshes);
                let boxes = match bounds.is_finite() {
                    true => boxes_about(parts.iter().filter(|part| !part.is_empty()).copied()),
                    false => vec![bounds],
                };
                Self { original, looks: looks as u32, ranks, boxes }
            }
        }
    }
}

/// How many looks the parts of `object` have.
fn count_looks(object: &Object, meshes: &mut LooksOfMeshes) -> usize {
    let mut count = 0;
    let own = match &object.shape {
        Shape::Mesh(mesh) => meshes.of(mesh).count(),
        Shape::Csg { children, .. } => {
            count += children.iter().map(|child| count_looks(child, meshes)).sum::<usize>();
            0
        }
        _ => 1,
    };
    count + own
}

impl PlacedPrototype {
    /// True if lengths change so much on the way to the prototype's space or back that their squares may be beyond single precision.
    pub fn is_extreme(&self) -> bool {
        let Transform { forward, inverse } = &self.place;
        let numbers = [forward, inverse].map(|map| map.matrix3.to_cols_array());
        numbers.as_flattened().iter().any(|x| x.abs() > LARGEST)
    }
}

/// See [`PlacedPrototype::is_extreme`].
const LARGEST: f64 = 1e12;

/// What corners are off by that were moved, as a share of the box around them.
const BOUNDS_ROUNDINGS: f64 = 16.0 * f64::EPSILON;

/// How many shapes a scene is when it is rendered, where what is shared counts once: `most` and more if they are more than `most`.
pub fn kept_shapes(scene: &Scene, most: u64) -> u64 {
    let Uses { all, mut shapes, .. } = Uses::of(scene, most);
    let mut surfaces = 0u64;
    for used in all {
        let one = used.size.shapes;
        let all = one.saturating_mul(used.places);
        let is_shared = used.is_worth_sharing();
        shapes = shapes.saturating_add(if is_shared { one } else { all });
        surfaces = surfaces.saturating_add(if is_shared { all } else { 0 });
    }
    shapes.saturating_add(surfaces.saturating_sub(MOST_SURFACES))
}

/// True if a mesh with its object's `texture` can be shared where it stands by itself.
///
/// It stops all light, or rays would have to be told which surfaces of a place they have gone through; an eye in it is asked for where
/// it is, which is no place that ends if it is a solid and `inverse`; and it has a look.
pub(super) fn mesh_can_be_shared(mesh: &Mesh, texture: Option<&Texture>, inverse: bool) -> bool {
    let is_endless = inverse && mesh.inside_vector.is_some();
    texture.is_some() && mesh.blocks_light(texture) && !is_endless
}

/// True if a composite can be shared where it stands by itself with the `textures` of its outside and inside: if all of it has a look,
/// stops all light and is seen by the same rays, and what cuts it is moved as its parts are.
pub(super) fn composite_can_be_shared(object: &Object, textures: [Option<&Texture>; 2]) -> bool {
    let is_composite = matches!(&object.shape, Shape::Csg { op, .. } if *op != CsgOp::Union);
    is_composite
        && object.clipped_by().is_empty()
        && !object.flags.is_turned()
        && parts_can_be_shared(object, textures)
}

fn parts_can_be_shared(object: &Object, textures: [Option<&Texture>; 2]) -> bool {
    let [texture, inside] = textures;
    match &object.shape {
        Shape::Csg { children, .. } => children.iter().all(|child| {
            let Flags { no_shadow, no_image, no_reflection, .. } = child.flags;
            let texture = child.texture.as_deref().or(texture);
            let inside = child.interior_texture().map(Arc::as_ref).or(inside);
            !no_shadow && !no_image && !no_reflection && parts_can_be_shared(child, [texture, inside])
        }),
        Shape::Mesh(mesh) => texture.is_some() && mesh.blocks_light(texture),
        // A triangle by itself has another front where it is mirrored.
        Shape::Triangle { .. } | Shape::Other(_) => false,
        _ => texture.is_some_and(Texture::is_opaque) && inside.is_none_or(Texture::is_opaque),
    }
}

/// What a scene is made of, as [`flatten`](super::flatten::flatten) finds it.
#[derive(Default)]
struct Uses {
    /// What can be shared, in the order in which it comes up.
    all: Vec<Use>,
    /// By [`Original::address`].
    number: FxHashMap<usize, usize>,
    /// All else, and what places of these take.
    shapes: u64,
    /// No more than these are counted.
    most: u64,
}

/// What can be shared, and in how many places.
struct Use {
    original: Original,
    size: Size,
    places: u64,
}

/// How large something is.
#[derive(Debug, Clone, Copy, Default)]
struct Size {
    /// Composites and primitives, triangles of meshes among them.
    shapes: u64,
    /// The same with meshes as one each: what each place takes.
    nodes: u64,
}

impl Size {
    /// That of `object`, without what clips it; more than `most` is not counted.
    fn of(object: &Object, most: u64) -> Self {
        let mut size = Self::default();
        size.add(object, most);
        size
    }

    fn add(&mut self, object: &Object, most: u64) {
        if self.shapes > most {
            return;
        }
        self.nodes += 1;
        match &object.shape {
            Shape::Mesh(mesh) => self.shapes += mesh.triangles.len() as u64,
            shape => {
                self.shapes += 1;
                if let Shape::Csg { children, .. } = shape {
                    for part in children.iter().flat_map(|child| child.clipped_by().iter().chain([child])) {
                        self.add(part, most);
                    }
                }
            }
        }
    }
}

impl Use {
    /// True if one tree for all places is worth what rays lose by it.
    fn is_worth_sharing(&self) -> bool {
        let Size { shapes, nodes } = self.size;
        let spared = shapes.saturating_sub(nodes).saturating_mul(self.places.saturating_sub(1));
        shapes >= LEAST_SURFACES && spared >= WORTH_SHARING
    }
}

impl Uses {
    fn of(scene: &Scene, most: u64) -> Self {
        let mut uses = Self { most, ..Self::default() };
        scene.objects.iter().for_each(|object| uses.count(object, [None; 2], false));
        uses
    }

    /// Counts an object with the `textures` of what it stands in, `cut` if that has surfaces which depend on each other.
    fn count(&mut self, object: &Arc<Object>, [texture, inside]: [Option<&Texture>; 2], cut: bool) {
        if self.shapes > self.most {
            return;
        }
        let texture = object.texture.as_deref().or(texture);
        let inside = object.interior_texture().map(Arc::as_ref).or(inside);
        let mut cut = cut || !object.clipped_by().is_empty();
        match &object.shape {
            Shape::Mesh(mesh) if !cut && mesh_can_be_shared(mesh, texture, object.flags.inverse) => {
                self.place(Original::Mesh(mesh.clone()), object, |original| original.is_mesh(mesh));
            }
            Shape::Csg { .. } if !cut && composite_can_be_shared(object, [texture, inside]) => {
                let original = Original::Composite(object.clone());
                self.place(original, object, |original| original.is_shape_of(object));
            }
            Shape::Mesh(mesh) => self.shapes = self.shapes.saturating_add(mesh.triangles.len() as u64),
            Shape::Csg { op, children, .. } => {
                cut |= *op != CsgOp::Union || object.flags.is_turned();
                self.shapes += 1;
                children.iter().for_each(|child| self.count(child, [texture, inside], cut));
            }
            _ => self.shapes += 1,
        }
        object.clipped_by().iter().for_each(|clip| self.count(clip, [texture, inside], true));
    }

    /// Counts a place of what can be shared, `object`, which is an original if it `is` none that is known.
    fn place(&mut self, original: Original, object: &Object, is: impl Fn(&Original) -> bool) {
        let number = *self.number.entry(original.address()).or_insert(self.all.len());
        let known = self.all.get(number).filter(|known| is(&known.original));
        let size = known.map_or_else(|| Size::of(object, self.most), |known| known.size);
        if number == self.all.len() {
            self.all.push(Use { original, size, places: 0 });
        } else if known.is_none() {
            // (Of two that begin with the same child one is shared.)
            self.shapes = self.shapes.saturating_add(size.shapes);
            return;
        }
        self.all[number].places += 1;
        self.shapes = self.shapes.saturating_add(size.nodes);
    }
}

/// The cells along each axis by which surfaces are boxed.
const CELLS: usize = 4;

/// Boxes that together hold all `surfaces`: moved one by one they are closer around what has been moved than the box of the whole would be.
fn boxes_about(surfaces: impl Iterator<Item = Aabb> + Clone) -> Vec<Aabb> {
    let whole = surfaces.clone().fold(Aabb::EMPTY, Aabb::union);
    let scale = CELLS as f64 / (whole.max - whole.min);
    let cell = |x: f64| (x as usize).min(CELLS - 1); // (NaN, of a flat mesh, is 0.)
    let mut boxes = vec![Aabb::EMPTY; CELLS * CELLS * CELLS];
    for surface in surfaces {
        let [x, y, z] = ((surface.center() - whole.min) * scale).to_array().map(cell);
        let around = &mut boxes[(x * CELLS + y) * CELLS + z];
        *around = around.union(surface);
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

    /// How many there are.
    pub fn count(&self) -> usize {
        1 + self.textures.len()
    }

    /// That of a triangle.
    pub fn of_triangle(&self, triangle: u32) -> u32 {
        self.of.get(triangle as usize).copied().unwrap_or(0)
    }
}

/// The looks of meshes, each looked for once.
#[derive(Debug, Default)]
pub(super) struct LooksOfMeshes {
    /// By address, of those that have several.
    known: FxHashMap<usize, Arc<MeshLooks>>,
    one: Arc<MeshLooks>,
}

impl LooksOfMeshes {
    /// Those of `mesh`.
    pub fn of(&mut self, mesh: &Arc<Mesh>) -> Arc<MeshLooks> {
        if mesh.textures.is_empty() {
            return self.one.clone();
        }
        self.known.entry(address(mesh)).or_insert_with(|| Arc::new(MeshLooks::of(mesh))).clone()
    }
}
