//! Functions of floats, compiled: `function { ... }` (manual section 3.1.7).
//!
//! A function is a straight list of operations over registers, each written at one place. [`Op::Select`] chooses among values
//! and [`Op::When`] skips the steps that only a choice not taken needs, so that the same list can be run at eight points at
//! a time, a register being eight numbers; only [`Op::Series`] loops. Here it is run at one point, in f64.

use super::number::Number;
use super::{Spline, Transform, internal};
use glam::DVec3;
use smallvec::SmallVec;
use std::sync::Arc;

/// A function of some floats.
#[derive(Debug, Clone, PartialEq)]
pub struct Function {
    /// How many floats it takes: its first registers.
    pub params: usize,
    /// How many registers it needs.
    pub registers: usize,
    /// In order.
    pub ops: Vec<Op>,
    /// What it comes to.
    pub result: Operand,
    /// How many functions are called within each other at most, itself counted.
    pub depth: usize,
    /// A pigment or a pattern is asked on the way.
    pub asks_pigments: bool,
}

/// A number or where it is kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Operand {
    /// Known when the function was compiled.
    Constant(f64),
    /// Index of a register.
    Register(u16),
}

/// One step; `out` is a register that no step before has written.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "a variant is the function or its operands")]
pub enum Op {
    /// `out = f(a)`
    One { out: u16, f: Unary, a: Operand },
    /// `out = f(a, b)`
    Two { out: u16, f: Binary, a: Operand, b: Operand },
    /// `out` is the value for `v < 0`, `v = 0` or `v > 0`.
    Select { out: u16, v: Operand, negative: Operand, zero: Operand, positive: Operand },
    /// The next `steps` steps are needed only where `v` has this sign.
    When { v: Operand, sign: Sign, steps: u32 },
    /// `out` is a component of what is called.
    Call { out: u16, callee: Box<Callee>, arguments: SmallVec<[Operand; 4]>, component: Component },
    /// The next `body` steps are run for `variable` from `from` to `to` by 1; `out` is the sum or product of `term`.
    Series { out: u16, product: bool, variable: u16, from: Operand, to: Operand, body: u32, term: Operand },
}

/// Which values of a number a choice is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sign {
    /// Below 0.
    Negative,
    /// 0, and what is no number.
    Zero,
    /// Above 0.
    Positive,
    /// All but those below 0.
    NotNegative,
}

impl Sign {
    /// True of a number of this sign.
    pub fn is_of(self, v: f64) -> bool {
        match self {
            Self::Negative => v < 0.0,
            Self::Zero => v == 0.0 || v.is_nan(),
            Self::Positive => v > 0.0,
            Self::NotNegative => !(v < 0.0),
        }
    }
}

/// What a function can call.
#[derive(Debug, Clone, PartialEq)]
pub enum Callee {
    /// Another function.
    Function(Arc<Function>),
    /// One of POV-Ray's own, by its number in `functions.inc`.
    Internal(u16),
    /// A curve: one argument, five components.
    Spline(Arc<Spline>),
    /// A moved point: three arguments, three components.
    Transform(Transform),
    /// A colour in space: three arguments, five components.
    Pigment(Arc<super::Pigment>),
    /// A pattern's number in space, of a pigment that goes from black to white: three arguments.
    Pattern(Arc<super::Pigment>),
    /// The function in whose body it is called, which takes so many arguments.
    Itself(usize),
    /// Something that is read but cannot be evaluated; 0.
    Missing,
}

/// Which number of a vector or colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Component {
    /// By index.
    Index(u8),
    /// A colour's brightness.
    Gray,
}

macro_rules! functions {
    ($(#[$doc:meta])* $name:ident($($arg:ident),*) $call:tt $kind:ty: $($variant:ident $body:expr;)*) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[allow(missing_docs, reason = "a variant is the function or its operands")]
        pub enum $name { $($variant,)* }

        impl $name {
            /// The value at one point.
            pub fn apply(self, $($arg: f64),*) -> f64 {
                let f: $kind = match self { $($name::$variant => $body,)* };
                f $call
            }
        }
    };
}

functions! {
    /// Functions of one float; angles are radians.
    Unary(a) (a) fn(f64) -> f64:
    Minus |a: f64| -a;
    Not |a: f64| f64::from(a == 0.0);
    Square |a: f64| a * a;
    Abs f64::abs;
    Acos f64::acos;
    Acosh f64::acosh;
    Asin f64::asin;
    Asinh f64::asinh;
    Atan f64::atan;
    Atanh f64::atanh;
    Ceil f64::ceil;
    Cos f64::cos;
    Cosh f64::cosh;
    Degrees |a: f64| a * (180.0 / std::f64::consts::PI);
    Radians |a: f64| a * (std::f64::consts::PI / 180.0);
    Exp f64::exp;
    Floor f64::floor;
    Int truncated;
    Ln f64::ln;
    Log f64::log10;
    Sin f64::sin;
    Sinh f64::sinh;
    Sqrt f64::sqrt;
    Tan f64::tan;
    Tanh f64::tanh;
}

functions! {
    /// Functions of two floats. Relations are 1 where they hold, else 0.
    Binary(a, b) (a, b) fn(f64, f64) -> f64:
    Add |a: f64, b: f64| a + b;
    Subtract |a: f64, b: f64| a - b;
    Multiply |a: f64, b: f64| a * b;
    Divide divided;
    Power f64::powf;
    Remainder |a: f64, b: f64| a % b;
    Quotient |a: f64, b: f64| (a / b).trunc();
    Atan2 f64::atan2;
    Min Number::smaller;
    Max Number::larger;
    And |a: f64, b: f64| f64::from(a != 0.0 && b != 0.0);
    Or |a: f64, b: f64| f64::from(a != 0.0 || b != 0.0);
    Less |a: f64, b: f64| f64::from(a < b);
    LessEqual |a: f64, b: f64| f64::from(a <= b);
    Greater |a: f64, b: f64| f64::from(a > b);
    GreaterEqual |a: f64, b: f64| f64::from(a >= b);
    Equal |a: f64, b: f64| f64::from((a - b).abs() < EQUAL_WITHIN);
    NotEqual |a: f64, b: f64| f64::from((a - b).abs() >= EQUAL_WITHIN);
}

/// Floats nearer than this are equal (measured: 1e-11 is, 1e-9 is not).
pub const EQUAL_WITHIN: f64 = 1e-10;

/// Division; by zero it gives infinity, whatever the signs (measured).
fn divided(a: f64, b: f64) -> f64 {
    if b == 0.0 { f64::INFINITY } else { a / b }
}

/// Truncation as C's cast to a 32-bit integer does it on the machines POV-Ray runs on: what does not fit is the
/// smallest integer (measured).
pub fn truncated(value: f64) -> f64 {
    if value > -2_147_483_649.0 && value < 2_147_483_648.0 { value.trunc() } else { f64::from(i32::MIN) }
}

/// What a run of a function needs from outside.
pub struct Surroundings<'a> {
    /// Steps that are left; a function that uses them up has no value.
    pub steps: u64,
    /// How many more calls of functions by themselves may be within each other; beyond that there is no value.
    pub calls: u32,
    /// The colour of a pigment at a point, `[red, green, blue, filter, transmit]`.
    pub pigment: &'a dyn Fn(&super::Pigment, DVec3) -> [f64; 5],
}

/// Calls of functions by themselves within each other: what POV-Ray's own stack is good for (measured: 1000 are, 2000 crash
/// it). Here each takes a kilobyte of the thread's.
const MOST_CALLS: u32 = 1000;

impl<'a> Surroundings<'a> {
    /// With `steps` left, and all calls.
    pub fn new(steps: u64, pigment: &'a dyn Fn(&super::Pigment, DVec3) -> [f64; 5]) -> Self {
        Self { steps, calls: MOST_CALLS, pigment }
    }
}

impl Function {
    /// The value at one point; `None` if `around` has run out of steps or calls, or for a wrong number of arguments.
    pub fn value(&self, arguments: &[f64], around: &mut Surroundings) -> Option<f64> {
        if arguments.len() != self.params {
            return None;
        }
        let mut registers: SmallVec<[f64; 24]> = SmallVec::from_elem(0.0, self.registers);
        registers[..self.params].copy_from_slice(arguments);
        let mut turns: SmallVec<[Turns; 2]> = SmallVec::new();
        let mut next = 0;
        loop {
            // The end of a series' turn: on to the next turn, or behind it.
            while let Some(series) = turns.last_mut().filter(|series| series.end == next) {
                let Op::Series { out, product, variable, term, .. } = self.ops[series.head] else {
                    return None;
                };
                let term = read(term, &registers);
                series.value = if product { series.value * term } else { series.value + term };
                series.at += 1.0;
                if series.at <= series.to {
                    around.steps = around.steps.checked_sub(1)?;
                    registers[usize::from(variable)] = series.at;
                    next = series.head + 1;
                } else {
                    registers[usize::from(out)] = series.value;
                    turns.pop();
                }
            }
            let Some(op) = self.ops.get(next) else { return Some(read(self.result, &registers)) };
            around.steps = around.steps.checked_sub(1)?;
            next += 1;
            let (out, value) = match *op {
                Op::One { out, f, a } => (out, f.apply(read(a, &registers))),
                Op::Two { out, f, a, b } => (out, f.apply(read(a, &registers), read(b, &registers))),
                Op::Select { out, v, negative, zero, positive } => {
                    let v = read(v, &registers);
                    let choice = if v < 0.0 {
                        negative
                    } else if v > 0.0 {
                        positive
                    } else {
                        zero
                    };
                    (out, read(choice, &registers))
                }
                Op::When { v, sign, steps } => {
                    if !sign.is_of(read(v, &registers)) {
                        next += steps as usize;
                    }
                    continue;
                }
                Op::Call { out, ref callee, ref arguments, component } => {
                    let arguments: SmallVec<[f64; 8]> =
                        arguments.iter().map(|a| read(*a, &registers)).collect();
                    let values = match **callee {
                        Callee::Itself(_) => [self.value_within(&arguments, around)?, 0.0, 0.0, 0.0, 0.0],
                        ref other => other.values(&arguments, around)?,
                    };
                    (out, component.of(&values))
                }
                Op::Series { out, product, variable, from, to, body, .. } => {
                    let (at, to) = (read(from, &registers), read(to, &registers));
                    let (head, end) = (next - 1, next + body as usize);
                    let value = f64::from(u8::from(product));
                    if at <= to {
                        around.steps = around.steps.checked_sub(1)?;
                        turns.push(Turns { head, end, at, to, value });
                        (variable, at)
                    } else {
                        next = end;
                        (out, value)
                    }
                }
            };
            registers[usize::from(out)] = value;
        }
    }

    /// The value for a call by itself.
    fn value_within(&self, arguments: &[f64], around: &mut Surroundings) -> Option<f64> {
        around.calls = around.calls.checked_sub(1)?;
        let value = self.value(arguments, around)?;
        around.calls += 1;
        Some(value)
    }
}

/// A series under way: its step, the step behind its body, the variable, its last value, and the result so far.
struct Turns {
    head: usize,
    end: usize,
    at: f64,
    to: f64,
    value: f64,
}

fn read(operand: Operand, registers: &[f64]) -> f64 {
    match operand {
        Operand::Constant(value) => value,
        Operand::Register(index) => registers[usize::from(index)],
    }
}

impl Component {
    /// That number of five.
    pub fn of(self, v: &[f64; 5]) -> f64 {
        match self {
            Component::Index(index) => v[usize::from(index).min(4)],
            // POV-Ray's weights.
            Component::Gray => 0.297 * v[0] + 0.589 * v[1] + 0.114 * v[2],
        }
    }
}

impl Callee {
    /// How many arguments it takes, at least and at most.
    pub fn arguments(&self) -> (usize, usize) {
        match self {
            Callee::Function(function) => (function.params, function.params),
            Callee::Internal(_) => (1, 16),
            Callee::Spline(_) => (1, 1),
            Callee::Transform(_) | Callee::Pigment(_) | Callee::Pattern(_) => (3, 3),
            Callee::Itself(params) => (*params, *params),
            Callee::Missing => (0, usize::MAX),
        }
    }

    /// True if it gives a vector or a colour and not a float.
    pub fn is_vector(&self) -> bool {
        matches!(self, Callee::Spline(_) | Callee::Transform(_) | Callee::Pigment(_))
    }

    /// The value at one point; a float stands first. `None` as for [`Function::value`].
    pub fn values(&self, arguments: &[f64], around: &mut Surroundings) -> Option<[f64; 5]> {
        let point = || DVec3::new(arguments[0], arguments[1], arguments[2]);
        let float = |value: f64| [value, 0.0, 0.0, 0.0, 0.0];
        let (least, most) = self.arguments();
        if !(least..=most).contains(&arguments.len()) {
            return None;
        }
        Some(match self {
            Callee::Function(function) => float(function.value(arguments, around)?),
            Callee::Internal(number) => float(internal::value(*number, arguments).unwrap_or(0.0)),
            Callee::Spline(spline) => spline.value(arguments[0]),
            Callee::Transform(transform) => {
                let p = transform.point(point());
                [p.x, p.y, p.z, 0.0, 0.0]
            }
            Callee::Pigment(pigment) => (around.pigment)(pigment, point()),
            Callee::Pattern(pigment) => float((around.pigment)(pigment, point())[0]),
            // Only its function knows which it is.
            Callee::Itself(_) => return None,
            Callee::Missing => [0.0; 5],
        })
    }
}
