//! `light_source { ... }` (manual section 3.4.4).

use super::machine::{Machine, Res};
use super::value::{Absent, Facts, Lacks, ObjectValue, Value};
use crate::lang::{Keyword, Token};
use crate::scene::{AreaLight, Fade, Light, LightKind, LightMore, Object, Rgb, Transform};
use glam::DVec3;
use std::sync::Arc;

/// A light's words before its kind is known.
struct Draft {
    light: Light,
    beam: Beam,
    was_cylinder: bool,
    radius: Option<f64>,
    falloff: Option<f64>,
    tightness: f64,
    fade_distance: f64,
    fade_power: f64,
    looks_like: Option<Arc<Object>>,
    /// Those in what it looks like.
    lights: Vec<Light>,
    /// Of what it looks like.
    facts: Facts,
    area: AreaLight,
    is_area: bool,
    more: LightMore,
    lacks: Lacks,
}

/// POV-Ray has one slot for these: the word said last holds (measured: a `spotlight` that is `shadowless` after that
/// shines everywhere).
#[derive(Clone, Copy, PartialEq)]
enum Beam {
    Point,
    Spot,
    Cylinder,
    Shadowless,
}

impl Machine<'_> {
    /// The block behind `light_source`.
    pub fn light(&mut self) -> Res<ObjectValue> {
        let open = self.open("light_source")?;
        let named = self.take_named(|value| match value {
            Value::Object(object) if !object.lights.is_empty() => Some(ObjectValue::clone(object)),
            _ => None,
        })?;
        if let Some(mut value) = named {
            while self.modifier(&mut value)? {}
            self.close("light_source", open)?;
            return Ok(value);
        }
        let location = self.vector()?;
        self.comma()?;
        let color: Rgb = self.rgb()?;
        let mut draft = Draft {
            light: Light {
                location,
                color,
                kind: LightKind::Point,
                point_at: DVec3::Z,
                parallel: false,
                shadowless: false,
                fade: None,
                more: None,
            },
            beam: Beam::Point,
            was_cylinder: false,
            radius: None,
            falloff: None,
            tightness: 0.0,
            fade_distance: 0.0,
            fade_power: 0.0,
            looks_like: None,
            lights: Vec::new(),
            facts: Facts::default(),
            area: AreaLight::default(),
            is_area: false,
            more: LightMore::default(),
            lacks: Lacks::default(),
        };
        self.comma()?;
        while self.light_item(&mut draft)? {}
        self.close("light_source", open)?;
        Ok(draft.finish())
    }

    fn light_item(&mut self, draft: &mut Draft) -> Res<bool> {
        use Keyword as K;
        let Token::Word(word) = self.peek()? else { return Ok(false) };
        if let Some(transform) = self.transform_item(word)? {
            self.charge_move(&draft.facts)?;
            draft.transform(&transform);
            return Ok(true);
        }
        let at = self.peek_lexeme()?;
        match word {
            K::Spotlight => {
                self.next()?;
                draft.beam = Beam::Spot;
            }
            K::Cylinder => {
                self.next()?;
                draft.beam = Beam::Cylinder;
                draft.was_cylinder = true;
            }
            K::Parallel => {
                self.next()?;
                draft.light.parallel = true;
            }
            K::Shadowless => {
                self.next()?;
                draft.beam = Beam::Shadowless;
            }
            K::PointAt => {
                self.next()?;
                draft.light.point_at = self.vector()?;
            }
            K::Radius => {
                self.next()?;
                draft.radius = Some(self.finite()?);
            }
            K::Falloff => {
                self.next()?;
                draft.falloff = Some(self.finite()?);
            }
            K::Tightness => {
                self.next()?;
                draft.tightness = self.finite()?;
            }
            K::FadeDistance => {
                self.next()?;
                draft.fade_distance = self.finite()?;
            }
            K::FadePower => {
                self.next()?;
                draft.fade_power = self.finite()?;
            }
            K::AreaLight => {
                self.next()?;
                draft.lacks.add(&self.lack("area_light", at));
                let first = self.vector()?;
                self.comma()?;
                let second = self.vector()?;
                self.comma()?;
                let mut size = [1; 2];
                for count in &mut size {
                    *count = self.integer("the size of an area_light", 1, u32::MAX)?;
                    self.comma()?;
                }
                draft.is_area = true;
                (draft.area.axes, draft.area.size) = ([first, second], size);
            }
            // Details of an area light, which may come before it.
            K::Adaptive => {
                self.next()?;
                draft.area.adaptive = Some(self.finite()?);
            }
            K::Jitter | K::Circular | K::Orient => {
                self.next()?;
                *match word {
                    K::Jitter => &mut draft.area.jitter,
                    K::Circular => &mut draft.area.circular,
                    _ => &mut draft.area.orient,
                } = true;
            }
            // Of meaning only where there are media, or an area.
            K::AreaIllumination | K::MediaInteraction | K::MediaAttenuation => {
                self.switch_item(&mut [
                    (K::AreaIllumination, &mut draft.area.illumination),
                    (K::MediaInteraction, &mut draft.more.media_interaction),
                    (K::MediaAttenuation, &mut draft.more.media_attenuation),
                ])?;
            }
            K::LooksLike => {
                self.next()?;
                let open = self.open("looks_like")?;
                let mut value = self.any_object()?;
                while self.modifier(&mut value)? {}
                self.close("looks_like", open)?;
                draft.lacks.add(&value.lacks);
                self.charge_move(&value.facts)?;
                draft.facts = value.facts;
                value.transform(&Transform::translate(draft.light.location));
                draft.looks_like = value.object.map(|mut shared| {
                    Arc::make_mut(&mut shared).flags.no_shadow = true;
                    shared
                });
                self.charge(size_of::<Light>() * value.lights.len())?;
                draft.lights = value.lights;
            }
            K::ProjectedThrough => {
                self.next()?;
                draft.lacks.add(&self.lack(word.text(), at));
                let open = self.open(word.text())?;
                let mut value = self.any_object()?;
                while self.modifier(&mut value)? {}
                self.close(word.text(), open)?;
                draft.more.projected_through = value.object;
            }
            K::Photons => {
                self.next()?;
                draft.more.photons = Some(self.photon_use()?);
                self.ignore("photons of a light", at);
            }
            _ => return Ok(false),
        }
        Ok(true)
    }
}

impl Draft {
    fn transform(&mut self, transform: &Transform) {
        self.light.move_by(transform);
        self.area.axes = self.area.axes.map(|axis| transform.vector(axis));
        self.lights.iter_mut().for_each(|light| light.move_by(transform));
        if let Some(object) = &mut self.more.projected_through {
            Arc::make_mut(object).move_by(transform);
        }
        if let Some(object) = &mut self.looks_like {
            Arc::make_mut(object).move_by(transform);
        }
    }

    fn finish(mut self) -> ObjectValue {
        // The rays of a cylinder stay parallel whatever it becomes.
        self.light.parallel |= self.was_cylinder && self.beam != Beam::Cylinder;
        match self.beam {
            Beam::Point => {}
            Beam::Shadowless => self.light.shadowless = true,
            Beam::Spot => {
                self.light.kind = LightKind::Spot {
                    radius: self.radius.unwrap_or(30.0).to_radians(),
                    falloff: self.falloff.unwrap_or(45.0).to_radians(),
                    tightness: self.tightness,
                };
            }
            Beam::Cylinder => {
                self.light.kind = LightKind::Cylinder {
                    radius: self.radius.unwrap_or(0.75),
                    falloff: self.falloff.unwrap_or(1.0),
                    tightness: self.tightness,
                };
            }
        }
        if self.fade_power > 0.0 && self.fade_distance.abs() > 1e-10 {
            self.light.fade = Some(Fade { distance: self.fade_distance, power: self.fade_power });
        }
        self.more.area = self.is_area.then_some(self.area);
        if self.more != LightMore::default() {
            self.light.more = Some(Box::new(self.more));
        }
        self.lights.insert(0, self.light);
        ObjectValue {
            object: self.looks_like,
            lights: self.lights,
            lacks: self.lacks,
            facts: self.facts,
            absent: Absent::Light,
            ..ObjectValue::default()
        }
    }
}
