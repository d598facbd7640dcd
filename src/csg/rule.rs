//! When a crossing of a composite's part is a surface.

use super::bracket::Body;
use super::parts::PartSet;
use std::ops::Range;

/// What is known of a part when its composite is decided.
#[derive(Debug, Clone)]
pub struct Rule<P> {
    pub(super) body: Body,
    /// Centre and square of the radius of a ball around it.
    pub(super) ball: Option<[f32; 4]>,
    /// Its crossings are surfaces where this holds,
    pub(super) all: Clause<P>,
    /// each of these clauses,
    pub(super) clauses: Range<u32>,
    /// and each of these conditions.
    pub(super) conditions: Range<u32>,
    /// Of a half space: bounded parts that it only counts within. Where rays miss one of them it need not be looked at.
    pub(super) mates: P,
}

/// When a part's crossings are surfaces, as its [`Rule`] tells it.
#[derive(Debug, Default)]
pub(super) struct WhenSeen<P> {
    pub(super) all: Clause<P>,
    pub(super) clauses: Vec<Clause<P>>,
    pub(super) conditions: Vec<Condition>,
}

impl<P: Copy> WhenSeen<P> {
    /// Its own clause, if nothing else has a say.
    pub(super) fn alone(&self) -> Option<Clause<P>> {
        (self.clauses.is_empty() && self.conditions.is_empty()).then_some(self.all)
    }
}

/// A node that places must be within, or outside of.
#[derive(Debug, Clone, Copy)]
pub struct Condition {
    pub(super) node: u32,
    pub(super) within: bool,
}

/// Of some parts a place must be within, of others without. A rule's own clause holds if all of that is so, the
/// others if some is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Clause<P> {
    pub(super) within: P,
    pub(super) without: P,
}

impl<P: PartSet> Clause<P> {
    /// Of one part.
    pub(super) fn of(part: u32, within: bool) -> Self {
        let (part, none) = (P::of(part), P::default());
        if within { Self { within: part, without: none } } else { Self { within: none, without: part } }
    }

    pub(super) fn or(self, other: Self) -> Self {
        Self { within: self.within | other.within, without: self.without | other.without }
    }

    /// True of every place.
    pub(super) fn is_tautology(self) -> bool {
        self.within.meets(self.without)
    }

    pub(super) fn is_single(self) -> bool {
        self.within.count() + self.without.count() == 1
    }
}
