//! The recursion: trace, shade, reflect, refract (Whitted 1980), with POV-Ray's rules for weights and levels.

use super::interior::{Media, fade, shadow_fade};
use super::light::{Arriving, arriving, is_dark};
use super::node::PlacedTexture;
use super::pattern;
use super::ray::{Departure, Ray, RayKind};
use super::reflect::reflectivity;
use super::surface::interference;
use super::surface::{Lit, mirror};
use super::trail::Face;
use super::world::{Met, World};
use crate::film::{Pixel, RayCounts};
use crate::scene::{Color, Finish, Layer, Rgb, Shape};
use glam::DVec3;
use smallvec::SmallVec;

/// The brightness of a colour, by which layers decide how much is left to see behind them (POV-Ray's weights).
const GREY: Rgb = Rgb::new(0.297, 0.589, 0.114);

/// The simulated caustics' exponent is this times `caustics` (POV-Ray's value).
const CAUSTICS_EXPONENT: f64 = 45.0;

/// Light that fell on the surface from its other side has a cosine under this (POV-Ray's bound).
const FACING: f64 = 1e-10;

/// Follows rays through one world, and counts them.
pub struct Tracer<'w> {
    world: &'w World<'w>,
    /// So far.
    pub counts: RayCounts,
}

/// What a ray sees.
#[derive(Debug, Clone, Copy)]
struct Seen {
    rgb: Rgb,
    /// What nothing covers: the background's own `transmit` where it is seen.
    transmit: f64,
}

impl Seen {
    /// Nothing: the ray was not worth tracing.
    const NOTHING: Self = Self { rgb: Rgb::ZERO, transmit: 0.0 };
}

/// A ray's standing in the recursion.
#[derive(Debug, Clone, Copy)]
struct Rank {
    /// Share of the pixel.
    weight: f64,
    /// Levels used up before this ray.
    level: u32,
    /// The ray goes straight on behind a surface and uses none up.
    straight: bool,
}

impl<'w> Tracer<'w> {
    /// A tracer that has counted nothing yet.
    pub fn new(world: &'w World<'w>) -> Self {
        Self { world, counts: RayCounts::default() }
    }

    /// The pixel that `ray` belongs to.
    pub fn camera_ray(&mut self, ray: &Ray) -> Pixel {
        self.counts.camera += 1;
        let media = self.world.media_at_start(ray);
        let seen = self.trace(ray, &media, Rank { weight: 1.0, level: 0, straight: false });
        Pixel { rgb: seen.rgb.as_vec3().to_array(), transmit: seen.transmit as f32 }
    }

    /// Finds the nearest hit and shades it.
    fn trace(&mut self, ray: &Ray, media: &Media, rank: Rank) -> Seen {
        if !self.is_worth(rank) {
            return Seen::NOTHING;
        }
        let level = rank.level + u32::from(!rank.straight);
        match self.world.nearest(ray, f64::INFINITY) {
            None => self.background(),
            Some(met) => self.shade(&met, ray, media, rank.weight, level),
        }
    }

    fn is_worth(&self, rank: Rank) -> bool {
        let globals = &self.world.scene.globals;
        rank.level < globals.max_trace_level && rank.weight >= globals.adc_bailout
    }

    /// What is seen where nothing is.
    fn background(&self) -> Seen {
        let background = &self.world.scene.background;
        Seen { rgb: background.rgb, transmit: background.transmit }
    }

    /// The final colours of the surface's textures, mixed.
    fn shade(&mut self, met: &Met, ray: &Ray, media: &Media, weight: f64, level: u32) -> Seen {
        let mut lights = vec![None; self.world.scene.lights.len()];
        let mut total = Seen { rgb: Rgb::ZERO, transmit: 0.0 };
        for (share, texture) in self.world.textures(met, ray) {
            // POV-Ray leaves out what is worth less than a ray, and does not share it out again.
            if share < self.world.scene.globals.adc_bailout {
                continue;
            }
            let point = Point { met, view: ray.dir, kind: ray.kind, media, level };
            let seen = self.shade_texture(&point, &texture, weight * share, &mut lights);
            total.rgb += share * seen.rgb;
            total.transmit += share * seen.transmit;
        }
        total
    }

    /// One texture: its layers from the top down, then what lies behind, then what it mirrors.
    fn shade_texture(
        &mut self,
        point: &Point,
        texture: &PlacedTexture,
        weight: f64,
        lights: &mut [Option<Rgb>],
    ) -> Seen {
        let (scene, interiors) = (self.world.scene, &self.world.interiors);
        let (met, media) = (point.met, point.media);
        let interior = met.face.leaf.look.interior;
        let place = texture.from_world.point(met.face.point);
        let cosine = -point.view.dot(met.normal);
        let mut rgb = Rgb::ZERO;
        // What is left of light from below the layers seen so far, and its brightness.
        let (mut filter, mut left) = (Rgb::ONE, 1.0);
        let mut mirrors: SmallVec<[(Rgb, f64, &Finish); 2]> = SmallVec::new();
        let mut top_film = None;
        for layer in texture.texture.layers.iter().rev() {
            if !(left > scene.globals.adc_bailout) {
                break;
            }
            let (finish, color) =
                (&layer.finish, pattern::color(&layer.pigment, place, scene.globals.noise_generator));
            let ior = media.relative_ior(interior, interiors);
            let reflected = reflectivity(finish, cosine, ior, color.rgb);
            let film = interference(finish, 2.0 * cosine, self.world.scene.globals.irid_wavelength);
            top_film.get_or_insert(film);
            // The film is on what is seen, which the exponent then bends.
            let film = match finish.reflection.exponent {
                1.0 => film,
                exponent => film.max(Rgb::ZERO).powf(1.0 / exponent),
            };
            mirrors.push((reflected.color * film, weight * left * reflected.weight, finish));
            let own = finish.ambient * scene.globals.ambient_light + finish.emission;
            let mut lit = color.rgb * own * color.opacity(scene.globals.opacity);
            lit += self.lights(point, finish, &color, lights);
            rgb += lit * filter;
            filter *= color.transmittance();
            if finish.conserve_energy {
                filter *= (Rgb::ONE - reflected.color).min(Rgb::ONE);
            }
            left = filter.dot(GREY).abs().min(1.0);
        }
        let (mut transmit, mut totally_reflected) = (0.0, false);
        if left > scene.globals.adc_bailout {
            let faded = if media.contains(interior) { fade(&interiors[interior.0], met.t) } else { Rgb::ONE };
            let seen = self.behind(point, weight * filter.abs().max_element());
            totally_reflected = seen.totally_reflected;
            if totally_reflected {
                // The top layer's film tints it as it does any mirrored light (measured in POV-Ray 3.7).
                rgb += faded * top_film.unwrap_or(Rgb::ONE) * seen.seen.rgb;
            } else {
                rgb += faded * filter * seen.seen.rgb;
                transmit = faded.dot(GREY) * seen.seen.transmit * left;
            }
        }
        if !totally_reflected {
            for (color, weight, finish) in mirrors {
                rgb += self.mirrored(point, color, weight, finish);
            }
        }
        Seen { rgb, transmit }
    }

    /// What a surface shows of all lights. `arrived` keeps what gets through to this point, for the other layers.
    fn lights(&mut self, point: &Point, finish: &Finish, color: &Color, arrived: &mut [Option<Rgb>]) -> Rgb {
        if finish.diffuse == 0.0
            && finish.diffuse_back == 0.0
            && finish.specular == 0.0
            && finish.phong == 0.0
        {
            return Rgb::ZERO;
        }
        let scene = self.world.scene;
        let mut sum = Rgb::ZERO;
        for (light, arrived) in scene.lights.iter().zip(arrived) {
            let Some(arriving) = arriving(light, point.met.face.point) else { continue };
            let away = point.met.normal.dot(arriving.toward) < FACING;
            let behind = away && !point.met.face.leaf.look.flags.double_illuminate;
            if behind && finish.diffuse_back == 0.0 {
                continue;
            }
            let through = if light.shadowless {
                arriving.color
            } else {
                *arrived.get_or_insert_with(|| self.through(point, &arriving))
            };
            if is_dark(through) {
                continue;
            }
            let (normal, view, toward) = (point.met.normal, point.view, arriving.toward);
            let lit = Lit { normal, view, toward, light: through, behind, fill: light.shadowless };
            sum += lit.answer(finish, color, &scene.globals);
        }
        sum
    }

    /// How much of a light gets through to a point: a ray from surface to surface towards it, straight through what is
    /// transparent.
    fn through(&mut self, point: &Point, arriving: &Arriving) -> Rgb {
        let mut color = arriving.color;
        let mut rest = arriving.distance;
        let mut media = point.media.clone();
        let mut ray = leaving(&point.met.face, arriving.toward, RayKind::Shadow);
        loop {
            self.counts.shadow += 1;
            let Some(met) = self.world.nearest(&ray, rest) else { return color };
            color *= self.filtered(&met, &ray, &media);
            if is_dark(color) {
                return Rgb::ZERO;
            }
            media = media.pass(met.face.leaf.look.interior, &self.world.interiors).media;
            rest -= met.t;
            ray = leaving(&met.face, ray.dir, RayKind::Shadow);
        }
    }

    /// What a surface on the way to a light leaves of it.
    fn filtered(&self, met: &Met, ray: &Ray, media: &Media) -> Rgb {
        if let Shape::Mesh(mesh) = met.face.leaf.shape()
            && mesh.blocks_light(met.face.leaf.look.texture.as_ref().map(|placed| &*placed.texture))
        {
            return Rgb::ZERO;
        }
        let id = met.face.leaf.look.interior;
        let interior = &self.world.interiors[id.0];
        let mut caustics = 1.0;
        if interior.caustics != 0.0 {
            caustics += met.normal.dot(ray.dir).abs().powf(CAUSTICS_EXPONENT * interior.caustics);
        }
        let mut sum = Rgb::ZERO;
        for (share, texture) in self.world.textures(met, ray) {
            let place = texture.from_world.point(met.face.point);
            let layers = texture.texture.layers.iter();
            let generator = self.world.scene.globals.noise_generator;
            let through =
                |layer: &Layer| pattern::color(&layer.pigment, place, generator).transmittance() * caustics;
            sum += share * layers.map(through).fold(Rgb::ONE, |product, layer| product * layer);
        }
        if media.contains(id) { sum * shadow_fade(interior, met.t) } else { sum }
    }

    /// What is seen through a surface.
    fn behind(&mut self, point: &Point, weight: f64) -> Behind {
        let met = point.met;
        let passage = point.media.pass(met.face.leaf.look.interior, &self.world.interiors);
        let rank = Rank { weight, level: point.level, straight: passage.is_straight() };
        let dir = if rank.straight { Some(point.view) } else { passage.bend(point.view, met.normal) };
        match dir {
            Some(dir) => {
                self.counts.refract += u64::from(self.is_worth(rank));
                let ray = leaving(&met.face, dir, point.kind);
                Behind { seen: self.trace(&ray, &passage.media, rank), totally_reflected: false }
            }
            None => {
                self.counts.reflect += u64::from(self.is_worth(rank));
                let ray = leaving(&met.face, mirror(point.view, met.normal), RayKind::Reflected);
                Behind { seen: self.trace(&ray, point.media, rank), totally_reflected: true }
            }
        }
    }

    /// What a layer mirrors. It does not pass through the layers above: POV-Ray's rule.
    fn mirrored(&mut self, point: &Point, color: Rgb, weight: f64, finish: &Finish) -> Rgb {
        if color == Rgb::ZERO {
            return Rgb::ZERO;
        }
        let rank = Rank { weight, level: point.level, straight: false };
        self.counts.reflect += u64::from(self.is_worth(rank));
        let ray = leaving(&point.met.face, mirror(point.view, point.met.normal), RayKind::Reflected);
        let seen = self.trace(&ray, point.media, rank).rgb;
        let exponent = finish.reflection.exponent;
        if exponent == 1.0 { color * seen } else { color * seen.max(Rgb::ZERO).powf(1.0 / exponent) }
    }
}

/// A point under shading.
struct Point<'a, 'w> {
    met: &'a Met<'w>,
    /// Unit direction of sight.
    view: DVec3,
    /// What sent the ray.
    kind: RayKind,
    /// What the ray came through.
    media: &'a Media,
    /// Levels used up, this ray's included.
    level: u32,
}

/// What is seen through a surface, or instead.
struct Behind {
    seen: Seen,
    totally_reflected: bool,
}

/// A ray that starts on a surface.
fn leaving(face: &Face, dir: DVec3, kind: RayKind) -> Ray {
    let departure = Departure { leaf: face.leaf.id, part: face.part, local: face.local };
    Ray { left: Some(departure), ..Ray::new(face.point, dir, kind) }
}
