//! Triangles in bulk.

use super::Texture;
use glam::DVec3;
use std::sync::Arc;

/// A `mesh` or `mesh2`, in the object's own space.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Corners.
    pub vertices: Vec<DVec3>,
    /// Unit normals for smooth triangles.
    pub normals: Vec<DVec3>,
    /// What [`MeshTriangle::textures`] index; in the mesh's own space.
    pub textures: Vec<Arc<Texture>>,
    /// The triangles.
    pub triangles: Vec<MeshTriangle>,
    /// Makes the mesh a solid: a point is inside if a ray in this direction crosses the mesh an odd number of times.
    pub inside_vector: Option<DVec3>,
}

/// Three corners, and what they share.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshTriangle {
    /// Indices into [`Mesh::vertices`].
    pub vertices: [u32; 3],
    /// Indices into [`Mesh::normals`], one a corner; `None` is flat.
    pub normals: Option<[u32; 3]>,
    /// Indices into [`Mesh::textures`], one a corner, blended between; `None` is the mesh's own texture.
    pub textures: Option<[u32; 3]>,
}

impl Mesh {
    /// Whether it stops all light, being textured with `own`, its object's texture (`None`: POV-Ray's default).
    ///
    /// POV-Ray asks a mesh's textures, used or not, but not its `interior_texture`: light that meets a clear one from
    /// inside is stopped where the others are opaque. Of other shapes it asks the texture that is met. (Measured in 3.7.)
    pub fn blocks_light(&self, own: Option<&Texture>) -> bool {
        own.is_none_or(Texture::is_opaque) && self.textures.iter().all(|texture| texture.is_opaque())
    }
}
