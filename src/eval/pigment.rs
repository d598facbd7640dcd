//! `pigment { ... }` and `color_map { ... }` (manual section 3.4.6.1).

use super::machine::{Lexeme, Machine, Res, Stop};
use super::value::{Value, With};
use crate::lang::{Keyword, Mark, Token};
use crate::scene::function::Callee;
use crate::scene::noise::Octaves;
use crate::scene::{BlockPattern, Color, ColorMap, Pattern, Pigment, PigmentKind, Transform, Wave};
use glam::DVec3;
use std::sync::Arc;

/// Some patterns come with colours of their own, which are not modelled; a map that is given later replaces them.
const UNMAPPED: &str = "pattern without a color_map of its own";

/// What a pigment's words have said so far.
struct Draft {
    kind: Kind,
    map: Option<ColorMap>,
    wave: Wave,
    frequency: f64,
    phase: f64,
    turbulence: DVec3,
    octaves: Octaves,
    /// The pattern whose own default map is wanted because none is given, and where it stands.
    unmapped: Option<Lexeme>,
    /// A map was given.
    mapped: bool,
    /// Something was said that makes it a pattern anew.
    changed: bool,
}

#[derive(Clone)]
enum Kind {
    Solid(Color),
    Blocks(BlockPattern, Vec<Color>),
    Mapped(Pattern),
    /// A pattern that is not modelled yet.
    Unknown,
}

impl Machine<'_> {
    /// The block behind `pigment`, which changes `base`.
    pub fn pigment(&mut self, base: &mut With<Pigment>) -> Res<()> {
        self.deeper(|m| {
            let open = m.open("pigment")?;
            if let Some(value) = m.take_named(|value| match value {
                Value::Pigment(pigment) => Some(With::clone(pigment)),
                _ => None,
            })? {
                *base = value;
            }
            let mut draft = Draft::of(&base.value.kind);
            while m.pigment_item(base, &mut draft)? {}
            m.close("pigment", open)?;
            if draft.map.is_none()
                && let Some(at) = draft.unmapped
            {
                base.lacks.add(&m.lack(UNMAPPED, at));
            }
            if draft.mapped {
                m.forget(&mut base.lacks, UNMAPPED);
            }
            if draft.changed {
                base.value.kind = draft.finish();
            }
            Ok(())
        })
    }

    /// The block behind `pattern` in a function: a pigment that goes from black to white with the pattern's number.
    pub fn pattern_block(&mut self) -> Res<With<Pigment>> {
        let open = self.open("pattern")?;
        let mut base = With::new(Pigment::default());
        let mut draft = Draft::of(&PigmentKind::Solid(Color::default()));
        while self.pigment_item(&mut base, &mut draft)? {}
        self.close("pattern", open)?;
        draft.map = None;
        if let Kind::Blocks(_, colors) = &mut draft.kind {
            let grey = |i: usize| Color::opaque(i as f64, i as f64, i as f64);
            colors.iter_mut().enumerate().for_each(|(i, color)| *color = grey(i));
        }
        base.value.kind = draft.finish();
        Ok(base)
    }

    /// If the next token is a name for which `pick` finds something, takes it.
    pub fn take_named<T>(&mut self, pick: impl Fn(&Value) -> Option<T>) -> Res<Option<T>> {
        let Token::Name(symbol) = self.peek()? else { return Ok(None) };
        match self.scopes.get(symbol) {
            Some(Value::Poison) => Err(Stop::Silent),
            Some(Value::Array(_)) => {
                // An element of an array: look before leaping.
                let lexeme = self.peek_lexeme()?;
                let element = self.array_sample(symbol);
                if element.as_ref().and_then(&pick).is_none() {
                    return Ok(None);
                }
                self.next()?;
                let value = self.name_value(lexeme)?;
                Ok(pick(&value))
            }
            Some(value) => {
                let picked = pick(value);
                if picked.is_some() {
                    self.next()?;
                }
                Ok(picked)
            }
            None => Ok(None),
        }
    }

    /// Some element of an array, to tell what kind of array it is.
    pub fn array_sample(&self, symbol: crate::lang::Symbol) -> Option<Value> {
        let mut value = self.scopes.get(symbol)?.clone();
        while let Value::Array(array) = &value {
            value = array.items.iter().flatten().next()?.clone();
        }
        Some(value)
    }

    fn pigment_item(&mut self, base: &mut With<Pigment>, draft: &mut Draft) -> Res<bool> {
        use Keyword as K;
        if self.starts_color()? {
            let color = self.color()?;
            draft.set(Kind::Solid(color));
            return Ok(true);
        }
        let Token::Word(word) = self.peek()? else { return Ok(false) };
        if let Some(transform) = self.transform_item(word)? {
            base.value.transform.move_by(&transform);
            return Ok(true);
        }
        let at = self.peek_lexeme()?;
        match word {
            K::Checker => {
                self.next()?;
                let colors =
                    self.color_list(base, &[Color::opaque(0.0, 0.0, 1.0), Color::opaque(0.0, 1.0, 0.0)])?;
                draft.set(Kind::Blocks(BlockPattern::Checker, colors));
            }
            K::Hexagon => {
                self.next()?;
                let defaults = [
                    Color::opaque(0.0, 0.0, 1.0),
                    Color::opaque(0.0, 1.0, 0.0),
                    Color::opaque(1.0, 0.0, 0.0),
                ];
                let colors = self.color_list(base, &defaults)?;
                draft.set(Kind::Blocks(BlockPattern::Hexagon, colors));
            }
            K::Brick => {
                self.next()?;
                let colors =
                    self.color_list(base, &[Color::opaque(0.5, 0.5, 0.5), Color::opaque(0.6, 0.15, 0.15)])?;
                let pattern = BlockPattern::Brick { size: DVec3::new(8.0, 3.0, 4.5), mortar: 0.5 };
                draft.set(Kind::Blocks(pattern, colors));
            }
            K::BrickSize => {
                self.next()?;
                let value = self.vector()?;
                if let Kind::Blocks(BlockPattern::Brick { size, .. }, _) = &mut draft.kind {
                    *size = value;
                    draft.changed = true;
                }
            }
            K::Mortar => {
                self.next()?;
                let value = self.finite()?;
                if let Kind::Blocks(BlockPattern::Brick { mortar, .. }, _) = &mut draft.kind {
                    *mortar = value;
                    draft.changed = true;
                }
            }
            K::Gradient => {
                self.next()?;
                let direction = self.vector()?;
                let Some(direction) = direction.try_normalize() else {
                    return Err(self.error_here("the direction of `gradient` must not be zero"));
                };
                draft.set(Kind::Mapped(Pattern::Gradient(direction)));
            }
            K::ColorMap | K::ColourMap => {
                self.next()?;
                let map = self.color_map()?;
                base.lacks.add(&map.lacks);
                draft.map = Some(map.value);
                draft.mapped = true;
                draft.changed = true;
            }
            K::QuickColor | K::QuickColour => {
                self.next()?;
                self.color()?;
            }
            K::PigmentMap | K::Average => {
                self.next()?;
                base.lacks.add(&self.lack(format!("pigment {{ {} }}", word.text()), at));
                if word == K::PigmentMap {
                    self.block_left_out(word.text())?;
                }
                draft.set(Kind::Unknown);
            }
            K::Function => {
                self.next()?;
                let Value::Function(called) = self.function()? else { return Ok(true) };
                base.lacks.add(&called.lacks);
                match &called.value {
                    Callee::Function(function) if function.params == 3 && !function.asks_pigments => {
                        draft.wave = Wave::Ramp;
                        draft.set(Kind::Mapped(Pattern::Function(function.clone())));
                    }
                    _ => {
                        base.lacks.add(&self.lack("pigment { function } of patterns or pigments", at));
                        draft.set(Kind::Unknown);
                    }
                }
            }
            K::ImageMap | K::UvMapping | K::PigmentPattern | K::ImagePattern => {
                self.next()?;
                base.lacks.add(&self.lack(format!("pigment {{ {} }}", word.text()), at));
                if self.peek()? == Token::Mark(Mark::OpenBrace) {
                    self.block_left_out(word.text())?;
                }
                draft.set(Kind::Unknown);
            }
            _ if simple_pattern(word).is_some() => {
                self.next()?;
                let mut pattern = simple_pattern(word).unwrap_or(Pattern::Onion);
                if let Pattern::Spiral1(arms) = &mut pattern {
                    self.comma()?;
                    *arms = self.finite()?;
                }
                draft.wave = match pattern {
                    Pattern::Marble(..) | Pattern::Wood(..) | Pattern::Spiral1(_) => Wave::Triangle,
                    _ => Wave::Ramp,
                };
                // These come with maps of their own.
                let own_map = matches!(word, K::Agate | K::Bozo | K::Marble | K::Radial | K::Wood);
                draft.unmapped = own_map.then_some(at);
                draft.set(Kind::Mapped(pattern));
            }
            _ if is_pattern(word) => {
                self.next()?;
                base.lacks.add(&self.lack(format!("pattern {}", word.text()), at));
                self.pattern_arguments(word)?;
                draft.set(Kind::Unknown);
            }
            _ => return self.pattern_modifier(word, &mut base.lacks, draft),
        }
        Ok(true)
    }

    /// A modifier of a pattern that is not modelled.
    pub fn modifier_of_unmodelled(&mut self, word: Keyword, lacks: &mut super::value::Lacks) -> Res<bool> {
        let mut draft = Draft::of(&PigmentKind::Solid(Color::default()));
        self.pattern_modifier(word, lacks, &mut draft)
    }

    /// A modifier that any pattern may have.
    fn pattern_modifier(
        &mut self,
        word: Keyword,
        lacks: &mut super::value::Lacks,
        draft: &mut Draft,
    ) -> Res<bool> {
        use Keyword as K;
        let at = self.peek_lexeme()?;
        match word {
            K::RampWave | K::TriangleWave | K::SineWave | K::ScallopWave | K::CubicWave | K::PolyWave => {
                self.next()?;
                draft.wave = match word {
                    K::RampWave => Wave::Ramp,
                    K::TriangleWave => Wave::Triangle,
                    K::SineWave => Wave::Sine,
                    K::ScallopWave => Wave::Scallop,
                    K::CubicWave => Wave::Cubic,
                    _ => Wave::Poly(self.optional_float()?.unwrap_or(1.0)),
                };
                draft.changed = true;
            }
            K::Frequency => {
                self.next()?;
                draft.frequency = self.finite()?;
                draft.changed = true;
            }
            K::Phase => {
                self.next()?;
                draft.phase = self.finite()?;
                draft.changed = true;
            }
            K::Turbulence => {
                self.next()?;
                // A float stands for all three components.
                draft.turbulence = self.vector()?;
                if draft.turbulence != DVec3::ZERO && matches!(draft.kind, Kind::Blocks(..)) {
                    lacks.add(&self.lack("turbulence of a block pattern", at));
                }
                draft.changed = true;
            }
            K::Octaves | K::Omega | K::Lambda => {
                self.next()?;
                let value = self.finite()?;
                match word {
                    // POV-Ray's bounds.
                    K::Octaves => draft.octaves.count = value.clamp(1.0, 10.0) as u32,
                    K::Omega => draft.octaves.omega = value,
                    _ => draft.octaves.lambda = value,
                }
                draft.changed = true;
            }
            K::AgateTurb => {
                self.next()?;
                let value = self.finite()?;
                if let Kind::Mapped(Pattern::Agate(strength, _)) = &mut draft.kind {
                    *strength = value;
                }
            }
            K::NoiseGenerator => {
                self.next()?;
                if self.finite()? != 2.0 {
                    lacks.add(&self.lack("noise_generator", at));
                }
            }
            K::Warp => {
                self.next()?;
                lacks.add(&self.lack("warp", at));
                self.block_left_out("warp")?;
            }
            // Details of turbulence and of patterns that are not modelled: they matter only to those.
            K::Metric
            | K::Offset
            | K::Exponent
            | K::Control0
            | K::Control1
            | K::Interpolate
            | K::Accuracy => {
                self.next()?;
                self.float()?;
            }
            K::Form => {
                self.next()?;
                self.vector()?;
            }
            K::Solid => {
                self.next()?;
                self.switch_value()?;
            }
            K::Interior | K::Exterior => {
                self.next()?;
                self.float()?;
                self.comma()?;
                self.optional_float()?;
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// What some unmodelled patterns have behind their name.
    pub fn pattern_arguments(&mut self, word: Keyword) -> Res<()> {
        use Keyword as K;
        match word {
            K::Spiral1 | K::Spiral2 | K::Tiling | K::Pavement | K::Quilted => {
                self.optional_float()?;
            }
            K::Slope | K::Aoi | K::Object | K::DensityFile | K::PigmentPattern => {
                match self.peek()? {
                    Token::Mark(Mark::OpenBrace) => self.block_left_out(word.text())?,
                    _ if word == K::DensityFile => {
                        self.next()?;
                        self.string()?;
                    }
                    _ if word == K::Slope => {
                        self.vector()?;
                    }
                    _ => {}
                };
                if word == K::Object {
                    while self.starts_color()? {
                        self.color()?;
                        self.comma()?;
                    }
                }
            }
            K::Julia | K::Mandel => self.fractal_arguments(word)?,
            K::Magnet => {
                self.comma()?;
                self.float()?;
                self.comma()?;
                match self.next()?.token {
                    Token::Word(word @ (K::Julia | K::Mandel)) => self.fractal_arguments(word)?,
                    _ => return Err(self.error_here("expected `mandel` or `julia` after `magnet`")),
                }
            }
            K::Square | K::Triangular | K::Cubic => {
                while self.starts_color()? {
                    self.color()?;
                    self.comma()?;
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn fractal_arguments(&mut self, word: Keyword) -> Res<()> {
        if word == Keyword::Julia {
            self.comma()?;
            self.vector()?;
        }
        self.comma()?;
        self.float()?;
        Ok(())
    }

    /// Skips the block of a word that has just been taken.
    pub fn block_left_out(&mut self, what: &str) -> Res<()> {
        let open = self.open(what)?;
        self.skip_block(what, open)
    }

    /// The colours of a block pattern: as many as there are, defaults for the rest.
    fn color_list(&mut self, base: &mut With<Pigment>, defaults: &[Color]) -> Res<Vec<Color>> {
        let mut colors = defaults.to_vec();
        for color in &mut colors {
            self.comma()?;
            if self.starts_color()? {
                *color = self.color()?;
            } else if self.peek()? == Token::Word(Keyword::Pigment) {
                let at = self.next()?;
                let mut inner = With::new(Pigment::default());
                self.pigment(&mut inner)?;
                base.lacks.add(&inner.lacks);
                match inner.value.kind {
                    PigmentKind::Solid(solid) => *color = solid,
                    _ => base.lacks.add(&self.lack("patterned pigment within a block pattern", at)),
                }
            } else {
                break;
            }
        }
        Ok(colors)
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
            if self.starts_color()? {
                map.entries.push((place, self.color()?));
            } else if let Some(next_place) = self.optional_float()? {
                // Old form: `[from to color color]`.
                self.comma()?;
                map.entries.push((place, self.color()?));
                self.comma()?;
                map.entries.push((next_place, self.color()?));
            } else {
                map.entries.push((place, self.color()?));
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

    /// A float, if one follows.
    pub fn optional_float(&mut self) -> Res<Option<f64>> {
        use Keyword as K;
        let follows = match self.peek()? {
            Token::Number(_) | Token::Mark(Mark::Minus | Mark::Plus | Mark::OpenParen | Mark::Not) => true,
            Token::Word(word) => {
                matches!(word, K::On | K::Off | K::True | K::False | K::Yes | K::No | K::Pi | K::Clock)
                    || super::builtin::float_function(word).is_some()
            }
            Token::Name(symbol) => match self.scopes.get(symbol) {
                Some(Value::Number(num)) => num.n == 1,
                Some(Value::Array(_)) => {
                    matches!(self.array_sample(symbol), Some(Value::Number(num)) if num.n == 1)
                }
                Some(Value::Function(_) | Value::Spline(_)) => true,
                _ => false,
            },
            _ => false,
        };
        if follows { self.float().map(Some) } else { Ok(None) }
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

    /// A lack that stands for a whole keyword whose block follows or not.
    pub fn lack_with_block(&mut self, word: Keyword, at: Lexeme) -> Res<super::value::Lacks> {
        let lacks = self.lack(word.text(), at);
        if self.peek()? == Token::Mark(Mark::OpenBrace) {
            self.block_left_out(word.text())?;
        }
        Ok(lacks)
    }
}

impl Draft {
    fn of(kind: &PigmentKind) -> Self {
        let mut draft = Draft {
            kind: Kind::Unknown,
            map: None,
            wave: Wave::Ramp,
            frequency: 1.0,
            phase: 0.0,
            turbulence: DVec3::ZERO,
            octaves: Octaves::default(),
            unmapped: None,
            mapped: false,
            changed: false,
        };
        match kind {
            PigmentKind::Solid(color) => draft.kind = Kind::Solid(*color),
            PigmentKind::Blocks { pattern, colors } => draft.kind = Kind::Blocks(*pattern, colors.clone()),
            PigmentKind::Mapped { pattern, wave, frequency, phase, map } => {
                let (pattern, turbulence, octaves) = pattern.in_order();
                draft.kind = Kind::Mapped(pattern);
                (draft.turbulence, draft.octaves) = (turbulence, octaves);
                (draft.wave, draft.frequency, draft.phase) = (*wave, *frequency, *phase);
                draft.map = Some(map.clone());
            }
        }
        draft
    }

    fn set(&mut self, kind: Kind) {
        self.kind = kind;
        self.changed = true;
    }

    fn finish(self) -> PigmentKind {
        match self.kind {
            Kind::Solid(color) => PigmentKind::Solid(color),
            Kind::Blocks(pattern, colors) => PigmentKind::Blocks { pattern, colors },
            Kind::Mapped(pattern) => PigmentKind::Mapped {
                pattern: pattern.turbulent(self.turbulence, self.octaves),
                wave: self.wave,
                frequency: self.frequency,
                phase: self.phase,
                // Without a map: from black to white.
                map: self.map.unwrap_or_else(|| ColorMap {
                    entries: vec![(0.0, Color::default()), (1.0, Color::opaque(1.0, 1.0, 1.0))],
                }),
            },
            // Stands in for a pattern that is not modelled, when the user has allowed that: the mean of its map.
            Kind::Unknown => PigmentKind::Solid(mean(self.map.as_ref())),
        }
    }
}

fn mean(map: Option<&ColorMap>) -> Color {
    let Some(map) = map.filter(|map| !map.entries.is_empty()) else { return Color::opaque(0.5, 0.5, 0.5) };
    let mut sum = map.entries[0].1;
    for (index, (_, color)) in map.entries.iter().enumerate().skip(1) {
        sum = sum.lerp(color, 1.0 / (index + 1) as f64);
    }
    sum
}

/// Patterns that are one word, or one and a number.
fn simple_pattern(word: Keyword) -> Option<Pattern> {
    use Keyword as K;
    let octaves = Octaves::default();
    Some(match word {
        K::Agate => Pattern::Agate(1.0, octaves),
        K::Boxed => Pattern::Boxed,
        K::Bozo | K::Bumps | K::Spotted => Pattern::Bozo,
        K::Cylindrical => Pattern::Cylindrical,
        K::Dents => Pattern::Dents,
        K::Granite => Pattern::Granite,
        K::Leopard => Pattern::Leopard,
        K::Marble => Pattern::Marble(0.0, octaves),
        K::Onion => Pattern::Onion,
        K::Planar => Pattern::Planar,
        K::Radial => Pattern::Radial,
        K::Spherical => Pattern::Spherical,
        K::Spiral1 => Pattern::Spiral1(0.0),
        K::Wood => Pattern::Wood(DVec3::ZERO, octaves),
        K::Wrinkles => Pattern::Wrinkles,
        _ => return None,
    })
}

/// Patterns of POV-Ray that are read; those of [`simple_pattern`] are modelled in pigments.
pub(super) fn is_pattern(word: Keyword) -> bool {
    use Keyword as K;
    matches!(
        word,
        K::Agate
            | K::Aoi
            | K::Boxed
            | K::Bozo
            | K::Bumps
            | K::Cells
            | K::Crackle
            | K::Cubic
            | K::Cylindrical
            | K::Dents
            | K::DensityFile
            | K::Facets
            | K::Granite
            | K::Julia
            | K::Leopard
            | K::Magnet
            | K::Mandel
            | K::Marble
            | K::Object
            | K::Onion
            | K::Pavement
            | K::Planar
            | K::Quilted
            | K::Radial
            | K::Ripples
            | K::Slope
            | K::Spherical
            | K::Spiral1
            | K::Spiral2
            | K::Spotted
            | K::Square
            | K::Tiling
            | K::Toroidal
            | K::Triangular
            | K::Waves
            | K::Wood
            | K::Wrinkles
    )
}

/// The transform of a pigment whose texture has moved by `outer` since.
pub(super) fn fold(pigment: &mut Pigment, outer: &Transform) {
    if !matches!(pigment.kind, PigmentKind::Solid(_)) {
        pigment.transform.move_by(outer);
    }
}
