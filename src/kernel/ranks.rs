//! Which of two surfaces at one place is seen: the one declared first.

/// The number of a surface.
pub type SurfaceId = u32;

/// No surface: the ray started in free space, or hit nothing.
pub const NO_SURFACE: SurfaceId = u32::MAX;

/// Surfaces' places in the order of declaration.
#[derive(Debug, Clone, Default)]
pub struct Ranks {
    /// By number.
    rows: Vec<u32>,
    /// Stretches of numbers after these, of things that decide for themselves which of their own is seen: the first number of each
    /// stretch and its place among all others.
    stretches: Vec<(SurfaceId, u32)>,
}

impl Ranks {
    /// By number, and then of `stretches` by their first numbers, which rise.
    pub fn new(rows: Vec<u32>, stretches: Vec<(SurfaceId, u32)>) -> Self {
        Self { rows, stretches }
    }

    /// By number, without stretches.
    pub fn rows(&self) -> &[u32] {
        &self.rows
    }

    /// The stretch that holds a number.
    #[inline(always)]
    pub fn stretch(&self, surface: SurfaceId) -> Option<usize> {
        self.stretches.partition_point(|&(first, _)| first <= surface).checked_sub(1)
    }

    /// The place of a surface, or of its stretch.
    #[inline(always)]
    pub fn of(&self, surface: SurfaceId) -> u32 {
        let stretch = || self.stretches.get(self.stretch(surface)?).map(|&(_, place)| place);
        self.rows.get(surface as usize).copied().or_else(stretch).unwrap_or(u32::MAX)
    }

    /// True if `surface` is seen where both are at one place; false if `other` is none. (Without a call, so that the loops which ask,
    /// seldom as they do, keep their registers.)
    #[inline(always)]
    pub fn prefer(&self, surface: SurfaceId, other: SurfaceId) -> bool {
        other != NO_SURFACE && self.of(surface) < self.of(other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_declared_is_seen_whether_by_itself_or_in_a_stretch() {
        let ranks = Ranks::new(vec![5, 0, 9], vec![(3, 7), (10, 2)]);
        let order = [1, 12, 0, 4, 2];
        for (k, &first) in order.iter().enumerate() {
            for &second in &order[k + 1..] {
                assert!(ranks.prefer(first, second) && !ranks.prefer(second, first), "{first} {second}");
            }
        }
        assert!(!ranks.prefer(3, 9), "one stretch decides for itself");
        assert!(!ranks.prefer(0, NO_SURFACE));
        assert_eq!([3, 9, 10].map(|surface| ranks.stretch(surface)), [Some(0), Some(0), Some(1)]);
    }
}
