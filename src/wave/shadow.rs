//! Shadow rays of one light: what blocks them, and what tints them.
//!
//! Rays are first held against everything in the way, in any order: what blocks all light ends them, what is
//! see-through is only noted. Those with such a note go from surface to surface and gather what the surfaces let through.

use super::hits::{resolve, seen_from_inside};
use super::medium::Media;
use super::query::{GROUP, Query};
use super::queue::{Feelers, Lines, Queue};
use super::shade::{NO_LIGHT, fade_over};
use super::sums::Sums;
use super::trace::Tracer;
use crate::bvh::Run;
use crate::compile::{Compiled, NO_SURFACE, class};
use crate::kernel::{Rays, Surfaces};
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3, each_lane};
use crate::scene::Rgb;
use smallvec::SmallVec;

/// Buffers for shadow rays.
#[derive(Default)]
pub struct ShadowTracer<S: Scalar> {
    queries: Vec<Query<S::Lane>>,
    /// Rays that nothing opaque blocks, in scenes where something may still tint them.
    open: Queue<Feelers<S::Lane>>,
    /// By light: see [`Tracer::occluded`].
    suspects: Vec<Option<Run>>,
}

impl<S: Scalar> ShadowTracer<S> {
    /// Traces the ready packets of `queue`, which lead to light number `light`, and adds the light that arrives to
    /// `sums`; rays that may be tinted wait.
    pub fn trace<B: Scalar>(
        &mut self,
        scene: &Compiled<S, B>,
        (light, queue): (usize, &mut Queue<Feelers<S::Lane>>),
        tracer: &mut Tracer<B>,
        media: &mut Media,
        sums: &mut Sums,
    ) {
        let filters = scene.has_class(class::FILTERS);
        if self.suspects.len() <= light {
            self.suspects.resize(light + 1, None);
        }
        for group in queue.packets().chunks(GROUP) {
            self.queries.clear();
            self.queries.extend(group.iter().map(|rays| Query::new(&rays.lines, rays.t_max, rays.lanes)));
            let tinted = tracer.occluded(scene, &mut self.queries, &mut self.suspects[light]);
            for (k, (query, rays)) in self.queries.iter().zip(group).enumerate() {
                let lanes = rays.lanes & !query.hits();
                sums.add(&rays.sink, rays.light, lanes & !tinted[k]);
                if filters {
                    self.open.push_lanes(rays, lanes & tinted[k]);
                }
            }
        }
        queue.clear();
        self.trace_open(scene, tracer, media, sums);
    }

    /// Traces the rays that wait, full packets or not.
    pub fn flush<B: Scalar>(
        &mut self,
        scene: &Compiled<S, B>,
        tracer: &mut Tracer<B>,
        media: &mut Media,
        sums: &mut Sums,
    ) {
        self.open.flush();
        self.trace_open(scene, tracer, media, sums);
    }

    fn trace_open<B: Scalar>(
        &mut self,
        scene: &Compiled<S, B>,
        tracer: &mut Tracer<B>,
        media: &mut Media,
        sums: &mut Sums,
    ) {
        for group in self.open.packets().chunks(GROUP) {
            let filters = gather_filters(scene, group, tracer, media);
            for (rays, filter) in group.iter().zip(filters) {
                sums.add(&rays.sink, rays.light.mul(Vec3::from_fn(|k| filter[k])), rays.lanes);
            }
        }
        self.open.clear();
    }
}

/// What see-through occluders leave of the light along up to [`GROUP`] packets of shadow rays.
fn gather_filters<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    group: &[Feelers<S::Lane>],
    tracer: &mut Tracer<B>,
    media: &mut Media,
) -> SmallVec<[[Rgb; LANES]; GROUP]> {
    let mut filters: SmallVec<[[Rgb; LANES]; GROUP]> = group.iter().map(|_| [Rgb::ONE; LANES]).collect();
    let mut mediums: SmallVec<[[u32; LANES]; GROUP]> = group.iter().map(|rays| rays.medium).collect();
    let mut rest: SmallVec<[S::Lane; GROUP]> = group.iter().map(|rays| rays.t_max).collect();
    let mut queries: SmallVec<[Query<S::Lane>; GROUP]> =
        group.iter().map(|rays| Query::new(&rays.lines, rays.t_max, rays.lanes)).collect();
    loop {
        tracer.nearest(scene, &mut queries, class::FILTERS);
        let mut some = false;
        for (k, query) in queries.iter_mut().enumerate() {
            let hits = query.hits();
            if hits == 0 {
                query.lanes = 0;
                continue;
            }
            let met = Mask::from_bits(hits);
            let found = resolve(scene, query);
            let more = cross(scene, query, &found, hits, &mut filters[k], &mut mediums[k], media);
            rest[k] -= met.keep(query.t);
            // On from where the ray is, away from the surface it has met.
            let origin = Vec3::select(met, found.point, query.rays.origin);
            let lines = Lines {
                rays: Rays { origin, dir: query.rays.dir },
                left: each_lane(|k| if hits >> k & 1 == 1 { query.surface[k] } else { NO_SURFACE }),
                part: found.part,
            };
            *query = Query::new(&lines, rest[k], more);
            some |= more != 0;
        }
        if !some {
            return filters;
        }
    }
}

/// Takes eight shadow rays through the surfaces they have met (in the lanes `hits`); returns the lanes that are
/// still worth following.
fn cross<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    query: &Query<S::Lane>,
    found: &Surfaces<S::Lane>,
    hits: u8,
    filter: &mut [Rgb; LANES],
    medium: &mut [u32; LANES],
    media: &mut Media,
) -> u8 {
    let cos = found.normal.dot(query.rays.dir).abs();
    let distance = query.t.to_f64s().to_array();
    let mut inside = None;
    // Neighbours mostly see one texture: what it lets through is worked out for all lanes at once.
    let mut known: Option<(u32, f64, [Rgb; LANES])> = None;
    let mut more = 0u8;
    for k in (0..LANES).filter(|k| hits >> k & 1 == 1) {
        let owner = &scene.owners[scene.owner[query.surface[k] as usize] as usize];
        let interior = &scene.interiors[owner.interior as usize];
        let mut through = |texture: u32| match &known {
            Some((of, caustics, tints)) if (*of, *caustics) == (texture, interior.caustics) => tints[k],
            _ => {
                let tints = texture_filter(scene, texture, found.point, interior.caustics, cos);
                known = Some((texture, interior.caustics, tints));
                tints[k]
            }
        };
        let from_inside = |k: usize| {
            let inside: &mut Option<u8> = &mut inside;
            *inside.get_or_insert_with(|| seen_from_inside(scene, query, found)) >> k & 1 == 1
        };
        let [a, b, c] = owner.textures;
        let mut tint = match owner.interior_texture {
            _ if owner.blocks => Rgb::ZERO,
            Some(texture) if { from_inside }(k) => through(texture),
            _ if a == b && b == c => through(a),
            _ => {
                let (u, v) = (found.u.lanes()[k].to_f64(), found.v.lanes()[k].to_f64());
                let mut tint = Rgb::ZERO;
                for (texture, weight) in [(a, 1.0 - u - v), (b, u), (c, v)] {
                    if weight != 0.0 {
                        tint += weight * through(texture);
                    }
                }
                tint
            }
        };
        let crossing = media.cross(medium[k], owner.interior, &scene.interiors);
        // In shadows POV-Ray fades only with a power over 0.
        if crossing.leaves && interior.fade_power > 0.0 {
            tint *= fade_over(interior, distance[k]);
        }
        medium[k] = crossing.next;
        filter[k] *= tint;
        if filter[k].abs().max_element() >= NO_LIGHT {
            more |= 1 << k;
        } else {
            filter[k] = Rgb::ZERO;
        }
    }
    more
}

/// What one texture lets through at eight points.
fn texture_filter<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    texture: u32,
    point: Vec3<S::Lane>,
    caustics: f64,
    cos: S::Lane,
) -> [Rgb; LANES] {
    let row = &scene.textures.textures[texture as usize];
    if row.opaque {
        return [Rgb::ZERO; LANES];
    }
    let program = &scene.textures.programs[row.program as usize];
    let mut filter = [Rgb::ONE; LANES];
    for (number, layer) in program.layers.iter().enumerate() {
        let through = layer.colors(&scene.textures, &[texture; LANES], number, point).transmittance();
        for (k, filter) in filter.iter_mut().enumerate() {
            let focus =
                if caustics == 0.0 { 1.0 } else { 1.0 + cos.lanes()[k].to_f64().powf(45.0 * caustics) };
            *filter = *filter * through.lane(k) * focus;
        }
    }
    filter
}
