//! Sets of a composite's parts, a bit for each: in one word for most composites, in several for large ones.

use crate::lane::{LANES, bits_of_many};
use std::fmt::Debug;
use std::ops::{BitAnd, BitOr, Not};

/// Parts by their numbers from the composite's first on.
pub trait PartSet:
    Copy
    + Debug
    + Default
    + PartialEq
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + Not<Output = Self>
    + 'static
{
    /// How many parts it has room for.
    const ROOM: usize;

    /// Of one part.
    fn of(part: u32) -> Self;

    /// Of one part, if it is `there`.
    fn of_if(part: u32, there: bool) -> Self;

    /// Of eight parts, from number `block * LANES` on, by a bit for each.
    fn of_block(block: usize, bits: u8) -> Self;

    /// Those of a larger set that there is room for.
    fn of_many(parts: Many) -> Self;

    /// How many there are.
    fn count(self) -> u32;

    /// One after the other, in rising order.
    fn each(self) -> impl Iterator<Item = u32>;

    /// True if there is none.
    #[inline(always)]
    fn is_empty(self) -> bool {
        self == Self::default()
    }

    /// True if some are in both.
    #[inline(always)]
    fn meets(self, other: Self) -> bool {
        !(self & other).is_empty()
    }

    /// True if all are in the other, too.
    #[inline(always)]
    fn is_within(self, other: Self) -> bool {
        !self.meets(!other)
    }
}

/// Of up to 64 parts.
pub type Few = u64;

impl PartSet for Few {
    const ROOM: usize = Self::BITS as usize;

    #[inline(always)]
    fn of(part: u32) -> Self {
        1 << part
    }

    #[inline(always)]
    fn of_if(part: u32, there: bool) -> Self {
        Self::from(there) << part
    }

    #[inline(always)]
    fn of_block(block: usize, bits: u8) -> Self {
        Self::from(bits) << (block * LANES)
    }

    #[inline(always)]
    fn of_many(parts: Many) -> Self {
        parts.0[0]
    }

    #[inline(always)]
    fn count(self) -> u32 {
        self.count_ones()
    }

    #[inline(always)]
    fn each(self) -> impl Iterator<Item = u32> {
        bits_of_many::<64>(self).map(|part| part as u32)
    }
}

/// Words of a large set.
const WORDS: usize = 4;

/// Of up to 256 parts: forty teeth of a wheel, each a block that two planes taper, are 120.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Many([u64; WORDS]);

impl Many {
    /// Of one part; the last stands for all that come after it, too.
    pub fn of_any(part: u32) -> Self {
        Self::of(part.min(Self::ROOM as u32 - 1))
    }
}

impl BitAnd for Many {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] & other.0[k]))
    }
}

impl BitOr for Many {
    type Output = Self;

    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] | other.0[k]))
    }
}

impl Not for Many {
    type Output = Self;

    #[inline(always)]
    fn not(self) -> Self {
        Self(self.0.map(|word| !word))
    }
}

impl PartSet for Many {
    const ROOM: usize = WORDS * Few::ROOM;

    #[inline(always)]
    fn of(part: u32) -> Self {
        let (word, bit) = (part as usize / Few::ROOM, part % Few::BITS);
        Self(std::array::from_fn(|k| u64::from(k == word) << bit))
    }

    #[inline(always)]
    fn of_if(part: u32, there: bool) -> Self {
        if there { Self::of(part) } else { Self::default() }
    }

    #[inline(always)]
    fn of_block(block: usize, bits: u8) -> Self {
        let (word, place) = (block * LANES / Few::ROOM, block * LANES % Few::ROOM);
        Self(std::array::from_fn(|k| if k == word { u64::from(bits) << place } else { 0 }))
    }

    #[inline(always)]
    fn of_many(parts: Many) -> Self {
        parts
    }

    #[inline(always)]
    fn count(self) -> u32 {
        self.0.iter().map(|word| word.count_ones()).sum()
    }

    #[inline(always)]
    fn each(self) -> impl Iterator<Item = u32> {
        (0..)
            .step_by(Few::ROOM)
            .zip(self.0)
            .flat_map(|(first, word)| word.each().map(move |part| first + part))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check<P: PartSet>() {
        let parts: Vec<u32> = (0..P::ROOM as u32).filter(|part| part * part % 7 == 2).collect();
        let set = parts.iter().fold(P::default(), |set, &part| set | P::of(part));
        assert_eq!(set.each().collect::<Vec<_>>(), parts);
        assert_eq!(set.count() as usize, parts.len());
        assert!(P::default().is_empty() && !set.is_empty() && !set.meets(!set) && set.is_within(set));
        assert!(!P::of(0).meets(set) && P::of(3).is_within(set) && !(P::of(0) | P::of(3)).is_within(set));
        for block in 0..P::ROOM / LANES {
            let eight: Vec<u32> = P::of_block(block, 0b1000_0101).each().collect();
            assert_eq!(eight, [0, 2, 7].map(|k| (block * LANES) as u32 + k));
        }
    }

    #[test]
    fn sets_hold_what_is_put_into_them() {
        check::<Few>();
        check::<Many>();
        assert_eq!(Few::of_many(Many::of(3) | Many::of(70)), Few::of(3));
        assert_eq!(Many::of_any(1000), Many::of(255));
    }
}
