//! In which order leaves get their rows.
//!
//! One ray is tested against four rows at a time, and packets share what is worked out of four: leaves had better not be parted over
//! two fours. So rows are not given leaf by leaf. Of some leaves that come one after the other in the tree, the one is next that
//! fits: meshes' camera and shadow rays gain 2 to 5 %, scattered ones 1 to 4.

use crate::lane::QUAD;
use std::cmp::Reverse;
use std::collections::VecDeque;

/// So many leaves of a kind wait for rows. (A leaf's rows should lie near those of its neighbours.)
const WINDOW: usize = 32;

/// Leaves of one kind that have no rows yet.
#[derive(Debug)]
pub(super) struct Filling<T> {
    /// By how many rows, less 1, come last in a leaf, behind fours that it fills: the leaves, and when they came.
    waiting: [VecDeque<(u32, T)>; QUAD],
    /// Leaves that have come.
    came: u32,
}

impl<T> Default for Filling<T> {
    fn default() -> Self {
        Self { waiting: Default::default(), came: 0 }
    }
}

impl<T> Filling<T> {
    /// A leaf of so many rows, at least 1, comes.
    #[inline]
    pub fn push(&mut self, rows: usize, leaf: T) {
        self.waiting[(rows - 1) % QUAD].push_back((self.came, leaf));
        self.came += 1;
    }

    /// True if a leaf must get its rows before others come.
    #[inline]
    pub fn is_full(&self) -> bool {
        self.waiting.iter().map(VecDeque::len).sum::<usize>() > WINDOW
    }

    /// The leaf that gets its rows next, if any waits, where the next row is number `row`: the oldest of those that do best, which
    /// fill a four that is begun, or go into it. A leaf of an odd length begins none, nor is parted, unless there is another to
    /// make the number even again: twos and fours that came behind it would be parted one after the other.
    #[inline]
    pub fn pop(&mut self, row: usize) -> Option<T> {
        let odd = |rows: usize| rows % 2 == 1;
        let alone = self.waiting[0].len() + self.waiting[2].len() < 2;
        let worth = |rows: usize| match (QUAD - row % QUAD, rows) {
            (room @ (1 | 3), _) if rows == room => 3,
            (1 | 3, _) if odd(rows) => 2,
            (room @ (1 | 3), _) => usize::from(rows < room),
            (_, _) if odd(rows) && alone => 0,
            (QUAD, _) => 1,
            (_, _) => [3, 4, 2, 1][rows - 1],
        };
        let best = |k: usize| self.waiting[k].front().map(|&(came, _)| (worth(k + 1), Reverse(came), k));
        let (.., k) = (0..QUAD).filter_map(best).max()?;
        self.waiting[k].pop_front().map(|(_, leaf)| leaf)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// How many more fours leaves lie in than they must, if they get their rows in the order of [`Filling`], and in that they come in.
    fn parted(lengths: &[usize]) -> [usize; 2] {
        let more = |row: usize, rows: usize| (row % QUAD + rows).div_ceil(QUAD) - rows.div_ceil(QUAD);
        let (mut filling, mut placed, mut first, mut in_turn) = (Filling::default(), Vec::new(), 0, 0);
        let mut row = 0;
        let mut pop = |filling: &mut Filling<usize>| {
            let rows = filling.pop(row)?;
            placed.push(more(row, rows));
            row += rows;
            Some(rows)
        };
        for &rows in lengths {
            in_turn += more(first, rows);
            first += rows;
            filling.push(rows, rows);
            if filling.is_full() {
                pop(&mut filling);
            }
        }
        while pop(&mut filling).is_some() {}
        assert_eq!((placed.len(), row), (lengths.len(), first));
        [placed.iter().sum(), in_turn]
    }

    #[test]
    fn only_threes_without_a_one_are_parted() {
        let mut numbers = Random::new(11);
        for shares in [[1, 4, 2, 3], [4, 3, 1, 1], [0, 5, 0, 4], [1, 20, 1, 20], [0, 0, 1, 0], [2, 3, 3, 2]] {
            let of_four: Vec<usize> = (1..=QUAD).flat_map(|rows| vec![rows; shares[rows - 1]]).collect();
            let any = |numbers: &mut Random| of_four[numbers.below(of_four.len())];
            let lengths: Vec<usize> = (0..4000).map(|_| any(&mut numbers)).collect();
            let count = |rows: usize| lengths.iter().filter(|&&length| length == rows).count();
            let [best, in_turn] = parted(&lengths);
            // Two threes and a two are parted once, three threes twice in twelve rows.
            let least = count(3).saturating_sub(count(1)) / 2;
            println!("{shares:?}: {best} and {in_turn} of {}, at least {least}", lengths.len());
            assert!(best <= least + lengths.len() / 50 && best <= in_turn, "{best} of {least}, {in_turn}");
        }
    }
}
