//! What a world is made of: objects and their parts, each of which knows its place, its look and its interior.

use super::box_tree::{BoxTree, PartBox, Reach, Tally};
use super::interior::InteriorId;
use super::ray::Ray;
use crate::scene::{Flags, Object, Shape, Texture, Transform};
use smallvec::SmallVec;
use std::sync::Arc;

/// An object or a part of one.
pub struct Node {
    /// A shape or several.
    pub kind: NodeKind,
    /// Only what is inside all of these is there.
    pub clips: Vec<Node>,
    /// What is in it, unless its children say otherwise.
    pub interior: InteriorId,
    /// It is a union that is no more than its parts.
    pub split: bool,
    /// What clips it does not keep an eye out of it.
    pub open_to_eyes: bool,
}

/// A shape or several.
#[allow(clippy::large_enum_variant, reason = "most nodes are leaves")]
pub enum NodeKind {
    /// One shape.
    Leaf(Leaf),
    /// Several.
    Group {
        /// How they are joined.
        join: Join,
        /// In order of declaration.
        children: Vec<Node>,
        /// Which of them a line may meet, if somebody has taken the trouble to know.
        near: Option<Near>,
        /// A face cut into it can show the textures of this many of its children: all, or the first of a difference.
        cuttable: usize,
        /// Of faces of several children at one place the last one's is seen, else the first one's.
        last_shows: bool,
    },
}

/// What lines pass by in a group, and the state of what they pass by.
pub struct Near {
    tree: BoxTree,
    /// The children that a line is inside of which passes by them: those that are inside out.
    inside_out: Vec<bool>,
    /// How many those are.
    insides: usize,
}

/// How the children of a group are joined. Difference is an intersection whose other children are inside out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Join {
    /// Inside any; all surfaces.
    Union,
    /// Inside any; surfaces outside all others.
    Merge,
    /// Inside all; surfaces inside all others.
    Intersection,
}

/// A shape in the world.
pub struct Leaf {
    /// Counts all leaves of the world.
    pub id: usize,
    /// Whose shape it is.
    pub object: Arc<Object>,
    /// From that space to the world.
    pub to_world: Transform,
    /// Inside and outside have changed places.
    pub inverted: bool,
    /// False if it has no inside at all.
    pub solid: bool,
    /// A bound on its coordinates in the world: the size of the numbers its meetings are computed from.
    pub reach: f64,
    /// What its surface shows.
    pub look: Look,
    /// Which triangles of a mesh a line may meet, if that is known.
    pub triangles: Option<Arc<BoxTree>>,
}

/// What a leaf has of its own or from its ancestors.
#[derive(Clone)]
pub struct Look {
    /// `None` only on helpers such as clips, whose surfaces are never seen.
    pub texture: Option<PlacedTexture>,
    /// Seen from inside instead of `texture`.
    pub interior_texture: Option<PlacedTexture>,
    /// What is in it.
    pub interior: InteriorId,
    /// Its own and its ancestors' switches; what hides it from rays is asked of whole objects only.
    pub flags: Flags,
}

/// A texture, and the way from the world to its space.
#[derive(Clone)]
pub struct PlacedTexture {
    /// The layers.
    pub texture: Arc<Texture>,
    /// Takes the world's points to the texture's.
    pub from_world: Transform,
}

impl Leaf {
    /// In its own space.
    pub fn shape(&self) -> &Shape {
        &self.object.shape
    }
}

impl PlacedTexture {
    /// A texture that lives in the space which `to_world` leads from.
    pub fn new(texture: &Arc<Texture>, to_world: &Transform) -> Self {
        Self { texture: texture.clone(), from_world: texture.transform.then(to_world).inverted() }
    }
}

impl Near {
    /// Of children in boxes, as far as those are known, some of which are inside out.
    pub fn new(boxes: &[Option<PartBox>], inside_out: Vec<bool>, tally: &Tally) -> Self {
        let insides = inside_out.iter().filter(|&&inside_out| inside_out).count();
        Self { tree: BoxTree::new(boxes, 1, tally), inside_out, insides }
    }

    /// The children that a ray may meet.
    pub fn ahead_of(&self, ray: &Ray) -> SmallVec<[u32; 16]> {
        self.tree.met_by(ray.origin, ray.dir, Reach::Ahead)
    }

    /// The children that a line may meet, and how many of the others it is inside of, all the way.
    pub fn met_by(&self, ray: &Ray) -> (SmallVec<[u32; 16]>, usize) {
        let met = self.tree.met_by(ray.origin, ray.dir, Reach::Whole);
        let asked = met.iter().filter(|&&child| self.inside_out[child as usize]).count();
        (met, self.insides - asked)
    }
}
