//! Composites against packets: the crossings of their parts come from the parts' columns.

use super::query::Query;
use crate::bvh::Run;
use crate::compile::{Compiled, SurfaceId, WithBlock};
use crate::csg::{Best, PartRoots, Scratch, Stretch};
use crate::kernel::{Block, Left, Rays};
use crate::lane::{LANES, Lane, Mask, Scalar, f64x8};

/// Tests a run of composites.
pub fn composites<S: Scalar, B: Scalar, const ANY: bool>(
    scene: &Compiled<S, B>,
    run: &Run,
    query: &mut Query<S::Lane>,
    lanes: u8,
    (scratch, stretch): (&mut Scratch, &mut Option<Stretch>),
) -> u8 {
    // Constructive geometry is done in double precision in every mode.
    let rays = Rays { origin: query.rays.origin.cast(), dir: query.rays.dir.cast() };
    let stretch = stretch.get_or_insert_with(|| Stretch::new(&rays, query.lanes));
    let t_min = query.t_min.to_f64s();
    let mut best = Best {
        t: query.t.to_f64s(),
        surface: query.surface,
        first_part: scene.first_part,
        rank: &scene.rank,
    };
    let mut changed = 0;
    for composite in &scene.csg.composites[run.first as usize..(run.first + run.len) as usize] {
        let waiting = if ANY { lanes & !changed } else { lanes };
        let parts = &composite.parts;
        let starts = query.starts_within(scene.first_part + parts.start, parts.len() as u32);
        let source = Parts { scene, left: query.left, part: query.part, starts };
        changed |= scene.csg.nearest(
            composite,
            (&rays, stretch),
            (waiting, t_min, ANY),
            &source,
            scratch,
            &mut best,
        );
        if ANY && changed == lanes {
            break;
        }
    }
    query.surface = best.surface;
    if !ANY {
        query.t = Mask::from_bits(changed).select(S::Lane::from_f64s(best.t), query.t);
    }
    changed
}

/// Crossings of composites' parts.
pub struct Parts<'a, S: Scalar, B: Scalar> {
    /// Where the parts are.
    pub scene: &'a Compiled<S, B>,
    /// The surfaces the rays started on.
    pub left: [SurfaceId; LANES],
    /// The parts of them.
    pub part: [u8; LANES],
    /// False if none of them is a part that is asked for.
    pub starts: bool,
}

impl<S: Scalar, B: Scalar> PartRoots for Parts<'_, S, B> {
    #[inline]
    fn roots(&self, part: u32, rays: &Rays<f64x8>, out: &mut Vec<f64x8>) -> (usize, u8) {
        let surface = self.scene.first_part + part;
        let mut on = 0u8;
        if self.starts {
            for (k, left) in self.left.iter().enumerate() {
                on |= u8::from(*left == surface) << k;
            }
        }
        let left = Left { on: Mask::from_bits(on), part: self.part };
        let part = &self.scene.csg.parts[part as usize];
        self.scene
            .parts
            .with(part.kind, RootsOf { row: part.row as usize, rays, left: (on != 0).then_some(&left), out })
    }
}

struct RootsOf<'a> {
    row: usize,
    rays: &'a Rays<f64x8>,
    left: Option<&'a Left<f64x8>>,
    out: &'a mut Vec<f64x8>,
}

impl WithBlock<f64> for RootsOf<'_> {
    type Output = (usize, u8);

    #[inline(always)]
    fn block<K: Block<f64>>(self, block: &K) -> (usize, u8) {
        let Self { row, rays, left, out } = self;
        let before = out.len();
        out.extend_from_slice(block.roots(row, rays, left).as_ref());
        let surface = out.len() - before;
        if K::SKIN_IS_PARTIAL {
            out.extend_from_slice(block.boundary(row, rays, left).as_ref());
        }
        (surface, block.starts_inside(row, rays).bits())
    }
}
