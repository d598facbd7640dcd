//! The bounds of a composite's parts in eights, those of eights of them in eights again, and so on: what rays cannot meet of many
//! parts is left out with a few tests.

use super::BoundsBlock;
use crate::kernel::Aabb;
use crate::lane::LANES;
use std::ops::Range;

/// So many blocks are held against rays one by one.
const FEW_BLOCKS: usize = 8;

/// Where the bounds of one composite's parts stand among all.
#[derive(Debug, Clone, Default)]
pub struct BoxTree {
    /// Blocks, the finest first. Box `k` of a level's block `j` is around block `LANES * j + k` of the level before; of the first level,
    /// around the part that stands in that place.
    pub(super) levels: Vec<Range<u32>>,
    /// By place: parts, by their number in the composite; a stretch of all composites' places.
    pub(super) places: Range<u32>,
}

impl BoxTree {
    /// Over the `boxes` of parts, not all of which are closed, adding to the blocks and places of other composites.
    pub(super) fn over(
        boxes: &[Aabb],
        is_closed: impl Fn(usize) -> bool,
        (blocks, places): (&mut Vec<BoundsBlock>, &mut Vec<u32>),
    ) -> Self {
        let (first_place, first_block) = (places.len() as u32, blocks.len());
        let order = order_of(boxes);
        places.extend(&order);
        let mut level: Vec<Aabb> = order.iter().map(|&part| boxes[part as usize]).collect();
        let mut levels = Vec::new();
        loop {
            let first = blocks.len() as u32;
            blocks.extend(level.chunks(LANES).map(BoundsBlock::new));
            levels.push(first..blocks.len() as u32);
            if level.len() <= FEW_BLOCKS * LANES {
                break;
            }
            let around = |eight: &[Aabb]| eight.iter().fold(Aabb::EMPTY, |all, one| all.union(*one));
            level = level.chunks(LANES).map(around).collect();
        }
        for (block, eight) in blocks[first_block..].iter_mut().zip(order.chunks(LANES)) {
            let is_open = |k: usize| u8::from(!is_closed(eight[k] as usize)) << k;
            block.open = (0..eight.len()).map(is_open).sum();
        }
        Self { levels, places: first_place..places.len() as u32 }
    }
}

/// Boxes in an order in which those of a block lie close together, if there are many.
fn order_of(boxes: &[Aabb]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    if boxes.len() > FEW_BLOCKS * LANES {
        let mut unit = LANES;
        while unit * LANES < boxes.len() {
            unit *= LANES;
        }
        arrange(&mut order, boxes, unit);
    }
    order
}

/// Puts boxes in an order in which each stretch of `unit`, of an eighth of it, and so on down to eight, lies close together: halves
/// by their middles along the longest axis, again and again.
fn arrange(order: &mut [u32], boxes: &[Aabb], mut unit: usize) {
    while order.len() <= unit {
        unit /= LANES;
        if unit < LANES {
            return;
        }
    }
    // (Twice the middle; of boxes without an end some number, or none.)
    let middle = |&part: &u32| boxes[part as usize].min + boxes[part as usize].max;
    let finite = order.iter().map(middle).filter(|middle| middle.is_finite());
    let around = finite.fold(Aabb::EMPTY, |around, middle| around.union(Aabb { min: middle, max: middle }));
    let axis = if around.is_empty() { 0 } else { (around.max - around.min).max_position() };
    let half = order.len().div_ceil(unit) / 2 * unit;
    order.select_nth_unstable_by(half, |a, b| middle(a)[axis].total_cmp(&middle(b)[axis]).then(a.cmp(b)));
    let (low, high) = order.split_at_mut(half);
    arrange(low, boxes, unit);
    arrange(high, boxes, unit);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use glam::DVec3;

    #[test]
    fn every_part_has_a_place_and_eights_lie_close_together() {
        let mut numbers = Random::new(3);
        for count in [1, 8, 64, 65, 500, 4097] {
            let mut boxes: Vec<Aabb> = (0..count)
                .map(|_| {
                    let at = numbers.vector(1.0) * 10.0;
                    Aabb { min: at - DVec3::splat(0.01), max: at + DVec3::splat(0.01) }
                })
                .collect();
            boxes[0] = Aabb::INFINITE;
            let (mut blocks, mut places) = (Vec::new(), vec![7]);
            let tree = BoxTree::over(&boxes, |part| part % 3 > 0, (&mut blocks, &mut places));
            let own = &places[tree.places.start as usize..tree.places.end as usize];
            let mut sorted = own.to_vec();
            sorted.sort_unstable();
            assert!(sorted.into_iter().eq(0..count as u32));
            for (block, eight) in blocks.iter().zip(own.chunks(LANES)) {
                let is_open = |k: usize| eight.get(k).is_some_and(|part| part % 3 == 0);
                assert!((0..LANES).all(|k| (block.open >> k & 1 == 1) == is_open(k)));
            }
            for pair in tree.levels.windows(2) {
                assert_eq!(pair[1].len(), pair[0].len().div_ceil(LANES), "{count}");
            }
            let Some(coarsest) = tree.levels.last() else { panic!("no level") };
            assert!(coarsest.len() <= FEW_BLOCKS);
            if count > 64 {
                // Of a cube of 20 in width an eight holds a part, and no more than a part.
                let width = |eight: &[u32]| {
                    let around = eight.iter().fold(Aabb::EMPTY, |all, &one| all.union(boxes[one as usize]));
                    (around.max - around.min).element_product()
                };
                let finite = own.chunks(LANES).map(width).filter(|width| width.is_finite());
                let (sum, all) = (finite.clone().sum::<f64>(), finite.count() as f64);
                assert!(sum / all < 8000.0 * 2.0 * 8.0 / count as f64, "{count}: {}", sum / all);
            }
        }
    }
}
