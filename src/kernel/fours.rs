//! Rows of numbers in columns that are cut into fours.

use crate::lane::{LANES, Lane, QUAD, Scalar, prefetch};
use crate::parallel;

/// `len` rows of `N` numbers. Four rows lie together, column by column, so that the rows of a leaf come with a few cache lines and
/// not with one for each column, and one ray is held against four of them at once.
#[derive(Debug, Clone)]
pub(super) struct Fours<S, const N: usize> {
    fours: Vec<Four<S, N>>,
    len: usize,
}

/// Four rows, column by column. Unused places are 0.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Four<S, const N: usize>(pub [[S; QUAD]; N]);

impl<S, const N: usize> Default for Fours<S, N> {
    fn default() -> Self {
        Self { fours: Vec::new(), len: 0 }
    }
}

impl<S: Scalar, const N: usize> Four<S, N> {
    /// The rows that there are, four at most.
    #[inline(always)]
    fn of(rows: impl Iterator<Item = [S; N]>) -> Self {
        let mut columns = [[S::default(); QUAD]; N];
        for (k, row) in rows.enumerate() {
            for (column, x) in columns.iter_mut().zip(row) {
                column[k] = x;
            }
        }
        Self(columns)
    }
}

impl<S: Scalar, const N: usize> Fours<S, N> {
    /// Rows.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Bytes of a row.
    pub fn row_bytes(&self) -> usize {
        N * size_of::<S>()
    }

    /// Adds a row.
    pub fn push(&mut self, row: [S; N]) {
        if self.len.is_multiple_of(QUAD) {
            self.fours.push(Four([[S::default(); QUAD]; N]));
        }
        self.len += 1;
        self.set(self.len - 1, row);
    }

    /// Adds rows `row(0)` to `row(count - 1)`.
    pub fn extend(&mut self, count: usize, row: impl Fn(usize) -> [S; N] + Send + Sync) {
        let first = count.min(self.len.next_multiple_of(QUAD) - self.len); // They fill the last four.
        (0..first).for_each(|k| self.push(row(k)));
        let four = |k: usize| {
            let from = first + k * QUAD;
            Four::of((from..count.min(from + QUAD)).map(&row))
        };
        parallel::extend(&mut self.fours, (count - first).div_ceil(QUAD), four);
        self.len += count - first;
    }

    /// Puts another row in the place of row `i`.
    pub fn set(&mut self, i: usize, row: [S; N]) {
        for (column, x) in self.fours[i / QUAD].0.iter_mut().zip(row) {
            column[i % QUAD] = x;
        }
    }

    /// Row `i`.
    #[inline(always)]
    pub fn row(&self, i: usize) -> [S; N] {
        self.fours[i / QUAD].0.map(|column| column[i % QUAD])
    }

    /// Rows `QUAD * k` to `QUAD * k + 3`.
    #[inline(always)]
    pub fn four(&self, k: usize) -> &Four<S, N> {
        &self.fours[k]
    }

    /// Asks the memory for rows `QUAD * k` to `QUAD * k + 3`.
    #[inline(always)]
    pub fn prefetch(&self, k: usize) {
        if let Some(Four(columns)) = self.fours.get(k) {
            for column in columns.iter().step_by(64 / size_of::<[S; QUAD]>()) {
                prefetch(column);
            }
        }
    }

    /// A column's numbers in rows `index`.
    #[inline(always)]
    pub fn gather(&self, column: usize, index: &[u32; LANES]) -> S::Lane {
        S::Lane::from_fn(|lane| {
            self.fours[index[lane] as usize / QUAD].0[column][index[lane] as usize % QUAD]
        })
    }

    /// Rows `order`.
    pub fn permuted(&self, order: &[u32]) -> Self {
        let mut rows = Self::default();
        rows.extend(order.len(), |k| self.row(order[k] as usize));
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_lie_where_they_were_put() {
        for (before, count) in [(0, 0), (3, 1), (0, 5), (5, 2), (6, 9), (2, 9 * parallel::PIECE + 1)] {
            let row = |k: usize| [k as f32, -(k as f32)];
            let mut rows = Fours::default();
            (0..before).for_each(|k| rows.push(row(k)));
            rows.extend(count, |k| row(before + k));
            assert_eq!(rows.len(), before + count);
            assert_eq!(rows.fours.len(), rows.len().div_ceil(QUAD));
            assert!((0..rows.len()).all(|k| rows.row(k) == row(k)));
            let order: Vec<u32> = (0..rows.len() as u32).rev().step_by(3).collect();
            let turned = rows.permuted(&order);
            assert!(order.iter().enumerate().all(|(k, &old)| turned.row(k) == row(old as usize)));
        }
    }
}
