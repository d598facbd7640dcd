//! Compilation of expressions: the rules of `expr.rs` for tokens that nothing comes between.

use super::super::builtin::{constant, float_function, float_function_of_two, normalized, rotated};
use super::super::value::Num;
use super::{Code, Id, Level, Node};
use crate::lang::{Keyword, Mark, Program, Token};
use glam::DVec3;
use smallvec::SmallVec;
use std::cell::Cell;

/// Expressions of more nodes than this are read every time: the tree is walked by recursion.
const NODES: usize = 200;

/// So are those nested more deeply than this: compiling recurses too.
const DEPTH: usize = 50;

pub(super) struct Compiler<'a> {
    program: &'a Program,
    at: usize,
    /// Factors within each other.
    depth: usize,
    nodes: Vec<Node>,
}

impl Compiler<'_> {
    pub fn compile(program: &Program, at: u32, level: Level) -> Option<Code> {
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
        Some(Code { nodes: compiler.nodes, end: compiler.at as u32, next_name, scalar: Cell::new(false) })
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
