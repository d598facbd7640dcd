//! What eight rays cannot meet: parts by their bounds, and with them whole branches of the expression.

use super::long::{LONG, LongList};
use super::parts::Many;
use super::{BoxTree, Composite, CsgNode, CsgTree, NodeKind, Surroundings, slice};
use crate::kernel::{Aabb, Rays};
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3, bits, f32x8, f64x8, highest, prefetch};
use smallvec::SmallVec;
use std::ops::Range;

/// Bounds of parts are widened by this share of the largest coordinate at hand: starts are rounded to single
/// precision, and that of a ray that leaves a part may lie some roundings (of double precision) outside of it.
const BOUNDS_SLACK: f64 = 4.0 * f32::UNIT_ROUNDOFF;

/// What a plane's distance along a ray may be off by, of its size: roundings of the difference, the inverse direction and
/// the product, doubled for either side, with room.
const DISTANCE_PAD: f64 = 16.0 * f32::UNIT_ROUNDOFF;

/// In place of a part's place in the list of those that are near.
pub(super) const NOT_NEAR: u32 = u32::MAX;

/// So few parts are asked one by one at once.
const FEW: usize = 3;

/// Blocks that may wait without an allocation: eight of the coarsest, and seven for each level below of a million parts.
const DEEPEST: usize = 64;

/// Where eight rays are in relation to a node of a composite, as far as bounds tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// All of them, all along.
    Inside,
    /// None of them, anywhere.
    Outside,
    /// It must be looked at.
    Either,
}

impl Side {
    fn inverted(self) -> Self {
        match self {
            Self::Inside => Self::Outside,
            Self::Outside => Self::Inside,
            Self::Either => Self::Either,
        }
    }
}

/// The bounds of eight parts, rounded outward.
#[derive(Debug, Clone, Copy)]
pub struct BoundsBlock {
    min: [[f32; LANES]; 3],
    max: [[f32; LANES]; 3],
    /// Those that are not [`Part::closed`](super::Part::closed), of parts: here, as a mesh's parts are far apart in memory.
    pub(super) open: u8,
}

impl BoundsBlock {
    /// Of up to eight boxes; the lanes without one hold nothing.
    pub fn new(boxes: &[Aabb]) -> Self {
        let (min, max) = ([[f32::INFINITY; LANES]; 3], [[f32::NEG_INFINITY; LANES]; 3]);
        let mut block = Self { min, max, open: 0 };
        for (k, bounds) in boxes.iter().enumerate().take(LANES) {
            for axis in 0..3 {
                block.min[axis][k] = (bounds.min[axis] as f32).next_down();
                block.max[axis][k] = (bounds.max[axis] as f32).next_up();
            }
        }
        block
    }

    /// Lowest and highest corner of number `k`.
    #[inline(always)]
    fn corners(&self, k: usize) -> ([f32; 3], [f32; 3]) {
        (self.min.map(|axis| axis[k]), self.max.map(|axis| axis[k]))
    }
}

/// Bounds of a number over the rays of a stretch.
#[derive(Debug, Clone, Copy)]
struct Interval {
    least: f32,
    most: f32,
}

impl Interval {
    /// By `slack` wider on either side.
    fn widened(self, slack: f32) -> Self {
        Self { least: (self.least - slack).next_down(), most: (self.most + slack).next_up() }
    }
}

/// The least and the most of seven numbers over the lanes given, all at once.
#[inline(always)]
fn ends([a, b, c, d, e, f, g]: [f32x8; 7], lanes: u8) -> [[f32; LANES]; 2] {
    let (live, first) = (Mask::from_bits(lanes), lanes.trailing_zeros() as usize & (LANES - 1));
    let rows = [a, b, c, d, e, f, g, g].map(|x| live.select(x, f32x8::splat(x.lanes()[first])));
    let [a, b, c, d, e, f, g, h] = f32x8::transpose(rows);
    let least = a.min(b).min(c.min(d)).min(e.min(f).min(g.min(h)));
    let most = a.max(b).max(c.max(d)).max(e.max(f).max(g.max(h)));
    [least.to_array(), most.to_array()]
}

/// The stretches of eight rays that bounds leave: from `enter` to `leave`, nothing where that is the other way round. Padded
/// for rounding, so that a place counts as within also where its own distance is rounded to single precision.
#[derive(Debug, Clone, Copy, Default)]
pub struct Span {
    pub(super) enter: f32x8,
    pub(super) leave: f32x8,
}

impl Span {
    /// All along.
    pub(super) fn all() -> Self {
        Self { enter: f32x8::lit(f64::NEG_INFINITY), leave: f32x8::lit(f64::INFINITY) }
    }

    /// From the start up to `t_far`.
    #[inline(always)]
    pub(super) fn up_to(t_far: f64x8) -> Self {
        Self { enter: f32x8::zero(), leave: f32x8::from_f64s(t_far) }
    }

    /// Lanes in which something is left.
    #[inline(always)]
    pub(super) fn lanes(&self) -> u8 {
        self.enter.le(self.leave).bits()
    }

    /// What is left of it between two distances; NaN bounds nothing.
    #[inline(always)]
    pub(super) fn narrowed(&self, from: f64x8, to: f64x8, slack: f32x8) -> Self {
        let (from, to, pad) = (f32x8::from_f64s(from), f32x8::from_f64s(to), f32x8::lit(DISTANCE_PAD));
        // The numbers' own `max` and `min` let NaN lose. (Where NaN ended the stretch, a few rays lost a
        // polynomial that a plane cuts: scenes/feature/poly.scn.)
        Self {
            enter: self.enter.max(from - (from.abs() * pad + slack)),
            leave: self.leave.min(to + (to.abs() * pad + slack)),
        }
    }

    /// Lanes in which the place is within.
    #[inline(always)]
    pub(super) fn holds(&self, about: f32x8) -> u8 {
        (self.enter.le(about) & about.le(self.leave)).bits()
    }
}

/// Eight rays as bounds see them: in single precision, whatever that of the parts.
#[derive(Debug, Clone)]
pub struct Stretch {
    lines: Lines,
    /// Origin and inverse direction by axis over all rays; `None` if they go several ways.
    group: Option<[[Interval; 2]; 3]>,
}

/// Eight lines.
#[derive(Debug, Clone)]
struct Lines {
    /// The starts moved up by the slack, as low corners see them, and down, as high ones do.
    up: Vec3<f32x8>,
    down: Vec3<f32x8>,
    inverse: Vec3<f32x8>,
    /// How much wider the bounds are taken.
    slack: f32x8,
}

impl Stretch {
    /// The rays of `lanes`.
    pub fn new(rays: &Rays<f64x8>, lanes: u8) -> Self {
        let (origin, inverse) = (rays.origin.cast::<f32x8>(), rays.dir.cast::<f32x8>().slab_inverse());
        let slack = origin.abs().max_element() * f32x8::lit(BOUNDS_SLACK);
        let [least, most] =
            ends([origin.x, origin.y, origin.z, inverse.x, inverse.y, inverse.z, slack], lanes);
        let one_octant = (3..6).all(|axis| most[axis] < 0.0 || least[axis] >= 0.0);
        let group = one_octant.then(|| {
            let of = |k: usize| Interval { least: least[k], most: most[k] };
            [0, 1, 2].map(|axis| [of(axis).widened(most[6]), of(axis + 3)])
        });
        let around = Vec3::new(slack, slack, slack);
        let lines = Lines { up: origin + around, down: origin - around, inverse, slack };
        Self { lines, group }
    }

    /// A bit for each part of a block that some ray may meet between `from` and `to`, by one interval test for all eight
    /// (Boulos, Wald, Shirley 2006, Geometric and arithmetic culling methods for entire ray packets).
    fn may_meet_block(&self, block: &BoundsBlock, from: f32, to: f32) -> u8 {
        let Some(axes) = &self.group else { return !0 };
        let (mut near, mut far) = (f32x8::splat(from), f32x8::splat(to));
        for (axis, [origin, inverse]) in axes.iter().enumerate() {
            let (least, most) = (f32x8::splat(inverse.least), f32x8::splat(inverse.most));
            let (low, high) = (f32x8::from_array(block.min[axis]), f32x8::from_array(block.max[axis]));
            let (o_least, o_most) = (f32x8::splat(origin.least), f32x8::splat(origin.most));
            let (enter, leave) = if inverse.least >= 0.0 {
                (low - o_most, high - o_least)
            } else {
                (high - o_least, low - o_most)
            };
            near = (enter * least).min(enter * most).max(near);
            far = (leave * least).max(leave * most).min(far);
        }
        let pad = f32x8::lit(DISTANCE_PAD);
        (near - near.abs() * pad).le(far + far.abs() * pad).bits()
    }

    /// How much wider the bounds are taken.
    #[inline(always)]
    pub(super) fn slack(&self) -> f32x8 {
        self.lines.slack
    }

    /// What a box leaves of `within`.
    #[inline(always)]
    pub(super) fn span(&self, min: [f32; 3], max: [f32; 3], within: &Span) -> Span {
        self.lines.span([min, max].map(Vec3::broadcast), within)
    }

    /// For each of the boxes `which` of a block, the lanes of `lanes` in which it leaves something of `within`: ray by ray or box by
    /// box, whichever are fewer.
    #[inline(always)]
    fn met(&self, block: &BoundsBlock, which: u8, within: &Span, lanes: u8) -> [u8; LANES] {
        let mut met = [0; LANES];
        if which.count_ones() <= lanes.count_ones() {
            for k in bits(which) {
                let (min, max) = block.corners(k);
                met[k] = self.span(min, max, within).lanes() & lanes;
            }
            return met;
        }
        let boxes = [block.min, block.max].map(|corner| {
            let [x, y, z] = corner.map(f32x8::from_array);
            Vec3::new(x, y, z)
        });
        for lane in bits(lanes) {
            let within = Span { enter: of_lane(within.enter, lane), leave: of_lane(within.leave, lane) };
            met[lane] = self.lines.of_lane(lane).span(boxes, &within).lanes() & which;
        }
        transposed(met)
    }
}

impl Lines {
    /// What boxes leave of `within`: all lines, each against the box in its lane.
    #[inline(always)]
    fn span(&self, [min, max]: [Vec3<f32x8>; 2], within: &Span) -> Span {
        let low = (min - self.up).mul(self.inverse);
        let high = (max - self.down).mul(self.inverse);
        let near = low.x.min(high.x).max(low.y.min(high.y)).max(low.z.min(high.z)).max(within.enter);
        let far = low.x.max(high.x).min(low.y.max(high.y)).min(low.z.max(high.z)).min(within.leave);
        let pad = f32x8::lit(DISTANCE_PAD);
        Span { enter: near - near.abs() * pad, leave: far + (far.abs() * pad + self.slack) }
    }

    /// One line in all lanes.
    #[inline(always)]
    fn of_lane(&self, lane: usize) -> Self {
        let of = |v: Vec3<f32x8>| Vec3::new(of_lane(v.x, lane), of_lane(v.y, lane), of_lane(v.z, lane));
        Self {
            up: of(self.up),
            down: of(self.down),
            inverse: of(self.inverse),
            slack: of_lane(self.slack, lane),
        }
    }
}

/// One lane in all.
#[inline(always)]
fn of_lane(x: f32x8, lane: usize) -> f32x8 {
    f32x8::splat(x.lanes()[lane & (LANES - 1)])
}

/// Eight rows of eight bits, as columns (Warren 2012, Hacker's Delight, section 7-3).
#[inline(always)]
fn transposed(rows: [u8; LANES]) -> [u8; LANES] {
    let mut x = u64::from_le_bytes(rows);
    for (shift, mask) in [(7, 0x00aa_00aa_00aa_00aa), (14, 0x0000_cccc_0000_cccc), (28, 0xf0f0_f0f0)] {
        let swap = (x ^ x >> shift) & mask;
        x ^= swap ^ swap << shift;
    }
    x.to_le_bytes()
}

/// A part that rays may meet.
#[derive(Debug, Clone)]
pub(super) struct Near {
    pub(super) number: u32,
    /// What its bounds leave of the rays: beyond, all are outside of it and none crosses it. All along for what is not closed.
    pub(super) span: Span,
    /// Its crossings, once they have been asked for.
    pub(super) crossings: Option<PartCrossings>,
}

impl Near {
    #[inline(always)]
    pub(super) fn new(number: u32, span: Span) -> Self {
        Self { number, span, crossings: None }
    }
}

/// Stretches of the list that crossings are kept in.
#[derive(Debug, Clone, Copy)]
pub(super) struct PartCrossings {
    /// Where the surface is crossed begins here,
    pub(super) first: u32,
    /// and ends here.
    pub(super) surface_end: u32,
    /// Where inside and outside change.
    pub(super) boundary: [u32; 2],
    /// Lanes that come from inside, infinitely far behind the start.
    pub(super) from_inside: u8,
}

impl Surroundings {
    /// True if none of eight places is within its bounds, widened as for rays.
    pub(super) fn are_away_from(&self, places: Vec3<f64x8>) -> bool {
        let slack = max_abs(places) * f64x8::lit(BOUNDS_SLACK);
        let [low, high] = self.within;
        let mut within = Mask::all_set();
        for (axis, x) in [places.x, places.y, places.z].into_iter().enumerate() {
            within &=
                (x + slack).ge(f64x8::lit(low[axis].into())) & (x - slack).le(f64x8::lit(high[axis].into()));
        }
        within.none()
    }
}

impl CsgTree {
    /// What the composite's bounds leave of `within`; `None` if that is nothing.
    #[inline(always)]
    pub(super) fn span(
        &self,
        composite: &Composite,
        stretch: &Stretch,
        within: Span,
        lanes: u8,
    ) -> Option<Span> {
        let [min, max] = composite.box_around;
        let span = stretch.span(min, max, &within);
        (span.lanes() & lanes != 0).then_some(span)
    }

    /// Adds to `near` the other parts that the rays `lanes` may meet `within` a stretch. `places` finds a part in the list.
    pub(super) fn cull(
        &self,
        composite: &Composite,
        (stretch, within, lanes): (&Stretch, &Span, u8),
        (near, places): (&mut Vec<Near>, &mut [u32]),
    ) {
        if composite.parts.len() == near.len() {
            return;
        }
        // Of what is not closed, what lies behind the rays counts too.
        let from_behind = Span { enter: Span::all().enter, ..*within };
        let few = composite.parts.len() <= FEW;
        let (mut least, mut most) = (f32::NEG_INFINITY, f32::INFINITY);
        if !few {
            let from = if composite.closed { within.enter } else { from_behind.enter };
            let (live, none) = (Mask::from_bits(lanes), f32x8::lit(f64::NEG_INFINITY));
            (least, most) = (-highest(live.select(-from, none)), highest(live.select(within.leave, none)));
        }
        let Composite { parts, boxes: BoxTree { levels, places: order }, .. } = composite;
        let order = slice(&self.bounds_order, order);
        // From the coarsest blocks down, each with the lanes that meet the box around it.
        let mut waiting = SmallVec::<[(usize, u32, u8); DEEPEST]>::new();
        if let Some(coarsest) = levels.last() {
            waiting.extend((0..coarsest.len() as u32).rev().map(|block| (levels.len() - 1, block, lanes)));
        }
        while let Some((level, number, lanes)) = waiting.pop() {
            let block = &self.bounds[(levels[level].start + number) as usize];
            // Where the group test says yes, ray by ray.
            let met = if few { !0 } else { stretch.may_meet_block(block, least, most) };
            let first = number as usize * LANES;
            if level > 0 {
                let from = if composite.closed { within } else { &from_behind };
                let by_box = stretch.met(block, met, from, lanes);
                for k in bits(met) {
                    if by_box[k] != 0 && first + k < levels[level - 1].len() {
                        waiting.push((level - 1, (first + k) as u32, by_box[k]));
                    }
                }
                continue;
            }
            // Of what is not closed, all that is to be known is whether it is met.
            let by_box =
                if composite.closed { [lanes; LANES] } else { stretch.met(block, met, &from_behind, lanes) };
            for k in bits(met) {
                let Some(&part) = order.get(first + k) else { break };
                let place = &mut places[part as usize];
                if by_box[k] == 0 || *place != NOT_NEAR {
                    continue; // It is not there, or known.
                }
                let mut span = Span::all();
                if block.open >> k & 1 == 0 {
                    let (min, max) = block.corners(k);
                    span = stretch.span(min, max, within);
                    if span.lanes() & lanes == 0 {
                        continue;
                    }
                }
                *place = near.len() as u32;
                near.push(Near::new(parts.start + part, span));
                prefetch(&self.parts[(parts.start + part) as usize]);
            }
        }
    }

    /// The side of a node made of others, whose sides (by number from `first` on) are known.
    fn side(&self, node: &CsgNode, sides: &[Side], first: u32) -> Side {
        let of = |child: &u32| sides[(*child - first) as usize];
        let list = |range: &Range<u32>| self.list(range).iter();
        let side = match &node.kind {
            NodeKind::Part(_) => Side::Outside,
            NodeKind::All(children) => fold(list(children).map(of), Side::Outside, Side::Inside),
            NodeKind::Any(children) | NodeKind::Merged(children) => {
                fold(list(children).map(of), Side::Inside, Side::Outside)
            }
            NodeKind::Odd(children) => {
                list(children).map(of).fold(Side::Outside, |odd, side| match (odd, side) {
                    (_, Side::Outside) => odd,
                    (Side::Either, _) | (_, Side::Either) => Side::Either,
                    (_, Side::Inside) => odd.inverted(),
                })
            }
        };
        if node.inverted { side.inverted() } else { side }
    }

    /// Completes a composite whose parts (from `first_part` on) and nodes (from `first_node` on) are the last. Its surfaces lie
    /// within `bounds`, and those and its inside within `reach`.
    pub fn push_composite(
        &mut self,
        first_part: u32,
        first_node: u32,
        root: u32,
        (bounds, reach): (Aabb, Aabb),
        (around, around_bounds, interior): (u32, Aabb, u32),
    ) {
        let parts = first_part..self.parts.len() as u32;
        let nodes = first_node..self.nodes.len() as u32;
        let boxes: Vec<Aabb> = self.parts[first_part as usize..].iter().map(|part| part.bounds).collect();
        let is_closed = |part: usize| self.parts[first_part as usize + part].closed;
        let boxes = BoxTree::over(&boxes, is_closed, (&mut self.bounds, &mut self.bounds_order));
        for number in nodes.clone() {
            let node = &self.nodes[number as usize];
            let side = self.side(node, &self.outside[first_node as usize..], first_node);
            let below = match &node.kind {
                NodeKind::Part(number) => Many::of_any(number - first_part),
                NodeKind::All(list) | NodeKind::Any(list) | NodeKind::Merged(list) | NodeKind::Odd(list) => {
                    let children = slice(&self.lists, list);
                    children.iter().fold(Many::default(), |parts, &child| parts | self.below[child as usize])
                }
            };
            self.outside.push(side);
            self.below.push(below);
        }
        for number in nodes.clone() {
            if let NodeKind::Any(list) | NodeKind::Merged(list) | NodeKind::Odd(list) =
                &self.nodes[number as usize].kind
                && list.len() >= LONG
            {
                let long = LongList::of(self, list);
                self.long.insert(list.start, long);
            }
        }
        let closed = self.parts[first_part as usize..].iter().all(|part| part.closed);
        let outward = |bounds: Aabb| {
            let block = BoundsBlock::new(&[bounds]);
            [block.min, block.max].map(|corner| corner.map(|axis| axis[0]))
        };
        let box_around = outward(reach);
        let asked_within = (reach != bounds).then(|| outward(bounds));
        let (first_required, first_needed) = (self.required.len() as u32, self.needed.len() as u32);
        self.require(root);
        let required = first_required..self.required.len() as u32;
        let needed = first_needed..self.needed.len() as u32;
        self.composites.push(Composite {
            parts,
            nodes,
            required,
            needed,
            boxes,
            bounds,
            box_around,
            asked_within,
            closed,
            root,
            surroundings: Surroundings { node: around, within: outward(around_bounds), interior },
            plan: None,
        });
    }

    /// Lists the parts and other nodes that `node` lies within.
    fn require(&mut self, node: u32) {
        let CsgNode { kind, inverted, .. } = self.nodes[node as usize].clone();
        match kind {
            NodeKind::Part(number) => {
                let part = &self.parts[number as usize];
                if part.solid && part.closed && !inverted {
                    self.required.push(number);
                }
            }
            NodeKind::All(list) if !inverted => {
                for k in list {
                    self.require(self.lists[k as usize]);
                }
            }
            _ => self.needed.push(node),
        }
    }
}

/// `decides` if one side is that, else `neutral` if all are that.
fn fold(sides: impl Iterator<Item = Side>, decides: Side, neutral: Side) -> Side {
    let mut result = neutral;
    for side in sides {
        if side == decides {
            return decides;
        }
        if side == Side::Either {
            result = Side::Either;
        }
    }
    result
}

/// The largest magnitude of a component, lane by lane.
pub(super) fn max_abs(v: Vec3<f64x8>) -> f64x8 {
    v.abs().max_element()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use glam::DVec3;

    #[test]
    fn rows_of_bits_become_columns() {
        let rows = [0x01, 0x80, 0xff, 0x00, 0x5a, 0x10, 0x03, 0xc4];
        let columns = transposed(rows);
        for (i, row) in rows.iter().enumerate() {
            for (k, column) in columns.iter().enumerate() {
                assert_eq!(row >> k & 1, column >> i & 1, "{i} {k}");
            }
        }
    }

    #[test]
    fn boxes_are_met_ray_by_ray_as_one_by_one() {
        let mut numbers = Random::new(5);
        let mut vector = |scale: f64| numbers.vector(1.0) * scale;
        for _ in 0..200 {
            let boxes: [Aabb; LANES] = std::array::from_fn(|_| {
                let (at, half) = (vector(4.0), vector(2.0).abs());
                Aabb { min: at - half, max: at + half }
            });
            let lines: [(DVec3, DVec3); LANES] =
                std::array::from_fn(|_| (vector(6.0), vector(1.0).normalize()));
            let of = |v: [DVec3; LANES]| {
                let [x, y, z] = [0, 1, 2].map(|axis| f64x8::from_array(v.map(|v| v[axis])));
                Vec3::new(x, y, z)
            };
            let rays = Rays { origin: of(lines.map(|line| line.0)), dir: of(lines.map(|line| line.1)) };
            let (stretch, block) = (Stretch::new(&rays, !0), BoundsBlock::new(&boxes));
            let within = Span::up_to(f64x8::lit(9.0));
            for lanes in [0b1, 0b1000_0100, !0] {
                let which = 0b1011_0110;
                for (k, met) in stretch.met(&block, which, &within, lanes).into_iter().enumerate() {
                    let (min, max) = block.corners(k);
                    let alone = stretch.span(min, max, &within).lanes() & lanes;
                    assert_eq!(met, if which >> k & 1 == 1 { alone } else { 0 });
                }
            }
        }
    }
}
