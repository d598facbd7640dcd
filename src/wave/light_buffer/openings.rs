//! Where nothing is before a light: a window on all that is on one side of it, whose cells tell what stands foremost there.
//!
//! For scenes whose buffers would cost more to fill and to read than they spare. Most points are lit: those of what other things stand
//! on where nothing is in the cell, those of things where they are foremost and the others begin farther away. Of
//! the latter only the thing itself can be in the way, which those that are convex never are.

use super::casters::{Caster, Casters};
use super::figure::{Figure, Window};
use super::foremost::{self, Drawing, Fronts};
use super::ground::{Ground, Grounds};
use super::raster::{CELL_ROUNDING, MOST_ACROSS, axes, finest_scale};
use super::region::{Regions, slack_at};
use super::seen::{Sides, relative};
use super::{FACES, Face, Known, REACH, within_reach};
use crate::compile::{Geometry, SurfaceId};
use crate::lane::{LANES, Lane, Scalar, Vec3, each_lane, each_number, equal_lanes, f32x8};
use glam::DVec3;
use std::ops::Range;
use std::sync::Arc;

/// Columns of cells, and rows: of a picture of a million pixels, a few pixels each.
const SIDE: u32 = 256;
const _: () = assert!(SIDE as f64 <= MOST_ACROSS);
/// Bits of a word.
const BITS: u32 = u32::BITS;
/// Words of all cells.
const WORDS: usize = (SIDE * SIDE / BITS) as usize;

/// So many cells, across and up, are one of those of what is foremost.
const TOGETHER: u32 = SIDE / foremost::SIDE;
const _: () = assert!(TOGETHER * foremost::SIDE == SIDE);

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
    fronts: Fronts,
    regions: Regions,
    grounds: Arc<Grounds>,
}

impl Openings {
    /// Of all `casters`, of which these are `bounded` and have these `grounds`; `None` if the light is among them.
    pub fn of<S: Scalar, B: Scalar>(
        scene: &Geometry<S, B>,
        casters: &Casters,
        (bounded, grounds): (&[Caster], &Arc<Grounds>),
        location: DVec3,
    ) -> Option<Self> {
        let slack = slack_at::<S>(location, casters.bounds);
        let boxes = bounded.iter().map(|caster| relative(caster, location, slack));
        let (min, max) = boxes.clone().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
        // The way along which all is farthest for what it measures across.
        let (number, all) = (0..FACES)
            .map(|number| (number, Sides::through(number, min, max)))
            .max_by(|(_, a), (_, b)| narrowness(a).total_cmp(&narrowness(b)))?;
        if !all.depths.iter().all(|depth| REACH.contains(depth)) {
            return None;
        }
        let face = lay_out(all.seen(all.depths), S::UNIT_ROUNDOFF)?;
        let coarse = coarser(&face);
        let (mut closed, mut drawing) = (Box::new([0; WORDS]), Drawing::on(coarse, all.depths));
        let (along, _, _, backward) = axes(number);
        let window = Window::along(location, along, backward);
        for (caster_number, (caster, (min, max))) in (0..).zip(bounded.iter().zip(boxes)) {
            let drawn = drawing.begin(caster_number, Sides::through(number, min, max));
            let draw = |figure: &Figure| {
                each_row(&face, &window, figure, |row, columns| close(&mut closed, row, columns));
                each_row(&coarse, &window, figure, |row, columns| drawing.put(&drawn, row, columns));
            };
            if !window.each_figure(scene, caster, slack, draw) {
                return None;
            }
        }
        let (regions, grounds) = (Regions::of(casters, location, slack), grounds.clone());
        Some(Self { location, along, backward, face, closed, fronts: drawing.done(), regions, grounds })
    }

    /// What is known of the ways from `lanes` of eight points on surfaces, which those in `outside` show from outside and which are lit on
    /// the side that is seen; in doubt are those that only what they lie on may be in the way of.
    #[inline(always)]
    pub fn look<L: Lane>(
        &self,
        point: Vec3<L>,
        (surface, outside): (&[SurfaceId; LANES], u8),
        lanes: u8,
    ) -> Known {
        let Self { location, along, backward, face, closed, fronts, regions, grounds } = self;
        if lanes == 0 {
            return Known::default();
        }
        let way = point - Vec3::splat(*location);
        let (ahead, across, up) = match along {
            0 => (way.x, way.y, way.z),
            1 => (way.y, way.z, way.x),
            _ => (way.z, way.x, way.y),
        };
        let ahead = if *backward { -ahead } else { ahead };
        let depth = ahead.cast::<f32x8>();
        let ([column, row], beside) = face.find([ahead, across, up], depth);
        let ground = each_number(surface, |surface| grounds.under(surface).0);
        let caster = each_lane(|k| ground[k] >> Ground::CASTER);
        let bare = equal_lanes(&caster, Ground::CASTS_NONE);
        let mut known = beside & bare;
        if lanes & bare != 0 {
            let bit = each_lane(|k| {
                let (word, bit) = place_of((row[k] as u32).wrapping_mul(SIDE).wrapping_add(column[k] as u32));
                closed[word] >> bit & 1
            });
            known |= bare & equal_lanes(&bit, 0);
        }
        if lanes & !bare != 0 {
            let place = [row, column].map(|place| each_lane(|k| place[k] as u32 / TOGETHER));
            known |= !bare & !beside & fronts.are_first(place, depth, &caster);
        }
        let convex = equal_lanes(&each_lane(|k| ground[k] & Ground::CONVEX), Ground::CONVEX);
        let alone = regions.hold(within_reach(depth) & lanes & known, point, surface);
        let free = alone & (bare | convex & outside);
        Known { free, blocked: 0, doubtful: alone & !free }
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

/// Hands the columns of each row of a face that a figure may be in to `with`.
fn each_row(face: &Face, window: &Window, figure: &Figure, mut with: impl FnMut(u32, Range<u32>)) {
    let [low, high] = face.range(1, figure.up(), CELL_ROUNDING);
    for row in low..=high {
        let ends = [f64::from(row) - CELL_ROUNDING, f64::from(row + 1) + CELL_ROUNDING];
        let across = window.across(figure, ends.map(|end| face.place(1, end)));
        if across[0] <= across[1] {
            let [left, right] = face.range(0, across, CELL_ROUNDING);
            with(row, left..right + 1);
        }
    }
}

/// Something is in these cells of a row.
fn close(closed: &mut [u32; WORDS], row: u32, columns: Range<u32>) {
    for column in columns {
        let (word, bit) = place_of(row * SIDE + column);
        closed[word] |= 1 << bit;
    }
}

/// The same face by [`TOGETHER`] cells.
fn coarser(face: &Face) -> Face {
    let by = f64::from(TOGETHER);
    Face {
        columns: face.columns.div_ceil(TOGETHER),
        rows: face.rows.div_ceil(TOGETHER),
        scale: face.scale / by,
        width: face.width * by,
        ..*face
    }
}

/// Where the bit of a cell is: its word, and which of it.
#[inline(always)]
fn place_of(cell: u32) -> (usize, u32) {
    ((cell / BITS) as usize & (WORDS - 1), cell % BITS)
}

/// How far away a box begins for how far it goes across or up.
fn narrowness(Sides { depths: [near, _], sides }: &Sides) -> f64 {
    let [across, up] = sides.map(|[low, high]| (-low).max(high));
    near / across.max(up)
}
