//! Fills the cells around a light: of each caster, the cells that its box can be seen through, and those that a convex solid
//! fills.

use super::casters::{Caster, Casters, Region};
use super::{Cell, FACES, Face, LightBuffer};
use crate::compile::{Compiled, WithBlock};
use crate::kernel::{Block, Looking, Rays, View};
use crate::lane::{LANES, Lane, Scalar, Vec3, f64x8};
use glam::DVec3;

/// What columns, points and depths may be off by, in roundings of the scene's reach: a few each for a point on a surface, the
/// light's place and a crossing.
const ROUNDINGS: f64 = 64.0;
/// Cells are held in single precision: depths are kept off by so many parts.
const DEPTH_ROUNDING: f64 = 8.0 * f32::EPSILON as f64;
/// What a point's place in its cell may be off by, in cells: two roundings of single precision in a few hundred.
const CELL_ROUNDING: f64 = 1e-3;
/// What a point's place at depth 1 may be off by, in roundings; cells are not made finer than that allows.
const ACROSS_ROUNDINGS: f64 = 8.0;
/// Faces go a little beyond the cube's edges, so that a point that rounding puts on the next face finds what is there.
const EDGE: f64 = 1.0 + 1e-3;
/// All casters of one light are drawn into at most so many times as many cells as there are, by coarser cells if need be.
const OVERDRAW: usize = 16;

/// A caster as the light sees it through one face.
struct Outline {
    /// Least and greatest coordinate across and up, at depth 1.
    across: [f64; 2],
    up: [f64; 2],
    /// Least depth.
    near: f64,
    /// The box relative to the light, across and up: least and greatest.
    sides: [[f64; 2]; 2],
}

/// Axes and direction of a face: along, across, up, and whether it looks the negative way.
fn axes(face: usize) -> (usize, usize, usize, bool) {
    let along = face / 2;
    (along, (along + 1) % 3, (along + 2) % 3, face % 2 == 1)
}

impl Outline {
    /// Of a box from `min` to `max` relative to the light, which is outside of it; `None` if it is not seen through
    /// `face`.
    fn through(face: usize, min: DVec3, max: DVec3) -> Option<Self> {
        let (along, across, up, backward) = axes(face);
        let (nearest, farthest) =
            if backward { (-max[along], -min[along]) } else { (min[along], max[along]) };
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
    fn cells(&self, face: &Face) -> [[u32; 2]; 2] {
        let range = |[low, high]: [f64; 2], corner: f64, most: u32| {
            let place = |x: f64, by: f64| ((x - corner) * face.scale + by).max(0.0) as u32;
            [place(low, -CELL_ROUNDING), place(high, CELL_ROUNDING)].map(|cell| cell.min(most - 1))
        };
        [range(self.across, face.corner[0], face.columns), range(self.up, face.corner[1], face.rows)]
    }

    /// The least depth at which the box's side number `side` can be met in cell number `cell` along it.
    fn depth_in(&self, side: usize, cell: u32, face: &Face) -> f64 {
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

/// The light's buffer at `location`.
pub fn fill<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    casters: &Casters,
    location: DVec3,
    cells: usize,
) -> LightBuffer {
    let far = casters.bounds.map_or(0.0, |b| b.min.abs().max(b.max.abs()).max_element());
    let slack = ROUNDINGS * S::UNIT_ROUNDOFF * location.abs().max_element().max(far);
    let mut buffer = LightBuffer {
        location,
        faces: [Face::default(); FACES],
        cells: Vec::new(),
        regions: Vec::new(),
        complete: casters.complete,
    };
    for plane in &casters.planes {
        match Region::beside(plane, location, slack) {
            Some(region) => buffer.regions.push(region),
            None => buffer.complete = false,
        }
    }

    // What is seen through each face.
    let mut seen: [Vec<(u32, Outline)>; FACES] = Default::default();
    for (number, caster) in casters.all.iter().enumerate() {
        let (min, max) = (caster.bounds.min - location - slack, caster.bounds.max - location + slack);
        if min.max(-max).max_element() <= 0.0 {
            match Region::within(caster, location, slack) {
                Some(region) => buffer.regions.push(region),
                None => buffer.complete = false,
            }
            continue;
        }
        for (face, seen) in seen.iter_mut().enumerate() {
            seen.extend(Outline::through(face, min, max).map(|outline| (number as u32, outline)));
        }
    }
    lay_out(&mut buffer, &seen, cells, S::UNIT_ROUNDOFF);
    for (number, seen) in seen.iter().enumerate() {
        let face = buffer.faces[number];
        let cells = &mut buffer.cells[face.first as usize..][..(face.columns * face.rows) as usize];
        let mut entries = Vec::new();
        for (caster, outline) in seen {
            let caster = &casters.all[*caster as usize];
            let places = outline.cells(&face);
            draw(caster, outline, &face, places, slack, cells);
            if caster.blocks {
                let light = Light { location, face: number, slack };
                block(scene, caster, &light, &face, places, (&mut entries, cells));
            }
        }
    }
    buffer
}

/// Spreads cells over what is seen through the faces.
fn lay_out(buffer: &mut LightBuffer, seen: &[Vec<(u32, Outline)>; FACES], cells: usize, roundoff: f64) {
    let both = |a: [f64; 2], b: [f64; 2]| [a[0].min(b[0]), a[1].max(b[1])];
    let frames: Vec<Option<[[f64; 2]; 2]>> = seen
        .iter()
        .map(|seen| {
            let outlines = seen.iter().map(|(_, outline)| [outline.across, outline.up]);
            outlines.reduce(|a, b| [both(a[0], b[0]), both(a[1], b[1])])
        })
        .collect();
    let area = |[across, up]: &[[f64; 2]; 2]| (across[1] - across[0]) * (up[1] - up[0]);
    let whole: f64 = frames.iter().flatten().map(area).sum();
    let finest = CELL_ROUNDING / (ACROSS_ROUNDINGS * roundoff);
    let mut scale = if whole > 0.0 { (cells as f64 / whole).sqrt().min(finest) } else { 1.0 };
    let most = (OVERDRAW * cells + seen.iter().map(|seen| 4 * seen.len()).sum::<usize>()) as f64;
    loop {
        let count = |[low, high]: [f64; 2]| ((high - low) * scale + 2.0 * CELL_ROUNDING).floor() + 1.0;
        let laid: f64 = frames.iter().flatten().map(|[across, up]| count(*across) * count(*up)).sum();
        // What is seen edge-on would have rows of cells without end.
        if laid <= (2 * cells + FACES) as f64 {
            let mut first = 0;
            for (face, frame) in buffer.faces.iter_mut().zip(&frames) {
                let Some([across, up]) = frame else { continue };
                let corner = [across[0], up[0]].map(|low| low - CELL_ROUNDING / scale);
                let (columns, rows) = (count(*across) as u32, count(*up) as u32);
                *face = Face { first, columns, rows, corner, scale };
                first += columns * rows;
            }
            if laid <= FACES as f64 || drawn(buffer, seen) <= most {
                buffer.cells = vec![Cell::EMPTY; first as usize];
                return;
            }
        }
        scale *= 0.5;
    }
}

/// How many cells all casters of a light are drawn into.
fn drawn(buffer: &LightBuffer, seen: &[Vec<(u32, Outline)>; FACES]) -> f64 {
    let count = |[first, last]: [u32; 2]| f64::from(last - first + 1);
    let faces = buffer.faces.iter().zip(seen);
    let places = faces.flat_map(|(face, seen)| seen.iter().map(|(_, outline)| outline.cells(face)));
    places.map(|[columns, rows]| count(columns) * count(rows)).sum()
}

/// Tells the cells that a caster is seen through how near it may be.
fn draw(
    caster: &Caster,
    outline: &Outline,
    face: &Face,
    places: [[u32; 2]; 2],
    slack: f64,
    cells: &mut [Cell],
) {
    let [[left, right], [low, high]] = places;
    for row in low..=high {
        let near = outline.near.max(outline.depth_in(1, row, face));
        for column in left..=right {
            let near = near.max(outline.depth_in(0, column, face));
            let near = (near * (1.0 - DEPTH_ROUNDING) - slack) as f32;
            let cell = &mut cells[(row * face.columns + column) as usize];
            if caster.surface == cell.nearest {
                cell.near = cell.near.min(near);
            } else if near < cell.near {
                cell.near_but_one = cell.near;
                (cell.near, cell.nearest) = (near, caster.surface);
            } else {
                cell.near_but_one = cell.near_but_one.min(near);
            }
        }
    }
}

/// A light, and the face that is looked through.
struct Light {
    location: DVec3,
    face: usize,
    slack: f64,
}

/// Tells the cells that a convex solid fills from where on they are dark.
///
/// The ways that meet a convex solid from outside make a convex cone: where the cell's four corners meet it, all of
/// the cell does. In the coordinates across / along, up / along, 1 / along it is convex as well, so that the inverse of the
/// depth where it is entered is a concave function over the cell, and the depth greatest in a corner.
fn block<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    caster: &Caster,
    light: &Light,
    face: &Face,
    places: [[u32; 2]; 2],
    (entries, cells): (&mut Vec<f64>, &mut [Cell]),
) {
    let [[left, right], [low, high]] = places;
    if right - left < 2 || high - low < 2 {
        return; // No cell but those on its rim.
    }
    let (_, across, up, backward) = axes(light.face);
    let columns = (right - left + 2) as usize;
    let corners = columns * (high - low + 2) as usize;
    entries.clear();
    for first in (0..corners).step_by(LANES) {
        let place = |side: usize, edge: u32| face.corner[side] + f64::from(edge) / face.scale;
        let corner = |k: usize| (first + k) % columns;
        let mut dir = [f64x8::lit(if backward { -1.0 } else { 1.0 }); 3];
        dir[across] = f64x8::from_fn(|k| place(0, left + corner(k) as u32));
        dir[up] = f64x8::from_fn(|k| place(1, low + ((first + k) / columns) as u32));
        let dir = Vec3::new(dir[0], dir[1], dir[2]);
        let length = dir.length();
        let rays =
            Rays { origin: Vec3::splat(light.location), dir: (dir * (f64x8::lit(1.0) / length)).cast() };
        let t = scene.columns.with(caster.kind, Entry { row: caster.row as usize, rays: &rays });
        entries.extend_from_slice(&(t.to_f64s() / length).to_array());
    }
    for row in low..=high {
        for column in left..=right {
            let corner = (row - low) as usize * columns + (column - left) as usize;
            let four = [corner, corner + 1, corner + columns, corner + columns + 1].map(|c| entries[c]);
            if four.iter().any(|depth| depth.is_nan()) {
                continue;
            }
            let depth = four.into_iter().fold(0.0, f64::max);
            let depth = (depth * (1.0 + DEPTH_ROUNDING) + light.slack) as f32;
            let cell = &mut cells[(row * face.columns + column) as usize];
            cell.blocked = cell.blocked.min(depth);
        }
    }
}

/// Where eight rays first meet a primitive; NaN where they do not.
struct Entry<'a, L> {
    row: usize,
    rays: &'a Rays<L>,
}

impl<S: Scalar> WithBlock<S> for Entry<'_, S::Lane> {
    type Output = S::Lane;

    fn block<K: Block<S>>(self, block: &K) -> S::Lane {
        let looking = Looking { from: S::Lane::zero(), to: S::Lane::lit(f64::INFINITY), lanes: !0 };
        block.first(self.row, self.rays, &View::default(), None, &looking)
    }
}
