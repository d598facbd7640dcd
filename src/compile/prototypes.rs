//! Of what a scene keeps one for all places, as far as looks and numbers allow.

use super::Instancing;
use super::composites::Extents;
use super::looks::LooksOfMeshes;
use super::original::{Original, address, first_child};
use super::uses::Uses;
use crate::kernel::Aabb;
use crate::scene::{Mesh, Object, Scene, Transform};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// What of a scene is shared.
#[derive(Debug, Default)]
pub(super) struct Prototypes {
    pub all: Vec<Prototype>,
    /// By [`Original::address`].
    number: FxHashMap<usize, u32>,
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
}

impl Prototype {
    /// Around all its surfaces, in its own space.
    pub fn bounds(&self) -> Aabb {
        self.boxes.iter().fold(Aabb::EMPTY, |all, one| all.union(*one))
    }

    /// Around them in a place.
    pub fn bounds_in(&self, place: &Transform) -> Aabb {
        if self.boxes.is_empty() {
            return Aabb::EMPTY; // Its parts nowhere meet.
        }
        let corners = self.boxes.iter().flat_map(Aabb::corners);
        let bounds = Aabb::of(corners.map(|corner| place.point(corner))).inflated(BOUNDS_ROUNDINGS);
        // (What is moved beyond all measure is asked by every ray, and met by none.)
        if bounds.is_finite() { bounds } else { Aabb::INFINITE }
    }

    fn of(original: Original, meshes: &mut LooksOfMeshes) -> Self {
        match &original {
            Original::Mesh(mesh) => {
                let (looks, ranks) = (meshes.of(mesh).count() as u32, mesh.triangles.len() as u32);
                let boxes = boxes_about(mesh.vertices.iter().map(|&at| Aabb { min: at, max: at }));
                Self { original, looks, ranks, boxes }
            }
            Original::Composite(object) => {
                let Extents { bounds, parts, looks, ranks } = Extents::of(object, meshes);
                let boxes = match bounds.is_finite() {
                    true => boxes_about(parts.iter().filter(|part| !part.is_empty()).copied()),
                    false => vec![bounds],
                };
                Self { original, looks, ranks, boxes }
            }
        }
    }
}

/// What corners are off by that were moved, as a share of the box around them.
const BOUNDS_ROUNDINGS: f64 = 16.0 * f64::EPSILON;

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
