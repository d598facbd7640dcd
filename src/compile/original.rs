//! What there may be several of, and what of it can be kept once.

use crate::scene::{CsgOp, Flags, Mesh, Object, Shape, Texture};
use std::sync::Arc;

/// Of what there are several.
#[derive(Debug, Clone)]
pub(super) enum Original {
    Mesh(Arc<Mesh>),
    /// Of which only the shape is meant: places and looks differ.
    Composite(Arc<Object>),
}

impl Original {
    /// Where it is looked up: the address of a mesh, or of a composite's first child.
    pub fn address(&self) -> usize {
        match self {
            Self::Mesh(mesh) => address(mesh),
            Self::Composite(object) => first_child(object).map_or(0, address),
        }
    }

    /// True if a mesh is this one.
    pub fn is_mesh(&self, mesh: &Arc<Mesh>) -> bool {
        matches!(self, Self::Mesh(original) if Arc::ptr_eq(original, mesh))
    }

    /// True if a composite is made of the same parts in the same way.
    pub fn is_shape_of(&self, object: &Object) -> bool {
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

pub(super) fn first_child(object: &Object) -> Option<&Arc<Object>> {
    if let Shape::Csg { children, .. } = &object.shape { children.first() } else { None }
}

/// What tells meshes and objects apart.
pub(super) fn address<T>(of: &Arc<T>) -> usize {
    Arc::as_ptr(of) as usize
}

/// True if a mesh can be shared where it stands by itself: it `has_look`, and an eye in it is asked for where it is, which is no place
/// that ends if it is a solid and `inverse`.
pub(super) fn mesh_can_be_shared(mesh: &Mesh, has_look: bool, inverse: bool) -> bool {
    let is_endless = inverse && mesh.inside_vector.is_some();
    has_look && !is_endless
}

/// True if a composite can be shared where it stands by itself with the `textures` of its outside and inside: if all of it has a look,
/// stops all light (crossings with a composite are found and settled as a whole) and is seen by the same rays, what cuts it is moved
/// as its parts are, and it ends somewhere. Of one of more nodes than `most` nothing is said.
pub(super) fn composite_can_be_shared(object: &Object, textures: [Option<&Texture>; 2], most: u64) -> bool {
    let is_composite = matches!(&object.shape, Shape::Csg { op, .. } if *op != CsgOp::Union);
    is_composite
        && object.clipped_by().is_empty()
        && !object.flags.is_turned()
        && parts_can_be_shared(object, textures, &mut { most })
        && !object.is_endless()
}

/// The same of its parts, of which no more are asked than are `left`.
fn parts_can_be_shared(object: &Object, [texture, inside]: [Option<&Texture>; 2], left: &mut u64) -> bool {
    let Some(fewer) = left.checked_sub(1) else { return false };
    *left = fewer;
    match &object.shape {
        Shape::Csg { children, .. } => children.iter().all(|child| {
            let Flags { no_shadow, no_image, no_reflection, .. } = child.flags;
            let texture = child.texture.as_deref().or(texture);
            let inside = child.interior_texture().map(Arc::as_ref).or(inside);
            !no_shadow && !no_image && !no_reflection && parts_can_be_shared(child, [texture, inside], left)
        }),
        Shape::Mesh(mesh) => texture.is_some() && mesh.blocks_light(texture),
        // A triangle by itself has another front where it is mirrored.
        Shape::Triangle { .. } | Shape::Other(_) => false,
        _ => texture.is_some_and(Texture::is_opaque) && inside.is_none_or(Texture::is_opaque),
    }
}
