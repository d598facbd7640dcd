//! Composites prepared to be decided in single precision: bodies of parts, and when a crossing of each is a surface.

use super::bracket::{Body, PAD};
use super::capsule::Capsule;
use super::{Capsules, Composite, Constraint, CsgTree, NodeKind, Part};
use crate::kernel::{Aabb, Solid};
use crate::lane::{LANES, Scalar};
use glam::DVec3;
use std::ops::{Range, RangeInclusive};

/// Composites of more parts are not prepared: a bit of a word for each.
pub(super) const MOST_PARTS: usize = 64;

/// Nor those whose expressions take more clauses, a part.
const MOST_CLAUSES: usize = 32;

/// So few parts are bracketed at once: a beam and its capsules take as long as one and a half.
const FEW: u32 = 3;

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
pub struct Plan {
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
    /// A bit for each part that the whole lies within.
    pub(super) required: u64,
    /// A bit for each other part.
    pub(super) others: u64,
    /// A bit for each part whose surface can be seen.
    pub(super) seen: u64,
    /// Around all parts, in eights: a stretch of [`CsgTree::capsules`]. None if parts other than required ones are few.
    pub(super) capsules: Range<u32>,
}

/// What is known of a part when its composite is decided.
#[derive(Debug, Clone, Default)]
pub struct Rule {
    pub(super) body: Body,
    /// Centre and square of the radius of a ball around it.
    pub(super) ball: Option<[f32; 4]>,
    /// Its crossings are surfaces where this holds,
    pub(super) all: Clause,
    /// and each of these, a stretch of [`CsgTree::clauses`].
    pub(super) clauses: Range<u32>,
}

/// Parts by bits: of some a place must be within, of others without. A rule's own clause holds if all of that is so, the
/// others if some is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Clause {
    pub(super) within: u64,
    pub(super) without: u64,
}

impl Clause {
    fn or(self, other: Self) -> Self {
        Self { within: self.within | other.within, without: self.without | other.without }
    }

    /// True of every place.
    fn is_empty_talk(self) -> bool {
        self.within & self.without != 0
    }

    fn is_single(self) -> bool {
        self.within.count_ones() + self.without.count_ones() == 1
    }
}

impl CsgTree {
    /// Prepares all composites for which that can be done; `solid` tells what body a part is.
    pub fn plan(&mut self, solid: impl Fn(&Part) -> Option<Solid>) {
        self.rules = vec![Rule::default(); self.parts.len()];
        for number in 0..self.composites.len() {
            let composite = self.composites[number].clone();
            let plan = self.plan_one(&composite, &solid);
            self.composites[number].plan = plan;
        }
    }

    fn plan_one(&mut self, composite: &Composite, solid: impl Fn(&Part) -> Option<Solid>) -> Option<Plan> {
        let (first, count) = (composite.parts.start, composite.parts.len());
        let [low, high] = composite.box_around.map(|corner| DVec3::from_array(corner.map(f64::from)));
        let around = Aabb { min: low, max: high };
        if count > MOST_PARTS || !around.is_finite() {
            return None;
        }
        // Rare, and so left to the walk: parts of a merge that not all rays see.
        let mut seen = self.parts[first as usize..][..count].iter().filter(|part| part.seen);
        if seen.next().is_some_and(|part| seen.any(|other| other.kinds != part.kinds)) {
            return None;
        }
        let (middle, size) = (around.center(), (high - low).length() * 0.5 * (1.0 + BALL_ROOM));
        let farthest = size * FARTHEST;
        if !(SIZES.contains(&size) && middle.abs().max_element() <= farthest) {
            return None;
        }
        let mut rules = Vec::with_capacity(count);
        let (mut clauses, mut capsules) = (Vec::new(), Vec::with_capacity(count));
        for number in composite.parts.clone() {
            let part = &self.parts[number as usize];
            let solid = solid(part).filter(|_| part.solid)?;
            let body = Body::new(&solid, middle, size);
            capsules.push(Capsule::around(&solid, part.bounds.intersection(around), size));
            let (all, own) = self.when_seen(part, first)?;
            let start = (self.clauses.len() + clauses.len()) as u32;
            clauses.extend(own);
            let ball = match body {
                Body::Ball(..) => None,
                _ => ball(part.bounds.intersection(around), middle, size),
            };
            rules.push(Rule { body, ball, all, clauses: start..(self.clauses.len() + clauses.len()) as u32 });
        }
        let bits = |wanted: &dyn Fn(u32) -> bool| {
            composite
                .parts
                .clone()
                .filter(|&number| wanted(number))
                .fold(0, |bits, n| bits | 1u64 << (n - first))
        };
        let required = &self.required[composite.required.start as usize..composite.required.end as usize];
        let required = bits(&|number| required.contains(&number));
        let others = bits(&|_| true) & !required;
        let first_block = self.capsules.len() as u32;
        if others.count_ones() > FEW {
            self.capsules.extend(capsules.chunks(LANES).map(|eight| Capsules::new(eight, middle, size)));
        }
        let plan = Plan {
            middle,
            size: (size * (1.0 + BALL_ROOM)) as f32,
            square: (size * size * (1.0 + BALL_ROOM)) as f32,
            // The start is at most this, the middle and the size away from the origin.
            farthest: (farthest - size - middle.abs().max_element()) * 0.5,
            pad: (size * PAD) as f32,
            required,
            others,
            seen: bits(&|number| self.parts[number as usize].seen),
            capsules: first_block..self.capsules.len() as u32,
        };
        self.clauses.extend(clauses);
        self.rules[first as usize..first as usize + count].clone_from_slice(&rules);
        Some(plan)
    }

    /// When a crossing of a part, which has an inside, is a surface: what must hold, in conjunctive normal form.
    fn when_seen(&self, part: &Part, first: u32) -> Option<(Clause, Vec<Clause>)> {
        let mut clauses = Vec::new();
        let constraints = part.constraints.start as usize..part.constraints.end as usize;
        for constraint in &self.constraints[constraints] {
            let (list, own, within) = match constraint {
                Constraint::Inside(list, own) => (list, *own, true),
                Constraint::Outside(list, own) => (list, *own, false),
                // On the other sides of the same places.
                Constraint::Inverted => continue,
            };
            for node in self.others(list, own) {
                clauses.extend(self.normal_form(node, within, first)?);
                if clauses.len() > MOST_CLAUSES + MOST_PARTS {
                    return None;
                }
            }
        }
        let (single, several): (Vec<Clause>, Vec<Clause>) = clauses.into_iter().partition(|c| c.is_single());
        (several.len() <= MOST_CLAUSES)
            .then(|| (single.into_iter().fold(Clause::default(), Clause::or), several))
    }

    /// Clauses that all hold where a place is `within` a node, or outside of it.
    fn normal_form(&self, number: u32, within: bool, first: u32) -> Option<Vec<Clause>> {
        let node = &self.nodes[number as usize];
        let within = within != node.inverted;
        let (list, every) = match &node.kind {
            NodeKind::Part(part) => {
                let bit = 1 << (part - first);
                return Some(vec![match within {
                    true => Clause { within: bit, without: 0 },
                    false => Clause { within: 0, without: bit },
                }]);
            }
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
            result.retain(|clause| !clause.is_empty_talk());
            if result.len() > MOST_CLAUSES + MOST_PARTS {
                return None;
            }
        }
        Some(result)
    }
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
    let [x, y, z] = center.to_array().map(|x| x as f32);
    Some([x, y, z, square as f32])
}
