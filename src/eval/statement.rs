//! The statements of a scene file, and everything that can stand to the right of `#declare Name =`.

use super::color::is_rgb;
use super::machine::{Machine, Res};
use super::normal::Normals;
use super::object::is_object;
use super::patterned::Spread;
use super::pigment::{Densities, Pigments};
use super::string::is_string_function;
use super::texture::Textures;
use super::value::{NamedMap, Num, Value, With};
use crate::lang::{Keyword, Mark, Token};
use crate::scene::noise::Generator;
use crate::scene::{Finish, Gamma, Normal, Opacity};
use std::sync::Arc;

/// From this version on noise is corrected to fill its range.
const FIRST_CORRECTED: f64 = 3.5;

impl Machine<'_> {
    /// Runs the scene to its end, whatever is wrong in it.
    pub fn run(&mut self) {
        loop {
            self.braces = 0;
            match self.statement() {
                Ok(true) => {}
                Ok(false) => break,
                Err(stop) => {
                    if !self.report(stop) || !self.resume() {
                        break;
                    }
                }
            }
        }
        // The last version that was said holds for the whole picture.
        if self.version < 3.7 {
            let globals = &mut self.scene.globals;
            globals.opacity = Opacity::Filtered;
            if !self.gamma_set {
                globals.assumed_gamma = Gamma::Off;
            }
        }
        if self.version < FIRST_CORRECTED && !self.generator_set {
            self.scene.globals.noise_generator = Generator::Original;
        }
        self.count_warnings();
        self.advise();
    }

    /// After an error: goes on to the end of the statement it was in. False if there is no more.
    fn resume(&mut self) -> bool {
        self.expand = true;
        loop {
            let in_block = self.braces > 0;
            let step = self.peek().and_then(|token| {
                let begins = matches!(token, Token::Word(word) if begins_statement(word));
                if token == Token::End || (!in_block && begins) { Ok(None) } else { self.next().map(Some) }
            });
            match step {
                Ok(None) => return self.peek().is_ok_and(|token| token != Token::End),
                Ok(Some(lexeme)) => match lexeme.token {
                    Token::Mark(Mark::CloseBrace) if self.braces == 0 => return true,
                    Token::Mark(Mark::Semicolon) if !in_block => return true,
                    _ => {}
                },
                Err(stop) => {
                    if !self.report(stop) {
                        return false;
                    }
                }
            }
        }
    }

    /// One statement; false at the end of the scene.
    fn statement(&mut self) -> Res<bool> {
        let at = self.peek_lexeme()?;
        let word = match at.token {
            Token::End => return Ok(false),
            Token::Word(word) => word,
            Token::Name(_) => {
                return match self.named_object()? {
                    Some(object) => {
                        self.place(object)?;
                        Ok(true)
                    }
                    None => self.expected("an object, a light, a camera or a directive"),
                };
            }
            _ => return self.expected("an object, a light, a camera or a directive"),
        };
        match word {
            Keyword::Camera => {
                self.next()?;
                let spec = self.camera()?;
                self.miss(&spec.lacks);
                self.scene.camera = self.finish_camera(&spec, at)?;
                if self.camera_set {
                    self.warn("cameras", "more than one camera: the last one counts", self.span(at));
                }
                self.camera_set = true;
            }
            Keyword::Background => {
                self.next()?;
                let open = self.open("background")?;
                let mut color = self.color()?;
                self.close("background", open)?;
                // Without alpha output POV-Ray lets the background's transmit share be black.
                color.rgb *= 1.0 - color.transmit;
                self.scene.background = color;
            }
            Keyword::GlobalSettings => {
                self.next()?;
                self.global_settings()?;
            }
            _ if self.atmosphere(word, at)? => {}
            _ => match self.object()? {
                Some(object) => self.place(object)?,
                None => return self.expected("an object, a light, a camera or a directive"),
            },
        }
        Ok(true)
    }

    /// `#default { ... }`.
    pub fn set_default(&mut self) -> Res<()> {
        let open = self.open("#default")?;
        self.later.forget_default();
        while let Token::Word(word) = self.peek()? {
            match word {
                Keyword::Texture => {
                    self.next()?;
                    self.default_texture = self.texture()?;
                }
                Keyword::Pigment | Keyword::Finish | Keyword::Normal => {
                    let mut texture = std::mem::take(&mut self.default_texture);
                    let result = self.surface_item(word, &mut texture);
                    self.default_texture = texture;
                    result?;
                }
                Keyword::Camera => {
                    self.next()?;
                    self.camera()?;
                }
                Keyword::Radiosity => {
                    self.next()?;
                    self.radiosity_importance()?;
                }
                _ => break,
            }
        }
        self.default_shared = None;
        self.later.forget_default();
        self.close("#default", open)
    }

    /// A map by itself.
    fn map_value<S: Spread>(&mut self) -> Res<Value> {
        self.next()?;
        let map = self.blend_map::<S>(false)?;
        Ok(Value::Map(Arc::new(With { value: S::to_name(map.value), lacks: map.lacks })))
    }

    /// What a `normal` starts from: that of the default texture.
    fn default_normal(&self) -> Normal {
        let default = self.default_texture.value.layers.last().and_then(|layer| layer.normal.as_deref());
        default.cloned().unwrap_or_default()
    }

    /// A value that begins with a word of the language.
    pub fn word_value(&mut self, word: Keyword) -> Res<Value> {
        use Keyword as K;
        Ok(match word {
            _ if is_rgb(word) || matches!(word, K::Color | K::Colour) => {
                Value::Number(Num { n: 5, v: self.color_components()? })
            }
            K::Red | K::Green | K::Blue | K::Filter | K::Transmit | K::Alpha => {
                Value::Number(Num { n: 5, v: self.color_components()? })
            }
            _ if is_string_function(word) => Value::String(self.string()?),
            K::Seed => {
                let seed = self.expr()?.v[0];
                Value::Random(Arc::new(super::builtin::random_stream(seed)))
            }
            K::Array => {
                self.next()?;
                self.array()?
            }
            K::Function => {
                self.next()?;
                self.function()?
            }
            K::Spline => {
                self.next()?;
                Value::Spline(Arc::new(self.spline()?))
            }
            K::Transform => {
                self.next()?;
                Value::Transform(self.transform_block()?.into())
            }
            K::Pigment => {
                self.next()?;
                self.pigment_value()?
            }
            K::Texture => {
                self.next()?;
                let mut texture = self.texture()?;
                // `#declare T = texture {...} texture {...}` is a layered texture.
                while self.peek_behind_value()? == Token::Word(K::Texture) {
                    self.next()?;
                    let mut layers = Some(texture);
                    let above = self.texture()?;
                    self.layer_over(&mut layers, above)?;
                    texture = layers.unwrap_or_default();
                }
                let shared = With { value: Arc::new(texture.value), lacks: texture.lacks };
                Value::Texture(Arc::new(shared))
            }
            K::Finish => {
                self.next()?;
                let base = self.default_texture.value.layers.last();
                let mut finish =
                    With::new(base.map_or(Finish::default(), |layer| Finish::clone(&layer.finish)));
                self.finish(&mut finish)?;
                Value::Finish(Arc::new(finish))
            }
            K::Normal => {
                self.next()?;
                let mut normal = With::new(self.default_normal());
                self.normal(&mut normal)?;
                Value::Normal(Arc::new(normal))
            }
            K::Interior => {
                self.next()?;
                Value::Interior(self.interior(None)?)
            }
            K::Material => {
                self.next()?;
                Value::Material(Arc::new(self.material()?))
            }
            K::ColorMap | K::ColourMap => {
                self.next()?;
                Value::ColorMap(Arc::new(self.color_map()?))
            }
            K::Camera => {
                self.next()?;
                Value::Camera(Arc::new(self.camera()?))
            }
            K::PigmentMap => self.map_value::<Pigments>()?,
            K::TextureMap => self.map_value::<Textures>()?,
            K::NormalMap => self.map_value::<Normals>()?,
            K::DensityMap => self.map_value::<Densities>()?,
            K::SlopeMap => {
                self.next()?;
                Value::Map(Arc::new(With::new(NamedMap::Slopes(self.slope_map()?))))
            }
            K::Fog | K::Rainbow | K::SkySphere | K::Media | K::Density => {
                match self.atmosphere_value(word)? {
                    Some(value) => value,
                    None => return self.expected("a value"),
                }
            }
            _ if is_object(word) => match self.object()? {
                Some(object) => Value::Object(Arc::new(object)),
                None => return self.expected("a value"),
            },
            _ => {
                if self.peek()? != Token::Word(word) {
                    return self.expected("a value");
                }
                match self.builtin(word)? {
                    Some(first) => Value::Number(self.expr_from(first)?),
                    None => return self.expected("a value"),
                }
            }
        })
    }
}

/// Words at which reading can take up again after an error.
fn begins_statement(word: Keyword) -> bool {
    is_object(word)
        || matches!(
            word,
            Keyword::Camera
                | Keyword::Background
                | Keyword::GlobalSettings
                | Keyword::Fog
                | Keyword::SkySphere
        )
}
