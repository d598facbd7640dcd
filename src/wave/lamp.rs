//! One light at eight hits: what of it goes to the eye, and the shadow rays that decide whether it does
//! (formulas as measured on POV-Ray 3.7: manual section 3.4.6.3).

use super::emit::{Emit, NO_LIGHT};
use super::finish::{interference, metal};
use super::hits::Hit;
use super::leaving::left_behind;
use super::light::LightProgram;
use super::light_buffer::{Around, Cones, Known, LightBuffer, Openings, Places};
use super::query::Query;
use super::queue::Lines;
use crate::compile::{Compiled, Geometry};
use crate::lane::{Lane, Mask, Scalar, Vec3, f32x8, f64x8};
use crate::scene::Rgb;
use crate::texture::{Colors, LayerProgram};

/// Where eight hits lie in a light's buffer: found before the light's turn comes, as the memory takes its time to hand over what
/// stands there.
#[derive(Default)]
pub struct Ahead {
    /// Lanes before which the light is.
    facing: u8,
    places: Places,
}

impl Ahead {
    /// Becomes that of `light` at `hit`. (Only for lights that go all ways: others are asked where they shine, which is known later.)
    #[inline]
    pub fn look<L: Lane>(&mut self, light: &LightProgram, hit: &Hit<L>) {
        if let (Around::Cells(buffer), true) = (&light.around, light.is_point()) {
            let double = hit.double_illuminate;
            self.facing = (light.is_before(hit.point, hit.normal).bits() | double) & hit.active;
            // What is lit from both sides may stand in its own light.
            buffer.place(hit.point, self.facing & !double, &mut self.places);
        }
    }
}

/// A light as the hits see it.
#[derive(Default)]
pub struct Lamp<L: Lane> {
    shadowless: bool,
    /// Unit directions to the light, and how far away it is along them.
    dir: Vec3<L>,
    distance: L,
    /// What arrives if nothing is in the way.
    light: Vec3<f32x8>,
    /// Cosine between normal and light.
    cos: L,
    /// Lanes where it is bright enough and before the surface, or behind it.
    front: u8,
    back: u8,
    /// Lanes that nothing keeps its light from.
    free: u8,
    /// What its buffer has told of it.
    known: Known,
}

impl<L: Lane> Lamp<L> {
    /// Becomes `light`; false if none of that can go to the eye. (In place: a lamp is large.)
    #[inline(always)]
    pub fn shine<S: Scalar<Lane = L>, B: Scalar>(
        &mut self,
        scene: &Compiled<S, B>,
        (light, ahead): (&LightProgram, &mut Ahead),
        hit: &Hit<L>,
        from_behind: bool,
        answered: &mut u64,
    ) -> bool {
        let double = hit.double_illuminate;
        let look = |buffer: &LightBuffer, places: &Places, known: &mut Known| {
            buffer.look(hit.point, places, (&hit.surface, hit.outside), known);
        };
        // A light that goes all ways is seen from wherever nothing is in the way, so that is asked first.
        let early = light.is_point();
        if let (Around::Cells(buffer), true) = (&light.around, early) {
            let facing = ahead.facing;
            look(buffer, &ahead.places, &mut self.known);
            if facing & !self.known.blocked == 0 && !from_behind {
                *answered += u64::from(facing.count_ones());
                return false;
            }
        }
        // (Where others read them, and nowhere else: they fill half of the registers.)
        (self.dir, self.distance) = light.towards(hit.point);
        let Self { dir, distance, cos, known, .. } = self;
        *cos = hit.normal.dot(*dir);
        let front = (cos.ge(L::lit(ALONG_SURFACE)).bits() | double) & hit.active;
        if front == 0 && !from_behind {
            return false;
        }
        self.light = light.at(hit.point, *dir, *distance);
        let mut bright = self.light.abs().max_element().ge(f32x8::lit(NO_LIGHT)).bits() & hit.active;
        let asked = bright & front;
        match &light.around {
            Around::Unknown => known.keep(0),
            Around::Cells(buffer) => {
                if !early {
                    buffer.place(hit.point, asked & !double, &mut ahead.places);
                    look(buffer, &ahead.places, known);
                }
                known.keep(asked);
                if known.doubtful != 0 {
                    ask(&scene.geometry, buffer, hit, (dir, distance), &ahead.places, known);
                }
            }
            Around::Cones(cones) => look_around(cones, hit, (dir, distance), asked & !double, known),
            Around::Openings(openings) => {
                look_through(&scene.geometry, openings, (hit, dir), asked & !double, known);
            }
        }
        *answered += u64::from((known.free | known.blocked).count_ones());
        bright &= !known.blocked;
        self.free = if light.shadowless { !0 } else { known.free };
        self.shadowless = light.shadowless;
        (self.front, self.back) = (bright & front, bright & !front);
        bright != 0
    }
}

/// Holds the ways to a light from hits of which its buffer does not tell against what stands in their places.
#[inline(never)] // Inlined, it takes the registers of shading.
fn ask<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    buffer: &LightBuffer,
    hit: &Hit<S::Lane>,
    (dir, distance): (&Vec3<S::Lane>, &S::Lane),
    places: &Places,
    known: &mut Known,
) {
    buffer.fetch_lists(places, known.doubtful);
    let mut lines = Lines::default();
    hit.leave(dir, &mut lines);
    let mut query = Query::new(&lines, before_light(hit, *distance), known.doubtful);
    buffer.ask(scene, &mut query, places, known);
}

/// Asks the cones around a light for the ways to it from `lanes` of eight hits.
#[inline(never)] // Inlined, it takes the registers of shading.
fn look_around<L: Lane>(
    cones: &Cones,
    hit: &Hit<L>,
    (dir, distance): (&Vec3<L>, &L),
    lanes: u8,
    known: &mut Known,
) {
    cones.look(hit.point, (*dir, *distance), (&hit.surface, hit.outside), lanes, known);
}

/// Looks through a light's window from `lanes` of eight hits, from which it is along `dir`.
#[inline(never)] // Inlined, it takes the registers of shading.
fn look_through<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    openings: &Openings,
    (hit, dir): (&Hit<S::Lane>, &Vec3<S::Lane>),
    lanes: u8,
    known: &mut Known,
) {
    *known = openings.look(hit.point, (&hit.surface, hit.outside), lanes);
    if known.doubtful != 0 {
        known.free |= left_behind(scene, (hit, dir), known.doubtful);
    }
}

/// POV-Ray's least cosine of light that still falls on the front.
const ALONG_SURFACE: f64 = 1e-10;

/// What the light of one lamp is multiplied by on its way to the eye, if nothing is in the lamp's way.
/// `opacity` is that of `colors`.
#[inline]
pub fn direct_light<L: Lane>(
    lamp: &Lamp<L>,
    LayerProgram { finish, highlights, .. }: &LayerProgram,
    colors: &Colors,
    opacity: f32x8,
    hit: &Hit<L>,
    irid_wavelength: Rgb,
) -> Vec3<f32x8> {
    let &Lamp { dir, cos, front, .. } = lamp;
    let back = if finish.diffuse_back != 0.0 { lamp.back } else { 0 };
    if front | back == 0 {
        return Vec3::lit(0.0);
    }

    let lit = Mask::<f32x8>::from_bits(front);
    let mut amount = f32x8::lit(finish.diffuse);
    if finish.diffuse_back != finish.diffuse {
        amount = lit.select(amount, f32x8::lit(finish.diffuse_back));
    }
    let slope = if finish.brilliance == 1.0 { cos.abs() } else { cos.abs().pow_const(finish.brilliance) };
    let mut sum = colors.rgb * (slope.cast::<f32x8>() * amount * opacity);

    if (finish.phong > 0.0 || finish.specular > 0.0) && !lamp.shadowless {
        let mut highlight = L::zero();
        if finish.phong > 0.0 {
            let c = hit.mirrored().dot(dir);
            let seen = c.gt(L::lit(highlights.least_phong));
            if seen.bits() & front != 0 {
                highlight += seen.keep(c.max(L::zero()).pow_const(finish.phong_size) * L::lit(finish.phong));
            }
        }
        if finish.specular > 0.0 {
            let half = dir - hit.dir;
            let (along, square) = (half.dot(hit.normal), half.dot(half));
            let least = square * L::lit(highlights.least_specular * highlights.least_specular);
            let seen = along.gt(L::zero()) & (along * along).gt(least);
            if seen.bits() & front != 0 {
                let c = seen.keep(along / square.sqrt());
                highlight += seen.keep(c.pow_const(1.0 / finish.roughness) * L::lit(finish.specular));
            }
        }
        let highlight = lit.keep(highlight.cast());
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
    let any = Mask::from_bits(front | back);
    // A NaN would spoil its pixel for good.
    sum.map(|c| (any & c.equal(c)).keep(c))
}

/// How near a light is as good as on a surface, in roundings of the coordinates involved: a few each for the point, the
/// way to the light and the crossing.
const LIGHT_ROUNDINGS: f64 = 32.0;

/// How far shadow rays from `hit` look: a light that lies on a surface is not behind it.
#[inline(always)]
fn before_light<L: Lane>(hit: &Hit<L>, distance: L) -> L {
    let reach = hit.point.abs().max_element() + distance.abs();
    distance - reach * L::lit(LIGHT_ROUNDINGS * L::Scalar::UNIT_ROUNDOFF)
}

/// Sends shadow rays for the light `sum` that could go to the eye from lamp `number`; adds what nothing is in the way of to `local`,
/// as it arrives at the hits' sums.
#[inline]
pub fn queue_light<L: Lane>(
    lamp: &Lamp<L>,
    sum: Vec3<f32x8>,
    number: usize,
    hit: &Hit<L>,
    (emit, local): (&mut Emit<L>, &mut Vec3<f64x8>),
) {
    let lanes = sum.abs().max_element().gt(f32x8::lit(NO_LIGHT)).bits() & hit.active;
    let (free, lanes) = (lanes & lamp.free, lanes & !lamp.free);
    let arriving = sum.mul(hit.throughput);
    if free != 0 {
        let free = Mask::from_bits(free);
        *local += arriving.map(|c| free.keep(c)).cast();
    }
    if lanes != 0 {
        let queue = &mut emit.shadows[number];
        let feelers = queue.next();
        hit.leave(&lamp.dir, &mut feelers.lines);
        feelers.t_max = before_light(hit, lamp.distance);
        feelers.light = arriving;
        feelers.sink = hit.sink;
        feelers.medium = hit.medium;
        feelers.lanes = lanes;
        queue.push();
    }
}
