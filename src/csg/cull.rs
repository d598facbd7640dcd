//! What eight rays cannot meet: parts by their bounds, and with them whole branches of the expression.

use super::{Composite, Constraint, CsgTree, NodeKind, Part};
use crate::kernel::{Aabb, Rays};
use crate::lane::{LANES, Lane, Scalar, Vec3, f32x8, f64x8};

/// Bounds of parts are widened by this share of the largest coordinate at hand: the start of a ray that leaves a
/// part may lie some roundings outside of it.
const BOUNDS_SLACK: f64 = 64.0 * f64::UNIT_ROUNDOFF;

/// No direction component is smaller than this before bounds, so that no plane distance is `0 * inf`.
const LEAST_DIRECTION: f64 = 1.0 / (1u64 << 60) as f64;

/// Where eight rays are in relation to a node of a composite, as far as bounds tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
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
    /// Over the lanes given, rounded outward.
    fn of(lane: f64x8, lanes: u8) -> Self {
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for (k, x) in lane.to_array().into_iter().enumerate() {
            if lanes >> k & 1 == 1 {
                least = if x < least { x } else { least };
                most = if x > most { x } else { most };
            }
        }
        Self { least: (least as f32).next_down(), most: (most as f32).next_up() }
    }
}

/// Stretches of eight rays, for culling parts by their bounds.
pub(super) struct Stretch {
    origin: Vec3<f64x8>,
    inverse: Vec3<f64x8>,
    /// Where the stretch ends; what lies beyond does not matter.
    far: f64x8,
    /// What counts as at the start.
    slack: f64x8,
    lanes: u8,
    /// Origin and inverse direction by axis, and the far end, over all rays; `None` if they go several ways.
    group: Option<([[Interval; 2]; 3], f32)>,
}

impl Stretch {
    pub fn new(rays: &Rays<f64x8>, far: f64x8, lanes: u8) -> Self {
        let least = f64x8::lit(LEAST_DIRECTION);
        let inverse = rays.dir.map(|d| f64x8::lit(1.0) / least.max(d.abs()).copysign(d));
        let slack = max_abs(rays.origin) * f64x8::lit(BOUNDS_SLACK);
        let one_octant = [inverse.x, inverse.y, inverse.z].into_iter().all(|i| {
            let negative = i.lt(f64x8::zero()).bits() & lanes;
            negative == 0 || negative == lanes
        });
        let group = one_octant.then(|| {
            let axis = |o: f64x8, i: f64x8| [Interval::of(o, lanes), Interval::of(i, lanes)];
            let o = rays.origin;
            let axes = [axis(o.x, inverse.x), axis(o.y, inverse.y), axis(o.z, inverse.z)];
            (axes, Interval::of(far + slack, lanes).most)
        });
        Self { origin: rays.origin, inverse, far, slack, lanes, group }
    }

    /// A bit for each part of a block that some ray may meet or start within, by one interval test for all eight
    /// (Boulos, Wald, Shirley 2006, Geometric and arithmetic culling methods for entire ray packets).
    fn may_meet_block(&self, block: &BoundsBlock) -> u8 {
        let Some((axes, t_far)) = &self.group else { return !0 };
        let (mut near, mut far) = (f32x8::lit(f64::NEG_INFINITY), f32x8::splat(*t_far));
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
        // Three roundings of each plane distance.
        let pad = f32x8::lit(16.0 * f32::UNIT_ROUNDOFF);
        (near - near.abs() * pad).le(far + far.abs() * pad).bits()
    }

    /// Whether a ray may meet the part or start within it. (Slab test padded by the roundings of a plane distance,
    /// Ize 2013.)
    #[inline(always)]
    fn may_meet(&self, part: &Part) -> bool {
        let Aabb { min, max } = part.bounds;
        let low = (Vec3::<f64x8>::splat(min) - self.origin).mul(self.inverse);
        let high = (Vec3::<f64x8>::splat(max) - self.origin).mul(self.inverse);
        let first = if part.closed { -self.slack } else { f64x8::lit(f64::NEG_INFINITY) };
        let near = low.x.min(high.x).max(low.y.min(high.y)).max(low.z.min(high.z)).max(first);
        let far = low.x.max(high.x).min(low.y.max(high.y)).min(low.z.max(high.z));
        let pad = f64x8::lit(8.0 * f64::UNIT_ROUNDOFF);
        let meets = near.le(far + far.abs() * pad) & near.le(self.far + self.slack);
        meets.bits() & self.lanes != 0
    }
}

impl CsgTree {
    /// Says for each node of the composite on which side of it the rays are; false if they are outside of the
    /// whole and no part that they may meet can be a surface of it.
    pub(super) fn cull(&self, composite: &Composite, stretch: &Stretch, sides: &mut Vec<Side>) -> bool {
        let blocks = &self.bounds[composite.bounds_blocks.start as usize..];
        sides.clear();
        let mut any = false;
        let (mut block, mut near) = (usize::MAX, 0u8);
        for number in composite.nodes.clone() {
            let node = &self.nodes[number as usize];
            let of = |child: &u32| sides[(*child - composite.nodes.start) as usize];
            let list = |range: &std::ops::Range<u32>| &self.lists[range.start as usize..range.end as usize];
            let side = match &node.kind {
                NodeKind::Part(number) => {
                    let part = &self.parts[*number as usize];
                    let place = (number - composite.parts.start) as usize;
                    if place / LANES != block {
                        block = place / LANES;
                        near = stretch.may_meet_block(&blocks[block]);
                    }
                    // (Where the group test says yes, ray by ray.)
                    if near >> (place % LANES) & 1 == 1 && stretch.may_meet(part) {
                        any = true;
                        Side::Either
                    } else {
                        Side::Outside
                    }
                }
                NodeKind::All(children) => fold(list(children).iter().map(of), Side::Outside, Side::Inside),
                NodeKind::Any(children) | NodeKind::Merged(children) => {
                    fold(list(children).iter().map(of), Side::Inside, Side::Outside)
                }
                NodeKind::Odd(children) => {
                    list(children).iter().map(of).fold(Side::Outside, |odd, side| match side {
                        Side::Outside => odd,
                        Side::Inside => odd.inverted(),
                        Side::Either => Side::Either,
                    })
                }
            };
            sides.push(if node.inverted { side.inverted() } else { side });
        }
        let outside = sides[(composite.root - composite.nodes.start) as usize] == Side::Outside;
        !outside || any && composite.parts.clone().any(|part| self.may_be_surface(composite, part, sides))
    }

    /// False if what is known of the sides rules out that a crossing of the part is a surface of the whole.
    fn may_be_surface(&self, composite: &Composite, part: u32, sides: &[Side]) -> bool {
        let part = &self.parts[part as usize];
        let side = |node: u32| sides[(node - composite.nodes.start) as usize];
        let ruled_out = |list: &std::ops::Range<u32>, own: u32, out: Side| {
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
