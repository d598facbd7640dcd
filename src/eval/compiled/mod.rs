//! Expressions in loops and macros, read once and then evaluated without reading.
//!
//! An expression that comes by for the second time is compiled, from its tokens alone, to a small tree ([`Code`]); from then
//! on its place in the text leads to the tree. Only what is sure to mean the same as reading it is compiled: no directive and
//! no macro call may stand in it or right behind it, and it has no side effect but `rand`. What names stand for is
//! looked up at every turn. Whenever a value is not as the tree wants it (a macro, a string, a vector where a float is
//! due, a subscript out of range, anything that will be an error), evaluation takes back its random numbers and
//! leaves the expression to the reader in `expr.rs`, which knows all the rules and all the messages.

mod compiler;
mod run;

pub(super) use run::compare;

use super::machine::{Lexeme, Machine};
use super::value::{Num, Value};
use crate::lang::{Mark, Symbol, Token};
use compiler::Compiler;
use glam::DVec3;
use run::Run;
use smallvec::SmallVec;
use std::cell::Cell;

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
    /// A loop or a macro has gone back in the text: before that nothing comes by twice.
    pub repeats: bool,
    /// The text has been begun before.
    pub entered: bool,
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
    scalar: Cell<bool>,
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

impl Machine<'_> {
    /// The value of the float that begins at the next token, if it has been compiled.
    #[inline]
    pub fn compiled_float(&mut self) -> Option<f64> {
        self.run_code(self.at, Level::Sum, None, |run, code| run.float(code.root()))
    }

    /// The value of the 3-vector that begins at the next token, if it has been compiled.
    #[inline]
    pub fn compiled_vector(&mut self) -> Option<DVec3> {
        self.run_code(self.at, Level::Sum, None, |run, code| run.vector(code.root()))
    }

    /// The value of the expression that begins at the next token, if it has been compiled.
    #[inline]
    pub fn compiled(&mut self, level: Level) -> Option<Num> {
        self.run_code(self.at, level, None, Code::num)
    }

    /// The value of the expression at token `start`, if it has been compiled and `mark` is behind it, which is taken too.
    #[inline]
    pub fn compiled_between(&mut self, start: u32, level: Level, mark: Mark) -> Option<Num> {
        self.run_code(start, level, Some(mark), Code::num)
    }

    /// The index of the code of the expression at token `start`.
    #[inline(always)]
    fn code_at(&mut self, start: u32, level: Level, only_compiled: bool) -> Option<usize> {
        let table = &self.compiled.get(self.program as usize)?.at[level as usize];
        match table.get(start as usize) {
            Some(&index @ FIRST..) => Some((index - FIRST) as usize),
            Some(&REFUSED) => None,
            _ if only_compiled => None,
            _ => self.code_to_be(start, level),
        }
    }

    /// Compiles what comes by for the second time.
    #[inline(never)]
    fn code_to_be(&mut self, start: u32, level: Level) -> Option<usize> {
        let program = self.program as usize;
        let compiled = self.compiled.get_mut(program)?;
        if !compiled.repeats {
            return None;
        }
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
                    return Some(compiled.codes.len() - 1);
                }
                None => *entry = REFUSED,
            },
            _ => {}
        }
        None
    }

    /// Evaluates the expression at token `start` and goes on behind it; behind `mark`, if one must follow. `None`, and nothing has
    /// happened, if the reader must do it.
    #[inline(always)]
    fn run_code<T>(
        &mut self,
        start: u32,
        level: Level,
        mark: Option<Mark>,
        value: impl FnOnce(&mut Run<'_>, &Code) -> Option<T>,
    ) -> Option<T> {
        let index = self.code_at(start, level, mark.is_some())?;
        let code = self.compiled.get(self.program as usize)?.codes.get(index)?;
        let end = code.end;
        match mark {
            Some(mark) => {
                if !matches!(self.text.tokens[end as usize], Token::Mark(found) if found == mark) {
                    return None;
                }
            }
            None => {
                if let Some(name) = code.next_name
                    && matches!(self.scopes.get(name), Some(Value::Macro(_)))
                {
                    return None;
                }
            }
        }
        let mut run = Run::new(&self.scopes, &code.nodes);
        let Some(value) = value(&mut run, code) else {
            run.take_back();
            return None;
        };
        drop(run);
        self.steps += u64::from(end.saturating_sub(self.at));
        self.last =
            Lexeme { token: self.text.tokens[end as usize - 1], program: self.program, index: end - 1 };
        self.jump(if mark.is_some() { end + 1 } else { end });
        Some(value)
    }
}

impl Code {
    #[inline]
    fn root(&self) -> Id {
        self.nodes.len() as Id - 1
    }

    /// Its value: read as a float, which takes a fraction of the time, if it was one the last time.
    #[inline]
    fn num(run: &mut Run<'_>, code: &Code) -> Option<Num> {
        if code.scalar.get() {
            if let Some(value) = run.float(code.root()) {
                return Some(Num::float(value));
            }
            run.take_back();
        }
        let num = run.num(code.root())?;
        code.scalar.set(num.n == 1);
        Some(num)
    }
}
