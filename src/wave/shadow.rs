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
use crate::compile::{Compiled, Owner, class};
use crate::kernel::{Rays, Surfaces};
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3, choose, each_lane, equal_lanes};

/// Buffers for shadow rays.
#[derive(Default)]
pub struct ShadowTracer<S: Scalar> {
    queries: Vec<Query<S::Lane>>,
    /// Rays that nothing opaque blocks, in scenes where something may still tint them.
    open: Queue<Feelers<S::Lane>>,
    /// By packet of them.
    rests: Vec<Rest<S::Lane>>,
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
            aim(&mut self.queries, group);
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
        let Self { queries, open, rests, .. } = self;
        for group in open.packets().chunks(GROUP) {
            gather_filters(scene, group, queries, rests, tracer, media);
            for (rays, rest) in group.iter().zip(&*rests) {
                sums.add(&rays.sink, rays.light.mul(rest.filter), rays.lanes);
            }
        }
        open.clear();
    }
}

/// Makes `queries` ask for what is in the way of `group`.
fn aim<L: Lane>(queries: &mut Vec<Query<L>>, group: &[Feelers<L>]) {
    queries.resize(group.len(), Query::default());
    for (query, rays) in queries.iter_mut().zip(group) {
        query.aim(&rays.lines, rays.t_max, rays.lanes);
    }
}

/// What is left to be done of a packet of shadow rays that goes from surface to surface.
struct Rest<L> {
    /// What the surfaces so far have let through.
    filter: Vec3<L>,
    /// What the rays travel in.
    medium: [u32; LANES],
    /// How far it is to the light.
    distance: L,
}

/// What see-through occluders leave of the light along up to [`GROUP`] packets of shadow rays, into `rests`.
fn gather_filters<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    group: &[Feelers<S::Lane>],
    queries: &mut Vec<Query<S::Lane>>,
    rests: &mut Vec<Rest<S::Lane>>,
    tracer: &mut Tracer<B>,
    media: &mut Media,
) {
    aim(queries, group);
    rests.clear();
    rests.extend(group.iter().map(|rays| Rest {
        filter: Vec3::lit(1.0),
        medium: rays.medium,
        distance: rays.t_max,
    }));
    loop {
        tracer.nearest(scene, queries, class::FILTERS);
        let mut some = false;
        for (query, rest) in queries.iter_mut().zip(&mut *rests) {
            let hits = query.hits();
            if hits == 0 {
                query.lanes = 0;
                continue;
            }
            let met = Mask::from_bits(hits);
            let found = resolve(scene, query);
            let more = cross(scene, query, &found, hits, rest, media);
            rest.distance -= met.keep(query.t);
            // On from where the ray is, away from the surface it has met.
            let origin = Vec3::select(met, found.point, query.rays.origin);
            let lines = Lines {
                rays: Rays { origin, dir: query.rays.dir },
                left: query.surface, // No surface where nothing was met.
                part: found.part,
            };
            query.aim(&lines, rest.distance, more);
            some |= more != 0;
        }
        if !some {
            return;
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
    rest: &mut Rest<S::Lane>,
    media: &mut Media,
) -> u8 {
    let surfaces = query.met(hits);
    let owners = each_lane(|k| scene.owner[surfaces[k] as usize]);
    let cos = found.normal.dot(query.rays.dir).abs();
    let before = rest.medium;
    let mut waiting = hits;
    // Neighbours mostly meet one object, and come from one interior.
    while waiting != 0 {
        let first = waiting.trailing_zeros() as usize & (LANES - 1);
        let same = waiting & equal_lanes(&owners, owners[first]) & equal_lanes(&before, before[first]);
        waiting &= !same;
        let owner = &scene.owners[owners[first] as usize];
        let interior = &scene.interiors[owner.interior as usize];
        let mut tint = owner_filter(scene, owner, query, found, (interior.caustics, cos));
        let crossing = media.cross(before[first], owner.interior, &scene.interiors);
        // In shadows POV-Ray fades only with a power over 0.
        if crossing.leaves && interior.fade_power > 0.0 {
            tint = tint.mul(Vec3::from_fn(|k| fade_over(interior, query.t.lanes()[k].to_f64())));
        }
        rest.medium = choose(same, &[crossing.next; LANES], &rest.medium);
        rest.filter = Vec3::select(Mask::from_bits(same), rest.filter.mul(tint), rest.filter);
    }
    let worth = rest.filter.abs().max_element().ge(S::Lane::lit(NO_LIGHT));
    let spent = !worth & Mask::from_bits(hits);
    rest.filter = Vec3::select(spent, Vec3::lit(0.0), rest.filter);
    hits & worth.bits()
}

/// What surfaces of one owner let through at eight points.
fn owner_filter<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    owner: &Owner,
    query: &Query<S::Lane>,
    found: &Surfaces<S::Lane>,
    focus: (f64, S::Lane),
) -> Vec3<S::Lane> {
    if owner.blocks {
        return Vec3::lit(0.0);
    }
    let through = |texture: u32| texture_filter(scene, texture, found.point, focus);
    let [a, b, c] = owner.textures;
    let outside = if a == b && b == c {
        through(a)
    } else {
        let (u, v) = (found.u, found.v);
        through(a) * (S::Lane::lit(1.0) - u - v) + through(b) * u + through(c) * v
    };
    match owner.interior_texture {
        None => outside,
        Some(texture) => {
            let inside = Mask::from_bits(seen_from_inside(scene, query, found));
            Vec3::select(inside, through(texture), outside)
        }
    }
}

/// What one texture lets through at eight points, which `caustics` gather where rays meet it at right angles.
fn texture_filter<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    texture: u32,
    point: Vec3<S::Lane>,
    (caustics, cos): (f64, S::Lane),
) -> Vec3<S::Lane> {
    let row = &scene.textures.textures[texture as usize];
    if row.opaque {
        return Vec3::lit(0.0);
    }
    let program = &scene.textures.programs[row.program as usize];
    let mut filter = Vec3::lit(1.0);
    for (number, layer) in program.layers.iter().enumerate() {
        let through = layer.colors(&scene.textures, &[texture; LANES], number, point).transmittance();
        filter = filter.mul(through);
        if caustics != 0.0 {
            filter = filter * (S::Lane::lit(1.0) + cos.pow_const(45.0 * caustics));
        }
    }
    filter
}
