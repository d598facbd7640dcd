//! `light_source { ... }` (manual section 3.4.4).

use super::machine::{Machine, Res};
use super::value::{Facts, Lacks, ObjectValue, Value};
use crate::lang::{Keyword, Token};
use crate::scene::{Fade, Light, LightKind, Object, Rgb, Transform};
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
    /// Of what it looks like.
    facts: Facts,
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
            },
            beam: Beam::Point,
            was_cylinder: false,
            radius: None,
            falloff: None,
            tightness: 0.0,
            fade_distance: 0.0,
            fade_power: 0.0,
            looks_like: None,
            facts: Facts::default(),
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
                self.vector()?;
                self.comma()?;
                self.vector()?;
                self.comma()?;
                self.float()?;
                self.comma()?;
                self.float()?;
            }
            // Details of an area light.
            K::Adaptive => {
                self.next()?;
                self.float()?;
            }
            K::Jitter | K::Circular | K::Orient => {
                self.next()?;
            }
            K::AreaIllumination => {
                self.next()?;
                self.switch_value()?;
            }
            // Of meaning only where there are media.
            K::MediaInteraction | K::MediaAttenuation => {
                self.next()?;
                self.switch_value()?;
            }
            K::LooksLike => {
                self.next()?;
                let open = self.open("looks_like")?;
                let mut value = match self.named_object()? {
                    Some(value) => value,
                    None => match self.object()? {
                        Some(value) => value,
                        None => return self.expected("an object"),
                    },
                };
                while self.modifier(&mut value)? {}
                self.close("looks_like", open)?;
                draft.lacks.add(&value.lacks);
                self.charge_move(&value.facts)?;
                draft.facts = value.facts;
                draft.looks_like = value.object.map(|mut shared| {
                    let object = Arc::make_mut(&mut shared);
                    object.move_by(&Transform::translate(draft.light.location));
                    object.flags.no_shadow = true;
                    shared
                });
            }
            K::ProjectedThrough => {
                self.next()?;
                draft.lacks.add(&self.lack_with_block(word, at)?);
            }
            K::Photons => {
                self.next()?;
                self.block_left_out("photons")?;
                self.ignore("photons of a light", at);
            }
            _ => return Ok(false),
        }
        Ok(true)
    }
}

impl Draft {
    fn transform(&mut self, transform: &Transform) {
        self.light.location = transform.point(self.light.location);
        self.light.point_at = transform.point(self.light.point_at);
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
        ObjectValue {
            object: self.looks_like,
            lights: vec![self.light],
            lacks: self.lacks,
            facts: self.facts,
            ..ObjectValue::default()
        }
    }
}
