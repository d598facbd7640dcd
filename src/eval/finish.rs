//! `finish { ... }` (manual section 3.4.6.3).

use super::machine::{Machine, Res};
use super::value::{Value, With};
use crate::lang::{Keyword, Mark, Token};
use crate::scene::{Finish, Reflection, Rgb, Subsurface};

/// `phong albedo` and `diffuse albedo` are shares of all light sent back; these turn them into plain amounts once
/// the exponents are known.
#[derive(Default)]
struct Albedo {
    diffuse: bool,
    phong: bool,
    specular: bool,
}

/// What is missing of a `finish` with a `refraction` other than 1.
const REFRACTION: &str = "refraction of a finish";

impl Machine<'_> {
    /// The block behind `finish`, which changes `base`.
    pub fn finish(&mut self, base: &mut With<Finish>) -> Res<()> {
        self.deeper(|m| {
            let open = m.open("finish")?;
            if let Some(named) = m.take_named(|value| match value {
                Value::Finish(finish) => Some(With::clone(finish)),
                _ => None,
            })? {
                *base = named;
            }
            let mut albedo = Albedo::default();
            while m.finish_item(base, &mut albedo)? {}
            m.close("finish", open)?;
            let finish = &mut base.value;
            if albedo.diffuse {
                let factor = (finish.brilliance + 1.0) / 2.0;
                finish.diffuse *= factor;
                finish.diffuse_back *= factor;
            }
            if albedo.phong {
                finish.phong *= (finish.phong_size + 1.0) / 2.0;
            }
            if albedo.specular {
                let r = 1.0 / finish.roughness;
                finish.specular *= (r + 2.0) / (4.0 * (2.0 - 2f64.powf(-r / 2.0)));
            }
            Ok(())
        })
    }

    fn finish_item(&mut self, base: &mut With<Finish>, albedo: &mut Albedo) -> Res<bool> {
        use Keyword as K;
        let Token::Word(word) = self.peek()? else { return Ok(false) };
        let at = self.peek_lexeme()?;
        let finish = &mut base.value;
        match word {
            K::Ambient => {
                self.next()?;
                finish.ambient = self.rgb()?;
            }
            K::Emission => {
                self.next()?;
                finish.emission = self.rgb()?;
            }
            K::Diffuse => {
                self.next()?;
                albedo.diffuse |= self.accept_word(K::Albedo)?;
                // No light is taken away: below 0 is 0 (measured).
                finish.diffuse = self.finite()?.max(0.0);
                // One number is that of the front: nothing is left of what the back had (measured).
                finish.diffuse_back = 0.0;
                if self.accept(Mark::Comma)? {
                    finish.diffuse_back = self.finite()?.max(0.0);
                }
            }
            K::Brilliance => {
                self.next()?;
                finish.brilliance = self.finite()?;
            }
            K::Phong => {
                self.next()?;
                albedo.phong |= self.accept_word(K::Albedo)?;
                finish.phong = self.finite()?;
            }
            K::PhongSize => {
                self.next()?;
                finish.phong_size = self.finite()?;
            }
            K::Specular => {
                self.next()?;
                albedo.specular |= self.accept_word(K::Albedo)?;
                finish.specular = self.finite()?;
            }
            K::Roughness => {
                self.next()?;
                finish.roughness = self.finite()?;
                if finish.roughness == 0.0 {
                    let span = self.span(self.last);
                    let message = "a `roughness` of 0 spreads the highlight over all of the lit side";
                    self.warn("roughness", message, span);
                    base.value.roughness = f64::INFINITY;
                }
            }
            K::Metallic => {
                self.next()?;
                // Below 0 highlights stay white, but not reflections (measured).
                finish.metallic = self.optional_float()?.unwrap_or(1.0).max(0.0);
            }
            K::Crand => {
                self.next()?;
                if self.finite()? == 0.0 {
                    self.forget(&mut base.lacks, word.text());
                } else {
                    base.lacks.add(&self.lack(word.text(), at));
                }
            }
            K::ConserveEnergy => {
                self.next()?;
                finish.conserve_energy = self.switch_value()?;
            }
            K::Reflection => {
                self.next()?;
                self.reflection(&mut base.value.reflection)?;
            }
            K::ReflectionExponent => {
                self.next()?;
                finish.reflection.exponent = self.finite()?;
            }
            K::Irid => {
                self.next()?;
                self.irid(base)?;
            }
            K::Subsurface => {
                self.next()?;
                base.lacks.add(&self.lack(word.text(), at));
                let open = self.open(word.text())?;
                let mut subsurface = Subsurface { translucency: Rgb::ZERO, anisotropy: 0.0 };
                while self.rgb_item(&mut [(K::Translucency, &mut subsurface.translucency)])?
                    || self.float_item(&mut [(K::Anisotropy, &mut subsurface.anisotropy)])?
                {}
                self.close(word.text(), open)?;
                base.value.subsurface = Some(subsurface);
            }
            K::UseAlpha => {
                self.next()?;
                self.switch_value()?;
            }
            // Moved to `interior` long ago, and written into it when the object is placed.
            K::Ior | K::Refraction | K::Caustics => {
                self.next()?;
                let value = self.finite()?;
                let said = (value >= 0.0).then_some(value);
                match word {
                    K::Ior => base.value.ior = said,
                    K::Caustics => base.value.caustics = said,
                    // Light that goes through is multiplied by it.
                    _ if value == 1.0 => self.forget(&mut base.lacks, REFRACTION),
                    _ => base.lacks.add(&self.lack(REFRACTION, at)),
                }
                self.finishes_of_interiors |= said.is_some() && word != K::Refraction;
                self.warn("finish ior", format!("`{}` belongs in `interior`", word.text()), self.span(at));
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// `on`, `off`, a number, or nothing, which is on.
    pub fn switch_value(&mut self) -> Res<bool> {
        Ok(self.optional_float()?.is_none_or(|value| value != 0.0))
    }

    /// `reflection C`, or `reflection { [min,] max ... }`.
    fn reflection(&mut self, reflection: &mut Reflection) -> Res<()> {
        if self.peek()? != Token::Mark(Mark::OpenBrace) {
            let color = self.rgb()?;
            (reflection.min, reflection.max) = (color, color);
            return Ok(());
        }
        let open = self.open("reflection")?;
        let mut said_fresnel = false;
        let first = self.rgb()?;
        let comma = self.accept(Mark::Comma)?;
        let second = if comma
            || self.starts_color()?
            || matches!(self.peek()?, Token::Number(_) | Token::Vector(..))
        {
            Some(self.rgb()?)
        } else {
            None
        };
        loop {
            use Keyword as K;
            let Token::Word(word) = self.peek()? else { break };
            match word {
                K::Fresnel => {
                    self.next()?;
                    reflection.fresnel = self.switch_value()?;
                    said_fresnel = reflection.fresnel;
                }
                K::Falloff => {
                    self.next()?;
                    reflection.falloff = self.finite()?;
                }
                K::Exponent => {
                    self.next()?;
                    reflection.exponent = self.finite()?;
                }
                K::Metallic => {
                    self.next()?;
                    reflection.metallic = self.optional_float()?.unwrap_or(1.0);
                }
                _ => break,
            }
        }
        self.close("reflection", open)?;
        (reflection.min, reflection.max) = match second {
            Some(second) => (first, second),
            // One value under Fresnel's law is the most that is reflected, else it is all there is; also where that law was said before
            // and still holds (measured in POV-Ray 3.7).
            None if said_fresnel => (Rgb::ZERO, first),
            None => (first, first),
        };
        Ok(())
    }

    /// `irid { amount thickness t turbulence t }`.
    fn irid(&mut self, base: &mut With<Finish>) -> Res<()> {
        let open = self.open("irid")?;
        base.value.irid = self.finite()?;
        loop {
            match self.peek()? {
                Token::Word(Keyword::Thickness) => {
                    self.next()?;
                    base.value.irid_thickness = self.finite()?;
                }
                Token::Word(Keyword::Turbulence) => {
                    let at = self.peek_lexeme()?;
                    self.next()?;
                    if self.float()? != 0.0 {
                        base.lacks.add(&self.lack("turbulence of irid", at));
                    }
                }
                _ => break,
            }
        }
        self.close("irid", open)
    }
}
