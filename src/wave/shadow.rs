//! Shadow rays of one light: what blocks them, and what tints them.
//!
//! Rays are first held against everything that blocks all light, in any order. Only if the scene has see-through
//! occluders do the survivors look for those, from surface to surface, and gather their filters.

use super::hits::{resolve, seen_from_inside};
use super::medium::Media;
use super::queue::{ShadowQueue, gather, load, load_numbers};
use super::shade::{NO_LIGHT, fade_over};
use super::sums::Sums;
use super::trace::{GROUP, Query, Tracer};
use crate::compile::{Compiled, NO_SURFACE, class};
use crate::kernel::Rays;
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3};
use crate::scene::Rgb;

/// Buffers for shadow rays.
#[derive(Default)]
pub struct ShadowTracer<S: Scalar> {
    queries: Vec<Query<S::Lane>>,
    open: Vec<u32>,
}

impl<S: Scalar> ShadowTracer<S> {
    /// Traces `queue` and adds the light that arrives to `sums`.
    pub fn trace<B: Scalar>(
        &mut self,
        scene: &Compiled<S, B>,
        queue: &ShadowQueue<S>,
        tracer: &mut Tracer<B>,
        media: &mut Media,
        sums: &mut Sums,
    ) {
        let filters = scene.has_class(class::FILTERS);
        self.open.clear();
        for group in (0..queue.len()).step_by(GROUP * LANES) {
            self.queries.clear();
            for first in (group..queue.len().min(group + GROUP * LANES)).step_by(LANES) {
                let (lines, left, part, lanes) = queue.geometry.load(first);
                self.queries.push(Query::new(lines, left, part, load::<S>(&queue.t_max, first), lanes));
            }
            if scene.has_class(class::BLOCKS) {
                tracer.occluded(scene, &mut self.queries, class::BLOCKS);
            }
            for (k, query) in self.queries.iter().enumerate() {
                let first = group + k * LANES;
                let open = query.lanes & !query.hits();
                if filters {
                    self.open.extend(
                        (0..LANES).filter(|lane| open >> lane & 1 == 1).map(|lane| (first + lane) as u32),
                    );
                } else {
                    let sink = load_numbers(&queue.sink, first, 0);
                    sums.add(&sink, queue.light.load(first), open);
                }
            }
        }
        for rows in self.open.chunks(LANES) {
            let row: [u32; LANES] = std::array::from_fn(|k| rows.get(k).copied().unwrap_or(rows[0]));
            let filter =
                gather_filters(scene, queue, &row, Mask::<S::Lane>::first(rows.len()).bits(), tracer, media);
            let sink = row.map(|r| queue.sink[r as usize]);
            sums.add(&sink, queue.light.gather(&row).mul(filter), Mask::<S::Lane>::first(rows.len()).bits());
        }
    }
}

/// What see-through occluders leave of the light along eight shadow rays.
fn gather_filters<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    queue: &ShadowQueue<S>,
    row: &[u32; LANES],
    lanes: u8,
    tracer: &mut Tracer<B>,
    media: &mut Media,
) -> Vec3<S::Lane> {
    let mut filter = [Rgb::ONE; LANES];
    let mut medium = row.map(|r| queue.medium[r as usize]);
    let mut rest: S::Lane = gather(&queue.t_max, row);
    let rays = Rays { origin: queue.geometry.origin.gather(row), dir: queue.geometry.dir.gather(row) };
    let left = row.map(|r| queue.geometry.left[r as usize]);
    let part = row.map(|r| queue.geometry.part[r as usize]);
    let mut query = Query::new(rays, left, part, rest, lanes);
    loop {
        tracer.nearest(scene, std::slice::from_mut(&mut query), class::FILTERS);
        let hits = query.hits();
        if hits == 0 {
            return Vec3::from_fn(|k| filter[k]);
        }
        let found = resolve(scene, &query);
        let cos = found.normal.dot(query.rays.dir).abs();
        let inside = seen_from_inside(scene, &query, &found);
        let distance = query.t.to_array();
        let mut more = 0u8;
        for k in (0..LANES).filter(|k| hits >> k & 1 == 1) {
            let owner = &scene.owners[scene.owner[query.surface[k] as usize] as usize];
            let weights = match owner.interior_texture {
                Some(texture) if inside >> k & 1 == 1 => [(texture, 1.0), (texture, 0.0), (texture, 0.0)],
                _ => {
                    let (u, v) = (found.u.to_array()[k].to_f64(), found.v.to_array()[k].to_f64());
                    let [a, b, c] = owner.textures;
                    if a == b && b == c {
                        [(a, 1.0), (a, 0.0), (a, 0.0)]
                    } else {
                        [(a, 1.0 - u - v), (b, u), (c, v)]
                    }
                }
            };
            let interior = &scene.interiors[owner.interior as usize];
            let mut tint = Rgb::ZERO;
            for (texture, weight) in weights {
                if weight != 0.0 {
                    tint += weight
                        * texture_filter(
                            scene,
                            texture,
                            found.point,
                            k,
                            interior.caustics,
                            cos.to_array()[k].to_f64(),
                        );
                }
            }
            let crossing = media.cross(medium[k], owner.interior, &scene.interiors);
            // In shadows POV-Ray fades only with a power over 0.
            if crossing.leaves && interior.fade_power > 0.0 {
                tint *= fade_over(interior, distance[k].to_f64());
            }
            medium[k] = crossing.next;
            filter[k] *= tint;
            more |= u8::from(filter[k].abs().max_element() >= NO_LIGHT) << k;
            if more >> k & 1 == 0 {
                filter[k] = Rgb::ZERO;
            }
        }
        rest -= Mask::<S::Lane>::from_bits(hits).keep(query.t);
        // On from where the ray is, away from the surface it has met.
        let met = Mask::from_bits(hits);
        let rays = Rays { origin: Vec3::select(met, found.point, query.rays.origin), dir: query.rays.dir };
        let left = std::array::from_fn(|k| if hits >> k & 1 == 1 { query.surface[k] } else { NO_SURFACE });
        query = Query::new(rays, left, found.part, rest, more);
    }
}

/// What one texture lets through at lane `k` of `point`.
fn texture_filter<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    texture: u32,
    point: Vec3<S::Lane>,
    k: usize,
    caustics: f64,
    cos: f64,
) -> Rgb {
    let row = &scene.textures.textures[texture as usize];
    if row.opaque {
        return Rgb::ZERO;
    }
    let program = &scene.textures.programs[row.program as usize];
    program.layers.iter().enumerate().fold(Rgb::ONE, |filter, (number, layer)| {
        let through = layer.colors(&scene.textures, &[texture; LANES], number, point).transmittance().lane(k);
        let focus = if caustics == 0.0 { 1.0 } else { 1.0 + cos.powf(45.0 * caustics) };
        filter * through * focus
    })
}
