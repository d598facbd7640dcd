//! The state of an evaluation, its bounds, and the phrases' small change: this mark is due, that block is left.
//!
//! Whoever reads a phrase asks for the next token (`cursor.rs`); what is wrong is told through `complaint.rs`.

use super::scope::Scopes;
use super::{Message, Options};
use crate::lang::{Diagnostic, Keyword, Mark, Program, SourceMap, Span, Symbol, Symbols, Token};
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
    /// Where it goes on once the frames above it are done.
    pub next: u32,
    /// How many loops were under way when it began.
    pub loops: usize,
    pub kind: FrameKind,
    /// The call or the `#include`.
    pub from: Option<Lexeme>,
    /// Of each `#switch` under way whose first `#case` has not been met: which token that is, and the value.
    pub switches: Vec<(u32, f64)>,
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

/// Stack of an evaluation: enough for [`NESTING`] levels at 64 kB each.
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
    /// Expressions that came by more than once, by program.
    pub compiled: Vec<super::compiled::Compiled>,
    /// The innermost text, which is the last frame's, and the token in it that is next.
    pub text: Arc<Program>,
    pub program: u32,
    pub at: u32,
    /// The token at `at` has been looked at: it is no directive, no call, no end of a macro.
    pub ready: bool,
    /// The last token taken.
    pub last: Lexeme,
    /// Where the last macro or include to end was called from: the token behind the call, and its program first.
    pub returned: (u32, u32),
    /// How many scopes were open where the declaration under way began.
    pub declare_depth: usize,
    /// The name that the declaration under way gives a value.
    pub declaring: Option<Symbol>,
    /// Braces open around the next token.
    pub braces: usize,
    nesting: usize,
    /// False while names are wanted as they stand (`#ifdef`, `#declare`, skipping).
    pub expand: bool,
    pub steps: u64,
    memory: u64,
    /// The version whose rules hold, times 100; and whether a `#version` has said so.
    pub version: f64,
    pub version_set: bool,
    pub gamma_set: bool,
    pub generator_set: bool,
    pub camera_set: bool,
    /// POV-Ray reads other characters in strings as blanks.
    pub ascii: bool,
    /// A `#version` in the scene's own text that is not its first statement.
    pub late_version: Option<Span>,
    /// What `#default` has made of the texture, and the same shared among the objects that have no other.
    pub default_texture: super::value::With<crate::scene::Texture>,
    pub default_shared: Option<Arc<crate::scene::Texture>>,
    /// Some finish so far says what the interior of its object is to be.
    pub finishes_of_interiors: bool,
    /// Library blocks that have not been asked for yet, and those that have.
    pub later: super::later::Blocks,
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
    /// What was asked about last by `trace` and `inside`.
    pub solids: Vec<super::geometry::Known>,
    pub warned: rustc_hash::FxHashSet<(Span, &'static str)>,
    /// How many warnings there were of each kind.
    pub warnings: FxHashMap<&'static str, usize>,
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
            compiled: Vec::new(),
            text: Arc::default(),
            program: 0,
            at: 0,
            ready: false,
            last: start,
            returned: (0, 0),
            declare_depth: 0,
            declaring: None,
            braces: 0,
            nesting: 0,
            expand: true,
            steps: 0,
            memory: 0,
            // A scene that does not say `#version` is read by the rules of 3.62 (measured).
            version: 3.62,
            version_set: false,
            gamma_set: false,
            generator_set: false,
            camera_set: false,
            ascii: true,
            late_version: None,
            default_texture: Default::default(),
            default_shared: None,
            finishes_of_interiors: false,
            later: Default::default(),
            scene: Scene::default(),
            messages: Vec::new(),
            diagnostics: Vec::new(),
            files_read: Vec::new(),
            folder: None,
            program_of: FxHashMap::default(),
            missing: Default::default(),
            data_files: Default::default(),
            solids: Vec::new(),
            warned: Default::default(),
            warnings: Default::default(),
        }
    }

    /// Tells that the value of a name is about to change or to go.
    #[inline]
    pub fn before_change(&mut self, symbol: Symbol) -> Res<()> {
        match self.scopes.older_than_blocks(symbol) {
            None => Ok(()),
            Some((variable, since)) => self.evaluate_naming(variable, since),
        }
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

    /// Counts steps that the script has had done for it.
    pub fn count_steps(&mut self, steps: u64) -> Res<()> {
        self.steps = self.steps.saturating_add(steps);
        if self.steps > self.options.limits.steps {
            return Err(self.halt(format!("stopped after {} evaluation steps", self.options.limits.steps)));
        }
        Ok(())
    }

    /// Counts `bytes` of memory that the script has asked for.
    pub fn charge(&mut self, bytes: usize) -> Res<()> {
        self.memory = self.memory.saturating_add(bytes as u64);
        if self.memory > self.options.limits.memory {
            let limit = self.options.limits.memory >> 20;
            return Err(self.halt(format!("stopped: the scene's values need more than {limit} MB")));
        }
        Ok(())
    }

    // ----------------------------------------------------------------------------------------------------------
    // Expectations

    /// Takes the next token if it is `mark`.
    #[inline]
    pub fn accept(&mut self, mark: Mark) -> Res<bool> {
        // A mark is what it is: nothing need be carried out before it is known.
        if !matches!(self.peek_raw(), Token::Mark(found) if found == mark) {
            if self.ready || !matches!(self.peek()?, Token::Mark(found) if found == mark) {
                return Ok(false);
            }
        } else if !self.ready {
            self.steps += 1;
        }
        self.take_mark(mark);
        Ok(true)
    }

    /// Takes the next token if it is `word`.
    pub fn accept_word(&mut self, word: Keyword) -> Res<bool> {
        let found = matches!(self.peek()?, Token::Word(found) if found == word);
        if found {
            self.next()?;
        }
        Ok(found)
    }

    /// Commas between values may be left out.
    #[inline]
    pub fn comma(&mut self) -> Res<()> {
        self.accept(Mark::Comma).map(|_| ())
    }

    #[inline]
    pub fn expect(&mut self, mark: Mark) -> Res<Lexeme> {
        if self.accept(mark)? { Ok(self.last) } else { self.unexpected(mark) }
    }

    #[cold]
    fn unexpected(&mut self, mark: Mark) -> Res<Lexeme> {
        let found = self.describe_peeked()?;
        Err(self.error_at_next(format!("expected `{}`, found {found}", mark.text())))
    }

    /// The `{` of a block.
    pub fn open(&mut self, what: &str) -> Res<Lexeme> {
        if self.accept(Mark::OpenBrace)? {
            return Ok(self.last);
        }
        let found = self.describe_peeked()?;
        Err(self.error_at_next(format!("expected `{{` after `{what}`, found {found}")))
    }

    /// The `}` of a block that `open` began.
    pub fn close(&mut self, what: &str, open: Lexeme) -> Res<()> {
        if self.accept(Mark::CloseBrace)? {
            return Ok(());
        }
        match self.peek()? {
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
}
