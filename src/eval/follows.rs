//! What follows: a name that stands for a wanted kind of value, a float, a block to be left out.

use super::machine::{Machine, Res, Stop};
use super::value::Value;
use crate::lang::{Keyword, Mark, Token};

impl Machine<'_> {
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

    /// True if a number or a vector follows. A name that stands for nothing counts: whoever reads it will say so.
    pub fn value_follows(&mut self) -> Res<bool> {
        Ok(match self.peek()? {
            Token::Number(_)
            | Token::Vector(..)
            | Token::Mark(Mark::Less | Mark::Minus | Mark::Plus | Mark::OpenParen | Mark::Not) => true,
            Token::Word(word) => super::builtin::is_number(word),
            Token::Name(symbol) => match self.scopes.get(symbol) {
                Some(Value::Array(_)) => matches!(self.array_sample(symbol), Some(Value::Number(_))),
                Some(Value::Number(_) | Value::Function(_) | Value::Spline(_) | Value::Poison) | None => true,
                _ => false,
            },
            _ => false,
        })
    }

    /// True if what follows ends a block, an entry or an argument, or is a word that begins no number.
    pub fn no_value_follows(&mut self) -> Res<bool> {
        use Mark::{CloseBrace, CloseBracket, CloseParen, Comma, Semicolon};
        Ok(match self.peek()? {
            Token::Mark(mark) => {
                matches!(mark, CloseBrace | CloseBracket | CloseParen | Comma | Semicolon)
            }
            Token::Word(word) => !super::builtin::is_number(word),
            _ => false,
        })
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
}
