//! Fills the cells around a light: of each caster, the cells that its box can be seen through, and those that a convex solid
//! fills.

use super::super::spare::Spare;
use super::casters::{Caster, Casters, caster};
use super::drawn::{Casting, Drawn, Settled};
use super::region::{Regions, slack_at};
use super::seen::{Seen, relative};
use super::tile::{Tile, Tiled, tiles};
use super::triangles::ShowTriangles;
use super::{Cell, FACES, Face, LightBuffer, List};
use crate::compile::{Geometry, class};
use crate::lane::Scalar;
use glam::DVec3;
use rayon::prelude::*;
use std::borrow::Cow;

/// Cells are held in single precision: depths are kept off by so many parts.
pub(super) const DEPTH_ROUNDING: f64 = 8.0 * f32::EPSILON as f64;
/// What a point's place in its cell may be off by, in cells: half of it by the point, half by single precision.
pub(super) const CELL_ROUNDING: f64 = 1e-3;
/// What a point's place at depth 1 may be off by, in roundings; cells are not made finer than that allows.
const ACROSS_ROUNDINGS: f64 = 8.0;
/// So many columns or rows a face has at most: numbers as large are rounded six times in single precision (the way across and
/// the way ahead, the cells in a unit, their quotient, their product, and the edge).
pub(super) const MOST_ACROSS: f64 = 0.5 * CELL_ROUNDING / (6.0 * f32::UNIT_ROUNDOFF);
/// Faces go a little beyond the cube's edges, so that a point that rounding puts on the next face finds what is there.
pub(super) const EDGE: f64 = 1.0 + 1e-3;
/// All casters of one light are drawn into at most so many times as many cells as there are, by coarser cells if need be.
const OVERDRAW: usize = 16;

/// The most cells in a unit, for points within a unit across and up.
pub(super) fn finest_scale(roundoff: f64) -> f64 {
    0.5 * CELL_ROUNDING / (ACROSS_ROUNDINGS * roundoff)
}

/// Axes and direction of a face: along, across, up, and whether it looks the negative way.
pub(super) fn axes(face: usize) -> (usize, usize, usize, bool) {
    let along = face / 2;
    (along, (along + 1) % 3, (along + 2) % 3, face % 2 == 1)
}

/// Memory that filling leaves to the next light's.
#[derive(Default)]
pub struct Room {
    views: Spare<View>,
    drawn: Spare<Drawn>,
    settled: Spare<Settled>,
}

/// What a light sees.
#[derive(Default)]
struct View {
    /// Through each face.
    seen: [Seen; FACES],
    /// The same tile by tile.
    tiled: [Tiled; FACES],
}

/// The light's buffer at `location`, of about so many cells; `None` if casters other than triangles would have to be drawn into
/// more than `most` of them, one by one.
pub fn fill<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    casters: &Casters,
    location: DVec3,
    (cells, most): (usize, f64),
    room: &Room,
) -> Option<LightBuffer> {
    let slack = slack_at::<S>(location, casters.bounds);
    let mut buffer = LightBuffer {
        location,
        faces: [Face::default(); FACES],
        cells: Vec::new(),
        lists: Vec::new(),
        candidates: Vec::new(),
        sheets: [0, 1].map(|k| {
            let (kind, opaque) = &casters.triangles[k];
            let first = scene.base[*kind as usize];
            first..first + if opaque.iter().all(|&opaque| opaque) { opaque.len() as u32 } else { 0 }
        }),
        regions: Regions::of(casters, location, slack),
    };
    room.views.lend(|View { seen, tiled }| {
        let others = show(scene, casters, (seen, slack), &mut buffer);
        let (laid, outlined) = lay_out(&mut buffer, seen, cells, S::UNIT_ROUNDOFF);
        if outlined > most {
            return None;
        }
        for ((seen, tiled), face) in seen.iter().zip(&mut *tiled).zip(&buffer.faces) {
            tiled.take(seen, face);
        }
        buffer.cells.resize(laid, Cell::EMPTY);
        buffer.lists.resize(laid, List::NONE);
        let all = match &others[..] {
            [] => Cow::Borrowed(&casters.all[..]),
            others => Cow::Owned([&casters.all[..], others].concat()),
        };
        let triangles = casters.triangles.each_ref().map(|(kind, _)| *kind);
        settle(&Casting { scene, casters: &all, triangles }, (tiled, slack), room, &mut buffer);
        Some(buffer)
    })
}

/// Shows the light all casters. Returns those triangles that are seen like other things, whose numbers follow on the rest's.
fn show<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    casters: &Casters,
    (seen, slack): (&mut [Seen; FACES], f64),
    buffer: &mut LightBuffer,
) -> Vec<Caster> {
    let location = buffer.location;
    seen.iter_mut().for_each(Seen::clear);
    // False if the light is in the caster's box.
    let show = |seen: &mut [Seen; FACES], number: usize, caster: &Caster| {
        let (min, max) = relative(caster, location, slack);
        let around = min.max(-max).max_element() <= 0.0;
        for (face, seen) in seen.iter_mut().enumerate().filter(|_| !around) {
            seen.add(face, number as u32, (min, max));
        }
        !around
    };
    for (number, caster) in casters.all.iter().enumerate() {
        if !show(seen, number, caster) {
            buffer.regions.enter(caster, location, slack);
        }
    }
    // Triangles that are part of sheets, and others.
    let mut others = Vec::new();
    for (number, (kind, opaque)) in casters.triangles.iter().enumerate() {
        let show = ShowTriangles { kind: number, opaque, location, seen: &mut *seen };
        let rows = scene.columns.with(*kind as u8, show);
        others.extend(rows.into_iter().map(|row| caster(scene, (*kind as u8, class::BLOCKS), row)));
    }
    for (number, caster) in others.iter().enumerate() {
        if !show(seen, casters.all.len() + number, caster) {
            buffer.regions.give_up();
        }
    }
    others
}

/// Settles all cells, tile by tile: threads that are done with their lights help with the tiles of others'.
fn settle<S: Scalar, B: Scalar>(
    what: &Casting<S, B>,
    (tiled, slack): (&[Tiled; FACES], f64),
    room: &Room,
    buffer: &mut LightBuffer,
) {
    let LightBuffer { location, faces, .. } = *buffer;
    let lights: [Light; FACES] =
        std::array::from_fn(|number| Light { location, number, face: faces[number], slack });
    let tiles: Vec<(&Light, Tile)> =
        lights.iter().flat_map(|light| tiles(&light.face).map(move |tile| (light, tile))).collect();
    let of_tile = |&(light, tile): &(&Light, Tile)| {
        let mut settled = room.settled.take();
        room.drawn.lend(|drawn| drawn.tile(what, light, (&tiled[light.number], tile), &mut settled));
        settled
    };
    let all: Vec<Settled> = tiles.par_iter().map(of_tile).collect();
    buffer.candidates.reserve_exact(all.iter().map(|settled| settled.candidates.len()).sum());
    for ((light, tile), settled) in tiles.into_iter().zip(all) {
        let before = buffer.candidates.len();
        for (k, (cell, list)) in (0..).zip(settled.cells.iter().zip(&settled.lists)) {
            let (column, row) = tile.place(k);
            let place = (light.face.first + row * light.face.columns + column) as usize;
            (buffer.cells[place], buffer.lists[place]) = (*cell, list.after(before));
        }
        buffer.candidates.extend_from_slice(&settled.candidates);
        room.settled.give_back(settled);
    }
}

/// Spreads cells over what is seen through the faces: how many, and into how many of them casters other than facets will be drawn.
fn lay_out(buffer: &mut LightBuffer, seen: &[Seen; FACES], cells: usize, roundoff: f64) -> (usize, f64) {
    let frames: Vec<_> = seen.iter().map(Seen::frame).collect();
    let area = |[across, up]: &[[f64; 2]; 2]| (across[1] - across[0]) * (up[1] - up[0]);
    let whole: f64 = frames.iter().flatten().map(area).sum();
    let scale = if whole > 0.0 { (cells as f64 / whole).sqrt().min(finest_scale(roundoff)) } else { 1.0 };
    let mut scale = f64::from(scale as f32);
    let most = (OVERDRAW * cells + seen.iter().map(|seen| 4 * seen.len()).sum::<usize>()) as f64;
    loop {
        let count = |[low, high]: [f64; 2]| ((high - low) * scale + 2.0 * CELL_ROUNDING).floor() + 1.0;
        let laid: f64 = frames.iter().flatten().map(|[across, up]| count(*across) * count(*up)).sum();
        let longest = frames.iter().flatten().flatten().map(|side| count(*side)).fold(0.0, f64::max);
        // What is seen edge-on would have rows of cells without end.
        if laid <= (2 * cells + FACES) as f64 && longest <= MOST_ACROSS {
            let mut first = 0;
            for (face, frame) in buffer.faces.iter_mut().zip(&frames) {
                let Some([across, up]) = frame else { continue };
                let corner = [across[0], up[0]].map(|low| low - CELL_ROUNDING / scale);
                let (columns, rows) = (count(*across) as u32, count(*up) as u32);
                *face = Face { first, columns, rows, corner, scale, width: 1.0 / scale };
                first += columns * rows;
            }
            let outlined = through_all(buffer, seen, Seen::outlined);
            let faceted = through_all(buffer, seen, Seen::faceted);
            if laid <= FACES as f64 || outlined + faceted <= most {
                return (first as usize, outlined);
            }
        }
        scale *= 0.5;
    }
}

/// How many cells casters of a light are drawn into, as `count` has it of those seen through a face.
fn through_all(buffer: &LightBuffer, seen: &[Seen; FACES], count: impl Fn(&Seen, &Face) -> f64) -> f64 {
    buffer.faces.iter().zip(seen).map(|(face, seen)| count(seen, face)).sum()
}

/// A light, and the face that is looked through.
pub(super) struct Light {
    pub location: DVec3,
    /// The face's number, and how it is laid out.
    pub number: usize,
    pub face: Face,
    /// What casters are grown by.
    pub slack: f64,
}
