//! What the light sees through each face of its cube.

use super::Face;
use super::casters::Caster;
use super::raster::{CELL_ROUNDING, EDGE, axes};
use super::sheet::{Facet, Figures};
use crate::lane::{QUAD, Quad};
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

/// A caster's box relative to the light, across and up a face: least and greatest.
pub(super) struct Sides([[f64; 2]; 2]);

impl Outline {
    /// Of a box from `min` to `max` relative to the light, which is outside of it; `None` if it is not seen through
    /// `face`.
    pub fn through(face: usize, min: DVec3, max: DVec3) -> Option<Self> {
        let (along, _, _, backward) = axes(face);
        let (nearest, farthest) =
            if backward { (-max[along], -min[along]) } else { (min[along], max[along]) };
        if farthest <= 0.0 {
            return None;
        }
        let Sides(sides) = Sides::through(face, min, max);
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
        let seen = |[low, high]: [f64; 2]| {
            let low = low / if low < 0.0 { near } else { farthest };
            let high = high / if high > 0.0 { near } else { farthest };
            [low.max(-EDGE), high.min(EDGE)]
        };
        Some(Self { across: seen(sides[0]), up: seen(sides[1]), near })
    }

    /// The cells it is seen through: first and last column, first and last row.
    pub fn cells(&self, face: &Face) -> [[u32; 2]; 2] {
        let range = |[low, high]: [f64; 2], corner: f64, most: u32| {
            let place = |x: f64, by: f64| ((x - corner) * face.scale + by).max(0.0) as u32;
            [place(low, -CELL_ROUNDING), place(high, CELL_ROUNDING)].map(|cell| cell.min(most - 1))
        };
        [range(self.across, face.corner[0], face.columns), range(self.up, face.corner[1], face.rows)]
    }
}

impl Sides {
    /// Of a box from `min` to `max` relative to the light.
    pub fn through(face: usize, min: DVec3, max: DVec3) -> Self {
        let (_, across, up, _) = axes(face);
        Self([across, up].map(|axis| [min[axis], max[axis]]))
    }

    /// The least depth at which the box's side number `side` can be met in cell number `cell` along it.
    pub fn depth_in(&self, side: usize, cell: u32, face: &Face) -> f64 {
        let Self(sides) = self;
        let [low, high] = sides[side];
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

/// What is seen through one face.
#[derive(Default)]
pub(super) struct Seen {
    /// With the casters' numbers.
    pub outlines: Vec<(u32, Outline)>,
    pub facets: Vec<Facet>,
    /// How many of them there will be.
    count: usize,
    /// Around the facets, those of every fourth: ranges across and up.
    frame: [[f64x4; 2]; 2],
    /// Sums over the facets: width by height, width and height.
    area: f64x4,
    girth: f64x4,
}

impl Seen {
    /// Nothing, as before anything was added.
    pub fn clear(&mut self) {
        self.outlines.clear();
        self.facets.clear();
        (self.count, self.area, self.girth) = (0, f64x4::splat(0.0), f64x4::splat(0.0));
        self.frame = [[f64::INFINITY, f64::NEG_INFINITY].map(f64x4::splat); 2];
    }

    /// How many.
    pub fn len(&self) -> usize {
        self.outlines.len() + self.count
    }

    /// Ranges across and up that hold all of it.
    pub fn frame(&self) -> Option<[[f64; 2]; 2]> {
        let outlines = self.outlines.iter().map(|(_, outline)| [outline.across, outline.up]);
        let lanes = self.frame.map(|ends| ends.map(Quad::to_array));
        let facets = (0..QUAD).map(|k| lanes.map(|ends| ends.map(|lanes| lanes[k])));
        let frame = outlines.chain(facets).reduce(around);
        frame.filter(|[across, _]| across[0] <= across[1])
    }

    /// How many cells facets are drawn into, on average.
    pub fn faceted(&self, face: &Face) -> f64 {
        let [area, girth] = [self.area, self.girth].map(|sums| Quad::to_array(sums).iter().sum::<f64>());
        area * face.scale * face.scale + girth * face.scale + self.count as f64
    }

    /// How many cells all else is drawn into.
    pub fn outlined(&self, face: &Face) -> f64 {
        let count = |[first, last]: [u32; 2]| f64::from(last - first + 1);
        let outlines = self.outlines.iter().map(|(_, outline)| outline.cells(face));
        outlines.map(|[columns, rows]| count(columns) * count(rows)).sum()
    }

    /// Makes room for triangles of `lanes`.
    #[inline(always)]
    pub fn expect(&mut self, figures: &Figures, lanes: u8) {
        let all_bits = |k: usize| f64::from_bits(if lanes >> k & 1 == 1 { !0 } else { 0 });
        let those: f64x4 = Quad::from_array(std::array::from_fn(all_bits));
        let ranges = figures.ranges();
        for ([low, high], [least, most]) in self.frame.iter_mut().zip(ranges) {
            *low = Quad::min(those.choose(least, *low), *low);
            *high = Quad::max(those.choose(most, *high), *high);
        }
        let [width, height] = ranges.map(|[low, high]| high - low);
        self.area += those & (width * height);
        self.girth += those & (width + height);
        self.count += lanes.count_ones() as usize;
    }

    /// Makes room for all facets expected.
    pub fn reserve(&mut self) {
        self.facets.reserve_exact(self.count);
    }

    /// Adds what is seen through face number `face` of a box from `min` to `max` about caster `number`.
    pub fn add(&mut self, face: usize, number: u32, (min, max): (DVec3, DVec3)) {
        self.outlines.extend(Outline::through(face, min, max).map(|outline| (number, outline)));
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
