//! The looks of meshes.

use crate::scene::Mesh;
use rustc_hash::FxHashMap;
use std::sync::Arc;

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
        self.known.entry(Arc::as_ptr(mesh) as usize).or_insert_with(|| Arc::new(MeshLooks::of(mesh))).clone()
    }
}
