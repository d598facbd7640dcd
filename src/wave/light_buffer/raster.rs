//! Fills the cells around a light: of each caster, the cells that its box can be seen through, and those that a convex solid
//! fills.

use super::ball::Ball;
use super::casters::{Caster, Casters, caster};
use super::cell::{Entry, Settle, TRIANGLE};
use super::region::{Regions, slack_at};
use super::seen::{Seen, Sides, relative};
use super::sheet::{Facet, Figures};
use super::{FACES, Face, LightBuffer};
use crate::compile::{Geometry, NO_SURFACE, SurfaceId, WithBlock, class};
use crate::kernel::{Block, Looking, Rays};
use crate::lane::{LANES, Lane, QUAD, Scalar, Vec3, bits, f64x8, prefetch};
use glam::DVec3;
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
/// So many casters before one is drawn, it is asked for.
const AHEAD: usize = 8;
/// All casters of one light are drawn into at most so many times as many cells as there are, by coarser cells if need be.
const OVERDRAW: usize = 16;

/// Axes and direction of a face: along, across, up, and whether it looks the negative way.
pub(super) fn axes(face: usize) -> (usize, usize, usize, bool) {
    let along = face / 2;
    (along, (along + 1) % 3, (along + 2) % 3, face % 2 == 1)
}

/// Memory that filling leaves to the next light's: fresh pages cost more than what is written to them.
#[derive(Default)]
pub struct Room {
    /// What is seen through each face.
    seen: [Seen; FACES],
    drawn: Drawn,
    /// Numbers of what is seen through a face, under how near it is: in order.
    order: Vec<u64>,
    /// Depths at the corners of a caster's cells.
    corners: Vec<f64>,
}

/// The light's buffer at `location`, of about so many cells; `None` if casters other than triangles would have to be drawn into
/// more than `most` of them, one by one.
pub fn fill<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    casters: &Casters,
    location: DVec3,
    (cells, most): (usize, f64),
    room: &mut Room,
) -> Option<LightBuffer> {
    let slack = slack_at::<S>(location, casters);
    let mut buffer = LightBuffer {
        location,
        faces: [Face::default(); FACES],
        cells: Vec::new(),
        lists: Vec::new(),
        candidates: Vec::new(),
        sheets: [0..0, 0..0],
        regions: Regions::of(casters, location, slack),
    };

    let Room { seen, drawn, order, corners } = room;
    seen.iter_mut().for_each(Seen::clear);
    // Shows the light a caster; false if it is in its box.
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
    for (kind, opaque) in &casters.triangles {
        let rows = scene.columns.with(*kind as u8, Expect { opaque, location, seen: &mut *seen });
        others.extend(rows.into_iter().map(|row| caster(scene, (*kind as u8, class::BLOCKS), row)));
    }
    for (number, caster) in others.iter().enumerate() {
        if !show(seen, casters.all.len() + number, caster) {
            buffer.regions.give_up();
        }
    }
    buffer.sheets = [0, 1].map(|k| {
        let (kind, opaque) = &casters.triangles[k];
        let first = scene.base[*kind as usize];
        first..first + if opaque.iter().all(|&opaque| opaque) { opaque.len() as u32 } else { 0 }
    });
    let all = match &others[..] {
        [] => Cow::Borrowed(&casters.all[..]),
        others => Cow::Owned([&casters.all[..], others].concat()),
    };
    let (laid, room) = lay_out(&mut buffer, seen, cells, S::UNIT_ROUNDOFF);
    if room[0] > most {
        return None;
    }
    seen.iter_mut().for_each(Seen::reserve);
    drawn.clear(laid, room);
    for (kind, opaque) in &casters.triangles {
        let (base, faces) = (scene.base[*kind as usize], &buffer.faces);
        let (seen, drawn) = (&mut *seen, &mut *drawn);
        scene.columns.with(*kind as u8, Place { opaque, base, location, slack, faces, seen, drawn });
    }
    for (number, seen) in seen.iter_mut().enumerate() {
        let face = buffer.faces[number];
        let light = Light { location, number, face, slack };
        drawn.begin(&face);
        // The nearest first: what lies behind what fills a cell is not put into it.
        order.clear();
        order.extend(
            seen.outlines.iter().zip(0u64..).map(|((_, outline), number)| {
                u64::from((outline.near as f32).to_bits()) << u32::BITS | number
            }),
        );
        order.sort_unstable();
        let outline = |number: u64| &seen.outlines[number as u32 as usize];
        for (k, &number) in order.iter().enumerate() {
            // In this order they are all over the memory, and of a large scene more than a cache holds.
            if let Some(&ahead) = order.get(k + 2 * AHEAD) {
                prefetch(outline(ahead));
            }
            if let Some(&ahead) = order.get(k + AHEAD) {
                prefetch(&all[outline(ahead).0 as usize]);
            }
            let &(name, ref outline) = outline(number);
            let caster = &all[name as usize];
            let places = outline.cells(&face);
            let first = drawn.draw(name, (caster, outline.near), &light, places);
            if caster.blocks {
                block(scene, caster, &light, places, (corners, drawn, first));
            }
        }
        drawn.settle(&Settle { scene, casters: &all, facets: &seen.facets }, &face, &mut buffer);
    }
    Some(buffer)
}

/// Hands triangles that are opaque to `with` as the light sees them, four at a time where they are seen through one face: the
/// fours' number, and those among them. Returns the rows of those that are not seen well within a face.
#[inline(always)]
fn each_figure<S: Scalar>(
    block: &impl Block<S>,
    opaque: &[bool],
    location: DVec3,
    mut with: impl FnMut(usize, u8, &Figures),
) -> Vec<u32> {
    let mut rest = Vec::new();
    for (four, opaque) in opaque.chunks(QUAD).enumerate() {
        let Some(corners) = block.corners_in_four(four) else { return rest };
        let wanted = opaque.iter().enumerate().fold(0, |lanes, (k, &opaque)| lanes | u8::from(opaque) << k);
        let all = Figures::of(&corners, location);
        with(four, all.within & wanted, &all);
        for k in bits(wanted & !all.within) {
            // Perhaps another face's.
            let alone = Figures::of(&corners.map(|lanes| [lanes[k]; QUAD]), location);
            if alone.within != 0 {
                with(four, 1 << k, &alone);
            } else {
                rest.push((four * QUAD + k) as u32);
            }
        }
    }
    rest
}

/// Tells what is seen through faces what room triangles will take; returns the rows of those that are no facets.
struct Expect<'a> {
    opaque: &'a [bool],
    location: DVec3,
    seen: &'a mut [Seen; FACES],
}

impl<S: Scalar> WithBlock<S> for Expect<'_> {
    type Output = Vec<u32>;

    #[inline(always)]
    fn block<K: Block<S>>(self, block: &K) -> Vec<u32> {
        let Self { opaque, location, seen } = self;
        each_figure(block, opaque, location, |_, lanes, figures| seen[figures.face].expect(figures, lanes))
    }
}

/// Shows the light those that are, once faces are laid out.
struct Place<'a> {
    opaque: &'a [bool],
    base: SurfaceId,
    location: DVec3,
    slack: f64,
    faces: &'a [Face; FACES],
    seen: &'a mut [Seen; FACES],
    drawn: &'a mut Drawn,
}

impl<S: Scalar> WithBlock<S> for Place<'_> {
    type Output = ();

    #[inline(always)]
    fn block<K: Block<S>>(self, block: &K) {
        let Self { opaque, base, location, slack, faces, seen, drawn } = self;
        each_figure(block, opaque, location, |four, lanes, figures| {
            let (first, face) = (base + (four * QUAD) as u32, &faces[figures.face]);
            let facets = &mut seen[figures.face].facets;
            figures.each_facet(lanes, face, (first, slack), |facet, [columns, rows]| {
                let number = facets.len() as u32;
                facets.push(facet);
                for row in rows[0]..=rows[1] {
                    for column in columns[0]..=columns[1] {
                        drawn.put(face.first + row as u32 * face.columns + column as u32, number);
                    }
                }
            });
        });
    }
}

/// What is drawn into cells.
#[derive(Default)]
struct Drawn {
    /// Casters in their cells, one caster after the other: those of one face.
    outlined: Vec<(u32, Entry)>,
    /// By cell of that face, from where on one of them fills it.
    dark: Vec<f32>,
    /// What is outlined, cell by cell, and by cell where it begins.
    by_cell: Vec<Entry>,
    begin: Vec<u32>,
    /// By cell of all faces, if there are facets: the last of its links, or [`NO_LINK`].
    last: Vec<u32>,
    links: Vec<Link>,
    /// What there is in one cell.
    entries: Vec<Entry>,
}

/// One of the facets in a cell. (Facets are drawn row by row, so that those of one cell are near each other in memory. Casters are
/// drawn in the order of their depths: a chain of them would be all over it.)
#[derive(Clone, Copy)]
struct Link {
    /// Number of the facet.
    facet: u32,
    /// The link to what was put there before, or [`NO_LINK`].
    before: u32,
}

const NO_LINK: u32 = u32::MAX;

impl Drawn {
    /// Nothing, in so many cells, with room for about so much outlined and so many facets.
    fn clear(&mut self, cells: usize, [outlined, faceted]: [f64; 2]) {
        self.outlined.clear();
        self.last.clear();
        self.last.resize(if faceted > 0.0 { cells } else { 0 }, NO_LINK);
        self.links.clear();
        // What is not written to is not there.
        self.outlined.reserve(outlined as usize);
        self.links.reserve(faceted as usize);
    }

    /// Nothing outlined yet of a face.
    fn begin(&mut self, face: &Face) {
        self.outlined.clear();
        self.dark.clear();
        self.dark.resize((face.columns * face.rows) as usize, f32::INFINITY);
    }

    /// Outlines a caster, all of which is as far as `near` at least, in the cells of `places` that nothing before it fills: where
    /// in the list that begins.
    fn draw(
        &mut self,
        name: u32,
        (caster, near): (&Caster, f64),
        light: &Light,
        [[left, right], [low, high]]: [[u32; 2]; 2],
    ) -> usize {
        let Light { location, number, face, slack } = light;
        let (first, ball) = (self.outlined.len(), Ball::of(caster, light));
        let (min, max) = relative(caster, *location, *slack);
        let sides = Sides::through(*number, min, max);
        for row in low..=high {
            let near = near.max(sides.depth_in(1, row, face));
            for column in left..=right {
                let mut near = near.max(sides.depth_in(0, column, face));
                if let Some(ball) = &ball {
                    let Some(depth) = ball.depth_in([column, row], face) else { continue };
                    near = near.max(depth);
                }
                let near = (near * (1.0 - DEPTH_ROUNDING) - slack) as f32;
                let cell = row * face.columns + column;
                if near <= self.dark[cell as usize] {
                    let (far, surface) = (f32::INFINITY, caster.surface);
                    self.outlined.push((cell, Entry { near, far, what: name, surface }));
                }
            }
        }
        first
    }

    /// Puts a facet into a cell of all faces.
    #[inline(always)]
    fn put(&mut self, cell: u32, facet: u32) {
        let last = &mut self.last[cell as usize];
        let before = std::mem::replace(last, self.links.len() as u32);
        self.links.push(Link { facet, before });
    }

    /// Puts what is outlined into the order of its cells, of which there are so many.
    fn sort(&mut self, cells: usize) {
        let Self { outlined, by_cell, begin, .. } = self;
        begin.clear();
        begin.resize(cells + 1, 0);
        for &(cell, _) in &*outlined {
            begin[cell as usize] += 1;
        }
        let mut end = 0;
        for place in &mut *begin {
            end += *place;
            *place = end;
        }
        by_cell.clear();
        by_cell.resize(outlined.len(), Entry::default());
        // From each cell's end on.
        for &(cell, entry) in &*outlined {
            let place = &mut begin[cell as usize];
            *place -= 1;
            by_cell[*place as usize] = entry;
        }
    }

    /// Settles all cells of a face, which come next, from the casters drawn and from the facets.
    fn settle<S: Scalar, B: Scalar>(&mut self, how: &Settle<S, B>, face: &Face, buffer: &mut LightBuffer) {
        let cells = face.columns * face.rows;
        self.sort(cells as usize);
        let Self { by_cell, begin, last, links, entries, .. } = self;
        for cell in 0..cells {
            let casters = begin[cell as usize] as usize..begin[cell as usize + 1] as usize;
            entries.clear();
            entries.extend_from_slice(&by_cell[casters]);
            let mut next = last.get((face.first + cell) as usize).copied().unwrap_or(NO_LINK);
            while let Some(&Link { facet, before }) = links.get(next as usize) {
                next = before;
                let Facet { near, far, .. } = how.facets[facet as usize];
                entries.push(Entry { near, far, what: TRIANGLE | facet, surface: NO_SURFACE });
            }
            let place = (cell % face.columns, cell / face.columns);
            let (cell, list) = how.cell(entries, place, &mut buffer.candidates);
            buffer.cells.push(cell);
            buffer.lists.push(list);
        }
    }
}

/// Spreads cells over what is seen through the faces, and makes room for them: how many, and into how many of them casters and facets will
/// be drawn.
fn lay_out(buffer: &mut LightBuffer, seen: &[Seen; FACES], cells: usize, roundoff: f64) -> (usize, [f64; 2]) {
    let frames: Vec<_> = seen.iter().map(Seen::frame).collect();
    let area = |[across, up]: &[[f64; 2]; 2]| (across[1] - across[0]) * (up[1] - up[0]);
    let whole: f64 = frames.iter().flatten().map(area).sum();
    let finest = 0.5 * CELL_ROUNDING / (ACROSS_ROUNDINGS * roundoff);
    let scale = if whole > 0.0 { (cells as f64 / whole).sqrt().min(finest) } else { 1.0 };
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
                buffer.cells.reserve_exact(first as usize);
                buffer.lists.reserve_exact(first as usize);
                return (first as usize, [outlined, faceted]);
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

/// Tells the cells that a convex solid fills from where on they are dark.
///
/// The ways that meet a convex solid from outside make a convex cone: where the cell's four corners meet it, all of
/// the cell does. In the coordinates across / along, up / along, 1 / along it is convex as well, so that the inverse of the
/// depth where it is entered is a concave function over the cell, and the depth greatest in a corner.
fn block<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    caster: &Caster,
    light: &Light,
    [[left, right], [low, high]]: [[u32; 2]; 2],
    (depths, drawn, first): (&mut Vec<f64>, &mut Drawn, usize),
) {
    let Drawn { outlined, dark, .. } = drawn;
    if right - left < 2 || high - low < 2 || outlined.len() == first {
        return; // No cell but those on its rim.
    }
    let (Light { face, .. }, (_, across, up, backward)) = (light, axes(light.number));
    let columns = (right - left + 2) as usize;
    let corners = columns * (high - low + 2) as usize;
    depths.clear();
    for eight in (0..corners).step_by(LANES) {
        let corner = |k: usize| (eight + k) % columns;
        let mut dir = [f64x8::lit(if backward { -1.0 } else { 1.0 }); 3];
        dir[across] = f64x8::from_fn(|k| face.place(0, f64::from(left + corner(k) as u32)));
        dir[up] = f64x8::from_fn(|k| face.place(1, f64::from(low + ((eight + k) / columns) as u32)));
        let dir = Vec3::new(dir[0], dir[1], dir[2]);
        let length = dir.length();
        let rays =
            Rays { origin: Vec3::splat(light.location), dir: (dir * (f64x8::lit(1.0) / length)).cast() };
        let t = scene.columns.with(caster.kind, Pierce { row: caster.row as usize, rays: &rays });
        depths.extend_from_slice(&(t.to_f64s() / length).to_array());
    }
    for (cell, entry) in &mut outlined[first..] {
        let (row, column) = (*cell / face.columns, *cell % face.columns);
        let corner = (row - low) as usize * columns + (column - left) as usize;
        let four = [corner, corner + 1, corner + columns, corner + columns + 1].map(|c| depths[c]);
        if four.iter().any(|depth| depth.is_nan()) {
            continue;
        }
        let depth = four.into_iter().fold(0.0, f64::max);
        entry.far = (depth * (1.0 + DEPTH_ROUNDING) + light.slack) as f32;
        let dark = &mut dark[*cell as usize];
        *dark = dark.min(entry.far);
    }
}

/// Where eight rays first meet a primitive; NaN where they do not.
struct Pierce<'a, L> {
    row: usize,
    rays: &'a Rays<L>,
}

impl<S: Scalar> WithBlock<S> for Pierce<'_, S::Lane> {
    type Output = S::Lane;

    fn block<K: Block<S>>(self, block: &K) -> S::Lane {
        let looking =
            Looking { from: S::Lane::zero(), to: S::Lane::lit(f64::INFINITY), lanes: !0, any: false };
        block.first(self.row, self.rays, None, &looking)
    }
}
