//! `function { ... }` (manual section 3.1.7): compiled once to a tree of floats, called by expressions.
//!
//! Identifiers are captured when the function is declared. Patterns, pigments and POV-Ray's internal functions are
//! read but not modelled; a call of one says so.

use super::builtin::float_function;
use super::directive::EQUAL_WITHIN;
use super::expr::divide;
use super::machine::{Machine, Res, Stop};
use super::value::{Num, Value};
use crate::lang::{Keyword, Mark, Token};
use smallvec::SmallVec;
use std::sync::Arc;

/// A function that has been declared.
#[derive(Debug)]
pub(super) struct Function {
    params: usize,
    /// `None`: read, but not modelled.
    body: Option<Node>,
}

/// A function's body.
#[derive(Debug)]
enum Node {
    Constant(f64),
    /// A parameter, or the variable of a `sum` or `prod` around.
    Variable(usize),
    One(fn(f64) -> f64, Box<Node>),
    Two(fn(f64, f64) -> f64, Box<[Node; 2]>),
    /// `select(v, negative, zero, positive)` or `select(v, negative, other)`.
    Select(Vec<Node>),
    /// `sum` or `prod`: the variable's index, from, to, body.
    Series {
        product: bool,
        variable: usize,
        bounds: Box<[Node; 2]>,
        body: Box<Node>,
    },
    Call(Arc<Function>, Vec<Node>),
}

/// What a name in a body may mean, innermost last.
type Names = SmallVec<[Token; 4]>;

/// More turns of a `sum` than this end it: it is one step of the evaluator.
const SERIES_TURNS: f64 = 1e6;

impl Machine<'_> {
    /// What stands behind `function`.
    pub fn function(&mut self) -> Res<Value> {
        self.deeper(|m| {
            let mut names: Names = SmallVec::new();
            if m.accept(Mark::OpenParen)? {
                while !m.accept(Mark::CloseParen)? {
                    let expand = std::mem::replace(&mut m.expand, false);
                    let name = m.next();
                    m.expand = expand;
                    match name?.token {
                        token @ (Token::Name(_) | Token::Word(_)) => names.push(token),
                        _ => return Err(m.error_here("expected a parameter's name or `)`")),
                    }
                    m.comma()?;
                }
            } else {
                names.extend([Keyword::X, Keyword::Y, Keyword::Z].map(Token::Word));
            }
            let params = names.len();
            let open = m.open("function")?;
            let body = match m.peek()? {
                Token::Word(
                    Keyword::Internal
                    | Keyword::Pattern
                    | Keyword::Pigment
                    | Keyword::Transform
                    | Keyword::Spline,
                ) => {
                    m.skip_block("function", open)?;
                    None
                }
                _ => {
                    let node = m.body_logical(&mut names)?;
                    m.close("function", open)?;
                    Some(node)
                }
            };
            Ok(Value::Function(Arc::new(Function { params, body })))
        })
    }

    /// The arguments of a call, and its value.
    pub fn call_function(&mut self, function: &Function) -> Res<Num> {
        self.deeper(|m| {
            let at = m.last;
            m.expect(Mark::OpenParen)?;
            let mut arguments: Vec<f64> = Vec::with_capacity(function.params);
            while m.peek()? != Token::Mark(Mark::CloseParen) {
                arguments.push(m.float()?);
                m.comma()?;
            }
            m.expect(Mark::CloseParen)?;
            if arguments.len() != function.params && function.body.is_some() {
                let message =
                    format!("the function wants {} arguments, found {}", function.params, arguments.len());
                return Err(m.error(message, m.span(at)));
            }
            match function.call(&mut arguments) {
                Some(value) => Ok(Num::float(value)),
                None => {
                    let message = "not modelled yet: a call of a function made of a pattern, pigment or internal function";
                    Err(m.error(message, m.span(at)))
                }
            }
        })
    }

    // ----------------------------------------------------------------------------------------------------------
    // Bodies: relations and logic need no parentheses here

    fn body_logical(&mut self, names: &mut Names) -> Res<Node> {
        self.deeper(|m| {
            let mut left = m.body_relation(names)?;
            while let Token::Mark(mark @ (Mark::And | Mark::Or)) = m.peek()? {
                m.next()?;
                let right = m.body_relation(names)?;
                let f: fn(f64, f64) -> f64 = match mark {
                    Mark::And => |a, b| f64::from(a != 0.0 && b != 0.0),
                    _ => |a, b| f64::from(a != 0.0 || b != 0.0),
                };
                left = Node::two(f, left, right);
            }
            Ok(left)
        })
    }

    fn body_relation(&mut self, names: &mut Names) -> Res<Node> {
        let mut left = self.body_sum(names)?;
        loop {
            let Token::Mark(mark) = self.peek()? else { return Ok(left) };
            let f: fn(f64, f64) -> f64 = match mark {
                Mark::Less => |a, b| f64::from(a < b),
                Mark::LessEqual => |a, b| f64::from(a <= b),
                Mark::Greater => |a, b| f64::from(a > b),
                Mark::GreaterEqual => |a, b| f64::from(a >= b),
                Mark::Equal => |a, b| f64::from((a - b).abs() < EQUAL_WITHIN),
                Mark::NotEqual => |a, b| f64::from((a - b).abs() >= EQUAL_WITHIN),
                _ => return Ok(left),
            };
            self.next()?;
            let right = self.body_sum(names)?;
            left = Node::two(f, left, right);
        }
    }

    fn body_sum(&mut self, names: &mut Names) -> Res<Node> {
        let mut left = self.body_product(names)?;
        while let Token::Mark(mark @ (Mark::Plus | Mark::Minus)) = self.peek()? {
            self.next()?;
            let right = self.body_product(names)?;
            let f: fn(f64, f64) -> f64 = if mark == Mark::Plus { |a, b| a + b } else { |a, b| a - b };
            left = Node::two(f, left, right);
        }
        Ok(left)
    }

    fn body_product(&mut self, names: &mut Names) -> Res<Node> {
        let mut left = self.body_factor(names)?;
        while let Token::Mark(mark @ (Mark::Star | Mark::Slash)) = self.peek()? {
            self.next()?;
            let right = self.body_factor(names)?;
            let f: fn(f64, f64) -> f64 = if mark == Mark::Star { |a, b| a * b } else { divide };
            left = Node::two(f, left, right);
        }
        Ok(left)
    }

    fn body_factor(&mut self, names: &mut Names) -> Res<Node> {
        let token = self.peek()?;
        if let Some(index) = names.iter().rposition(|name| *name == token) {
            self.next()?;
            return Ok(Node::Variable(index));
        }
        match token {
            Token::Number(value) => {
                self.next()?;
                Ok(Node::Constant(value))
            }
            Token::Mark(Mark::OpenParen) => {
                self.next()?;
                let node = self.body_logical(names)?;
                self.expect(Mark::CloseParen)?;
                Ok(node)
            }
            Token::Mark(mark @ (Mark::Minus | Mark::Plus | Mark::Not)) => {
                self.next()?;
                let node = self.deeper(|m| m.body_factor(names))?;
                Ok(match mark {
                    Mark::Minus => Node::One(|v| -v, Box::new(node)),
                    Mark::Not => Node::One(|v| f64::from(v == 0.0), Box::new(node)),
                    _ => node,
                })
            }
            Token::Name(_) => self.body_name(names),
            Token::Word(word) => self.body_word(word, names),
            _ => self.expected("a number, a parameter or a function"),
        }
    }

    /// A float that is captured, a component of a vector, or a call of another function.
    fn body_name(&mut self, names: &mut Names) -> Res<Node> {
        let lexeme = self.next()?;
        match self.name_value(lexeme)? {
            Value::Function(function) => {
                let arguments = self.body_arguments(names)?;
                if function.body.is_some() && arguments.len() != function.params {
                    let message = format!(
                        "the function wants {} arguments, found {}",
                        function.params,
                        arguments.len()
                    );
                    return Err(self.error(message, self.span(lexeme)));
                }
                Ok(Node::Call(function, arguments))
            }
            Value::Number(num) => {
                let num = self.suffix(num)?;
                if num.n == 1 {
                    return Ok(Node::Constant(num.v[0]));
                }
                Err(self.error("expected a float in a function, found a vector", self.span(lexeme)))
            }
            Value::Poison => Err(Stop::Silent),
            // A spline or a pigment's function: the whole body is beyond us, but only if it is called.
            Value::Missing(_) => {
                self.body_arguments(names)?;
                let missing = Function { params: 0, body: None };
                Ok(Node::Call(Arc::new(missing), Vec::new()))
            }
            other => {
                let message = format!("expected a float in a function, found {}", other.kind());
                Err(self.error(message, self.span(lexeme)))
            }
        }
    }

    fn body_arguments(&mut self, names: &mut Names) -> Res<Vec<Node>> {
        self.expect(Mark::OpenParen)?;
        let mut arguments = Vec::new();
        while self.peek()? != Token::Mark(Mark::CloseParen) {
            arguments.push(self.body_logical(names)?);
            self.comma()?;
        }
        self.next()?;
        // `F(x, y, z).red` of a pigment's function.
        if self.accept(Mark::Dot)? {
            self.next()?;
        }
        Ok(arguments)
    }

    fn body_word(&mut self, word: Keyword, names: &mut Names) -> Res<Node> {
        use Keyword as K;
        if let Some(f) = float_function(word) {
            self.next()?;
            let [argument] = self.body_exactly::<1>(names, word)?;
            return Ok(Node::One(f, Box::new(argument)));
        }
        let two: fn(f64, f64) -> f64 = match word {
            K::Atan2 => f64::atan2,
            K::Pow | K::Pwr => f64::powf,
            K::Mod => |a, b| a % b,
            K::Div => |a, b| (a / b).trunc(),
            K::Min => f64::min,
            K::Max => f64::max,
            K::Sqr => {
                self.next()?;
                let [argument] = self.body_exactly::<1>(names, word)?;
                return Ok(Node::One(|v| v * v, Box::new(argument)));
            }
            K::Select => {
                self.next()?;
                let nodes = self.body_arguments(names)?;
                if !(3..=4).contains(&nodes.len()) {
                    return Err(self.error_here("`select` wants 3 or 4 arguments"));
                }
                return Ok(Node::Select(nodes));
            }
            K::Sum | K::Prod => return self.body_series(word == K::Prod, names),
            _ => {
                return match self.builtin(word)? {
                    Some(num) if num.n == 1 => Ok(Node::Constant(num.v[0])),
                    _ => self.expected("a number, a parameter or a function"),
                };
            }
        };
        self.next()?;
        let mut nodes = self.body_arguments(names)?.into_iter();
        let Some(first) = nodes.next() else { return self.expected("an argument") };
        Ok(nodes.fold(first, |left, right| Node::two(two, left, right)))
    }

    fn body_exactly<const N: usize>(&mut self, names: &mut Names, word: Keyword) -> Res<[Node; N]> {
        let arguments = self.body_arguments(names)?;
        let found = arguments.len();
        <[Node; N]>::try_from(arguments)
            .map_err(|_| self.error_here(format!("`{}` wants {N} argument, found {found}", word.text())))
    }

    /// `sum(i, from, to, body)`.
    fn body_series(&mut self, product: bool, names: &mut Names) -> Res<Node> {
        self.next()?;
        self.expect(Mark::OpenParen)?;
        let variable = self.next()?.token;
        self.comma()?;
        let from = self.body_logical(names)?;
        self.comma()?;
        let to = self.body_logical(names)?;
        self.comma()?;
        names.push(variable);
        let body = self.body_logical(names);
        names.pop();
        let body = Box::new(body?);
        self.expect(Mark::CloseParen)?;
        Ok(Node::Series { product, variable: names.len(), bounds: Box::new([from, to]), body })
    }
}

impl Function {
    /// The value at `arguments`, which is used as scratch space; `None` if something in it is not modelled.
    fn call(&self, arguments: &mut Vec<f64>) -> Option<f64> {
        self.body.as_ref()?.value(arguments)
    }
}

impl Node {
    fn two(f: fn(f64, f64) -> f64, a: Node, b: Node) -> Node {
        match (&a, &b) {
            (Node::Constant(a), Node::Constant(b)) => Node::Constant(f(*a, *b)),
            _ => Node::Two(f, Box::new([a, b])),
        }
    }

    fn value(&self, variables: &mut Vec<f64>) -> Option<f64> {
        Some(match self {
            Node::Constant(value) => *value,
            Node::Variable(index) => *variables.get(*index)?,
            Node::One(f, a) => f(a.value(variables)?),
            Node::Two(f, both) => f(both[0].value(variables)?, both[1].value(variables)?),
            Node::Select(parts) => {
                let v = parts[0].value(variables)?;
                let part = if v < 0.0 { 1 } else { 2 + usize::from(v > 0.0) };
                parts[part.min(parts.len() - 1)].value(variables)?
            }
            Node::Series { product, variable, bounds, body } => {
                let (from, to) = (bounds[0].value(variables)?, bounds[1].value(variables)?);
                let mut value = f64::from(u8::from(*product));
                let mut at = from;
                while at <= to && at - from < SERIES_TURNS {
                    variables.truncate(*variable);
                    variables.push(at);
                    let term = body.value(variables)?;
                    value = if *product { value * term } else { value + term };
                    at += 1.0;
                }
                variables.truncate(*variable);
                value
            }
            Node::Call(function, arguments) => {
                let mut inner = Vec::with_capacity(arguments.len() + 1);
                for argument in arguments {
                    inner.push(argument.value(variables)?);
                }
                function.call(&mut inner)?
            }
        })
    }
}
