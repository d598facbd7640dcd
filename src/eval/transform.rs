//! `translate`, `rotate`, `scale`, `matrix`, `transform` (manual section 2.3.3).

use super::machine::{Lexeme, Machine, Res};
use super::value::Value;
use crate::lang::{Keyword, Mark, Token};
use crate::scene::Transform;
use glam::{DAffine3, DVec3};

impl Machine<'_> {
    /// Reads a transform if `word`, the next token, begins one.
    pub fn transform_item(&mut self, word: Keyword) -> Res<Option<Transform>> {
        let transform = match word {
            Keyword::Translate => {
                self.next()?;
                Transform::translate(self.vector()?)
            }
            Keyword::Rotate => {
                self.next()?;
                Transform::rotate(self.vector()? * (std::f64::consts::PI / 180.0))
            }
            Keyword::Scale => {
                self.next()?;
                let start = self.peek_lexeme()?;
                let mut factor = self.vector()?;
                if factor.cmpeq(DVec3::ZERO).any() {
                    let span = self.span(start).to(self.span(self.last));
                    self.warn("scale 0", "a scale of 0 counts as 1", span);
                    factor = DVec3::select(factor.cmpeq(DVec3::ZERO), DVec3::ONE, factor);
                }
                Transform::scale(factor)
            }
            Keyword::Matrix => {
                self.next()?;
                self.matrix()?
            }
            Keyword::Transform => {
                self.next()?;
                self.transform_block()?
            }
            _ => return Ok(None),
        };
        Ok(Some(transform))
    }

    /// `transform { ... inverse }`, or the name of one.
    pub fn transform_block(&mut self) -> Res<Transform> {
        let named = |value: &Value| match value {
            Value::Transform(transform) => Some(**transform),
            _ => None,
        };
        if let Some(transform) = self.take_named(named)? {
            return Ok(transform);
        }
        self.deeper(|m| {
            let open = m.open("transform")?;
            let mut transform = Transform::IDENTITY;
            let mut inverted = false;
            loop {
                if let Some(next) = m.take_named(named)? {
                    transform = transform.then(&next);
                    continue;
                }
                let Token::Word(word) = m.peek()? else { break };
                if word == Keyword::Inverse {
                    // Of the whole, wherever and how often it stands (measured).
                    m.next()?;
                    inverted = true;
                } else if word == Keyword::Function || word == Keyword::Spline {
                    let message = format!("not modelled yet: `{}` in a transform", word.text());
                    return Err(m.error_at_next(message));
                } else {
                    match m.transform_item(word)? {
                        Some(next) => transform = transform.then(&next),
                        None => break,
                    }
                }
            }
            m.close("transform", open)?;
            Ok(if inverted { transform.inverted() } else { transform })
        })
    }

    /// `<` twelve numbers `>`: the images of x, y and z, then the translation.
    fn matrix(&mut self) -> Res<Transform> {
        let mut m = [0.0; 12];
        if let Token::Vector(first, 12) = self.peek()? {
            let lexeme = self.next()?;
            let numbers = &self.programs[lexeme.program as usize].numbers;
            m.copy_from_slice(&numbers[first as usize..][..12]);
            return self.invertible(m, lexeme, lexeme);
        }
        let open = self.expect(Mark::Less)?;
        for value in &mut m {
            *value = self.finite()?;
            self.comma()?;
        }
        let close = self.expect(Mark::Greater)?;
        self.invertible(m, open, close)
    }

    fn invertible(&mut self, mut m: [f64; 12], open: Lexeme, close: Lexeme) -> Res<Transform> {
        for i in 0..3 {
            if m[i] == 0.0 && m[3 + i] == 0.0 && m[6 + i] == 0.0 {
                let span = self.span(open).to(self.span(close));
                self.warn("matrix column", "a matrix column of zeros counts as a scale of 1", span);
                m[4 * i] = 1.0;
            }
        }
        match Transform::from_affine(DAffine3::from_cols_array(&m)) {
            Some(transform) => Ok(transform),
            None => {
                let span = self.span(open).to(self.span(close));
                Err(self.error("this matrix flattens space and has no inverse", span))
            }
        }
    }
}
