//! Light at hits, eight to a packet: local light into the sums, new rays into the queues.
//!
//! In three steps, each of which is taken for several packets before the next is: what is seen of their surfaces, what lamps send, what goes
//! on. All of it is thirty kilobytes of code, and a core's first-level cache holds 32, or half of that while somebody else's
//! thread runs on the core.

use super::emit::Emit;
use super::finish::{answers_light, interference};
use super::hit_list::Found;
use super::hits::Hit;
use super::lamp::{Ahead, Lamp, direct_light, queue_light};
use super::light::{LightProgram, grey};
use super::medium::Media;
use super::onward::{Crossings, Mirror, reflect, reflect_share, transmit};
use crate::compile::Compiled;
use crate::lane::{Lane, Mask, Scalar, Vec3, f32x8, f64x8};
use crate::texture::{Colors, Program};

/// A layer under others, as light meets it.
#[derive(Debug)]
struct LitLayer {
    /// Which of its program's it is.
    layer: usize,
    colors: Colors,
    /// Of those, by the scene's rule.
    opacity: f32x8,
    /// What the layers above let through, and where anything is left of it.
    filter: Vec3<f32x8>,
    live: Mask<f32x8>,
}

/// What has been found of eight hits, one step after the other.
#[derive(Debug, Default)]
pub struct Shading<L: Lane> {
    /// What goes to the eye from here. (In double precision, or it would matter whether a lamp's light is added here or when its
    /// shadow rays are through.)
    local: Vec3<f64x8>,
    /// What all layers let through, and how much that is.
    filter: Vec3<f32x8>,
    transmitted: f32x8,
    crossings: Crossings<L>,
    /// Of the top layer. (Most textures have one, which nothing lies over.)
    colors: Colors,
    opacity: f32x8,
    /// The top layer answers light.
    top_lit: bool,
    /// Layers under it that do.
    below: Vec<LitLayer>,
    /// Some layer answers light from behind.
    from_behind: bool,
    mirrors: Vec<Mirror<L>>,
}

/// Shades packets of hits, with room for what is found of them.
pub fn shade<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    lights: &[LightProgram],
    hits: &[Found<S::Lane>],
    shadings: &mut Vec<Shading<S::Lane>>,
    emit: &mut Emit<S::Lane>,
) {
    if hits.is_empty() {
        return;
    }
    if shadings.len() < hits.len() {
        shadings.resize_with(hits.len(), Shading::default);
    }
    let shadings = &mut shadings[..hits.len()];
    for (Found { hit, program, .. }, shading) in hits.iter().zip(&mut *shadings) {
        emit.counts.shaded += 1;
        emit.counts.hits += u64::from(hit.active.count_ones());
        paint(scene, hit, &scene.textures.programs[*program as usize], shading, emit.media);
    }
    for (number, light) in lights.iter().enumerate() {
        illuminate(scene, (number, light), hits, shadings, emit);
    }
    for (found, shading) in hits.iter().zip(shadings) {
        go_on(scene, found, shading, emit);
    }
}

/// The look of surfaces, layer by layer: what light falls on, and what goes through and comes back.
#[inline(never)]
fn paint<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    hit: &Hit<S::Lane>,
    program: &Program,
    shading: &mut Shading<S::Lane>,
    media: &mut Media,
) {
    shading.crossings = Crossings::of(scene, program, hit, media);
    shading.top_lit = false;
    shading.below.clear();
    shading.mirrors.clear();
    shading.from_behind = program.layers.iter().any(|layer| layer.finish.diffuse_back != 0.0);
    let adc = f32x8::lit(scene.globals.adc_bailout);
    let one = f32x8::lit(1.0);

    let mut live = Mask::<f32x8>::from_bits(hit.active);
    let mut local = Vec3::<f64x8>::lit(0.0);
    let mut filter = Vec3::lit(1.0);
    let mut transmitted = one;
    let mut below = Colors::default();
    for (number, layer) in program.layers.iter().enumerate() {
        live &= transmitted.gt(adc);
        if live.none() {
            break;
        }
        let finish = &layer.finish;
        let colors = if number == 0 { &mut shading.colors } else { &mut below };
        layer.paint(&scene.textures, &hit.texture, number, hit.point, colors);
        let own = Vec3::splat(finish.ambient * scene.globals.ambient_light + finish.emission);
        let opacity = colors.opacity(layer.opacity);
        let lit = (colors.rgb.mul(own) * opacity).mul(filter);
        local += Vec3::select(live, lit.mul(hit.throughput), Vec3::lit(0.0)).cast();
        if answers_light(finish) && number == 0 {
            (shading.top_lit, shading.opacity) = (true, opacity);
        } else if answers_light(finish) {
            shading.below.push(LitLayer { layer: number, colors: *colors, opacity, filter, live });
        }

        let mut reflectivity = None;
        if finish.reflection.is_some() {
            let mut mirror = reflect_share(finish, colors, hit, &shading.crossings, transmitted, live);
            // What is conserved is counted without the film's interference.
            reflectivity = Some(mirror.factor);
            if finish.irid != 0.0 {
                let path = hit.cos * S::Lane::lit(2.0);
                let mut film = interference(finish, path, scene.globals.irid_wavelength);
                // The film is on what is seen, which the exponent then bends.
                if finish.reflection.exponent != 1.0 {
                    let power = 1.0 / finish.reflection.exponent;
                    film = film.map(|f| f.max(f32x8::zero()).pow_const(power));
                }
                mirror.factor = mirror.factor.mul(film);
            }
            shading.mirrors.push(mirror);
        }
        let mut through = colors.transmittance();
        if let (true, Some(r)) = (finish.conserve_energy, reflectivity) {
            through = through.mul(r.map(|r| (one - r).min(one)));
        }
        filter = Vec3::select(live, filter.mul(through), filter);
        transmitted = live.select(grey(filter).abs().min(one), transmitted);
    }
    (shading.local, shading.filter, shading.transmitted) = (local, filter, transmitted);
}

/// What a lamp sends to the eye by hits.
#[inline(never)]
fn illuminate<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    (number, light): (usize, &LightProgram),
    hits: &[Found<S::Lane>],
    shadings: &mut [Shading<S::Lane>],
    emit: &mut Emit<S::Lane>,
) {
    let irid_wavelength = scene.globals.irid_wavelength;
    // While one packet's places in memory are fetched, the light shines on the one before.
    let mut ahead = [Ahead::default(), Ahead::default()];
    let mut lamp = Lamp::default();
    let lit = |shading: &Shading<S::Lane>| shading.top_lit || !shading.below.is_empty();
    if lit(&shadings[0]) {
        ahead[0].look(light, &hits[0].hit);
    }
    for k in 0..hits.len() {
        if let Some(next) = hits.get(k + 1)
            && lit(&shadings[k + 1])
        {
            ahead[(k + 1) % 2].look(light, &next.hit);
        }
        let (Found { hit, program, .. }, shading) = (&hits[k], &mut shadings[k]);
        let (ahead, answered) = (&mut ahead[k % 2], &mut emit.counts.answered);
        if !lit(shading) || !lamp.shine(scene, (light, ahead), hit, shading.from_behind, answered) {
            continue;
        }
        let layers = &scene.textures.programs[*program as usize].layers;
        let mut sum = Vec3::lit(0.0);
        if let (Some(layer), true) = (layers.first(), shading.top_lit) {
            sum = direct_light(&lamp, layer, &shading.colors, shading.opacity, hit, irid_wavelength);
        }
        for LitLayer { layer, colors, opacity, filter, live } in &shading.below {
            let part = direct_light(&lamp, &layers[*layer], colors, *opacity, hit, irid_wavelength);
            sum += Vec3::select(*live, part.mul(*filter), Vec3::lit(0.0));
        }
        queue_light(&lamp, sum, number, hit, (emit, &mut shading.local));
    }
}

/// Adds up what has come together, and sends rays on.
#[inline(never)]
fn go_on<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    Found { hit, program, sender }: &Found<S::Lane>,
    shading: &Shading<S::Lane>,
    emit: &mut Emit<S::Lane>,
) {
    emit.sums.add(&hit.sink, shading.local, hit.active);
    let through = shading.transmitted.gt(f32x8::lit(scene.globals.adc_bailout)).bits() & hit.active;
    let inside_out = match through {
        0 => 0,
        _ => {
            let top = scene.textures.programs[*program as usize].layers.first();
            let top = (top.map(|layer| &layer.finish), through);
            let passed = (shading.filter, shading.transmitted);
            transmit(scene, hit, top, &shading.crossings, passed, (emit, *sender))
        }
    };
    for mirror in &shading.mirrors {
        reflect(scene, hit, mirror, inside_out, emit);
    }
}
