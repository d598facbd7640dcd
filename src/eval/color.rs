//! Colours (manual section 3.1.7): `rgb <1, 0, 0>`, `color red 1 filter .5`, `White * .5`.

use super::machine::{Machine, Res};
use super::value::{Num, Value};
use crate::lang::{Keyword, Token};
use crate::scene::{Color, Gamma, Rgb};

impl Machine<'_> {
    /// A colour where one is due: with or without `color`, also as a plain vector or float.
    pub fn color(&mut self) -> Res<Color> {
        Ok(as_color(self.color_components()?))
    }

    /// A colour of which only red, green and blue count.
    pub fn rgb(&mut self) -> Res<Rgb> {
        Ok(self.color()?.rgb)
    }

    /// A colour in a place where POV-Ray wants one.
    pub fn required_color(&mut self) -> Res<Color> {
        if !self.starts_color()? && self.no_value_follows()? {
            return self.expected("a colour");
        }
        self.color()
    }

    /// The five components. What follows a colour by keyword (`transmit .3`, `red .5`) replaces that component.
    pub fn color_components(&mut self) -> Res<[f64; 5]> {
        let mut color = [0.0; 5];
        let mut started = false;
        let mut whole = false;
        loop {
            // Once there is a colour, an old scene's next directive may need it declared.
            let next = if started { self.peek_operator()? } else { self.peek()? };
            let word = match next {
                Token::Word(word) => word,
                _ if started => break,
                _ if self.no_value_follows()? => {
                    self.missing_color();
                    break;
                }
                _ => {
                    color = self.color_expression()?;
                    (started, whole) = (true, true);
                    continue;
                }
            };
            let component = match word {
                // `color color White` is written by some tools.
                Keyword::Color | Keyword::Colour if !started => {
                    self.next()?;
                    continue;
                }
                Keyword::Red => 0,
                Keyword::Green => 1,
                Keyword::Blue => 2,
                Keyword::Filter => 3,
                Keyword::Alpha => {
                    let at = self.peek_lexeme()?;
                    self.warn("alpha", "`alpha` is an old word for `filter`", self.span(at));
                    3
                }
                Keyword::Transmit => 4,
                _ if is_rgb(word) && !whole && !started => {
                    let at = self.next()?;
                    let value = self.expr()?;
                    if matches!(word, Keyword::Rgb | Keyword::Srgb) && value.v[3..].iter().any(|c| *c != 0.0)
                    {
                        let message =
                            format!("`{}` of more than three components: it is see-through", word.text());
                        self.warn("long rgb", message, self.span(at));
                    }
                    color = self.components_of(word, value);
                    (started, whole) = (true, true);
                    continue;
                }
                _ if started => break,
                _ if self.no_value_follows()? => {
                    self.missing_color();
                    break;
                }
                _ => {
                    color = self.color_expression()?;
                    (started, whole) = (true, true);
                    continue;
                }
            };
            self.next()?;
            started = true;
            color[component] = self.float()?;
        }
        let span = self.span(self.last);
        if color.iter().any(|c| !c.is_finite()) {
            return Err(self.error("expected a colour of finite components", span));
        }
        Ok(color)
    }

    /// Without a colour where one is due all components are 0, as POV-Ray has it without a word.
    fn missing_color(&mut self) {
        let span = self.span(self.last);
        self.warn("missing color", "no colour follows: all of its components are 0", span);
    }

    /// A colour as an expression: a float stands for all five components, filter and transmit too (measured).
    fn color_expression(&mut self) -> Res<[f64; 5]> {
        Ok(self.expr()?.promoted(5))
    }

    /// What `rgb`, `rgbf`, `srgb` and the like make of the value behind them.
    pub fn components_of(&self, word: Keyword, value: Num) -> [f64; 5] {
        use Keyword as K;
        let [r, g, b, f, t] = value.v;
        let mut color = match word {
            K::Rgb | K::Srgb if value.n == 1 => [r, r, r, 0.0, 0.0],
            K::Rgbf | K::Srgbf if value.n == 1 => [r, r, r, r, 0.0],
            K::Rgbt | K::Srgbt if value.n == 1 => [r, r, r, 0.0, r],
            K::Rgbft | K::Srgbft if value.n == 1 => [r; 5],
            K::Rgbt | K::Srgbt => [r, g, b, 0.0, f],
            _ => [r, g, b, f, t],
        };
        if matches!(word, K::Srgb | K::Srgbf | K::Srgbt | K::Srgbft) {
            for c in &mut color[..3] {
                *c = self.decode_srgb(*c);
            }
        }
        color
    }

    /// An sRGB value in the scene's working space.
    fn decode_srgb(&self, value: f64) -> f64 {
        let linear = if value < 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) };
        match self.scene.globals.assumed_gamma {
            Gamma::Power(1.0) => linear,
            Gamma::Power(gamma) => linear.max(0.0).powf(1.0 / gamma),
            Gamma::Srgb | Gamma::Off => value,
        }
    }

    /// True if the next token begins a colour, which may be a plain vector or float.
    pub fn color_follows(&mut self) -> Res<bool> {
        Ok(self.starts_color()? || self.value_follows()?)
    }

    /// True if the next token begins a colour in a place where anything else might stand too.
    pub fn starts_color(&mut self) -> Res<bool> {
        use Keyword as K;
        Ok(match self.peek()? {
            Token::Word(word) => {
                is_rgb(word)
                    || matches!(
                        word,
                        K::Color
                            | K::Colour
                            | K::Red
                            | K::Green
                            | K::Blue
                            | K::Filter
                            | K::Transmit
                            | K::Alpha
                    )
            }
            Token::Name(symbol) => match self.scopes.get(symbol) {
                // A plain vector is no colour here, as in POV-Ray.
                Some(Value::Number(num)) => num.n == 5,
                Some(Value::Array(_)) => {
                    matches!(self.array_sample(symbol), Some(Value::Number(num)) if num.n == 5)
                }
                _ => false,
            },
            _ => false,
        })
    }
}

/// `rgb` and its kin.
pub(super) fn is_rgb(word: Keyword) -> bool {
    use Keyword as K;
    matches!(word, K::Rgb | K::Rgbf | K::Rgbt | K::Rgbft | K::Srgb | K::Srgbf | K::Srgbt | K::Srgbft)
}

/// Components as the scene description has them.
pub(super) fn as_color([r, g, b, f, t]: [f64; 5]) -> Color {
    Color { rgb: Rgb::new(r, g, b), filter: f, transmit: t }
}
