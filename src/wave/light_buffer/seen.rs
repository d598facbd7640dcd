//! What the light sees through each face of its cube.

use super::Face;
use super::casters::Caster;
use super::raster::{CELL_ROUNDING, EDGE, axes};
use super::sheet::Figures;
use crate::lane::Quad;
use glam::DVec3;
use wide::f64x4;

/// A caster as the light sees it through one face.
pub(super) struct Outline {
    /// Least and greatest coordinate across and up, at depth 1.
    pub across: [f64; 2],
    pub up: [f64; 2],
    /// Least depth.
    pub near: f64,
}

/// What is farther across than this, in its depth, is beside a face for certain: told without a division, as most boxes are beside most
/// faces.
const BESIDE: f64 = EDGE * (1.0 + 1e-12);

/// A box relative to the light, as it lies before a face: least and greatest.
pub(super) struct Sides {
    /// Along the face's axis.
    pub depths: [f64; 2],
    /// Across and up.
    pub sides: [[f64; 2]; 2],
}

impl Outline {
    /// Of a box from `min` to `max` relative to the light, which is outside of it; `None` if it is not seen through
    /// `face`.
    pub fn through(face: usize, min: DVec3, max: DVec3) -> Option<Self> {
        let through = Sides::through(face, min, max);
        let Sides { depths: [nearest, farthest], sides } = through;
        if farthest <= 0.0 {
            return None;
        }
        // Within the face nothing is farther across than along.
        let off = |[low, high]: [f64; 2]| if low > 0.0 { low } else { (-high).max(0.0) };
        let off = off(sides[0]).max(off(sides[1]));
        if off > farthest * BESIDE {
            return None;
        }
        let near = nearest.max(off / EDGE);
        if near <= 0.0 || near > farthest {
            return None;
        }
        let [across, up] = through.seen([near, farthest]).map(|[low, high]| [low.max(-EDGE), high.min(EDGE)]);
        Some(Self { across, up, near })
    }

    /// The cells it is seen through: first and last column, first and last row.
    pub fn cells(&self, face: &Face) -> [[u32; 2]; 2] {
        [face.range(0, self.across, CELL_ROUNDING), face.range(1, self.up, CELL_ROUNDING)]
    }
}

impl Sides {
    /// Of a box from `min` to `max` relative to the light.
    pub fn through(face: usize, min: DVec3, max: DVec3) -> Self {
        let (along, across, up, backward) = axes(face);
        let depths = if backward { [-max[along], -min[along]] } else { [min[along], max[along]] };
        Self { depths, sides: [across, up].map(|axis| [min[axis], max[axis]]) }
    }

    /// Where, across and up at depth 1, is seen what lies between these depths.
    pub fn seen(&self, [near, far]: [f64; 2]) -> [[f64; 2]; 2] {
        self.sides.map(|[low, high]| {
            [low / if low < 0.0 { near } else { far }, high / if high > 0.0 { near } else { far }]
        })
    }

    /// The least depth at which the box's side number `side` can be met in cell number `cell` along it.
    pub fn depth_in(&self, side: usize, cell: u32, face: &Face) -> f64 {
        let [low, high] = self.sides[side];
        let (first, last) = (f64::from(cell) - CELL_ROUNDING, f64::from(cell + 1) + CELL_ROUNDING);
        if low > 0.0 {
            let last = face.place(side, last);
            if last > 0.0 { low / last } else { f64::INFINITY }
        } else if high < 0.0 {
            let first = face.place(side, first);
            if first < 0.0 { high / first } else { f64::INFINITY }
        } else {
            0.0
        }
    }
}

/// Something that is seen through a face, and how far it reaches there. (All that a light sees is kept until the cells are laid
/// out: it is small, and the rest is told again tile by tile.)
#[derive(Debug, Clone, Copy)]
pub(super) struct Glimpse {
    /// Whatever it is known by.
    pub what: u64,
    /// Least and greatest coordinate across and up, at depth 1: from [`Seen::origin`] on, as what is far away is seen in a small part of
    /// the face.
    sides: [[f32; 2]; 2],
}

impl Glimpse {
    /// First and last column, first and last row of cells that it may be seen through; a hair more than those of which
    /// [`Outline::cells`] and [`Figures::each_facet`] tell.
    pub fn cells(&self, origin: [f64; 2], face: &Face) -> [[u32; 2]; 2] {
        [0, 1].map(|side| {
            // The face is so many columns wide at most that single precision is off by less than one rounding of cells.
            let [low, high] = self.sides[side].map(|x| f64::from(x) + origin[side]);
            face.range(side, [low, high], 2.0 * CELL_ROUNDING)
        })
    }
}

/// What is seen through one face.
#[derive(Default)]
pub(super) struct Seen {
    /// Casters: their number, below how near they are (see [`named`]).
    pub outlines: Vec<Glimpse>,
    /// Triangles by fours: see [`Four`].
    pub fours: Vec<Glimpse>,
    /// Where coordinates count from: some place that something is seen at.
    pub origin: [f64; 2],
    /// How many of the triangles will be facets.
    count: usize,
    /// Around all of it: ranges across and up.
    frame: [[f64; 2]; 2],
    /// Sums over the facets: width by height, width and height.
    area: f64x4,
    girth: f64x4,
}

/// Four triangles in a row of their columns, some of which are seen through one face.
#[derive(Debug, Clone, Copy)]
pub(super) struct Four {
    /// Number of their kind in [`Casters::triangles`](super::Casters).
    pub kind: usize,
    /// A bit for each that is seen.
    pub lanes: u8,
    pub four: u32,
}

impl Four {
    /// As [`Glimpse::what`].
    pub fn packed(self) -> u64 {
        (self.kind as u64) << 40 | u64::from(self.lanes) << 32 | u64::from(self.four)
    }

    /// Of [`Four::packed`].
    pub fn of(packed: u64) -> Self {
        Self { kind: (packed >> 40) as usize, lanes: (packed >> 32) as u8, four: packed as u32 }
    }
}

/// A caster as [`Glimpse::what`]: its number below how near it is, so that these are in the order of depths.
fn named(number: u32, near: f64) -> u64 {
    u64::from((near as f32).to_bits()) << u32::BITS | u64::from(number)
}

/// A caster's number.
pub(super) fn number_of(named: u64) -> usize {
    named as u32 as usize
}

impl Seen {
    /// Nothing, as before anything was added.
    pub fn clear(&mut self) {
        self.outlines.clear();
        self.fours.clear();
        (self.count, self.area, self.girth) = (0, f64x4::splat(0.0), f64x4::splat(0.0));
        self.frame = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    }

    /// How many.
    pub fn len(&self) -> usize {
        self.outlines.len() + self.count
    }

    /// Ranges across and up that hold all of it.
    pub fn frame(&self) -> Option<[[f64; 2]; 2]> {
        (self.frame[0][0] <= self.frame[0][1]).then_some(self.frame)
    }

    /// How many cells facets are drawn into, on average.
    pub fn faceted(&self, face: &Face) -> f64 {
        let [area, girth] = [self.area, self.girth].map(|sums| Quad::to_array(sums).iter().sum::<f64>());
        area * face.scale * face.scale + girth * face.scale + self.count as f64
    }

    /// How many cells all else is drawn into.
    pub fn outlined(&self, face: &Face) -> f64 {
        let count = |[first, last]: [u32; 2]| f64::from(last - first + 1);
        let outlines = self.outlines.iter().map(|outline| outline.cells(self.origin, face));
        outlines.map(|[columns, rows]| count(columns) * count(rows)).sum()
    }

    /// Adds triangles of `kind`: `lanes` of four.
    #[inline(always)]
    pub fn add_four(&mut self, four: Four, figures: &Figures) {
        let all_bits = |k: usize| f64::from_bits(if four.lanes >> k & 1 == 1 { !0 } else { 0 });
        let those: f64x4 = Quad::from_array(std::array::from_fn(all_bits));
        let ranges = figures.ranges();
        let [width, height] = ranges.map(|[low, high]| high - low);
        self.area += those & (width * height);
        self.girth += those & (width + height);
        self.count += four.lanes.count_ones() as usize;
        let sides = ranges.map(|[low, high]| {
            let [least, most] = [f64::INFINITY, f64::NEG_INFINITY].map(f64x4::splat);
            let [a, b, c, d] = Quad::to_array(those.choose(low, least));
            let [e, f, g, h] = Quad::to_array(those.choose(high, most));
            [a.min(b).min(c.min(d)), e.max(f).max(g.max(h))]
        });
        let glimpse = self.glimpse(four.packed(), sides);
        self.fours.push(glimpse);
    }

    /// Adds what is seen through face number `face` of a box from `min` to `max` about caster `number`.
    pub fn add(&mut self, face: usize, number: u32, (min, max): (DVec3, DVec3)) {
        if let Some(Outline { across, up, near }) = Outline::through(face, min, max) {
            let glimpse = self.glimpse(named(number, near), [across, up]);
            self.outlines.push(glimpse);
        }
    }

    /// What is seen between these sides, which the frame takes in.
    #[inline(always)]
    fn glimpse(&mut self, what: u64, sides: [[f64; 2]; 2]) -> Glimpse {
        if self.outlines.is_empty() && self.fours.is_empty() {
            self.origin = sides.map(|[low, _]| low);
        }
        self.frame = around(self.frame, sides);
        let from = self.origin;
        Glimpse { what, sides: [0, 1].map(|side| sides[side].map(|x| (x - from[side]) as f32)) }
    }
}

/// The box about a caster, relative to the light, and grown.
pub(super) fn relative(caster: &Caster, location: DVec3, slack: f64) -> (DVec3, DVec3) {
    (caster.bounds.min - location - slack, caster.bounds.max - location + slack)
}

/// The ranges that hold two pairs of ranges.
#[inline(always)]
fn around(a: [[f64; 2]; 2], b: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    [0, 1].map(|side| [a[side][0].min(b[side][0]), a[side][1].max(b[side][1])])
}
