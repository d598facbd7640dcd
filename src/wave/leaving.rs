//! Rays that leave what they start on for good.

use super::hits::Hit;
use crate::compile::{COMPOSITE, Geometry, WithBlock};
use crate::kernel::{Aabb, Block, Left, Rays};
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3, equal_lanes};

/// Those of `lanes` of eight ways along `dir` from hits that do not meet what they start on again, where that is quickly told.
pub fn left_behind<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    (hit, dir): (&Hit<S::Lane>, &Vec3<S::Lane>),
    lanes: u8,
) -> u8 {
    let rays = Rays { origin: hit.point, dir: *dir };
    let (mut waiting, mut left) = (lanes, 0);
    while waiting != 0 {
        let surface = hit.surface[waiting.trailing_zeros() as usize & (LANES - 1)];
        let on = equal_lanes(&hit.surface, surface) & waiting;
        waiting &= !on;
        if scene.kind_of(surface) < COMPOSITE {
            let (kind, row) = scene.row_of(surface);
            let start = Left { on: Mask::from_bits(on), part: hit.part };
            left |= scene.columns.with(kind, LeftBehind { row: row as usize, rays: &rays, left: &start });
        } else if let Some(part) = scene.part_of(surface) {
            let composite = scene.csg.parts[part as usize].composite;
            let bounds = &scene.csg.composites[composite as usize].bounds;
            left |= on & hit.outside & leave_box(bounds, &rays);
        }
    }
    left
}

/// What a point on a face of the box around it may be off by, in roundings of its largest coordinate: it was turned to its place, and moved.
const FACE_ROUNDINGS: f64 = 4.0;

/// Rays that start where a box ends, and lead out of it. (One that is traced may meet, some roundings on, what lies in the same plane.)
#[inline(always)]
fn leave_box<L: Lane>(bounds: &Aabb, Rays { origin, dir }: &Rays<L>) -> u8 {
    let rounding = origin.abs().max_element() * L::lit(FACE_ROUNDINGS * L::Scalar::UNIT_ROUNDOFF);
    let zero = L::zero();
    let axis = |origin: L, dir: L, axis: usize| {
        let [low, high] = [bounds.min[axis], bounds.max[axis]].map(L::lit);
        (origin - rounding).le(low) & dir.lt(zero) | (origin + rounding).ge(high) & dir.gt(zero)
    };
    (axis(origin.x, dir.x, 0) | axis(origin.y, dir.y, 1) | axis(origin.z, dir.z, 2)).bits()
}

/// Asks a row which rays leave it for good.
struct LeftBehind<'a, L: Lane> {
    row: usize,
    rays: &'a Rays<L>,
    left: &'a Left<L>,
}

impl<S: Scalar> WithBlock<S> for LeftBehind<'_, S::Lane> {
    type Output = u8;

    #[inline(always)]
    fn block<K: Block<S>>(self, block: &K) -> u8 {
        block.left_behind(self.row, self.rays, self.left)
    }
}
