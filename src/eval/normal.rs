//! `normal { ... }` (manual section 3.4.6.2): read into the description, not rendered.

use super::machine::{Machine, Res};
use super::patterned::Spread;
use super::value::{Lacks, NamedMap, Value, With};
use crate::lang::{Keyword, Token};
use crate::scene::{AnyPattern, Image, Map, Normal, OtherPattern, Pattern, Patterned};
use std::sync::Arc;

/// Normals as what a pattern spreads.
pub(super) struct Normals;

impl Spread for Normals {
    type Item = Normal;
    const WORD: Keyword = Keyword::Normal;
    const MAP: Keyword = Keyword::NormalMap;

    fn body(m: &mut Machine<'_>) -> Res<With<Normal>> {
        let mut normal = With::new(Normal::default());
        m.normal_body(&mut normal)?;
        Ok(normal)
    }

    fn named(map: &NamedMap) -> Option<&Vec<(f64, Normal)>> {
        if let NamedMap::Normals(map) = map { Some(map) } else { None }
    }

    fn to_name(entries: Vec<(f64, Normal)>) -> NamedMap {
        NamedMap::Normals(entries)
    }
}

impl Machine<'_> {
    /// The block behind `normal`, which changes `base`.
    pub fn normal(&mut self, base: &mut With<Normal>) -> Res<()> {
        self.deeper(|m| {
            let at = m.last;
            let open = m.open("normal")?;
            m.normal_body(base)?;
            m.close("normal", open)?;
            // A normal without a pattern changes nothing.
            base.lacks = match base.value.patterned {
                Some(_) if base.lacks.met.is_empty() => {
                    Lacks { depth: base.lacks.depth, ..m.lack("normal", at) }
                }
                Some(_) => base.lacks.clone(),
                None => Lacks::default(),
            };
            Ok(())
        })
    }

    fn normal_body(&mut self, base: &mut With<Normal>) -> Res<()> {
        if let Some(named) = self.take_named(|value| match value {
            Value::Normal(normal) => Some(With::clone(normal)),
            _ => None,
        })? {
            *base = named;
            self.normal_amount(&mut base.value)?;
        }
        let normal = &mut base.value;
        // The whole normal is what is not modelled: nobody need be told of its parts.
        let mut parts = Lacks::default();
        let mut chosen = normal.patterned.is_some();
        let mut said = match normal.patterned.take() {
            Some(said) => Patterned::clone(&said),
            None => Patterned::new(AnyPattern::Number(Pattern::Onion)),
        };
        let mut new = true;
        while let Token::Word(word) = self.peek()? {
            if let Some(transform) = self.transform_item(word)? {
                normal.transform.move_by(&transform);
            } else if new && self.pattern_with_list::<Normals>(&mut said, &mut parts)?.is_some() {
                (chosen, new) = (true, false);
                self.normal_amount(normal)?;
            } else if word == Keyword::BumpMap && new {
                self.next()?;
                let image = self.bump_map(&mut normal.amount, &mut parts)?;
                said.pattern = AnyPattern::Other(OtherPattern::Image(Box::new(image)));
                (chosen, new) = (true, false);
                self.normal_amount(normal)?;
            } else if word == Keyword::UvMapping && new {
                self.next()?;
                said.uv_mapping = self.switch_value()?;
            } else if word == Keyword::NoBumpScale {
                self.next()?;
                normal.bump_scale = !self.switch_value()?;
            } else if !self.float_item(&mut [
                (Keyword::BumpSize, &mut normal.amount),
                (Keyword::Accuracy, &mut normal.accuracy),
            ])? && !self.any_map::<Normals>(&mut said, &mut parts)?
                && !self.pattern_modifier(word, &mut said, &mut normal.transform, &mut parts)?
            {
                break;
            }
        }
        if chosen {
            if matches!((&said.pattern, &said.map), (AnyPattern::Other(OtherPattern::Average), Map::Own)) {
                return Err(self.error_here("`average` wants a `normal_map`"));
            }
            self.charge_entries(&said.map)?;
            normal.patterned = Some(Arc::new(said));
        }
        base.lacks.depth = base.lacks.depth.max(parts.depth);
        Ok(())
    }

    /// The block behind `bump_map`, which may say the amount too.
    fn bump_map(&mut self, amount: &mut f64, lacks: &mut Lacks) -> Res<Image> {
        let open = self.open("bump_map")?;
        let mut image = Image::new(self.image_source(lacks)?);
        while self.image_item(&mut image)? || self.float_item(&mut [(Keyword::BumpSize, amount)])? {}
        self.close("bump_map", open)?;
        Ok(image)
    }

    /// How far it leans, if that is said behind its pattern.
    fn normal_amount(&mut self, normal: &mut Normal) -> Res<()> {
        self.comma()?;
        if let Some(amount) = self.optional_float()? {
            normal.amount = amount;
        }
        Ok(())
    }
}
