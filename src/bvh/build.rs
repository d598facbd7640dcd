//! From boxes to a tree: two children a node (`binary`), bettered by moving subtrees where asked (`reinsert`), then
//! put together by eight (`collapse`) and written (`emit`).

use super::Bvh;
use super::binary::Binary;
use super::collapse::plan;
use super::emit::{Outline, emit};
use super::extent::Extent;
use super::items::{Items, Tag};
use super::reinsert::bettered;
use crate::lane::Scalar;

/// How much time a tree may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Preset {
    /// As little as possible: for previews of large scenes. (Long triangles are not cut, which spares most of the time where there are
    /// many; elsewhere it is as fast as the next.)
    Fast,
    /// What pays off within one picture.
    #[default]
    Balanced,
    /// What pays off over many.
    Best,
}

impl Preset {
    /// The tree of two children a node: splits sought among 8, 16 or 32 places an axis.
    fn binary(self, items: Vec<Extent>) -> Binary {
        let tree = match self {
            Self::Fast => Binary::over::<8, 8>(items),
            Self::Balanced => Binary::over::<16, 8>(items),
            Self::Best => Binary::over::<32, 16>(items),
        };
        if self.rounds() == 0 { tree } else { bettered(tree, self.rounds()) }
    }

    /// How often the whole tree is looked through for subtrees that would lie better elsewhere.
    fn rounds(self) -> usize {
        match self {
            Self::Fast | Self::Balanced => 0,
            Self::Best => 6,
        }
    }
}

/// The finished tree, and for each kind, of which there are `rows[kind]` rows in the columns, the new order of those that are
/// in the tree: row `k` must become the former row `order[kind][k]`.
pub fn build<B: Scalar>(items: Items, rows: &[usize], preset: Preset) -> (Bvh<B>, Vec<Vec<u32>>) {
    let (moved, slack) = (items.moved_bounds(), items.slack::<B>());
    let Items { bounds, origin, unit, extents, shared } = items;
    let mut tree = Bvh {
        nodes: Vec::new(),
        runs: Vec::new(),
        bounds,
        depth: 0,
        classes: extents.iter().fold(0, |classes, item| classes | Tag::of(item).class()),
        origin,
        entry: [[B::default(); 3]; 2],
        together: false,
    };
    if extents.is_empty() {
        return (tree, vec![Vec::new(); rows.len()]);
    }
    tree.entry = [moved.min - slack, moved.max + slack].map(|corner| corner.to_array().map(B::from_f64));

    let binary = preset.binary(extents);
    let plans = plan(&binary);
    let order = emit(&Outline { binary: &binary, plans: &plans, rows, shared, unit, slack }, &mut tree);
    (tree, order)
}
