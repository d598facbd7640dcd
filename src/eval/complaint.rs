//! What is wrong, in words: tokens as messages name them, errors with the way that led there, near misses.

use super::advice::SHOWN_OF_A_KIND;
use super::machine::{FrameKind, Lexeme, Machine, Res, Stop};
use super::value::Value;
use super::{Message, Stream};
use crate::lang::{Diagnostic, Keyword, Severity, Span, Symbol, Token};

impl Machine<'_> {
    pub fn span(&self, lexeme: Lexeme) -> Span {
        self.programs[lexeme.program as usize].span(lexeme.index as usize)
    }

    /// A token as it is written.
    pub fn text_of(&self, lexeme: Lexeme) -> &str {
        self.sources.text(self.span(lexeme))
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
            Token::Rows(..) => "a list of vectors".into(),
            Token::Block(word) => format!("`{}`", word.text()),
            Token::Body => "the body of a macro".into(),
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
        let lexeme = if self.ready { self.here() } else { self.last };
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

    /// Tells a warning, once per place; of a kind that comes often, only the first.
    pub fn warn(&mut self, kind: &'static str, message: impl Into<String>, span: Span) {
        if !self.warned.insert((span, kind)) {
            return;
        }
        let count = self.warnings.entry(kind).or_default();
        *count += 1;
        if *count <= SHOWN_OF_A_KIND {
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
