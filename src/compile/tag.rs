//! What is known of a primitive besides its geometry.

/// What a surface looks like and who sees it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Look {
    pub owner: u32,
    pub class: u8,
}

/// A look, and a place in the order of declaration.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tag {
    pub owner: u32,
    pub rank: u32,
    pub class: u8,
}

impl Look {
    /// With a rank.
    pub fn ranked(self, rank: u32) -> Tag {
        Tag { owner: self.owner, rank, class: self.class }
    }
}

/// Turns round the order of surfaces at one place, among all that were given a rank since `before`.
pub(super) fn turn_ranks(tags: &mut [Tag], before: u32, last: u32) {
    for tag in tags {
        tag.rank = turned_rank(tag.rank, before, last);
    }
}

/// A rank after `before`, counted back from `last`.
pub(super) fn turned_rank(rank: u32, before: u32, last: u32) -> u32 {
    before + 1 + (last - rank)
}
