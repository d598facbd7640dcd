//! What the camera stands in: POV-Ray's rays start with the interiors of all solids around the eye.

use super::composite::Parts;
use super::medium::Media;
use crate::compile::{COMPOSITE, Compiled, Kind, NO_SURFACE, WithBlock};
use crate::csg::Scratch;
use crate::kernel::{Aabb, Block, Rays};
use crate::lane::{LANES, Lane, Scalar, Vec3, f64x8};
use crate::scene::{Camera, Projection};
use glam::DVec3;
use smallvec::SmallVec;

/// What is kept from one question to the next, so that nothing is allocated.
#[derive(Debug, Default)]
pub struct EnclosingBuffers {
    scratch: Scratch,
    found: Vec<(u32, u8)>,
}

/// Solids that the eye may be in, in order of declaration: kind, row and interior.
#[derive(Debug, Default)]
pub struct Enclosing(Vec<(u8, u32, u32)>);

impl Enclosing {
    /// The solids of `scene` that the eye may be in: none where no interior matters.
    pub fn new<S: Scalar, B: Scalar>(scene: &Compiled<S, B>) -> Self {
        let mut solids = Vec::new();
        if scene.interiors.len() < 2 {
            return Self::default();
        }
        let eyes = eyes(&scene.camera, scene.origin);
        let interior = |surface: u32| scene.owners[scene.owner[surface as usize] as usize].interior;
        // POV-Ray asks only objects in whose box the eye is, and the box of a disc is flat.
        let flat = [Kind::Disc, Kind::Triangle, Kind::SmoothTriangle, Kind::Polygon];
        for &kind in Kind::ALL.iter().filter(|kind| !flat.contains(kind)) {
            for row in 0..scene.columns.len(kind) as u32 {
                let surface = scene.base[kind as usize] + row;
                let inverse = scene.owners[scene.owner[surface as usize] as usize].inverse;
                if inverse || scene.columns.bounds(kind, row as usize).meets(&eyes) {
                    solids.push((scene.rank[surface as usize], kind as u8, row, interior(surface)));
                }
            }
        }
        for (number, composite) in scene.csg.composites.iter().enumerate() {
            if composite.parts.is_empty() {
                continue;
            }
            let surface = scene.first_part + composite.parts.start;
            solids.push((scene.rank[surface as usize], COMPOSITE, number as u32, interior(surface)));
        }
        solids.sort_unstable();
        Self(solids.into_iter().map(|(_, kind, row, interior)| (kind, row, interior)).collect())
    }

    /// The lists of interiors around eight points (compiled space).
    pub fn media<S: Scalar, B: Scalar>(
        &self,
        scene: &Compiled<S, B>,
        points: Vec3<f64x8>,
        media: &mut Media,
        EnclosingBuffers { scratch, found }: &mut EnclosingBuffers,
    ) -> [u32; LANES] {
        if self.0.is_empty() {
            return [0; LANES];
        }
        let mut lists: [SmallVec<[u32; 4]>; LANES] = Default::default();
        // Any direction will do; one along no axis and in no plane of a usual scene meets the fewest special cases.
        let dir = Vec3::splat(DVec3::new(0.36, 0.48, 0.8));
        let rays = Rays { origin: points, dir };
        for &(kind, row, interior) in &self.0 {
            found.clear();
            if kind == COMPOSITE {
                let source = Parts { scene, left: &[NO_SURFACE; LANES], part: &[0; LANES], starts: true };
                let composite = &scene.csg.composites[row as usize];
                scene.csg.interiors_at_start(composite, &rays, &source, scratch, found);
            } else {
                let rays = Rays { origin: points.cast(), dir: dir.cast() };
                let surface = scene.base[usize::from(kind)] + row;
                let inverse = scene.owners[scene.owner[surface as usize] as usize].inverse;
                let inside = scene.columns.with(kind, Contains { row: row as usize, rays: &rays });
                found.push((interior, if inverse { !inside } else { inside }));
            }
            for &(interior, inside) in &*found {
                for (k, list) in lists.iter_mut().enumerate() {
                    // Parts of a union share one interior: it is entered once. The air of opaque solids, number 0 of them
                    // all, is never left: only its place among the others counts.
                    let new = if interior == 0 { list.last() != Some(&0) } else { !list.contains(&interior) };
                    if inside >> k & 1 == 1 && new {
                        list.push(interior);
                    }
                }
            }
        }
        lists.map(|list| media.number(list))
    }
}

/// Where rays start (compiled space): the eye, or the window.
fn eyes(camera: &Camera, origin: DVec3) -> Aabb {
    let middle = camera.location - origin;
    match camera.projection {
        Projection::Perspective => Aabb::of([middle]),
        Projection::Orthographic => {
            let corner = |s: f64, t: f64| middle + (camera.right * s + camera.up * t) * 0.5;
            let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)];
            Aabb::of(corners).inflated(4.0 * f64::EPSILON)
        }
    }
}

/// Lanes whose start lies inside a primitive.
struct Contains<'a, L> {
    row: usize,
    rays: &'a Rays<L>,
}

impl<S: Scalar> WithBlock<S> for Contains<'_, S::Lane> {
    type Output = u8;

    fn block<K: Block<S>>(self, block: &K) -> u8 {
        let mut inside = block.starts_inside(self.row, self.rays).bits();
        for &crossing in block.boundary(self.row, self.rays, None).as_ref() {
            inside ^= crossing.lt(S::Lane::zero()).bits();
        }
        inside
    }
}
