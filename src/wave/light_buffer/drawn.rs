//! Draws what a light sees into the cells of a tile.

use super::among::Candidate;
use super::ball::Ball;
use super::casters::Caster;
use super::cell::{Entry, Settle, TRIANGLE};
use super::raster::{DEPTH_ROUNDING, Light, axes};
use super::seen::{Four, Outline, Sides, number_of, relative};
use super::sheet::Facet;
use super::tile::{Tile, Tiled};
use super::triangles::DrawTriangles;
use super::{Cell, List};
use crate::compile::{Geometry, Kind, NO_SURFACE, WithBlock};
use crate::kernel::{Block, Looking, Rays};
use crate::lane::{LANES, Lane, Scalar, Vec3, f64x8, prefetch};

/// So many casters before one is drawn, it is asked for.
const AHEAD: usize = 8;

/// What is known of a tile's cells, one after the other.
#[derive(Default)]
pub(super) struct Settled {
    pub cells: Vec<Cell>,
    pub lists: Vec<List>,
    /// The lists begin here.
    pub candidates: Vec<Candidate>,
}

/// What lights see.
pub(super) struct Casting<'a, S: Scalar, B: Scalar> {
    pub scene: &'a Geometry<S, B>,
    /// By the numbers that outlines have.
    pub casters: &'a [Caster],
    /// By the numbers that fours have.
    pub triangles: [Kind; 2],
}

/// What is drawn into a tile's cells.
#[derive(Default)]
pub(super) struct Drawn {
    tile: Tile,
    facets: Vec<Facet>,
    /// One thing after the other, in their cells.
    entries: Vec<(u32, Entry)>,
    /// By cell, from where on a convex solid fills it.
    dark: Vec<f32>,
    /// The entries cell by cell, and by cell where they begin.
    by_cell: Vec<Entry>,
    begin: Vec<u32>,
    /// Casters, the nearest first, as [`Tiled`] knows them.
    order: Vec<u64>,
    /// Depths at the corners of a caster's cells.
    corners: Vec<f64>,
}

impl Drawn {
    /// Finds what `light` sees through the cells of a tile of its face.
    pub fn tile<S: Scalar, B: Scalar>(
        &mut self,
        what: &Casting<S, B>,
        light: &Light,
        (tiled, tile): (&Tiled, Tile),
        settled: &mut Settled,
    ) {
        self.begin(tile);
        for fours in tiled.fours.of(tile.number).chunk_by(|a, b| Four::of(*a).kind == Four::of(*b).kind) {
            let kind = what.triangles[Four::of(fours[0]).kind] as u8;
            let base = what.scene.base[usize::from(kind)];
            what.scene.columns.with(kind, DrawTriangles { fours, base, light, drawn: &mut *self });
        }
        // The nearest first: what lies behind what fills a cell is not put into it.
        let mut order = std::mem::take(&mut self.order);
        order.clear();
        order.extend_from_slice(tiled.outlines.of(tile.number));
        order.sort_unstable();
        for (k, &named) in order.iter().enumerate() {
            // In this order they are all over the memory, and of a large scene more than a cache holds.
            if let Some(&ahead) = order.get(k + AHEAD) {
                prefetch(&what.casters[number_of(ahead)]);
            }
            self.draw(what, number_of(named), light);
        }
        self.order = order;
        self.settle(what, settled);
    }

    /// Nothing yet in the cells of `tile`.
    fn begin(&mut self, tile: Tile) {
        self.tile = tile;
        self.facets.clear();
        self.entries.clear();
        self.dark.clear();
        self.dark.resize(tile.len(), f32::INFINITY);
    }

    /// Adds a triangle that is seen through these columns and rows of its face.
    #[inline(always)]
    pub fn add_facet(&mut self, facet: Facet, cells: [[u32; 2]; 2]) {
        let Self { tile, facets, entries, .. } = self;
        let Some([columns, rows]) = tile.part_of(cells) else { return };
        let Facet { near, far, .. } = facet;
        let entry = Entry { near, far, what: TRIANGLE | facets.len() as u32, surface: NO_SURFACE };
        facets.push(facet);
        for row in rows[0]..=rows[1] {
            for column in columns[0]..=columns[1] {
                entries.push((tile.cell(column, row), entry));
            }
        }
    }

    /// Draws caster number `number` into the cells that nothing drawn before it fills.
    fn draw<S: Scalar, B: Scalar>(&mut self, what: &Casting<S, B>, number: usize, light: &Light) {
        let caster = &what.casters[number];
        let Light { location, number: of_face, face, slack } = light;
        let (min, max) = relative(caster, *location, *slack);
        let Some(outline) = Outline::through(*of_face, min, max) else { return };
        let cells = outline.cells(face);
        let Some(part) = self.tile.part_of(cells) else { return };
        let first = self.entries.len();
        let (ball, sides) = (Ball::of(caster, light), Sides::through(*of_face, min, max));
        let [[left, right], [low, high]] = part;
        for row in low..=high {
            let near = outline.near.max(sides.depth_in(1, row, face));
            for column in left..=right {
                let mut near = near.max(sides.depth_in(0, column, face));
                if let Some(ball) = &ball {
                    let Some(depth) = ball.depth_in([column, row], face) else { continue };
                    near = near.max(depth);
                }
                let near = (near * (1.0 - DEPTH_ROUNDING) - slack) as f32;
                let cell = self.tile.cell(column, row);
                if near <= self.dark[cell as usize] {
                    let (what, surface) = (number as u32, caster.surface);
                    self.entries.push((cell, Entry { near, far: f32::INFINITY, what, surface }));
                }
            }
        }
        // What is two cells wide has none but those on its rim.
        let has_inner = cells.iter().all(|[first, last]| last - first >= 2);
        if caster.blocks && has_inner && self.entries.len() > first {
            self.block(what.scene, caster, light, (part, first));
        }
    }

    /// Tells the cells that a convex solid fills from where on they are dark: those of `part` of the tile, from the entry numbered
    /// `first` on.
    ///
    /// The ways that meet a convex solid from outside make a convex cone: where the cell's four corners meet it, all of
    /// the cell does. In the coordinates across / along, up / along, 1 / along it is convex as well, so that the inverse of the
    /// depth where it is entered is a concave function over the cell, and the depth greatest in a corner.
    fn block<S: Scalar, B: Scalar>(
        &mut self,
        scene: &Geometry<S, B>,
        caster: &Caster,
        light: &Light,
        ([[left, right], [low, high]], first): ([[u32; 2]; 2], usize),
    ) {
        let Self { tile, entries, dark, corners: depths, .. } = self;
        let (Light { face, .. }, (_, across, up, backward)) = (light, axes(light.number));
        let columns = (right - left + 2) as usize;
        let corners = columns * (high - low + 2) as usize;
        depths.clear();
        for eight in (0..corners).step_by(LANES) {
            let corner = |k: usize| (eight + k) % columns;
            let mut dir = [f64x8::lit(if backward { -1.0 } else { 1.0 }); 3];
            dir[across] = f64x8::from_fn(|k| face.place(0, f64::from(left + corner(k) as u32))).in_register();
            dir[up] = f64x8::from_fn(|k| face.place(1, f64::from(low + ((eight + k) / columns) as u32)))
                .in_register();
            let dir = Vec3::new(dir[0], dir[1], dir[2]);
            let length = dir.length();
            let rays =
                Rays { origin: Vec3::splat(light.location), dir: (dir * (f64x8::lit(1.0) / length)).cast() };
            let t = scene.columns.with(caster.kind, Pierce { row: caster.row as usize, rays: &rays });
            depths.extend_from_slice(&(t.to_f64s() / length).to_array());
        }
        for (cell, entry) in &mut entries[first..] {
            let (column, row) = tile.place(*cell);
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

    /// Puts what is drawn into the order of its cells.
    fn sort(&mut self) {
        let Self { tile, entries, by_cell, begin, .. } = self;
        begin.clear();
        begin.resize(tile.len() + 1, 0);
        for &(cell, _) in &*entries {
            begin[cell as usize] += 1;
        }
        let mut end = 0;
        for place in &mut *begin {
            end += *place;
            *place = end;
        }
        by_cell.clear();
        by_cell.resize(entries.len(), Entry::default());
        // From each cell's end on.
        for &(cell, entry) in &*entries {
            let place = &mut begin[cell as usize];
            *place -= 1;
            by_cell[*place as usize] = entry;
        }
    }

    /// Settles the cells from what is drawn.
    fn settle<S: Scalar, B: Scalar>(&mut self, what: &Casting<S, B>, settled: &mut Settled) {
        self.sort();
        let Self { tile, facets, by_cell, begin, .. } = self;
        let how = Settle { scene: what.scene, casters: what.casters, facets };
        let Settled { cells, lists, candidates } = settled;
        cells.clear();
        lists.clear();
        candidates.clear();
        for k in 0..tile.len() {
            let entries = &mut by_cell[begin[k] as usize..begin[k + 1] as usize];
            let (cell, list) = how.cell(entries, tile.place(k as u32), candidates);
            cells.push(cell);
            lists.push(list);
        }
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
