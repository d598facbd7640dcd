//! Where nothing is before a light: a window on all that is on one side of it, with a bit for each cell that something may be seen
//! through.
//!
//! For scenes whose cells would cost more to fill and to read than they spare: most points of what other things stand on are
//! lit, which of most of them one bit tells, of eight kilobytes that stay in a core's first-level cache.

use super::casters::{Caster, Casters};
use super::figure::{Figure, Window};
use super::raster::{CELL_ROUNDING, MOST_ACROSS, finest_scale};
use super::region::{Regions, slack_at};
use super::seen::relative;
use super::{Face, REACH};
use crate::compile::{Geometry, Kind, SurfaceId};
use crate::lane::{LANES, Lane, Scalar, Vec3, each_lane, equal_lanes, f32x8, lanes_within};
use glam::DVec3;

/// Columns of cells, and rows: of a picture of a million pixels, a few pixels each.
const SIDE: u32 = 256;
const _: () = assert!(SIDE as f64 <= MOST_ACROSS);

/// Bits of a word.
const BITS: u32 = u32::BITS;
/// Words of all cells.
const WORDS: usize = (SIDE * SIDE / BITS) as usize;

/// With a larger share of the cells closed, there is too little to tell.
const MOST_CLOSED: f64 = 0.875;

/// What a light sees through one window, in compiled space.
#[derive(Debug)]
pub struct Openings {
    location: DVec3,
    /// The axis ahead, and whether it looks the negative way. Across and up are the next two axes.
    along: usize,
    backward: bool,
    face: Face,
    /// A bit for each cell that something may be in, row by row.
    closed: Box<[u32; WORDS]>,
    regions: Regions,
    /// The first of the planes, and how many there are: what is within bounds has itself before it, but for planes' points nobody need
    /// look.
    planes: [SurfaceId; 2],
}

impl Openings {
    /// Of all `casters`, of which these are `bounded`; `None` if the light is among them, or there is little to tell.
    pub fn of<S: Scalar, B: Scalar>(
        scene: &Geometry<S, B>,
        casters: &Casters,
        bounded: &[Caster],
        location: DVec3,
    ) -> Option<Self> {
        let slack = slack_at::<S>(location, casters.bounds);
        let boxes = bounded.iter().map(|caster| relative(caster, location, slack));
        let (min, max) = boxes.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
        // The way along which all is farthest for what it measures across.
        let ways = (0..3).flat_map(|along| [(along, false), (along, true)]);
        let (along, backward, [depths, across, up]) = ways
            .map(|(along, backward)| (along, backward, sides(along, backward, (min, max))))
            .max_by(|(_, _, a), (_, _, b)| narrowness(a).total_cmp(&narrowness(b)))?;
        if !depths.iter().all(|depth| REACH.contains(depth)) {
            return None;
        }
        let face = lay_out([across, up].map(|side| seen(side, depths)), S::UNIT_ROUNDOFF)?;
        let regions = Regions::of(casters, location, slack);
        let planes = [scene.base[Kind::Plane as usize], scene.columns.len(Kind::Plane) as u32];
        let closed = Box::new([0; WORDS]);
        let mut openings = Self { location, along, backward, face, closed, regions, planes };
        let window = Window::along(location, along, backward);
        for caster in bounded {
            let close = |figure: &Figure| openings.close(&window, figure);
            if !window.each_figure(scene, caster, slack, close) {
                return None;
            }
        }
        let closed: u32 = openings.closed.iter().map(|word| word.count_ones()).sum();
        let all = f64::from(face.columns) * f64::from(face.rows);
        (f64::from(closed) <= MOST_CLOSED * all).then_some(openings)
    }

    /// Something is in the cells of a figure.
    fn close(&mut self, window: &Window, figure: &Figure) {
        let face = self.face;
        let [low, high] = face.range(1, figure.up(), CELL_ROUNDING);
        for row in low..=high {
            let ends = [f64::from(row) - CELL_ROUNDING, f64::from(row + 1) + CELL_ROUNDING];
            let across = window.across(figure, ends.map(|end| face.place(1, end)));
            if across[0] > across[1] {
                continue;
            }
            let [left, right] = face.range(0, across, CELL_ROUNDING);
            for column in left..=right {
                let (word, bit) = place_of(row * SIDE + column);
                self.closed[word] |= 1 << bit;
            }
        }
    }

    /// Those of the ways from `lanes` of eight points to the light that nothing is in. The points lie on surfaces, which are lit on the
    /// side that is seen.
    #[inline(always)]
    pub fn free<L: Lane>(&self, point: Vec3<L>, surface: &[SurfaceId; LANES], lanes: u8) -> u8 {
        let Self { location, along, backward, face, closed, regions, planes: [first, count] } = self;
        let lanes = lanes & lanes_within(surface, *first, *count);
        if lanes == 0 {
            return 0;
        }
        let way = point - Vec3::splat(*location);
        let (ahead, across, up) = match along {
            0 => (way.x, way.y, way.z),
            1 => (way.y, way.z, way.x),
            _ => (way.z, way.x, way.y),
        };
        let ahead = if *backward { -ahead } else { ahead };
        let single = L::cast::<f32x8>;
        let depth = single(ahead);
        let scale = f32x8::lit(face.scale) / depth;
        // Single precision tells cells apart once differences have been taken.
        let place = |w: L, corner: f64| single((-ahead).fused(L::lit(corner), w)) * scale;
        let (column, row) = (place(across, face.corner[0]), place(up, face.corner[1]));
        let (columns, rows) = (f32x8::lit(f64::from(face.columns)), f32x8::lit(f64::from(face.rows)));
        let beside = (column.min(row).lt(f32x8::zero()) | column.ge(columns) | row.ge(rows)).bits();
        let ahead = (depth.gt(f32x8::lit(REACH.start)) & depth.lt(f32x8::lit(REACH.end))).bits();
        let (column, row) = (column.trunc_int().to_array(), row.trunc_int().to_array());
        let bit = each_lane(|k| {
            let (word, bit) = place_of((row[k] as u32).wrapping_mul(SIDE).wrapping_add(column[k] as u32));
            closed[word] >> bit & 1
        });
        let free = ahead & (beside | equal_lanes(&bit, 0)) & lanes;
        regions.hold(free, point, surface)
    }
}

/// Cells over what is seen between these places across and up.
fn lay_out(sides: [[f64; 2]; 2], roundoff: f64) -> Option<Face> {
    let widest = sides.iter().map(|[low, high]| high - low).fold(0.0, f64::max);
    // Places are off by parts of what they are.
    let farthest = sides.as_flattened().iter().fold(1.0, |a: f64, b| a.max(b.abs()));
    let scale = (f64::from(SIDE - 2) / widest).min(finest_scale(roundoff) / farthest);
    let scale = f64::from(scale as f32);
    let count = |[low, high]: [f64; 2]| ((high - low) * scale + 2.0 * CELL_ROUNDING) as u32 + 1;
    let [columns, rows] = sides.map(count);
    let corner = sides.map(|[low, _]| low - CELL_ROUNDING / scale);
    let fits = scale > 0.0 && columns <= SIDE && rows <= SIDE;
    fits.then_some(Face { first: 0, columns, rows, corner, scale, width: 1.0 / scale })
}

/// Where the bit of a cell is: its word, and which of it.
#[inline(always)]
fn place_of(cell: u32) -> (usize, u32) {
    ((cell / BITS) as usize & (WORDS - 1), cell % BITS)
}

/// From where to where a box relative to the light goes ahead, across and up.
fn sides(along: usize, backward: bool, (min, max): (DVec3, DVec3)) -> [[f64; 2]; 3] {
    let side = |k: usize| (along + k) % 3;
    let [low, high] = [min, max].map(|corner| corner[along]);
    let ahead = if backward { [-high, -low] } else { [low, high] };
    [ahead, [min[side(1)], max[side(1)]], [min[side(2)], max[side(2)]]]
}

/// How far away a box begins for how far it goes across or up.
fn narrowness([[near, _], across, up]: &[[f64; 2]; 3]) -> f64 {
    let reach = [across, up].map(|[low, high]| (-low).max(*high));
    near / reach[0].max(reach[1])
}

/// Where, at depth 1, a side is seen that lies between these depths.
fn seen([low, high]: [f64; 2], [near, far]: [f64; 2]) -> [f64; 2] {
    [low / if low < 0.0 { near } else { far }, high / if high > 0.0 { near } else { far }]
}
