//! What see-through surfaces leave of the light on its way: along shadow rays that nothing opaque blocks.
//!
//! Rays that meet one primitive are through with its crossings; where several are in the way, rays go from surface to
//! surface, nearest first, as which of two surfaces at one place counts is decided there.

use super::emit::NO_LIGHT;
use super::hits::{resolve, seen_from_inside};
use super::medium::{Media, fade_over};
use super::query::{Query, start_rounding};
use super::queue::{Feelers, Lines};
use super::trace::Tracer;
use crate::compile::{Compiled, NO_SURFACE, Owner, SurfaceId, WithBlock, class};
use crate::kernel::{Block, Left, Rays, Surfaces};
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3, choose, each_number, equal_lanes, f32x8};
use crate::texture::{Colors, PigmentProgram};

/// What is left to be done of a packet of shadow rays that goes from surface to surface.
pub struct Rest<L> {
    /// What the surfaces so far have let through.
    pub filter: Vec3<f32x8>,
    /// What the rays travel in.
    medium: [u32; LANES],
    /// How far it is to the light.
    distance: L,
}

impl<L: Lane> Rest<L> {
    /// All of it.
    pub fn of(rays: &Feelers<L>) -> Self {
        Self { filter: Vec3::lit(1.0), medium: rays.medium, distance: rays.t_max }
    }

    /// Lets `tint` of the light through in some lanes: those where that leaves any.
    fn dim(&mut self, tint: Vec3<f32x8>, lanes: u8) -> u8 {
        let filter = self.filter.mul(tint);
        let worth = filter.abs().max_element().ge(f32x8::lit(NO_LIGHT));
        let left = filter.map(|f| worth.keep(f));
        self.filter = Vec3::select(Mask::from_bits(lanes), left, self.filter);
        lanes & worth.bits()
    }
}

/// What a surface lets through wherever and however rays meet it, if that is all they meet there: one colour, and an interior that
/// neither gathers nor swallows light.
fn one_tint<S: Scalar, B: Scalar>(scene: &Compiled<S, B>, surface: SurfaceId) -> Option<Vec3<f32x8>> {
    let owner = &scene.owners[scene.geometry.owner_of(surface) as usize];
    let interior = &scene.interiors[owner.interior as usize];
    let [texture, b, c] = owner.textures;
    let row = &scene.textures.textures[texture as usize];
    let layers = &scene.textures.programs[row.program as usize].layers;
    let alike = b == texture && c == texture && owner.interior_texture.is_none() && !owner.blocks;
    let clear = interior.caustics == 0.0 && interior.fade_power <= 0.0;
    let plain = layers.iter().all(|layer| matches!(layer.pigment, PigmentProgram::Plain));
    let anywhere = || texture_filter(scene, texture, Vec3::default(), (0.0, S::Lane::zero()));
    (alike && clear && plain).then(anywhere)
}

/// What the crossings of `surface`, the only one in the way of the rays `lanes` of `query`, leave of their light.
pub fn through_one<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    rays: &Feelers<S::Lane>,
    query: &mut Query<S::Lane>,
    (surface, mut lanes): (SurfaceId, u8),
    media: &mut Media,
) -> Vec3<f32x8> {
    let mut rest = Rest::of(rays);
    let on = query.lanes_on(surface) & lanes;
    let left = Left { on: Mask::from_bits(on), part: query.part };
    let (lines, mut last, mut after) = (query.rays, S::Lane::zero(), query.t_min);
    let tint = one_tint(scene, surface);
    let crossed = |t: S::Lane| {
        let hits = (t.gt(after) & t.lt(rays.t_max)).bits() & lanes;
        if hits == 0 {
            return;
        }
        let (point, more) = if let Some(tint) = tint {
            (lines.origin + lines.dir * t, rest.dim(tint, hits))
        } else {
            (query.t, query.surface) = (t, choose(hits, &[surface; LANES], &[NO_SURFACE; LANES]));
            let found = resolve(&scene.geometry, query);
            (found.point, cross(scene, query, &found, (hits, t - last), &mut rest, media))
        };
        lanes &= more | !hits;
        let met = Mask::from_bits(hits);
        last = met.select(t, last);
        // Within the rounding of where a ray would go on there is nothing new.
        after = met.select(t + start_rounding(&point), after);
    };
    let (kind, row) = scene.geometry.row_of(surface);
    let left = (on != 0).then_some(&left);
    scene.geometry.columns.with(kind, EachCrossing { row: row as usize, rays: &lines, left, crossed });
    rest.filter
}

/// Hands on the crossings of eight rays with one row, the nearest first.
struct EachCrossing<'a, L, F> {
    row: usize,
    rays: &'a Rays<L>,
    left: Option<&'a Left<L>>,
    crossed: F,
}

impl<S: Scalar, F: FnMut(S::Lane)> WithBlock<S> for EachCrossing<'_, S::Lane, F> {
    type Output = ();

    fn block<K: Block<S>>(mut self, block: &K) {
        block.roots(self.row, self.rays, self.left).as_ref().iter().for_each(|&t| (self.crossed)(t));
    }
}

/// What all that is see-through leaves of the light along a group of shadow rays, which `queries` ask for: into `rests`.
pub fn gather_filters<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    group: &[Feelers<S::Lane>],
    queries: &mut [Query<S::Lane>],
    rests: &mut Vec<Rest<S::Lane>>,
    tracer: &mut Tracer<B>,
    media: &mut Media,
) {
    rests.clear();
    rests.extend(group.iter().map(Rest::of));
    loop {
        tracer.nearest(&scene.geometry, queries, class::FILTERS);
        let mut some = false;
        for (query, rest) in queries.iter_mut().zip(&mut *rests) {
            let hits = query.hits();
            if hits == 0 {
                query.lanes = 0;
                continue;
            }
            let met = Mask::from_bits(hits);
            let found = resolve(&scene.geometry, query);
            let more = cross(scene, query, &found, (hits, query.t), rest, media);
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

/// Takes eight shadow rays through the surfaces they have met (in the lanes `hits`), `way` behind the last ones; returns the
/// lanes that are still worth following.
fn cross<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    query: &Query<S::Lane>,
    found: &Surfaces<S::Lane>,
    (hits, way): (u8, S::Lane),
    rest: &mut Rest<S::Lane>,
    media: &mut Media,
) -> u8 {
    let surfaces = query.met(hits);
    let owners = each_number(&surfaces, |surface| scene.geometry.owner_of(surface));
    let cos = found.normal.dot(query.rays.dir).abs();
    let before = rest.medium;
    let (mut waiting, mut more) = (hits, 0);
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
            tint = tint.mul(Vec3::from_fn(|k| fade_over(interior, way.lanes()[k].to_f64())));
        }
        rest.medium = choose(same, &[crossing.next; LANES], &rest.medium);
        more |= rest.dim(tint, same);
    }
    more
}

/// What surfaces of one owner let through at eight points.
fn owner_filter<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    owner: &Owner,
    query: &Query<S::Lane>,
    found: &Surfaces<S::Lane>,
    focus: (f64, S::Lane),
) -> Vec3<f32x8> {
    if owner.blocks {
        return Vec3::lit(0.0);
    }
    let through = |texture: u32| texture_filter(scene, texture, found.point, focus);
    let [a, b, c] = owner.textures;
    let outside = if a == b && b == c {
        through(a)
    } else {
        let (u, v): (f32x8, f32x8) = (found.u.cast(), found.v.cast());
        through(a) * (f32x8::lit(1.0) - u - v) + through(b) * u + through(c) * v
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
) -> Vec3<f32x8> {
    let row = &scene.textures.textures[texture as usize];
    if row.opaque {
        return Vec3::lit(0.0);
    }
    let program = &scene.textures.programs[row.program as usize];
    let (mut filter, mut colors) = (Vec3::lit(1.0), Colors::default());
    for (number, layer) in program.layers.iter().enumerate() {
        layer.paint(&scene.textures, &[texture; LANES], number, point, &mut colors);
        filter = filter.mul(colors.transmittance());
        if caustics != 0.0 {
            let focus: f32x8 = cos.pow_const(45.0 * caustics).cast();
            filter = filter * (f32x8::lit(1.0) + focus);
        }
    }
    filter
}
