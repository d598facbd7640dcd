//! What may be said of any pattern: waves, warps, maps (manual sections 3.4.7.2 to 3.4.7.12). The same for pigments, normals,
//! textures and densities, which are the [`Spread`]s.

use super::machine::{Lexeme, Machine, Res};
use super::pattern::{PatternWord, list_length, own_wave};
use super::value::{Lacks, NamedMap, Value, With};
use crate::lang::{Keyword, Mark, Token};
use crate::scene::noise::Octaves;
use crate::scene::{
    AnyPattern, BlockPattern, Map, OtherPattern, Pattern, Patterned, Placement, Warp, Wave, WrapKind,
};
use glam::DVec3;

/// Something that a pattern spreads over space.
pub(super) trait Spread {
    type Item: Clone;
    /// The word of its block.
    const WORD: Keyword;
    /// The word of its map.
    const MAP: Keyword;

    /// What stands between the braces of its block, or between `[place` and `]`.
    fn body(m: &mut Machine<'_>) -> Res<With<Self::Item>>;

    /// What a colour is in its place; `None` if it is none.
    fn of_color(_: crate::scene::Color) -> Option<Self::Item> {
        None
    }

    /// A declared map of its kind.
    fn named(map: &NamedMap) -> Option<&Entries<Self::Item>>;

    /// A map to be declared.
    fn to_name(entries: Entries<Self::Item>) -> NamedMap;
}

/// Patterns within patterns: a script can go deeper than braces (`#declare P = pigment { pigment_pattern { P } }`).
const DEEPEST: u32 = 100;

/// Places or weights, and what stands there.
type Entries<T> = Vec<(f64, T)>;

/// Bytes of an entry of a map, about; for the memory limit.
const ENTRY_BYTES: usize = 500;

impl Machine<'_> {
    /// A pattern and the things it chooses from, which replace what `said` had. `None` if no pattern is next.
    pub fn pattern_with_list<S: Spread>(
        &mut self,
        said: &mut Patterned<S::Item>,
        lacks: &mut Lacks,
    ) -> Res<Option<Lexeme>> {
        let mut inner = Lacks::default();
        let Some(PatternWord { pattern, at, open }) = self.pattern_word(&mut inner)? else { return Ok(None) };
        if matches!(pattern, AnyPattern::Other(OtherPattern::Facets { .. })) && S::WORD != Keyword::Normal {
            return Err(self.error("the pattern `facets` is for a `normal` alone", self.span(at)));
        }
        // What else has been said stays, also the wave (measured in POV-Ray 3.7).
        said.wave = own_wave(&pattern).unwrap_or(said.wave);
        if matches!(said.map, Map::List(_)) {
            said.map = Map::Own;
        }
        if let Some(length) = list_length(&pattern) {
            said.frequency = 0.0;
            said.map = Map::List(self.pattern_list::<S>(length, &mut inner)?);
        }
        said.pattern = pattern;
        if let Some(open) = open {
            self.close("object", open)?;
        }
        self.nest(inner, lacks)?;
        Ok(Some(at))
    }

    /// Takes in what is not modelled in the parts of a pattern.
    fn nest(&mut self, inner: Lacks, lacks: &mut Lacks) -> Res<()> {
        if inner.depth >= DEEPEST {
            return Err(self.halt(format!("patterns within each other more than {DEEPEST} levels deep")));
        }
        lacks.add(&Lacks { depth: inner.depth + 1, ..inner });
        Ok(())
    }

    /// Counts the memory of a map that is kept.
    pub fn charge_entries<T>(&mut self, map: &Map<T>) -> Res<()> {
        self.charge(map.items().count() * ENTRY_BYTES)
    }

    /// Up to `length` colours or blocks, all of one kind.
    fn pattern_list<S: Spread>(&mut self, length: usize, lacks: &mut Lacks) -> Res<Vec<S::Item>> {
        let mut list = Vec::new();
        let mut blocks = false;
        while list.len() < length {
            self.comma()?;
            if self.peek()? == Token::Word(S::WORD) && (blocks || list.is_empty()) {
                blocks = true;
                self.next()?;
                let open = self.open(S::WORD.text())?;
                let item = self.deeper(|m| S::body(m))?;
                self.close(S::WORD.text(), open)?;
                lacks.add(&item.lacks);
                list.push(item.value);
            } else if !blocks && S::of_color(Default::default()).is_some() && self.color_follows()? {
                list.extend(S::of_color(self.color()?));
            } else {
                break;
            }
        }
        Ok(list)
    }

    /// The block behind the word of a map: `[place body]` and so on, or the name of one. Instead of places there may be weights,
    /// which may be left out.
    pub fn blend_map<S: Spread>(&mut self, weights: bool) -> Res<With<Entries<S::Item>>> {
        let what = S::MAP.text();
        let open = self.open(what)?;
        let named = self.take_named(|value| match value {
            Value::Map(map) => {
                S::named(&map.value).map(|map_| With { value: map_.clone(), lacks: map.lacks.clone() })
            }
            _ => None,
        })?;
        if let Some(map) = named {
            self.close(what, open)?;
            return Ok(map);
        }
        let mut map = With::new(Vec::new());
        while self.accept(Mark::OpenBracket)? {
            let place = match weights {
                true => self.optional_float()?.unwrap_or(1.0),
                false => self.finite()?,
            };
            self.comma()?;
            let item = self.deeper(|m| S::body(m))?;
            self.charge(ENTRY_BYTES)?;
            map.lacks.add(&item.lacks);
            map.value.push((place, item.value));
            self.expect(Mark::CloseBracket)?;
            self.comma()?;
        }
        if map.value.is_empty() {
            return self.expected("`[` and an entry of the map");
        }
        self.close(what, open)?;
        Ok(map)
    }

    /// A map of this or another kind, if one is next: `color_map`, `slope_map`, `pigment_map`, ... False if none is.
    pub fn any_map<S: Spread>(&mut self, said: &mut Patterned<S::Item>, lacks: &mut Lacks) -> Res<bool> {
        use Keyword as K;
        let at = self.peek_lexeme()?;
        let Token::Word(
            word @ (K::ColorMap
            | K::ColourMap
            | K::PigmentMap
            | K::NormalMap
            | K::TextureMap
            | K::DensityMap
            | K::SlopeMap),
        ) = at.token
        else {
            return Ok(false);
        };
        let colors = matches!(word, K::ColorMap | K::ColourMap);
        let fits = match word {
            _ if colors => S::of_color(Default::default()).is_some(),
            K::SlopeMap => S::WORD == K::Normal,
            _ => word == S::MAP,
        };
        if !fits {
            let message = format!("`{}` cannot be used in a `{}`", word.text(), S::WORD.text());
            return Err(self.error(message, self.span(at)));
        }
        if list_length(&said.pattern).is_some() {
            let message = format!("`{}` cannot be used with a pattern of blocks", word.text());
            return Err(self.error(message, self.span(at)));
        }
        self.next()?;
        if colors {
            let map = self.color_map()?;
            lacks.add(&map.lacks);
            said.map = Map::Colors(map.value);
        } else if word == K::SlopeMap {
            said.map = Map::Slopes(self.slope_map()?);
        } else {
            let weights = matches!(said.pattern, AnyPattern::Other(OtherPattern::Average));
            let map = self.blend_map::<S>(weights)?;
            self.nest(map.lacks, lacks)?;
            said.map = Map::Entries(map.value);
        }
        Ok(true)
    }

    /// The block behind `slope_map`: `[place <height, slope>]` and so on, or the name of one.
    pub fn slope_map(&mut self) -> Res<Vec<[f64; 3]>> {
        let open = self.open("slope_map")?;
        let named = self.take_named(|value| match value {
            Value::Map(map) => match &map.value {
                NamedMap::Slopes(slopes) => Some(slopes.clone()),
                _ => None,
            },
            _ => None,
        })?;
        let mut map = named.unwrap_or_default();
        while self.accept(Mark::OpenBracket)? {
            let place = self.finite()?;
            self.comma()?;
            let [height, slope] = self.pair("a height and a slope")?;
            self.charge(std::mem::size_of::<[f64; 3]>())?;
            map.push([place, height, slope]);
            self.expect(Mark::CloseBracket)?;
            self.comma()?;
        }
        if map.is_empty() {
            return self.expected("`[` and an entry of the map");
        }
        self.close("slope_map", open)?;
        Ok(map)
    }

    /// A vector of two components.
    pub fn pair(&mut self, what: &str) -> Res<[f64; 2]> {
        let start = self.peek_lexeme()?;
        let value = self.expr()?;
        if value.n > 2 {
            let span = self.span(start).to(self.span(self.last));
            return Err(self.error(format!("expected {what}, two components, found {}", value.n), span));
        }
        let [a, b, ..] = value.promoted(2);
        Ok([a, b])
    }

    /// A modifier that a pattern at `place` may have. False if the next word is none.
    pub fn pattern_modifier<T>(
        &mut self,
        word: Keyword,
        said: &mut Patterned<T>,
        place: &mut Placement,
        lacks: &mut Lacks,
    ) -> Res<bool> {
        use Keyword as K;
        let at = self.peek_lexeme()?;
        if let Some(wave) = wave(word) {
            self.next()?;
            said.wave = match wave {
                Wave::Poly(usual) => {
                    let before = if let Wave::Poly(before) = said.wave { before } else { usual };
                    Wave::Poly(self.optional_float()?.unwrap_or(before))
                }
                wave => wave,
            };
            return Ok(true);
        }
        match word {
            K::Frequency | K::Phase => {
                self.next()?;
                let value = self.finite()?;
                *if word == K::Phase { &mut said.phase } else { &mut said.frequency } = value;
            }
            K::Turbulence => {
                self.next()?;
                // A float stands for all three components.
                said.turbulence = self.vector()?;
                if said.turbulence != DVec3::ZERO && list_length(&said.pattern).is_some() {
                    lacks.add(&self.lack("turbulence of a block pattern", at));
                }
            }
            K::Octaves | K::Omega | K::Lambda => {
                self.octaves_item(&mut said.octaves)?;
            }
            K::NoiseGenerator => {
                self.next()?;
                said.noise_generator = self.integer("`noise_generator`", 0, 3)? as u8;
                if said.noise_generator == 3 {
                    lacks.add(&self.lack("noise_generator", at));
                }
            }
            K::Warp => {
                self.next()?;
                lacks.add(&self.lack("warp", at));
                let open = self.open("warp")?;
                let warp = self.warp()?;
                self.close("warp", open)?;
                self.charge(std::mem::size_of::<Warp>())?;
                if !place.is_identity() {
                    // What has been said so far moves what is within the warp.
                    said.warps.push(Warp::Transform(Box::new(**place)));
                    *place = Placement::IDENTITY;
                }
                said.warps.push(warp);
            }
            _ => return self.modifier_of_one(word, &mut said.pattern),
        }
        Ok(true)
    }

    /// `octaves`, `omega` or `lambda`. False if none is next.
    pub fn octaves_item(&mut self, octaves: &mut Octaves) -> Res<bool> {
        use Keyword as K;
        let Token::Word(word @ (K::Octaves | K::Omega | K::Lambda)) = self.peek()? else { return Ok(false) };
        self.next()?;
        let value = self.finite()?;
        match word {
            // POV-Ray's bounds.
            K::Octaves => octaves.count = value.clamp(1.0, 10.0) as u32,
            K::Omega => octaves.omega = value,
            _ => octaves.lambda = Octaves::kept(value),
        }
        Ok(true)
    }

    /// A modifier that only one pattern has, or two.
    fn modifier_of_one(&mut self, word: Keyword, pattern: &mut AnyPattern) -> Res<bool> {
        use Keyword as K;
        use OtherPattern as O;
        let owner = match word {
            K::AgateTurb => "agate",
            K::BrickSize | K::Mortar => "brick",
            K::Metric | K::Offset | K::Solid => "crackle",
            K::Form => "crackle` or `pavement",
            K::Control0 | K::Control1 => "quilted",
            K::Exponent => "mandel` or `julia",
            K::Exterior | K::Interior => "mandel`, `julia` or `pavement",
            K::Interpolate => "density_file",
            K::Size | K::Coords => "facets",
            K::NumberOfSides | K::NumberOfTiles | K::Pattern => "pavement",
            _ => return Ok(false),
        };
        let at = self.next()?;
        match (pattern, word) {
            (AnyPattern::Blocks(BlockPattern::Brick { size, .. }), K::BrickSize) => *size = self.vector()?,
            (AnyPattern::Blocks(BlockPattern::Brick { mortar, .. }), K::Mortar) => *mortar = self.finite()?,
            (AnyPattern::Number(Pattern::Agate(strength, _)), K::AgateTurb) => *strength = self.finite()?,
            (AnyPattern::Other(other), _) => match (other, word) {
                (O::Crackle { form, .. }, K::Form) => *form = self.vector()?,
                (O::Crackle { metric, .. }, K::Metric) => *metric = self.finite()?,
                (O::Crackle { offset, .. }, K::Offset) => *offset = self.finite()?,
                (O::Crackle { solid, .. }, K::Solid) => *solid = self.switch_value()?,
                (O::Quilted([control, _]), K::Control0) => *control = self.finite()?,
                (O::Quilted([_, control]), K::Control1) => *control = self.finite()?,
                (O::Facets { size, .. }, K::Size) => *size = self.finite()?,
                (O::Facets { coords, .. }, K::Coords) => *coords = Some(self.finite()?),
                (O::DensityFile { interpolate, .. }, K::Interpolate) => {
                    *interpolate = self.integer("`interpolate`", 0, 2)? as u8;
                }
                (O::Fractal(fractal), K::Exponent) => fractal.exponent = self.finite()? as u8,
                (O::Fractal(fractal), K::Exterior | K::Interior) => {
                    let (kind, most) = match word {
                        K::Exterior => (&mut fractal.exterior, 8),
                        _ => (&mut fractal.interior, 6),
                    };
                    let number = self.integer(&format!("the kind of `{}`", word.text()), 0, most)?;
                    self.comma()?;
                    *kind = (number as u8, self.optional_float()?.unwrap_or(1.0));
                }
                (O::Pavement { sides, tiles, pattern, exterior, interior, form }, _) => {
                    let (place, least, most) = match word {
                        K::NumberOfSides => (sides, 3, 6),
                        K::NumberOfTiles => (tiles, 1, 6),
                        K::Pattern => (pattern, 1, 22),
                        K::Exterior => (exterior, 0, 2),
                        K::Interior => (interior, 0, 2),
                        K::Form => (form, 0, 4),
                        _ => return self.only_of(owner, word, at),
                    };
                    *place = self.integer(&format!("`{}` of a pavement", word.text()), least, most)? as u8;
                }
                _ => return self.only_of(owner, word, at),
            },
            _ => return self.only_of(owner, word, at),
        }
        Ok(true)
    }

    fn only_of<T>(&self, owner: &str, word: Keyword, at: Lexeme) -> Res<T> {
        let message = format!("`{}` belongs to the pattern `{owner}`", word.text());
        Err(self.error(message, self.span(at)))
    }

    /// What stands between the braces of a `warp` (manual section 3.4.7.12).
    fn warp(&mut self) -> Res<Warp> {
        use Keyword as K;
        let at = self.next()?;
        let Token::Word(word) = at.token else { return Err(self.error_here("expected the kind of a warp")) };
        Ok(match word {
            K::Turbulence => {
                let (mut amount, mut octaves) = (self.vector()?, Default::default());
                loop {
                    if self.accept_word(K::Turbulence)? {
                        amount = self.vector()?;
                    } else if !self.octaves_item(&mut octaves)? {
                        break Warp::Turbulence { amount, octaves };
                    }
                }
            }
            K::Repeat => {
                let width = self.vector()?;
                if width.cmpne(DVec3::ZERO).bitmask().count_ones() != 1 {
                    return Err(self.error_here("a warp repeats along one axis, found none or more than one"));
                }
                let [mut offset, mut flip] = [DVec3::ZERO; 2];
                while self.vector_item(&mut [(K::Offset, &mut offset), (K::Flip, &mut flip)])? {}
                Warp::Repeat { width, offset, flip }
            }
            K::BlackHole => {
                let center = self.vector()?;
                self.comma()?;
                let radius = self.finite()?;
                let (mut falloff, mut strength, mut inverse) = (2.0, 1.0, false);
                let mut repeat = DVec3::ZERO;
                let mut turbulence = DVec3::ZERO;
                loop {
                    if self.accept_word(K::Inverse)? {
                        inverse = self.switch_value()?;
                    } else if !self
                        .float_item(&mut [(K::Falloff, &mut falloff), (K::Strength, &mut strength)])?
                        && !self
                            .vector_item(&mut [(K::Repeat, &mut repeat), (K::Turbulence, &mut turbulence)])?
                    {
                        break;
                    }
                }
                let repeat = (repeat != DVec3::ZERO).then_some(repeat);
                Warp::BlackHole { center, radius, falloff, strength, repeat, turbulence, inverse }
            }
            K::Cylindrical | K::Spherical | K::Toroidal | K::Planar => {
                let about = match word {
                    K::Cylindrical => WrapKind::Cylinder,
                    K::Spherical => WrapKind::Sphere,
                    K::Toroidal => WrapKind::Torus,
                    _ => WrapKind::Plane,
                };
                let (mut orientation, mut distance_exponent, mut major_radius) = (DVec3::Z, 0.0, 1.0);
                let mut distance = 0.0;
                if about == WrapKind::Plane && self.peek()? != Token::Mark(Mark::CloseBrace) {
                    orientation = self.vector()?;
                    self.comma()?;
                    distance = self.finite()?;
                }
                while self.vector_item(&mut [(K::Orientation, &mut orientation)])?
                    || self.float_item(&mut [
                        (K::DistExp, &mut distance_exponent),
                        (K::MajorRadius, &mut major_radius),
                    ])?
                {}
                Warp::Wrap { about, orientation, distance_exponent, major_radius, distance }
            }
            K::Cubic => Warp::Cubic,
            _ => {
                let message = format!("expected the kind of a warp, found `{}`", word.text());
                return Err(self.error(message, self.span(at)));
            }
        })
    }
}

/// A wave's word.
fn wave(word: Keyword) -> Option<Wave> {
    use Keyword as K;
    Some(match word {
        K::RampWave => Wave::Ramp,
        K::TriangleWave => Wave::Triangle,
        K::SineWave => Wave::Sine,
        K::ScallopWave => Wave::Scallop,
        K::CubicWave => Wave::Cubic,
        K::PolyWave => Wave::Poly(1.0),
        _ => return None,
    })
}
