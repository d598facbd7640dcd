//! Composites prepared to be decided in single precision: bodies of parts, and when a crossing of each is a surface.

use super::bracket::{Body, PAD};
use super::capsule::Capsule;
use super::carved::Carved;
use super::parts::{Few, Many, PartSet};
use super::rule::{Clause, Condition, Rule, WhenSeen};
use super::single::single;
use super::{Capsules, Composite, Constraint, CsgNode, CsgTree, NodeKind, Part, slice};
use crate::kernel::{Aabb, Solid};
use crate::lane::{LANES, Scalar};
use glam::DVec3;
use std::ops::{Range, RangeInclusive};

/// Composites of more parts are not prepared.
pub(super) const MOST_PARTS: usize = Many::ROOM;

/// What takes more clauses, of one part, is asked of the expression as it stands: a union of a dozen intersections of three parts
/// would take half a million.
const MOST_CLAUSES: usize = 32;

/// So few parts are bracketed at once: a beam and its capsules take as long as one and a half.
const AT_ONCE: u32 = 3;

/// A ball around a part that reaches out to this share of the ball around the whole is not worth a test.
const WORTH_A_TEST: f64 = 0.75;

/// Balls are larger by this share than what they are around, so that a test in single precision does not miss.
const BALL_ROOM: f64 = 1.0 / 1024.0;

/// Rays that start farther away, in sizes of the composite, are not decided in single precision: roundings of their starts, in
/// double precision, would matter.
const FARTHEST: f64 = (1u64 << 22) as f64;

/// Sizes of composites whose squares, and those of parts far smaller, are well within single precision.
const SIZES: RangeInclusive<f64> = 1e-12..=1e12;

/// How a composite is decided in single precision.
#[derive(Debug, Clone)]
pub enum Plan {
    /// One of up to 64 parts.
    Few(Decision<Few>),
    /// One of more.
    Many(Decision<Many>),
}

/// The same, with sets of its parts.
#[derive(Debug, Clone)]
pub struct Decision<P> {
    /// The middle of all that can be seen of it,
    pub(super) middle: DVec3,
    /// and the square of how far that goes.
    pub(super) square: f32,
    /// How far that goes.
    pub(super) size: f32,
    /// Rays that start farther than this from where they are nearest to the middle are not decided.
    pub(super) farthest: f64,
    /// What crossings in single and double precision may differ by.
    pub(super) pad: f32,
    /// Parts that the whole lies within.
    pub(super) required: P,
    /// Others.
    pub(super) others: P,
    /// Those of them that are out of the question where others are missed: see [`Rule::mates`].
    pub(super) dependent: P,
    /// Parts that are asked for their crossings.
    pub(super) asked: P,
    /// Parts whose surface can be seen.
    pub(super) seen: P,
    /// Around all parts, in eights: a stretch of [`CsgTree::capsules`]. None if parts other than required ones are few.
    pub(super) capsules: Range<u32>,
    /// How it is carved, if it is.
    pub(super) carved: Option<Carved<P>>,
    /// The rule of the first part.
    first_rule: u32,
}

/// What decisions refer to.
#[derive(Debug, Clone, Default)]
pub struct Rules<P> {
    /// By part, composite by composite.
    by_part: Vec<Rule<P>>,
    clauses: Vec<Clause<P>>,
    conditions: Vec<Condition>,
}

impl<P> Rules<P> {
    /// That of a part.
    #[inline(always)]
    pub(super) fn of(&self, decision: &Decision<P>, part: u32) -> &Rule<P> {
        &self.by_part[(decision.first_rule + part) as usize]
    }

    /// The clauses of a rule that hold if some of what they say is so.
    #[inline(always)]
    pub(super) fn clauses(&self, rule: &Rule<P>) -> &[Clause<P>] {
        slice(&self.clauses, &rule.clauses)
    }

    /// The conditions of a rule.
    #[inline(always)]
    pub(super) fn conditions(&self, rule: &Rule<P>) -> &[Condition] {
        slice(&self.conditions, &rule.conditions)
    }
}

/// Sets that rules are told in.
pub(super) trait RuleSet: PartSet {
    /// Those of all composites whose parts such sets have room for.
    fn rules(tree: &CsgTree) -> &Rules<Self>;

    /// The same, to add to.
    fn rules_mut(tree: &mut CsgTree) -> &mut Rules<Self>;
}

impl RuleSet for Few {
    fn rules(tree: &CsgTree) -> &Rules<Self> {
        &tree.few
    }

    fn rules_mut(tree: &mut CsgTree) -> &mut Rules<Self> {
        &mut tree.few
    }
}

impl RuleSet for Many {
    fn rules(tree: &CsgTree) -> &Rules<Self> {
        &tree.many
    }

    fn rules_mut(tree: &mut CsgTree) -> &mut Rules<Self> {
        &mut tree.many
    }
}

impl CsgTree {
    /// Prepares all composites for which that can be done; `solid` tells what body a part is.
    pub fn plan(&mut self, solid: impl Fn(&Part) -> Option<Solid>) {
        for number in 0..self.composites.len() {
            let composite = self.composites[number].clone();
            self.composites[number].plan = if composite.parts.len() <= Few::ROOM {
                self.plan_one(&composite, &solid).map(Plan::Few)
            } else {
                self.plan_one(&composite, &solid).map(Plan::Many)
            };
        }
    }

    fn plan_one<P: RuleSet>(
        &mut self,
        composite: &Composite,
        solid: impl Fn(&Part) -> Option<Solid>,
    ) -> Option<Decision<P>> {
        let (first, count) = (composite.parts.start, composite.parts.len());
        let [low, high] = composite.box_around.map(|corner| DVec3::from_array(corner.map(f64::from)));
        let around = Aabb { min: low, max: high };
        if count > P::ROOM || !around.is_finite() {
            return None;
        }
        // Rare, and so left to the walk: closed meshes, and parts of a merge that not all rays see.
        let nodes = slice(&self.nodes, &composite.nodes);
        if nodes.iter().any(|node| matches!(node.kind, NodeKind::Odd(_))) {
            return None;
        }
        let mut seen = self.parts[first as usize..][..count].iter().filter(|part| part.seen);
        if seen.next().is_some_and(|part| seen.any(|other| other.classes != part.classes)) {
            return None;
        }
        let (middle, size) = (around.center(), (high - low).length() * 0.5 * (1.0 + BALL_ROOM));
        let farthest = size * FARTHEST;
        if !(SIZES.contains(&size) && middle.abs().max_element() <= farthest) {
            return None;
        }
        let mut own =
            Rules { by_part: Vec::with_capacity(count), clauses: Vec::new(), conditions: Vec::new() };
        let (mut capsules, mut bounded) = (Vec::with_capacity(count), P::default());
        let (mut bodies, mut when_seen) = (Vec::with_capacity(count), Vec::with_capacity(count));
        let before = P::rules(self);
        let (first_clause, first_condition) = (before.clauses.len(), before.conditions.len());
        let first_rule = before.by_part.len() as u32;
        for number in composite.parts.clone() {
            let part = &self.parts[number as usize];
            let solid = solid(part).filter(|_| part.solid)?;
            let bounds = part.bounds.intersection(around);
            capsules.push(Capsule::around(&solid, bounds, size));
            bodies.push((solid, bounds));
            if !matches!(solid, Solid::HalfSpace { .. }) {
                bounded = bounded | P::of(number - first);
            }
            when_seen.push(self.when_seen(part, first));
        }
        for ((solid, bounds), seen) in bodies.iter().zip(&when_seen) {
            let body = Body::new(solid, *bounds, middle, size);
            let ball = match body {
                Body::Ball(..) => None,
                _ => ball(*bounds, middle, size),
            };
            own.by_part.push(Rule {
                body,
                ball,
                all: seen.all,
                clauses: append(first_clause, &mut own.clauses, &seen.clauses),
                conditions: append(first_condition, &mut own.conditions, &seen.conditions),
                mates: P::default(),
            });
        }
        self.find_mates(composite, bounded, &mut own.by_part);
        let parts = |wanted: &dyn Fn(u32) -> bool| {
            let wanted = composite.parts.clone().filter(|&number| wanted(number));
            wanted.fold(P::default(), |parts, number| parts | P::of(number - first))
        };
        let required = slice(&self.required, &composite.required);
        let required = parts(&|number| required.contains(&number));
        let others = parts(&|_| true) & !required;
        let first_block = self.capsules.len() as u32;
        if others.count() > AT_ONCE {
            self.capsules.extend(capsules.chunks(LANES).map(|eight| Capsules::new(eight, middle, size)));
        }
        let rule = |number: u32| &own.by_part[(number - first) as usize];
        let dependent = parts(&|number| !rule(number).mates.is_empty());
        let seen = parts(&|number| self.parts[number as usize].seen);
        let carved = self.carve(composite, (required, seen), (&bodies, &when_seen), (middle, size));
        let asked = parts(&|number| matches!(rule(number).body, Body::Asked(..) | Body::AskedWhole));
        let decision = Decision {
            middle,
            size: (size * (1.0 + BALL_ROOM)) as f32,
            square: (size * size * (1.0 + BALL_ROOM)) as f32,
            // The start is at most this, the middle and the size away from the origin.
            farthest: (farthest - size - middle.abs().max_element()) * 0.5,
            pad: (size * PAD) as f32,
            required,
            others,
            dependent: others & dependent,
            asked,
            seen,
            capsules: first_block..self.capsules.len() as u32,
            carved,
            first_rule,
        };
        let rules = P::rules_mut(self);
        rules.by_part.append(&mut own.by_part);
        rules.clauses.append(&mut own.clauses);
        rules.conditions.append(&mut own.conditions);
        Some(decision)
    }

    /// Gives half spaces those of the `bounded` parts that they are intersected with: what is not within these is not within the
    /// intersection, whatever the half space is.
    fn find_mates<P: PartSet>(&self, composite: &Composite, bounded: P, rules: &mut [Rule<P>]) {
        let first = composite.parts.start;
        for node in slice(&self.nodes, &composite.nodes) {
            let NodeKind::All(list) = &node.kind else { continue };
            let (mut mates, mut half_spaces) = (P::default(), P::default());
            for &child in self.list(list) {
                let CsgNode { kind: NodeKind::Part(part), inverted, .. } = self.nodes[child as usize] else {
                    continue;
                };
                let part = P::of(part - first);
                if !part.meets(bounded) {
                    half_spaces = half_spaces | part;
                } else if !inverted {
                    mates = mates | part;
                }
            }
            for part in half_spaces.each() {
                let rule = &mut rules[part as usize];
                rule.mates = mates & rule.all.within;
            }
        }
    }

    /// When a crossing of a part, which has an inside, is a surface: in conjunctive normal form, as far as that is short.
    fn when_seen<P: PartSet>(&self, part: &Part, first: u32) -> WhenSeen<P> {
        let mut seen = WhenSeen::default();
        for constraint in slice(&self.constraints, &part.constraints) {
            let (list, own, within) = match constraint {
                Constraint::Inside(list, own) => (list, *own, true),
                Constraint::Outside(list, own) => (list, *own, false),
                // On the other sides of the same places.
                Constraint::Inverted => continue,
            };
            for node in self.others(list, own) {
                if let CsgNode { kind: NodeKind::Part(other), inverted, .. } = self.nodes[node as usize] {
                    seen.all = seen.all.or(Clause::of(other - first, within != inverted));
                    continue;
                }
                let form = self.normal_form(node, within, first);
                let (single, several): (Vec<Clause<P>>, Vec<Clause<P>>) =
                    form.iter().flatten().partition(|clause| clause.is_single());
                seen.all = single.into_iter().fold(seen.all, Clause::or);
                if form.is_some() && seen.clauses.len() + several.len() <= MOST_CLAUSES {
                    seen.clauses.extend(several);
                } else {
                    seen.conditions.push(Condition { node, within });
                }
            }
        }
        seen
    }

    /// Clauses that all hold where a place is `within` a node, or outside of it.
    fn normal_form<P: PartSet>(&self, number: u32, within: bool, first: u32) -> Option<Vec<Clause<P>>> {
        let node = &self.nodes[number as usize];
        let within = within != node.inverted;
        let (list, every) = match &node.kind {
            NodeKind::Part(part) => return Some(vec![Clause::of(part - first, within)]),
            NodeKind::All(list) => (list, within),
            NodeKind::Any(list) | NodeKind::Merged(list) => (list, !within),
            NodeKind::Odd(_) => return None,
        };
        let mut result = if every { Vec::new() } else { vec![Clause::default()] };
        for &child in self.list(list) {
            let clauses = self.normal_form(child, within, first)?;
            if every {
                result.extend(clauses);
            } else {
                result = result.iter().flat_map(|a| clauses.iter().map(|b| a.or(*b))).collect();
            }
            result.retain(|clause| !clause.is_tautology());
            if result.len() > MOST_CLAUSES + P::ROOM {
                return None;
            }
        }
        Some(result)
    }
}

/// Puts `own` behind `all`, which come behind so many others: where they will stand.
fn append<T: Copy>(before: usize, all: &mut Vec<T>, own: &[T]) -> Range<u32> {
    let start = (before + all.len()) as u32;
    all.extend_from_slice(own);
    start..(before + all.len()) as u32
}

/// Around a box, if that saves anything beside the ball of `size` around `middle`.
fn ball(bounds: Aabb, middle: DVec3, size: f64) -> Option<[f32; 4]> {
    if !bounds.is_finite() {
        return None;
    }
    let (center, radius) = (bounds.center() - middle, (bounds.max - bounds.min).length() * 0.5);
    if center.length() + radius > size * WORTH_A_TEST {
        return None;
    }
    // The test loses some roundings of squares of the size of the whole.
    let square = radius * radius * (1.0 + BALL_ROOM) + size * size * (64.0 * f32::UNIT_ROUNDOFF);
    let [x, y, z] = single(center);
    Some([x, y, z, square as f32])
}
