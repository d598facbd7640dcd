//! What can stand between a light and a point.

use crate::bvh::{Child, Run};
use crate::compile::{COMPOSITE, Geometry, Kind, NO_SURFACE, SurfaceId, class};
use crate::kernel::{Aabb, Block, Solid};
use crate::lane::Scalar;
use glam::DVec3;

/// Something of finite size that casts a shadow.
#[derive(Debug, Clone, Copy)]
pub struct Caster {
    pub bounds: Aabb,
    /// Kind and row, [`COMPOSITE`] or [`INSTANCE`](crate::compile::INSTANCE) and number.
    pub kind: u8,
    pub row: u32,
    /// See [`class`].
    pub classes: u8,
    /// Of convex solids, which never stand in the way of their own front; else [`NO_SURFACE`].
    pub surface: SurfaceId,
    /// A convex solid that stops all light.
    pub blocks: bool,
    /// Stops all light.
    pub opaque: bool,
}

/// A half space whose boundary casts a shadow.
#[derive(Debug, Clone, Copy)]
pub(super) struct HalfSpace {
    pub normal: DVec3,
    pub foot: DVec3,
    pub surface: SurfaceId,
}

/// Everything in a scene that casts shadows.
#[derive(Debug)]
pub struct Casters {
    pub(super) all: Vec<Caster>,
    /// By kind of triangles, the rows that are opaque: these are not among them.
    pub(super) triangles: [(Kind, Vec<bool>); 2],
    pub(super) planes: Vec<HalfSpace>,
    /// Nothing else without bounds.
    pub(super) complete: bool,
    /// Around all that has bounds, at least.
    pub(super) bounds: Option<Aabb>,
}

/// True of kinds whose solids are convex, with a surface that is all of their skin.
pub(super) fn is_convex(kind: Kind) -> bool {
    use Kind::{Box, Cone, Cylinder, Ellipsoid, OrientedBox, Sphere};
    matches!(kind, Sphere | Ellipsoid | Box | OrientedBox | Cylinder | Cone)
}

/// With fewer casters a shadow ray takes no longer than to look it up.
const FEWEST: usize = 64;

/// More triangles a pixel than this take longer to draw than the buffer saves: 500 instructions or so each, where a
/// shadow ray among them takes a thousand to trace.
const TRIANGLES_A_PIXEL: f64 = 0.5;

/// Whether most casters are convex solids or triangles, and many, but, apart from triangles, no more than `most`, which is what may be
/// drawn into cells. (Points on others are mostly in doubt: what they lie on, or its next piece, is near.)
pub fn are_worth_it<S: Scalar, B: Scalar>(scene: &Geometry<S, B>, pixels: usize, most: f64) -> bool {
    let Counts { triangles, convex, others } = Counts::of(scene);
    let all = triangles + convex + others;
    let few = (convex + others) as f64 <= most && triangles as f64 <= TRIANGLES_A_PIXEL * pixels as f64;
    convex + triangles >= FEWEST.max(all / 2) && few
}

/// What there is in a scene, whether it casts shadows or not.
#[derive(Default)]
struct Counts {
    triangles: usize,
    /// Of convex kinds.
    convex: usize,
    others: usize,
}

impl Counts {
    fn of<S: Scalar, B: Scalar>(scene: &Geometry<S, B>) -> Self {
        let others = scene.csg.composites.len() + scene.instances.rows.len();
        let mut counts = Self { others, ..Self::default() };
        for &kind in Kind::ALL {
            let count = match kind {
                Kind::Triangle | Kind::SmoothTriangle => &mut counts.triangles,
                _ if is_convex(kind) => &mut counts.convex,
                _ => &mut counts.others,
            };
            *count += scene.columns.len(kind);
        }
        counts
    }
}

/// How many things there are in a scene, and parts of composites: at least as many as cast shadows.
pub fn count<S: Scalar, B: Scalar>(scene: &Geometry<S, B>) -> usize {
    let Counts { triangles, convex, others } = Counts::of(scene);
    triangles + convex + others + scene.csg.parts.len()
}

/// Hands the runs in the leaves of the tree that have one of these classes to `with`.
fn each_run<S: Scalar, B: Scalar>(scene: &Geometry<S, B>, classes: u8, mut with: impl FnMut(&Run)) {
    for node in &scene.bvh.nodes {
        for &leaf in node.child.iter().filter(|child| child.is_leaf() && **child != Child::NONE) {
            scene.bvh.for_each_run(leaf, |run| {
                if run.class & classes != 0 {
                    with(run);
                }
            });
        }
    }
}

/// What is in the tree and has one of these classes, each once, as casters are.
pub fn in_tree<S: Scalar, B: Scalar>(scene: &Geometry<S, B>, classes: u8) -> Vec<Caster> {
    let mut all = Vec::new();
    each_run(scene, classes, |run| {
        all.extend((run.first..run.first + run.len).map(|row| caster(scene, (run.kind, run.class), row)));
    });
    // What is long may stand in several leaves.
    all.sort_unstable_by_key(|caster| (caster.kind, caster.row));
    all.dedup_by_key(|caster| (caster.kind, caster.row));
    all
}

impl Casters {
    /// Those of `scene`.
    pub fn of<S: Scalar, B: Scalar>(scene: &Geometry<S, B>) -> Self {
        let Counts { convex, others, .. } = Counts::of(scene);
        let mut casters = Self {
            all: Vec::with_capacity(convex + others),
            // A long triangle may stand in several leaves.
            triangles: [Kind::Triangle, Kind::SmoothTriangle]
                .map(|kind| (kind, vec![false; scene.columns.len(kind)])),
            planes: Vec::new(),
            complete: true,
            bounds: None,
        };
        let wanted = class::BLOCKS | class::FILTERS;
        each_run(scene, wanted, |run| {
            let mut triangles = casters.triangles.iter_mut();
            let of_kind = triangles.find(|(kind, _)| *kind as u8 == run.kind);
            if let (true, Some((_, opaque))) = (run.class & class::BLOCKS != 0, of_kind) {
                opaque[run.first as usize..][..run.len as usize].fill(true);
                return;
            }
            for row in run.first..run.first + run.len {
                casters.all.push(caster(scene, (run.kind, run.class), row));
            }
        });
        let mut giants = Aabb::EMPTY;
        for run in scene.unbounded.iter().filter(|run| run.class & wanted != 0) {
            if run.kind != Kind::Plane as u8 {
                // Giants have bounds, and yet are not in the tree.
                for row in run.first..run.first + run.len {
                    let giant = caster(scene, (run.kind, run.class), row);
                    if giant.bounds.is_finite() {
                        giants = giants.union(giant.bounds);
                        casters.all.push(giant);
                    } else {
                        casters.complete = false;
                    }
                }
                continue;
            }
            for row in run.first..run.first + run.len {
                if let Some(Solid::HalfSpace { normal, foot }) = scene.columns.planes.solid(row as usize) {
                    let surface = scene.base[Kind::Plane as usize] + row;
                    casters.planes.push(HalfSpace { normal, foot, surface });
                }
            }
        }
        casters.bounds = (!scene.bvh.nodes.is_empty()).then_some(scene.bvh.bounds.union(giants));
        casters
    }
}

impl Casters {
    /// Those that have bounds, triangles among the rest.
    pub fn bounded<S: Scalar, B: Scalar>(&self, scene: &Geometry<S, B>) -> Vec<Caster> {
        let mut all = self.all.clone();
        for (kind, opaque) in &self.triangles {
            let rows = (0u32..).zip(opaque).filter(|(_, opaque)| **opaque);
            all.extend(rows.map(|(row, _)| caster(scene, (*kind as u8, class::BLOCKS), row)));
        }
        all
    }
}

/// A row of a kind, with its classes.
pub(super) fn caster<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    (kind, classes): (u8, u8),
    row: u32,
) -> Caster {
    if kind >= COMPOSITE {
        let bounds = match kind {
            COMPOSITE => scene.csg.composites[row as usize].bounds,
            _ => scene.instances.rows[row as usize].bounds,
        };
        return Caster { bounds, kind, row, classes, surface: NO_SURFACE, blocks: false, opaque: false };
    }
    let known = Kind::ALL[usize::from(kind)];
    let (convex, opaque) = (is_convex(known), classes & class::BLOCKS != 0);
    Caster {
        bounds: scene.columns.bounds(known, row as usize),
        kind,
        row,
        classes,
        surface: if convex { scene.base[usize::from(kind)] + row } else { NO_SURFACE },
        blocks: convex && opaque,
        opaque,
    }
}
