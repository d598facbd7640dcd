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
        let mut run = Run::new(&self.scopes, &code.nodes);
        let Some(value) = value(&mut run, root) else {
            run.take_back();
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
