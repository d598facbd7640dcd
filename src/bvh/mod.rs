//! The tree over everything that has a finite box: eight children a node, boxes in lanes.
//!
//! It knows bounds, kinds and row numbers, and calls leaf code it is handed; it knows no kernel, colour or text.

mod binary;
mod bounds;
mod build;
mod collapse;
mod eights;
mod emit;
mod extent;
mod filling;
mod group;
mod items;
mod node;
mod occupancy;
mod packet;
mod part;
mod reinsert;
mod single;
mod small;
mod stack;
mod stream;
mod visit;
mod walk;

#[cfg(test)]
mod tests;

pub use build::{Preset, build};
pub use eights::{GROUP, Packets, each_packet};
pub use items::{Item, Items};
pub use node::{Bvh, Child, Node, Run};
pub use occupancy::{Count, Occupancy, Tests};
pub use packet::Packet;
pub use stack::Stack;
pub use visit::Visit;
pub use walk::{Traversal, walk};
