//! `texture`, `material` and `interior` (manual sections 3.4.6 and 3.4.7).

use super::machine::{Machine, Res};
use super::pigment::{fold, is_pattern};
use super::value::{Material, Value, With};
use crate::lang::{Keyword, Mark, Token};
use crate::scene::{Finish, Interior, Layer, Texture};
use std::sync::Arc;

/// A script may lay a texture over itself again and again (`#declare T = texture { T } texture { T }`).
const MOST_LAYERS: usize = 1_000;

impl Machine<'_> {
    /// The block behind `texture`.
    pub fn texture(&mut self) -> Res<With<Texture>> {
        self.deeper(|m| {
            let open = m.open("texture")?;
            let named = m.take_named(|value| match value {
                Value::Texture(texture) => Some(texture.copy()),
                _ => None,
            })?;
            let mut texture = named.unwrap_or_else(|| m.default_texture.clone());
            m.charge(size_of::<Layer>() * texture.value.layers.len())?;
            while m.texture_item(&mut texture)? {}
            m.close("texture", open)?;
            Ok(texture)
        })
    }

    /// Another `texture` on top of those that are there.
    pub fn layer_over(&self, below: &mut Option<With<Texture>>, mut above: With<Texture>) -> Res<()> {
        match below {
            None => *below = Some(above),
            Some(below) => {
                if below.value.layers.len() + above.value.layers.len() > MOST_LAYERS {
                    return Err(self.halt(format!("a texture of more than {MOST_LAYERS} layers")));
                }
                settle(&mut below.value);
                settle(&mut above.value);
                below.value.layers.append(&mut above.value.layers);
                below.lacks.add(&above.lacks);
            }
        }
        Ok(())
    }

    /// The declared texture, if what follows `texture` is just `{ Name }`: nothing need be copied.
    pub fn only_named_texture(&mut self) -> Res<Option<Arc<With<Arc<Texture>>>>> {
        let at = self.at as usize;
        let Some([Token::Mark(Mark::OpenBrace), Token::Name(symbol), Token::Mark(Mark::CloseBrace)]) =
            self.text.tokens.get(at..at + 3)
        else {
            return Ok(None);
        };
        let Some(Value::Texture(texture)) = self.scopes.get(*symbol) else { return Ok(None) };
        let texture = texture.clone();
        for _ in 0..3 {
            self.next()?;
        }
        Ok(Some(texture))
    }

    fn texture_item(&mut self, texture: &mut With<Texture>) -> Res<bool> {
        use Keyword as K;
        let Token::Word(word) = self.peek()? else { return Ok(false) };
        if let Some(transform) = self.transform_item(word)? {
            texture.value = texture.value.transformed(&transform);
            return Ok(true);
        }
        if self.surface_item(word, texture)? {
            return Ok(true);
        }
        let at = self.peek_lexeme()?;
        match word {
            // Patterns of whole textures.
            K::Checker | K::Brick | K::Hexagon | K::Gradient | K::Average | K::Function | K::ImagePattern => {
                self.next()?;
                texture.lacks.add(&self.lack(format!("texture {{ {} }}", word.text()), at));
                match word {
                    K::Gradient => {
                        self.vector()?;
                    }
                    K::Function | K::ImagePattern => self.block_left_out(word.text())?,
                    _ => {}
                }
                self.inner_textures(texture)?;
            }
            _ if is_pattern(word) => {
                self.next()?;
                texture.lacks.add(&self.lack(format!("texture {{ {} }}", word.text()), at));
                self.pattern_arguments(word)?;
                self.inner_textures(texture)?;
            }
            K::TextureMap | K::MaterialMap | K::Tiles | K::Warp => {
                self.next()?;
                texture.lacks.add(&self.lack(word.text(), at));
                self.block_left_out(word.text())?;
            }
            K::UvMapping | K::NoBumpScale => {
                self.next()?;
                if word == K::UvMapping {
                    texture.lacks.add(&self.lack(word.text(), at));
                }
            }
            K::BrickSize => {
                self.next()?;
                self.vector()?;
            }
            K::Mortar => {
                self.next()?;
                self.float()?;
            }
            _ => return self.modifier_of_unmodelled(word, &mut texture.lacks),
        }
        Ok(true)
    }

    /// The textures that a block pattern of textures chooses from; the first one stands in.
    fn inner_textures(&mut self, texture: &mut With<Texture>) -> Res<()> {
        let mut first = true;
        while self.peek()? == Token::Word(Keyword::Texture) {
            self.next()?;
            let inner = self.texture()?;
            texture.lacks.add(&inner.lacks);
            if std::mem::replace(&mut first, false) {
                texture.value = inner.value;
            }
            self.comma()?;
        }
        Ok(())
    }

    /// `pigment`, `finish` or `normal` in a texture or an object: changes the top layer. False if `word` is none.
    pub fn surface_item(&mut self, word: Keyword, texture: &mut With<Texture>) -> Res<bool> {
        match word {
            Keyword::Pigment => {
                self.next()?;
                settle(&mut texture.value);
                let mut pigment = With::new(std::mem::take(&mut top(&mut texture.value).pigment));
                let result = self.pigment(&mut pigment);
                top(&mut texture.value).pigment = pigment.value;
                texture.lacks.add(&pigment.lacks);
                result?;
            }
            Keyword::Finish => {
                self.next()?;
                let mut finish = With::new(Finish::clone(&top(&mut texture.value).finish));
                let result = self.finish(&mut finish);
                top(&mut texture.value).finish = Arc::new(finish.value);
                texture.lacks.add(&finish.lacks);
                result?;
            }
            Keyword::Normal => {
                let at = self.next()?;
                let lacks = self.normal(at)?;
                texture.lacks.add(&lacks);
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// The block behind `normal`, which is not modelled yet.
    pub fn normal(&mut self, at: super::machine::Lexeme) -> Res<super::value::Lacks> {
        let open = self.open("normal")?;
        if self.accept(Mark::CloseBrace)? {
            return Ok(Default::default());
        }
        let lacks = self.lack("normal", at);
        self.skip_block("normal", open)?;
        Ok(lacks)
    }

    /// The block behind `interior`: an interior of its own, which starts from the one that is named, else from `base`, what
    /// has been said so far.
    pub fn interior(&mut self, base: Option<&Interior>) -> Res<With<Arc<Interior>>> {
        self.deeper(|m| {
            let open = m.open("interior")?;
            let named = m.take_named(|value| match value {
                Value::Interior(interior) => Some(interior.clone()),
                _ => None,
            })?;
            let mut lacks = named.as_ref().map(|n| n.lacks.clone()).unwrap_or_default();
            let mut interior =
                named.map_or_else(|| base.cloned().unwrap_or_default(), |n| Interior::clone(&n.value));
            loop {
                use Keyword as K;
                let Token::Word(word) = m.peek()? else { break };
                let at = m.peek_lexeme()?;
                match word {
                    K::Ior | K::Caustics | K::FadeDistance | K::FadePower => {
                        m.next()?;
                        let value = m.finite()?;
                        *match word {
                            K::Ior => &mut interior.ior,
                            K::Caustics => &mut interior.caustics,
                            K::FadeDistance => &mut interior.fade_distance,
                            _ => &mut interior.fade_power,
                        } = value;
                    }
                    K::FadeColor | K::FadeColour => {
                        m.next()?;
                        interior.fade_color = m.rgb()?;
                    }
                    K::Dispersion => {
                        m.next()?;
                        if m.float()? != 1.0 {
                            lacks.add(&m.lack("dispersion", at));
                        }
                    }
                    K::DispersionSamples | K::Refraction => {
                        m.next()?;
                        m.float()?;
                    }
                    K::Media => {
                        m.next()?;
                        lacks.add(&m.lack_with_block(word, at)?);
                    }
                    // Media move; nothing else in an interior does.
                    _ => match m.transform_item(word)? {
                        Some(_) => {}
                        None => break,
                    },
                }
            }
            m.close("interior", open)?;
            if interior.ior == 0.0 {
                let span = m.span(m.last);
                m.warn("ior", "an `ior` of 0 counts as 1", span);
                interior.ior = 1.0;
            }
            Ok(With { value: Arc::new(interior), lacks })
        })
    }

    /// The block behind `material`.
    pub fn material(&mut self) -> Res<Material> {
        self.deeper(|m| {
            let open = m.open("material")?;
            let named = m.take_named(|value| match value {
                Value::Material(material) => Some(Material::clone(material)),
                _ => None,
            })?;
            let mut material = named.unwrap_or_default();
            while let Token::Word(word) = m.peek()? {
                match word {
                    Keyword::Texture => {
                        m.next()?;
                        let texture = m.texture()?;
                        m.layer_over(&mut material.texture, texture)?;
                    }
                    Keyword::InteriorTexture => {
                        m.next()?;
                        let texture = m.texture()?;
                        m.layer_over(&mut material.interior_texture, texture)?;
                    }
                    Keyword::Interior => {
                        m.next()?;
                        let base = material.interior.take();
                        let interior = m.interior(base.as_ref().map(|base| &*base.value))?;
                        material.interior = Some(interior);
                    }
                    Keyword::Pigment | Keyword::Finish | Keyword::Normal => {
                        let mut texture =
                            material.texture.take().unwrap_or_else(|| m.default_texture.clone());
                        m.surface_item(word, &mut texture)?;
                        material.texture = Some(texture);
                    }
                    _ => match m.transform_item(word)? {
                        Some(transform) => {
                            let sides = [&mut material.texture, &mut material.interior_texture];
                            for texture in sides.into_iter().flatten() {
                                texture.value = texture.value.transformed(&transform);
                            }
                        }
                        None => break,
                    },
                }
            }
            m.close("material", open)?;
            Ok(material)
        })
    }
}

/// The layer that `pigment` and `finish` mean: the one on top.
pub(super) fn top(texture: &mut Texture) -> &mut Layer {
    if texture.layers.is_empty() {
        texture.layers.push(Layer::default());
    }
    let last = texture.layers.len() - 1;
    &mut texture.layers[last]
}

/// Moves the texture's transform into its pigments, so that what comes next is not moved by it.
pub(super) fn settle(texture: &mut Texture) {
    if !texture.transform.is_identity() {
        for layer in &mut texture.layers {
            fold(&mut layer.pigment, &texture.transform);
        }
        texture.transform = Default::default();
    }
}
