//! What is known of a composite's parts along eight rays, and which places are inside of what.

use super::cull::{NOT_NEAR, Near, PartCrossings, Side, Span, Stretch, max_abs};
use super::long::LONG;
use super::parts::{Many, PartSet};
use super::scratch::{PartRoots, Scratch};
use super::{Composite, Constraint, CsgTree, NodeKind, slice};
use crate::kernel::Rays;
use crate::lane::{LANES, Lane, Mask, Scalar, f32x8, f64x8};
use std::ops::Range;

/// Crossings that lie closer together than this share of the distances involved are one place: coincident faces of
/// two parts are computed by different formulas and differ by some roundings (4 each for `t` and for the origin
/// relative to either part).
pub(super) const TIE: f64 = 16.0 * f64::UNIT_ROUNDOFF;

/// A part that is left within this share of the distance from which hits count, has no tie with any of them: the distance
/// is twice a tie's or more.
const LEFT_BEHIND: f64 = 0.25;

/// The two sides of a place on a ray: a bit per lane for "inside just before" and "inside just after".
#[derive(Debug, Clone, Copy)]
struct Sides {
    before: u8,
    after: u8,
}

impl CsgTree {
    /// The nodes of a list.
    pub fn list(&self, range: &Range<u32>) -> &[u32] {
        slice(&self.lists, range)
    }

    /// The nodes of a list without one of them.
    pub(super) fn others(&self, range: &Range<u32>, own: u32) -> impl Iterator<Item = u32> {
        self.list(range).iter().copied().filter(move |&node| node != own)
    }

    /// Eight rays of whose way through the composite nothing is known yet.
    pub(super) fn along<'a, P: PartRoots>(
        &'a self,
        composite: &'a Composite,
        rays: &'a Rays<f64x8>,
        source: &'a P,
        scratch: &'a mut Scratch,
    ) -> Along<'a, P> {
        scratch.crossings.clear();
        scratch.forget_near();
        scratch.first_part = composite.parts.start;
        if scratch.places.len() < composite.parts.len() {
            scratch.places.resize(composite.parts.len(), NOT_NEAR);
        }
        scratch.within_reach.clear();
        let reach = max_abs(rays.origin);
        Along { tree: self, composite, rays, source, scratch, reach, near: Many::default(), tie: TIE }
    }
}

/// Everything known along the eight rays.
pub(super) struct Along<'a, P> {
    tree: &'a CsgTree,
    composite: &'a Composite,
    rays: &'a Rays<f64x8>,
    source: &'a P,
    pub(super) scratch: &'a mut Scratch,
    reach: f64x8,
    /// As [`CsgTree::below`] has them: the parts that are near.
    near: Many,
    /// See [`TIE`].
    pub(super) tie: f64,
}

/// Nodes that are asked one after the other.
enum Nodes {
    /// Of [`CsgTree::lists`].
    All(Range<u32>),
    /// Of [`WithinReach::nodes`](super::scratch::WithinReach).
    WithinReach(Range<usize>),
}

impl Nodes {
    #[inline(always)]
    fn len(&self) -> usize {
        match self {
            Self::All(list) => list.len(),
            Self::WithinReach(list) => list.len(),
        }
    }
}

/// A place on each of eight rays, with what counts as the same place.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub(super) early: f64x8,
    pub(super) late: f64x8,
    /// The same as bounds see it.
    pub(super) about: f32x8,
    /// Where it is asked for; nothing that is said of other lanes means anything.
    pub(super) lanes: u8,
}

impl<'a, P: PartRoots> Along<'a, P> {
    #[inline(always)]
    pub(super) fn place(&self, at: f64x8, lanes: u8) -> Place {
        let tie = (self.reach + at.abs()) * f64x8::lit(self.tie);
        Place { early: at - tie, late: at + tie, about: f32x8::from_f64s(at), lanes }
    }

    /// Puts the parts in the order in which one of the rays comes to their bounds: what it meets first mostly hides the others.
    pub(super) fn sort(&mut self, lanes: u8) {
        let lane = lanes.trailing_zeros() as usize & (LANES - 1);
        let Scratch { near, order, .. } = &mut *self.scratch;
        order.clear();
        order.extend(near.iter().zip(0..).map(|(near, k)| (near.span.enter.lanes()[lane], k)));
        order.sort_unstable_by(|(a, m), (b, n)| a.total_cmp(b).then(m.cmp(n)));
    }

    /// Finds the parts that matter `within` a stretch, beside those that are known to; false if the rays are outside of
    /// something that the whole lies within.
    pub(super) fn cull(&mut self, stretch: &Stretch, within: &Span, lanes: u8) -> bool {
        let Self { tree, composite, .. } = *self;
        let Scratch { near, places, .. } = &mut *self.scratch;
        tree.cull(composite, (stretch, within, lanes), (near, places));
        let first = composite.parts.start;
        self.near =
            near.iter().fold(Many::default(), |parts, near| parts | Many::of_any(near.number - first));
        slice(&tree.needed, &composite.needed).iter().all(|&node| self.side(node) != Side::Outside)
    }

    /// What the inside of a part, which counts as near from now on, leaves of `within`; and the lanes that have left it before
    /// anything counts.
    pub(super) fn narrowed(&mut self, number: u32, within: &Span, t_min: f64x8, slack: f32x8) -> (Span, u8) {
        let place = self.scratch.near.len();
        self.scratch.near.push(Near::new(number, *within));
        self.scratch.places[(number - self.composite.parts.start) as usize] = place as u32;
        let PartCrossings { boundary: [first, end], from_inside, .. } = self.crossed(place);
        let (from, to) = match self.scratch.crossings[first as usize..end as usize] {
            // Both or none, unless a polynomial has lost one.
            [from, a, _, b] if from_inside == 0 && (from.equal(from) ^ a.equal(a)).none() => {
                (from, b.equal(b).select(b, a))
            }
            [from, to] if from_inside == 0 && (from.equal(from) ^ to.equal(to)).none() => (from, to),
            [at] => {
                let inf = f64x8::lit(f64::INFINITY);
                let begins_inside = Mask::from_bits(from_inside);
                // Without a crossing, which is NaN, all is inside or nothing.
                (begins_inside.select(-inf, at), begins_inside.select(at.min(inf), inf))
            }
            _ => return (*within, 0),
        };
        let behind = to.le(t_min * f64x8::lit(LEFT_BEHIND)) & t_min.gt(f64x8::zero());
        (within.narrowed(from, to, slack), behind.bits())
    }

    /// The crossings of the part at a place of `near`.
    #[inline(always)]
    pub(super) fn crossed(&mut self, place: usize) -> PartCrossings {
        match self.scratch.near[place].crossings {
            Some(crossings) => crossings,
            None => self.cross(place),
        }
    }

    fn cross(&mut self, place: usize) -> PartCrossings {
        let number = self.scratch.near[place].number;
        let first = self.scratch.crossings.len() as u32;
        let (surface, from_inside) = self.source.roots(number, self.rays, &mut self.scratch.crossings);
        let (surface_end, end) = (first + surface as u32, self.scratch.crossings.len() as u32);
        let boundary = match self.tree.parts[number as usize].solid {
            false => [first, first],
            true if end > surface_end => [surface_end, end],
            true => [first, surface_end],
        };
        let crossings = PartCrossings { first, surface_end, boundary, from_inside };
        self.scratch.near[place].crossings = Some(crossings);
        crossings
    }

    /// Lanes in which the crossing of part `number` at `at` is a surface of the whole.
    pub(super) fn is_surface(&mut self, number: u32, at: &Place) -> u8 {
        let tree = self.tree;
        let part = &tree.parts[number as usize];
        let constraints = slice(&tree.constraints, &part.constraints);
        if !part.solid {
            return self.is_kept(constraints, at);
        }
        let mut own = self.part(number, at);
        // A crossing at which nothing is entered or left: the inner skin of a spindle torus.
        let inner = if part.partial_skin { !(own.before ^ own.after) } else { 0 };
        for constraint in constraints {
            match constraint {
                Constraint::Inside(list, child) => {
                    for &node in tree.list(list) {
                        if node == *child || self.side(node) == Side::Inside {
                            continue;
                        }
                        let sides = self.node(node, at);
                        own.before &= sides.before;
                        own.after &= sides.after;
                        if (own.before | own.after) & at.lanes == 0 {
                            break;
                        }
                    }
                }
                Constraint::Outside(list, child) => {
                    let list = self.within_reach(list);
                    for k in 0..list.len() {
                        let node = self.child(&list, k);
                        if node == *child || self.side(node) == Side::Outside {
                            continue;
                        }
                        let sides = self.node(node, at);
                        own.before |= sides.before;
                        own.after |= sides.after;
                    }
                }
                Constraint::Inverted => own = Sides { before: !own.before, after: !own.after },
            }
        }
        let mut surface = own.before ^ own.after;
        if inner != 0 {
            surface = (surface & !inner) | (self.is_kept(constraints, at) & inner);
        }
        surface
    }

    /// Lanes in which a surface without an inside is kept.
    ///
    /// Without an inside there is no before and after: the surface is kept where the constraints hold on either side, so
    /// that a face on the rim of a clip is kept.
    fn is_kept(&mut self, constraints: &[Constraint], at: &Place) -> u8 {
        let tree = self.tree;
        constraints.iter().fold(!0, |valid, constraint| match constraint {
            Constraint::Inside(list, own) => tree.others(list, *own).fold(valid, |valid, node| {
                let sides = self.node(node, at);
                valid & (sides.before | sides.after)
            }),
            Constraint::Outside(list, own) => {
                let list = self.within_reach(list);
                (0..list.len()).fold(valid, |valid, k| {
                    let node = self.child(&list, k);
                    if node == *own {
                        return valid;
                    }
                    let sides = self.node(node, at);
                    valid & !(sides.before & sides.after)
                })
            }
            Constraint::Inverted => valid,
        })
    }

    /// Lanes whose place is in a node or on it.
    pub(super) fn is_within(&mut self, node: u32, at: &Place) -> u8 {
        let sides = self.node(node, at);
        sides.before | sides.after
    }

    pub(super) fn collect_parts(&mut self, node: u32, lanes: u8, at: &Place, found: &mut Vec<(u32, u8)>) {
        let sides = self.node(node, at);
        let lanes = lanes & (sides.before | sides.after);
        if lanes == 0 {
            return;
        }
        let tree = self.tree;
        let node = &tree.nodes[node as usize];
        match &node.kind {
            NodeKind::Part(number) => found.push((*number, lanes)),
            NodeKind::All(list) | NodeKind::Any(list) | NodeKind::Merged(list) | NodeKind::Odd(list) => {
                for &child in tree.list(list).iter().take(node.cuttable) {
                    self.collect_parts(child, lanes, at, found);
                }
            }
        }
    }

    /// On which side of a node the rays are all along, if that is known without crossing parts.
    #[inline(always)]
    fn side(&self, node: u32) -> Side {
        if self.tree.below[node as usize].meets(self.near) {
            Side::Either
        } else {
            self.tree.outside[node as usize]
        }
    }

    /// The nodes of a list that the rays may be in somewhere, and perhaps others: for those to whom what is outside makes no
    /// difference. (A merge of a thousand balls asks each crossing about each ball, and a ray meets twenty.)
    #[inline(always)]
    fn within_reach(&mut self, list: &Range<u32>) -> Nodes {
        if list.len() < LONG { Nodes::All(list.clone()) } else { self.cut_down(list) }
    }

    #[inline(never)]
    fn cut_down(&mut self, list: &Range<u32>) -> Nodes {
        if let Some((_, known)) = self.scratch.within_reach.known.iter().find(|(other, _)| other == list) {
            return Nodes::WithinReach(known.clone());
        }
        let Some(long) = self.tree.long.get(&list.start) else { return Nodes::All(list.clone()) };
        let Scratch { near, within_reach, .. } = &mut *self.scratch;
        let first = within_reach.nodes.len();
        long.within_reach(near.iter().map(|near| near.number), &mut within_reach.nodes);
        let found = first..within_reach.nodes.len();
        within_reach.known.push((list.clone(), found.clone()));
        Nodes::WithinReach(found)
    }

    /// Number `k` of some nodes.
    #[inline(always)]
    fn child(&self, nodes: &Nodes, k: usize) -> u32 {
        match nodes {
            Nodes::All(list) => self.tree.lists[list.start as usize + k],
            Nodes::WithinReach(list) => self.scratch.within_reach.nodes[list.start + k],
        }
    }

    /// Inside part `number` just before and just after `at`.
    fn part(&mut self, number: u32, at: &Place) -> Sides {
        let place = self.scratch.places[(number - self.composite.parts.start) as usize] as usize;
        if place == NOT_NEAR as usize || self.scratch.near[place].span.holds(at.about) & at.lanes == 0 {
            return Sides { before: 0, after: 0 };
        }
        let PartCrossings { boundary: [first, end], from_inside, .. } = self.crossed(place);
        let mut sides = Sides { before: from_inside, after: from_inside };
        for &crossing in &self.scratch.crossings[first as usize..end as usize] {
            sides.before ^= crossing.lt(at.early).bits();
            sides.after ^= crossing.le(at.late).bits();
        }
        sides
    }

    /// Inside `node` just before and just after `at`.
    fn node(&mut self, node: u32, at: &Place) -> Sides {
        match self.side(node) {
            Side::Inside => return Sides { before: !0, after: !0 },
            Side::Outside => return Sides { before: 0, after: 0 },
            Side::Either => {}
        }
        let tree = self.tree;
        let node = &tree.nodes[node as usize];
        let mut sides = match &node.kind {
            NodeKind::Part(number) => self.part(*number, at),
            NodeKind::All(list) => self.fold(&Nodes::All(list.clone()), at, (!0, Some(0)), |a, b| a & b),
            NodeKind::Any(list) | NodeKind::Merged(list) => {
                let list = self.within_reach(list);
                self.fold(&list, at, (0, Some(!0)), |a, b| a | b)
            }
            NodeKind::Odd(list) => {
                let list = self.within_reach(list);
                self.fold(&list, at, (0, None), |a, b| a ^ b)
            }
        };
        if node.inverted {
            sides = Sides { before: !sides.before, after: !sides.after };
        }
        sides
    }

    /// Folds the sides of nodes from `start` on, until they are what nothing `settles` further.
    #[inline(always)]
    fn fold(
        &mut self,
        list: &Nodes,
        at: &Place,
        (start, settled): (u8, Option<u8>),
        op: impl Fn(u8, u8) -> u8,
    ) -> Sides {
        let mut sides = Sides { before: start, after: start };
        for k in 0..list.len() {
            let child = self.node(self.child(list, k), at);
            sides = Sides { before: op(sides.before, child.before), after: op(sides.after, child.after) };
            if let Some(settled) = settled
                && ((sides.before ^ settled) | (sides.after ^ settled)) & at.lanes == 0
            {
                break;
            }
        }
        sides
    }
}
