//! What see-through surfaces leave of the light on its way: along shadow rays that nothing opaque blocks.
//!
//! Rays go from crossing to crossing, the nearest first: which of two surfaces at one place counts is decided so, and how far a ray has
//! come in an interior. Where each surface lets through one colour, that is all that is asked for.

use super::crossings::{Crossings, InTheWay, Transparent, each_crossing};
use super::hits::{resolve, seen_from_inside};
use super::medium::{Media, fade_over};
use super::query::{Query, start_rounding};
use super::queue::Feelers;
use super::tinted::{dim, tinted, tinted_by, tinted_by_composites};
use crate::compile::{Compiled, NO_SURFACE, Owner, SurfaceId};
use crate::kernel::Surfaces;
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3, bits, choose, each_number, equal_lanes, f32x8};
use crate::texture::{Colors, PigmentProgram};

/// What is left to be done of a packet of shadow rays that goes from surface to surface.
struct Rest {
    /// What the surfaces so far have let through.
    filter: Vec3<f32x8>,
    /// What the rays travel in.
    medium: [u32; LANES],
}

impl Rest {
    /// All of it.
    fn of<L: Lane>(rays: &Feelers<L>) -> Self {
        Self { filter: Vec3::lit(1.0), medium: rays.medium }
    }
}

/// What textures let through wherever rays meet them, by their numbers, as far as that was asked for; of those that let through
/// one colour everywhere.
#[derive(Debug, Default)]
struct Tints(Vec<Option<Option<[f32; 3]>>>);

impl Tints {
    /// What a surface lets through wherever and however rays meet it, if that is all they meet there: one colour, and an interior
    /// that neither gathers nor swallows light.
    #[inline(always)]
    fn of<S: Scalar, B: Scalar>(&mut self, scene: &Compiled<S, B>, surface: SurfaceId) -> Option<[f32; 3]> {
        let owner = &scene.owners[scene.geometry.owner_of(surface) as usize];
        if owner.blocks {
            return Some([0.0; 3]);
        }
        let interior = &scene.interiors[owner.interior as usize];
        let [texture, b, c] = owner.textures;
        let alike = b == texture && c == texture && owner.interior_texture.is_none();
        let clear = interior.caustics == 0.0 && interior.fade_power <= 0.0;
        if !(alike && clear) {
            return None;
        }
        match self.0.get(texture as usize) {
            Some(&Some(known)) => known,
            _ => self.look_up(scene, texture),
        }
    }

    #[cold]
    fn look_up<S: Scalar, B: Scalar>(&mut self, scene: &Compiled<S, B>, texture: u32) -> Option<[f32; 3]> {
        let row = &scene.textures.textures[texture as usize];
        let layers = &scene.textures.programs[row.program as usize].layers;
        let plain = layers.iter().all(|layer| matches!(layer.pigment, PigmentProgram::Plain));
        let anywhere = || {
            let Vec3 { x, y, z } = texture_filter(scene, texture, Vec3::default(), (0.0, S::Lane::zero()));
            [x, y, z].map(|channel| channel.lanes()[0])
        };
        self.0.resize(scene.textures.textures.len(), None);
        *self.0[texture as usize].insert(plain.then(anywhere))
    }
}

/// Buffers for [`through`].
#[derive(Debug, Default)]
pub struct Tinting {
    crossings: Crossings,
    tints: Tints,
}

/// What is left of the light of the rays `lanes` of `query` by what is in their `way`.
pub fn through<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    rays: &Feelers<S::Lane>,
    (query, lanes): (&mut Query<S::Lane>, u8),
    way: &InTheWay,
    tinting: &mut Tinting,
    media: &mut Media,
) -> Vec3<f32x8> {
    let mut rest = Rest::of(rays);
    let Tinting { crossings, tints } = tinting;
    let after = query.t_min;
    // (What only blocked rays have met does not count: how much of it they have noted is a matter of the walk.)
    let mut met = way.things.iter().filter(|(_, met)| met & lanes != 0);
    if let (Some(&(Transparent::Primitive(surface), _)), None) = (met.next(), met.next()) {
        if let Some(tint) = tints.of(scene, surface) {
            return tinted_by(&scene.geometry, (query, lanes), surface, Vec3::broadcast(tint));
        }
        let asked = *query; // (Passing on changes it.)
        let mut passage =
            Passage { scene, query, rest: &mut rest, media, lanes, last: S::Lane::zero(), after };
        each_crossing(&scene.geometry, &asked, surface, lanes, |t| {
            let hits = (t.gt(passage.after) & t.lt(asked.t)).bits() & passage.lanes;
            if hits != 0 {
                passage.cross((hits, t), &[surface; LANES]);
            }
        });
        return rest.filter;
    }
    let mut tint = |surface| tints.of(scene, surface);
    if let Some(filter) = tinted_by_composites(&scene.geometry, (query, lanes), way, &mut tint) {
        return filter;
    }
    crossings.find(&scene.geometry, query, way, lanes, tint);
    let (mut colored, mut waiting) = ([f32x8::lit(1.0); 3], 0);
    for lane in bits(lanes) {
        let line = (query.rays.origin.lane(lane), query.rays.dir.lane(lane));
        match tinted::<S>(crossings.of(lane), line, after.lanes()[lane].to_f64()) {
            Some(filter) => {
                for (channel, x) in colored.iter_mut().zip(filter) {
                    channel.lanes_mut()[lane] = x;
                }
            }
            None => waiting |= 1 << lane,
        }
    }
    let [x, y, z] = colored;
    rest.filter = Vec3::new(x, y, z);
    let mut passage =
        Passage { scene, query, rest: &mut rest, media, lanes: waiting, last: S::Lane::zero(), after };
    loop {
        let (mut hits, mut t, mut surfaces) = (0, S::Lane::zero(), [NO_SURFACE; LANES]);
        for lane in bits(passage.lanes) {
            if let Some(crossing) = crossings.next(lane, passage.after.lanes()[lane].to_f64()) {
                hits |= 1 << lane;
                t.lanes_mut()[lane] = S::from_f64(crossing.t);
                surfaces[lane] = crossing.surface;
            }
        }
        if hits == 0 {
            return rest.filter;
        }
        passage.cross((hits, t), &surfaces);
    }
}

/// Shadow rays on their way through crossings that are known.
struct Passage<'a, S: Scalar, B: Scalar> {
    scene: &'a Compiled<S, B>,
    query: &'a mut Query<S::Lane>,
    rest: &'a mut Rest,
    media: &'a mut Media,
    /// Rays that are worth following.
    lanes: u8,
    /// Where the last crossing was.
    last: S::Lane,
    /// Within the rounding of where a ray would go on from there is nothing new.
    after: S::Lane,
}

impl<S: Scalar, B: Scalar> Passage<'_, S, B> {
    /// Takes rays through `surfaces` at `t` in the lanes `hits`.
    fn cross(&mut self, (hits, t): (u8, S::Lane), surfaces: &[SurfaceId; LANES]) {
        let Self { scene, query, rest, media, last, .. } = self;
        (query.t, query.surface) = (t, choose(hits, surfaces, &[NO_SURFACE; LANES]));
        let found = resolve(&scene.geometry, query);
        let more = cross(scene, query, &found, (hits, t - *last), rest, media);
        self.lanes &= more | !hits;
        let met = Mask::from_bits(hits);
        self.last = met.select(t, self.last);
        self.after = met.select(t + start_rounding(&found.point), self.after);
    }
}

/// Takes eight shadow rays through the surfaces they have met (in the lanes `hits`), `way` behind the last ones; returns the
/// lanes that are still worth following.
fn cross<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    query: &Query<S::Lane>,
    found: &Surfaces<S::Lane>,
    (hits, way): (u8, S::Lane),
    rest: &mut Rest,
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
        more |= dim(&mut rest.filter, tint, same);
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
