//! Pictures that a scene names: `image_map`, `bump_map` and the like, and the one of a `height_field` (manual section 3.4.7.11).
//! Files are not opened.

use super::machine::{Machine, Res};
use super::value::{Lacks, Value, With};
use crate::lang::{Keyword, Token};
use crate::scene::{Computed, Image, ImageSource, Pigment, function};

/// Dots of a computed picture along one side.
const SIDE: u32 = 1 << 20;

impl Machine<'_> {
    /// The block behind the word of an image.
    pub fn image(&mut self, word: Keyword, lacks: &mut Lacks) -> Res<Image> {
        let open = self.open(word.text())?;
        let source = self.image_source(lacks)?;
        let mut image = Image::new(source);
        while self.image_item(&mut image)? {}
        self.close(word.text(), open)?;
        Ok(image)
    }

    /// A file with what is said of its gamma, or `function width, height { ... }`.
    pub fn image_source(&mut self, lacks: &mut Lacks) -> Res<ImageSource> {
        use Keyword as K;
        if self.accept_word(K::Function)? {
            let mut size = [0; 2];
            for side in &mut size {
                *side = self.integer("the size of a picture", 1, SIDE)?;
                self.comma()?;
            }
            let from = self.computed(lacks)?;
            return Ok(ImageSource::Computed { size, from });
        }
        let kind = match self.peek()? {
            Token::Word(
                word @ (K::Png
                | K::Gif
                | K::Tga
                | K::Iff
                | K::Ppm
                | K::Pgm
                | K::Jpeg
                | K::Tiff
                | K::Sys
                | K::Pot
                | K::Exr
                | K::Hdr
                | K::Df3),
            ) => {
                self.next()?;
                Some(word.text())
            }
            _ => None,
        };
        let name = self.file_name()?.to_string();
        let (mut gamma, mut premultiplied) = (None, None);
        loop {
            if self.accept_word(K::Gamma)? {
                gamma = if self.accept_word(K::Srgb)? { None } else { Some(self.finite()?) };
            } else if self.accept_word(K::Premultiplied)? {
                premultiplied = Some(self.switch_value()?);
            } else {
                return Ok(ImageSource::File { name, kind, gamma, premultiplied });
            }
        }
    }

    /// What a computed picture asks: a function's body or name, or a pigment or pattern in its place.
    fn computed(&mut self, lacks: &mut Lacks) -> Res<Computed> {
        let called = match self.peek()? {
            Token::Name(_) => self.rvalue()?,
            _ => self.function()?,
        };
        match called {
            Value::Function(called) => {
                lacks.add(&called.lacks);
                Ok(Computed::Callee(Box::new(function::Callee::clone(&called.value))))
            }
            Value::Pigment(pigment) => {
                let With { value, lacks: inner } = With::<Pigment>::clone(&pigment);
                lacks.add(&inner);
                Ok(Computed::Pigment(Box::new(value)))
            }
            _ => self.expected("a function"),
        }
    }

    /// What may be said of an image behind its source. False if nothing is.
    pub fn image_item(&mut self, image: &mut Image) -> Res<bool> {
        use Keyword as K;
        let Token::Word(word) = self.peek()? else { return Ok(false) };
        match word {
            K::MapType => {
                self.next()?;
                image.map_type = self.one_of("`map_type`", &[0, 1, 2, 5, 7])?;
            }
            K::Interpolate => {
                self.next()?;
                image.interpolate = self.one_of("`interpolate`", &[0, 1, 2, 3, 4])?;
            }
            K::Once => {
                self.next()?;
                image.once = true;
            }
            K::UseIndex | K::UseColor | K::UseColour => {
                self.next()?;
                image.use_index = word == K::UseIndex;
            }
            K::UseAlpha => {
                self.next()?;
                image.use_alpha = true;
            }
            K::Filter | K::Transmit => {
                self.next()?;
                let slot = usize::from(word == K::Transmit);
                if self.accept_word(K::All)? {
                    image.all[slot] = self.finite()?;
                } else {
                    let index = self.integer("the index of a colour", 0, 255)?;
                    self.comma()?;
                    let mut shares = [0.0; 2];
                    shares[slot] = self.finite()?;
                    self.charge(std::mem::size_of::<(u32, f64, f64)>())?;
                    image.by_index.push((index, shares[0], shares[1]));
                }
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// A whole number out of a few.
    fn one_of(&mut self, what: &str, allowed: &[u8]) -> Res<u8> {
        let value = self.finite()?;
        match allowed.iter().find(|number| f64::from(**number) == value) {
            Some(number) => Ok(*number),
            None => {
                let list: Vec<_> = allowed.iter().map(u8::to_string).collect();
                Err(self.error_here(format!("{what} must be one of {}, found {value}", list.join(", "))))
            }
        }
    }
}
