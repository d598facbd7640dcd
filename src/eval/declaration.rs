//! Declarations: variables, macros, and the names that they give (manual sections 3.2.2 and 3.2.8).

use super::compiled::Level;
use super::machine::{Lexeme, Machine, Res, Stop};
use super::scope::Place;
use super::value::{Macro, Value};
use crate::lang::{Diagnostic, Keyword, Mark, Span, Symbol, Token};
use std::sync::Arc;

impl Machine<'_> {
    /// `#declare Name = value;` with a value that has been compiled.
    pub fn quick_declare(&mut self, local: bool) -> Option<()> {
        let start = self.at as usize;
        let &[Token::Name(symbol), Token::Mark(Mark::Equal), first] =
            self.text.tokens.get(start + 1..start + 4)?
        else {
            return None;
        };
        if let Token::Block(word) = first
            && !local
        {
            return self.quick_block(symbol, word).then_some(());
        }
        if self.scopes.older_than_blocks(symbol).is_some() {
            return None;
        }
        let num = self.compiled_between(self.at + 3, Level::Sum, Mark::Semicolon)?;
        self.optional_semicolon();
        let value = Value::Number(num);
        match local {
            true => self.scopes.local(symbol, value),
            false => self.scopes.declare(symbol, value),
        }
        Some(())
    }

    pub fn define_macro(&mut self, end: u32, at: Lexeme) -> Res<()> {
        let expand = std::mem::replace(&mut self.expand, false);
        let head = self.macro_head();
        self.expand = expand;
        let (symbol, params) = head.inspect_err(|_| self.jump(end + 1))?;
        let body = self.at;
        self.before_change(symbol)?;
        let value = Macro { name: symbol, params, program: at.program, body };
        self.scopes.declare(symbol, Value::Macro(Arc::new(value)));
        self.jump(end + 1);
        Ok(())
    }

    /// A macro's name and parameters.
    fn macro_head(&mut self) -> Res<(Symbol, smallvec::SmallVec<[Symbol; 4]>)> {
        self.no_directive("a name")?;
        let (symbol, _) = self.raw_name("macro")?;
        self.no_directive("`(`")?;
        self.expect(Mark::OpenParen)?;
        let mut params = smallvec::SmallVec::new();
        loop {
            self.no_directive("a parameter's name or `)`")?;
            self.comma()?;
            self.no_directive("a parameter's name or `)`")?;
            match self.next()?.token {
                Token::Mark(Mark::CloseParen) => return Ok((symbol, params)),
                Token::Name(symbol) => params.push(symbol),
                Token::Word(word) => {
                    let message = format!("`{}` is a keyword and cannot be a parameter", word.text());
                    return Err(self.error_here(message));
                }
                _ => return Err(self.error_here("expected a parameter's name or `)`")),
            }
        }
    }

    /// An error if a directive comes next. In a macro's head there is none that would not belong to its body, or end it.
    fn no_directive(&mut self, wanted: &str) -> Res<()> {
        match self.peek_raw() {
            Token::Directive(directive, _) => {
                let message = format!("expected {wanted}, found `#{}`", directive.name());
                Err(self.error(message, self.span(self.here())))
            }
            _ => Ok(()),
        }
    }

    /// A name that is wanted as it stands, whatever it stands for.
    pub fn raw_name(&mut self, directive: &str) -> Res<(Symbol, Lexeme)> {
        let expand = std::mem::replace(&mut self.expand, false);
        let lexeme = self.next();
        self.expand = expand;
        let lexeme = lexeme?;
        match lexeme.token {
            Token::Name(symbol) => Ok((symbol, lexeme)),
            Token::Word(word) => {
                let message = format!("`{}` is a keyword and cannot be declared", word.text());
                Err(self.error(message, self.span(lexeme)))
            }
            _ => {
                let found = self.describe(lexeme);
                Err(self
                    .error(format!("expected a name after `#{directive}`, found {found}"), self.span(lexeme)))
            }
        }
    }

    /// `#declare Name[i] = value;`
    pub fn declare(&mut self, local: bool) -> Res<()> {
        // `#declare deprecated once "see elsewhere" Name = ...` is how the standard includes mark old names.
        if self.peek_raw() == Token::Word(Keyword::Deprecated) {
            self.next()?;
            self.accept_word(Keyword::Once)?;
            self.string()?;
        }
        let (symbol, at) = self.raw_name(if local { "local" } else { "declare" })?;
        let mut element: Option<Place> = None;
        while self.peek_raw() == Token::Mark(Mark::OpenBracket) {
            let mut place = match element.take().or_else(|| self.scopes.place(symbol)) {
                Some(place) => place,
                None => return self.unknown(symbol, at),
            };
            let array = self.scopes.at(&place).cloned();
            let Some(index) = self.subscripts(array.as_ref())? else {
                let message = format!("`{}` has no such element", self.symbols.name(symbol));
                return Err(self.error(message, self.span(at)));
            };
            place.path.push(index);
            element = Some(place);
        }
        let depth = self.scopes.depth();
        let outer = std::mem::replace(&mut self.declare_depth, depth);
        let outer_name = std::mem::replace(&mut self.declaring, element.is_none().then_some(symbol));
        let value = self.expect(Mark::Equal).and_then(|_| self.right_side(symbol));
        self.leave_ended_macros();
        self.declare_depth = outer;
        self.declaring = outer_name;
        let value = match value {
            Ok(value) => value,
            Err(stop) => {
                // Whoever uses the name later should not be told again.
                if element.is_none() && !matches!(stop, Stop::Halt(_)) {
                    self.assign(symbol, local.then_some(depth), Value::Poison)?;
                }
                return Err(stop);
            }
        };
        let needs_semicolon = matches!(value, Value::Number(_));
        match element {
            // POV-Ray binds the array's name anew and loses the value with it (measured).
            Some(place) if local && !self.scopes.is_of(symbol, depth) && self.scopes.at(&place).is_some() => {
                let message = format!(
                    "`#local` sets no element of `{}`, an array of an outer scope",
                    self.symbols.name(symbol)
                );
                self.warn("local element", message, self.span(at));
            }
            Some(place) => {
                self.check_array_depth(place.path.len() + value.array_depth())?;
                self.charge(self.scopes.copied_by_write(&place))?;
                self.before_change(place.symbol)?;
                if !self.scopes.set_at(&place, value) {
                    let message =
                        format!("`{}` is gone by the time its element is set", self.symbols.name(symbol));
                    return Err(self.error(message, self.span(at)));
                }
            }
            None => self.assign(symbol, local.then_some(depth), value)?,
        }
        // POV-Ray insists since 3.5 and says nothing in older scenes.
        if needs_semicolon && self.version > 3.1 && self.peek_behind_value()? != Token::Mark(Mark::Semicolon)
        {
            return self.missing_semicolon(at);
        }
        self.optional_semicolon();
        if needs_semicolon {
            // One too many is no mistake here (measured).
            self.optional_semicolon();
        }
        Ok(())
    }

    /// Tells that the declaration of the name `at` has no `;`, right behind its value. Goes on as if it had one if a statement or
    /// directive follows.
    fn missing_semicolon(&mut self, at: Lexeme) -> Res<()> {
        // The value may end in a macro's body, and directives behind it may have been carried out already.
        let value = self.last;
        let within = at.index < value.index && (value.program, self.program) == (at.program, at.program);
        let index = match within && value.index < self.at {
            true => value.index,
            false if self.returned.0 == at.program && self.returned.1 > at.index => self.returned.1 - 1,
            false if self.program == at.program && self.at > at.index => self.at - 1,
            false => value.index,
        };
        let program = if index == value.index { value.program } else { at.program };
        let tokens = &self.programs[program as usize].tokens;
        let behind = (index + 1).min(tokens.len() as u32 - 1);
        let next = Lexeme { token: tokens[behind as usize], program, index: behind };
        let found = self.describe(next);
        let end = self.span(Lexeme { program, index, ..value });
        let span = Span { start: end.end, ..end };
        // A loop comes by again and again.
        if !self.warned.insert((span, "missing semicolon")) {
            return Ok(());
        }
        let message = format!("expected `;` after the value of a declaration, found {found}");
        let error = Diagnostic::error(message, span);
        let error = Stop::Error(Box::new(error.with_help("end the declaration with `;`")));
        match next.token {
            Token::Directive(..) | Token::Word(_) | Token::Name(_) | Token::End => match self.report(error) {
                true => Ok(()),
                false => Err(Stop::Halt(None)),
            },
            _ => Err(error),
        }
    }

    fn assign(&mut self, symbol: Symbol, local_at: Option<usize>, value: Value) -> Res<()> {
        let later = matches!(value, Value::Later(_));
        if !later {
            self.before_change(symbol)?;
        }
        match local_at {
            Some(depth) => self.scopes.local_at(depth, symbol, value),
            None => self.scopes.declare(symbol, value),
        }
        if later {
            self.scopes.make_young(symbol);
        }
        Ok(())
    }

    /// "undeclared identifier", with a suggestion.
    pub fn unknown<T>(&self, symbol: Symbol, at: Lexeme) -> Res<T> {
        let message = format!("undeclared identifier `{}`", self.symbols.name(symbol));
        let mut diagnostic = Diagnostic::error(message, self.span(at));
        diagnostic.help = self.suggestion(symbol);
        Err(Stop::Error(Box::new(diagnostic)))
    }
}
