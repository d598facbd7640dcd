//! What a light's surroundings tell of its shadow rays before they are traced (Haines and Greenberg 1986, The light buffer:
//! a shadow-testing accelerator).
//!
//! Around each point light lies a cube of cells. A cell knows how near the first thing may be that could stand in a
//! way through it, and beyond which depth all of it is blocked: by one convex solid, or by triangles that leave no gap. Most
//! points are nearer than the one or farther than the other. Of those between, the ones on a single sheet of
//! triangles with nothing before it are lit, and others are held against the few things that the cell lists. Where there
//! are few things at all there are no cells, but a cone for each ([`Cones`]); where cells would take longer than they spare,
//! what is foremost is told by a window on all of them ([`Openings`]). The answers are those that tracing would give; of what is
//! left nothing is said.

mod among;
mod ball;
mod casters;
mod cell;
mod cones;
mod drawn;
mod figure;
mod foremost;
mod ground;
mod openings;
mod raster;
mod region;
mod seen;
mod sheet;
mod tile;
mod triangles;

pub use casters::{Caster, Casters, are_worth_it, count, in_tree};
pub use cones::Cones;
pub use figure::{Figure, Window};
pub use ground::Grounds;
pub use openings::Openings;
pub use raster::{Room, fill};
pub use region::slack_at;

use super::query::Query;
use crate::compile::{Geometry, NO_SURFACE, SurfaceId};
use crate::lane::{
    LANES, Lane, Mask, Scalar, Vec3, choose, each_lane, equal_lanes, f32x8, lanes_within, prefetch,
    same_lanes,
};
use among::{Candidate, Ways, met};
use glam::DVec3;
use region::Regions;
use std::ops::Range;

/// A direction from the light, and the paths near it. Depths are along the axis of the cube's face.
#[derive(Debug, Clone, Copy)]
struct Cell {
    /// Before this nothing is in the way.
    near: f32,
    /// The same without the convex surface `nearest`, which is never in the way of its own front.
    near_but_one: f32,
    /// Or [`SHEET`]: triangles that are not in each other's way.
    nearest: SurfaceId,
    /// Beyond this all is blocked.
    blocked: f32,
}

/// What may stand in a cell between its depths.
#[derive(Debug, Clone, Copy)]
struct List {
    first: u32,
    len: u32,
}

impl List {
    /// Not known: it begins where no list does.
    const NONE: Self = Self { first: u32::MAX, len: 0 };

    /// The same list, once so many candidates come before what it was made among.
    fn after(self, before: usize) -> Self {
        let first = self.first as usize + before;
        if self.len == 0 {
            self
        } else {
            u32::try_from(first).map_or(Self::NONE, |first| Self { first, ..self })
        }
    }
}

/// See [`Cell::nearest`].
const SHEET: SurfaceId = NO_SURFACE - 1;

impl Cell {
    /// Nothing is in it.
    const EMPTY: Self = Self {
        near: f32::INFINITY,
        near_but_one: f32::INFINITY,
        nearest: NO_SURFACE,
        blocked: f32::INFINITY,
    };
}

/// A face of the cube, as far as anything can be seen through it: `columns` by `rows` square cells, from `first` on.
#[derive(Debug, Clone, Copy, Default)]
struct Face {
    first: u32,
    columns: u32,
    rows: u32,
    /// Where the first cell begins; the cube's edges are at -1 and 1.
    corner: [f64; 2],
    /// Cells in a unit: a number of single precision.
    scale: f64,
    /// How wide that makes a cell.
    width: f64,
}

impl Face {
    /// How far across (side 0) or up (side 1) at depth 1 lies what is so many cells from where the first one begins.
    fn place(&self, side: usize, cells: f64) -> f64 {
        self.corner[side] + cells * self.width
    }

    /// First and last cell across or up that what lies from `low` to `high`, at depth 1, may be in: `room` cells more on either side.
    fn range(&self, side: usize, [low, high]: [f64; 2], room: f64) -> [u32; 2] {
        let last = [self.columns, self.rows][side] - 1;
        let cell = |x: f64, by: f64| ((x - self.corner[side]) * self.scale + by).max(0.0) as u32;
        [cell(low, -room), cell(high, room)].map(|cell| cell.min(last))
    }

    /// Column and row of eight points that lie so far ahead, across and up, and the lanes of those beside all cells. Depths are the way
    /// ahead in single precision, which tells cells apart once differences have been taken.
    #[inline(always)]
    fn find<L: Lane>(&self, [ahead, across, up]: [L; 3], depth: f32x8) -> ([[i32; LANES]; 2], u8) {
        let scale = f32x8::lit(self.scale) / depth;
        let place = |w: L, corner: f64| (-ahead).fused(L::lit(corner), w).cast::<f32x8>() * scale;
        let (column, row) = (place(across, self.corner[0]), place(up, self.corner[1]));
        let (columns, rows) = (f32x8::lit(f64::from(self.columns)), f32x8::lit(f64::from(self.rows)));
        let beside = column.min(row).lt(f32x8::zero()) | column.ge(columns) | row.ge(rows);
        ([column, row].map(|place| place.trunc_int().to_array()), beside.bits())
    }
}

/// Of points nearer or farther than this, along the axis of their face, nothing is said: single precision has no room for them.
const REACH: Range<f64> = 1e-30..1e30;

/// Lanes of these depths of which something may be said.
#[inline(always)]
fn within_reach(depth: f32x8) -> u8 {
    (depth.gt(f32x8::lit(REACH.start)) & depth.lt(f32x8::lit(REACH.end))).bits()
}

/// A cube's faces: towards x, -x, y, -y, z, -z. Across and up are the next two axes.
const FACES: usize = 6;

/// What is known of what surrounds a light.
#[derive(Debug, Default)]
pub enum Around {
    /// Nothing, or it is not asked for: shadow rays tell.
    #[default]
    Unknown,
    /// Cell by cell.
    Cells(Box<LightBuffer>),
    /// Thing by thing, where there are few.
    Cones(Cones),
    /// Where there is nothing, and what is foremost.
    Openings(Openings),
}

/// What is known of the ways from one light, in compiled space.
#[derive(Debug)]
pub struct LightBuffer {
    location: DVec3,
    faces: [Face; FACES],
    cells: Vec<Cell>,
    /// Their lists, which fewer points ask for.
    lists: Vec<List>,
    candidates: Vec<Candidate>,
    /// Surfaces of triangles, all of which are part of what the cells tell as sheets.
    sheets: [Range<SurfaceId>; 2],
    regions: Regions,
}

/// Where eight points lie in a light's buffer.
#[derive(Debug, Clone, Copy, Default)]
pub struct Places {
    /// Lanes that lie in cells, and lanes that lie beside all of them.
    within: u8,
    beside: u8,
    /// Cells, and depths there.
    cell: [u32; LANES],
    depth: f32x8,
}

impl Places {
    /// The cells of `lanes`; in other lanes that of one of these. (All are asked for: nobody guesses how many there are.)
    #[inline(always)]
    fn cells_of(&self, lanes: u8) -> [u32; LANES] {
        let one = self.cell[lanes.trailing_zeros() as usize & (LANES - 1)];
        choose(lanes, &self.cell, &[one; LANES])
    }
}

/// What a light's buffer knows of eight points.
#[derive(Debug, Clone, Copy, Default)]
pub struct Known {
    /// Lanes that nothing is in the way of, not even what is see-through.
    pub free: u8,
    /// Lanes that no light reaches.
    pub blocked: u8,
    /// Lanes that may be one or the other: of cells [`LightBuffer::ask`] tells, through windows what they lie on.
    pub doubtful: u8,
}

impl Known {
    /// Forgets all lanes but these.
    pub fn keep(&mut self, lanes: u8) {
        self.free &= lanes;
        self.blocked &= lanes;
        self.doubtful &= lanes;
    }
}

impl LightBuffer {
    /// Finds the cells of `lanes` of eight points, for [`LightBuffer::look`], and asks the memory for what is in them: neighbours lie
    /// in many cells behind a curved mirror, and the cells of a light are more than a cache holds.
    #[inline]
    pub fn place<L: Lane>(&self, point: Vec3<L>, lanes: u8, places: &mut Places) {
        let way = point - Vec3::splat(self.location);
        // Single precision tells faces apart, once differences have been taken.
        let single = L::cast::<f32x8>;
        let [x, y, z] = [way.x, way.y, way.z].map(|w| single(w).abs());
        let along_x = (x.ge(y) & x.ge(z)).bits();
        let along_y = y.ge(z).bits() & !along_x;
        let along = [along_x, along_y, !(along_x | along_y)];
        let zero = L::zero();
        let backward = [way.x, way.y, way.z].map(|w| w.lt(zero).bits());

        let (mut depth, mut cell, mut waiting) = (f32x8::zero(), [0; LANES], lanes);
        let (mut within, mut beside) = (0u8, 0u8);
        // Neighbours mostly lie behind one face.
        while waiting != 0 {
            let first = waiting.trailing_zeros();
            let axis = along.iter().position(|lanes| lanes >> first & 1 == 1).unwrap_or(0);
            let negative = backward[axis] >> first & 1 == 1;
            let same = waiting & along[axis] & if negative { backward[axis] } else { !backward[axis] };
            waiting &= !same;
            let face = &self.faces[axis * 2 + usize::from(negative)];
            // (By number they would be looked up in memory, where they are not yet.)
            let (ahead, across, up, to) = match axis {
                0 => (way.x, way.y, way.z, x),
                1 => (way.y, way.z, way.x, y),
                _ => (way.z, way.x, way.y, z),
            };
            let ([column, row], out) = face.find([ahead.abs(), across, up], to);
            let sound = same & within_reach(to);
            beside |= sound & out;
            within |= sound & !out;
            depth = Mask::from_bits(same).select(to, depth);
            let place = |k: usize| {
                (row[k] as u32)
                    .wrapping_mul(face.columns)
                    .wrapping_add(column[k] as u32)
                    .wrapping_add(face.first)
            };
            cell = choose(same, &each_lane(place), &cell);
        }
        *places = Places { within, beside, cell, depth };
        for cell in places.cells_of(within) {
            if let Some(cell) = self.cells.get(cell as usize) {
                prefetch(cell);
            }
        }
    }

    /// Puts into `known` what is known of the ways from eight points to the light, of those that have `places`. The points lie on
    /// surfaces, which those in `outside` see from outside and which are lit on the side that is seen.
    #[inline]
    pub fn look<L: Lane>(
        &self,
        point: Vec3<L>,
        places: &Places,
        (surface, outside): (&[SurfaceId; LANES], u8),
        known: &mut Known,
    ) {
        let &Places { within, beside, cell, depth } = places;
        (known.free, known.blocked, known.doubtful) = (beside, 0, 0);
        if within != 0 {
            // Lanes that are not within have any number.
            let cells =
                [0, 1, 2, 3, 4, 5, 6, 7].map(|k| self.cells.get(cell[k] as usize).unwrap_or(&Cell::EMPTY));
            let nearest = each_lane(|k| cells[k].nearest);
            let mut own = same_lanes(&nearest, surface) & outside;
            let on_sheets = equal_lanes(&nearest, SHEET);
            if on_sheets != 0 {
                for sheet in self.sheets.iter().filter(|sheet| !sheet.is_empty()) {
                    own |= on_sheets & lanes_within(surface, sheet.start, sheet.end - sheet.start);
                }
            }
            let [near, near_but_one] =
                [f32x8::from_fn(|k| cells[k].near), f32x8::from_fn(|k| cells[k].near_but_one)];
            let near = Mask::from_bits(own).select(near_but_one, near);
            let free = depth.lt(near).bits() & within;
            known.blocked = depth.gt(f32x8::from_fn(|k| cells[k].blocked)).bits() & within;
            if !self.candidates.is_empty() {
                known.doubtful = within & !free & !known.blocked;
            }
            known.free |= free;
        }
        let open = self.regions.hold(known.free | known.doubtful, point, surface);
        known.free &= open;
        known.doubtful &= open;
        if known.doubtful != 0 {
            for cell in places.cells_of(known.doubtful) {
                if let Some(list) = self.lists.get(cell as usize) {
                    prefetch(list);
                }
            }
        }
    }

    /// Asks the memory for the lists of points that are in doubt.
    #[inline]
    pub fn fetch_lists(&self, places: &Places, doubtful: u8) {
        for cell in places.cells_of(doubtful) {
            let list = self.lists.get(cell as usize);
            if let Some(first) = list.and_then(|list| self.candidates.get(list.first as usize)) {
                prefetch(first);
            }
        }
    }

    /// Tells those of the lanes that [`LightBuffer::look`] left in doubt whose cells have lists; `query` asks for what is in their way.
    #[inline]
    pub fn ask<S: Scalar, B: Scalar>(
        &self,
        scene: &Geometry<S, B>,
        query: &mut Query<S::Lane>,
        places: &Places,
        known: &mut Known,
    ) {
        let mut ways = Ways { query, depths: places.depth.lanes() };
        let mut waiting = known.doubtful;
        while waiting != 0 {
            // Neighbours often lie in one cell.
            let cell = places.cell[waiting.trailing_zeros() as usize & (LANES - 1)];
            let same = equal_lanes(&places.cell, cell) & waiting;
            waiting &= !same;
            let Some(list) = self.lists.get(cell as usize) else { continue };
            let all = list.first as usize..list.first as usize + list.len as usize;
            let Some(candidates) = self.candidates.get(all) else { continue };
            let met = met(scene, candidates, &mut ways, same);
            known.free |= same & !met;
            known.blocked |= met;
        }
    }
}
