//! Expressions in loops and macros, read once and then evaluated without reading.
//!
//! An expression that comes by for the second time is compiled, from its tokens alone, to a small tree ([`Code`]); from then
//! on its place in the text leads to the tree. Only what is sure to mean the same as reading it is compiled: no directive and
//! no macro call may stand in it or right behind it, and it has no side effect but `rand`. What names stand for is
//! looked up at every turn. Whenever a value is not as the tree wants it (a macro, a string, a vector where a float is
//! due, a subscript out of range, anything that will be an error), evaluation takes back its random numbers and
//! leaves the expression to the reader in `expr.rs`, which knows all the rules and all the messages.

use super::builtin::{
    constant, float_function, float_function_of_two, next_random, normalized, rotated, rotated_about,
};
use super::directive::EQUAL_WITHIN;
use super::expr::divide;
use super::machine::{Lexeme, Machine};
use super::scope::Scopes;
use super::value::{Num, Value};
use crate::lang::{Keyword, Mark, Program, Symbol, Token};
use glam::DVec3;
use smallvec::SmallVec;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

/// Which phrase begins at a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Level {
    /// A sum of products: a value anywhere.
    Sum,
    /// What may stand in parentheses: relations, `&`, `? :`.
    Choice,
}

/// What is compiled of one program.
#[derive(Debug, Default)]
pub(super) struct Compiled {
    codes: Vec<Code>,
    /// For each token and level, if an expression has begun there: [`SEEN`], [`REFUSED`], or a code's index plus [`FIRST`].
    at: [Vec<u32>; 2],
}

const SEEN: u32 = 1;
const REFUSED: u32 = 2;
const FIRST: u32 = 3;

/// A compiled expression.
#[derive(Debug)]
struct Code {
    /// Children before parents: the last one is the value.
    nodes: Vec<Node>,
    /// The token behind it.
    end: u32,
    /// The token behind it is a name; if it is a macro's, its call comes first.
    next_name: Option<Symbol>,
    /// Its last value was a float: the next one will be, most likely.
    scalar: bool,
}

type Id = u32;

#[derive(Debug, Clone)]
enum Node {
    Float(f64),
    Num(Box<Num>),
    Name(Symbol),
    /// `Name[i][j]`, through as many arrays as it takes.
    Element(Symbol, SmallVec<[Id; 2]>),
    /// `<a, b, c>`.
    Vector(SmallVec<[Id; 3]>),
    Component(usize, Id),
    Negative(Id),
    Not(Id),
    Add(Id, Id),
    Subtract(Id, Id),
    Multiply(Id, Id),
    Divide(Id, Id),
    Compare(Mark, Id, Id),
    And(Id, Id),
    Or(Id, Id),
    Choice(Id, Id, Id),
    One(fn(f64) -> f64, Id),
    Two(fn(f64, f64) -> f64, Id, Id),
    Length(Id),
    Dot(Id, Id),
    OneVector(fn(DVec3) -> DVec3, Id),
    TwoVectors(fn(DVec3, DVec3) -> DVec3, Id, Id),
    AxisRotate(Id, Id, Id),
    Random(Symbol),
}

/// Expressions of more nodes than this are read every time: the tree is walked by recursion.
const NODES: usize = 200;

/// So are those nested more deeply than this: compiling recurses too.
const DEPTH: usize = 50;

impl Machine<'_> {
    /// The value of the float that begins at the next token, if it has been compiled.
    #[inline]
    pub fn compiled_float(&mut self) -> Option<f64> {
        let id = self.code_at(self.at, Level::Sum)?;
        self.run_code(id, |run, root| run.float(root))
    }

    /// The value of the 3-vector that begins at the next token, if it has been compiled.
    #[inline]
    pub fn compiled_vector(&mut self) -> Option<DVec3> {
        let id = self.code_at(self.at, Level::Sum)?;
        self.run_code(id, |run, root| run.vector(root))
    }

    /// The value of the expression that begins at the next token, if it has been compiled.
    #[inline]
    pub fn compiled(&mut self, level: Level) -> Option<Num> {
        let id = self.code_at(self.at, level)?;
        self.run_num(id)
    }

    /// The value of the expression at token `start`, if it has been compiled and `mark` is behind it, which is taken too.
    #[inline]
    pub fn compiled_between(&mut self, start: u32, level: Level, mark: Mark) -> Option<Num> {
        let program = self.program as usize;
        let compiled = self.compiled.get(program)?;
        let index = compiled.at[level as usize].get(start as usize)?.checked_sub(FIRST)?;
        let end = compiled.codes[index as usize].end;
        if !matches!(self.text.tokens[end as usize], Token::Mark(found) if found == mark) {
            return None;
        }
        let num = self.run_num((program, index as usize))?;
        self.at = end + 1;
        Some(num)
    }

    /// Evaluates a code: as a float, which takes a fraction of the time, if it was one the last time.
    #[inline]
    fn run_num(&mut self, id: (usize, usize)) -> Option<Num> {
        if self.compiled[id.0].codes[id.1].scalar
            && let Some(value) = self.run_code(id, |run, root| run.float(root))
        {
            return Some(Num::float(value));
        }
        let num = self.run_code(id, |run, root| run.num(root))?;
        self.compiled[id.0].codes[id.1].scalar = num.n == 1;
        Some(num)
    }

    /// The code of the expression at token `start`. Compiles what comes by for the second time.
    #[inline]
    fn code_at(&mut self, start: u32, level: Level) -> Option<(usize, usize)> {
        let program = self.program as usize;
        let entry = *self.compiled.get(program)?.at[level as usize].get(start as usize).unwrap_or(&0);
        match entry {
            REFUSED => None,
            0 | SEEN => self.code_to_be(start, level),
            index => Some((program, (index - FIRST) as usize)),
        }
    }

    #[inline(never)]
    fn code_to_be(&mut self, start: u32, level: Level) -> Option<(usize, usize)> {
        let program = self.program as usize;
        let compiled = self.compiled.get_mut(program)?;
        let table = &mut compiled.at[level as usize];
        if table.is_empty() {
            table.resize(self.text.tokens.len(), 0);
        }
        let entry = table.get_mut(start as usize)?;
        match *entry {
            0 => *entry = SEEN,
            SEEN => match Compiler::compile(&self.text, start, level) {
                Some(code) => {
                    *entry = compiled.codes.len() as u32 + FIRST;
                    compiled.codes.push(code);
                    return Some((program, compiled.codes.len() - 1));
                }
                None => *entry = REFUSED,
            },
            _ => {}
        }
        None
    }

    /// Evaluates a code and goes on behind it; `None`, and nothing has happened, if the reader must do it.
    #[inline]
    fn run_code<T>(
        &mut self,
        (program, index): (usize, usize),
        value: impl FnOnce(&mut Run<'_>, Id) -> Option<T>,
    ) -> Option<T> {
        let code = self.compiled.get(program)?.codes.get(index)?;
        if let Some(name) = code.next_name
            && matches!(self.scopes.get(name), Some(Value::Macro(_)))
        {
            return None;
        }
        let root = code.nodes.len() as Id - 1;
        let mut run = Run { scopes: &self.scopes, nodes: &code.nodes, taken: SmallVec::new() };
        let Some(value) = value(&mut run, root) else {
            for (stream, state) in run.taken.into_iter().rev() {
                stream.store(state, Ordering::Relaxed);
            }
            return None;
        };
        drop(run);
        let (end, index) = (code.end, code.end - 1);
        self.steps += u64::from(end.saturating_sub(self.at));
        self.last = Lexeme { token: self.text.tokens[index as usize], program: program as u32, index };
        self.jump(end);
        Some(value)
    }
}

// --------------------------------------------------------------------------------------------------------------
// Evaluation

/// One evaluation of a code.
struct Run<'a> {
    scopes: &'a Scopes,
    nodes: &'a [Node],
    /// Random streams that were drawn from, and their states before.
    taken: SmallVec<[(&'a AtomicU32, u32); 4]>,
}

impl<'a> Run<'a> {
    /// A node's value if it is a float.
    fn float(&mut self, id: Id) -> Option<f64> {
        let nodes = self.nodes;
        Some(match &nodes[id as usize] {
            Node::Float(value) => *value,
            Node::Name(symbol) => match self.scopes.get(*symbol)? {
                Value::Number(num) if num.n == 1 => num.v[0],
                _ => return None,
            },
            Node::Element(symbol, indices) => match self.element(*symbol, indices)? {
                num if num.n == 1 => num.v[0],
                _ => return None,
            },
            Node::Num(_)
            | Node::Vector(_)
            | Node::OneVector(..)
            | Node::TwoVectors(..)
            | Node::AxisRotate(..) => {
                return None;
            }
            Node::Component(component, of) => self.num(*of)?.promoted(5)[*component],
            Node::Negative(of) => -self.float(*of)?,
            Node::Not(of) => f64::from(self.float(*of)?.abs() < EQUAL_WITHIN),
            Node::Add(a, b) => self.float(*a)? + self.float(*b)?,
            Node::Subtract(a, b) => self.float(*a)? - self.float(*b)?,
            Node::Multiply(a, b) => self.float(*a)? * self.float(*b)?,
            Node::Divide(a, b) => {
                let a = self.float(*a)?;
                divide(a, self.float(*b)?)
            }
            Node::Compare(mark, a, b) => {
                let a = self.float(*a)?;
                f64::from(compare(*mark, a, self.float(*b)?))
            }
            Node::And(a, b) => {
                let a = is_true(self.float(*a)?);
                f64::from(is_true(self.float(*b)?) && a)
            }
            Node::Or(a, b) => {
                let a = is_true(self.float(*a)?);
                f64::from(is_true(self.float(*b)?) || a)
            }
            Node::Choice(which, yes, no) => {
                let which = is_true(self.float(*which)?);
                // Both sides are evaluated, as POV-Ray does.
                let (yes, no) = (self.float(*yes)?, self.float(*no)?);
                if which { yes } else { no }
            }
            Node::One(f, of) => f(self.float(*of)?),
            Node::Two(f, a, b) => {
                let a = self.float(*a)?;
                f(a, self.float(*b)?)
            }
            Node::Length(of) => self.vector(*of)?.length(),
            Node::Dot(a, b) => {
                let a = self.vector(*a)?;
                a.dot(self.vector(*b)?)
            }
            Node::Random(symbol) => {
                let Value::Random(stream) = self.scopes.get(*symbol)? else { return None };
                let stream: &'a Arc<AtomicU32> = stream;
                self.taken.push((stream, stream.load(Ordering::Relaxed)));
                next_random(stream)
            }
        })
    }

    /// A node's value, float or vector.
    fn num(&mut self, id: Id) -> Option<Num> {
        let nodes = self.nodes;
        Some(match &nodes[id as usize] {
            Node::Num(num) => **num,
            Node::Name(symbol) => match self.scopes.get(*symbol)? {
                Value::Number(num) => *num,
                _ => return None,
            },
            Node::Element(symbol, indices) => self.element(*symbol, indices)?,
            Node::Vector(parts) => {
                let mut num = Num { n: parts.len() as u8, v: [0.0; 5] };
                for (slot, part) in num.v.iter_mut().zip(parts) {
                    *slot = self.float(*part)?;
                }
                num
            }
            Node::Negative(of) => self.num(*of)?.map(|v| -v),
            Node::Not(of) => self.num(*of)?.map(|v| f64::from(v.abs() < EQUAL_WITHIN)),
            Node::Add(a, b) => self.both(*a, *b)?.zip(|a, b| a + b),
            Node::Subtract(a, b) => self.both(*a, *b)?.zip(|a, b| a - b),
            Node::Multiply(a, b) => self.both(*a, *b)?.zip(|a, b| a * b),
            Node::Divide(a, b) => self.both(*a, *b)?.zip(divide),
            Node::Choice(which, yes, no) => {
                let which = is_true(self.float(*which)?);
                let both = self.both(*yes, *no)?;
                if which { both.0 } else { both.1 }
            }
            Node::OneVector(f, of) => Num::vector(f(self.vector(*of)?)),
            Node::TwoVectors(f, a, b) => {
                let a = self.vector(*a)?;
                Num::vector(f(a, self.vector(*b)?))
            }
            Node::AxisRotate(v, axis, degrees) => {
                let (v, axis) = (self.vector(*v)?, self.vector(*axis)?);
                Num::vector(rotated_about(v, axis, self.float(*degrees)?))
            }
            _ => Num::float(self.float(id)?),
        })
    }

    /// A node's value as a 3-vector; the reader tells if it is not finite.
    fn vector(&mut self, id: Id) -> Option<DVec3> {
        let v = match &self.nodes[id as usize] {
            Node::Vector(parts) if parts.len() == 3 => {
                let (x, y) = (self.float(parts[0])?, self.float(parts[1])?);
                DVec3::new(x, y, self.float(parts[2])?)
            }
            _ => self.num(id)?.xyz(),
        };
        v.is_finite().then_some(v)
    }

    fn both(&mut self, a: Id, b: Id) -> Option<Both> {
        let a = self.num(a)?;
        Some(Both(a, self.num(b)?))
    }

    fn element(&mut self, symbol: Symbol, indices: &[Id]) -> Option<Num> {
        let mut value = self.scopes.get(symbol)?;
        let mut indices = indices.iter();
        while let Value::Array(array) = value {
            let mut flat = 0;
            for &size in &array.dims {
                // The small step is against 0.1 * 30 being 2.9999999999999996.
                let index = (self.float(*indices.next()?)? + EQUAL_WITHIN).floor();
                if !(index >= 0.0 && index < size as f64) {
                    return None;
                }
                flat = flat * size + index as usize;
            }
            value = array.items.get(flat)?.as_ref()?;
        }
        match value {
            Value::Number(num) if indices.next().is_none() => Some(*num),
            _ => None,
        }
    }
}

/// Two operands.
struct Both(Num, Num);

impl Both {
    #[inline]
    fn zip(self, f: impl Fn(f64, f64) -> f64) -> Num {
        self.0.zip(self.1, f)
    }
}

fn is_true(value: f64) -> bool {
    Num::float(value).is_true()
}

/// A relation of two floats. `=` and its kin allow for rounding (measured).
pub(super) fn compare(mark: Mark, a: f64, b: f64) -> bool {
    match mark {
        Mark::Less => a < b,
        Mark::LessEqual => a <= b + EQUAL_WITHIN,
        Mark::Equal => (a - b).abs() < EQUAL_WITHIN,
        Mark::NotEqual => (a - b).abs() >= EQUAL_WITHIN,
        Mark::GreaterEqual => a >= b - EQUAL_WITHIN,
        _ => a > b,
    }
}

// --------------------------------------------------------------------------------------------------------------
// Compilation: the rules of `expr.rs` for tokens that nothing comes between

struct Compiler<'a> {
    program: &'a Program,
    at: usize,
    /// Factors within each other.
    depth: usize,
    nodes: Vec<Node>,
}

impl Compiler<'_> {
    fn compile(program: &Program, at: u32, level: Level) -> Option<Code> {
        let mut compiler = Compiler { program, at: at as usize, depth: 0, nodes: Vec::new() };
        let root = match level {
            Level::Sum => compiler.sum()?,
            Level::Choice => compiler.choice()?,
        };
        let next_name = match compiler.peek() {
            Token::Name(symbol) => Some(symbol),
            // The reader looks at the token behind a value: a directive would be carried out.
            Token::Directive(..) | Token::Junk(_) | Token::End => return None,
            _ => None,
        };
        debug_assert_eq!(root as usize, compiler.nodes.len() - 1);
        Some(Code { nodes: compiler.nodes, end: compiler.at as u32, next_name, scalar: false })
    }

    fn peek(&self) -> Token {
        self.program.tokens.get(self.at).copied().unwrap_or(Token::End)
    }

    fn accept(&mut self, mark: Mark) -> bool {
        let found = self.peek() == Token::Mark(mark);
        self.at += usize::from(found);
        found
    }

    fn expect(&mut self, mark: Mark) -> Option<()> {
        self.accept(mark).then_some(())
    }

    fn add(&mut self, node: Node) -> Option<Id> {
        self.nodes.push(node);
        (self.nodes.len() <= NODES).then_some(self.nodes.len() as Id - 1)
    }

    fn choice(&mut self) -> Option<Id> {
        let value = self.logical()?;
        if !self.accept(Mark::Question) {
            return Some(value);
        }
        let yes = self.choice()?;
        self.expect(Mark::Colon)?;
        let no = self.choice()?;
        self.add(Node::Choice(value, yes, no))
    }

    fn logical(&mut self) -> Option<Id> {
        let mut value = self.relation()?;
        loop {
            let node = if self.accept(Mark::And) {
                Node::And(value, self.relation()?)
            } else if self.accept(Mark::Or) {
                Node::Or(value, self.relation()?)
            } else {
                return Some(value);
            };
            value = self.add(node)?;
        }
    }

    fn relation(&mut self) -> Option<Id> {
        use Mark::{Equal, Greater, GreaterEqual, Less, LessEqual, NotEqual};
        let mut value = self.sum()?;
        while let Token::Mark(mark @ (Less | LessEqual | Equal | NotEqual | GreaterEqual | Greater)) =
            self.peek()
        {
            self.at += 1;
            let right = self.sum()?;
            value = self.add(Node::Compare(mark, value, right))?;
        }
        Some(value)
    }

    fn sum(&mut self) -> Option<Id> {
        let first = self.factor()?;
        let mut sum = self.term_from(first)?;
        loop {
            let add = match self.peek() {
                Token::Mark(Mark::Plus) => true,
                Token::Mark(Mark::Minus) => false,
                _ => return Some(sum),
            };
            self.at += 1;
            let right = self.factor()?;
            let right = self.term_from(right)?;
            sum = self.add(if add { Node::Add(sum, right) } else { Node::Subtract(sum, right) })?;
        }
    }

    fn term_from(&mut self, first: Id) -> Option<Id> {
        let mut product = self.suffix(first)?;
        loop {
            let times = match self.peek() {
                Token::Mark(Mark::Star) => true,
                Token::Mark(Mark::Slash) => false,
                _ => return Some(product),
            };
            self.at += 1;
            let right = self.factor()?;
            product =
                self.add(if times { Node::Multiply(product, right) } else { Node::Divide(product, right) })?;
        }
    }

    fn suffix(&mut self, mut value: Id) -> Option<Id> {
        while self.accept(Mark::Dot) {
            let component = match self.peek() {
                Token::Word(Keyword::X | Keyword::U | Keyword::Red) => 0,
                Token::Word(Keyword::Y | Keyword::V | Keyword::Green) => 1,
                Token::Word(Keyword::Z | Keyword::Blue) => 2,
                Token::Word(Keyword::T | Keyword::Filter) => 3,
                Token::Word(Keyword::Transmit) => 4,
                _ => return None,
            };
            self.at += 1;
            value = self.add(Node::Component(component, value))?;
        }
        Some(value)
    }

    fn factor(&mut self) -> Option<Id> {
        self.depth += 1;
        let value = if self.depth <= DEPTH { self.factor_inside() } else { None };
        self.depth -= 1;
        value
    }

    fn factor_inside(&mut self) -> Option<Id> {
        let token = self.peek();
        self.at += 1;
        let value = match token {
            Token::Number(value) => return self.add(Node::Float(value)),
            Token::Vector(first, count @ 2..=5) => {
                let mut num = Num { n: count as u8, v: [0.0; 5] };
                num.v[..usize::from(count)]
                    .copy_from_slice(&self.program.numbers[first as usize..][..usize::from(count)]);
                self.add(Node::Num(Box::new(num)))?
            }
            Token::Mark(Mark::Less) => self.vector()?,
            Token::Mark(Mark::OpenParen) => {
                let value = self.choice()?;
                self.expect(Mark::CloseParen)?;
                value
            }
            Token::Mark(mark @ (Mark::Minus | Mark::Plus | Mark::Not)) => {
                let value = self.factor()?;
                return match mark {
                    Mark::Minus => self.add(Node::Negative(value)),
                    Mark::Not => self.add(Node::Not(value)),
                    _ => Some(value),
                };
            }
            Token::Name(symbol) => match self.peek() {
                Token::Mark(Mark::OpenBracket) => {
                    let mut indices = SmallVec::new();
                    while self.accept(Mark::OpenBracket) {
                        indices.push(self.sum()?);
                        self.expect(Mark::CloseBracket)?;
                    }
                    self.add(Node::Element(symbol, indices))?
                }
                Token::Mark(Mark::OpenParen) => return None,
                _ => self.add(Node::Name(symbol))?,
            },
            Token::Word(word) => self.word(word)?,
            _ => return None,
        };
        self.suffix(value)
    }

    /// `<a, b, c>` with all its commas.
    fn vector(&mut self) -> Option<Id> {
        let mut parts: SmallVec<[Id; 3]> = SmallVec::new();
        loop {
            parts.push(self.sum()?);
            if self.accept(Mark::Greater) {
                return if (2..=5).contains(&parts.len()) { self.add(Node::Vector(parts)) } else { None };
            }
            self.expect(Mark::Comma)?;
        }
    }

    fn word(&mut self, word: Keyword) -> Option<Id> {
        use Keyword as K;
        if let Some(num) = constant(word) {
            return self.add(if num.n == 1 { Node::Float(num.v[0]) } else { Node::Num(Box::new(num)) });
        }
        if let Some(f) = float_function(word) {
            let [a] = self.arguments()?;
            return self.add(Node::One(f, a));
        }
        if let Some(f) = float_function_of_two(word) {
            let [a, b] = self.arguments()?;
            return self.add(Node::Two(f, a, b));
        }
        let node = match word {
            K::Min | K::Max => return self.fold(if word == K::Min { f64::min } else { f64::max }),
            K::Vlength => {
                let [a] = self.arguments()?;
                Node::Length(a)
            }
            K::Vdot => {
                let [a, b] = self.arguments()?;
                Node::Dot(a, b)
            }
            K::Vcross => {
                let [a, b] = self.arguments()?;
                Node::TwoVectors(DVec3::cross, a, b)
            }
            K::Vnormalize => {
                let [a] = self.arguments()?;
                Node::OneVector(normalized, a)
            }
            K::Vrotate => {
                let [a, b] = self.arguments()?;
                Node::TwoVectors(rotated, a, b)
            }
            K::VaxisRotate => {
                let [a, b, c] = self.arguments()?;
                Node::AxisRotate(a, b, c)
            }
            K::Rand => {
                self.expect(Mark::OpenParen)?;
                let Token::Name(symbol) = self.peek() else { return None };
                self.at += 1;
                self.expect(Mark::CloseParen)?;
                Node::Random(symbol)
            }
            _ => return None,
        };
        self.add(node)
    }

    /// `(a, b)` with all commas.
    fn arguments<const N: usize>(&mut self) -> Option<[Id; N]> {
        self.expect(Mark::OpenParen)?;
        let mut arguments = [0; N];
        for (index, argument) in arguments.iter_mut().enumerate() {
            if index > 0 {
                self.expect(Mark::Comma)?;
            }
            *argument = self.sum()?;
        }
        self.expect(Mark::CloseParen)?;
        Some(arguments)
    }

    /// `min(a, b, ...)`.
    fn fold(&mut self, f: fn(f64, f64) -> f64) -> Option<Id> {
        self.expect(Mark::OpenParen)?;
        let mut value = self.sum()?;
        while self.accept(Mark::Comma) {
            let right = self.sum()?;
            value = self.add(Node::Two(f, value, right))?;
        }
        self.expect(Mark::CloseParen)?;
        Some(value)
    }
}
