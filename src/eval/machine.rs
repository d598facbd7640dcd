//! Runs tokens: the frame stack, look-ahead, expectations, errors.
//!
//! Whoever reads a phrase asks for the next token ([`Machine::next`], [`Machine::peek`]); directives and macro calls are
//! carried out when the asking meets them, so they may stand between any two tokens.

use super::scope::{Scopes, Slot};
use super::value::{Macro, Value};
use super::{Message, Options, Stream};
use crate::lang::{
    Diagnostic, Directive, Keyword, Mark, Program, Severity, SourceMap, Span, Symbol, Symbols, Token,
};
use crate::scene::Scene;
use rustc_hash::FxHashMap;
use std::path::PathBuf;
use std::sync::Arc;

/// Why a phrase could not be read.
#[derive(Debug)]
pub(super) enum Stop {
    /// Something to tell; evaluation goes on behind the statement.
    Error(Box<Diagnostic>),
    /// A consequence of what has been told.
    Silent,
    /// No use in going on.
    Halt(Option<Box<Diagnostic>>),
}

pub(super) type Res<T> = Result<T, Stop>;

/// A token and where it came from.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lexeme {
    pub token: Token,
    pub program: u32,
    pub index: u32,
}

/// A text being run.
#[derive(Debug)]
pub(super) struct Frame {
    pub program: u32,
    pub next: u32,
    /// How many loops were under way when it began.
    pub loops: usize,
    pub kind: FrameKind,
    /// The call or the `#include`.
    pub from: Option<Lexeme>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FrameKind {
    Scene,
    Include,
    Macro(Symbol),
}

/// A `#for` under way.
#[derive(Debug)]
pub(super) struct Loop {
    pub symbol: Symbol,
    pub last: f64,
    pub step: f64,
    /// The first token of its body.
    pub body: u32,
}

/// Phrases within each other (braces, parentheses, calls inside of arguments) beyond this many are refused: the evaluator recurses, on a
/// stack of [`STACK_BYTES`].
const NESTING: usize = 1_000;

/// Stack of the thread that evaluates: enough for [`NESTING`] levels at 64 kB each.
pub(super) const STACK_BYTES: usize = 64 << 20;

/// The state of an evaluation.
pub(super) struct Machine<'a> {
    pub options: &'a Options,
    pub sources: SourceMap,
    pub symbols: Symbols,
    pub programs: Vec<Arc<Program>>,
    pub frames: Vec<Frame>,
    pub loops: Vec<Loop>,
    pub scopes: Scopes,
    peeked: Option<Lexeme>,
    /// The last token taken.
    pub last: Lexeme,
    /// Braces open around the next token.
    pub braces: usize,
    nesting: usize,
    /// False while names are wanted as they stand (`#ifdef`, `#declare`, skipping).
    pub expand: bool,
    steps: u64,
    memory: u64,
    /// The version whose rules hold, times 100; and whether a `#version` has said so.
    pub version: f64,
    pub version_set: bool,
    pub gamma_set: bool,
    /// What `#default` has made of the texture, and the same shared among the objects that have no other.
    pub default_texture: super::value::With<crate::scene::Texture>,
    pub default_shared: Option<Arc<crate::scene::Texture>>,
    pub scene: Scene,
    pub messages: Vec<Message>,
    pub diagnostics: Vec<Diagnostic>,
    pub files_read: Vec<PathBuf>,
    pub folder: Option<PathBuf>,
    /// Programs of files that have been read before, by path.
    pub program_of: FxHashMap<PathBuf, u32>,
    /// What is not modelled.
    pub missing: super::missing::MissingList,
    /// What `#fopen` has opened.
    pub data_files: super::data_file::DataFiles,
    warned: rustc_hash::FxHashSet<(Span, &'static str)>,
}

impl<'a> Machine<'a> {
    pub fn new(options: &'a Options) -> Self {
        let start = Lexeme { token: Token::End, program: 0, index: 0 };
        Machine {
            options,
            sources: SourceMap::default(),
            symbols: Symbols::default(),
            programs: Vec::new(),
            frames: Vec::new(),
            loops: Vec::new(),
            scopes: Scopes::default(),
            peeked: None,
            last: start,
            braces: 0,
            nesting: 0,
            expand: true,
            steps: 0,
            memory: 0,
            // A scene that does not say `#version` is read by the rules of 3.62 (measured).
            version: 3.62,
            version_set: false,
            gamma_set: false,
            default_texture: Default::default(),
            default_shared: None,
            scene: Scene::default(),
            messages: Vec::new(),
            diagnostics: Vec::new(),
            files_read: Vec::new(),
            folder: None,
            program_of: FxHashMap::default(),
            missing: Default::default(),
            data_files: Default::default(),
            warned: Default::default(),
        }
    }

    // ----------------------------------------------------------------------------------------------------------
    // Tokens

    /// Takes the next token.
    #[inline]
    pub fn next(&mut self) -> Res<Lexeme> {
        let lexeme = match self.peeked.take() {
            Some(lexeme) => lexeme,
            None => self.pull()?,
        };
        match lexeme.token {
            Token::Mark(Mark::OpenBrace) => self.braces += 1,
            Token::Mark(Mark::CloseBrace) => self.braces = self.braces.saturating_sub(1),
            _ => {}
        }
        self.last = lexeme;
        Ok(lexeme)
    }

    /// Looks at the next token. Directives before it are carried out.
    #[inline]
    pub fn peek(&mut self) -> Res<Token> {
        if self.peeked.is_none() {
            self.peeked = Some(self.pull()?);
        }
        Ok(self.peeked.map_or(Token::End, |lexeme| lexeme.token))
    }

    /// The token that was looked at, with its place.
    pub fn peek_lexeme(&mut self) -> Res<Lexeme> {
        self.peek()?;
        Ok(self.peeked.unwrap_or(self.last))
    }

    /// The next token of the text; directives and macro calls on the way are carried out.
    fn pull(&mut self) -> Res<Lexeme> {
        loop {
            if let Some(lexeme) = self.peeked.take() {
                return Ok(lexeme);
            }
            self.steps += 1;
            if self.steps > self.options.limits.steps {
                return Err(self.halt(format!(
                    "stopped after {} evaluation steps: the script does not seem to end",
                    self.options.limits.steps
                )));
            }
            let depth = self.frames.len();
            let Some(frame) = self.frames.last_mut() else {
                return Ok(Lexeme { token: Token::End, ..self.last });
            };
            let lexeme = Lexeme {
                token: self.programs[frame.program as usize].tokens[frame.next as usize],
                program: frame.program,
                index: frame.next,
            };
            frame.next += 1;
            match lexeme.token {
                Token::Directive(directive, jump) => self.directive(directive, jump, lexeme)?,
                // A `#` before what is no directive is no mistake (measured).
                Token::Junk('#') => {}
                Token::Name(symbol) if self.expand => {
                    let Some(Value::Macro(callee)) = self.scopes.get(symbol) else { return Ok(lexeme) };
                    let callee = callee.clone();
                    self.call(&callee, lexeme)?;
                }
                Token::End => {
                    if depth == 1 {
                        frame.next -= 1;
                        return Ok(lexeme);
                    }
                    self.leave_frame();
                }
                _ => return Ok(lexeme),
            }
        }
    }

    /// Where the next token of the innermost text stands, if none has been looked at yet.
    #[inline]
    pub fn raw_position(&self) -> Option<(u32, u32)> {
        match self.peeked {
            Some(_) => None,
            None => self.frames.last().map(|frame| (frame.program, frame.next)),
        }
    }

    /// Takes the token at [`Machine::raw_position`], which is neither a directive, a name nor a bracket.
    #[inline]
    pub fn take_raw(&mut self) {
        if let Some(frame) = self.frames.last_mut() {
            let token = self.programs[frame.program as usize].tokens[frame.next as usize];
            self.last = Lexeme { token, program: frame.program, index: frame.next };
            frame.next += 1;
            self.steps += 1;
        }
    }

    /// The next token of the innermost text as it stands; no directive is carried out.
    pub fn peek_raw(&self) -> Token {
        match (self.peeked, self.frames.last()) {
            (Some(lexeme), _) => lexeme.token,
            (None, Some(frame)) => self.programs[frame.program as usize].tokens[frame.next as usize],
            (None, None) => Token::End,
        }
    }

    /// Looks at the token behind what may be a whole value: a directive there is not carried out but ends the
    /// value. `#declare A = B` goes without a semicolon for most kinds of values, and the next `#declare` or `#ifdef`
    /// must find `A` declared.
    pub fn peek_behind_value(&mut self) -> Res<Token> {
        // A macro whose body ends with the value is left, and what follows the call is looked at.
        while self.frames.len() > 1 && matches!(self.peek_raw(), Token::Directive(Directive::EndMacro, _)) {
            self.leave_frame();
        }
        match self.peek_raw() {
            token @ Token::Directive(..) => Ok(token),
            _ => self.peek(),
        }
    }

    /// Looks at the token behind a number, which may be an operator. In scenes before 3.5 numbers too are declared without
    /// a semicolon.
    #[inline]
    pub fn peek_operator(&mut self) -> Res<Token> {
        if self.version > 3.1 { self.peek() } else { self.peek_behind_value() }
    }

    /// The token that [`Machine::peek_raw`] sees, for messages.
    pub fn describe_raw(&self) -> String {
        match (self.peeked, self.frames.last()) {
            (Some(lexeme), _) => self.describe(lexeme),
            (None, Some(frame)) => {
                let token = self.peek_raw();
                self.describe(Lexeme { token, program: frame.program, index: frame.next })
            }
            (None, None) => "the end of the file".into(),
        }
    }

    /// Takes a `;` if one follows at once. Looking further would carry out the directives that follow.
    pub fn optional_semicolon(&mut self) {
        if self.peek_raw() == Token::Mark(Mark::Semicolon) {
            match self.peeked {
                Some(_) => self.peeked = None,
                None => {
                    if let Some(frame) = self.frames.last_mut() {
                        frame.next += 1;
                    }
                }
            }
        }
    }

    /// Ends the innermost include or macro.
    pub fn leave_frame(&mut self) {
        if let Some(frame) = self.frames.pop() {
            self.loops.truncate(frame.loops);
            self.scopes.pop();
        }
    }

    pub fn enter_frame(&mut self, program: u32, next: u32, kind: FrameKind, from: Option<Lexeme>) -> Res<()> {
        if self.frames.len() >= self.options.limits.calls {
            let message =
                format!("more than {} macro calls or includes within each other", self.options.limits.calls);
            return Err(self.halt(message));
        }
        if !self.frames.is_empty() {
            self.scopes.push();
        }
        self.frames.push(Frame { program, next, loops: self.loops.len(), kind, from });
        Ok(())
    }

    /// Sends the innermost frame to the token at `index`.
    pub fn jump(&mut self, index: u32) {
        if let Some(frame) = self.frames.last_mut() {
            frame.next = index;
        }
    }

    /// Reads a call's arguments and enters the macro.
    fn call(&mut self, callee: &Macro, at: Lexeme) -> Res<()> {
        self.deeper(|m| {
            let name = m.symbols.name(callee.name).clone();
            if m.peek()? != Token::Mark(Mark::OpenParen) {
                let found = m.describe_peeked()?;
                let message = format!("expected `(` and the arguments of macro `{name}`, found {found}");
                return Err(m.error_at_next(message));
            }
            m.next()?;
            let mut slots: smallvec::SmallVec<[Slot; 4]> = Default::default();
            for (index, _) in callee.params.iter().enumerate() {
                m.comma()?;
                if m.peek()? == Token::Mark(Mark::CloseParen) {
                    let wants = callee.params.len();
                    let message = format!("macro `{name}` wants {wants} arguments, found {index}");
                    return Err(m.error_at_next(message));
                }
                slots.push(m.argument()?);
            }
            m.comma()?;
            m.expect(Mark::CloseParen)?;
            m.enter_frame(callee.program, callee.body, FrameKind::Macro(callee.name), Some(at))?;
            for (param, slot) in callee.params.iter().zip(slots) {
                m.scopes.bind_local(*param, slot);
            }
            Ok(())
        })
    }

    /// Runs `read` one level further down; refuses to go too deep.
    pub fn deeper<T>(&mut self, read: impl FnOnce(&mut Self) -> Res<T>) -> Res<T> {
        if self.nesting >= NESTING {
            return Err(self.halt(format!("nested more than {NESTING} levels deep")));
        }
        self.nesting += 1;
        let result = read(self);
        self.nesting -= 1;
        result
    }

    /// Counts `bytes` of memory that the script has asked for.
    pub fn charge(&mut self, bytes: usize) -> Res<()> {
        self.memory += bytes as u64;
        if self.memory > self.options.limits.memory {
            let limit = self.options.limits.memory >> 20;
            return Err(self.halt(format!("stopped: the scene's values need more than {limit} MB")));
        }
        Ok(())
    }

    // ----------------------------------------------------------------------------------------------------------
    // Expectations

    /// Takes the next token if it is `mark`.
    pub fn accept(&mut self, mark: Mark) -> Res<bool> {
        let found = self.peek()? == Token::Mark(mark);
        if found {
            self.next()?;
        }
        Ok(found)
    }

    /// Takes the next token if it is `word`.
    pub fn accept_word(&mut self, word: Keyword) -> Res<bool> {
        let found = self.peek()? == Token::Word(word);
        if found {
            self.next()?;
        }
        Ok(found)
    }

    /// Commas between values may be left out.
    pub fn comma(&mut self) -> Res<()> {
        self.accept(Mark::Comma).map(|_| ())
    }

    pub fn expect(&mut self, mark: Mark) -> Res<Lexeme> {
        if self.peek()? == Token::Mark(mark) {
            return self.next();
        }
        let found = self.describe_peeked()?;
        Err(self.error_at_next(format!("expected `{}`, found {found}", mark.text())))
    }

    /// The `{` of a block.
    pub fn open(&mut self, what: &str) -> Res<Lexeme> {
        if self.peek()? == Token::Mark(Mark::OpenBrace) {
            return self.next();
        }
        let found = self.describe_peeked()?;
        Err(self.error_at_next(format!("expected `{{` after `{what}`, found {found}")))
    }

    /// The `}` of a block that `open` began.
    pub fn close(&mut self, what: &str, open: Lexeme) -> Res<()> {
        match self.peek()? {
            Token::Mark(Mark::CloseBrace) => self.next().map(|_| ()),
            Token::End => Err(self.unclosed(what, open)),
            _ => {
                let found = self.describe_peeked()?;
                Err(self.error_at_next(format!("expected `}}` or more of `{what}`, found {found}")))
            }
        }
    }

    pub fn unclosed(&mut self, what: &str, open: Lexeme) -> Stop {
        self.error(format!("this `{{` of `{what}` is never closed"), self.span(open))
    }

    /// Takes everything up to the `}` that belongs to an `{` already taken.
    pub fn skip_block(&mut self, what: &str, open: Lexeme) -> Res<()> {
        let inside = self.braces;
        let expand = std::mem::replace(&mut self.expand, false);
        let result = loop {
            match self.next() {
                Ok(Lexeme { token: Token::End, .. }) => break Err(self.unclosed(what, open)),
                Ok(_) if self.braces < inside => break Ok(()),
                Ok(_) => {}
                Err(stop) => break Err(stop),
            }
        };
        self.expand = expand;
        result
    }

    // ----------------------------------------------------------------------------------------------------------
    // Saying what is wrong

    pub fn span(&self, lexeme: Lexeme) -> Span {
        self.programs[lexeme.program as usize].span(lexeme.index as usize)
    }

    /// A token as a message names it.
    pub fn describe(&self, lexeme: Lexeme) -> String {
        match lexeme.token {
            Token::End => "the end of the file".into(),
            Token::Junk(c) => format!("the character `{c}`, which is no part of the language"),
            Token::BrokenString => "a string without its closing quote".into(),
            Token::BrokenComment => "a comment without its `*/`".into(),
            Token::Name(symbol) => match self.scopes.get(symbol) {
                Some(value) => format!("{} `{}`", value.kind(), self.symbols.name(symbol)),
                None => format!("undeclared identifier `{}`", self.symbols.name(symbol)),
            },
            Token::String(_) => "a string".into(),
            Token::Vector(..) => "a vector".into(),
            _ => format!("`{}`", self.sources.text(self.span(lexeme))),
        }
    }

    pub fn describe_peeked(&mut self) -> Res<String> {
        let lexeme = self.peek_lexeme()?;
        Ok(self.describe(lexeme))
    }

    pub fn error(&self, message: impl Into<String>, span: Span) -> Stop {
        Stop::Error(Box::new(Diagnostic::error(message, span)))
    }

    /// An error at the token that was looked at (or else at the last one taken).
    pub fn error_at_next(&mut self, message: impl Into<String>) -> Stop {
        let lexeme = self.peeked.unwrap_or(self.last);
        let mut diagnostic = Diagnostic::error(message, self.span(lexeme));
        if let Token::Name(symbol) = lexeme.token
            && self.scopes.get(symbol).is_none()
        {
            diagnostic.help = self.suggestion(symbol);
        }
        Stop::Error(Box::new(diagnostic))
    }

    /// An error at the last token taken.
    pub fn error_here(&self, message: impl Into<String>) -> Stop {
        self.error(message, self.span(self.last))
    }

    /// "expected `what`, found (the next token)".
    pub fn expected<T>(&mut self, what: &str) -> Res<T> {
        if let Token::Name(symbol) = self.peek()?
            && matches!(self.scopes.get(symbol), Some(Value::Poison))
        {
            return Err(Stop::Silent);
        }
        let found = self.describe_peeked()?;
        Err(self.error_at_next(format!("expected {what}, found {found}")))
    }

    pub fn halt(&self, message: impl Into<String>) -> Stop {
        Stop::Halt(Some(Box::new(Diagnostic::error(message, self.span(self.last)))))
    }

    /// Tells a warning, once per place.
    pub fn warn(&mut self, kind: &'static str, message: impl Into<String>, span: Span) {
        if self.warned.insert((span, kind)) {
            let diagnostic = Diagnostic::new(Severity::Warning, message, Some(span));
            self.tell(diagnostic);
        }
    }

    /// Writes a diagnostic down, with the way that led there.
    pub fn tell(&mut self, mut diagnostic: Diagnostic) {
        if diagnostic.severity > Severity::Note {
            for frame in self.frames.iter().rev() {
                let Some(from) = frame.from else { continue };
                let message = match frame.kind {
                    FrameKind::Macro(symbol) => {
                        format!("in macro `{}`, called here", self.symbols.name(symbol))
                    }
                    _ => "in a file included here".to_string(),
                };
                let span = self.span(from);
                if diagnostic.span != Some(span) {
                    diagnostic.notes.push((message, Some(span)));
                }
            }
        }
        self.diagnostics.push(diagnostic);
    }

    /// Tells what stopped a statement. False if it is time to give up.
    pub fn report(&mut self, stop: Stop) -> bool {
        let (diagnostic, go_on) = match stop {
            Stop::Error(diagnostic) => (Some(diagnostic), true),
            Stop::Silent => (None, true),
            Stop::Halt(diagnostic) => (diagnostic, false),
        };
        if let Some(diagnostic) = diagnostic {
            self.tell(*diagnostic);
        }
        let errors = self.diagnostics.iter().filter(|d| d.severity == Severity::Error).count();
        go_on && errors < self.options.limits.errors
    }

    pub fn say(&mut self, stream: Stream, text: String) {
        self.messages.push(Message { stream, text });
    }

    /// A name or keyword that is nearly `symbol`, as a help text.
    pub fn suggestion(&self, symbol: Symbol) -> Option<String> {
        let wrong = self.symbols.name(symbol);
        let names = self.scopes.names().map(|s| self.symbols.name(s).as_ref());
        let words = Keyword::ALL.iter().map(|k| k.text());
        let limit = (wrong.len() / 3).clamp(1, 3);
        let best = names.chain(words).map(|name| (distance(wrong, name, limit), name)).min()?;
        (best.0 <= limit).then(|| format!("there is `{}`", best.1))
    }
}

/// Edits between two words, case apart counting as nothing much; `limit + 1` if more than `limit`.
fn distance(a: &str, b: &str, limit: usize) -> usize {
    if a.len().abs_diff(b.len()) > limit {
        return limit + 1;
    }
    let (a, b) = (a.to_ascii_lowercase().into_bytes(), b.to_ascii_lowercase().into_bytes());
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.iter().enumerate() {
        let mut left_above = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let above = row[j + 1];
            row[j + 1] = (left_above + usize::from(x != y)).min(above + 1).min(row[j] + 1);
            left_above = above;
        }
    }
    row[b.len()]
}
