//! The patterns: their words and what stands behind each (manual section 3.4.7.1).

use super::machine::{Lexeme, Machine, Res};
use super::value::{Lacks, Value, With};
use crate::lang::{Keyword, Mark, Token};
use crate::scene::function::Callee;
use crate::scene::noise::Octaves;
use crate::scene::{AnyPattern, BlockPattern, Fractal, OtherPattern, Pattern, Pigment, Wave};
use glam::DVec3;

/// A pattern as it is met.
pub(super) struct PatternWord {
    pub pattern: AnyPattern,
    /// Its word.
    pub at: Lexeme,
    /// A brace that is still open: what the pattern chooses from stands inside.
    pub open: Option<Lexeme>,
}

impl Machine<'_> {
    /// A pattern's word and its arguments, if one is next. What in the arguments is not modelled goes to `lacks`.
    pub fn pattern_word(&mut self, lacks: &mut Lacks) -> Res<Option<PatternWord>> {
        use Keyword as K;
        let at = self.peek_lexeme()?;
        let Token::Word(word) = at.token else { return Ok(None) };
        if let Some(simple) = simple_pattern(word) {
            self.next()?;
            return Ok(Some(PatternWord { pattern: simple, at, open: None }));
        }
        if !matches!(
            word,
            K::Gradient
                | K::Spiral1
                | K::Spiral2
                | K::Tiling
                | K::Julia
                | K::Mandel
                | K::Magnet
                | K::Slope
                | K::Object
                | K::PigmentPattern
                | K::DensityFile
                | K::ImagePattern
                | K::Function
        ) {
            return Ok(None);
        }
        self.next()?;
        let mut brace = None;
        let number = |pattern| Ok(Some(PatternWord { pattern: AnyPattern::Number(pattern), at, open: None }));
        let other = match word {
            K::Gradient => {
                let start = self.peek_lexeme()?;
                let direction = self.vector()?.try_normalize();
                if direction.is_none() {
                    let message = "the direction of `gradient` is zero: it has the first colour of its map";
                    let span = self.span(start).to(self.span(self.last));
                    self.warn("direction", message, span);
                }
                // POV-Ray divides by its length: the pattern is no number anywhere, whatever its phase (measured).
                let direction = direction.unwrap_or(DVec3::NAN);
                return number(Pattern::Gradient(direction));
            }
            K::Spiral1 => {
                self.comma()?;
                return number(Pattern::Spiral1(self.finite()?, 0.0, Octaves::default()));
            }
            K::Spiral2 => {
                self.comma()?;
                OtherPattern::Spiral2(self.finite()?)
            }
            K::Tiling => OtherPattern::Tiling(self.integer("the number of a tiling", 1, 27)? as u8),
            K::Julia | K::Mandel => OtherPattern::Fractal(self.fractal(word, 0)?),
            K::Magnet => {
                let kind = self.integer("the kind of magnet fractal", 1, 2)? as u8;
                match self.next()?.token {
                    Token::Word(word @ (K::Julia | K::Mandel)) => {
                        OtherPattern::Fractal(self.fractal(word, kind)?)
                    }
                    _ => return Err(self.error_here("expected `mandel` or `julia` after `magnet`")),
                }
            }
            K::Slope => self.slope()?,
            K::Object => {
                let open = self.open("object")?;
                let object = self.any_object()?;
                lacks.add(&object.lacks);
                // Its two colours or pigments stand within the same braces: the caller reads them, and closes.
                brace = Some(open);
                OtherPattern::Object(object.object)
            }
            K::PigmentPattern => {
                let mut pigment = With::new(Pigment::default());
                self.pigment_block::<super::pigment::Pigments>("pigment_pattern", &mut pigment)?;
                lacks.add(&pigment.lacks);
                OtherPattern::Pigment(Box::new(pigment.value))
            }
            K::DensityFile => {
                if !self.accept_word(K::Df3)? {
                    return self.expected("`df3` and the name of a file");
                }
                OtherPattern::DensityFile { name: self.file_name()?.to_string(), interpolate: 0 }
            }
            K::ImagePattern => OtherPattern::Image(Box::new(self.image(word, lacks)?)),
            _ => {
                let Value::Function(called) = self.function()? else { return Ok(None) };
                lacks.add(&called.lacks);
                match &called.value {
                    Callee::Function(function) if function.params == 3 && !function.asks_pigments => {
                        return number(Pattern::Function(function.clone()));
                    }
                    Callee::Function(function) if function.params == 3 => {
                        OtherPattern::Function(function.clone())
                    }
                    Callee::Function(function) => {
                        let message = format!(
                            "a function that makes a pattern takes 3 parameters, found one of {}",
                            function.params
                        );
                        return Err(self.error(message, self.span(at)));
                    }
                    callee => OtherPattern::Callee(Box::new(callee.clone())),
                }
            }
        };
        Ok(Some(PatternWord { pattern: AnyPattern::Other(other), at, open: brace }))
    }

    /// What stands behind `julia` or `mandel`.
    fn fractal(&mut self, word: Keyword, magnet: u8) -> Res<Fractal> {
        let mut julia = None;
        if word == Keyword::Julia {
            let value = self.expr()?;
            if !matches!(value.n, 1 | 2) {
                return Err(self.error_here("expected a vector of two components after `julia`"));
            }
            let [x, y, ..] = value.promoted(2);
            julia = Some([x, y]);
            self.comma()?;
        } else {
            self.comma()?;
        }
        let iterations = self.finite()?.clamp(0.0, f64::from(u32::MAX)) as u32;
        Ok(Fractal { julia, magnet, exponent: 2, iterations, exterior: (1, 1.0), interior: (0, 1.0) })
    }

    /// `slope y`, or `slope { y, from, to altitude y, from, to }`.
    fn slope(&mut self) -> Res<OtherPattern> {
        let open = self.accept(Mark::OpenBrace)?.then_some(self.last);
        let direction = self.vector()?;
        let mut range = [0.0, 1.0];
        let mut altitude = None;
        if let Some(open) = open {
            self.optional_range(&mut range)?;
            if self.accept_word(Keyword::Altitude)? {
                let along = self.vector()?;
                let mut heights = [0.0, 1.0];
                self.optional_range(&mut heights)?;
                altitude = Some((along, heights));
            }
            self.close("slope", open)?;
        }
        Ok(OtherPattern::Slope { direction, range, altitude })
    }

    /// `[,] from, to`, if that follows.
    fn optional_range(&mut self, range: &mut [f64; 2]) -> Res<()> {
        self.comma()?;
        if let Some(from) = self.optional_float()? {
            self.comma()?;
            *range = [from, self.finite()?];
        }
        Ok(())
    }

    /// A whole number between two bounds; what it is, for the message.
    pub fn integer(&mut self, what: &str, least: u32, most: u32) -> Res<u32> {
        let value = self.finite()?;
        if !(f64::from(least)..f64::from(most) + 1.0).contains(&value) {
            let bounds = match most {
                u32::MAX => format!("at least {least}"),
                most => format!("from {least} to {most}"),
            };
            return Err(self.error_here(format!("{what} must be {bounds}, found {value}")));
        }
        Ok(value as u32)
    }
}

/// The wave that comes with a pattern.
pub(super) fn own_wave(pattern: &AnyPattern) -> Option<Wave> {
    match pattern {
        AnyPattern::Number(Pattern::Marble(..) | Pattern::Wood(..) | Pattern::Spiral1(..))
        | AnyPattern::Other(OtherPattern::Spiral2(_)) => Some(Wave::Triangle),
        _ => None,
    }
}

/// How many things a pattern chooses from, if it chooses from a list.
pub(super) fn list_length(pattern: &AnyPattern) -> Option<usize> {
    match pattern {
        AnyPattern::Blocks(pattern) => Some(pattern.color_count()),
        AnyPattern::Other(OtherPattern::Object(_)) => Some(2),
        AnyPattern::Other(OtherPattern::Square) => Some(4),
        AnyPattern::Other(OtherPattern::Triangular | OtherPattern::Cubic) => Some(6),
        _ => None,
    }
}

/// Patterns that are one word.
fn simple_pattern(word: Keyword) -> Option<AnyPattern> {
    use Keyword as K;
    use OtherPattern as O;
    let octaves = Octaves::default();
    let number = match word {
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
        K::Wood => Pattern::Wood(DVec3::ZERO, octaves),
        K::Wrinkles => Pattern::Wrinkles,
        K::Checker => return Some(AnyPattern::Blocks(BlockPattern::Checker)),
        K::Hexagon => return Some(AnyPattern::Blocks(BlockPattern::Hexagon)),
        K::Brick => {
            let size = DVec3::new(8.0, 3.0, 4.5);
            return Some(AnyPattern::Blocks(BlockPattern::Brick { size, mortar: 0.5 }));
        }
        _ => {
            return Some(AnyPattern::Other(match word {
                K::Aoi => O::Aoi,
                K::Average => O::Average,
                K::Cells => O::Cells,
                K::Crackle => {
                    let form = DVec3::new(-1.0, 1.0, 0.0);
                    O::Crackle { form, metric: 2.0, offset: 0.0, solid: false }
                }
                K::Cubic => O::Cubic,
                K::Facets => O::Facets { size: 1.0, coords: None },
                K::Pavement => {
                    O::Pavement { sides: 3, tiles: 1, pattern: 1, exterior: 0, interior: 0, form: 0 }
                }
                K::Quilted => O::Quilted([1.0, 1.0]),
                K::Ripples => O::Ripples,
                K::Square => O::Square,
                K::Toroidal => O::Toroidal,
                K::Triangular => O::Triangular,
                K::Waves => O::Waves,
                _ => return None,
            }));
        }
    };
    Some(AnyPattern::Number(number))
}
