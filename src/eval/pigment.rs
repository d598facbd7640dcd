//! `pigment { ... }`, `density { ... }` and `color_map { ... }` (manual section 3.4.6.1).

use super::machine::{Lexeme, Machine, Res};
use super::patterned::Spread;
use super::value::{Lacks, NamedMap, Value, With};
use crate::lang::{Keyword, Mark, Token};
use crate::scene::noise::Generator;
use crate::scene::{
    AnyPattern, Blocks, Color, ColorMap, Map, Mapped, OtherPattern, Pattern, Patterned, Pigment, PigmentKind,
    Transform,
};
use std::sync::Arc;

/// Some patterns come with colours of their own, which are not modelled; a map that is given later replaces them.
const UNMAPPED: &str = "pattern without a color_map of its own";

/// Pigments as what a pattern spreads.
pub(super) struct Pigments;

/// Densities of media: pigments whose words differ a little.
pub(super) struct Densities;

/// What a pigment's words have said so far.
struct Draft {
    /// One colour, unless there is a pattern.
    solid: Option<Color>,
    said: Patterned<Pigment>,
    /// The pattern whose own default map is wanted because none is given, and where it stands.
    unmapped: Option<Lexeme>,
    /// A map was given.
    mapped: bool,
    /// A colour or a pattern was given; another one is not allowed.
    chosen: bool,
    /// Something was said that makes it a pattern anew.
    changed: bool,
}

impl Spread for Pigments {
    type Item = Pigment;
    const WORD: Keyword = Keyword::Pigment;
    const MAP: Keyword = Keyword::PigmentMap;

    fn body(m: &mut Machine<'_>) -> Res<With<Pigment>> {
        let mut pigment = With::new(Pigment::default());
        m.pigment_body::<Self>(&mut pigment)?;
        Ok(pigment)
    }

    fn of_color(color: Color) -> Option<Pigment> {
        Some(Pigment::solid(color))
    }

    fn named(map: &NamedMap) -> Option<&Vec<(f64, Pigment)>> {
        if let NamedMap::Pigments(map) = map { Some(map) } else { None }
    }

    fn to_name(entries: Vec<(f64, Pigment)>) -> NamedMap {
        NamedMap::Pigments(entries)
    }
}

impl Spread for Densities {
    type Item = Pigment;
    const WORD: Keyword = Keyword::Density;
    const MAP: Keyword = Keyword::DensityMap;

    fn body(m: &mut Machine<'_>) -> Res<With<Pigment>> {
        let mut density = With::new(Pigment::solid(Color::opaque(1.0, 1.0, 1.0)));
        m.pigment_body::<Self>(&mut density)?;
        Ok(density)
    }

    fn of_color(color: Color) -> Option<Pigment> {
        Some(Pigment::solid(color))
    }

    fn named(map: &NamedMap) -> Option<&Vec<(f64, Pigment)>> {
        if let NamedMap::Densities(map) = map { Some(map) } else { None }
    }

    fn to_name(entries: Vec<(f64, Pigment)>) -> NamedMap {
        NamedMap::Densities(entries)
    }
}

impl Machine<'_> {
    /// The block behind `pigment`, which changes `base`.
    pub fn pigment(&mut self, base: &mut With<Pigment>) -> Res<()> {
        self.pigment_block::<Pigments>("pigment", base)
    }

    /// The block behind a word that wants a pigment.
    pub fn pigment_block<S: Spread<Item = Pigment>>(
        &mut self,
        what: &str,
        base: &mut With<Pigment>,
    ) -> Res<()> {
        self.deeper(|m| {
            let open = m.open(what)?;
            m.pigment_body::<S>(base)?;
            m.close(what, open)
        })
    }

    /// What stands between a pigment's braces.
    fn pigment_body<S: Spread<Item = Pigment>>(&mut self, base: &mut With<Pigment>) -> Res<()> {
        let density = S::WORD == Keyword::Density;
        if let Some(value) = self.take_named(|value| match value {
            Value::Pigment(pigment) if !density => Some(With::clone(pigment)),
            Value::Density(pigment) if density => Some(With::clone(pigment)),
            _ => None,
        })? {
            *base = value;
        }
        let at = self.last;
        if !density
            && at.token == Token::Mark(Mark::OpenBrace)
            && self.peek()? == Token::Mark(Mark::CloseBrace)
        {
            self.warn("empty pigment", "an empty `pigment` changes nothing", self.span(at));
        }
        let mut draft = Draft::of(&base.value.kind);
        while self.pigment_item::<S>(base, &mut draft)? {}
        if matches!(draft.said.map, Map::Own) {
            if matches!(draft.said.pattern, AnyPattern::Other(OtherPattern::Average)) && draft.solid.is_none()
            {
                return Err(self.error_here(format!("`average` wants a `{}`", S::MAP.text())));
            }
            if let Some(at) = draft.unmapped {
                base.lacks.add(&self.lack(UNMAPPED, at));
            }
        }
        if draft.mapped {
            self.forget(&mut base.lacks, UNMAPPED);
        }
        if draft.changed {
            self.charge_entries(&draft.said.map)?;
            base.value.kind = draft.finish();
            if matches!(base.value.kind, PigmentKind::Other { .. }) && base.lacks.met.is_empty() {
                base.lacks.add(&self.lack("a pigment of this kind", at));
            }
        }
        Ok(())
    }

    /// The block behind `pattern` in a function: a pigment that goes from black to white with the pattern's number.
    pub fn pattern_block(&mut self) -> Res<With<Pigment>> {
        let open = self.open("pattern")?;
        let mut base = With::new(Pigment::default());
        let mut draft = Draft::of(&PigmentKind::Solid(Color::default()));
        while self.pigment_item::<Pigments>(&mut base, &mut draft)? {}
        self.close("pattern", open)?;
        draft.said.map = match &draft.said.pattern {
            AnyPattern::Blocks(pattern) => {
                let grey = |i: usize| Pigment::solid(Color::opaque(i as f64, i as f64, i as f64));
                Map::List((0..pattern.color_count()).map(grey).collect())
            }
            _ => Map::Own,
        };
        base.value.kind = draft.finish();
        Ok(base)
    }

    fn pigment_item<S: Spread<Item = Pigment>>(
        &mut self,
        base: &mut With<Pigment>,
        draft: &mut Draft,
    ) -> Res<bool> {
        use Keyword as K;
        if self.starts_color()? {
            let color = self.color()?;
            // What has been said of a pattern before does not matter any more.
            base.lacks = Lacks::default();
            (draft.solid, draft.chosen, draft.changed) = (Some(color), true, true);
            return Ok(true);
        }
        let Token::Word(word) = self.peek()? else { return Ok(false) };
        if let Some(transform) = self.transform_item(word)? {
            base.value.transform.move_by(&transform);
            return Ok(true);
        }
        let at = self.peek_lexeme()?;
        if !draft.chosen
            && let Some(at) = self.pattern_with_list::<S>(&mut draft.said, &mut base.lacks)?
        {
            let name = format!("pattern {}", self.text_of(at));
            match &draft.said.pattern {
                AnyPattern::Other(OtherPattern::Average) => {
                    base.lacks.add(&self.lack(format!("{} {{ average }}", S::WORD.text()), at));
                }
                AnyPattern::Other(OtherPattern::Function(_) | OtherPattern::Callee(_)) => {
                    base.lacks.add(&self.lack("pigment { function } of patterns or pigments", at));
                }
                AnyPattern::Other(_) => base.lacks.add(&self.lack(name, at)),
                _ => {}
            }
            if let Map::List(list) = &draft.said.map
                && list.iter().any(|pigment| !matches!(pigment.kind, PigmentKind::Solid(_)))
            {
                base.lacks.add(&self.lack("patterned pigment within a block pattern", at));
            }
            // These come with maps of their own.
            let own_map = matches!(word, K::Agate | K::Bozo | K::Marble | K::Radial | K::Wood);
            draft.unmapped = own_map.then_some(at);
            (draft.solid, draft.chosen, draft.changed) = (None, true, true);
            return Ok(true);
        }
        match word {
            K::PigmentMap => base.lacks.add(&self.lack("pigment { pigment_map }", at)),
            K::QuickColor | K::QuickColour => {
                self.next()?;
                self.color()?;
                return Ok(true);
            }
            K::UvMapping if !draft.chosen => {
                self.next()?;
                draft.said.uv_mapping = self.switch_value()?;
                draft.changed = true;
                base.lacks.add(&self.lack("pigment { uv_mapping }", at));
                return Ok(true);
            }
            K::ImageMap if !draft.chosen && S::WORD == K::Pigment => {
                self.next()?;
                base.lacks.add(&self.lack("pigment { image_map }", at));
                let image = self.image(word, &mut base.lacks)?;
                draft.said.pattern = AnyPattern::Other(OtherPattern::Image(Box::new(image)));
                draft.said.map = Map::Own;
                (draft.solid, draft.chosen, draft.changed) = (None, true, true);
                return Ok(true);
            }
            _ => {}
        }
        if self.any_map::<S>(&mut draft.said, &mut base.lacks)? {
            (draft.mapped, draft.changed) = (true, true);
            return Ok(true);
        }
        let found =
            self.pattern_modifier(word, &mut draft.said, &mut base.value.transform, &mut base.lacks)?;
        draft.changed |= found;
        Ok(found)
    }

    /// The block behind `color_map`.
    pub fn color_map(&mut self) -> Res<With<ColorMap>> {
        let open = self.open("color_map")?;
        if let Some(map) = self.take_named(|value| match value {
            Value::ColorMap(map) => Some(With::clone(map)),
            _ => None,
        })? {
            self.close("color_map", open)?;
            return Ok(map);
        }
        let mut map = ColorMap::default();
        while self.accept(Mark::OpenBracket)? {
            let place = self.finite()?;
            self.comma()?;
            // An entry of the old form is two.
            self.charge(2 * std::mem::size_of::<(f64, Color)>())?;
            if self.starts_color()? {
                map.entries.push((place, self.color()?));
            } else if let Some(next_place) = self.optional_float()? {
                // Old form: `[from to color color]`.
                self.comma()?;
                map.entries.push((place, self.required_color()?));
                self.comma()?;
                map.entries.push((next_place, self.required_color()?));
            } else {
                map.entries.push((place, self.required_color()?));
            }
            self.expect(Mark::CloseBracket)?;
            self.comma()?;
        }
        if map.entries.is_empty() {
            return self.expected("`[` and an entry of the map");
        }
        self.close("color_map", open)?;
        Ok(With::new(map))
    }

    /// A pigment as a value.
    pub fn pigment_value(&mut self) -> Res<Value> {
        let mut pigment = With { value: self.default_pigment(), lacks: self.default_texture.lacks.clone() };
        self.pigment(&mut pigment)?;
        Ok(Value::Pigment(Arc::new(pigment)))
    }

    fn default_pigment(&self) -> Pigment {
        self.default_texture.value.layers.last().map(|layer| layer.pigment.clone()).unwrap_or_default()
    }
}

impl Draft {
    fn of(kind: &PigmentKind) -> Self {
        let mut draft = Draft {
            solid: None,
            said: Patterned::new(AnyPattern::Number(Pattern::Onion)),
            unmapped: None,
            mapped: false,
            chosen: false,
            changed: false,
        };
        let said = &mut draft.said;
        match kind {
            PigmentKind::Solid(color) => draft.solid = Some(*color),
            PigmentKind::Blocks(blocks) => {
                said.pattern = AnyPattern::Blocks(blocks.pattern);
                (said.wave, said.frequency, said.phase) = (blocks.wave, blocks.frequency, blocks.phase);
                said.map = Map::List(blocks.colors.iter().map(|color| Pigment::solid(*color)).collect());
            }
            PigmentKind::Mapped(mapped) => {
                let Mapped { pattern, wave, frequency, phase, generator, map } = &**mapped;
                said.noise_generator = generator.map_or(0, Generator::number);
                let (pattern, turbulence, octaves) = pattern.in_order();
                said.pattern = AnyPattern::Number(pattern);
                (said.turbulence, said.octaves) = (turbulence, octaves);
                (said.wave, said.frequency, said.phase) = (*wave, *frequency, *phase);
                said.map = Map::Colors(map.clone());
            }
            PigmentKind::Other { said: other, .. } => *said = Patterned::clone(other),
        }
        draft
    }

    fn finish(self) -> PigmentKind {
        if let Some(color) = self.solid {
            return PigmentKind::Solid(color);
        }
        rendered(&self.said).unwrap_or_else(|| {
            let stand_in = Box::new(mean(&self.said.map));
            PigmentKind::Other { said: Arc::new(self.said), stand_in }
        })
    }
}

/// A pigment as it is rendered, if it is.
fn rendered(said: &Patterned<Pigment>) -> Option<PigmentKind> {
    if said.uv_mapping || !said.warps.is_empty() {
        return None;
    }
    let generator = match said.noise_generator {
        0 => None,
        number => Some(Generator::numbered(number)?),
    };
    match &said.pattern {
        AnyPattern::Blocks(pattern) => {
            let mut colors = pattern.own_colors().to_vec();
            if let Map::List(list) = &said.map {
                for (color, pigment) in colors.iter_mut().zip(list) {
                    let PigmentKind::Solid(solid) = pigment.kind else { return None };
                    *color = solid;
                }
            }
            let (wave, frequency, phase) = (said.wave, said.frequency, said.phase);
            Some(PigmentKind::Blocks(Box::new(Blocks { pattern: *pattern, colors, wave, frequency, phase })))
        }
        AnyPattern::Number(pattern) => {
            let map = match &said.map {
                Map::Colors(map) => map.clone(),
                // Without a map: from black to white.
                Map::Own => {
                    ColorMap { entries: vec![(0.0, Color::default()), (1.0, Color::opaque(1.0, 1.0, 1.0))] }
                }
                _ => return None,
            };
            Some(PigmentKind::Mapped(Box::new(Mapped {
                pattern: pattern.clone().turbulent(said.turbulence, said.octaves),
                wave: said.wave,
                frequency: said.frequency,
                phase: said.phase,
                generator,
                map,
            })))
        }
        AnyPattern::Other(_) => None,
    }
}

/// Stands in for a pattern that is not modelled, when the user has allowed that: the mean of its map.
fn mean(map: &Map<Pigment>) -> Color {
    let of_pigment = |pigment: &Pigment| match &pigment.kind {
        PigmentKind::Solid(color) => *color,
        PigmentKind::Other { stand_in, .. } => **stand_in,
        PigmentKind::Blocks(blocks) => mean_of(blocks.colors.iter().copied()),
        PigmentKind::Mapped(mapped) => mean_of(mapped.map.entries.iter().map(|(_, color)| *color)),
    };
    match map {
        Map::Colors(map) => mean_of(map.entries.iter().map(|(_, color)| *color)),
        map => mean_of(map.items().map(of_pigment)),
    }
}

fn mean_of(colors: impl Iterator<Item = Color>) -> Color {
    let sum = |mean: Option<Color>, (index, color): (usize, Color)| {
        Some(mean.map_or(color, |mean| mean.lerp(&color, 1.0 / (index + 1) as f64)))
    };
    colors.enumerate().fold(None, sum).unwrap_or(Color::opaque(0.5, 0.5, 0.5))
}

/// The transform of a pigment whose texture has moved by `outer` since.
pub(super) fn fold(pigment: &mut Pigment, outer: &Transform) {
    if !matches!(pigment.kind, PigmentKind::Solid(_)) {
        pigment.transform.move_by(outer);
    }
}
