//! From the scene's tree to columns: every primitive in the world's space (or the compiled scene's, see
//! [`Compiled::origin`]), one block per kind that is present, a tree over all of it, and a table of who owns what.
//!
//! What comes in is a [`Scene`]; what goes out is everything the waves need, and nothing they must decide per ray.

mod assemble;
mod columns;
mod flatten;
mod owner;
mod primitives;
mod shapes;

pub use columns::{Columns, Kind, WithBlock};
pub use owner::{Owner, class};
pub use primitives::Primitives;

use crate::bvh::{Bvh, Preset, Run};
use crate::csg::CsgTree;
use crate::lane::Scalar;
use crate::scene::{Camera, Color, Globals, Interior, Light, Scene};
use crate::texture::TextureTable;
use glam::DVec3;
use std::ops::Range;

/// The number of a surface: a plain primitive (its kind's base plus its row), or a part of a composite
/// ([`Compiled::first_part`] plus its number).
pub type SurfaceId = u32;

/// No surface: the ray started in free space, or hit nothing.
pub const NO_SURFACE: SurfaceId = u32::MAX;

/// Kind number of composites among the kinds of the tree's runs: one past the last kind with columns.
pub const COMPOSITE: u8 = Kind::ALL.len() as u8;

/// Set in the kind of a surface that is part of a composite.
pub const PART: u8 = 1 << 7;

/// A scene made ready for rays: primitives in precision `S`, boxes in precision `B`.
pub struct Compiled<S: Scalar, B: Scalar> {
    /// Subtracted from world coordinates before they become columns: zero in double precision; in single precision
    /// the middle of the scene, so that a scene far from the world's origin keeps its digits.
    pub origin: DVec3,
    /// Primitives that stand by themselves.
    pub columns: Columns<S>,
    /// First surface number of each kind.
    pub base: Vec<SurfaceId>,
    /// Parts of composites, always in double precision.
    pub parts: Columns<f64>,
    /// What the parts make up.
    pub csg: CsgTree,
    /// First surface number of a part.
    pub first_part: SurfaceId,
    /// By surface number: its kind; of parts with [`PART`] set.
    pub kinds: Vec<u8>,
    /// By surface number: index into `owners`.
    pub owner: Vec<u32>,
    /// By surface number: place in the order of declaration, for ties.
    pub rank: Vec<u32>,
    /// Unions that are one object though their parts stand by themselves, in order of declaration.
    pub bodies: Vec<Body>,
    /// Meshes that have an inside and are no parts of composites.
    pub mesh_bodies: Vec<MeshBody>,
    /// What belongs to whom.
    pub owners: Vec<Owner>,
    /// Colours.
    pub textures: TextureTable,
    /// By number; number 0 is air that no surface encloses.
    pub interiors: Vec<Interior>,
    /// Light fades in some interior.
    pub fades: bool,
    /// Without finite bounds: tested before the tree.
    pub unbounded: Vec<Run>,
    /// Over everything else.
    pub bvh: Bvh<B>,
    /// Union of the classes of all runs.
    pub classes: u8,
    /// In order of declaration.
    pub lights: Vec<Light>,
    /// The camera, in world space.
    pub camera: Camera,
    /// Settings.
    pub globals: Globals,
    /// What rays see that hit nothing.
    pub background: Color,
}

impl<S: Scalar, B: Scalar> Compiled<S, B> {
    /// Compiles `scene`.
    pub fn new(scene: &Scene) -> Self {
        Primitives::of(scene).compile(scene, Preset::default())
    }

    /// Bytes of the tree, of triangles' and spheres' columns, and of the tables by surface number.
    pub fn bytes(&self) -> usize {
        let columns: usize = Kind::ALL.iter().map(|&kind| self.columns.bytes(kind)).sum();
        let tables =
            size_of_val(&self.kinds[..]) + size_of_val(&self.owner[..]) + size_of_val(&self.rank[..]);
        self.bvh.bytes() + columns + tables
    }

    /// Kind and row of a surface that is no part of a composite.
    #[inline(always)]
    pub fn row_of(&self, surface: SurfaceId) -> (u8, u32) {
        let kind = self.kinds[surface as usize];
        (kind, surface - self.base[usize::from(kind)])
    }

    /// True if it has triangles, whose tests want a ray's view.
    pub fn has_triangles(&self) -> bool {
        self.columns.len(Kind::Triangle) + self.columns.len(Kind::SmoothTriangle) > 0
    }

    /// True if any run has a class of `filter`.
    pub fn has_class(&self, filter: u8) -> bool {
        self.classes & filter != 0
    }
}

/// A union that is one object to an eye in it.
#[derive(Debug, Clone)]
pub struct Body {
    /// Of its parts' surfaces.
    pub ranks: Range<u32>,
    /// What the eye is in.
    pub interior: u32,
}

/// A mesh that is one solid to an eye in it.
#[derive(Debug, Clone)]
pub struct MeshBody {
    /// Of its triangles.
    pub ranks: Range<u32>,
    /// What the eye is in.
    pub interior: u32,
    /// Inside and outside have changed places.
    pub inverse: bool,
}

/// Everything [`Compiled`] needs from the pass over the scene's tree.
struct Flat<S: Scalar> {
    columns: Columns<S>,
    parts: Columns<f64>,
    csg: CsgTree,
    /// By kind and row of `columns`: owner, rank and class.
    plain: Vec<Vec<Tag>>,
    /// By composite.
    composites: Vec<Tag>,
    /// By part.
    part_tags: Vec<Tag>,
    bodies: Vec<Body>,
    mesh_bodies: Vec<MeshBody>,
    owners: Vec<Owner>,
    textures: TextureTable,
    interiors: Vec<Interior>,
}

/// What is known of a primitive besides its geometry.
#[derive(Debug, Clone, Copy)]
struct Tag {
    owner: u32,
    rank: u32,
    class: u8,
}
