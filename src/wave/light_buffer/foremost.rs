//! What stands foremost in the cells of a window, and from which depth on something else may stand there.

use super::Face;
use super::ground::Ground;
use super::raster::{CELL_ROUNDING, DEPTH_ROUNDING};
use super::seen::Sides;
use crate::lane::{LANES, Lane, each_lane, f32x8, same_lanes};
use std::ops::Range;

/// Columns of cells, and rows. (With twice as many there are a few more answers, but where mirrors scatter the points a second-level
/// cache does not hold 256 kB beside all else.)
pub(super) const SIDE: u32 = 128;
const CELLS: usize = (SIDE * SIDE) as usize;

/// Depths are told in so many steps from the nearest of all to the farthest.
const STEPS: f32 = 65_534.0;
/// What a depth of a point may be off by, in steps.
const STEP_ROUNDING: f32 = 1.0;
/// Farther than all that is there.
const FARTHEST: u16 = u16::MAX;

/// What is in one cell: above, the number of the caster that begins first, or [`Ground::CASTS_NONE`]; below, where the first of the
/// others begins, at least, or [`FARTHEST`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Foremost(u32);

impl Foremost {
    /// Where the caster's number begins.
    const CASTER: u32 = 16;
    /// The bits below it.
    const OTHERS: u32 = FARTHEST as u32;
    const NOTHING: Self = Self(Ground::CASTS_NONE << Self::CASTER | Self::OTHERS);

    fn new(caster: u32, others: u16) -> Self {
        Self(caster << Self::CASTER | u32::from(others))
    }

    fn caster(self) -> u32 {
        self.0 >> Self::CASTER
    }

    fn others(self) -> u16 {
        (self.0 & Self::OTHERS) as u16
    }
}

/// Depths in steps.
#[derive(Debug, Clone, Copy)]
struct Steps {
    from: f32,
    scale: f32,
}

impl Steps {
    /// Between the nearest depth and the farthest.
    fn between([near, far]: [f64; 2]) -> Self {
        let (from, far) = (near as f32, far as f32);
        // (What is flat, and lies across, has a depth of some roundings.)
        Self { from, scale: STEPS / (far - from).max(far * f32::EPSILON) }
    }

    /// Depths of points.
    #[inline(always)]
    fn of(&self, depth: f32x8) -> f32x8 {
        (depth - f32x8::splat(self.from)) * f32x8::splat(self.scale)
    }

    /// Where something begins, at least, whose depth is no less than this.
    fn at_least(&self, depth: f64) -> u16 {
        let depth = (depth * (1.0 - DEPTH_ROUNDING)) as f32;
        let steps = (depth - self.from) * self.scale - STEP_ROUNDING;
        (steps as u16).min(FARTHEST - 1)
    }
}

/// What is foremost, cell by cell.
#[derive(Debug)]
pub(super) struct Fronts {
    /// Row by row.
    cells: Box<[Foremost; CELLS]>,
    steps: Steps,
}

impl Fronts {
    /// Lanes in which the foremost of a cell, by row and column, is this caster, and a depth is less than where the others begin.
    #[inline(always)]
    pub fn are_first(&self, [row, column]: [[u32; LANES]; 2], depth: f32x8, caster: &[u32; LANES]) -> u8 {
        let cell = each_lane(|k| {
            self.cells[row[k].wrapping_mul(SIDE).wrapping_add(column[k]) as usize & (CELLS - 1)].0
        });
        let others = f32x8::from_fn(|k| (cell[k] & Foremost::OTHERS) as f32);
        same_lanes(caster, &each_lane(|k| cell[k] >> Foremost::CASTER))
            & self.steps.of(depth).lt(others).bits()
    }
}

/// Casters are drawn into cells, one after the other.
pub(super) struct Drawing {
    fronts: Fronts,
    /// Where the foremost of each cell begins, at least.
    first: Vec<u16>,
    face: Face,
}

/// The caster that is being drawn.
pub(super) struct Drawn {
    number: u32,
    sides: Sides,
    /// Where it begins, at least,
    near: u16,
    /// in each of these columns.
    first_column: u32,
    columns: Vec<u16>,
}

impl Drawing {
    /// On a face of at most [`SIDE`] columns and rows, of what lies between these depths.
    pub fn on(face: Face, depths: [f64; 2]) -> Self {
        let cells = Box::new([Foremost::NOTHING; CELLS]);
        let fronts = Fronts { cells, steps: Steps::between(depths) };
        Self { fronts, first: vec![FARTHEST; CELLS], face }
    }

    /// What all casters make.
    pub fn done(self) -> Fronts {
        self.fronts
    }

    /// Begins caster `number`, whose box has these `sides` and is all before the face.
    pub fn begin(&self, number: u32, sides: Sides) -> Drawn {
        let steps = &self.fronts.steps;
        let near = steps.at_least(sides.depths[0]);
        let [left, right] = self.face.range(0, sides.seen(sides.depths)[0], CELL_ROUNDING);
        let depth = |column: u32| steps.at_least(sides.depth_in(0, column, &self.face)).max(near);
        let columns = (left..=right).map(depth).collect();
        Drawn { number, sides, near, first_column: left, columns }
    }

    /// Puts the caster into some columns of a row; a second time makes no difference.
    pub fn put(&mut self, drawn: &Drawn, row: u32, columns: Range<u32>) {
        let Self { fronts: Fronts { cells, steps }, first, face } = self;
        let in_row = steps.at_least(drawn.sides.depth_in(1, row, face)).max(drawn.near);
        let places = (row * SIDE + columns.start) as usize..(row * SIDE + columns.end) as usize;
        for ((cell, first), column) in cells[places.clone()].iter_mut().zip(&mut first[places]).zip(columns) {
            // (Figures are a little larger than their boxes.)
            let in_column = drawn.columns.get(column.wrapping_sub(drawn.first_column) as usize);
            let depth = in_row.max(*in_column.unwrap_or(&drawn.near));
            if cell.caster() == drawn.number {
                continue;
            }
            if depth < *first {
                *cell = Foremost::new(drawn.number, *first);
                *first = depth;
            } else {
                *cell = Foremost::new(cell.caster(), cell.others().min(depth));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use glam::DVec3;

    #[test]
    fn what_begins_at_a_depth_begins_no_later_in_steps() {
        let random = &mut Random::new(3);
        for _ in 0..2000 {
            let near = 10f64.powf(random.between(-4.0, 6.0));
            let far = near * (1.0 + 10f64.powf(random.between(-6.0, 2.0)));
            let steps = Steps::between([near, far]);
            let depth = near + (far - near) * random.between(0.0, 1.0);
            let told = f32::from(steps.at_least(depth));
            let [at, beyond] = [depth, far].map(|depth| steps.of(f32x8::lit(depth)).lanes()[0]);
            assert!(told == 0.0 || told < at, "{depth} of {near} to {far}: {told}, {at}");
            assert!(beyond < f32::from(FARTHEST), "nothing but nothing is farther than {far}: {beyond}");
            // A step or two, and what single precision cannot tell.
            let rounding = (far * 2.0 * DEPTH_ROUNDING / (far - near)) as f32 * STEPS;
            assert!(told > at - 3.0 - rounding, "{depth} of {near} to {far}: {told}, {at}");
        }
    }

    #[test]
    fn the_first_and_the_next_are_told_in_whatever_order_they_come() {
        let (columns, rows) = (40, 30);
        let face = Face { first: 0, columns, rows, corner: [-1.0, -0.75], scale: 20.0, width: 0.05 };
        let random = &mut Random::new(5);
        for _ in 0..50 {
            let (mut drawing, row) = (Drawing::on(face, [2.0, 8.0]), 12);
            let casters: Vec<Drawn> = (0..6)
                .map(|number| {
                    let [x, y] = [0, 1].map(|_| random.between(-2.0, 2.0));
                    let min = DVec3::new(x, y, random.between(2.0, 7.0));
                    drawing.begin(number, Sides::through(4, min, min + 1.0))
                })
                .collect();
            // Each in two figures that overlap, and go beyond what its box is seen in.
            for caster in &casters {
                [10..30, 2..20].into_iter().for_each(|columns| drawing.put(caster, row, columns));
            }
            for column in 0..columns {
                let depth_of = |caster: &Drawn| {
                    let seen = caster.columns.len() as u32;
                    let is_seen = (caster.first_column..caster.first_column + seen).contains(&column);
                    let across = if is_seen { caster.sides.depth_in(0, column, &face) } else { 0.0 };
                    let depths = [across, caster.sides.depth_in(1, row, &face)];
                    depths
                        .map(|depth| drawing.fronts.steps.at_least(depth))
                        .into_iter()
                        .fold(caster.near, u16::max)
                };
                let mut all: Vec<_> =
                    casters.iter().map(|caster| (depth_of(caster), caster.number)).collect();
                all.sort_unstable();
                let place = (row * SIDE + column) as usize;
                let cell = drawing.fronts.cells[place];
                if (2..30).contains(&column) {
                    assert_eq!((drawing.first[place], cell.others()), (all[0].0, all[1].0));
                    assert!(all.contains(&(all[0].0, cell.caster())), "the foremost is one of the nearest");
                } else {
                    assert_eq!(cell, Foremost::NOTHING);
                }
            }
        }
    }
}
