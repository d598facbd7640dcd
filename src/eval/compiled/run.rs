//! Evaluation of compiled expressions.
//!
//! A code's nodes and the names' values come in; the code's value goes out, or `None` where the reader must do it.

use super::super::builtin::{next_random, rotated_about};
use super::super::directive::EQUAL_WITHIN;
use super::super::expr::divide;
use super::super::scope::Scopes;
use super::super::value::{Num, Value};
use super::{Id, Node};
use crate::lang::{Mark, Symbol};
use glam::DVec3;
use smallvec::SmallVec;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

/// One evaluation of a code.
pub(super) struct Run<'a> {
    scopes: &'a Scopes,
    nodes: &'a [Node],
    /// Random streams that were drawn from, and their states before.
    taken: SmallVec<[(&'a AtomicU32, u32); 4]>,
}

impl<'a> Run<'a> {
    #[inline]
    pub fn new(scopes: &'a Scopes, nodes: &'a [Node]) -> Self {
        Run { scopes, nodes, taken: SmallVec::new() }
    }

    /// Gives the random streams back what was drawn.
    pub fn take_back(&mut self) {
        for (stream, state) in self.taken.drain(..).rev() {
            stream.store(state, Ordering::Relaxed);
        }
    }

    /// [`Run::float`] of a part: most are numbers or names, for which the call would cost more than the value.
    #[inline(always)]
    fn operand(&mut self, id: Id) -> Option<f64> {
        match &self.nodes[id as usize] {
            Node::Float(value) => Some(*value),
            Node::Name(symbol) => self.scopes.float(*symbol),
            _ => self.float(id),
        }
    }

    /// A node's value if it is a float.
    pub fn float(&mut self, id: Id) -> Option<f64> {
        let nodes = self.nodes;
        Some(match &nodes[id as usize] {
            Node::Float(value) => *value,
            Node::Name(symbol) => self.scopes.float(*symbol)?,
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
            Node::Component(component, of) => {
                let value;
                let num = match &nodes[*of as usize] {
                    Node::Name(symbol) => match self.scopes.get(*symbol)? {
                        Value::Number(num) => num,
                        _ => return None,
                    },
                    _ => {
                        value = self.num(*of)?;
                        &value
                    }
                };
                match num.n {
                    1 => num.v[0],
                    // The reader tells of a component that is not there.
                    n => num.v[..usize::from(n)].get(*component).copied()?,
                }
            }
            Node::Negative(of) => -self.operand(*of)?,
            Node::Not(of) => f64::from(self.operand(*of)?.abs() < EQUAL_WITHIN),
            Node::Add(a, b) => self.operand(*a)? + self.operand(*b)?,
            Node::Subtract(a, b) => self.operand(*a)? - self.operand(*b)?,
            Node::Multiply(a, b) => self.operand(*a)? * self.operand(*b)?,
            Node::Divide(a, b) => {
                let a = self.operand(*a)?;
                // Division by zero is told by the reader.
                divide(a, Some(self.operand(*b)?).filter(|b| *b != 0.0)?)
            }
            Node::Compare(mark, a, b) => {
                let a = self.operand(*a)?;
                f64::from(compare(*mark, a, self.operand(*b)?))
            }
            Node::And(a, b) => {
                let a = is_true(self.operand(*a)?);
                f64::from(is_true(self.operand(*b)?) && a)
            }
            Node::Or(a, b) => {
                let a = is_true(self.operand(*a)?);
                f64::from(is_true(self.operand(*b)?) || a)
            }
            Node::Choice(which, yes, no) => {
                let which = is_true(self.operand(*which)?);
                // Both sides are evaluated, as POV-Ray does.
                let (yes, no) = (self.operand(*yes)?, self.operand(*no)?);
                if which { yes } else { no }
            }
            // What is outside of the function's domain is told by the reader.
            Node::One(f, of) => Some(f(self.operand(*of)?)).filter(|value| *value > f64::NEG_INFINITY)?,
            Node::Two(f, a, b) => {
                let a = self.operand(*a)?;
                Some(f(a, self.operand(*b)?)).filter(|value| !value.is_nan())?
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
    pub fn num(&mut self, id: Id) -> Option<Num> {
        let nodes = self.nodes;
        Some(match &nodes[id as usize] {
            Node::Num(num) => **num,
            Node::Name(symbol) => match self.scopes.get(*symbol)? {
                Value::Number(num) => *num,
                _ => return None,
            },
            Node::Element(symbol, indices) => self.element(*symbol, indices)?,
            Node::Vector(parts) if parts.len() == 3 => {
                let (x, y) = (self.operand(parts[0])?, self.operand(parts[1])?);
                Num { n: 3, v: [x, y, self.operand(parts[2])?, 0.0, 0.0] }
            }
            Node::Vector(parts) => {
                let mut num = Num { n: parts.len() as u8, v: [0.0; 5] };
                for (slot, part) in num.v.iter_mut().zip(parts) {
                    *slot = self.operand(*part)?;
                }
                num
            }
            Node::Negative(of) => self.num(*of)?.map(|v| -v),
            Node::Not(of) => self.num(*of)?.map(|v| f64::from(v.abs() < EQUAL_WITHIN)),
            Node::Add(a, b) => self.both(*a, *b)?.zip(|a, b| a + b),
            Node::Subtract(a, b) => self.both(*a, *b)?.zip(|a, b| a - b),
            Node::Multiply(a, b) => self.both(*a, *b)?.zip(|a, b| a * b),
            Node::Divide(a, b) => {
                let both = self.both(*a, *b)?;
                if both.1.v[..usize::from(both.1.n)].contains(&0.0) {
                    return None;
                }
                both.zip(divide)
            }
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
    pub fn vector(&mut self, id: Id) -> Option<DVec3> {
        let v = match &self.nodes[id as usize] {
            Node::Vector(parts) if parts.len() == 3 => {
                let (x, y) = (self.operand(parts[0])?, self.float(parts[1])?);
                DVec3::new(x, y, self.operand(parts[2])?)
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
pub(in super::super) fn compare(mark: Mark, a: f64, b: f64) -> bool {
    match mark {
        Mark::Less => a < b,
        Mark::LessEqual => a <= b + EQUAL_WITHIN,
        Mark::Equal => (a - b).abs() < EQUAL_WITHIN,
        Mark::NotEqual => (a - b).abs() >= EQUAL_WITHIN,
        Mark::GreaterEqual => a >= b - EQUAL_WITHIN,
        _ => a > b,
    }
}
