//! Rays that go on from eight hits: mirrored, refracted, straight on, and back by total internal reflection
//! (formulas as measured on POV-Ray 3.7: manual sections 3.4.6.3 finish, 3.4.6.5 interior).

use super::emit::Emit;
use super::finish::{fresnel, interference, metal};
use super::hit_list::Sender;
use super::hits::Hit;
use super::light::grey;
use super::medium::{Crossing, Media, fade_over};
use crate::compile::Compiled;
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3, choose, each_lane, each_number, equal_lanes, f32x8};
use crate::scene::{Finish, Rgb};
use crate::texture::{Colors, Program};

/// A mirror ray that a layer asks for.
#[derive(Debug)]
pub struct Mirror<L> {
    lanes: Mask<f32x8>,
    /// What comes back of what it sees.
    pub factor: Vec3<f32x8>,
    weight: L,
    /// See [`Reflection::exponent`](crate::scene::Reflection::exponent).
    exponent: f64,
}

/// What happens to each ray's list of interiors (see [`Crossing`]).
#[derive(Debug, Default)]
pub struct Crossings<L> {
    next: [u32; LANES],
    eta: L,
    leaves: u8,
    fresnel_ior: L,
}

impl<L: Lane> Crossings<L> {
    /// Of the hits, if their program can see it at all.
    pub fn of<S: Scalar<Lane = L>, B: Scalar>(
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

/// How much of what a mirror ray sees comes back, and the weight of that ray.
pub fn reflect_share<L: Lane>(
    finish: &Finish,
    colors: &Colors,
    hit: &Hit<L>,
    crossings: &Crossings<L>,
    transmitted: f32x8,
    live: Mask<f32x8>,
) -> Mirror<L> {
    let reflection = &finish.reflection;
    let (min, max) = (Vec3::splat(reflection.min), Vec3::splat(reflection.max));
    let one = L::lit(1.0);
    let weight = hit.weight * transmitted.cast();
    let between = |share: f32x8| max * share + min * (f32x8::lit(1.0) - share);
    let (mut factor, weight) = if reflection.fresnel {
        let factor = between(fresnel(hit.cos, crossings.fresnel_ior).cast());
        (factor, weight * factor.max_element().cast())
    } else {
        let share = (one - hit.cos).max(L::zero());
        let falloff = reflection.falloff;
        let share = if falloff == 1.0 { share.in_register() } else { share.pow_const(falloff) };
        let most = reflection.max.max_element().max(reflection.min.max_element());
        (between(share.cast()), weight * L::lit(most))
    };
    if reflection.metallic != 0.0 {
        factor = factor.mul(metal(hit.cos, colors, reflection.metallic));
    }
    let factor = Vec3::select(live, factor, Vec3::lit(0.0));
    Mirror { lanes: live, factor, weight, exponent: reflection.exponent }
}

/// POV-Ray's bound for a surface that bends nothing: a ratio of indices this near to 1.
const UNBENT: f64 = 1e-10;

/// Sends light through the surface, in the lanes `through`: straight on, refracted, or back by total internal reflection. Returns
/// the lanes of the last kind, which the film of the `top` layer tints.
#[inline(never)] // Inlined, it takes the registers of shading.
pub fn transmit<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    hit: &Hit<S::Lane>,
    (top, through): (Option<&Finish>, u8),
    crossings: &Crossings<S::Lane>,
    (filter, transmitted): (Vec3<f32x8>, f32x8),
    (emit, sender): (&mut Emit<S::Lane>, Sender),
) -> u8 {
    let zero = S::Lane::zero();
    let one = S::Lane::lit(1.0);
    let adc_bailout = scene.globals.adc_bailout;
    let weight = hit.weight * filter.abs().max_element().cast();
    let seen = through & depth_left(scene, hit) & weight.ge(S::Lane::lit(adc_bailout)).bits();

    let fade = fade_along(scene, hit, crossings);
    let eta = crossings.eta;
    let straight = (eta - one).abs().lt(S::Lane::lit(UNBENT));
    let k = one + eta * eta * (hit.cos * hit.cos - one);
    let back = (!straight & k.lt(zero)).bits() & through;
    let bent = hit.dir * eta + hit.normal * (eta * hit.cos - k.max(zero).sqrt());
    let dir = Vec3::select(straight, hit.dir, bent.normalize());

    let level = |same: u8| -> [u16; LANES] { each_lane(|k| hit.level[k] + u16::from(same >> k & 1 == 0)) };
    let inner = hit.throughput.mul(fade);
    let lanes = seen & !back;
    if lanes != 0 {
        let refracted = &mut emit.refracted[sender as usize];
        let bent = refracted.next();
        hit.leave(&dir, &mut bent.lines);
        bent.throughput = inner.mul(filter);
        bent.weight = weight;
        bent.share = hit.share * grey(fade) * transmitted;
        bent.sink = hit.sink;
        bent.level = level(straight.bits());
        bent.medium = crossings.next;
        bent.lanes = lanes;
        refracted.push();
    }
    let lanes = seen & back;
    if lanes != 0 {
        let mirrored = emit.reflected.next();
        hit.leave(&hit.mirrored().normalize(), &mut mirrored.lines);
        mirrored.throughput = match top {
            Some(finish) if finish.irid != 0.0 => {
                let path = hit.cos * S::Lane::lit(2.0);
                inner.mul(interference(finish, path, scene.globals.irid_wavelength))
            }
            _ => inner,
        };
        mirrored.weight = weight;
        mirrored.share = f32x8::zero();
        mirrored.sink = hit.sink;
        mirrored.level = level(0);
        mirrored.medium = hit.medium;
        mirrored.lanes = lanes;
        emit.reflected.push();
    }
    back
}

/// Lanes whose next ray may still be traced.
fn depth_left<S: Scalar, B: Scalar>(scene: &Compiled<S, B>, hit: &Hit<S::Lane>) -> u8 {
    let may = |level: u16| u32::from(level) < scene.globals.max_trace_level;
    if hit.level == [hit.level[0]; LANES] {
        return if may(hit.level[0]) { !0 } else { 0 };
    }
    let mut bits = 0;
    for (k, &level) in hit.level.iter().enumerate() {
        bits |= u8::from(may(level)) << k;
    }
    bits
}

/// What the interior that is left has taken of the light on the way through it.
fn fade_along<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    hit: &Hit<S::Lane>,
    crossings: &Crossings<S::Lane>,
) -> Vec3<f32x8> {
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

/// Sends mirror rays.
#[inline(never)] // See [`transmit`].
pub fn reflect<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    hit: &Hit<S::Lane>,
    mirror: &Mirror<S::Lane>,
    inside_out: u8,
    emit: &mut Emit<S::Lane>,
) {
    let some = (mirror.lanes & mirror.factor.abs().max_element().gt(f32x8::zero())).bits();
    let heavy = mirror.weight.ge(S::Lane::lit(scene.globals.adc_bailout)).bits();
    let lanes = some & heavy & depth_left(scene, hit) & !inside_out;
    if lanes == 0 {
        return;
    }
    let mirrored = emit.reflected.next();
    hit.leave(&hit.mirrored().normalize(), &mut mirrored.lines);
    mirrored.throughput = hit.throughput.mul(mirror.factor);
    mirrored.weight = mirror.weight;
    mirrored.share = f32x8::zero();
    mirrored.sink = hit.sink;
    mirrored.level = each_lane(|k| hit.level[k] + 1);
    mirrored.medium = hit.medium;
    mirrored.lanes = lanes;
    if mirror.exponent != 1.0 {
        // What is seen is bent by a power before it is added: it needs a sum of its own.
        let exponent = 1.0 / mirror.exponent;
        mirrored.sink = emit.sums.defer(&hit.sink, mirrored.throughput, exponent, lanes);
        mirrored.throughput = Vec3::lit(1.0);
    }
    emit.reflected.push();
}
