//! A node's items parted between two children, in place: where the surface-area heuristic finds it best among all ways to
//! part them (three or four), along the three axes (few), or at planes that cut the middles' bounds evenly (many: Wald
//! 2007, On fast construction of SAH-based bounding volume hierarchies).
//!
//! Large items may also be parted from small ones, wherever these lie. Each way says where the second child's items begin and
//! what lies around either's.

use super::extent::{Around, Extent};
use super::items::Tag;
use wide::f32x4;

/// Up to so many items every plane between two of them is tried.
pub(super) const FEW: usize = 8;

#[inline(always)]
fn cost_of(item: &Extent) -> f32 {
    Tag::of(item).cost()
}

/// `N` items, 3 or 4, the best of all ways to part them.
pub(super) fn exhausted<const N: usize>(items: &mut [Extent]) -> (usize, [Around; 2]) {
    // By the set of items, a bit each.
    let mut bounds = [Extent::EMPTY; 16];
    let mut costs = [0.0; 16];
    let mut weights = [0.0; 16];
    let all = (1usize << N) - 1;
    for set in 1..all {
        let last = set.ilog2() as usize;
        let rest = set ^ 1 << last;
        bounds[set] = bounds[rest].around(items[last]);
        costs[set] = costs[rest] + cost_of(&items[last]);
        weights[set] = bounds[set].half_area() * costs[set];
    }
    let (mut least, mut left) = (f32::INFINITY, 1);
    for set in 1..=all / 2 {
        let both = weights[set] + weights[all - set];
        if both < least {
            (least, left) = (both, set);
        }
    }
    let old: [Extent; N] = std::array::from_fn(|k| items[k]);
    let at = left.count_ones() as usize;
    let mut to = [0, at];
    for (k, item) in old.into_iter().enumerate() {
        let side = usize::from(left & 1 << k == 0);
        items[to[side]] = item;
        to[side] += 1;
    }
    (at, [left, all - left].map(|set| Around { bounds: bounds[set], centers: Extent::EMPTY }))
}

/// At most [`FEW`] items, parted between two neighbours by their middles along one of the axes.
pub(super) fn swept(items: &mut [Extent]) -> (usize, [Around; 2]) {
    let count = items.len();
    let mut old = [Extent::EMPTY; FEW];
    old[..count].copy_from_slice(items);
    let centers = [0, 1, 2].map(|axis| old.map(|item| item.center_along(axis)));
    let mut best = (f32::INFINITY, [0u8; FEW], 1, [Extent::EMPTY; 2]);
    for centers in &centers {
        let mut order = [0, 1, 2, 3, 4, 5, 6, 7u8];
        for k in 1..count {
            let (new, mut to) = (order[k], k);
            while to > 0 && centers[usize::from(order[to - 1])] > centers[usize::from(new)] {
                order[to] = order[to - 1];
                to -= 1;
            }
            order[to] = new;
        }
        let mut right = [(Extent::EMPTY, 0.0); FEW];
        let (mut bounds, mut cost) = (Extent::EMPTY, 0.0);
        for k in (1..count).rev() {
            let item = &old[usize::from(order[k])];
            (bounds, cost) = (bounds.around(*item), cost + cost_of(item));
            right[k] = (bounds, bounds.half_area() * cost);
        }
        let (mut bounds, mut cost) = (Extent::EMPTY, 0.0);
        for k in 1..count {
            let item = &old[usize::from(order[k - 1])];
            (bounds, cost) = (bounds.around(*item), cost + cost_of(item));
            let both = bounds.half_area() * cost + right[k].1;
            if both < best.0 {
                best = (both, order, k, [bounds, right[k].0]);
            }
        }
    }
    let (least, order, at, sides) = best;
    if least == f32::INFINITY {
        return halved(items);
    }
    for (item, number) in items.iter_mut().zip(order) {
        *item = old[usize::from(number)];
    }
    (at, sides.map(|bounds| Around { bounds, centers: Extent::EMPTY }))
}

/// By number: for items that no plane parts.
fn halved(items: &[Extent]) -> (usize, [Around; 2]) {
    let at = items.len() / 2;
    let around = |items: &[Extent]| items.iter().fold(Around::NOTHING, |around, &item| around.and(item));
    (at, [around(&items[..at]), around(&items[at..])])
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
        let place = (item.center() - self.low) * self.scale;
        place.fast_max(f32x4::ZERO).fast_min(self.last).fast_trunc_int().to_array()
    }
}

/// What lies in each bin, and what testing it costs, by axis.
#[derive(Clone, Copy)]
struct Bins<const BINS: usize> {
    bounds: [[Extent; BINS]; 3],
    costs: [[f32; BINS]; 3],
}

impl<const BINS: usize> Bins<BINS> {
    const EMPTY: Self = Self { bounds: [[Extent::EMPTY; BINS]; 3], costs: [[0.0; BINS]; 3] };

    /// Of items in these places.
    #[inline(always)]
    fn of(items: &[Extent], places: &Places) -> Self {
        let mut bins = Self::EMPTY;
        if items.len() < TWO_SETS_FROM {
            items.iter().for_each(|item| bins.add(item, places));
        } else {
            let mut odd = Self::EMPTY;
            let pairs = items.chunks_exact(2);
            pairs.remainder().iter().for_each(|item| bins.add(item, places));
            for pair in pairs {
                bins.add(&pair[0], places);
                odd.add(&pair[1], places);
            }
            bins.add_all(&odd);
        }
        bins
    }

    #[inline(always)]
    fn add(&mut self, item: &Extent, places: &Places) {
        let place = places.of(item);
        let cost = cost_of(item);
        for ((bounds, costs), place) in self.bounds.iter_mut().zip(&mut self.costs).zip(place) {
            let k = place as usize % BINS;
            bounds[k] = bounds[k].around(*item);
            costs[k] += cost;
        }
    }

    fn add_all(&mut self, other: &Self) {
        for axis in 0..3 {
            for k in 0..BINS {
                self.bounds[axis][k] = self.bounds[axis][k].around(other.bounds[axis][k]);
                self.costs[axis][k] += other.costs[axis][k];
            }
        }
    }

    /// What it costs to part them along the best axis, which that is, and the first bin of the second side; nothing if all are in one
    /// bin.
    fn best(&self) -> Option<(f32, usize, usize)> {
        let (mut least, mut best) = (f32::INFINITY, None);
        for axis in 0..3 {
            let (cost, first_right) = best_place(&self.bounds[axis], &self.costs[axis]);
            if cost < least {
                (least, best) = (cost, Some((cost, axis, first_right)));
            }
        }
        best
    }
}

/// Where a row of bins is best parted: what that costs, infinite if all is in one bin, and the first bin of the second side.
#[inline(always)]
fn best_place<const BINS: usize>(bins: &[Extent; BINS], costs: &[f32; BINS]) -> (f32, usize) {
    // Costs of the right sides from the end, then a sweep from the left. An empty side costs NaN.
    let mut right = [0.0; BINS];
    let (mut bounds, mut cost) = (Extent::EMPTY, 0.0);
    for k in (1..BINS).rev() {
        (bounds, cost) = (bounds.around(bins[k]), cost + costs[k]);
        right[k] = bounds.half_area() * cost;
    }
    let mut best = (f32::INFINITY, 1);
    let (mut bounds, mut cost) = (Extent::EMPTY, 0.0);
    for k in 1..BINS {
        (bounds, cost) = (bounds.around(bins[k - 1]), cost + costs[k - 1]);
        let both = bounds.half_area() * cost + right[k];
        if both < best.0 {
            best = (both, k);
        }
    }
    best
}

/// From so many items on every second one goes to bins of its own, since neighbours mostly share a bin and would wait for
/// each other.
const TWO_SETS_FROM: usize = 128;

/// `centers` holds the items' middles.
pub(super) fn binned<const BINS: usize>(items: &mut [Extent], centers: &Extent) -> (usize, [Around; 2]) {
    let places = Places::new::<BINS>(centers);
    let bins = Bins::<BINS>::of(items, &places);
    let Some((_, axis, first_right)) = bins.best() else { return tightened::<BINS>(items, centers) };
    // The same test as for the bins, to the last bit, or boxes would not hold their items.
    let (low, scale) = (places.low.to_array()[axis], places.scale.to_array()[axis]);
    let at = parted(items, |item| (item.center_along(axis) - low) * scale < first_right as f32);
    // Middles of the sides lie in the sides' boxes and on their side of the plane.
    let plane = low + first_right as f32 / scale;
    let mut sides = sides_of(&bins.bounds[axis], first_right, centers);
    sides[0].centers = sides[0].centers.below(axis, plane);
    sides[1].centers = sides[1].centers.above(axis, plane);
    (at, sides)
}

/// Puts the items first that go left; how many these are.
#[inline(always)]
fn parted(items: &mut [Extent], goes_left: impl Fn(&Extent) -> bool) -> usize {
    // Without a branch that could be guessed wrong: every item goes to the end of the left side, which grows or not.
    let mut at = 0;
    for k in 0..items.len() {
        let item = items[k];
        items.swap(k, at);
        at += usize::from(goes_left(&item));
    }
    at
}

/// Around the items of bins on either side; their middles lie among `centers`.
#[inline(always)]
fn sides_of(bins: &[Extent], first_right: usize, centers: &Extent) -> [Around; 2] {
    [&bins[..first_right], &bins[first_right..]].map(|bins| {
        let bounds = bins.iter().fold(Extent::EMPTY, |bounds, bin| bounds.around(*bin));
        Around { bounds, centers: bounds.twice().common(*centers) }
    })
}

/// Sizes told apart, by powers of four of their areas from the whole node's on down.
const SIZES: usize = 16;

/// The large items first, if that is better than to part them at a plane: what is built on a wide ground falls into few bins
/// beside it, and whichever side the ground goes to is as wide as all.
#[cold]
#[inline(never)]
pub(super) fn by_size<const BINS: usize>(
    items: &mut [Extent],
    around: &Around,
) -> Option<(usize, [Around; 2])> {
    // Half of the exponent: the upper bits, as areas have no sign.
    let power_of_four = |extent: &Extent| extent.half_area().to_bits() >> 24;
    let whole = power_of_four(&around.bounds);
    let place = |item: &Extent| (whole.saturating_sub(power_of_four(item)) as usize).min(SIZES - 1);
    let (mut bins, mut costs) = ([Extent::EMPTY; SIZES], [0.0; SIZES]);
    for item in &*items {
        let k = place(item);
        bins[k] = bins[k].around(*item);
        costs[k] += cost_of(item);
    }
    let (cost, first_right) = best_place(&bins, &costs);
    let places = Places::new::<BINS>(&around.centers);
    let (at_plane, ..) = Bins::<BINS>::of(items, &places).best()?;
    (cost < at_plane).then(|| {
        let at = parted(items, |item| place(item) < first_right);
        (at, sides_of(&bins, first_right, &around.centers))
    })
}

/// For items that all fall into one bin: `centers` may hold more than their middles.
fn tightened<const BINS: usize>(items: &mut [Extent], centers: &Extent) -> (usize, [Around; 2]) {
    let tight = items.iter().fold(Around::NOTHING, |around, &item| around.and(item)).centers;
    if tight.corners() == centers.corners() { halved(items) } else { binned::<BINS>(items, &tight) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn a_wide_ground_is_parted_from_what_stands_on_it() {
        let mut numbers = Random::new(3);
        let mut small = || {
            let at = numbers.vector(1.0).to_array().map(|x| x as f32);
            Extent::new(at, at.map(|x| x + 0.1)).tagged(0, 1f32.to_bits())
        };
        let ground =
            |half: f32| Extent::new([-half, -1.0, -half], [half, -1.0, half]).tagged(0, 1f32.to_bits());
        let around = |items: &[Extent]| items.iter().fold(Around::NOTHING, |around, &item| around.and(item));
        let mut items: Vec<Extent> = (0..100).map(|_| small()).collect();
        let alike = around(&items);
        assert!(by_size::<16>(&mut items, &alike).is_none());
        for half in [1000.0, 900.0] {
            items.insert(50, ground(half));
        }
        let all = around(&items);
        let (at, [large, rest]) = by_size::<16>(&mut items, &all).unwrap();
        assert_eq!((at, large.bounds.corners()), (2, ground(1000.0).corners()));
        assert!(items[..at].iter().all(|item| item.half_area() > 1e6));
        assert_eq!(rest.bounds.corners(), alike.bounds.corners());
    }
}
