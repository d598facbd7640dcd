//! Light at eight hits that share a texture program: local light into the sums, new rays into the queues.

use super::emit::Emit;
use super::finish::{answers_light, interference};
use super::hits::Hit;
use super::lamp::{Ahead, Lamp, direct_light, queue_light};
use super::light::{LightProgram, grey};
use super::onward::{Crossings, reflect, reflect_share, transmit};
use crate::compile::Compiled;
use crate::lane::{Lane, Mask, Scalar, Vec3, f32x8, f64x8};
use crate::texture::{Colors, LayerProgram};
use smallvec::SmallVec;

/// A texture with more layers under its top one allocates for each packet.
const LOWER_LAYERS: usize = 3;

/// A layer under others, as light meets it.
struct LitLayer<'a> {
    layer: &'a LayerProgram,
    colors: Colors,
    /// Of those, by the scene's rule.
    opacity: f32x8,
    /// What the layers above let through, and where anything is left of it.
    filter: Vec3<f32x8>,
    live: Mask<f32x8>,
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
    // While the first light's places in memory are fetched, layers are painted; while the next one's are, a light shines.
    let mut ahead = [Ahead::default(), Ahead::default()];
    if let (Some(light), true) = (lights.first(), program.layers.iter().any(|l| answers_light(&l.finish))) {
        ahead[0].look(light, hit);
    }
    let crossings = Crossings::of(scene, program, hit, emit.media);
    let adc = f32x8::lit(scene.globals.adc_bailout);
    let one = f32x8::lit(1.0);

    let mut live = Mask::<f32x8>::from_bits(hit.active);
    // In double precision, or it would matter whether a lamp's light is added here or when its shadow rays are through.
    let mut local = Vec3::<f64x8>::lit(0.0);
    let mut filter = Vec3::lit(1.0);
    let mut transmitted = one;
    // Most textures have one layer, which nothing lies over.
    let (mut top_lit, mut lit_below) = (false, SmallVec::<[LitLayer; LOWER_LAYERS]>::new());
    let (mut top_colors, mut below) = (Colors::default(), Colors::default());
    let mut top_opacity = one;
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
        let opacity = colors.opacity(layer.opacity);
        let lit = (colors.rgb.mul(own) * opacity).mul(filter);
        local += Vec3::select(live, lit.mul(hit.throughput), Vec3::lit(0.0)).cast();
        if answers_light(finish) && number == 0 {
            (top_lit, top_opacity) = (true, opacity);
        } else if answers_light(finish) {
            lit_below.push(LitLayer { layer, colors: *colors, opacity, filter, live });
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
                    film = film.map(|f| f.max(f32x8::zero()).pow_const(power));
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

    let top = program.layers.first();
    if top_lit || !lit_below.is_empty() {
        let from_behind = program.layers.iter().any(|layer| layer.finish.diffuse_back != 0.0);
        let irid_wavelength = scene.globals.irid_wavelength;
        let mut lamp = Lamp::default();
        for (number, light) in lights.iter().enumerate() {
            if let Some(next) = lights.get(number + 1) {
                ahead[(number + 1) % 2].look(next, hit);
            }
            let (ahead, answered) = (&mut ahead[number % 2], &mut emit.counts.answered);
            if !lamp.shine(scene, (light, ahead), hit, from_behind, answered) {
                continue;
            }
            let mut sum = Vec3::lit(0.0);
            if let (Some(layer), true) = (top, top_lit) {
                sum = direct_light(&lamp, layer, &top_colors, top_opacity, hit, irid_wavelength);
            }
            for LitLayer { layer, colors, opacity, filter, live } in &lit_below {
                let part = direct_light(&lamp, layer, colors, *opacity, hit, irid_wavelength);
                sum += Vec3::select(*live, part.mul(*filter), Vec3::lit(0.0));
            }
            queue_light(&lamp, sum, number, hit, (emit, &mut local));
        }
    }
    emit.sums.add(&hit.sink, local, hit.active);
    let top = top.map(|layer| &layer.finish);
    let through = transmitted.gt(adc).bits() & hit.active;
    let inside_out = match through {
        0 => 0,
        _ => transmit(scene, hit, (top, through), &crossings, (filter, transmitted), emit),
    };
    for mirror in mirrors.iter() {
        reflect(scene, hit, mirror, inside_out, emit);
    }
}

/// Mostly one of something, at times more.
struct Few<T> {
    first: Option<T>,
    more: SmallVec<[T; LOWER_LAYERS]>,
}

impl<T> Few<T> {
    fn new() -> Self {
        Self { first: None, more: SmallVec::new() }
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
