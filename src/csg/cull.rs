//! What eight rays cannot meet: parts by their bounds, and with them whole branches of the expression.

use super::{Composite, Constraint, CsgNode, CsgTree, NodeKind};
use crate::kernel::{Aabb, Rays};
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3, f32x8, f64x8, highest};
use std::ops::Range;

/// Bounds of parts are widened by this share of the largest coordinate at hand: starts are rounded to single
/// precision, and that of a ray that leaves a part may lie some roundings (of double precision) outside of it.
const BOUNDS_SLACK: f64 = 4.0 * f32::UNIT_ROUNDOFF;

/// What a plane's distance along a ray may be off by, of its size: roundings of the difference, the inverse direction and
/// the product, doubled for either side, with room.
const DISTANCE_PAD: f64 = 16.0 * f32::UNIT_ROUNDOFF;

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
}

impl BoundsBlock {
    /// Of up to eight boxes; the lanes without one hold nothing.
    pub fn new(boxes: &[Aabb]) -> Self {
        let mut block = Self { min: [[f32::INFINITY; LANES]; 3], max: [[f32::NEG_INFINITY; LANES]; 3] };
        for (k, bounds) in boxes.iter().enumerate().take(LANES) {
            for axis in 0..3 {
                block.min[axis][k] = (bounds.min[axis] as f32).next_down();
                block.max[axis][k] = (bounds.max[axis] as f32).next_up();
            }
        }
        block
    }
}

/// Bounds of a number over the rays of a stretch.
#[derive(Debug, Clone, Copy)]
struct Interval {
    least: f32,
    most: f32,
}

impl Interval {
    /// Over the lanes given.
    #[inline(always)]
    fn of(x: f32x8, lanes: Mask<f32x8>) -> Self {
        let none = f32x8::lit(f64::NEG_INFINITY);
        Self { least: -highest(lanes.select(-x, none)), most: highest(lanes.select(x, none)) }
    }

    /// By `slack` wider on either side.
    fn widened(self, slack: f32) -> Self {
        Self { least: (self.least - slack).next_down(), most: (self.most + slack).next_up() }
    }
}

/// Eight rays as bounds see them: in single precision, whatever that of the parts.
#[derive(Debug, Clone)]
pub struct Stretch {
    origin: Vec3<f32x8>,
    inverse: Vec3<f32x8>,
    /// How much wider the bounds are taken.
    slack: f32x8,
    /// Origin and inverse direction by axis over all rays; `None` if they go several ways.
    group: Option<[[Interval; 2]; 3]>,
}

impl Stretch {
    /// The rays of `lanes`.
    pub fn new(rays: &Rays<f64x8>, lanes: u8) -> Self {
        let (origin, inverse) = (rays.origin.cast::<f32x8>(), rays.dir.cast::<f32x8>().slab_inverse());
        let slack = origin.abs().max_element() * f32x8::lit(BOUNDS_SLACK);
        let one_octant = [inverse.x, inverse.y, inverse.z].into_iter().all(|i| {
            let negative = i.lt(f32x8::zero()).bits() & lanes;
            negative == 0 || negative == lanes
        });
        let group = one_octant.then(|| {
            let lanes = Mask::from_bits(lanes);
            let widest = Interval::of(slack, lanes).most;
            let axis = |o, i| [Interval::of(o, lanes).widened(widest), Interval::of(i, lanes)];
            [axis(origin.x, inverse.x), axis(origin.y, inverse.y), axis(origin.z, inverse.z)]
        });
        Self { origin, inverse, slack, group }
    }

    /// A bit for each part of a block that some ray may meet or start within, by one interval test for all eight
    /// (Boulos, Wald, Shirley 2006, Geometric and arithmetic culling methods for entire ray packets).
    fn may_meet_block(&self, block: &BoundsBlock) -> u8 {
        let Some(axes) = &self.group else { return !0 };
        let (mut near, mut far) = (f32x8::lit(f64::NEG_INFINITY), f32x8::lit(f64::INFINITY));
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

    /// Whether one of the rays `lanes` may meet the part in lane `k` of a block before `t_far` or start within it; a `closed`
    /// one is passed when its bounds are.
    #[inline(always)]
    fn may_meet(&self, (block, k): (&BoundsBlock, usize), closed: bool, t_far: f32x8, lanes: u8) -> bool {
        let corner = |corner: &[[f32; LANES]; 3]| {
            Vec3::new(f32x8::splat(corner[0][k]), f32x8::splat(corner[1][k]), f32x8::splat(corner[2][k]))
        };
        let slack = Vec3::new(self.slack, self.slack, self.slack);
        let low = (corner(&block.min) - slack - self.origin).mul(self.inverse);
        let high = (corner(&block.max) + slack - self.origin).mul(self.inverse);
        let first = if closed { f32x8::zero() } else { f32x8::lit(f64::NEG_INFINITY) };
        let near = low.x.min(high.x).max(low.y.min(high.y)).max(low.z.min(high.z)).max(first);
        let far = low.x.max(high.x).min(low.y.max(high.y)).min(low.z.max(high.z)).min(t_far);
        let pad = f32x8::lit(DISTANCE_PAD);
        let meets = (near - near.abs() * pad).le(far + (far.abs() * pad + self.slack));
        meets.bits() & lanes != 0
    }
}

impl CsgTree {
    /// Lists the parts that the rays `lanes` may meet before `t_far`, and says for each node of the composite on which side of it
    /// the rays are; false if they are outside of the whole and no part that they may meet can be a surface of it.
    pub(super) fn cull(
        &self,
        composite: &Composite,
        (stretch, t_far, lanes): (&Stretch, f64x8, u8),
        near: &mut Vec<u32>,
        sides: &mut Vec<Side>,
    ) -> bool {
        let t_far = f32x8::from_f64s(t_far);
        sides.clear();
        sides.extend_from_slice(&self.outside[composite.nodes.start as usize..composite.nodes.end as usize]);
        near.clear();
        let blocks = composite.bounds_blocks.start as usize..composite.bounds_blocks.end as usize;
        for (first, block) in composite.parts.clone().step_by(LANES).zip(&self.bounds[blocks]) {
            // Where the group test says yes, ray by ray.
            let mut waiting = stretch.may_meet_block(block);
            while waiting != 0 {
                let k = waiting.trailing_zeros();
                let number = first + k;
                waiting &= waiting - 1;
                if number >= composite.parts.end {
                    break;
                }
                let part = &self.parts[number as usize];
                if stretch.may_meet((block, k as usize), part.closed, t_far, lanes) {
                    near.push(number);
                    sides[(part.node - composite.nodes.start) as usize] = Side::Either;
                }
            }
        }
        if !near.is_empty() {
            for &number in &self.inner[composite.inner.start as usize..composite.inner.end as usize] {
                let place = (number - composite.nodes.start) as usize;
                sides[place] = self.side(&self.nodes[number as usize], sides, composite.nodes.start);
            }
        }
        let outside = sides[(composite.root - composite.nodes.start) as usize] == Side::Outside;
        !outside || near.iter().any(|&part| self.may_be_surface(composite, part, sides))
    }

    /// The side of a node made of others, whose sides (by number from `first` on) are known.
    fn side(&self, node: &CsgNode, sides: &[Side], first: u32) -> Side {
        let of = |child: &u32| sides[(*child - first) as usize];
        let list = |range: &Range<u32>| self.lists[range.start as usize..range.end as usize].iter();
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

    /// Completes a composite whose parts (from `first_part` on) and nodes (from `first_node` on) are the last.
    pub fn push_composite(&mut self, first_part: u32, first_node: u32, root: u32, bounds: Aabb) {
        let parts = first_part..self.parts.len() as u32;
        let nodes = first_node..self.nodes.len() as u32;
        let (first_block, first_inner) = (self.bounds.len() as u32, self.inner.len() as u32);
        let boxes: Vec<Aabb> = self.parts[first_part as usize..].iter().map(|part| part.bounds).collect();
        self.bounds.extend(boxes.chunks(LANES).map(BoundsBlock::new));
        for number in nodes.clone() {
            let node = &self.nodes[number as usize];
            let side = self.side(node, &self.outside[first_node as usize..], first_node);
            self.outside.push(side);
            if !matches!(node.kind, NodeKind::Part(_)) {
                self.inner.push(number);
            }
        }
        let bounds_blocks = first_block..self.bounds.len() as u32;
        let inner = first_inner..self.inner.len() as u32;
        self.composites.push(Composite { parts, nodes, inner, bounds_blocks, bounds, root });
    }

    /// False if what is known of the sides rules out that a crossing of the part is a surface of the whole.
    fn may_be_surface(&self, composite: &Composite, part: u32, sides: &[Side]) -> bool {
        let part = &self.parts[part as usize];
        let side = |node: u32| sides[(node - composite.nodes.start) as usize];
        let ruled_out = |list: &Range<u32>, own: u32, out: Side| {
            let list = &self.lists[list.start as usize..list.end as usize];
            list.iter().any(|&node| node != own && side(node) == out)
        };
        part.seen
            && side(part.node) == Side::Either
            && !self.constraints[part.constraints.start as usize..part.constraints.end as usize].iter().any(
                |constraint| match constraint {
                    Constraint::Inside(list, own) => ruled_out(list, *own, Side::Outside),
                    Constraint::Outside(list, own) => ruled_out(list, *own, Side::Inside),
                    Constraint::Inverted => false,
                },
            )
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
