//! From the scene's tree to columns: every primitive in the world's space (or the compiled scene's, see
//! [`Geometry::origin`]), one block per kind that is present, a tree over all of it, and a table of who owns what.
//!
//! Every surface has a number ([`SurfaceId`]): a plain primitive its kind's [base](Geometry::base) and its row, a part of a
//! composite [`Geometry::first_part`] and its own number, and after all these a surface of an instance the
//! [first](Instance::first) of it and its number in what stands there.
//!
//! What comes in is a [`Scene`]; what goes out is everything the waves need, and nothing they must decide per ray.

mod assemble;
mod columns;
mod composites;
mod flatten;
mod gathered;
mod geometry;
mod instances;
mod looks;
mod original;
mod owner;
mod primitives;
mod prototypes;
mod shapes;
mod tag;
mod uses;

pub use columns::{Columns, Kind, WithBlock};
pub use geometry::Geometry;
pub use instances::{Instance, Instances, Instancing};
pub use owner::{Owner, class};
pub use primitives::Primitives;
pub use uses::kept_shapes;

pub use crate::kernel::{NO_SURFACE, SurfaceId};

pub use crate::bvh::Preset;
use crate::lane::Scalar;
use crate::scene::{Camera, Color, Globals, Interior, Light, Scene};
use crate::texture::TextureTable;
use composites::Composites;
use instances::PlacedPrototype;
use std::ops::Range;
use tag::{Look, Tag, turn_ranks, turned_rank};

/// Kind number of composites among the kinds of the tree's runs: one past the last kind with columns.
pub const COMPOSITE: u8 = Kind::ALL.len() as u8;

/// Kind number of instances: after composites.
pub const INSTANCE: u8 = COMPOSITE + 1;

/// Set in the kind of a surface that is part of a composite.
pub const PART: u8 = 1 << 7;

/// A scene made ready for rays: primitives in precision `S`, boxes in precision `B`.
pub struct Compiled<S: Scalar, B: Scalar> {
    /// What rays meet.
    pub geometry: Geometry<S, B>,
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

/// A scene's primitives, in their own order.
#[derive(Default)]
struct Flat<S: Scalar> {
    columns: Columns<S>,
    /// By kind and row of `columns`: owner, rank and class.
    plain: Vec<Vec<Tag>>,
    composites: Composites,
    /// Where prototypes stand.
    placed: Vec<PlacedPrototype>,
}

/// What [`Compiled`] keeps of a scene's objects besides their geometry.
struct Objects {
    bodies: Vec<Body>,
    mesh_bodies: Vec<MeshBody>,
    owners: Vec<Owner>,
    textures: TextureTable,
    interiors: Vec<Interior>,
}
