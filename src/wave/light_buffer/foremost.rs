//! What stands foremost in the cells of a window, and from which depth on something else may stand there.

use super::Face;
use super::ground::Ground;
use super::raster::DEPTH_ROUNDING;
use super::seen::Sides;
use crate::lane::f32x8;
use std::ops::Range;

/// Depths are told in so many steps from the nearest of all to the farthest.
const STEPS: f32 = 65_534.0;
/// What a depth of a point may be off by, in steps.
const STEP_ROUNDING: f32 = 1.0;

/// In one cell: above, the number of the caster that begins first, or [`Ground::CASTS_NONE`]; below, where the first of the others begins,
/// at least, or [`FARTHEST`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Foremost(pub u32);

/// Farther than all that is there.
pub(super) const FARTHEST: u16 = u16::MAX;

impl Foremost {
    /// Where the caster's number begins.
    pub const CASTER: u32 = 16;
    /// The bits below it.
    pub const OTHERS: u32 = FARTHEST as u32;
    /// Nothing is there.
    pub const NOTHING: Self = Self(Ground::CASTS_NONE << Self::CASTER | Self::OTHERS);

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
pub(super) struct Steps {
    from: f32,
    scale: f32,
}

impl Steps {
    /// Between the nearest depth and the farthest.
    pub fn between([near, far]: [f64; 2]) -> Self {
        let (from, far) = (near as f32, far as f32);
        // (What is flat, and lies across, has a depth of some roundings.)
        Self { from, scale: STEPS / (far - from).max(far * f32::EPSILON) }
    }

    /// Depths of points.
    #[inline(always)]
    pub fn of(&self, depth: f32x8) -> f32x8 {
        (depth - f32x8::splat(self.from)) * f32x8::splat(self.scale)
    }

    /// Where something begins, at least, whose depth is no less than this.
    fn at_least(&self, depth: f64) -> u16 {
        let depth = (depth * (1.0 - DEPTH_ROUNDING)) as f32;
        let steps = (depth - self.from) * self.scale - STEP_ROUNDING;
        (steps as u16).min(FARTHEST - 1)
    }
}

/// A caster that is drawn into cells.
pub(super) struct Drawn {
    number: u32,
    sides: Sides,
    /// Where it begins, at least,
    near: u16,
    /// in each of these columns.
    first_column: u32,
    columns: Vec<u16>,
}

impl Drawn {
    /// Caster `number`, whose box has these `sides`, is nowhere nearer than `near`, and is seen in these columns of a face, at most.
    pub fn new(
        number: u32,
        (sides, near): (Sides, f64),
        columns: Range<u32>,
        face: &Face,
        steps: &Steps,
    ) -> Self {
        let near = steps.at_least(near);
        let first_column = columns.start;
        let columns =
            columns.map(|column| steps.at_least(sides.depth_in(0, column, face)).max(near)).collect();
        Self { number, sides, near, first_column, columns }
    }

    /// Puts it into some cells of a row, the first of which is `cells`; where the foremost begins there is told in `first`.
    pub fn put(
        &self,
        (row, columns): (u32, Range<u32>),
        (face, steps): (&Face, &Steps),
        cells: &mut [Foremost],
        first: &mut [u16],
    ) {
        let in_row = steps.at_least(self.sides.depth_in(1, row, face)).max(self.near);
        for ((cell, first), column) in cells.iter_mut().zip(first).zip(columns) {
            // (Figures are a little larger than their boxes.)
            let in_column = self.columns.get(column.wrapping_sub(self.first_column) as usize);
            let depth = in_row.max(*in_column.unwrap_or(&self.near));
            if cell.caster() == self.number {
                continue;
            }
            if depth < *first {
                *cell = Foremost::new(self.number, *first);
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
    use crate::lane::Lane;
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
            let steps = Steps::between([2.0, 8.0]);
            let casters: Vec<Drawn> = (0..6)
                .map(|number| {
                    let min = DVec3::new(
                        random.between(-2.0, 2.0),
                        random.between(-2.0, 2.0),
                        random.between(2.0, 7.0),
                    );
                    let sides = Sides::through(4, min, min + 1.0);
                    Drawn::new(number, (sides, min.z), 5..columns, &face, &steps)
                })
                .collect();
            let mut cells = vec![Foremost::NOTHING; columns as usize];
            let mut first = vec![FARTHEST; columns as usize];
            let row = 12;
            // Each in two figures that overlap, the second of which begins before what its box is seen in.
            for caster in &casters {
                for range in [10..30, 2..20] {
                    let some = range.start as usize..range.end as usize;
                    caster.put((row, range), (&face, &steps), &mut cells[some.clone()], &mut first[some]);
                }
            }
            for (column, cell) in (0..).zip(&cells) {
                let depth_of = |caster: &Drawn| {
                    let across = if column < 5 { 0.0 } else { caster.sides.depth_in(0, column, &face) };
                    [across, caster.sides.depth_in(1, row, &face)]
                        .map(|depth| steps.at_least(depth))
                        .into_iter()
                        .fold(caster.near, u16::max)
                };
                let mut all: Vec<_> =
                    casters.iter().map(|caster| (depth_of(caster), caster.number)).collect();
                all.sort_unstable();
                if (2..30).contains(&column) {
                    assert_eq!((first[column as usize], cell.others()), (all[0].0, all[1].0));
                    assert!(all.contains(&(all[0].0, cell.caster())), "the foremost is one of the nearest");
                } else {
                    assert_eq!(cell.0, Foremost::NOTHING.0);
                }
            }
        }
    }
}
