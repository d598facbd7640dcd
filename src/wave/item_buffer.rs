//! Which things may be seen in which pixels of a picture: so that camera rays are held against those, without a tree (Weghorst,
//! Hooper and Greenberg 1984, Improved computational methods for ray tracing: the item buffer).
//!
//! Of things that have close outlines; what is seen of them is found by testing them, as in the tree's leaves.

use super::area::{BLOCK, PACKET, TileArea};
use super::light_buffer::{Caster, Figure, Window, count, in_tree, slack_at};
use crate::bvh::Run;
use crate::compile::{Compiled, class};
use crate::kernel::Aabb;
use crate::lane::{LANES, Scalar};
use crate::scene::Projection;
use glam::DVec3;

/// How many packets of a block are side by side.
const ACROSS: usize = BLOCK / PACKET[0];

/// Things and parts of things at most for each pixel: of frames of 88 and of 1,700 it spares 2 to 3 ns a pixel.
const MOST: f64 = 1.0 / 64.0;

/// What a ray may be off by, in pixels.
const ROOM: f64 = 1e-3;

/// Something that may be seen in a block.
#[derive(Debug, Clone, Copy)]
pub struct Item {
    /// One row.
    pub run: Run,
    /// By which of the block's packets.
    pub packets: u8,
    /// No nearer than this.
    pub near: f64,
}

/// What may be seen in the blocks of a picture.
#[derive(Debug)]
pub struct ItemBuffer {
    /// Blocks a row.
    columns: usize,
    /// By block, where its items begin, and where the last ones end.
    begin: Vec<u32>,
    /// The nearest of each block first.
    items: Vec<Item>,
}

/// What may be seen in those of a tile.
pub struct TileItems<'a> {
    of: &'a ItemBuffer,
    area: TileArea,
}

impl ItemBuffer {
    /// For a picture of a scene of few things without triangles, by an eye in one place; else `None`.
    pub fn of<S: Scalar, B: Scalar>(
        Compiled { camera, geometry, .. }: &Compiled<S, B>,
        (width, height): (usize, usize),
    ) -> Option<Self> {
        let most = (width * height) as f64 * MOST;
        let fits = camera.projection == Projection::Perspective && !geometry.has_triangles();
        // (In packets of one octant each the blocks' packets do not stay together.)
        if !fits || count(geometry) as f64 > most || !geometry.bvh.goes_box_by_box() {
            return None;
        }
        let eye = camera.location - geometry.origin;
        let slack = slack_at::<S>(eye, Some(geometry.bvh.bounds));
        let window = Window::new(eye, [camera.direction, camera.right, camera.up]);
        let things = in_tree(geometry, class::CAMERA);
        let mut things: Vec<(f64, Caster)> =
            things.into_iter().map(|thing| (distance(eye, thing.bounds) - slack, thing)).collect();
        things.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let (mut drawn, mut entries) = (Drawn::new(width, height), Vec::new());
        for (near, thing) in things {
            let Caster { bounds, kind, row, classes, .. } = thing;
            if window.is_behind(grown(bounds, slack)) {
                continue;
            }
            let draw = |figure: &Figure| drawn.draw(&window, figure);
            if !window.each_figure(geometry, &thing, slack, draw) {
                drawn.draw_everywhere();
            }
            let run = Run { kind, class: classes, last: true, len: 1, first: row };
            drawn.take(|block, packets| entries.push((block, Item { run, packets, near })));
        }
        let mut begin = vec![0; drawn.packets.len() + 1];
        for (block, _) in &entries {
            begin[block + 1] += 1;
        }
        for block in 1..begin.len() {
            begin[block] += begin[block - 1];
        }
        // (In a stable order: the nearest stays the first.)
        entries.sort_by_key(|(block, _)| *block);
        let items = entries.into_iter().map(|(_, item)| item).collect();
        Some(Self { columns: drawn.columns, begin, items })
    }

    /// Those of a tile, if it consists of whole blocks.
    pub fn of_tile(&self, area: TileArea) -> Option<TileItems<'_>> {
        let whole = [area.x, area.y, area.width, area.height].iter().all(|side| side % BLOCK == 0);
        whole.then_some(TileItems { of: self, area })
    }
}

impl TileItems<'_> {
    /// What may be seen in a block of the tile, which are counted row by row.
    #[inline]
    pub fn of_block(&self, block: usize) -> &[Item] {
        let Self { of: ItemBuffer { columns, begin, items }, area } = self;
        let (x, y) = (block % (area.width / BLOCK), block / (area.width / BLOCK));
        let place = (area.y / BLOCK + y) * columns + area.x / BLOCK + x;
        begin.get(place..place + 2).map_or(&[], |ends| &items[ends[0] as usize..ends[1] as usize])
    }
}

/// What one thing covers.
struct Drawn {
    width: usize,
    height: usize,
    /// Blocks a row.
    columns: usize,
    /// By block, a bit for each packet that may see it.
    packets: Vec<u8>,
    /// Blocks in which there are any.
    covered: Vec<usize>,
}

impl Drawn {
    fn new(width: usize, height: usize) -> Self {
        let [columns, rows] = [width, height].map(|side| side.div_ceil(BLOCK));
        Self { width, height, columns, packets: vec![0; columns * rows], covered: Vec::new() }
    }

    /// Adds the packets that look through a figure.
    fn draw(&mut self, window: &Window, figure: &Figure) {
        let (width, height) = (self.width as f64, self.height as f64);
        // Rows count from the top, and a pixel is looked at through its middle.
        let [low, high] = figure.up();
        let rows = [high, low].map(|up| (0.5 - up) * height - 0.5);
        let Some([first, last]) = pixels_between(rows, self.height) else { return };
        for row in first / PACKET[1]..=last / PACKET[1] {
            let top = (row * PACKET[1]) as f64;
            let ends = [top + (PACKET[1] - 1) as f64 + ROOM, top - ROOM];
            let across = window.across(figure, ends.map(|y| 0.5 - (y + 0.5) / height));
            let columns = across.map(|across| (across + 0.5) * width - 0.5);
            let Some([left, right]) = pixels_between(columns, self.width) else { continue };
            for column in left / PACKET[0]..=right / PACKET[0] {
                self.cover(column, row);
            }
        }
    }

    /// Adds all packets.
    fn draw_everywhere(&mut self) {
        self.covered.clear();
        self.covered.extend(0..self.packets.len());
        self.packets.fill(!0);
    }

    /// Adds a packet by its column and row.
    fn cover(&mut self, column: usize, row: usize) {
        let down = LANES / ACROSS;
        let block = row / down * self.columns + column / ACROSS;
        let packets = &mut self.packets[block];
        if *packets == 0 {
            self.covered.push(block);
        }
        *packets |= 1 << (row % down * ACROSS + column % ACROSS);
    }

    /// Hands on all that was added, block by block, and begins anew.
    fn take(&mut self, mut with: impl FnMut(usize, u8)) {
        for block in self.covered.drain(..) {
            with(block, std::mem::take(&mut self.packets[block]));
        }
    }
}

/// The first and the last of `count` pixels whose middle is between two places, or as good as.
fn pixels_between([low, high]: [f64; 2], count: usize) -> Option<[usize; 2]> {
    let (first, last) = ((low - ROOM).ceil().max(0.0), (high + ROOM).floor().min(count as f64 - 1.0));
    (first <= last).then_some([first as usize, last as usize])
}

/// How far a box is from a point.
fn distance(from: DVec3, Aabb { min, max }: Aabb) -> f64 {
    (min - from).max(from - max).max(DVec3::ZERO).length()
}

/// A box and what is so far around it.
fn grown(Aabb { min, max }: Aabb, by: f64) -> Aabb {
    Aabb { min: min - by, max: max + by }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::Solid;
    use crate::random::Random;

    /// Every pixel whose ray meets a ball is covered, and beside them only some around.
    #[test]
    fn balls_cover_the_pixels_that_see_them() {
        let numbers = &mut Random::new(3);
        let (mut seen, mut covered_in_all, mut beside) = (0, 0, 0);
        for round in 0..200 {
            let (width, height) = (40 + round % 23, 30 + round % 17);
            let eye = numbers.vector(3.0);
            let [ahead, right, up] = [DVec3::Z, DVec3::X, DVec3::Y].map(|axis| axis + numbers.vector(0.3));
            let window = Window::new(eye, [ahead, right, up]);
            let center = eye + ahead * numbers.between(2.0, 9.0) + numbers.vector(2.0);
            let radius = numbers.between(0.01, 0.8);
            let lobes = Solid::Ball { center, radius }.lobes().unwrap();
            let Some(figure) = window.figure(&lobes, 1e-9) else { continue };
            let mut drawn = Drawn::new(width, height);
            drawn.draw(&window, &figure);
            let covers = |x: usize, y: usize| {
                let block = y / BLOCK * drawn.columns + x / BLOCK;
                drawn.packets[block] >> (y % BLOCK / PACKET[1] * ACROSS + x % BLOCK / PACKET[0]) & 1 == 1
            };
            for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
                let s = (x as f64 + 0.5) / width as f64 - 0.5;
                let t = (height as f64 - y as f64 - 0.5) / height as f64 - 0.5;
                let dir = (ahead + right * s + up * t).normalize();
                let away = (center - eye).reject_from_normalized(dir).length();
                let meets = away <= radius && dir.dot(center - eye) > 0.0;
                assert!(!meets || covers(x, y), "{round}: {x}, {y} sees the ball");
                seen += usize::from(meets);
                covered_in_all += usize::from(covers(x, y));
                // A packet across is a tenth of the picture.
                beside += usize::from(covers(x, y) && away > radius + 0.4 * dir.dot(center - eye));
            }
            let mut blocks = 0;
            drawn.take(|_, packets| blocks += usize::from(packets != 0));
            assert!(drawn.packets.iter().all(|&packets| packets == 0) && drawn.covered.is_empty());
            assert!(blocks <= drawn.packets.len());
        }
        assert!(
            seen > 10_000 && covered_in_all < 4 * seen && beside == 0,
            "{seen}, {covered_in_all}, {beside}"
        );
    }
}
