//! Hits of a batch of rays in columns, sorted by what shades them.

use super::queue::{Columns3, LaneList};
use super::trace::{Parts, Query, locate};
use crate::compile::{Compiled, NO_SURFACE, WithBlock};
use crate::csg::Scratch;
use crate::kernel::{Block, Rays, Surfaces};
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3, each_lane};

/// One row for each hit and each texture that has a share in it.
#[derive(Debug, Default)]
pub struct HitList<S> {
    /// Row of the ray in its queue.
    pub ray: Vec<u32>,
    /// Distance.
    pub t: Vec<S>,
    /// Hit points, on the surface.
    pub point: Columns3<S>,
    /// Unit normals, as the shape has them.
    pub normal: Columns3<S>,
    /// The surface.
    pub surface: Vec<u32>,
    /// The part of it.
    pub part: Vec<u8>,
    /// Its owner.
    pub owner: Vec<u32>,
    /// The texture seen.
    pub texture: Vec<u32>,
    /// The texture's share, 1 but for triangles that blend three.
    pub share: Vec<S>,
    /// Rows in the order of shading: texture program by program.
    pub order: Vec<u32>,
    /// First place in `order` of each program, and the end.
    starts: Vec<u32>,
}

/// Where eight rays meet the surfaces they hit.
pub fn resolve<S: Scalar, B: Scalar>(scene: &Compiled<S, B>, query: &Query<S::Lane>) -> Surfaces<S::Lane> {
    let mut waiting = query.hits();
    let mut all = Surfaces::default();
    let place =
        each_lane(|k| if waiting >> k & 1 == 1 { locate(scene, query.surface[k]) } else { (0, 0, false) });
    while waiting != 0 {
        let first = waiting.trailing_zeros() as usize;
        let (kind, row, part) = place[first];
        let mut rows = [row; LANES];
        let mut same = 0u8;
        for k in (0..LANES).filter(|k| waiting >> k & 1 == 1) {
            let (other, row, of_composite) = place[k];
            if (other, of_composite) == (kind, part) {
                rows[k] = row;
                same |= 1 << k;
            }
        }
        waiting &= !same;
        let mask = Mask::<S::Lane>::from_bits(same);
        let found = if part {
            let rays = Rays { origin: cast(query.rays.origin), dir: cast(query.rays.dir) };
            let t = query.t.to_f64s();
            let found = scene.parts.with(kind, Resolve { rows: &rows, mask: mask.cast(), rays: &rays, t });
            Surfaces {
                point: cast_back(found.point),
                normal: cast_back(found.normal),
                u: S::Lane::from_f64s(found.u),
                v: S::Lane::from_f64s(found.v),
                part: found.part,
            }
        } else {
            scene.columns.with(kind, Resolve { rows: &rows, mask, rays: &query.rays, t: query.t })
        };
        all.point = Vec3::select(mask, found.point, all.point);
        all.normal = Vec3::select(mask, found.normal, all.normal);
        all.u = mask.select(found.u, all.u);
        all.v = mask.select(found.v, all.v);
        for k in (0..LANES).filter(|k| same >> k & 1 == 1) {
            all.part[k] = found.part[k];
        }
    }
    all
}

/// The lanes that meet their surface from its inside.
pub fn seen_from_inside<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    query: &Query<S::Lane>,
    found: &Surfaces<S::Lane>,
) -> u8 {
    let along = found.normal.dot(query.rays.dir).gt(S::Lane::zero()).bits();
    let hits = query.hits();
    (0..LANES).filter(|k| hits >> k & 1 == 1).fold(0, |inside, k| {
        let surface = query.surface[k];
        let inverted = match surface.checked_sub(scene.first_part) {
            Some(part) => scene.csg.parts[part as usize].inverted,
            None => scene.owners[scene.owner[surface as usize] as usize].inverse,
        };
        inside | u8::from((along >> k & 1 == 1) != inverted) << k
    })
}

fn cast<L: Lane>(v: Vec3<L>) -> Vec3<wide::f64x8> {
    Vec3::new(v.x.to_f64s(), v.y.to_f64s(), v.z.to_f64s())
}

fn cast_back<L: Lane>(v: Vec3<wide::f64x8>) -> Vec3<L> {
    Vec3::new(L::from_f64s(v.x), L::from_f64s(v.y), L::from_f64s(v.z))
}

struct Resolve<'a, L> {
    rows: &'a [u32; LANES],
    mask: Mask<L>,
    rays: &'a Rays<L>,
    t: L,
}

impl<S: Scalar> WithBlock<S> for Resolve<'_, S::Lane> {
    type Output = Surfaces<S::Lane>;

    fn block<K: Block<S>>(self, block: &K) -> Surfaces<S::Lane> {
        block.resolve(self.rows, self.mask, self.rays, self.t)
    }
}

impl<S: Scalar> HitList<S> {
    /// Drops all rows.
    pub fn clear(&mut self) {
        self.ray.clear();
        self.t.clear();
        self.point.truncate(0);
        self.normal.truncate(0);
        self.surface.clear();
        self.part.clear();
        self.owner.clear();
        self.texture.clear();
        self.share.clear();
    }

    /// Adds the hits of a packet whose rays are rows `first` and following of their queue.
    pub fn push<B: Scalar>(&mut self, scene: &Compiled<S, B>, first: usize, query: &Query<S::Lane>) {
        let lanes = query.hits();
        if lanes == 0 {
            return;
        }
        let found = resolve(scene, query);
        let inside = seen_from_inside(scene, query, &found);
        let (u, v) = (found.u.to_array(), found.v.to_array());
        let (mut blends, mut cuts) = (0u8, 0u8);
        let owners = query.surface.map(|s| if s == NO_SURFACE { 0 } else { scene.owner[s as usize] });
        let mut textures = [0; LANES];
        for k in (0..LANES).filter(|k| lanes >> k & 1 == 1) {
            let owner = &scene.owners[owners[k] as usize];
            textures[k] = match owner.interior_texture {
                Some(texture) if inside >> k & 1 == 1 => texture,
                _ => {
                    cuts |= u8::from(owner.cut) << k;
                    blends |= u8::from(owner.textures != [owner.textures[0]; 3]) << k;
                    owner.textures[0]
                }
            };
        }
        self.push_cuts(scene, first, query, &found, cuts);
        let lanes = lanes & !cuts;
        self.push_rows(first, query, &found, (&owners, &textures), S::Lane::lit(1.0), lanes & !blends);
        for corner in 0..3 {
            if blends == 0 {
                break;
            }
            let weight = |k: usize| match corner {
                0 => S::from_f64(1.0 - u[k].to_f64() - v[k].to_f64()),
                1 => u[k],
                _ => v[k],
            };
            let textures = owners.map(|o| scene.owners[o as usize].textures[corner]);
            self.push_rows(first, query, &found, (&owners, &textures), S::Lane::from_fn(weight), blends);
        }
    }

    /// Adds the hits of `lanes`, on cut faces, with the textures of the parts they lie in.
    fn push_cuts<B: Scalar>(
        &mut self,
        scene: &Compiled<S, B>,
        first: usize,
        query: &Query<S::Lane>,
        found: &Surfaces<S::Lane>,
        lanes: u8,
    ) {
        let rays = Rays { origin: cast(query.rays.origin), dir: cast(query.rays.dir) };
        for k in (0..LANES).filter(|k| lanes >> k & 1 == 1) {
            let lane = 1 << k;
            let owner = scene.owner[query.surface[k] as usize];
            let mut looks = vec![];
            if let Some(part) = query.surface[k].checked_sub(scene.first_part) {
                let composite = &scene.csg.composites[scene.csg.parts[part as usize].composite as usize];
                let source = Parts { scene, left: query.left, part: query.part };
                // Two roundings: of `t` itself, and of the ray that it was found along.
                let at = (lane, query.t.to_f64s(), 2.0 * S::UNIT_ROUNDOFF);
                for (part, _) in scene.csg.parts_at(composite, &rays, at, &source, &mut Scratch::default()) {
                    let owner = scene.owner[(scene.first_part + part) as usize];
                    if !scene.owners[owner as usize].cut {
                        looks.push(scene.owners[owner as usize].textures[0]);
                    }
                }
            }
            if looks.is_empty() {
                looks.push(scene.owners[owner as usize].textures[0]);
            }
            let share = S::Lane::lit(1.0 / looks.len() as f64);
            for texture in looks {
                self.push_rows(first, query, found, (&[owner; LANES], &[texture; LANES]), share, lane);
            }
        }
    }

    fn push_rows(
        &mut self,
        first: usize,
        query: &Query<S::Lane>,
        found: &Surfaces<S::Lane>,
        (owners, textures): (&[u32; LANES], &[u32; LANES]),
        share: S::Lane,
        lanes: u8,
    ) {
        if lanes == 0 {
            return;
        }
        let lanes = &LaneList::new(lanes);
        self.point.push(found.point, lanes);
        self.normal.push(found.normal, lanes);
        lanes.push(&mut self.t, &query.t.to_array());
        lanes.push(&mut self.share, &share.to_array());
        lanes.push(&mut self.ray, &each_lane(|k| (first + k) as u32));
        lanes.push(&mut self.surface, &query.surface);
        lanes.push(&mut self.part, &found.part);
        lanes.push(&mut self.owner, owners);
        lanes.push(&mut self.texture, textures);
    }

    /// Sorts rows by texture program, rows of one program in their order (a counting sort).
    pub fn sort<B: Scalar>(&mut self, scene: &Compiled<S, B>) {
        let program = |texture: u32| scene.textures.textures[texture as usize].program as usize;
        self.starts.clear();
        self.starts.resize(scene.textures.programs.len() + 1, 0);
        for &texture in &self.texture {
            self.starts[program(texture) + 1] += 1;
        }
        for k in 1..self.starts.len() {
            self.starts[k] += self.starts[k - 1];
        }
        self.order.clear();
        self.order.resize(self.texture.len(), 0);
        let mut next = self.starts.clone();
        for (row, &texture) in self.texture.iter().enumerate() {
            let place = &mut next[program(texture)];
            self.order[*place as usize] = row as u32;
            *place += 1;
        }
    }

    /// Rows to be shaded together: at most eight, of one program.
    pub fn packets(&self) -> impl Iterator<Item = &[u32]> {
        self.starts.windows(2).flat_map(|ends| self.order[ends[0] as usize..ends[1] as usize].chunks(LANES))
    }
}
