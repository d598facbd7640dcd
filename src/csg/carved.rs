//! Composites that are carved out of a whole: which parts hold all of them, and which are bitten off.

use super::bites::Bitten;
use super::parts::PartSet;
use super::rule::{Clause, WhenSeen};
use super::{Composite, CsgNode, CsgTree, NodeKind, Part, slice};
use crate::kernel::{Aabb, Solid};
use glam::DVec3;

/// More bites than this are not held against places.
const MOST_BITES: u32 = 24;

/// How a composite is carved: where rays come into all of its required parts, or into the first of its hull where none are required, but
/// not into a bite, they see a surface, and nothing is before it.
#[derive(Debug, Clone)]
pub(super) struct Carved<P> {
    /// Parts that it lies within some of; none where it has required ones.
    pub(super) hull: P,
    /// Parts that nothing of it lies within.
    pub(super) bites: P,
    /// What is around them.
    pub(super) bitten: Bitten,
    /// The first of the parts that hold it.
    pub(super) first: u32,
    /// Where rays leave a bite, in the whole and in no other bite, they see a surface.
    pub(super) shows_bites: bool,
}

impl CsgTree {
    /// How a composite of some `size` around `middle` is carved, if it is; of its parts, some of which are `required` and some can be `seen`,
    /// it is known what bodies they are and when their crossings are surfaces.
    pub(super) fn carve<P: PartSet>(
        &mut self,
        composite: &Composite,
        (required, seen): (P, P),
        (bodies, when_seen): (&[(Solid, Aabb)], &[WhenSeen<P>]),
        (middle, size): (DVec3, f64),
    ) -> Option<Carved<P>> {
        let hull = if required.is_empty() { self.hull(composite)? } else { P::default() };
        let whole = required | hull;
        if !whole.is_within(seen) {
            return None;
        }
        let first = whole.each().next()?;
        let bites = whole.each().try_fold(P::default(), |bites, part| {
            let Clause { within, without } = when_seen[part as usize].alone()?;
            within.is_within(required).then_some(bites | without & !hull)
        })?;
        if bites.count() > MOST_BITES {
            return None;
        }
        let within_hull = Clause { within: hull, without: P::default() };
        let shows = |part: u32| {
            let WhenSeen { all, clauses, conditions } = &when_seen[part as usize];
            *all == Clause { within: required, without: bites & !P::of(part) }
                && clauses.iter().eq((!hull.is_empty()).then_some(&within_hull))
                && conditions.is_empty()
        };
        let shows_bites = bites.is_within(seen) && bites.each().all(shows);
        let bitten = self.bites.push(bites.each().map(|part| &bodies[part as usize]), middle, size);
        Some(Carved { hull, bites, bitten, first, shows_bites })
    }

    /// The parts of the one union that a composite lies within, if that is of parts only.
    fn hull<P: PartSet>(&self, composite: &Composite) -> Option<P> {
        let needed = slice(&self.needed, &composite.needed).iter().map(|&node| &self.nodes[node as usize]);
        let mut unions = needed.filter(|node| !node.inverted);
        let (Some(CsgNode { kind: NodeKind::Any(list) | NodeKind::Merged(list), .. }), None) =
            (unions.next(), unions.next())
        else {
            return None;
        };
        self.list(list).iter().try_fold(P::default(), |hull, &node| match self.nodes[node as usize] {
            CsgNode { kind: NodeKind::Part(number), inverted: false, .. } => {
                let Part { closed, whole_skin, .. } = self.parts[number as usize];
                (closed && whole_skin).then(|| hull | P::of(number - composite.parts.start))
            }
            _ => None,
        })
    }
}
