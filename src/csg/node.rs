//! Composites as the walk along a ray needs them: flat lists instead of a tree of pointers.

use super::parts::{Few, Many};
use super::{Bites, BoundsBlock, BoxTree, Capsules, LongList, Plan, Rules, Side};
use crate::kernel::Aabb;
use rustc_hash::FxHashMap;
use std::ops::Range;

/// All composites of a scene.
#[derive(Debug, Clone, Default)]
pub struct CsgTree {
    /// One for each composite that stands in the scene's tree.
    pub composites: Vec<Composite>,
    /// Parts of all composites, each composite's together.
    pub parts: Vec<Part>,
    /// Boolean expressions over parts.
    pub nodes: Vec<CsgNode>,
    /// Lists of nodes that [`NodeKind`] and [`Constraint`] refer to.
    pub lists: Vec<u32>,
    /// What must hold for a part's crossing to be a surface, innermost first.
    pub constraints: Vec<Constraint>,
    /// Bounds of parts in eights: what [`BoxTree`] refers to.
    pub bounds: Vec<BoundsBlock>,
    /// In which order these have the parts: what [`BoxTree`] refers to.
    pub bounds_order: Vec<u32>,
    /// By node: its side for rays that meet no part.
    pub outside: Vec<Side>,
    /// By node: the parts of its composite that it is made of; the last stands for all that come after it, too.
    pub below: Vec<Many>,
    /// By where in [`CsgTree::lists`] it begins, what is known of a long list of nodes.
    pub long: FxHashMap<u32, LongList>,
    /// Parts that a composite lies within, composite by composite.
    pub required: Vec<u32>,
    /// Other nodes that it lies within.
    pub needed: Vec<u32>,
    /// What [`Plan::Few`] refers to.
    pub few: Rules<Few>,
    /// What [`Plan::Many`] refers to.
    pub many: Rules<Many>,
    /// What [`Plan`] refers to: around parts, each composite beginning a block.
    pub capsules: Vec<Capsules>,
    /// What [`Plan`] refers to: around parts that are cut out of others.
    pub bites: Bites,
}

/// One composite.
#[derive(Debug, Clone)]
pub struct Composite {
    /// Its parts.
    pub parts: Range<u32>,
    /// Its nodes, children before their parents.
    pub nodes: Range<u32>,
    /// Nothing of it is outside of these parts: a stretch of [`CsgTree::required`].
    pub required: Range<u32>,
    /// Nor of these nodes: a stretch of [`CsgTree::needed`].
    pub needed: Range<u32>,
    /// The bounds of its parts.
    pub boxes: BoxTree,
    /// Holds all its surfaces; infinite if nothing bounds it.
    pub bounds: Aabb,
    /// Holds its surfaces and its inside: lowest and highest corner, rounded outward.
    pub box_around: [[f32; 3]; 2],
    /// Only what meets this box is asked about it, as in POV-Ray, which bounds it by its surfaces: of a composite whose inside
    /// reaches beyond those (a disc's is a half space), else `None`.
    pub asked_within: Option<[[f32; 3]; 2]>,
    /// All parts are [`Part::closed`].
    pub closed: bool,
    /// The expression for the inside of the whole.
    pub root: u32,
    /// What an eye is in.
    pub surroundings: Surroundings,
    /// How it is decided in single precision, if it can be.
    pub plan: Option<Plan>,
}

/// What an eye is in that is in a composite.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings {
    /// Of these: all of the composite, or what there is of it before something clips it.
    pub node: u32,
    /// Holds that: lowest and highest corner, rounded outward.
    pub within: [[f32; 3]; 2],
    /// The composite's own.
    pub interior: u32,
}

/// A primitive that is part of a composite.
#[derive(Debug, Clone)]
pub struct Part {
    /// Which columns it is in.
    pub kind: u8,
    /// Its row.
    pub row: u32,
    /// Its node.
    pub node: u32,
    /// It has an inside; else only a surface (triangle, polygon, mesh without `inside_vector`).
    pub solid: bool,
    /// It has surfaces at which nothing is entered or left.
    pub partial_skin: bool,
    /// Its surface is its whole boundary.
    pub whole_skin: bool,
    /// It is turned inside out: its normal points the other way.
    pub inverted: bool,
    /// Holds its crossings and, if it has an inside, its inside; infinite if that has no end.
    pub bounds: Aabb,
    /// A ray that has passed its bounds is outside: true of all but the faces of meshes, each of which is entered
    /// or left by itself.
    pub closed: bool,
    /// Its crossings can be seen; false for what only clips.
    pub seen: bool,
    /// A bit for each kind of rays that sees them, if they see the composite.
    pub classes: u8,
    /// A stretch of [`CsgTree::constraints`].
    pub constraints: Range<u32>,
    /// Its composite's number.
    pub composite: u32,
}

/// The inside of a part or of several.
#[derive(Debug, Clone)]
pub struct CsgNode {
    /// Of what.
    pub kind: NodeKind,
    /// Inside and outside change places.
    pub inverted: bool,
    /// Of its children, the first so many lend their looks to cut faces: of a difference only what is cut.
    pub cuttable: usize,
}

/// How an inside is made of others.
#[derive(Debug, Clone)]
pub enum NodeKind {
    /// Of one part, by its number in the tree.
    Part(u32),
    /// Inside every one of a stretch of [`CsgTree::lists`].
    All(Range<u32>),
    /// Inside at least one.
    Any(Range<u32>),
    /// The same, of a merge: surfaces inside another child do not count.
    Merged(Range<u32>),
    /// Inside an odd number: the triangles of a closed mesh.
    Odd(Range<u32>),
}

/// What a composite does to the surfaces of one of its children.
#[derive(Debug, Clone)]
pub enum Constraint {
    /// They count where they are inside all children of an intersection but the one named: their own.
    Inside(Range<u32>, u32),
    /// They count where they are outside all children of a merge but their own.
    Outside(Range<u32>, u32),
    /// The child is turned inside out before its parent sees it.
    Inverted,
}
