//! Long lists made by several threads: in place, in order, and the same on any number of threads.

use rayon::prelude::*;

/// Shorter lists, and shorter pieces of lists, are one thread's: to hand over a piece takes some microseconds.
pub const PIECE: usize = 4096;

/// Adds `f(0)` to `f(count - 1)` to a list.
pub fn extend<T: Send>(list: &mut Vec<T>, count: usize, f: impl Fn(usize) -> T + Send + Sync) {
    if count < 2 * PIECE {
        list.extend((0..count).map(f));
    } else {
        list.par_extend((0..count).into_par_iter().with_min_len(PIECE).map(f));
    }
}

/// `f(0)` to `f(count - 1)`.
pub fn list<T: Send>(count: usize, f: impl Fn(usize) -> T + Send + Sync) -> Vec<T> {
    let mut list = Vec::new();
    extend(&mut list, count, f);
    list
}

/// `f(0)` to `f(count - 1)` put together by `with`, which minds neither order nor grouping; `nothing` changes nothing.
pub fn fold<T: Copy + Send + Sync>(
    count: usize,
    nothing: T,
    f: impl Fn(usize) -> T + Send + Sync,
    with: impl Fn(T, T) -> T + Send + Sync,
) -> T {
    if count < 2 * PIECE {
        return (0..count).map(f).fold(nothing, with);
    }
    (0..count).into_par_iter().with_min_len(PIECE).map(f).reduce(|| nothing, with)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_the_same_however_long() {
        for count in [0, 1, PIECE, 2 * PIECE - 1, 2 * PIECE, 5 * PIECE + 3] {
            let mut squares = vec![7];
            extend(&mut squares, count, |k| k * k);
            assert_eq!(squares[0], 7);
            assert!(squares[1..].iter().copied().eq((0..count).map(|k| k * k)));
            assert_eq!(list(count, |k| k * k), squares[1..]);
            assert_eq!(fold(count, 0, |k| k, |a, b| a.max(b)), count.saturating_sub(1));
        }
    }
}
