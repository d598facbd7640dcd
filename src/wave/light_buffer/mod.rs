//! What a light's surroundings tell of its shadow rays before they are traced (Haines and Greenberg 1986, The light buffer:
//! a shadow-testing accelerator).
//!
//! Around each point light lies a cube of cells. A cell knows how near the first thing may be that could stand in a
//! way through it, and beyond which depth all of it is blocked: by one convex solid, or by triangles that leave no gap. Most
//! points are nearer than the one or farther than the other. Of those between, the ones on a single sheet of
//! triangles with nothing before it are lit, and others are held against the few things that the cell lists. The
//! answers are those that tracing would give; of what is left nothing is said.

mod among;
mod casters;
mod cell;
mod raster;
mod seen;
mod sheet;

pub use among::Ways;
pub use casters::{Casters, are_worth_it};
pub use raster::{Room, fill};

use crate::compile::{Compiled, NO_SURFACE, SurfaceId};
use crate::kernel::View;
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3, bits, choose, each_lane, equal_lanes, f32x8};
use among::{Candidate, meets};
use casters::Region;
use glam::DVec3;
use raster::axes;
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
    /// Where the list begins of what may stand in between, or [`NO_LIST`].
    first: u32,
    len: u32,
}

/// See [`Cell::nearest`].
const SHEET: SurfaceId = NO_SURFACE - 1;
/// See [`Cell::first`].
const NO_LIST: u32 = u32::MAX;

impl Cell {
    /// Nothing is in it.
    const EMPTY: Self = Self {
        near: f32::INFINITY,
        near_but_one: f32::INFINITY,
        nearest: NO_SURFACE,
        blocked: f32::INFINITY,
        first: NO_LIST,
        len: 0,
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
}

/// Of points nearer or farther than this, along the axis of their face, nothing is said: single precision has no room for them.
const REACH: Range<f64> = 1e-30..1e30;

/// A cube's faces: towards x, -x, y, -y, z, -z. Across and up are the next two axes.
const FACES: usize = 6;

/// What is known of the ways from one light, in compiled space.
#[derive(Debug)]
pub struct LightBuffer {
    location: DVec3,
    faces: [Face; FACES],
    cells: Vec<Cell>,
    /// Their lists.
    candidates: Vec<Candidate>,
    /// Surfaces of triangles, all of which are part of what the cells tell as sheets.
    sheets: [Range<SurfaceId>; 2],
    /// Convex regions that the light is in and whose surface may block: a way within them all meets none of those.
    regions: Vec<Region>,
    /// Nothing unknown stands anywhere, so that an empty cell is free.
    complete: bool,
}

/// What a light's buffer knows of eight points.
#[derive(Debug, Clone, Copy, Default)]
pub struct Known {
    /// Lanes that nothing is in the way of, not even what is see-through.
    pub free: u8,
    /// Lanes that no light reaches.
    pub blocked: u8,
    /// Lanes that are one or the other, as [`LightBuffer::ask`] tells.
    pub listed: u8,
    /// Their cells, and their depths there.
    cell: [u32; LANES],
    depth: [f32; LANES],
}

impl LightBuffer {
    /// What is known of the ways from `lanes` of eight points to the light. The points lie on surfaces, which those in
    /// `outside` see from outside and which are lit on the side that is seen.
    #[inline]
    pub fn look<L: Lane>(
        &self,
        point: Vec3<L>,
        surface: &[SurfaceId; LANES],
        outside: u8,
        lanes: u8,
    ) -> Known {
        let way = point - Vec3::splat(self.location);
        // Single precision tells faces and cells apart, once differences have been taken.
        let single = |x: L| f32x8::from_f64s(x.to_f64s());
        let way = [way.x, way.y, way.z];
        let reach = way.map(|w| single(w).abs());
        let [x, y, z] = reach;
        let along_x = (x.ge(y) & x.ge(z)).bits();
        let along_y = y.ge(z).bits() & !along_x;
        let along = [along_x, along_y, !(along_x | along_y)];
        let zero = L::zero();
        let backward = way.map(|w| w.lt(zero).bits());

        let (mut depth, mut cell, mut waiting) = (f32x8::zero(), [0; LANES], lanes);
        let (mut within, mut beside) = (0u8, 0u8);
        // Neighbours mostly lie behind one face.
        while waiting != 0 {
            let first = waiting.trailing_zeros();
            let axis = along.iter().position(|lanes| lanes >> first & 1 == 1).unwrap_or(0);
            let negative = backward[axis] >> first & 1 == 1;
            let same = waiting & along[axis] & if negative { backward[axis] } else { !backward[axis] };
            waiting &= !same;
            let number = axis * 2 + usize::from(negative);
            let face = &self.faces[number];
            let (_, across, up, _) = axes(number);
            let to = reach[axis];
            let scale = f32x8::lit(face.scale) / to;
            let ahead = way[axis].abs();
            let place = |w: L, corner: f64| single((-ahead).fused(L::lit(corner), w)) * scale;
            let (column, row) = (place(way[across], face.corner[0]), place(way[up], face.corner[1]));
            let (columns, rows) = (f32x8::lit(f64::from(face.columns)), f32x8::lit(f64::from(face.rows)));
            let sound = same & (to.gt(f32x8::lit(REACH.start)) & to.lt(f32x8::lit(REACH.end))).bits();
            let out = column.min(row).lt(f32x8::zero()) | column.ge(columns) | row.ge(rows);
            beside |= sound & out.bits();
            within |= sound & !out.bits();
            depth = Mask::from_bits(same).select(to, depth);
            let (column, row) = (column.trunc_int().to_array(), row.trunc_int().to_array());
            let place = |k: usize| {
                (row[k] as u32)
                    .wrapping_mul(face.columns)
                    .wrapping_add(column[k] as u32)
                    .wrapping_add(face.first)
            };
            cell = choose(same, &each_lane(place), &cell);
        }
        let mut known = Known { free: beside, ..Known::default() };
        if within != 0 {
            let (mut near, mut dark, mut listed) = ([0.0; LANES], [0.0; LANES], 0);
            for k in 0..LANES {
                // Lanes that are not within have any number.
                let cell = self.cells.get(cell[k] as usize).unwrap_or(&Cell::EMPTY);
                let own = if cell.nearest == SHEET {
                    self.sheets.iter().any(|sheets| sheets.contains(&surface[k]))
                } else {
                    cell.nearest == surface[k] && outside >> k & 1 == 1
                };
                near[k] = if own { cell.near_but_one } else { cell.near };
                dark[k] = cell.blocked;
                listed |= u8::from(cell.first != NO_LIST) << k;
            }
            let free = depth.lt(f32x8::from(near)).bits() & within;
            known.blocked = depth.gt(f32x8::from(dark)).bits() & within;
            known.listed = listed & within & !free & !known.blocked;
            known.free |= free;
            (known.cell, known.depth) = (cell, depth.to_array());
        }
        let mut open = known.free | known.listed;
        if !self.complete {
            open = 0;
        }
        for region in &self.regions {
            if open == 0 {
                break;
            }
            open &= region.holds(point) | equal_lanes(surface, region.surface);
        }
        known.free &= open;
        known.listed &= open;
        known
    }

    /// Tells the lanes that [`LightBuffer::look`] left to the lists.
    #[inline]
    pub fn ask<S: Scalar, B: Scalar>(&self, scene: &Compiled<S, B>, ways: &Ways<S>, known: &mut Known) {
        let view = if scene.has_triangles() { View::along(ways.rays.dir) } else { View::default() };
        for k in bits(known.listed) {
            let Some(cell) = self.cells.get(known.cell[k] as usize) else { continue };
            let all = cell.first as usize..cell.first as usize + cell.len as usize;
            let candidates = self.candidates.get(all).unwrap_or_default();
            let blocked = meets(scene, candidates, ways, (&view, k), known.depth[k]);
            known.free |= u8::from(!blocked) << k;
            known.blocked |= u8::from(blocked) << k;
        }
    }
}
