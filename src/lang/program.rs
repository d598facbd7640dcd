//! A file as tokens, ready to be evaluated any number of times.

use super::{FileId, Keyword, Span, Symbol};
use std::sync::Arc;

/// A file's tokens in order. Loops and macro bodies are ranges of them and are never read anew.
///
/// The nesting of directives is kept as jumps: each [`Token::Directive`] carries the index of the token where
/// evaluation goes on if the part that follows it is not wanted (see [`Directive`]).
#[derive(Debug, Clone, Default)]
pub struct Program {
    /// Ends with [`Token::End`].
    pub tokens: Vec<Token>,
    /// For each token its first byte and its length in bytes.
    pub places: Vec<(u32, u32)>,
    /// What [`Token::Vector`] and [`Token::Rows`] index.
    pub numbers: Vec<f64>,
    /// What [`Token::String`] indexes: text between the quotes, escapes not yet resolved.
    pub strings: Vec<Arc<str>>,
    /// Whose text it is.
    pub file: Option<FileId>,
}

/// What the language is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Token {
    /// A float without a sign.
    Number(f64),
    /// A vector of two or more plain numbers: the first one's index, and how many.
    Vector(u32, u16),
    /// The vectors of three plain numbers that begin a list of a mesh2, with their commas: the first number's index, and
    /// how many vectors.
    Rows(u32, u32),
    /// A string, by index.
    String(u32),
    /// A user's name.
    Name(Symbol),
    /// A word of the language.
    Word(Keyword),
    /// A bracket, operator or separator.
    Mark(Mark),
    /// A directive and its jump.
    Directive(Directive, u32),
    /// A block or colour that a library declares, with the word that begins it; [`Manner::Skim`](super::Manner) leaves its text as it is.
    Block(Keyword),
    /// The body of a library's macro, likewise.
    Body,
    /// A character that is no part of the language.
    Junk(char),
    /// `"` without its partner.
    BrokenString,
    /// `/*` without its partner.
    BrokenComment,
    /// The end of the file.
    End,
}

/// Brackets, operators, separators.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "a variant is the word or sign")]
pub enum Mark {
    OpenBrace,
    CloseBrace,
    OpenParen,
    CloseParen,
    OpenBracket,
    CloseBracket,
    Less,
    Greater,
    LessEqual,
    GreaterEqual,
    Equal,
    NotEqual,
    Not,
    And,
    Or,
    Question,
    Colon,
    Semicolon,
    Comma,
    Dot,
    Plus,
    Minus,
    Star,
    Slash,
}

/// Directives, with the meaning of their jumps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "a variant is the word or sign")]
pub enum Directive {
    /// Jumps to the matching `#elseif`, `#else` or `#end`, as do the next three.
    If,
    Ifdef,
    Ifndef,
    Elseif,
    /// Of an `#if`; jumps to its `#end`.
    Else,
    /// Of an `#if` or `#switch`.
    EndBranch,
    /// Jumps to its `#end`.
    While,
    /// Jumps back to its `#while`.
    EndWhile,
    /// Jumps to its `#end`.
    For,
    /// Jumps back to its `#for`.
    EndFor,
    /// Jumps to the first `#case`, `#range` or `#else` of it, or to its `#end`.
    Switch,
    /// Jumps to the next `#case`, `#range`, `#else` or to the `#end`, as does the next one.
    Case,
    Range,
    /// An `#elseif` or `#else` behind the `#else`: an error if evaluation comes by. Jumps as they do.
    LateBranch,
    /// Of a `#switch`; jumps to its next branch or its `#end`.
    SwitchElse,
    /// Jumps to the `#end` of the innermost loop, switch or macro.
    Break,
    /// Jumps to its `#end`.
    Macro,
    EndMacro,
    Declare,
    Local,
    Undef,
    Include,
    Version,
    Default,
    Debug,
    Warning,
    Error,
    Render,
    Statistics,
    Fopen,
    Fclose,
    Read,
    Write,
}

impl Mark {
    /// As it is written.
    pub fn text(self) -> &'static str {
        use Mark::*;
        match self {
            OpenBrace => "{",
            CloseBrace => "}",
            OpenParen => "(",
            CloseParen => ")",
            OpenBracket => "[",
            CloseBracket => "]",
            Less => "<",
            Greater => ">",
            LessEqual => "<=",
            GreaterEqual => ">=",
            Equal => "=",
            NotEqual => "!=",
            Not => "!",
            And => "&",
            Or => "|",
            Question => "?",
            Colon => ":",
            Semicolon => ";",
            Comma => ",",
            Dot => ".",
            Plus => "+",
            Minus => "-",
            Star => "*",
            Slash => "/",
        }
    }

    /// The mark written so; `None` if there is none.
    pub(super) fn from_text(text: &str) -> Option<Mark> {
        use Mark::*;
        Some(match text {
            "{" => OpenBrace,
            "}" => CloseBrace,
            "(" => OpenParen,
            ")" => CloseParen,
            "[" => OpenBracket,
            "]" => CloseBracket,
            "<" => Less,
            ">" => Greater,
            "<=" => LessEqual,
            ">=" => GreaterEqual,
            "=" => Equal,
            "!=" => NotEqual,
            "!" => Not,
            "&" => And,
            "|" => Or,
            "?" => Question,
            ":" => Colon,
            ";" => Semicolon,
            "," => Comma,
            "." => Dot,
            "+" => Plus,
            "-" => Minus,
            "*" => Star,
            "/" => Slash,
            _ => return None,
        })
    }
}

impl Program {
    /// Where the token at `index` stands.
    pub fn span(&self, index: usize) -> Span {
        let (start, len) = self.places[index];
        Span { file: self.file.unwrap_or(FileId(0)), start, end: start + len }
    }
}
