//! Where evaluation stands: the next token, the stack of texts, jumps and calls.
//!
//! Directives and macro calls are carried out when somebody asks for the token behind them, so they may stand between
//! any two tokens.

use super::machine::{Frame, FrameKind, Lexeme, Machine, Res};
use super::scope::Slot;
use super::value::{Macro, Value};
use crate::lang::{Directive, Mark, Token};

impl Machine<'_> {
    /// Takes the next token.
    #[inline]
    pub fn next(&mut self) -> Res<Lexeme> {
        let lexeme = self.peek_lexeme()?;
        match lexeme.token {
            Token::Mark(Mark::OpenBrace) => self.braces += 1,
            Token::Mark(Mark::CloseBrace) => self.braces = self.braces.saturating_sub(1),
            // The end of the scene stays.
            Token::End => {
                self.last = lexeme;
                return Ok(lexeme);
            }
            _ => {}
        }
        self.at += 1;
        self.ready = false;
        self.last = lexeme;
        Ok(lexeme)
    }

    /// Takes the mark that is at hand.
    #[inline]
    pub fn take_mark(&mut self, mark: Mark) {
        self.last = Lexeme { token: Token::Mark(mark), program: self.program, index: self.at };
        match mark {
            Mark::OpenBrace => self.braces += 1,
            Mark::CloseBrace => self.braces = self.braces.saturating_sub(1),
            _ => {}
        }
        self.at += 1;
        self.ready = false;
    }

    /// Looks at the next token. Directives before it are carried out.
    #[inline]
    pub fn peek(&mut self) -> Res<Token> {
        let token = self.peek_raw();
        if self.ready {
            return Ok(token);
        }
        // Most tokens are of a phrase, as they stand. Whatever loops or recurses comes by `settle`, where steps are bounded.
        if !matches!(token, Token::Directive(..) | Token::Name(_) | Token::Junk(_) | Token::End) {
            self.steps += 1;
            self.ready = true;
            return Ok(token);
        }
        self.settle()?;
        Ok(self.peek_raw())
    }

    /// The token that was looked at, with its place.
    #[inline]
    pub fn peek_lexeme(&mut self) -> Res<Lexeme> {
        self.peek()?;
        Ok(self.here())
    }

    /// The token at hand as it stands, with its place.
    #[inline]
    pub fn here(&self) -> Lexeme {
        Lexeme { token: self.peek_raw(), program: self.program, index: self.at }
    }

    /// Goes on to a token that is one of a phrase: directives and macro calls on the way are carried out.
    #[inline(never)]
    fn settle(&mut self) -> Res<()> {
        // What directives take is not the phrase's.
        let last = self.last;
        while !self.ready {
            self.steps += 1;
            if self.steps > self.options.limits.steps {
                return Err(self.halt(format!(
                    "stopped after {} evaluation steps: the script does not seem to end",
                    self.options.limits.steps
                )));
            }
            match self.peek_raw() {
                Token::Directive(directive, jump) if self.quick_directive(directive, jump) => {}
                Token::Directive(directive, jump) => {
                    let lexeme = self.here();
                    self.at += 1;
                    // A directive reads on and may meet another one where its value should be, and a loop's `#end` again itself.
                    self.deeper(|m| m.directive(directive, jump, lexeme))?;
                }
                // A `#` before what is no directive is no mistake (measured).
                Token::Junk('#') => self.at += 1,
                Token::Name(symbol) if self.expand => match self.scopes.get(symbol) {
                    Some(Value::Macro(callee)) => {
                        let callee = callee.clone();
                        let lexeme = self.here();
                        self.at += 1;
                        self.call(&callee, lexeme)?;
                    }
                    Some(Value::Later(later)) => {
                        let later = later.clone();
                        self.evaluate_later(&later)?;
                        self.ready = true;
                    }
                    _ => self.ready = true,
                },
                Token::End if self.frames.len() > 1 => self.leave_frame(),
                _ => self.ready = true,
            }
        }
        self.last = last;
        Ok(())
    }

    /// The next token of the innermost text as it stands; no directive is carried out.
    #[inline]
    pub fn peek_raw(&self) -> Token {
        self.text.tokens.get(self.at as usize).copied().unwrap_or(Token::End)
    }

    /// Takes the token at hand, which is neither a directive, a name nor a brace.
    #[inline]
    pub fn take_raw(&mut self) {
        self.last = self.here();
        self.steps += 1;
        self.jump(self.at + 1);
    }

    /// Looks at the token behind what may be a whole value: a directive there is not carried out but ends the
    /// value. `#declare A = B` goes without a semicolon for most kinds of values, and the next `#declare` or `#ifdef`
    /// must find `A` declared.
    pub fn peek_behind_value(&mut self) -> Res<Token> {
        self.leave_ended_macros();
        match self.peek_raw() {
            token @ Token::Directive(..) => Ok(token),
            // Nor is a macro called: what it is given may be what is being declared.
            token @ Token::Name(symbol) if matches!(self.scopes.get(symbol), Some(Value::Macro(_))) => {
                Ok(token)
            }
            _ => self.peek(),
        }
    }

    /// Leaves macros that were called for the value being declared and whose bodies have ended with it.
    pub fn leave_ended_macros(&mut self) {
        while self.scopes.depth() > self.declare_depth
            && self.frames.len() > 1
            && matches!(self.peek_raw(), Token::Directive(Directive::EndMacro, _))
        {
            self.leave_frame();
        }
    }

    /// Looks at the token behind a number, which may be an operator. In scenes before 3.5 numbers too are declared without
    /// a semicolon.
    #[inline]
    pub fn peek_operator(&mut self) -> Res<Token> {
        if self.version > 3.1 { self.peek() } else { self.peek_behind_value() }
    }

    /// Takes a `;` if one follows at once. Looking further would carry out the directives that follow.
    pub fn optional_semicolon(&mut self) {
        if self.peek_raw() == Token::Mark(Mark::Semicolon) {
            self.jump(self.at + 1);
        }
    }

    /// Sends the innermost text back to the token at `index`.
    #[inline]
    pub fn jump_back(&mut self, index: u32) {
        if let Some(compiled) = self.compiled.get_mut(self.program as usize) {
            compiled.repeats = true;
        }
        self.jump(index);
    }

    /// Sends the innermost text to the token at `index`.
    #[inline]
    pub fn jump(&mut self, index: u32) {
        self.at = index;
        self.ready = false;
    }

    /// Ends the innermost include or macro.
    pub fn leave_frame(&mut self) {
        // The scene itself is never left.
        if self.frames.len() < 2 {
            return;
        }
        if let Some(frame) = self.frames.pop() {
            self.loops.truncate(frame.loops);
            self.scopes.pop();
        }
        if let Some(frame) = self.frames.last() {
            let (program, next) = (frame.program, frame.next);
            self.returned = (program, next);
            self.go_to(program, next);
        }
    }

    pub fn enter_frame(&mut self, program: u32, next: u32, kind: FrameKind, from: Option<Lexeme>) -> Res<()> {
        if self.frames.len() >= self.options.limits.calls {
            let message =
                format!("more than {} macro calls or includes within each other", self.options.limits.calls);
            return Err(self.halt(message));
        }
        if let Some(frame) = self.frames.last_mut() {
            frame.next = self.at;
            self.scopes.push();
        }
        self.frames.push(Frame { program, next, loops: self.loops.len(), kind, from, switches: Vec::new() });
        if self.compiled.len() < self.programs.len() {
            self.compiled.resize_with(self.programs.len(), Default::default);
        }
        // Even an include may come again.
        let compiled = &mut self.compiled[program as usize];
        compiled.repeats |= compiled.entered;
        compiled.entered = true;
        self.go_to(program, next);
        Ok(())
    }

    /// Makes a text the innermost one.
    #[inline]
    fn go_to(&mut self, program: u32, next: u32) {
        // Most macros are called from the file they stand in.
        if program != self.program || self.text.tokens.is_empty() {
            self.program = program;
            self.text = self.programs[program as usize].clone();
        }
        self.jump(next);
    }

    /// Reads a call's arguments and enters the macro.
    fn call(&mut self, callee: &Macro, at: Lexeme) -> Res<()> {
        self.deeper(|m| {
            if m.peek()? != Token::Mark(Mark::OpenParen) {
                let found = m.describe_peeked()?;
                let name = m.symbols.name(callee.name);
                let message = format!("expected `(` and the arguments of macro `{name}`, found {found}");
                return Err(m.error_at_next(message));
            }
            m.next()?;
            let mut slots: smallvec::SmallVec<[Slot; 4]> = Default::default();
            for (index, _) in callee.params.iter().enumerate() {
                m.comma()?;
                if m.peek()? == Token::Mark(Mark::CloseParen) {
                    let (name, wants) = (m.symbols.name(callee.name), callee.params.len());
                    let message = format!("macro `{name}` wants {wants} arguments, found {index}");
                    return Err(m.error_at_next(message));
                }
                slots.push(m.argument()?);
            }
            m.comma()?;
            m.expect(Mark::CloseParen)?;
            let (program, body) = m.body(callee)?;
            m.enter_frame(program, body, FrameKind::Macro(callee.name), Some(at))?;
            for (param, slot) in callee.params.iter().zip(slots) {
                m.scopes.bind_local(*param, slot);
            }
            Ok(())
        })
    }
}
