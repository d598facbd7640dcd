//! What could be kept once of a scene, how large it is, and in how many places it stands.

use super::original::{Original, composite_can_be_shared, mesh_can_be_shared};
use crate::scene::{CsgOp, Object, Scene, Shape, Texture};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// Surfaces that are spared by sharing something, from which on it is shared.
const WORTH_SHARING: u64 = 1 << 16;
/// What has fewer is not: to go into it costs as much as to test it.
const LEAST_SURFACES: u64 = 64;
/// All surfaces have numbers in 32 bits, some of which mean something else: what goes beyond has its primitives in the scene's columns,
/// as far as there is room.
pub(super) const MOST_SURFACES: u64 = 1 << 31;

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

/// What a scene is made of, as [`flatten`](super::flatten::flatten) finds it.
#[derive(Default)]
pub(super) struct Uses {
    /// What can be shared, in the order in which it comes up.
    pub all: Vec<Use>,
    /// By [`Original::address`].
    number: FxHashMap<usize, usize>,
    /// All else, and what places of these take.
    shapes: u64,
    /// No more than these are counted.
    most: u64,
}

/// What can be shared, and in how many places.
pub(super) struct Use {
    pub original: Original,
    pub size: Size,
    pub places: u64,
}

/// How large something is.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Size {
    /// Composites and primitives, triangles of meshes among them.
    pub shapes: u64,
    /// The same with meshes as one each: what each place takes.
    nodes: u64,
}

impl Size {
    /// That of `object`; more than `most` is not counted.
    fn of(object: &Object, most: u64) -> Self {
        let mut size = Self::default();
        size.add(object, most);
        size
    }

    fn add(&mut self, object: &Object, most: u64) {
        if self.shapes > most {
            return;
        }
        object.clipped_by().iter().for_each(|clip| self.add(clip, most));
        self.nodes += 1;
        match &object.shape {
            Shape::Mesh(mesh) => self.shapes += mesh.triangles.len() as u64,
            shape => {
                self.shapes += 1;
                if let Shape::Csg { children, .. } = shape {
                    children.iter().for_each(|child| self.add(child, most));
                }
            }
        }
    }
}

impl Use {
    /// True if one tree for all places is worth what rays lose by it.
    pub fn is_worth_sharing(&self) -> bool {
        let Size { shapes, nodes } = self.size;
        let spared = shapes.saturating_sub(nodes).saturating_mul(self.places.saturating_sub(1));
        shapes >= LEAST_SURFACES && spared >= WORTH_SHARING
    }
}

impl Uses {
    /// Those in `scene`; more than `most` shapes are not counted.
    pub fn of(scene: &Scene, most: u64) -> Self {
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
            Shape::Mesh(mesh)
                if !cut && mesh_can_be_shared(mesh, texture.is_some(), object.flags.inverse) =>
            {
                self.place(Original::Mesh(mesh.clone()), object, |original| original.is_mesh(mesh));
            }
            Shape::Csg { .. } if !cut && composite_can_be_shared(object, [texture, inside], self.most) => {
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
