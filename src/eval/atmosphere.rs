//! `fog`, `sky_sphere`, `rainbow` and `media` of a scene (manual section 3.4.2): read into the description, not rendered.

use super::machine::{Lexeme, Machine, Res};
use super::value::{Value, With};
use crate::lang::Keyword;
use crate::scene::{Fog, GroundFog, Pigment, Rainbow, SkySphere};
use glam::DVec3;
use std::sync::Arc;

/// Bytes of a part of the air, about; for the memory limit.
const AIR_BYTES: usize = 400;

/// What a fog's words have said so far.
struct FogDraft {
    fog: Fog,
    ground: bool,
    layer: GroundFog,
}

impl Machine<'_> {
    /// Reads a part of the air as a statement, if one is next.
    pub fn atmosphere(&mut self, word: Keyword, at: Lexeme) -> Res<bool> {
        if !matches!(word, Keyword::Fog | Keyword::SkySphere | Keyword::Rainbow | Keyword::Media) {
            return Ok(false);
        }
        self.next()?;
        self.charge(AIR_BYTES)?;
        let lacks = self.lack(word.text(), at);
        let mut told = lacks;
        match word {
            Keyword::Fog => {
                let fog = self.fog()?;
                if fog.distance == 0.0 {
                    // There is none.
                    told = Default::default();
                }
                self.scene.atmosphere.fogs.push(fog);
            }
            Keyword::Rainbow => {
                let rainbow = self.rainbow()?;
                self.scene.atmosphere.rainbows.push(rainbow);
            }
            Keyword::SkySphere => {
                let sky = self.sky_sphere()?;
                if self.scene.atmosphere.sky_sphere.is_some() {
                    self.warn("sky_sphere", "more than one `sky_sphere`: the last one counts", self.span(at));
                }
                self.scene.atmosphere.sky_sphere = Some(sky.value);
            }
            _ => {
                let media = self.media()?;
                self.scene.atmosphere.media.push(media.value);
            }
        }
        self.miss(&told);
        Ok(true)
    }

    /// A part of the air as a value; `None` if `word` begins none.
    pub fn atmosphere_value(&mut self, word: Keyword) -> Res<Option<Value>> {
        if !matches!(word, Keyword::Fog | Keyword::SkySphere | Keyword::Rainbow) {
            return self.media_value(word);
        }
        self.next()?;
        Ok(Some(match word {
            Keyword::Fog => Value::Fog(Arc::new(self.fog()?)),
            Keyword::Rainbow => Value::Rainbow(Arc::new(self.rainbow()?)),
            _ => Value::SkySphere(Arc::new(self.sky_sphere()?)),
        }))
    }

    fn fog(&mut self) -> Res<Fog> {
        let draft = |fog: Fog| FogDraft {
            ground: fog.ground.is_some(),
            layer: fog.ground.unwrap_or(GroundFog { offset: 0.0, altitude: 0.0 }),
            fog,
        };
        let named = |value: &Value| match value {
            Value::Fog(fog) => Some(draft(Fog::clone(fog))),
            _ => None,
        };
        let FogDraft { mut fog, ground, layer } =
            self.block("fog", named, draft(Fog::default()), Self::fog_item)?;
        fog.ground = ground.then_some(layer);
        fog.up = fog.up.try_normalize().unwrap_or(DVec3::Y);
        Ok(fog)
    }

    fn fog_item(&mut self, draft: &mut FogDraft, word: Keyword) -> Res<bool> {
        use Keyword as K;
        let FogDraft { fog, ground, layer } = draft;
        if self.starts_color()? {
            fog.color = self.color()?;
            return Ok(true);
        }
        if let Some(transform) = self.transform_item(word)? {
            fog.up = transform.vector(fog.up);
            return Ok(true);
        }
        if word == K::FogType {
            self.next()?;
            *ground = self.integer("`fog_type`", 1, 2)? == 2;
            return Ok(true);
        }
        Ok(self.float_item(&mut [
            (K::Distance, &mut fog.distance),
            (K::FogAlt, &mut layer.altitude),
            (K::FogOffset, &mut layer.offset),
            (K::TurbDepth, &mut fog.turbulence_depth),
        ])? || self.vector_item(&mut [(K::Up, &mut fog.up), (K::Turbulence, &mut fog.turbulence)])?
            || self.octaves_item(&mut fog.octaves)?)
    }

    fn rainbow(&mut self) -> Res<Rainbow> {
        use Keyword as K;
        let at = self.last;
        let named = |value: &Value| match value {
            Value::Rainbow(rainbow) => Some(Rainbow::clone(rainbow)),
            _ => None,
        };
        let mut rainbow = self.block("rainbow", named, Rainbow::default(), |m, rainbow, word| {
            if let Some(transform) = m.transform_item(word)? {
                rainbow.direction = transform.vector(rainbow.direction);
                rainbow.up = transform.vector(rainbow.up);
            } else if matches!(word, K::ColorMap | K::ColourMap) {
                m.next()?;
                rainbow.colors = m.color_map()?.value;
            } else {
                return Ok(m.float_item(&mut [
                    (K::Angle, &mut rainbow.angle_deg),
                    (K::Width, &mut rainbow.width_deg),
                    (K::ArcAngle, &mut rainbow.arc_angle_deg),
                    (K::FalloffAngle, &mut rainbow.falloff_angle_deg),
                    (K::Distance, &mut rainbow.distance),
                    (K::Jitter, &mut rainbow.jitter),
                ])? || m
                    .vector_item(&mut [(K::Direction, &mut rainbow.direction), (K::Up, &mut rainbow.up)])?);
            }
            Ok(true)
        })?;
        let span = self.span(at);
        let Some(direction) = rainbow.direction.try_normalize() else {
            return Err(self.error("the `direction` of a rainbow must not be zero", span));
        };
        let up = rainbow.up.try_normalize().unwrap_or(DVec3::Y);
        if direction.cross(up).length() < f64::EPSILON {
            return Err(self.error("the `direction` and `up` of a rainbow must not be in one line", span));
        }
        if rainbow.arc_angle_deg < rainbow.falloff_angle_deg {
            return Err(
                self.error("the `arc_angle` of a rainbow must not be below its `falloff_angle`", span)
            );
        }
        (rainbow.direction, rainbow.up) = (direction, up);
        Ok(rainbow)
    }

    fn sky_sphere(&mut self) -> Res<With<SkySphere>> {
        let at = self.last;
        let named = |value: &Value| match value {
            Value::SkySphere(sky) => Some(With::clone(sky)),
            _ => None,
        };
        let sky = self.block("sky_sphere", named, With::new(SkySphere::default()), |m, sky, word| {
            if word == Keyword::Pigment {
                m.next()?;
                m.charge(AIR_BYTES)?;
                let mut pigment = With::new(Pigment::default());
                m.pigment(&mut pigment)?;
                sky.lacks.add(&pigment.lacks);
                sky.value.pigments.push(pigment.value);
            } else if let Some(transform) = m.transform_item(word)? {
                sky.value.transform.move_by(&transform);
            } else {
                return m.rgb_item(&mut [(Keyword::Emission, &mut sky.value.emission)]);
            }
            Ok(true)
        })?;
        if sky.value.pigments.is_empty() {
            return Err(self.error("a `sky_sphere` wants a `pigment`", self.span(at)));
        }
        Ok(sky)
    }
}
