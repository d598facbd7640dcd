//! What the light sees through each face of its cube.

use super::Face;
use super::casters::Caster;
use super::raster::{CELL_ROUNDING, EDGE, axes};
use super::sheet::Figure;
use crate::compile::SurfaceId;
use glam::DVec3;

/// A caster as the light sees it through one face.
pub(super) struct Outline {
    /// Least and greatest coordinate across and up, at depth 1.
    pub across: [f64; 2],
    pub up: [f64; 2],
    /// Least depth.
    pub near: f64,
    /// The box relative to the light, across and up: least and greatest.
    sides: [[f64; 2]; 2],
}

impl Outline {
    /// Of a box from `min` to `max` relative to the light, which is outside of it; `None` if it is not seen through
    /// `face`.
    pub fn through(face: usize, min: DVec3, max: DVec3) -> Option<Self> {
        let (along, across, up, backward) = axes(face);
        let (nearest, farthest) =
            if backward { (-max[along], -min[along]) } else { (min[along], max[along]) };
        if farthest <= 0.0 {
            return None;
        }
        let sides = [across, up].map(|axis| [min[axis], max[axis]]);
        // Within the face nothing is farther across than along.
        let off = |[low, high]: [f64; 2]| if low > 0.0 { low } else { (-high).max(0.0) };
        let near = nearest.max(off(sides[0]) / EDGE).max(off(sides[1]) / EDGE);
        if near <= 0.0 || near > farthest {
            return None;
        }
        let seen = |[low, high]: [f64; 2]| {
            let low = low / if low < 0.0 { near } else { farthest };
            let high = high / if high > 0.0 { near } else { farthest };
            [low.max(-EDGE), high.min(EDGE)]
        };
        Some(Self { across: seen(sides[0]), up: seen(sides[1]), near, sides })
    }

    /// The cells it is seen through: first and last column, first and last row.
    pub fn cells(&self, face: &Face) -> [[u32; 2]; 2] {
        places(face, [self.across, self.up], CELL_ROUNDING)
    }

    /// The least depth at which the box's side number `side` can be met in cell number `cell` along it.
    pub fn depth_in(&self, side: usize, cell: u32, face: &Face) -> f64 {
        let place = |edge: f64| face.corner[side] + edge / face.scale;
        let [low, high] = self.sides[side];
        let (first, last) = (f64::from(cell) - CELL_ROUNDING, f64::from(cell + 1) + CELL_ROUNDING);
        if low > 0.0 {
            let last = place(last);
            if last > 0.0 { low / last } else { f64::INFINITY }
        } else if high < 0.0 {
            let first = place(first);
            if first < 0.0 { high / first } else { f64::INFINITY }
        } else {
            0.0
        }
    }
}

/// The cells within ranges across and up, grown by parts of a cell: first and last column, first and last row.
#[inline(always)]
fn places(face: &Face, [across, up]: [[f64; 2]; 2], by: f64) -> [[u32; 2]; 2] {
    let range = |[low, high]: [f64; 2], corner: f64, most: u32| {
        let place = |x: f64, by: f64| ((x - corner) * face.scale + by).max(0.0) as u32;
        [place(low, -by), place(high, by)].map(|cell| cell.min(most - 1))
    };
    [range(across, face.corner[0], face.columns), range(up, face.corner[1], face.rows)]
}

/// A triangle that is seen well within one face.
pub(super) struct Facet {
    pub surface: SurfaceId,
    /// Least and greatest depth, with room.
    pub near: f32,
    pub far: f32,
    pub figure: Figure,
}

impl Facet {
    /// The cells it is seen through: more than those that are grown by [`CELL_ROUNDING`] and see it.
    #[inline(always)]
    fn cells(&self, face: &Face) -> [[u32; 2]; 2] {
        places(face, [self.figure.range(0), self.figure.range(1)], 2.0 * CELL_ROUNDING)
    }

    /// Calls with the number of each.
    #[inline(always)]
    pub fn each_cell(&self, face: &Face, mut call: impl FnMut(u32)) {
        let [[left, right], [low, high]] = self.cells(face);
        for row in low..=high {
            (left..=right).for_each(|column| call(row * face.columns + column));
        }
    }
}

/// What is seen through one face.
#[derive(Default)]
pub(super) struct Seen {
    /// With the casters' numbers.
    pub outlines: Vec<(u32, Outline)>,
    pub facets: Vec<Facet>,
    /// Around the facets: ranges across and up.
    frame: Option<[[f64; 2]; 2]>,
    /// Sums over the facets: width by height, width and height.
    area: f64,
    girth: f64,
}

impl Seen {
    /// Nothing, as before anything was added.
    pub fn clear(&mut self) {
        self.outlines.clear();
        self.facets.clear();
        (self.frame, self.area, self.girth) = (None, 0.0, 0.0);
    }

    /// How many.
    pub fn len(&self) -> usize {
        self.outlines.len() + self.facets.len()
    }

    /// Ranges across and up that hold all of it.
    pub fn frame(&self) -> Option<[[f64; 2]; 2]> {
        let outlines = self.outlines.iter().map(|(_, outline)| [outline.across, outline.up]);
        outlines.chain(self.frame).reduce(around)
    }

    /// How many cells all of it is drawn into: of facets, on average.
    pub fn drawn(&self, face: &Face) -> f64 {
        let count = |[first, last]: [u32; 2]| f64::from(last - first + 1);
        let outlines = self.outlines.iter().map(|(_, outline)| outline.cells(face));
        let outlines: f64 = outlines.map(|[columns, rows]| count(columns) * count(rows)).sum();
        outlines + self.area * face.scale * face.scale + self.girth * face.scale + self.facets.len() as f64
    }

    /// Adds a triangle.
    #[inline(always)]
    pub fn push(&mut self, facet: Facet) {
        let ranges @ [across, up] = [facet.figure.range(0), facet.figure.range(1)];
        let (width, height) = (across[1] - across[0], up[1] - up[0]);
        self.area += width * height;
        self.girth += width + height;
        self.frame = Some(self.frame.map_or(ranges, |frame| around(frame, ranges)));
        self.facets.push(facet);
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
