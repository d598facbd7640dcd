//! Library blocks, colours and macro bodies that wait until somebody asks for them.
//!
//! A scene that includes `textures.inc` for one texture need not read the other hundred. In comes a declaration whose block has
//! been left as text (`lang`'s `skim`); the name is bound to where it stands and to all it depends on ([`Context`], and names by
//! their age: see [`Scopes`](super::scope::Scopes)). The first time a token names it, it is evaluated as it would have been there. Nobody can tell the
//! difference, but for this: what is wrong in a block, or is warned of, is told only if the block is used.

use super::machine::{Frame, FrameKind, Lexeme, Machine, Res, Stop};
use super::object::is_object;
use super::value::{Macro, Value, With};
use crate::lang::{Keyword, Span, Symbol, Token, read_part};
use crate::scene::{Gamma, Texture};
use memchr::memmem::Finder;
use rustc_hash::{FxHashMap, FxHashSet};
use std::sync::Arc;

/// A block that a library declares.
#[derive(Debug)]
pub(super) struct Later {
    symbol: Symbol,
    word: Keyword,
    /// Its token.
    program: u32,
    index: u32,
    /// Blocks are numbered in order.
    number: u32,
    context: Arc<Context>,
}

/// What a block depends on besides names.
#[derive(Debug)]
struct Context {
    version: f64,
    version_set: bool,
    gamma: Gamma,
    default: Arc<With<Texture>>,
    /// The includes that it is in, for messages.
    includes: Vec<(FrameKind, Option<Lexeme>)>,
}

/// All that waits or has waited.
#[derive(Debug, Default)]
pub(super) struct Blocks {
    /// Those not evaluated yet, in order, and some of the others.
    pending: Vec<Arc<Later>>,
    /// The program of the text at a token, once it has been cut into tokens.
    parts: FxHashMap<(u32, u32), u32>,
    /// Of the last block.
    context: Option<Arc<Context>>,
    /// The default texture as it is now.
    default: Option<Arc<With<Texture>>>,
}

impl Blocks {
    /// The default texture is about to change, or has.
    pub fn forget_default(&mut self) {
        self.default = None;
        self.context = None;
    }
}

impl Later {
    /// What it will be, for messages.
    pub fn kind(&self) -> &'static str {
        use Keyword as K;
        match self.word {
            K::ColourMap => K::ColorMap.text(),
            K::Rgb | K::Rgbf | K::Rgbt | K::Rgbft | K::Color | K::Colour => "colour",
            word if is_object(word) => "object",
            word => word.text(),
        }
    }
}

impl Machine<'_> {
    /// What stands to the right of `#declare Name =`.
    pub fn right_side(&mut self, symbol: Symbol) -> Res<Value> {
        let Token::Block(word) = self.peek_raw() else { return self.rvalue() };
        if !self.can_wait(symbol, self.here().index) {
            return self.block_here();
        }
        // Other blocks may mean what the name stood for before.
        self.before_change(symbol)?;
        let value = self.leave_for_later(symbol, word, self.at);
        self.take_raw();
        Ok(value)
    }

    /// `#declare Name = block` with the directive at hand, if the block can wait and nothing need be done before. Nothing but
    /// speed: libraries are made of these.
    #[inline]
    pub fn quick_block(&mut self, symbol: Symbol, word: Keyword) -> bool {
        let index = self.at + 3;
        if self.scopes.older_than_blocks(symbol).is_some() || !self.can_wait(symbol, index) {
            return false;
        }
        let value = self.leave_for_later(symbol, word, index);
        self.scopes.declare(symbol, value);
        self.scopes.make_young(symbol);
        self.steps += 3;
        self.jump(index + 1);
        self.optional_semicolon();
        true
    }

    fn leave_for_later(&mut self, symbol: Symbol, word: Keyword, index: u32) -> Value {
        let context = self.context();
        let number = self.scopes.leave_block();
        let later = Arc::new(Later { symbol, word, program: self.program, index, number, context });
        self.later.pending.push(later.clone());
        Value::Later(later)
    }

    /// True if the block at a token can be evaluated at any time: it is not within a macro, and no local is in it.
    fn can_wait(&self, symbol: Symbol, index: u32) -> bool {
        let in_macro = self.frames.iter().any(|frame| matches!(frame.kind, FrameKind::Macro(_)));
        if in_macro || self.scopes.is_local(symbol) {
            return false;
        }
        let before = self.scopes.outermost(symbol).map(|_| &symbol);
        let span = || self.text.span(index as usize);
        let mut names = before.into_iter().chain(self.scopes.locals());
        names.all(|name| !self.is_in(&Finder::new(self.symbols.name(*name).as_bytes()), span()))
    }

    /// True if a name may be in a text.
    fn is_in(&self, name: &Finder<'_>, span: Span) -> bool {
        name.find(self.sources.text(span).as_bytes()).is_some()
    }

    fn context(&mut self) -> Arc<Context> {
        let place = |lexeme: Option<Lexeme>| lexeme.map(|lexeme| (lexeme.program, lexeme.index));
        if let Some(context) = &self.later.context
            && context.version == self.version
            && context.version_set == self.version_set
            && context.gamma == self.scene.globals.assumed_gamma
            && context
                .includes
                .iter()
                .map(|include| place(include.1))
                .eq(self.frames.iter().map(|frame| place(frame.from)))
        {
            return context.clone();
        }
        let default = &self.default_texture;
        let default = self.later.default.get_or_insert_with(|| Arc::new(default.clone())).clone();
        let context = Arc::new(Context {
            version: self.version,
            version_set: self.version_set,
            gamma: self.scene.globals.assumed_gamma,
            default,
            includes: self.frames.iter().map(|frame| (frame.kind, frame.from)).collect(),
        });
        self.later.context = Some(context.clone());
        context
    }

    /// Evaluates what a name stands for, and what is needed for that, as the next token asks for it.
    #[inline(never)]
    pub fn evaluate_later(&mut self, later: &Arc<Later>) -> Res<()> {
        // From the last block on to what it names, so that no chain of them is too long for the stack.
        let mut wanted = vec![later.clone()];
        let mut numbers: FxHashSet<u32> = [later.number].into_iter().collect();
        let mut next = 0;
        while let Some(block) = wanted.get(next).cloned() {
            next += 1;
            let part = self.part(block.program, block.index)?;
            for token in &self.programs[part as usize].tokens {
                if let Token::Name(symbol) = token
                    && let Some(Value::Later(needed)) = self.scopes.outermost(*symbol)
                    && needed.number < block.number
                    && numbers.insert(needed.number)
                {
                    wanted.push(needed.clone());
                }
            }
        }
        wanted.sort_unstable_by_key(|block| block.number);
        wanted.iter().try_for_each(|block| self.evaluate_block(block))
    }

    /// Evaluates the blocks that mean the variable by its present value, which it has had since the block numbered `since`.
    #[cold]
    #[inline(never)]
    pub fn evaluate_naming(&mut self, variable: Symbol, since: u32) -> Res<()> {
        let mut pending = std::mem::take(&mut self.later.pending);
        pending.retain(|block| self.waits(block));
        let name = self.symbols.name(variable).clone();
        let name = Finder::new(name.as_bytes());
        for block in pending.iter().filter(|block| block.number > since) {
            let span = self.programs[block.program as usize].span(block.index as usize);
            if self.is_in(&name, span) {
                self.evaluate_later(block)?;
            }
        }
        pending.retain(|block| self.waits(block));
        self.later.pending = pending;
        self.scopes.make_young(variable);
        Ok(())
    }

    fn waits(&self, block: &Arc<Later>) -> bool {
        matches!(self.scopes.outermost(block.symbol), Some(Value::Later(later)) if Arc::ptr_eq(later, block))
    }

    /// Evaluates one block as if that had been done where it stands.
    fn evaluate_block(&mut self, block: &Arc<Later>) -> Res<()> {
        if !self.waits(block) {
            return Ok(());
        }
        let part = self.part(block.program, block.index)?;
        let mut names: Vec<Symbol> = Vec::new();
        names.extend(self.programs[part as usize].tokens.iter().filter_map(|token| match token {
            Token::Name(symbol) => Some(*symbol),
            _ => None,
        }));
        names.sort_unstable();
        names.dedup();
        let hidden: Vec<_> = names.iter().map(|name| self.scopes.hide(*name, block.number)).collect();
        let context = &block.context;
        let version = std::mem::replace(&mut self.version, context.version);
        let version_set = std::mem::replace(&mut self.version_set, context.version_set);
        let gamma = std::mem::replace(&mut self.scene.globals.assumed_gamma, context.gamma);
        let is_default = |default: &Arc<With<Texture>>| Arc::ptr_eq(default, &context.default);
        let default = (!self.later.default.as_ref().is_some_and(is_default)).then(|| {
            let then = With::clone(&context.default);
            (std::mem::replace(&mut self.default_texture, then), self.default_shared.take())
        });
        let loops = self.loops.len();
        let frame = |&(kind, from): &(FrameKind, Option<Lexeme>)| Frame {
            program: part,
            next: 0,
            loops,
            kind,
            from,
            switches: Vec::new(),
        };
        let frames = std::mem::replace(&mut self.frames, context.includes.iter().map(frame).collect());

        let value = self.run_part(part);

        self.frames = frames;
        if let Some((texture, shared)) = default {
            self.default_texture = texture;
            self.default_shared = shared;
        }
        self.scene.globals.assumed_gamma = gamma;
        self.version_set = version_set;
        self.version = version;
        hidden.into_iter().for_each(|hidden| self.scopes.show(hidden));
        let (value, result) = match value {
            Ok(value) => (value, Ok(())),
            Err(stop) => (Value::Poison, Err(stop)),
        };
        self.scopes.put_outermost(block.symbol, value);
        result
    }

    /// The value of the block at hand, now.
    pub fn block_here(&mut self) -> Res<Value> {
        let part = self.part(self.program, self.at)?;
        self.take_raw();
        self.run_part(part)
    }

    /// Where a macro's body begins.
    #[inline]
    pub fn body(&mut self, callee: &Macro) -> Res<(u32, u32)> {
        match self.programs[callee.program as usize].tokens[callee.body as usize] {
            Token::Body => Ok((self.part(callee.program, callee.body)?, 0)),
            _ => Ok((callee.program, callee.body)),
        }
    }

    /// The program of the text that is left at a token.
    fn part(&mut self, program: u32, index: u32) -> Res<u32> {
        if let Some(part) = self.later.parts.get(&(program, index)) {
            return Ok(*part);
        }
        let source = &self.programs[program as usize];
        let (token, span) = (source.tokens[index as usize], source.span(index as usize));
        let text = self.sources.file(span.file).text.clone();
        match read_part(token, span, &text, &mut self.symbols) {
            Ok(part) => self.programs.push(Arc::new(part)),
            Err(errors) => {
                errors.into_iter().for_each(|error| self.tell(error));
                return Err(Stop::Halt(None));
            }
        }
        let part = self.programs.len() as u32 - 1;
        self.later.parts.insert((program, index), part);
        Ok(part)
    }

    /// The value that a part is. What is wrong in it has been told: nothing but a halt comes out as an error.
    fn run_part(&mut self, part: u32) -> Res<Value> {
        if self.compiled.len() < self.programs.len() {
            self.compiled.resize_with(self.programs.len(), Default::default);
        }
        let compiled = &mut self.compiled[part as usize];
        compiled.repeats |= compiled.entered;
        compiled.entered = true;
        let place = (self.program, self.at, self.ready, self.last);
        let around = (self.braces, self.expand, self.declare_depth);
        let text = std::mem::replace(&mut self.text, self.programs[part as usize].clone());
        self.program = part;
        self.jump(0);
        (self.braces, self.expand, self.declare_depth) = (0, true, self.scopes.depth());

        let value = self.deeper(|m| m.rvalue()).or_else(|stop| match self.report(stop) {
            true => Ok(Value::Poison),
            false => Err(Stop::Halt(None)),
        });

        (self.braces, self.expand, self.declare_depth) = around;
        (self.program, self.at, self.ready, self.last) = place;
        self.text = text;
        value
    }
}
