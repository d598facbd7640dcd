//! Values of any kind: what names stand for, array elements, what is declared or handed to a macro.

use super::compiled::Level;
use super::directive::EQUAL_WITHIN;
use super::machine::{Lexeme, Machine, Res, Stop};
use super::scope::Slot;
use super::value::{Array, Value, With};
use crate::lang::{Mark, Token};
use crate::scene::function::Callee;
use smallvec::SmallVec;
use std::sync::Arc;

/// Arrays may be within each other to this depth: who drops them recurses.
const ARRAY_DEPTH: usize = 500;

impl Machine<'_> {
    /// The value of a name that has just been taken, with the subscripts that follow it.
    pub fn name_value(&mut self, lexeme: Lexeme) -> Res<Value> {
        let Token::Name(symbol) = lexeme.token else { return self.expected("a name") };
        let Some(value) = self.scopes.get(symbol) else { return self.unknown(symbol, lexeme) };
        match value {
            Value::Number(num) => Ok(Value::Number(*num)),
            Value::Array(_) => {
                let mut value = value.clone();
                while matches!(value, Value::Array(_))
                    && self.peek_behind_value()? == Token::Mark(Mark::OpenBracket)
                {
                    let index = self.subscripts(Some(&value))?;
                    let Value::Array(array) = &value else { break };
                    value = match index.and_then(|index| array.items[index].clone()) {
                        Some(item) => item,
                        None => {
                            let name = self.symbols.name(symbol);
                            let message = format!("this element of `{name}` has never been set");
                            return Err(self.error(message, self.span(lexeme)));
                        }
                    };
                }
                Ok(value)
            }
            value => Ok(value.clone()),
        }
    }

    /// `[i][j]`: as many subscripts as the array has dimensions; the element's flat index. `None` if `array` is none.
    pub fn subscripts(&mut self, array: Option<&Value>) -> Res<Option<usize>> {
        let Some(Value::Array(array)) = array else {
            self.expect(Mark::OpenBracket)?;
            self.deeper(Self::float)?;
            self.expect(Mark::CloseBracket)?;
            return Ok(None);
        };
        let mut flat = 0;
        for &size in &array.dims {
            let open = self.expect(Mark::OpenBracket)?;
            // POV-Ray truncates; the small step is against 0.1 * 30 being 2.9999999999999996.
            let index = (self.deeper(Self::float)? + EQUAL_WITHIN).floor();
            let close = self.expect(Mark::CloseBracket)?;
            if !(index >= 0.0 && index < size as f64) {
                let span = self.span(open).to(self.span(close));
                return Err(self.error(format!("subscript {index} is not in 0..{}", size - 1), span));
            }
            flat = flat * size + index as usize;
        }
        Ok(Some(flat))
    }

    /// What may stand to the right of `#declare Name =`.
    pub fn rvalue(&mut self) -> Res<Value> {
        if let Some(num) = self.compiled(Level::Sum) {
            return Ok(Value::Number(num));
        }
        self.deeper(|m| match m.peek()? {
            Token::Name(_) => {
                let lexeme = m.next()?;
                match m.name_value(lexeme)? {
                    Value::Number(num) => Ok(Value::Number(m.expr_from(num)?)),
                    Value::Function(function) if m.peek_behind_value()? == Token::Mark(Mark::OpenParen) => {
                        let first = m.call_function(&function)?;
                        Ok(Value::Number(m.expr_from(first)?))
                    }
                    Value::Spline(spline) if m.peek_behind_value()? == Token::Mark(Mark::OpenParen) => {
                        let first = m.call_function(&With::new(Callee::Spline(spline)))?;
                        Ok(Value::Number(m.expr_from(first)?))
                    }
                    Value::Poison => Err(Stop::Silent),
                    other => Ok(other),
                }
            }
            Token::String(_) => Ok(Value::String(m.string()?)),
            Token::Word(word) => m.word_value(word),
            Token::Block(_) => m.block_here(),
            _ => Ok(Value::Number(m.expr()?)),
        })
    }

    /// A macro's argument. A bare name or array element is handed over by reference, anything else by value.
    pub fn argument(&mut self) -> Res<Slot> {
        // A name with an operator behind it is an expression; anything but a name may be one.
        use Mark::{Dot, Minus, Plus, Slash, Star};
        let expression = !matches!(self.peek_raw(), Token::Name(_))
            || matches!(
                self.text.tokens.get(self.at as usize + 1),
                Some(Token::Mark(Plus | Minus | Star | Slash | Dot))
            );
        if expression && let Some(num) = self.compiled(Level::Sum) {
            return Ok(Slot::Value(Value::Number(num)));
        }
        let Token::Name(symbol) = self.peek()? else { return Ok(Slot::Value(self.rvalue()?)) };
        let lexeme = self.next()?;
        let Some(mut place) = self.scopes.place(symbol) else { return self.unknown(symbol, lexeme) };
        let mut value = self.scopes.at(&place).cloned();
        let depth = self.scopes.depth();
        while matches!(value, Some(Value::Array(_)))
            && self.peek_behind_value()? == Token::Mark(Mark::OpenBracket)
        {
            let Some(index) = self.subscripts(value.as_ref())? else { break };
            place.path.push(index);
            value = self.scopes.at(&place).cloned();
        }
        let next = self.peek()?;
        // If looking on has left the macro that the name belongs to, its value is all that is left of it.
        let gone = self.scopes.depth() < depth;
        match value {
            Some(Value::Poison) => Err(Stop::Silent),
            Some(Value::Number(num)) => match next {
                Token::Mark(Plus | Minus | Star | Slash | Dot) => {
                    Ok(Slot::Value(Value::Number(self.expr_from(num)?)))
                }
                _ if gone => Ok(Slot::Value(Value::Number(num))),
                _ => Ok(Slot::Reference(place)),
            },
            Some(Value::Function(function)) if next == Token::Mark(Mark::OpenParen) => {
                let first = self.call_function(&function)?;
                Ok(Slot::Value(Value::Number(self.expr_from(first)?)))
            }
            Some(Value::Spline(spline)) if next == Token::Mark(Mark::OpenParen) => {
                let first = self.call_function(&With::new(Callee::Spline(spline)))?;
                Ok(Slot::Value(Value::Number(self.expr_from(first)?)))
            }
            Some(value) if gone => Ok(Slot::Value(value)),
            _ => Ok(Slot::Reference(place)),
        }
    }

    /// `array[2][3] {{...}, {...}}`; the word has been taken.
    pub fn array(&mut self) -> Res<Value> {
        let mut dims: SmallVec<[usize; 2]> = SmallVec::new();
        while self.peek_behind_value()? == Token::Mark(Mark::OpenBracket) {
            self.next()?;
            let size = (self.float()? + EQUAL_WITHIN).floor();
            if !(size >= 1.0) || dims.len() == 5 {
                return Err(self.error_here("an array has 1 to 5 dimensions, each of at least 1 element"));
            }
            dims.push(if size > 1e15 { usize::MAX / 64 } else { size as usize });
            self.expect(Mark::CloseBracket)?;
        }
        if dims.is_empty() {
            return self.expected("`[` and the size of the array");
        }
        let count = dims.iter().try_fold(1usize, |n, d| n.checked_mul(*d)).unwrap_or(usize::MAX);
        self.charge(count.saturating_mul(std::mem::size_of::<Option<Value>>()))?;
        let mut items = vec![None; count];
        if self.peek_behind_value()? == Token::Mark(Mark::OpenBrace) {
            self.initialise(&dims, &mut items)?;
        }
        let depth = 1 + items.iter().flatten().map(Value::array_depth).max().unwrap_or(0);
        self.check_array_depth(depth)?;
        Ok(Value::Array(Arc::new(Array { dims, items, depth })))
    }

    /// A loop can put an array into another for ever (`#declare A = array[1] { A }`).
    pub fn check_array_depth(&self, depth: usize) -> Res<()> {
        if depth > ARRAY_DEPTH {
            return Err(self.halt(format!("arrays within each other more than {ARRAY_DEPTH} levels deep")));
        }
        Ok(())
    }

    fn initialise(&mut self, dims: &[usize], items: &mut [Option<Value>]) -> Res<()> {
        let open = self.open("array")?;
        let part = items.len() / dims[0];
        for row in items.chunks_mut(part) {
            if self.peek()? == Token::Mark(Mark::CloseBrace) {
                break;
            }
            match dims.len() {
                1 => row[0] = Some(self.rvalue()?),
                _ => self.initialise(&dims[1..], row)?,
            }
            self.comma()?;
        }
        self.close("array", open)
    }
}
