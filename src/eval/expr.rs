//! Numbers, vectors and colours: expressions (manual section 3.1.3 to 3.1.7).

use super::compiled::{Level, compare};
use super::directive::EQUAL_WITHIN;
use super::machine::{Lexeme, Machine, Res, Stop};
use super::value::{Num, Value, With};
use crate::lang::{Keyword, Mark, Token};
use crate::scene::function::{Callee, Component};
use glam::DVec3;

impl Machine<'_> {
    /// A float.
    pub fn float(&mut self) -> Res<f64> {
        match self.quick_float() {
            Some(value) => Ok(value),
            None => self.read_float(),
        }
    }

    #[inline(never)]
    fn read_float(&mut self) -> Res<f64> {
        let start = self.peek_lexeme()?;
        let value = self.expr()?;
        if value.n == 1 {
            return Ok(value.v[0]);
        }
        let found = if value.n == 5 { "a colour" } else { "a vector" };
        let span = self.span(start).to(self.span(self.last));
        Err(self.error(format!("expected a float, found {found}"), span))
    }

    /// A 3-vector; a float stands for all three components.
    pub fn vector(&mut self) -> Res<DVec3> {
        match self.literal_vector().or_else(|| self.compiled_vector()) {
            Some(value) => Ok(value),
            None => self.read_vector(),
        }
    }

    #[inline(never)]
    fn read_vector(&mut self) -> Res<DVec3> {
        let start = self.peek_lexeme()?;
        let value = self.expr()?.xyz();
        if !value.is_finite() {
            let span = self.span(start).to(self.span(self.last));
            return Err(self.error(format!("expected a finite vector, found {}", show(value)), span));
        }
        Ok(value)
    }

    /// A float that is finite.
    pub fn finite(&mut self) -> Res<f64> {
        let before = self.here();
        if let Some(value) = self.quick_float() {
            return self.checked_finite(value, before);
        }
        let start = self.peek_lexeme()?;
        let value = self.read_float()?;
        self.checked_finite(value, start)
    }

    /// A float that has been read, from the token `start` on.
    #[inline]
    pub fn checked_finite(&self, value: f64, start: Lexeme) -> Res<f64> {
        if !value.is_finite() {
            let span = self.span(start).to(self.span(self.last));
            return Err(self.error(format!("expected a finite number, found {value}"), span));
        }
        Ok(value)
    }

    /// Sums of products.
    #[inline]
    pub fn expr(&mut self) -> Res<Num> {
        if let Some(value) = self.literal().or_else(|| self.compiled(Level::Sum)) {
            return Ok(value);
        }
        let first = self.factor()?;
        self.expr_from(first)
    }

    /// True if the token behind the next one is a mark that no expression goes on with. Nothing but speed: data is mostly
    /// numbers and vectors that stand alone.
    #[inline]
    fn stands_alone(&self) -> bool {
        use Mark::{CloseBrace, CloseBracket, CloseParen, Comma, Greater, Semicolon};
        matches!(
            self.text.tokens.get(self.at as usize + 1),
            Some(Token::Mark(Comma | CloseBrace | CloseBracket | CloseParen | Greater | Semicolon))
        )
    }

    /// The next token, if it is a number or vector that is a whole expression.
    #[inline]
    fn literal(&mut self) -> Option<Num> {
        if let Some(v) = self.literal_vector() {
            return Some(Num::vector(v));
        }
        let Token::Number(value) = self.peek_raw() else { return None };
        if !self.stands_alone() {
            return None;
        }
        self.take_raw();
        Some(Num::float(value))
    }

    /// The next token, if it is a vector of three that is a whole expression.
    #[inline]
    pub fn literal_vector(&mut self) -> Option<DVec3> {
        let Token::Vector(first, 3) = self.peek_raw() else { return None };
        let v = &self.text.numbers[first as usize..][..3];
        let v = DVec3::new(v[0], v[1], v[2]);
        if !self.stands_alone() || !v.is_finite() {
            return None;
        }
        self.take_raw();
        Some(v)
    }

    /// The float that is next, if it need not be read token by token.
    #[inline]
    pub fn quick_float(&mut self) -> Option<f64> {
        if let Token::Number(value) = self.peek_raw()
            && self.stands_alone()
        {
            self.take_raw();
            return Some(value);
        }
        self.compiled_float()
    }

    /// The rest of an expression whose first factor has been read.
    pub fn expr_from(&mut self, first: Num) -> Res<Num> {
        // Most values stand alone.
        use Mark::{Dot, Minus, Plus, Slash, Star};
        let Token::Mark(Dot | Star | Slash | Plus | Minus) = self.peek_operator()? else { return Ok(first) };
        let mut sum = self.term_from(first)?;
        loop {
            let Token::Mark(mark @ (Mark::Plus | Mark::Minus)) = self.peek_operator()? else {
                return Ok(sum);
            };
            self.next()?;
            let right = self.factor()?;
            let right = self.term_from(right)?;
            sum =
                if mark == Mark::Plus { sum.zip(right, |a, b| a + b) } else { sum.zip(right, |a, b| a - b) };
        }
    }

    fn term_from(&mut self, first: Num) -> Res<Num> {
        let mut product = self.suffix(first)?;
        loop {
            let Token::Mark(mark @ (Mark::Star | Mark::Slash)) = self.peek_operator()? else {
                return Ok(product);
            };
            self.next()?;
            let right = self.factor()?;
            product = if mark == Mark::Star {
                product.zip(right, |a, b| a * b)
            } else {
                if right.v[..usize::from(right.n)].contains(&0.0) {
                    self.warn(
                        "division by zero",
                        "division by zero: it gives infinity",
                        self.span(self.last),
                    );
                }
                product.zip(right, divide)
            };
        }
    }

    /// `.x`, `.red` and the like, any number of times.
    pub fn suffix(&mut self, mut value: Num) -> Res<Num> {
        while self.peek_operator()? == Token::Mark(Mark::Dot) {
            let component = self.component()?;
            // A float has every component.
            if let Component::Index(index) = component
                && value.n > 1
                && index >= value.n
            {
                let message =
                    format!("a vector of {} components has no `{}`", value.n, self.text_of(self.last));
                return Err(self.error_here(message));
            }
            value = Num::float(component.of(&value.promoted(5)));
        }
        Ok(value)
    }

    /// `.x`, `.red` and the like; the dot is next.
    pub fn component(&mut self) -> Res<Component> {
        self.next()?;
        Ok(match self.next()?.token {
            Token::Word(Keyword::X | Keyword::U | Keyword::Red) => Component::Index(0),
            Token::Word(Keyword::Y | Keyword::V | Keyword::Green) => Component::Index(1),
            Token::Word(Keyword::Z | Keyword::Blue) => Component::Index(2),
            Token::Word(Keyword::T | Keyword::Filter) => Component::Index(3),
            Token::Word(Keyword::Transmit) => Component::Index(4),
            Token::Word(Keyword::Gray) => Component::Gray,
            _ => return Err(self.error_here("expected a component such as `x` or `red` after `.`")),
        })
    }

    /// A number, vector, name, call or parenthesis, with the signs before it and the `.x` behind.
    pub fn factor(&mut self) -> Res<Num> {
        let value = match self.peek()? {
            Token::Number(value) => {
                self.next()?;
                return Ok(Num::float(value));
            }
            Token::Vector(first, count) => {
                let lexeme = self.next()?;
                let numbers = &self.programs[lexeme.program as usize].numbers;
                let mut v = [0.0; 5];
                match numbers[first as usize..][..usize::from(count)] {
                    [a, b, c] => v[..3].copy_from_slice(&[a, b, c]),
                    ref numbers if count <= 5 => v[..usize::from(count)].copy_from_slice(numbers),
                    _ => {
                        return Err(
                            self.error_here(format!("a vector has at most 5 components, found {count}"))
                        );
                    }
                }
                Num { n: count as u8, v }
            }
            Token::Mark(Mark::Less) => self.vector_literal()?,
            Token::Mark(Mark::OpenParen) => {
                self.next()?;
                let value = self.deeper(|m| m.choice())?;
                self.expect(Mark::CloseParen)?;
                value
            }
            Token::Mark(mark @ (Mark::Minus | Mark::Plus | Mark::Not)) => {
                self.next()?;
                let value = self.deeper(|m| m.factor())?;
                return Ok(match mark {
                    Mark::Minus => value.map(|v| -v),
                    Mark::Not => value.map(|v| f64::from(v.abs() < EQUAL_WITHIN)),
                    _ => value,
                });
            }
            Token::Name(_) => {
                let lexeme = self.next()?;
                match self.name_value(lexeme)? {
                    Value::Number(num) => num,
                    Value::Function(function) if self.peek()? == Token::Mark(Mark::OpenParen) => {
                        self.call_function(&function)?
                    }
                    Value::Spline(spline) if self.peek()? == Token::Mark(Mark::OpenParen) => {
                        self.call_function(&With::new(Callee::Spline(spline)))?
                    }
                    Value::Poison => return Err(Stop::Silent),
                    other => {
                        let name = self.sources.text(self.span(lexeme));
                        let message =
                            format!("expected a number or a vector, found {} `{name}`", other.kind());
                        return Err(self.error(message, self.span(lexeme)));
                    }
                }
            }
            Token::Word(word) => match self.builtin(word)? {
                Some(value) => value,
                None => return self.expected("a number or a vector"),
            },
            _ => return self.expected("a number or a vector"),
        };
        self.suffix(value)
    }

    /// `<a, b, c>`; commas may be left out.
    fn vector_literal(&mut self) -> Res<Num> {
        self.deeper(|m| {
            let open = m.next()?;
            let mut num = Num { n: 0, v: [0.0; 5] };
            loop {
                if m.peek()? == Token::Mark(Mark::Greater) && num.n >= 2 {
                    m.next()?;
                    return Ok(num);
                }
                if num.n == 5 {
                    let found = m.describe_peeked()?;
                    return Err(m.error_at_next(format!("expected `>` after 5 components, found {found}")));
                }
                if m.peek()? == Token::End {
                    return Err(m.error("this `<` is never closed", m.span(open)));
                }
                num.v[num.n as usize] = m.float()?;
                num.n += 1;
                m.comma()?;
            }
        })
    }

    // ----------------------------------------------------------------------------------------------------------
    // Inside parentheses

    /// `a ? b : c`, or what may stand before `?`. Both sides are evaluated, as POV-Ray does.
    pub fn choice(&mut self) -> Res<Num> {
        if let Some(value) = self.compiled(Level::Choice) {
            return Ok(value);
        }
        let value = self.logical()?;
        if !self.accept(Mark::Question)? {
            return Ok(value);
        }
        if value.n != 1 {
            return Err(self.error_here("expected a float before `?`, found a vector"));
        }
        self.deeper(|m| {
            let yes = m.choice()?;
            m.expect(Mark::Colon)?;
            let no = m.choice()?;
            Ok(if value.is_true() { yes } else { no })
        })
    }

    /// `&` and `|`: of equal rank, from left to right; of vectors, component by component.
    fn logical(&mut self) -> Res<Num> {
        let mut value = self.relation()?;
        loop {
            let Token::Mark(mark @ (Mark::And | Mark::Or)) = self.peek()? else { return Ok(value) };
            self.next()?;
            let right = self.relation()?;
            value = value.zip(right, |a, b| {
                let (a, b) = (Num::float(a).is_true(), Num::float(b).is_true());
                f64::from(if mark == Mark::And { a && b } else { a || b })
            });
        }
    }

    /// `<`, `=` and the like: 1 where they hold, else 0; of vectors, component by component (measured).
    fn relation(&mut self) -> Res<Num> {
        let mut value = if self.begins_string()? { self.string_relation()? } else { self.expr()? };
        loop {
            let Token::Mark(
                mark @ (Mark::Less
                | Mark::LessEqual
                | Mark::Equal
                | Mark::NotEqual
                | Mark::GreaterEqual
                | Mark::Greater),
            ) = self.peek()?
            else {
                return Ok(value);
            };
            self.next()?;
            let right = self.expr()?;
            value = value.zip(right, |a, b| f64::from(compare(mark, a, b)));
        }
    }
}

/// Division; by zero it gives infinity, whatever the signs (measured).
pub(super) fn divide(a: f64, b: f64) -> f64 {
    if b == 0.0 { f64::INFINITY } else { a / b }
}

/// A vector as the language writes it.
pub(super) fn show(v: DVec3) -> String {
    format!("<{}, {}, {}>", v.x, v.y, v.z)
}
