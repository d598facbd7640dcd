//! The tree over everything that has a finite box: eight children a node, boxes in lanes.
//!
//! It knows bounds, kinds and row numbers, and calls leaf code it is handed; it knows no kernel, colour or text.

mod binary;
mod build;
mod collapse;
mod node;
mod occupancy;
mod packet;
mod reinsert;
mod small;
mod walk;

#[cfg(test)]
mod tests;

pub use build::{Item, Preset, build};
pub use node::{Bvh, Child, Node, Run};
pub use occupancy::{Count, Occupancy, Tests};
pub use packet::Packet;
pub use walk::{Stack, Traversal, Visit, walk};
