//! What goes into a tree: boxes in single precision, rounded outward as those of the finished tree are, in coordinates
//! scaled by a power of two: a scene scaled by one gives the same tree, and none is too large or too small.

use super::Bvh;
use super::extent::Extent;
use crate::kernel::Aabb;
use crate::lane::Scalar;
use crate::parallel;
use glam::DVec3;

/// One primitive to be put in the tree.
#[derive(Debug, Clone, Copy)]
pub struct Item {
    /// Finite.
    pub bounds: Aabb,
    /// Which columns it is a row of.
    pub kind: u8,
    /// Bits for [`Run::class`](super::Run::class).
    pub class: u8,
    /// Its row.
    pub index: u32,
    /// What it costs to test it too where rays go into a leaf, in box tests of a packet; kept to eight bits of mantissa.
    pub cost: f32,
}

/// Primitives of one tree: 32 bytes each.
#[derive(Debug, Clone)]
pub struct Items {
    /// Around all of them.
    pub(super) bounds: Aabb,
    /// Subtracted from coordinates: zero unless the middle of `bounds` is further off than they are wide; near the origin
    /// nothing is gained by moving it.
    pub(super) origin: DVec3,
    /// One of the extents' coordinates in scene units: a power of two.
    pub(super) unit: f64,
    /// With [`Tag`]s.
    pub(super) extents: Vec<Extent>,
    /// Some rows are in it piece by piece.
    pub(super) shared: bool,
}

impl Items {
    /// None yet, room for `capacity`. `bounds` must hold all that will come.
    pub fn within(bounds: Aabb, capacity: usize) -> Self {
        let (center, diagonal) = (bounds.center(), bounds.max - bounds.min);
        let far = center.is_finite() && center.length() > diagonal.length();
        let origin = if far { center } else { DVec3::ZERO };
        let reach = (bounds.min - origin).abs().max((bounds.max - origin).abs());
        let unit = power_of_two_over(reach.max_element());
        Self { bounds, origin, unit, extents: Vec::with_capacity(capacity), shared: false }
    }

    /// Adds one.
    #[inline(always)]
    pub fn push(&mut self, item: &Item) {
        let tag = Tag::new(item);
        self.extents.push(self.extent(item.bounds, tag));
    }

    /// Adds those of `item(0)` to `item(count - 1)` that have finite bounds; the rows of the others.
    pub fn extend(&mut self, count: usize, item: impl Fn(usize) -> Item + Send + Sync) -> Vec<u32> {
        let first = self.extents.len();
        let mut extents = std::mem::take(&mut self.extents);
        parallel::extend(&mut extents, count, |k| {
            let item = item(k);
            self.extent(item.bounds, Tag::new(&item))
        });
        self.extents = extents;
        let loose = |k: usize| !self.extents[first + k].is_finite();
        if !parallel::fold(count, false, loose, |a, b| a || b) {
            return Vec::new();
        }
        let (finite, loose): (Vec<_>, Vec<_>) =
            self.extents.drain(first..).partition(|extent| extent.is_finite());
        self.extents.extend(finite);
        loose.iter().map(|extent| Tag::of(extent).row).collect()
    }

    /// How many.
    pub fn len(&self) -> usize {
        self.extents.len()
    }

    /// True without any.
    pub fn is_empty(&self) -> bool {
        self.extents.is_empty()
    }

    /// Kind, row and half the surface (square scene units) of number `number`.
    pub fn at(&self, number: usize) -> (u8, u32, f64) {
        let extent = &self.extents[number];
        let tag = Tag::of(extent);
        (tag.kind(), tag.row, f64::from(extent.half_area()) * self.unit * self.unit)
    }

    /// Puts boxes that together hold it in the place of number `number`'s own. Its row stays one, and leaves share it.
    pub fn cut(&mut self, number: usize, pieces: &[Aabb]) {
        let tag = Tag::of(&self.extents[number]);
        let mut pieces = pieces.iter().map(|&piece| self.extent(piece, tag)).collect::<Vec<_>>().into_iter();
        if let Some(first) = pieces.next() {
            self.extents[number] = first;
        }
        self.shared |= pieces.len() > 0;
        self.extents.extend(pieces);
    }

    /// Whether more than a quarter of the boxes would be wider for the [slack](Bvh::slack) of precision `B` on either side than for
    /// what they are around.
    pub fn are_too_fine_for<B: Scalar>(&self) -> bool {
        let slack = self.slack::<B>().max_element() / self.unit;
        let narrow = |extent: &Extent| {
            let [low, high] = extent.corners();
            (0..3).all(|axis| f64::from(high[axis] - low[axis]) < 2.0 * slack)
        };
        let count = parallel::fold(self.len(), 0, |k| usize::from(narrow(&self.extents[k])), |a, b| a + b);
        4 * count > self.len()
    }

    /// [`Bvh::slack`] of the tree over them.
    pub(super) fn slack<B: Scalar>(&self) -> DVec3 {
        Bvh::<B>::slack(&self.moved_bounds())
    }

    /// `bounds` relative to `origin`.
    pub(super) fn moved_bounds(&self) -> Aabb {
        Aabb { min: self.bounds.min - self.origin, max: self.bounds.max - self.origin }
    }

    #[inline(always)]
    fn extent(&self, bounds: Aabb, tag: Tag) -> Extent {
        let scale = 1.0 / self.unit;
        let low = ((bounds.min - self.origin) * scale).to_array().map(down);
        let high = ((bounds.max - self.origin) * scale).to_array().map(|x| -down(-x));
        Extent::new(low, high).tagged(tag.row, tag.what)
    }
}

/// The two numbers in an item's extent.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tag {
    pub row: u32,
    /// The upper half of its cost's bits, then class, then kind.
    what: u32,
}

impl Tag {
    const COST: u32 = 0xffff_0000;

    fn new(item: &Item) -> Self {
        let cost = item.cost.to_bits().saturating_add(1 << 15) & Self::COST;
        Self { row: item.index, what: cost | u32::from(item.class) << 8 | u32::from(item.kind) }
    }

    #[inline(always)]
    pub fn of(extent: &Extent) -> Self {
        let (row, what) = extent.tags();
        Self { row, what }
    }

    pub fn kind(self) -> u8 {
        self.what as u8
    }

    pub fn class(self) -> u8 {
        (self.what >> 8) as u8
    }

    #[inline(always)]
    pub fn cost(self) -> f32 {
        f32::from_bits(self.what & Self::COST)
    }

    /// In the order of kind, class and row.
    #[inline(always)]
    pub fn key(self) -> u64 {
        u64::from(self.kind()) << 40 | u64::from(self.class()) << 32 | u64::from(self.row)
    }
}

/// The least power of two that is not less than `x`, within what can be divided by.
fn power_of_two_over(x: f64) -> f64 {
    let least = f64::MIN_POSITIVE * 16.0;
    x.log2().ceil().exp2().clamp(least, 1.0 / least)
}

/// The next number in single precision that is not greater.
#[inline(always)]
fn down(x: f64) -> f32 {
    let nearest = x as f32;
    if f64::from(nearest) > x { nearest.next_down() } else { nearest }
}
