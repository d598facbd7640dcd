//! `media { ... }` (manual section 3.4.8.3): read into the description, not rendered.

use super::item::{ANY, BELOW_ONE, NOT_NEGATIVE, POSITIVE};
use super::machine::{Machine, Res};
use super::pigment::Densities;
use super::value::{Value, With};
use crate::lang::{Keyword, Mark, Token};
use crate::scene::{Color, Media, Pigment, Rgb, Scattering};
use std::sync::Arc;

impl Machine<'_> {
    /// The block behind `media`.
    pub fn media(&mut self) -> Res<With<Media>> {
        let named = |value: &Value| match value {
            Value::Media(media) => Some(With::clone(media)),
            _ => None,
        };
        let media = self.block("media", named, With::new(Media::default()), Self::media_item)?;
        self.charge(media.value.densities.len() * std::mem::size_of::<Pigment>())?;
        Ok(media)
    }

    fn media_item(&mut self, base: &mut With<Media>, word: Keyword) -> Res<bool> {
        use Keyword as K;
        let media = &mut base.value;
        if let Some(transform) = self.transform_item(word)? {
            media.transform.move_by(&transform);
            return Ok(true);
        }
        match word {
            K::Method => {
                self.next()?;
                media.method = self.integer("`method` of media", 1, 3)? as u8;
            }
            K::Intervals => {
                self.next()?;
                media.intervals = self.integer("`intervals` of media", 1, u32::MAX)?;
            }
            K::Samples => {
                self.next()?;
                let least = self.integer("`samples` of media", 1, u32::MAX)?;
                let most = if self.accept(Mark::Comma)? {
                    self.integer("the most `samples` of media", least, u32::MAX)?
                } else {
                    least
                };
                media.samples = [least, most];
            }
            K::AaLevel => {
                self.next()?;
                media.aa_level = self.integer("`aa_level` of media", 1, u32::MAX)?;
            }
            K::Scattering => {
                self.next()?;
                media.scattering = Some(self.scattering()?);
            }
            K::Density => {
                self.next()?;
                let density = self.density()?;
                self.charge(std::mem::size_of::<Pigment>())?;
                base.lacks.add(&density.lacks);
                media.densities.push(density.value);
            }
            _ => {
                return Ok(self.bounded_item(&mut [
                    (K::Confidence, &mut media.confidence, BELOW_ONE),
                    (K::Variance, &mut media.variance, ANY),
                    (K::Ratio, &mut media.ratio, ANY),
                    (K::AaThreshold, &mut media.aa_threshold, POSITIVE),
                    (K::Jitter, &mut media.jitter, ANY),
                ])? || self.rgb_item(&mut [
                    (K::Absorption, &mut media.absorption),
                    (K::Emission, &mut media.emission),
                ])?);
            }
        }
        Ok(true)
    }

    /// The block behind `density`.
    pub fn density(&mut self) -> Res<With<Pigment>> {
        let mut density = With::new(Pigment::solid(Color::opaque(1.0, 1.0, 1.0)));
        self.pigment_block::<Densities>("density", &mut density)?;
        Ok(density)
    }

    /// `{ kind, color ... }`
    fn scattering(&mut self) -> Res<Scattering> {
        use Keyword as K;
        let open = self.open("scattering")?;
        let kind = self.integer("the kind of `scattering`", 1, 5)? as u8;
        self.comma()?;
        let color: Rgb = self.rgb()?;
        let mut scattering = Scattering { kind, color, eccentricity: 0.0, extinction: 1.0 };
        loop {
            if self.peek()? == Token::Word(K::Eccentricity) && kind != 5 {
                return Err(
                    self.error_at_next("`eccentricity` belongs to scattering of kind 5, found it in another")
                );
            }
            if !self.bounded_item(&mut [
                (K::Eccentricity, &mut scattering.eccentricity, ANY),
                (K::Extinction, &mut scattering.extinction, NOT_NEGATIVE),
            ])? {
                break;
            }
        }
        self.close("scattering", open)?;
        Ok(scattering)
    }

    /// A medium, a density or a map of them as a value; `None` if `word` begins none.
    pub fn media_value(&mut self, word: Keyword) -> Res<Option<Value>> {
        Ok(Some(match word {
            Keyword::Media => {
                self.next()?;
                Value::Media(Arc::new(self.media()?))
            }
            Keyword::Density => {
                self.next()?;
                Value::Density(Arc::new(self.density()?))
            }
            _ => return Ok(None),
        }))
    }
}
