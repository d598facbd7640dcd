//! Long lists of nodes, of which rays meet few.

use super::{CsgTree, NodeKind, Side, slice};
use std::ops::Range;

/// Lists of so many nodes are cut down to those that rays may be in, once for all places that are asked about.
pub(super) const LONG: usize = 32;

/// What finds the nodes of a list that matter.
#[derive(Debug, Clone)]
pub struct LongList {
    /// The first of the parts that the nodes are made of,
    first_part: u32,
    /// and by part from there on the node that it belongs to, or `u32::MAX`.
    node: Vec<u32>,
    /// The nodes that rays may be in which meet none of their parts.
    always: Vec<u32>,
}

impl LongList {
    /// Of `list`.
    pub(super) fn of(tree: &CsgTree, list: &Range<u32>) -> Self {
        let (mut parts, mut always) = (Vec::new(), Vec::new());
        for &node in tree.list(list) {
            if tree.outside[node as usize] != Side::Outside {
                always.push(node);
            }
            let mut waiting = vec![node];
            while let Some(below) = waiting.pop() {
                match &tree.nodes[below as usize].kind {
                    NodeKind::Part(part) => parts.push((*part, node)),
                    NodeKind::All(list)
                    | NodeKind::Any(list)
                    | NodeKind::Merged(list)
                    | NodeKind::Odd(list) => waiting.extend(slice(&tree.lists, list)),
                }
            }
        }
        let first_part = parts.iter().map(|(part, _)| *part).min().unwrap_or(0);
        let count = parts.iter().map(|(part, _)| part - first_part + 1).max().unwrap_or(0);
        let mut node = vec![u32::MAX; count as usize];
        for (part, of) in parts {
            node[(part - first_part) as usize] = of;
        }
        Self { first_part, node, always }
    }

    /// Adds to `found` the nodes that matter to rays which meet these parts, each once.
    pub(super) fn within_reach(&self, near: impl Iterator<Item = u32>, found: &mut Vec<u32>) {
        let first = found.len();
        found.extend(&self.always);
        let node = |part: u32| self.node.get(part.checked_sub(self.first_part)? as usize).copied();
        found.extend(near.filter_map(node).filter(|node| *node != u32::MAX));
        found[first..].sort_unstable();
        let mut kept = first;
        for k in first..found.len() {
            if kept == first || found[k] != found[kept - 1] {
                found[kept] = found[k];
                kept += 1;
            }
        }
        found.truncate(kept);
    }
}
