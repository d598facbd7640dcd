//! Constructive geometry: which crossings of the parts are surfaces of the whole.
//!
//! Roth's method (1982, Ray casting for modeling solids), eight rays at a time: every part gives all its crossings,
//! also those behind the start, and *inside* is counted along the ray. No rounded point is ever tested for being
//! inside, so coincident faces do not speckle. POV-Ray's meaning is kept: a union keeps the surfaces inside it, a merge
//! does not, an intersection or difference keeps what bounds it.
//!
//! Most is decided in single precision, with bounds for what that may be off by: which part is met, and whether any is. Only the
//! crossing that is seen is then computed in double, and only lanes that are in doubt go the way of all crossings.
//!
//! This room knows parts by kind and row; it knows no colours and no tree over composites.

mod along;
mod asker;
mod best;
mod bites;
mod boxes;
mod bracket;
mod capsule;
mod carved;
mod cull;
mod decide;
mod long;
mod nearest;
mod node;
mod parts;
mod plan;
mod quadric;
mod question;
mod rule;
mod scratch;
mod single;
mod way_in;

pub use asker::Asker;
pub use best::Best;
pub use bites::Bites;
pub use boxes::BoxTree;
pub use bracket::Body;
pub use capsule::Capsules;
pub use cull::{BoundsBlock, Side, Stretch};
pub use long::LongList;
pub use node::{Composite, Constraint, CsgNode, CsgTree, NodeKind, Part, Surroundings};
pub use plan::{Plan, Rules};
pub use scratch::{PartRoots, Scratch};

use std::ops::Range;

/// What a range of numbers means of a list.
#[inline(always)]
fn slice<'a, T>(all: &'a [T], range: &Range<u32>) -> &'a [T] {
    &all[range.start as usize..range.end as usize]
}
