//! Light at eight hits that share a texture program: local light into the sums, new rays into the queues
//! (formulas as measured on POV-Ray 3.7: manual sections 3.4.6.3 finish, 3.4.6.5 interior).

use super::hits::Hit;
use super::light::{LightProgram, grey};
use super::medium::{Crossing, Media};
use super::queue::{Carriers, Feelers, Queue};
use super::sums::Sums;
use crate::compile::Compiled;
use crate::film::PacketCounts;
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3, choose, each_lane, each_number, equal_lanes};
use crate::scene::{Finish, Interior, Reflection, Rgb};
use crate::texture::{Colors, LayerProgram, Program};

/// Light weaker than this in every channel is not followed (POV-Ray's figure; channels are of order 1).
pub const NO_LIGHT: f64 = 1e-10;

/// Where the shading of a batch puts what it makes.
pub struct Emit<'a, L: Lane> {
    /// Sums of pixels.
    pub sums: &'a mut Sums,
    /// Reflected rays, and those of total internal reflection.
    pub reflected: &'a mut Queue<Carriers<L>>,
    /// Refracted rays, and those that go straight on.
    pub refracted: &'a mut Queue<Carriers<L>>,
    /// A queue a light.
    pub shadows: &'a mut [Queue<Feelers<L>>],
    /// The thread's interior lists.
    pub media: &'a mut Media,
    /// Counts packets of hits, hits in them, and shadow rays that lights' buffers have answered.
    pub counts: &'a mut PacketCounts,
}

/// A layer under others, as light meets it.
struct LitLayer<'a, L> {
    layer: &'a LayerProgram,
    colors: Colors<L>,
    /// What the layers above let through, and where anything is left of it.
    filter: Vec3<L>,
    live: Mask<L>,
}

/// A mirror ray that a layer asks for.
struct Mirror<'a, L> {
    lanes: Mask<L>,
    factor: Vec3<L>,
    weight: L,
    finish: &'a Reflection,
}

/// Shades `hit`, whose textures all have the program number `program`.
pub fn shade<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    lights: &[LightProgram],
    hit: &Hit<S::Lane>,
    program: u32,
    emit: &mut Emit<S::Lane>,
) {
    emit.counts.shaded += 1;
    emit.counts.hits += u64::from(hit.active.count_ones());
    let program = &scene.textures.programs[program as usize];
    let active = Mask::<S::Lane>::from_bits(hit.active);
    let crossings = Crossings::of(scene, program, hit, emit.media);
    let adc = S::Lane::lit(scene.globals.adc_bailout);
    let one = S::Lane::lit(1.0);

    let mut live = active;
    let mut local = Vec3::lit(0.0);
    let mut filter = Vec3::lit(1.0);
    let mut transmitted = one;
    // Most textures have one layer, which nothing lies over.
    let (mut top_lit, mut lit_below) = (false, Vec::new());
    let (mut top_colors, mut below) = (Colors::default(), Colors::default());
    let mut mirrors = Few::new();
    for (number, layer) in program.layers.iter().enumerate() {
        live &= transmitted.gt(adc);
        if live.none() {
            break;
        }
        let finish = &layer.finish;
        let colors = if number == 0 { &mut top_colors } else { &mut below };
        layer.paint(&scene.textures, &hit.texture, number, hit.point, colors);
        let own = Vec3::splat(finish.ambient * scene.globals.ambient_light + finish.emission);
        let lit = (colors.rgb.mul(own) * colors.opacity()).mul(filter);
        local += Vec3::select(live, lit, Vec3::lit(0.0));
        if answers_light(finish) && number == 0 {
            top_lit = true;
        } else if answers_light(finish) {
            lit_below.push(LitLayer { layer, colors: *colors, filter, live });
        }

        let mut reflectivity = None;
        if finish.reflection.is_some() {
            let mut mirror = reflect_share(finish, colors, hit, &crossings, transmitted, live);
            // What is conserved is counted without the film's interference.
            reflectivity = Some(mirror.factor);
            if finish.irid != 0.0 {
                let path = hit.cos * S::Lane::lit(2.0);
                let mut film = interference(finish, path, scene.globals.irid_wavelength);
                // The film is on what is seen, which the exponent then bends.
                if finish.reflection.exponent != 1.0 {
                    let power = 1.0 / finish.reflection.exponent;
                    film = film.map(|f| f.max(S::Lane::zero()).pow_const(power));
                }
                mirror.factor = mirror.factor.mul(film);
            }
            mirrors.push(mirror);
        }
        let mut through = colors.transmittance();
        if let (true, Some(r)) = (finish.conserve_energy, reflectivity) {
            through = through.mul(r.map(|r| (one - r).min(one)));
        }
        filter = Vec3::select(live, filter.mul(through), filter);
        transmitted = live.select(grey(filter).abs().min(one), transmitted);
    }

    emit.sums.add(&hit.sink, local.mul(hit.throughput), hit.active);
    let top = program.layers.first();
    if top_lit || !lit_below.is_empty() {
        let from_behind = program.layers.iter().any(|layer| layer.finish.diffuse_back != 0.0);
        let irid_wavelength = scene.globals.irid_wavelength;
        let mut lamp = Lamp::default();
        for (number, light) in lights.iter().enumerate() {
            if !lamp.shine(light, hit, active, from_behind, &mut emit.counts.answered) {
                continue;
            }
            let mut sum = Vec3::lit(0.0);
            if let (Some(layer), true) = (top, top_lit) {
                sum = direct_light(&lamp, &layer.finish, &top_colors, hit, irid_wavelength);
            }
            for LitLayer { layer, colors, filter, live } in &lit_below {
                let part = direct_light(&lamp, &layer.finish, colors, hit, irid_wavelength);
                sum += Vec3::select(*live, part.mul(*filter), Vec3::lit(0.0));
            }
            queue_light(&lamp, sum, number, hit, emit);
        }
    }
    let top = top.map(|layer| &layer.finish);
    let inside_out = transmit(scene, hit, active, top, &crossings, (filter, transmitted), emit);
    for mirror in mirrors.iter() {
        reflect(scene, hit, mirror, inside_out, emit);
    }
}

/// What happens to each ray's list of interiors (see [`Crossing`]).
struct Crossings<L> {
    next: [u32; LANES],
    eta: L,
    leaves: u8,
    fresnel_ior: L,
}

impl<L: Lane> Crossings<L> {
    /// Of the hits, if their program can see it at all.
    fn of<S: Scalar<Lane = L>, B: Scalar>(
        scene: &Compiled<S, B>,
        program: &Program,
        hit: &Hit<L>,
        media: &mut Media,
    ) -> Self {
        let one = L::lit(1.0);
        let mut crossings = Self { next: [0; LANES], eta: one, leaves: 0, fresnel_ior: one };
        let opaque =
            each_number(&hit.texture, |t| scene.textures.textures[t as usize].opaque) == [true; LANES];
        if opaque && !program.layers.iter().any(|layer| layer.finish.reflection.fresnel) {
            return crossings;
        }
        let mut waiting = hit.active;
        // Neighbours are mostly in the same case.
        while waiting != 0 {
            let first = waiting.trailing_zeros() as usize & (LANES - 1);
            let (medium, interior) = (hit.medium[first], hit.interior[first]);
            let same = equal_lanes(&hit.medium, medium) & equal_lanes(&hit.interior, interior);
            waiting &= !same;
            let Crossing { next, eta, leaves, fresnel_ior } = media.cross(medium, interior, &scene.interiors);
            let mask = Mask::from_bits(same);
            crossings.next = choose(same, &[next; LANES], &crossings.next);
            crossings.eta = mask.select(L::lit(eta), crossings.eta);
            crossings.leaves |= if leaves { same } else { 0 };
            crossings.fresnel_ior = mask.select(L::lit(fresnel_ior), crossings.fresnel_ior);
        }
        crossings
    }
}

/// Mostly one of something, at times more.
struct Few<T> {
    first: Option<T>,
    more: Vec<T>,
}

impl<T> Few<T> {
    fn new() -> Self {
        Self { first: None, more: Vec::new() }
    }

    #[inline(always)]
    fn push(&mut self, one: T) {
        if self.first.is_none() {
            self.first = Some(one);
        } else {
            self.more.push(one);
        }
    }

    #[inline(always)]
    fn iter(&self) -> impl Iterator<Item = &T> {
        self.first.iter().chain(&self.more)
    }
}

/// A light as the hits see it.
#[derive(Default)]
struct Lamp<L: Lane> {
    shadowless: bool,
    /// Unit directions to the light, and how far away it is along them.
    dir: Vec3<L>,
    distance: L,
    /// What arrives if nothing is in the way.
    light: Vec3<L>,
    /// Cosine between normal and light.
    cos: L,
    /// Bright enough and before the surface, or behind it.
    front: Mask<L>,
    back: Mask<L>,
    /// Lanes that nothing keeps its light from.
    free: u8,
}

impl<L: Lane> Lamp<L> {
    /// Becomes `light`; false if none of that can go to the eye. (In place: a lamp is large.)
    #[inline(always)]
    fn shine(
        &mut self,
        light: &LightProgram,
        hit: &Hit<L>,
        active: Mask<L>,
        from_behind: bool,
        answered: &mut u64,
    ) -> bool {
        let (dir, distance) = light.towards(hit.point);
        let cos = hit.normal.dot(dir);
        let front = (cos.ge(L::lit(ALONG_SURFACE)) | Mask::from_bits(hit.double_illuminate)) & active;
        if front.none() && !from_behind {
            return false;
        }
        self.light = light.at(hit.point, dir, distance);
        let mut bright = self.light.abs().max_element().ge(L::lit(NO_LIGHT)) & active;
        self.free = if light.shadowless { !0 } else { 0 };
        if let Some(buffer) = &light.buffer {
            // What is lit from both sides may stand in its own light.
            let lanes = (bright & front).bits() & !hit.double_illuminate;
            let known = buffer.look(hit.point, &hit.surface, hit.outside, lanes);
            *answered += u64::from((known.free | known.blocked).count_ones());
            bright &= !Mask::from_bits(known.blocked);
            self.free = known.free;
        }
        self.shadowless = light.shadowless;
        (self.dir, self.distance, self.cos) = (dir, distance, cos);
        (self.front, self.back) = (bright & front, bright & !front);
        bright.any()
    }
}

/// POV-Ray's least cosine of light that still falls on the front.
const ALONG_SURFACE: f64 = 1e-10;

fn answers_light(finish: &Finish) -> bool {
    finish.diffuse != 0.0 || finish.diffuse_back != 0.0 || finish.phong != 0.0 || finish.specular != 0.0
}

/// The cosine at which POV-Ray leaves out highlights of a large exponent, which makes them invisible there.
const FAINT_PHONG: f64 = 0.0008;

/// What the light of one lamp is multiplied by on its way to the eye, if nothing is in the lamp's way.
#[inline]
fn direct_light<L: Lane>(
    lamp: &Lamp<L>,
    finish: &Finish,
    colors: &Colors<L>,
    hit: &Hit<L>,
    irid_wavelength: Rgb,
) -> Vec3<L> {
    let none = Vec3::lit(0.0);
    let opacity = colors.opacity();
    let &Lamp { dir, cos, front: lit, .. } = lamp;
    let back = if finish.diffuse_back != 0.0 { lamp.back } else { Mask::none_set() };
    if !(lit | back).any() {
        return none;
    }

    let amount = lit.select(L::lit(finish.diffuse), back.keep(L::lit(finish.diffuse_back)));
    let slope = if finish.brilliance == 1.0 { cos.abs() } else { cos.abs().pow_const(finish.brilliance) };
    let mut sum = colors.rgb * (slope * amount * opacity);

    if (finish.phong > 0.0 || finish.specular > 0.0) && !lamp.shadowless {
        let mut highlight = L::zero();
        if finish.phong > 0.0 {
            let mirrored = hit.dir + hit.normal * (hit.cos * L::lit(2.0));
            let c = mirrored.dot(dir);
            let least = if finish.phong_size >= 60.0 { FAINT_PHONG } else { 0.0 };
            let seen = c.gt(L::lit(least)) & lit;
            if seen.any() {
                highlight += seen.keep(c.max(L::zero()).pow_const(finish.phong_size) * L::lit(finish.phong));
            }
        }
        if finish.specular > 0.0 {
            let half = dir - hit.dir;
            let length = half.length();
            let c = half.dot(hit.normal) / length;
            let seen = length.gt(L::zero()) & c.gt(L::zero()) & lit;
            if seen.any() {
                let c = seen.keep(c);
                highlight += seen.keep(c.pow_const(1.0 / finish.roughness) * L::lit(finish.specular));
            }
        }
        let highlight = lit.keep(highlight);
        sum += match finish.metallic {
            0.0 => Vec3::new(highlight, highlight, highlight),
            metallic => metal(cos, colors, metallic) * highlight,
        };
    }
    if finish.irid != 0.0 {
        let path = cos.abs() + hit.cos;
        sum = sum.mul(interference(finish, path, irid_wavelength));
    }
    let sum = sum.mul(lamp.light);
    Vec3::select(lit | back, sum, none).map(|c| {
        // A NaN would spoil its pixel for good.
        c.equal(c).keep(c)
    })
}

/// POV-Ray's tint of metallic highlights and reflections at the angle whose cosine is `cos`: white at grazing angles.
fn metal<L: Lane>(cos: L, colors: &Colors<L>, metallic: f64) -> Vec3<L> {
    let one = L::lit(1.0);
    let cos = cos.min(one).max(-one);
    let x = cos.acos().abs() / L::lit(std::f64::consts::FRAC_PI_2);
    let d = x - L::lit(1.12);
    let f = (L::lit(0.014567225) / (d * d) - L::lit(0.011612903)).min(one).max(L::zero());
    let share = (one - f) * L::lit(metallic);
    colors.rgb.map(|c| one + share * (c - one))
}

/// Thin-film interference over a path of `cos` towards the light plus `cos` towards the eye.
fn interference<L: Lane>(finish: &Finish, path: L, wavelength: Rgb) -> Vec3<L> {
    let phase = path * L::lit(std::f64::consts::TAU * finish.irid_thickness);
    let channel = |w: f64| L::lit(1.0) + (phase / L::lit(w)).sin_cos().1 * L::lit(finish.irid);
    Vec3::new(channel(wavelength.x), channel(wavelength.y), channel(wavelength.z))
}

/// How much of what a mirror ray sees comes back, and the weight of that ray.
fn reflect_share<'a, L: Lane>(
    finish: &'a Finish,
    colors: &Colors<L>,
    hit: &Hit<L>,
    crossings: &Crossings<L>,
    transmitted: L,
    live: Mask<L>,
) -> Mirror<'a, L> {
    let reflection = &finish.reflection;
    let (min, max) = (Vec3::splat(reflection.min), Vec3::splat(reflection.max));
    let one = L::lit(1.0);
    let weight = hit.weight * transmitted;
    let between = |share: L| max * share + min * (one - share);
    let (mut factor, weight) = if reflection.fresnel {
        let f = fresnel(hit.cos, crossings.fresnel_ior);
        let factor = between(f);
        (factor, weight * factor.max_element())
    } else {
        let share = (one - hit.cos).max(L::zero());
        let share = if reflection.falloff == 1.0 { share } else { share.pow_const(reflection.falloff) };
        let most = reflection.max.max_element().max(reflection.min.max_element());
        (between(share), weight * L::lit(most))
    };
    if reflection.metallic != 0.0 {
        factor = factor.mul(metal(hit.cos, colors, reflection.metallic));
    }
    Mirror { lanes: live, factor: Vec3::select(live, factor, Vec3::lit(0.0)), weight, finish: reflection }
}

/// Fresnel's reflectance of unpolarised light for a surface of relative index `ior` (Cook and Torrance 1982, A
/// reflectance model for computer graphics, section on Fresnel); 1 beyond the critical angle.
fn fresnel<L: Lane>(cos: L, ior: L) -> L {
    let one = L::lit(1.0);
    let square = ior * ior + cos * cos - one;
    let g = square.max(L::zero()).sqrt();
    let (minus, plus) = (g - cos, g + cos);
    let a = minus / plus;
    let b = (cos * plus - one) / (cos * minus + one);
    let f = (a * a * (one + b * b) * L::lit(0.5)).min(one).max(L::zero());
    square.gt(L::zero()).select(f, one)
}

/// How near a light is as good as on a surface, in roundings of the coordinates involved: a few each for the point, the
/// way to the light and the crossing.
const LIGHT_ROUNDINGS: f64 = 32.0;

/// Sends shadow rays for the light `sum` that could arrive from lamp `number`.
#[inline]
fn queue_light<L: Lane>(lamp: &Lamp<L>, sum: Vec3<L>, number: usize, hit: &Hit<L>, emit: &mut Emit<L>) {
    let lanes = sum.abs().max_element().gt(L::lit(NO_LIGHT)).bits() & hit.active;
    if lanes == 0 {
        return;
    }
    let light = sum.mul(hit.throughput);
    let free = lanes & lamp.free;
    if free != 0 {
        emit.sums.add(&hit.sink, light, free);
    }
    let lanes = lanes & !free;
    if lanes == 0 {
        return;
    }
    let queue = &mut emit.shadows[number];
    let feelers = queue.next();
    hit.leave(lamp.dir, &mut feelers.lines);
    // A light that lies on a surface is not behind it.
    let distance = lamp.distance;
    let reach = hit.point.abs().max_element() + distance.abs();
    feelers.t_max = distance - reach * L::lit(LIGHT_ROUNDINGS * L::Scalar::UNIT_ROUNDOFF);
    feelers.light = light;
    feelers.sink = hit.sink;
    feelers.medium = hit.medium;
    feelers.lanes = lanes;
    queue.push();
}

/// POV-Ray's bound for a surface that bends nothing: a ratio of indices this near to 1.
const UNBENT: f64 = 1e-10;

/// Sends light through the surface: straight on, refracted, or back by total internal reflection. Returns the lanes
/// of the last kind, which the film of the `top` layer tints.
fn transmit<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    hit: &Hit<S::Lane>,
    active: Mask<S::Lane>,
    top: Option<&Finish>,
    crossings: &Crossings<S::Lane>,
    (filter, transmitted): (Vec3<S::Lane>, S::Lane),
    emit: &mut Emit<S::Lane>,
) -> Mask<S::Lane> {
    let zero = S::Lane::zero();
    let one = S::Lane::lit(1.0);
    let through = transmitted.gt(S::Lane::lit(scene.globals.adc_bailout)) & active;
    if through.none() {
        return Mask::none_set();
    }
    let weight = hit.weight * filter.abs().max_element();
    let deep = depth_left(scene, hit);
    let seen = through & deep & weight.ge(S::Lane::lit(scene.globals.adc_bailout));

    let fade = fade_along(scene, hit, crossings);
    let eta = crossings.eta;
    let straight = (eta - one).abs().lt(S::Lane::lit(UNBENT));
    let k = one + eta * eta * (hit.cos * hit.cos - one);
    let back = through & !straight & k.lt(zero);
    let bent = hit.dir * eta + hit.normal * (eta * hit.cos - k.max(zero).sqrt());
    let dir = Vec3::select(straight, hit.dir, bent.normalize());

    let level = |same: u8| -> [u16; LANES] { each_lane(|k| hit.level[k] + u16::from(same >> k & 1 == 0)) };
    let inner = hit.throughput.mul(fade);
    let lanes = (seen & !back).bits();
    if lanes != 0 {
        let bent = emit.refracted.next();
        hit.leave(dir, &mut bent.lines);
        bent.throughput = inner.mul(filter);
        bent.weight = weight;
        bent.share = hit.share * grey(fade) * transmitted;
        bent.sink = hit.sink;
        bent.level = level(straight.bits());
        bent.medium = crossings.next;
        bent.lanes = lanes;
        emit.refracted.push();
    }
    let lanes = (seen & back).bits();
    if lanes != 0 {
        let mirrored = emit.reflected.next();
        hit.leave((hit.dir + hit.normal * (hit.cos * S::Lane::lit(2.0))).normalize(), &mut mirrored.lines);
        mirrored.throughput = match top {
            Some(finish) if finish.irid != 0.0 => {
                let path = hit.cos * S::Lane::lit(2.0);
                inner.mul(interference(finish, path, scene.globals.irid_wavelength))
            }
            _ => inner,
        };
        mirrored.weight = weight;
        mirrored.share = zero;
        mirrored.sink = hit.sink;
        mirrored.level = level(0);
        mirrored.medium = hit.medium;
        mirrored.lanes = lanes;
        emit.reflected.push();
    }
    back
}

/// Lanes whose next ray may still be traced.
fn depth_left<S: Scalar, B: Scalar>(scene: &Compiled<S, B>, hit: &Hit<S::Lane>) -> Mask<S::Lane> {
    let may = |level: u16| u32::from(level) < scene.globals.max_trace_level;
    if hit.level == [hit.level[0]; LANES] {
        return if may(hit.level[0]) { Mask::all_set() } else { Mask::none_set() };
    }
    let mut bits = 0;
    for (k, &level) in hit.level.iter().enumerate() {
        bits |= u8::from(may(level)) << k;
    }
    Mask::from_bits(bits)
}

/// What the interior that is left has taken of the light on the way through it.
fn fade_along<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    hit: &Hit<S::Lane>,
    crossings: &Crossings<S::Lane>,
) -> Vec3<S::Lane> {
    if !scene.fades {
        return Vec3::lit(1.0);
    }
    let mut fade = [Rgb::ONE; LANES];
    let distance = hit.distance.to_array();
    for (k, fade) in fade.iter_mut().enumerate() {
        if crossings.leaves >> k & 1 == 1 {
            *fade = fade_over(&scene.interiors[hit.interior[k] as usize], distance[k].to_f64());
        }
    }
    Vec3::from_fn(|k| fade[k])
}

/// Share of light left after `distance` in `interior` (manual section 3.4.6.5.4).
pub fn fade_over(interior: &Interior, distance: f64) -> Rgb {
    if interior.fade_distance == 0.0 {
        return Rgb::ONE;
    }
    let depth = distance / interior.fade_distance;
    if interior.fade_power >= 1000.0 {
        return ((interior.fade_color - Rgb::ONE) * depth).exp();
    }
    interior.fade_color + (Rgb::ONE - interior.fade_color) / (1.0 + depth.powf(interior.fade_power))
}

/// Sends mirror rays.
fn reflect<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    hit: &Hit<S::Lane>,
    mirror: &Mirror<S::Lane>,
    inside_out: Mask<S::Lane>,
    emit: &mut Emit<S::Lane>,
) {
    let some = mirror.factor.abs().max_element().gt(S::Lane::zero());
    let heavy = mirror.weight.ge(S::Lane::lit(scene.globals.adc_bailout));
    let lanes = (mirror.lanes & some & heavy & depth_left(scene, hit) & !inside_out).bits();
    if lanes == 0 {
        return;
    }
    let dir = (hit.dir + hit.normal * (hit.cos * S::Lane::lit(2.0))).normalize();
    let mirrored = emit.reflected.next();
    hit.leave(dir, &mut mirrored.lines);
    mirrored.throughput = hit.throughput.mul(mirror.factor);
    mirrored.weight = mirror.weight;
    mirrored.share = S::Lane::zero();
    mirrored.sink = hit.sink;
    mirrored.level = each_lane(|k| hit.level[k] + 1);
    mirrored.medium = hit.medium;
    mirrored.lanes = lanes;
    if mirror.finish.exponent != 1.0 {
        // What is seen is bent by a power before it is added: it needs a sum of its own.
        let exponent = 1.0 / mirror.finish.exponent;
        mirrored.sink = emit.sums.defer(&hit.sink, mirrored.throughput, exponent, lanes);
        mirrored.throughput = Vec3::lit(1.0);
    }
    emit.reflected.push();
}
