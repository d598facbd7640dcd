//! Tiles of cells: what is drawn into one is small enough for a cache, and the next one's takes its place there.

use super::Face;
use super::seen::{Glimpse, Seen};

/// Columns and rows of cells in a tile: small enough that what tens of triangles a cell leave there is a megabyte or two, and large
/// enough that few are seen through two tiles.
const SIDE: u32 = 32;

/// Some cells of a face.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Tile {
    /// Which of the face's it is.
    pub number: usize,
    /// First and last column, first and last row.
    columns: [u32; 2],
    rows: [u32; 2],
}

impl Tile {
    /// How many columns it has.
    #[inline(always)]
    fn width(&self) -> u32 {
        self.columns[1] - self.columns[0] + 1
    }

    /// How many cells it has.
    pub fn len(&self) -> usize {
        (self.width() * (self.rows[1] - self.rows[0] + 1)) as usize
    }

    /// What it has of a range of columns and a range of rows; `None` if that is nothing.
    #[inline(always)]
    pub fn part_of(&self, [columns, rows]: [[u32; 2]; 2]) -> Option<[[u32; 2]; 2]> {
        let both = |[a, b]: [u32; 2], [c, d]: [u32; 2]| [a.max(c), b.min(d)];
        let part = [both(columns, self.columns), both(rows, self.rows)];
        part.iter().all(|[first, last]| first <= last).then_some(part)
    }

    /// The number in the tile of the cell in a column and row of the face.
    #[inline(always)]
    pub fn cell(&self, column: u32, row: u32) -> u32 {
        (row - self.rows[0]) * self.width() + (column - self.columns[0])
    }

    /// The column and row of cell number `cell`.
    pub fn place(&self, cell: u32) -> (u32, u32) {
        (self.columns[0] + cell % self.width(), self.rows[0] + cell / self.width())
    }
}

/// The tiles of `face`, row by row.
pub(super) fn tiles(face: &Face) -> impl Iterator<Item = Tile> + use<> {
    let Face { columns, rows, .. } = *face;
    let parts = |cells: u32| {
        (0..cells).step_by(SIDE as usize).map(move |first| [first, (first + SIDE).min(cells) - 1])
    };
    let all = parts(rows).flat_map(move |rows| parts(columns).map(move |columns| [columns, rows]));
    all.enumerate().map(|(number, [columns, rows])| Tile { number, columns, rows })
}

/// What is seen through the tiles of a face.
#[derive(Default)]
pub(super) struct Tiled {
    pub outlines: ByTile,
    pub fours: ByTile,
}

impl Tiled {
    /// Takes what is seen through `face` apart by its tiles.
    pub fn take(&mut self, seen: &Seen, face: &Face) {
        self.outlines.take(&seen.outlines, seen.origin, face);
        self.fours.take(&seen.fours, seen.origin, face);
    }
}

/// Whatever is seen through the tiles of a face, the first tile's first.
#[derive(Default)]
pub(super) struct ByTile {
    what: Vec<u64>,
    /// Where there the first tile begins, and where each ends.
    ends: Vec<u32>,
}

impl ByTile {
    /// Takes them apart by tiles, those of each in their order.
    fn take(&mut self, glimpses: &[Glimpse], origin: [f64; 2], face: &Face) {
        let [across, up] = [face.columns, face.rows].map(|cells| cells.div_ceil(SIDE));
        let each_tile = |glimpse: &Glimpse, with: &mut dyn FnMut(usize)| {
            let [columns, rows] = glimpse.cells(origin, face).map(|ends| ends.map(|cell| cell / SIDE));
            for row in rows[0]..=rows[1] {
                for column in columns[0]..=columns[1] {
                    with((row * across + column) as usize);
                }
            }
        };
        let Self { what, ends } = self;
        ends.clear();
        ends.resize((across * up) as usize + 1, 0);
        for glimpse in glimpses {
            each_tile(glimpse, &mut |tile| ends[tile + 1] += 1);
        }
        // From how many there are to where they begin; that moves on to where they end.
        let mut sum = 0;
        for end in &mut *ends {
            (*end, sum) = (sum, sum + *end);
        }
        what.clear();
        what.resize(sum as usize, 0);
        for glimpse in glimpses {
            each_tile(glimpse, &mut |tile| {
                let next = &mut ends[tile + 1];
                what[*next as usize] = glimpse.what;
                *next += 1;
            });
        }
    }

    /// [`Glimpse::what`] of what is seen through tile number `tile`.
    pub fn of(&self, tile: usize) -> &[u64] {
        &self.what[self.ends[tile] as usize..self.ends[tile + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::super::seen::{Outline, number_of};
    use super::*;
    use crate::random::Random;
    use std::collections::BTreeSet;

    fn face() -> Face {
        Face { first: 0, columns: 70, rows: 45, corner: [-0.7, -0.4], scale: 50.0, width: 0.02 }
    }

    #[test]
    fn every_cell_is_in_one_tile() {
        let mut seen = BTreeSet::new();
        for (number, tile) in tiles(&face()).enumerate() {
            assert_eq!(tile.number, number);
            for cell in 0..tile.len() as u32 {
                let (column, row) = tile.place(cell);
                assert_eq!(tile.cell(column, row), cell);
                assert_eq!(tile.part_of([[column; 2], [row; 2]]), Some([[column; 2], [row; 2]]));
                assert!(seen.insert((column, row)));
            }
        }
        assert_eq!((seen.len(), seen.last()), (70 * 45, Some(&(69, 44))));
        assert_eq!(tiles(&Face::default()).count(), 0);
    }

    /// A box is known to all tiles whose cells see it, and to no others but for a hair.
    #[test]
    fn tiles_know_what_is_seen_through_them() {
        let (mut numbers, mut seen, mut tiled) = (Random::new(5), Seen::default(), Tiled::default());
        seen.clear();
        let mut outlines = Vec::new();
        for number in 0..500 {
            let middle = numbers.vector(0.6).with_z(1.0);
            let half = numbers.vector(1.0).abs() * numbers.between(0.0, 0.3);
            let (min, max) = (middle - half, middle + half.with_z(0.0));
            seen.add(4, number, (min, max));
            outlines.extend(Outline::through(4, min, max).map(|outline| (number as usize, outline)));
        }
        tiled.take(&seen, &face());
        let (mut whole, mut parts) = (0, 0);
        for tile in tiles(&face()) {
            let known: BTreeSet<usize> =
                tiled.outlines.of(tile.number).iter().map(|&named| number_of(named)).collect();
            for (number, outline) in &outlines {
                let [columns, rows] = outline.cells(&face());
                let wider = |[first, last]: [u32; 2]| [first.saturating_sub(1), last + 1];
                let is_known = known.contains(number);
                let is_in = tile.part_of([columns, rows]).is_some();
                assert!(is_known || !is_in, "{number} is seen through tile {}", tile.number);
                assert!(!is_known || tile.part_of([wider(columns), wider(rows)]).is_some());
                parts += u32::from(is_known);
            }
            whole += tile.len();
        }
        assert!(whole == 70 * 45 && outlines.len() > 400 && parts > outlines.len() as u32, "{parts}");
    }
}
