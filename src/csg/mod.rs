//! Constructive geometry: which crossings of the parts are surfaces of the whole.
//!
//! Roth's method (1982, Ray casting for modeling solids), eight rays at a time: every part gives all its crossings,
//! also those behind the start, and *inside* is counted along the ray. No rounded point is ever tested for being
//! inside, so coincident faces do not speckle. POV-Ray's meaning is kept: a union keeps the surfaces inside it, a merge
//! does not, an intersection or difference keeps what bounds it.
//!
//! This room knows parts by kind and row; it knows no colours and no tree over composites.

mod cull;
mod nearest;
mod node;

pub use cull::{BoundsBlock, Side, Stretch};
pub use nearest::{Best, PartRoots, Scratch};
pub use node::{Composite, Constraint, CsgNode, CsgTree, NodeKind, Part};
