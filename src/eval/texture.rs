//! `texture`, `material` and `interior` (manual sections 3.4.6 and 3.4.7).

use super::color::as_color;
use super::compiled::Level;
use super::machine::{Lexeme, Machine, Res};
use super::patterned::Spread;
use super::pigment::fold;
use super::value::{Lacks, Material, NamedMap, Num, Value, With};
use crate::lang::{Keyword, Mark, Token};
use crate::scene::{
    AnyPattern, BlockPattern, Finish, Image, Interior, Layer, Map, Normal, OtherPattern, Pattern, Patterned,
    Pigment, PigmentKind, Placement, Texture,
};
use glam::DVec3;
use smallvec::smallvec;
use std::sync::Arc;

/// A script may lay a texture over itself again and again (`#declare T = texture { T } texture { T }`).
const MOST_LAYERS: usize = 1_000;

/// Textures as what a pattern spreads.
pub(super) struct Textures;

impl Spread for Textures {
    type Item = Texture;
    const WORD: Keyword = Keyword::Texture;
    const MAP: Keyword = Keyword::TextureMap;

    fn body(m: &mut Machine<'_>) -> Res<With<Texture>> {
        m.texture_body()
    }

    fn named(map: &NamedMap) -> Option<&Vec<(f64, Texture)>> {
        if let NamedMap::Textures(map) = map { Some(map) } else { None }
    }

    fn to_name(entries: Vec<(f64, Texture)>) -> NamedMap {
        NamedMap::Textures(entries)
    }
}

impl Machine<'_> {
    /// The block behind `texture`.
    pub fn texture(&mut self) -> Res<With<Texture>> {
        self.deeper(|m| {
            let open = m.open("texture")?;
            let texture = m.texture_body()?;
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

    /// What stands between a texture's braces.
    fn texture_body(&mut self) -> Res<With<Texture>> {
        let named = self.take_named(|value| match value {
            Value::Texture(texture) => Some(texture.copy()),
            _ => None,
        })?;
        let mut texture = named.unwrap_or_else(|| self.default_texture.clone());
        while self.named_surface(&mut texture)? {}
        let mut draft = texture.value.patterned.take().map(|said| Patterned::clone(&said));
        while self.texture_item(&mut texture, &mut draft)? {}
        if draft.as_ref().is_some_and(|said| matches!(said.map, Map::Own)) {
            return Err(self.error_here("a pattern of textures wants a `texture_map`"));
        }
        if let Some(said) = &draft {
            self.charge_entries(&said.map)?;
        }
        texture.value.patterned = draft.map(Arc::new);
        Ok(texture)
    }

    /// The declared texture, if what follows `texture` is just `{ Name }`: nothing need be copied. What is not modelled in it goes
    /// to `lacks`.
    #[inline]
    pub fn only_named_texture(&mut self, lacks: &mut Lacks) -> Option<Arc<Texture>> {
        let at = self.at as usize;
        let Some([Token::Mark(Mark::OpenBrace), Token::Name(symbol), Token::Mark(Mark::CloseBrace)]) =
            self.text.tokens.get(at..at + 3)
        else {
            return None;
        };
        let Some(Value::Texture(texture)) = self.scopes.get(*symbol) else { return None };
        lacks.add(&texture.lacks);
        let texture = texture.value.clone();
        self.steps += 3;
        let index = self.at + 2;
        self.last = Lexeme { token: Token::Mark(Mark::CloseBrace), program: self.program, index };
        self.jump(index + 1);
        Some(texture)
    }

    /// The default texture with the colour of `pigment { rgb <1, 0, 0> }`, if that is what is next, with a colour that takes no
    /// reading. Nothing but speed: most objects of a script look like that.
    pub fn plain_pigment(&mut self) -> Option<Arc<Texture>> {
        let at = self.at as usize;
        let &[
            Token::Word(Keyword::Pigment),
            Token::Mark(Mark::OpenBrace),
            Token::Word(Keyword::Rgb),
            first,
            next,
        ] = self.text.tokens.get(at..at + 5)?
        else {
            return None;
        };
        let base = &self.default_texture.value;
        let [Layer { pigment, .. }] = &base.layers[..] else { return None };
        if !(base.transform.is_identity() && pigment.transform.is_identity()) || base.patterned.is_some() {
            return None;
        }
        let color = match first {
            Token::Vector(first, 3) if next == Token::Mark(Mark::CloseBrace) => {
                let v = &self.text.numbers[first as usize..][..3];
                let v = Num::vector(DVec3::new(v[0], v[1], v[2]));
                self.steps += 5;
                self.jump(self.at + 5);
                v
            }
            _ => self.compiled_between(self.at + 3, Level::Sum, Mark::CloseBrace)?,
        };
        let color = self.components_of(Keyword::Rgb, color);
        if !color.iter().all(|c| c.is_finite()) {
            // The reader says what is wrong.
            self.jump(at as u32);
            return None;
        }
        let base = &self.default_texture.value;
        let below = &base.layers[0];
        let pigment = Pigment { kind: PigmentKind::Solid(as_color(color)), transform: Placement::IDENTITY };
        let layer = Layer { pigment, finish: below.finish.clone(), normal: below.normal.clone() };
        Some(Arc::new(Texture {
            layers: smallvec![layer],
            patterned: None,
            uv_mapping: base.uv_mapping,
            transform: Placement::IDENTITY,
        }))
    }

    fn texture_item(
        &mut self,
        texture: &mut With<Texture>,
        draft: &mut Option<Patterned<Texture>>,
    ) -> Res<bool> {
        use Keyword as K;
        let Token::Word(word) = self.peek()? else { return Ok(false) };
        if let Some(transform) = self.transform_item(word)? {
            texture.value.transform.move_by(&transform);
            return Ok(true);
        }
        if self.surface_item(word, texture)? {
            return Ok(true);
        }
        let at = self.peek_lexeme()?;
        let none = || Patterned::new(AnyPattern::Number(Pattern::Onion));
        match word {
            K::NoBumpScale => {
                self.next()?;
                self.switch_value()?;
            }
            K::UvMapping => {
                self.next()?;
                texture.value.uv_mapping = self.switch_value()?;
                texture.lacks.add(&self.lack(word.text(), at));
            }
            K::MaterialMap | K::Tiles => {
                self.next()?;
                texture.lacks.add(&self.lack(word.text(), at));
                let mut said = none();
                said.map = Map::List(self.old_pattern(word, &mut said.pattern, &mut texture.lacks)?);
                stand_in(texture, &said);
                *draft = Some(said);
            }
            _ => {
                let before = draft.is_some();
                let mut said = draft.take().unwrap_or_else(none);
                let is_new = matches!(said.map, Map::Own);
                let found = match word {
                    _ if is_new
                        && self.pattern_with_list::<Textures>(&mut said, &mut texture.lacks)?.is_some() =>
                    {
                        texture.lacks.add(&self.lack(format!("texture {{ {} }}", self.text_of(at)), at));
                        true
                    }
                    K::TextureMap => {
                        texture.lacks.add(&self.lack(word.text(), at));
                        self.any_map::<Textures>(&mut said, &mut texture.lacks)?
                    }
                    _ => {
                        self.any_map::<Textures>(&mut said, &mut texture.lacks)?
                            || self.pattern_modifier(
                                word,
                                &mut said,
                                &mut texture.value.transform,
                                &mut texture.lacks,
                            )?
                    }
                };
                stand_in(texture, &said);
                *draft = (before || found).then_some(said);
                return Ok(found);
            }
        }
        Ok(true)
    }

    /// The blocks behind `material_map` and `tiles`, the old forms of a pattern of textures.
    fn old_pattern(
        &mut self,
        word: Keyword,
        pattern: &mut AnyPattern,
        lacks: &mut super::value::Lacks,
    ) -> Res<Vec<Texture>> {
        let open = self.open(word.text())?;
        if word == Keyword::MaterialMap {
            let mut image = Image::new(self.image_source(lacks)?);
            while self.image_item(&mut image)? {}
            *pattern = AnyPattern::Other(OtherPattern::Image(Box::new(image)));
        } else {
            *pattern = AnyPattern::Blocks(BlockPattern::Checker);
        }
        let mut list = Vec::new();
        while let Token::Word(Keyword::Texture) = self.peek()? {
            self.next()?;
            let texture = self.texture()?;
            self.charge(std::mem::size_of::<Texture>())?;
            lacks.add(&texture.lacks);
            list.push(texture.value);
            self.comma()?;
            self.accept_word(Keyword::Tile2)?;
        }
        self.close(word.text(), open)?;
        Ok(list)
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
                self.next()?;
                settle(&mut texture.value);
                let before = top(&mut texture.value).normal.take();
                let mut normal = With::new(before.map(|shared| Normal::clone(&shared)).unwrap_or_default());
                let result = self.normal(&mut normal);
                let leans = normal.value.patterned.is_some();
                top(&mut texture.value).normal = leans.then(|| Arc::new(normal.value));
                texture.lacks.add(&normal.lacks);
                result?;
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// The name of a pigment, finish or normal at the beginning of a texture stands for a block of that name alone. False if
    /// none is next.
    fn named_surface(&mut self, texture: &mut With<Texture>) -> Res<bool> {
        let named = self.take_named(|value| match value {
            Value::Pigment(_) | Value::Finish(_) | Value::Normal(_) => Some(value.clone()),
            _ => None,
        })?;
        match named {
            Some(Value::Pigment(pigment)) => {
                settle(&mut texture.value);
                top(&mut texture.value).pigment = pigment.value.clone();
                texture.lacks.add(&pigment.lacks);
            }
            Some(Value::Finish(finish)) => {
                top(&mut texture.value).finish = Arc::new(finish.value.clone());
                texture.lacks.add(&finish.lacks);
            }
            Some(Value::Normal(normal)) => {
                settle(&mut texture.value);
                let leans = normal.value.patterned.is_some();
                top(&mut texture.value).normal = leans.then(|| Arc::new(normal.value.clone()));
                texture.lacks.add(&normal.lacks);
            }
            _ => return Ok(false),
        }
        Ok(true)
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
                        interior.dispersion = m.finite()?;
                        if interior.dispersion != 1.0 {
                            lacks.add(&m.lack("dispersion", at));
                        }
                    }
                    K::DispersionSamples => {
                        m.next()?;
                        interior.dispersion_samples = m.integer("`dispersion_samples`", 2, u32::MAX)?;
                    }
                    K::Refraction => {
                        m.next()?;
                        m.float()?;
                        let message = "`refraction` has no effect: `ior` is enough";
                        m.warn("refraction", message, m.span(at));
                    }
                    K::Media => {
                        m.next()?;
                        lacks.add(&m.lack("media", at));
                        let media = m.media()?;
                        lacks.depth = lacks.depth.max(media.lacks.depth);
                        interior.media.push(media.value);
                    }
                    // Media move; nothing else in an interior does.
                    _ => match m.transform_item(word)? {
                        Some(transform) => {
                            interior.media.iter_mut().for_each(|media| media.transform.move_by(&transform));
                        }
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

/// The first of the textures that a pattern chooses from stands in for all.
fn stand_in(texture: &mut With<Texture>, said: &Patterned<Texture>) {
    if let Some(first) = said.map.items().next() {
        texture.value.layers = first.layers.clone();
    }
}

/// Moves the texture's transform into its pigments, so that what comes next is not moved by it.
pub(super) fn settle(texture: &mut Texture) {
    // A pattern of textures is moved as a whole.
    if !texture.transform.is_identity() && texture.patterned.is_none() {
        for layer in &mut texture.layers {
            fold(&mut layer.pigment, &texture.transform);
            if let Some(normal) = &mut layer.normal {
                Arc::make_mut(normal).transform.move_by(&texture.transform);
            }
        }
        texture.transform = Default::default();
    }
}
