//! The nearest surface of a composite along eight rays.

use super::cull::{Side, Stretch, max_abs};
use super::{Composite, Constraint, CsgTree, NodeKind};
use crate::kernel::Rays;
use crate::lane::{LANES, Lane, Mask, Scalar, f64x8};
use std::ops::Range;

/// Crossings that lie closer together than this share of the distances involved are one place: coincident faces of
/// two parts are computed by different formulas and differ by some roundings (4 each for `t` and for the origin
/// relative to either part).
const TIE: f64 = 16.0 * f64::UNIT_ROUNDOFF;

/// Crossings of a composite's parts with eight rays; kept between calls so that nothing is allocated.
#[derive(Debug, Default)]
pub struct Scratch {
    crossings: Vec<f64x8>,
    parts: Vec<PartCrossings>,
    sides: Vec<Side>,
    /// Parts that rays may meet.
    near: Vec<u32>,
}

#[derive(Debug, Clone, Default)]
struct PartCrossings {
    /// Where the surface is crossed, as a stretch of `crossings`.
    surface: Range<usize>,
    /// Where inside and outside change.
    boundary: Range<usize>,
    /// Lanes that come from inside, infinitely far behind the start.
    from_inside: u8,
}

/// The nearest hits of eight rays so far.
#[derive(Debug)]
pub struct Best<'a> {
    /// How far they are.
    pub t: f64x8,
    /// Which surfaces they are; `u32::MAX` for none.
    pub surface: [u32; LANES],
    /// Surface number of part 0.
    pub first_part: u32,
    /// By surface number: the lower wins where two are equally near.
    pub rank: &'a [u32],
}

/// What a part does along eight rays: surface crossings and boundary crossings (both into the list given, surface
/// first), how many are surface, and the lanes that are inside at minus infinity. `None` for the second list: the same.
pub trait PartRoots {
    /// See the trait.
    fn roots(&self, part: u32, rays: &Rays<f64x8>, out: &mut Vec<f64x8>) -> (usize, u8);
}

/// The two sides of a place on a ray: a bit per lane for "inside just before" and "inside just after".
#[derive(Debug, Clone, Copy)]
struct Sides {
    before: u8,
    after: u8,
}

impl CsgTree {
    /// Puts the nearest surface of `composite` beyond `t_min` into `best`, in the lanes of `lanes` where it is nearer
    /// than what stands there; returns the lanes that changed. With `any`, a lane is done when it has changed once.
    pub fn nearest(
        &self,
        composite: &Composite,
        (rays, stretch): (&Rays<f64x8>, &Stretch),
        (lanes, t_min, any): (u8, f64x8, bool),
        source: &impl PartRoots,
        scratch: &mut Scratch,
        best: &mut Best,
    ) -> u8 {
        let mut changed = 0;
        let Some(along) = self.along(composite, rays, (stretch, best.t, lanes), source, scratch) else {
            return 0;
        };

        for &number in along.near {
            let part = &self.parts[number as usize];
            if !part.seen {
                continue;
            }
            for k in along.parts[(number - composite.parts.start) as usize].surface.clone() {
                let at = along.crossings[k];
                let mut wanted = (at.gt(t_min) & at.le(best.t)).bits() & lanes;
                if any {
                    wanted &= at.lt(best.t).bits() & !changed;
                }
                if wanted == 0 {
                    continue;
                }
                wanted &= along.is_surface(number, &along.place(at));
                if any {
                    for (lane, surface) in best.surface.iter_mut().enumerate() {
                        if wanted >> lane & 1 == 1 {
                            *surface = best.first_part + number;
                        }
                    }
                    changed |= wanted;
                    if changed == lanes {
                        return changed;
                    }
                    continue;
                }
                let mut ties = at.equal(best.t).bits() & wanted;
                while ties != 0 {
                    let lane = ties.trailing_zeros() as usize;
                    ties &= ties - 1;
                    let other = best.surface[lane];
                    let first = other != u32::MAX
                        && best.rank[(best.first_part + number) as usize] < best.rank[other as usize];
                    if !first {
                        wanted &= !(1 << lane);
                    }
                }
                best.t = Mask::from_bits(wanted).select(at, best.t);
                for (lane, surface) in best.surface.iter_mut().enumerate() {
                    if wanted >> lane & 1 == 1 {
                        *surface = best.first_part + number;
                    }
                }
                changed |= wanted;
            }
        }
        changed
    }

    /// The interiors that the rays start in, with a bit for each lane: of a union or merge those of its children, of any
    /// other composite its own.
    pub fn interiors_at_start(
        &self,
        composite: &Composite,
        rays: &Rays<f64x8>,
        source: &impl PartRoots,
        scratch: &mut Scratch,
    ) -> Vec<(u32, u8)> {
        let line = Stretch::new(rays, !0);
        let lanes = !0;
        let mut found = Vec::new();
        let Some(along) =
            self.along(composite, rays, (&line, f64x8::lit(f64::INFINITY), lanes), source, scratch)
        else {
            return found;
        };
        along.collect_interiors(composite.root, &along.place(f64x8::zero()), !0, &mut found);
        found
    }

    /// The parts that the places at `t` (known to a share of `t_error`) along the rays lie in or on, with a bit for each lane that does: whose looks a
    /// cut face without one of its own shows (`cutaway_textures`).
    pub fn parts_at(
        &self,
        composite: &Composite,
        rays: &Rays<f64x8>,
        (lanes, t, t_error): (u8, f64x8, f64),
        source: &impl PartRoots,
        scratch: &mut Scratch,
    ) -> Vec<(u32, u8)> {
        let line = Stretch::new(rays, lanes);
        let mut found = Vec::new();
        let Some(mut along) =
            self.along(composite, rays, (&line, f64x8::lit(f64::INFINITY), lanes), source, scratch)
        else {
            return found;
        };
        along.tie = TIE + t_error;
        along.collect_parts(composite.root, lanes, &along.place(t), &mut found);
        found
    }

    /// Finds the crossings of all parts that matter on the stretch; `None` if none can be a surface of the whole and
    /// the rays are nowhere inside.
    fn along<'a>(
        &'a self,
        composite: &'a Composite,
        rays: &Rays<f64x8>,
        stretch: (&Stretch, f64x8, u8),
        source: &impl PartRoots,
        scratch: &'a mut Scratch,
    ) -> Option<Along<'a>> {
        let Scratch { crossings, parts, sides, near } = scratch;
        if !self.cull(composite, stretch, near, sides) {
            return None;
        }
        crossings.clear();
        // What stands there for parts that are not near is never read.
        parts.resize(parts.len().max(composite.parts.len()), PartCrossings::default());
        for &number in near.iter() {
            let first = crossings.len();
            let (surface, from_inside) = source.roots(number, rays, crossings);
            let surface = first..first + surface;
            let boundary = match self.parts[number as usize].solid {
                false => first..first,
                true if crossings.len() > surface.end => surface.end..crossings.len(),
                true => surface.clone(),
            };
            parts[(number - composite.parts.start) as usize] =
                PartCrossings { surface, boundary, from_inside };
        }
        let reach = max_abs(rays.origin);
        Some(Along { tree: self, composite, near, crossings, parts, sides, reach, tie: TIE })
    }
}

/// Everything known along the eight rays.
struct Along<'a> {
    tree: &'a CsgTree,
    composite: &'a Composite,
    /// Parts that rays may meet.
    near: &'a [u32],
    crossings: &'a [f64x8],
    parts: &'a [PartCrossings],
    /// By node of the composite.
    sides: &'a [Side],
    reach: f64x8,
    /// See [`TIE`].
    tie: f64,
}

/// A place on each of eight rays, with what counts as the same place.
struct Place {
    early: f64x8,
    late: f64x8,
}

impl Along<'_> {
    #[inline(always)]
    fn place(&self, at: f64x8) -> Place {
        let tie = (self.reach + at.abs()) * f64x8::lit(self.tie);
        Place { early: at - tie, late: at + tie }
    }

    /// Lanes in which the crossing of part `number` at `at` is a surface of the whole.
    fn is_surface(&self, number: u32, at: &Place) -> u8 {
        let part = &self.tree.parts[number as usize];
        let constraints =
            &self.tree.constraints[part.constraints.start as usize..part.constraints.end as usize];
        if !part.solid {
            return self.is_kept(constraints, at);
        }
        let mut own = self.part(number, at);
        // A crossing at which nothing is entered or left: the inner skin of a spindle torus.
        let inner = if part.partial_skin { !(own.before ^ own.after) } else { 0 };
        for constraint in constraints {
            match constraint {
                Constraint::Inside(list, child) => {
                    for &node in self.list(list) {
                        if node == *child || self.side(node) == Side::Inside {
                            continue;
                        }
                        let sides = self.node(node, at);
                        own.before &= sides.before;
                        own.after &= sides.after;
                    }
                }
                Constraint::Outside(list, child) => {
                    for &node in self.list(list) {
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
    fn is_kept(&self, constraints: &[Constraint], at: &Place) -> u8 {
        constraints.iter().fold(!0, |valid, constraint| match constraint {
            Constraint::Inside(list, own) => self.others(list, *own).fold(valid, |valid, node| {
                let sides = self.node(node, at);
                valid & (sides.before | sides.after)
            }),
            Constraint::Outside(list, own) => self.others(list, *own).fold(valid, |valid, node| {
                let sides = self.node(node, at);
                valid & !(sides.before & sides.after)
            }),
            Constraint::Inverted => valid,
        })
    }

    fn collect_interiors(&self, number: u32, start: &Place, lanes: u8, found: &mut Vec<(u32, u8)>) {
        let sides = self.node(number, start);
        let lanes = lanes & (sides.before | sides.after);
        let node = &self.tree.nodes[number as usize];
        match &node.kind {
            _ if lanes == 0 => {}
            NodeKind::Any(list) | NodeKind::Merged(list) => {
                for &child in self.list(list) {
                    self.collect_interiors(child, start, lanes, found);
                }
            }
            _ => found.push((node.interior, lanes)),
        }
    }

    fn collect_parts(&self, node: u32, lanes: u8, at: &Place, found: &mut Vec<(u32, u8)>) {
        let sides = self.node(node, at);
        let lanes = lanes & (sides.before | sides.after);
        if lanes == 0 {
            return;
        }
        let node = &self.tree.nodes[node as usize];
        match &node.kind {
            NodeKind::Part(number) => found.push((*number, lanes)),
            NodeKind::All(list) | NodeKind::Any(list) | NodeKind::Merged(list) | NodeKind::Odd(list) => {
                for &child in self.list(list).iter().take(node.cuttable) {
                    self.collect_parts(child, lanes, at, found);
                }
            }
        }
    }

    /// On which side of a node the rays are all along.
    #[inline(always)]
    fn side(&self, node: u32) -> Side {
        self.sides[(node - self.composite.nodes.start) as usize]
    }

    fn list(&self, range: &Range<u32>) -> &[u32] {
        &self.tree.lists[range.start as usize..range.end as usize]
    }

    /// The nodes of a list without one of them.
    fn others(&self, range: &Range<u32>, own: u32) -> impl Iterator<Item = u32> {
        self.list(range).iter().copied().filter(move |&node| node != own)
    }

    /// Inside part `number` just before and just after `at`.
    fn part(&self, number: u32, at: &Place) -> Sides {
        let part = &self.parts[(number - self.composite.parts.start) as usize];
        let mut sides = Sides { before: part.from_inside, after: part.from_inside };
        for &crossing in &self.crossings[part.boundary.clone()] {
            sides.before ^= crossing.lt(at.early).bits();
            sides.after ^= crossing.le(at.late).bits();
        }
        sides
    }

    /// Inside `node` just before and just after `at`.
    fn node(&self, node: u32, at: &Place) -> Sides {
        match self.side(node) {
            Side::Inside => return Sides { before: !0, after: !0 },
            Side::Outside => return Sides { before: 0, after: 0 },
            Side::Either => {}
        }
        let node = &self.tree.nodes[node as usize];
        let mut sides = match &node.kind {
            NodeKind::Part(number) => self.part(*number, at),
            NodeKind::All(list) => self.fold(list, at, !0, |a, b| a & b),
            NodeKind::Any(list) | NodeKind::Merged(list) => self.fold(list, at, 0, |a, b| a | b),
            NodeKind::Odd(list) => self.fold(list, at, 0, |a, b| a ^ b),
        };
        if node.inverted {
            sides = Sides { before: !sides.before, after: !sides.after };
        }
        sides
    }

    fn fold(&self, list: &Range<u32>, at: &Place, start: u8, op: impl Fn(u8, u8) -> u8) -> Sides {
        let mut sides = Sides { before: start, after: start };
        for &child in self.list(list) {
            let child = self.node(child, at);
            sides = Sides { before: op(sides.before, child.before), after: op(sides.after, child.after) };
        }
        sides
    }
}
