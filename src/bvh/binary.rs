//! Boxes to a tree of two children a node: binned surface-area heuristic (Wald 2007, On fast construction of SAH-based
//! bounding volume hierarchies), from the top down, each node's items parted in place.
//!
//! It knows boxes in single precision and what a test of their contents costs; not what the contents are.

use crate::lane::f32x8;
use wide::f32x4;

/// A box in single precision: the lowest corner in lanes 0 to 2, the highest one negated in lanes 4 to 6, so that the
/// box around two is their minimum. Lanes 3 and 7 hold two numbers that are the owner's business.
#[derive(Debug, Clone, Copy)]
#[repr(transparent)]
pub(super) struct Extent(f32x8);

impl Extent {
    /// Holds nothing.
    pub const EMPTY: Self = Self(f32x8::new([f32::INFINITY; 8]));

    /// From `low` to `high`.
    pub fn new([a, b, c]: [f32; 3], [d, e, f]: [f32; 3]) -> Self {
        Self(f32x8::new([a, b, c, 0.0, -d, -e, -f, 0.0]))
    }

    /// Around both; the owner's numbers become meaningless.
    #[inline(always)]
    pub fn around(self, other: Self) -> Self {
        Self(self.0.fast_min(other.0))
    }

    /// The same box with the owner's numbers.
    #[inline(always)]
    pub fn tagged(self, a: u32, b: u32) -> Self {
        let mut lanes = self.0.to_array();
        (lanes[3], lanes[7]) = (f32::from_bits(a), f32::from_bits(b));
        Self(f32x8::new(lanes))
    }

    /// The owner's numbers.
    #[inline(always)]
    pub fn tags(&self) -> (u32, u32) {
        let lanes = self.0.as_array();
        (lanes[3].to_bits(), lanes[7].to_bits())
    }

    /// Lowest and highest corner.
    pub fn corners(&self) -> [[f32; 3]; 2] {
        let [a, b, c, _, d, e, f, _] = *self.0.as_array();
        [[a, b, c], [-d, -e, -f]]
    }

    /// Half its surface.
    #[inline(always)]
    pub fn half_area(&self) -> f32 {
        let [low, negated] = self.halves();
        let [x, y, z, _] = (low + negated).to_array(); // Widths, negated; products of two do not mind.
        x * y + (y + x) * z
    }

    /// Lowest corner, and the highest one negated.
    #[inline(always)]
    fn halves(&self) -> [f32x4; 2] {
        bytemuck::cast(self.0)
    }

    /// Twice the middle.
    #[inline(always)]
    fn center(&self) -> f32x4 {
        let [low, negated] = self.halves();
        low - negated
    }

    /// Around a point.
    #[inline(always)]
    fn point(at: f32x4) -> Self {
        Self(bytemuck::cast([at, -at]))
    }
}

/// A tree of two children a node over reordered items, one in each leaf.
///
/// Nodes stand before their children, the first of which follows at once: the second is found by the count, since a node
/// over `n` items and all below it are `2 n - 1`. A node's numbers are its first item and how many it has; an item's are
/// its owner's number for it and the bits of its cost.
#[derive(Debug, Default)]
pub(super) struct Binary {
    pub nodes: Vec<Extent>,
    pub items: Vec<Extent>,
}

/// Nodes of at most so many items make do with half as many bins.
const FEW: usize = 32;
/// Subtrees over this many items are built side by side.
pub(super) const PARALLEL_OVER: usize = 4096;

impl Binary {
    /// Over `items` (at least one, at most 2^31), splits sought among `BINS` places an axis, or `HALF` as many where there
    /// are few items. The same tree on any number of threads.
    pub fn over<const BINS: usize, const HALF: usize>(mut items: Vec<Extent>) -> Self {
        let mut nodes = vec![Extent::EMPTY; 2 * items.len() - 1];
        split::<BINS, HALF>(&mut items, &mut nodes, 0);
        Self { nodes, items }
    }

    /// Where the second child of node `at` stands; `at` must not be a leaf.
    #[inline(always)]
    pub fn second(&self, at: usize) -> usize {
        second(&self.nodes, at)
    }
}

/// The same for a node and all below it.
#[inline(always)]
pub(super) fn second(nodes: &[Extent], at: usize) -> usize {
    at + 2 * nodes[at + 1].tags().1 as usize
}

fn split<const BINS: usize, const HALF: usize>(items: &mut [Extent], nodes: &mut [Extent], first: u32) {
    let (mut bounds, mut centers) = (Extent::EMPTY, Extent::EMPTY);
    for item in items.iter() {
        bounds = bounds.around(*item);
        centers = centers.around(Extent::point(item.center()));
    }
    nodes[0] = bounds.tagged(first, items.len() as u32);
    let at = match items.len() {
        1 => return,
        2 => 1,
        few if few <= FEW => partition::<HALF>(items, &centers),
        _ => partition::<BINS>(items, &centers),
    };
    let parallel = items.len() > PARALLEL_OVER;
    let (left, right) = items.split_at_mut(at);
    let (left_nodes, right_nodes) = nodes[1..].split_at_mut(2 * at - 1);
    let second = first + at as u32;
    if parallel {
        rayon::join(
            || split::<BINS, HALF>(left, left_nodes, first),
            || split::<BINS, HALF>(right, right_nodes, second),
        );
    } else {
        split::<BINS, HALF>(left, left_nodes, first);
        split::<BINS, HALF>(right, right_nodes, second);
    }
}

/// The bin of an item along each axis.
#[derive(Debug, Clone, Copy)]
struct Places {
    low: f32x4,
    scale: f32x4,
    last: f32x4,
}

impl Places {
    fn new<const BINS: usize>(centers: &Extent) -> Self {
        let [low, negated] = centers.halves();
        let width = -(low + negated);
        let scale = width.to_array().map(|width| {
            let scale = BINS as f32 / width;
            if scale.is_finite() && scale > 0.0 { scale } else { 0.0 }
        });
        Self { low, scale: f32x4::new(scale), last: f32x4::splat((BINS - 1) as f32) }
    }

    #[inline(always)]
    fn of(&self, item: &Extent) -> [i32; 4] {
        ((item.center() - self.low) * self.scale).fast_min(self.last).fast_trunc_int().to_array()
    }
}

/// Sorts items into two sides, neither empty, and says where the second begins.
fn partition<const BINS: usize>(items: &mut [Extent], centers: &Extent) -> usize {
    let places = Places::new::<BINS>(centers);
    let mut bins = [[Extent::EMPTY; BINS]; 3];
    let mut costs = [[0.0f32; BINS]; 3];
    for item in items.iter() {
        let place = places.of(item);
        let cost = f32::from_bits(item.tags().1);
        for axis in 0..3 {
            let k = place[axis] as usize % BINS;
            bins[axis][k] = bins[axis][k].around(*item);
            costs[axis][k] += cost;
        }
    }
    let mut best = (f32::INFINITY, 0, 0); // (cost, axis, first bin of the right side)
    for axis in 0..3 {
        let (bins, costs) = (&bins[axis], &costs[axis]);
        // Costs of the right sides from the end, then a sweep from the left. An empty side costs NaN.
        let mut right = [0.0; BINS];
        let (mut bounds, mut cost) = (Extent::EMPTY, 0.0);
        for k in (1..BINS).rev() {
            (bounds, cost) = (bounds.around(bins[k]), cost + costs[k]);
            right[k] = bounds.half_area() * cost;
        }
        let (mut bounds, mut cost) = (Extent::EMPTY, 0.0);
        for k in 1..BINS {
            (bounds, cost) = (bounds.around(bins[k - 1]), cost + costs[k - 1]);
            let both = bounds.half_area() * cost + right[k];
            if both < best.0 {
                best = (both, axis, k);
            }
        }
    }
    let (_, axis, first_right) = best;
    // Without a branch that could be guessed wrong: every item goes to the end of the left side, which grows or not.
    let mut at = 0;
    for k in 0..items.len() {
        let item = items[k];
        items.swap(k, at);
        at += usize::from((places.of(&item)[axis] as usize) < first_right);
    }
    // All middles coincide: no plane parts them, so part them by number.
    if at == 0 || at == items.len() { items.len() / 2 } else { at }
}
