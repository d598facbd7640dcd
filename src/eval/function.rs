//! `function { ... }` (manual section 3.1.7): read once and compiled to a [`Function`]'s operations.
//!
//! Identifiers are captured when the function is declared. What patterns and pigments say at a point, the oracle is asked.

use super::machine::{Lexeme, Machine, Res, Stop};
use super::value::{Lacks, Num, Value, With};
use crate::lang::{Keyword, Mark, Token};
use crate::reference;
use crate::scene::function::{Binary, Callee, Component, Op, Operand, Sign, Surroundings, Unary};
use crate::scene::{Function, Pigment, internal};
use glam::DVec3;
use smallvec::SmallVec;
use std::sync::Arc;

/// What a name that is called stands for, and what in it is not modelled.
pub(super) type Called = With<Callee>;

/// Functions within each other beyond this are refused: evaluation recurses.
const DEEPEST: usize = 100;
/// Steps of one call by the script: a function of functions can double its cost at each level.
const CALL_STEPS: u64 = 100_000_000;
/// Operations of one function.
const LONGEST: usize = 30_000;

/// A function under way.
struct Draft {
    function: Function,
    /// What names mean: parameters first, then the variables of `sum` and `prod` about.
    names: SmallVec<[(Token, u16); 4]>,
    lacks: Lacks,
}

impl Machine<'_> {
    /// What stands behind `function`.
    pub fn function(&mut self) -> Res<Value> {
        self.deeper(|m| {
            let mut names: SmallVec<[(Token, u16); 4]> = SmallVec::new();
            let unnamed = !m.accept(Mark::OpenParen)?;
            if !unnamed {
                while !m.accept(Mark::CloseParen)? {
                    let expand = std::mem::replace(&mut m.expand, false);
                    let name = m.next();
                    m.expand = expand;
                    match name?.token {
                        token @ (Token::Name(_) | Token::Word(_)) if names.len() < 100 => {
                            names.push((token, names.len() as u16));
                        }
                        _ => return Err(m.error_here("expected a parameter's name or `)`")),
                    }
                    m.comma()?;
                }
            } else {
                let xyz = [Keyword::X, Keyword::Y, Keyword::Z];
                names.extend(xyz.iter().zip(0..).map(|(word, i)| (Token::Word(*word), i)));
            }
            let params = names.len();
            if unnamed {
                // Other words for the first two (measured).
                names.extend([(Token::Word(Keyword::U), 0), (Token::Word(Keyword::V), 1)]);
            }
            let open = m.open("function")?;
            let at = m.peek_lexeme()?;
            let called = match at.token {
                Token::Word(word) => m.special_function(word, at)?,
                _ => None,
            };
            if let Some(called) = called {
                m.close("function", open)?;
                return Ok(Value::Function(Arc::new(called)));
            }
            let ops = Vec::new();
            let result = Operand::Constant(0.0);
            let function =
                Function { params, registers: params, ops, result, depth: 1, asks_pigments: false };
            let mut draft = Draft { function, names, lacks: Lacks::default() };
            draft.function.result = m.body_logical(&mut draft)?;
            m.close("function", open)?;
            if draft.function.depth > DEEPEST {
                let message = format!("more than {DEEPEST} functions within each other");
                return Err(m.error(message, m.span(open)));
            }
            m.charge(draft.function.ops.len() * std::mem::size_of::<Op>())?;
            let value = Callee::Function(Arc::new(draft.function));
            Ok(Value::Function(Arc::new(With { value, lacks: draft.lacks })))
        })
    }

    /// A function that is not made of floats: its word and what follows, but not the closing brace.
    fn special_function(&mut self, word: Keyword, at: Lexeme) -> Res<Option<Called>> {
        Ok(Some(match word {
            Keyword::Internal => {
                self.next()?;
                self.expect(Mark::OpenParen)?;
                let number = self.finite()?;
                self.expect(Mark::CloseParen)?;
                let known = (0.0..1000.0).contains(&number) && internal::is_modelled(number as u16);
                match known {
                    true => With::new(Callee::Internal(number as u16)),
                    false => {
                        With { value: Callee::Missing, lacks: self.lack(format!("internal({number})"), at) }
                    }
                }
            }
            Keyword::Pigment => {
                self.next()?;
                let mut pigment = With::new(Pigment::default());
                self.pigment(&mut pigment)?;
                With { value: Callee::Pigment(Arc::new(pigment.value)), lacks: pigment.lacks }
            }
            Keyword::Pattern => {
                self.next()?;
                let pigment = self.pattern_block()?;
                With { value: Callee::Pattern(Arc::new(pigment.value)), lacks: pigment.lacks }
            }
            Keyword::Transform => {
                self.next()?;
                With::new(Callee::Transform(self.transform_block()?))
            }
            Keyword::Spline => {
                self.next()?;
                With::new(Callee::Spline(Arc::new(self.spline()?)))
            }
            _ => return Ok(None),
        }))
    }

    /// The arguments of a call, and its value.
    pub fn call_function(&mut self, called: &Called) -> Res<Num> {
        self.deeper(|m| {
            let at = m.last;
            m.expect(Mark::OpenParen)?;
            let mut arguments: SmallVec<[f64; 8]> = SmallVec::new();
            let mut other_curve = None;
            while m.peek()? != Token::Mark(Mark::CloseParen) {
                // A point may be given as a vector.
                let value = m.expr()?;
                arguments.extend_from_slice(&value.v[..usize::from(value.n)]);
                m.comma()?;
                // The second argument of a spline may be another kind of curve.
                if let Callee::Spline(spline) = &called.value {
                    arguments.truncate(1);
                    if let Some(kind) = m.spline_kind()? {
                        m.count_steps(spline.len() as u64)?;
                        other_curve = Some(Callee::Spline(Arc::new(spline.of_kind(kind))));
                    }
                }
            }
            m.expect(Mark::CloseParen)?;
            m.check_arguments(&called.value, arguments.len(), at)?;
            m.miss(&called.lacks);
            let pigment = |pigment: &Pigment, point: DVec3| {
                let color = reference::pigment_color(pigment, point);
                [color.rgb.x, color.rgb.y, color.rgb.z, color.filter, color.transmit]
            };
            let mut around = Surroundings::new(CALL_STEPS, &pigment);
            let v = other_curve.as_ref().unwrap_or(&called.value).values(&arguments, &mut around);
            m.count_steps(CALL_STEPS - around.steps)?;
            if v.is_none() && around.calls == 0 {
                let message = "stopped: too many calls of a function by itself within each other";
                return Err(m.halt(message));
            }
            let Some(v) = v else {
                return Err(m.halt(format!("stopped: a function's value takes more than {CALL_STEPS} steps")));
            };
            let n = match &called.value {
                Callee::Spline(spline) => spline.components.max(1),
                Callee::Transform(_) => 3,
                Callee::Pigment(_) => 5,
                _ => 1,
            };
            Ok(Num { n, v })
        })
    }

    fn check_arguments(&mut self, callee: &Callee, found: usize, at: Lexeme) -> Res<()> {
        let (least, most) = callee.arguments();
        if (least..=most).contains(&found) {
            return Ok(());
        }
        let message = format!("the function wants {least} arguments, found {found}");
        Err(self.error(message, self.span(at)))
    }

    // ----------------------------------------------------------------------------------------------------------
    // Bodies: relations and logic need no parentheses here

    fn body_logical(&mut self, draft: &mut Draft) -> Res<Operand> {
        self.deeper(|m| {
            let mut left = m.body_relation(draft)?;
            while let Token::Mark(mark @ (Mark::And | Mark::Or)) = m.peek()? {
                m.next()?;
                let right = m.body_relation(draft)?;
                let f = if mark == Mark::And { Binary::And } else { Binary::Or };
                left = m.op_two(draft, f, left, right)?;
            }
            Ok(left)
        })
    }

    fn body_relation(&mut self, draft: &mut Draft) -> Res<Operand> {
        let mut left = self.body_sum(draft)?;
        loop {
            let Token::Mark(mark) = self.peek()? else { return Ok(left) };
            let f = match mark {
                Mark::Less => Binary::Less,
                Mark::LessEqual => Binary::LessEqual,
                Mark::Greater => Binary::Greater,
                Mark::GreaterEqual => Binary::GreaterEqual,
                Mark::Equal => Binary::Equal,
                Mark::NotEqual => Binary::NotEqual,
                _ => return Ok(left),
            };
            self.next()?;
            let right = self.body_sum(draft)?;
            left = self.op_two(draft, f, left, right)?;
        }
    }

    fn body_sum(&mut self, draft: &mut Draft) -> Res<Operand> {
        let mut left = self.body_product(draft)?;
        while let Token::Mark(mark @ (Mark::Plus | Mark::Minus)) = self.peek()? {
            self.next()?;
            let right = self.body_product(draft)?;
            let f = if mark == Mark::Plus { Binary::Add } else { Binary::Subtract };
            left = self.op_two(draft, f, left, right)?;
        }
        Ok(left)
    }

    fn body_product(&mut self, draft: &mut Draft) -> Res<Operand> {
        let mut left = self.body_factor(draft)?;
        while let Token::Mark(mark @ (Mark::Star | Mark::Slash)) = self.peek()? {
            self.next()?;
            let right = self.body_factor(draft)?;
            let f = if mark == Mark::Star { Binary::Multiply } else { Binary::Divide };
            left = self.op_two(draft, f, left, right)?;
        }
        Ok(left)
    }

    fn body_factor(&mut self, draft: &mut Draft) -> Res<Operand> {
        let token = self.peek()?;
        if let Some((_, register)) = draft.names.iter().rfind(|(name, _)| *name == token) {
            let register = *register;
            self.next()?;
            return Ok(Operand::Register(register));
        }
        match token {
            Token::Number(value) => {
                self.next()?;
                Ok(Operand::Constant(value))
            }
            Token::Mark(Mark::OpenParen) => {
                self.next()?;
                let operand = self.body_logical(draft)?;
                self.expect(Mark::CloseParen)?;
                Ok(operand)
            }
            Token::Mark(mark @ (Mark::Minus | Mark::Plus | Mark::Not)) => {
                self.next()?;
                let operand = self.deeper(|m| m.body_factor(draft))?;
                match mark {
                    Mark::Minus => self.op_one(draft, Unary::Minus, operand),
                    Mark::Not => self.op_one(draft, Unary::Not, operand),
                    _ => Ok(operand),
                }
            }
            Token::Name(_) => self.body_name(draft),
            Token::Word(word) => self.body_word(word, draft),
            _ => self.expected("a number, a parameter or a function"),
        }
    }

    /// A float that is captured, a component of a vector, or a call of another function.
    fn body_name(&mut self, draft: &mut Draft) -> Res<Operand> {
        let lexeme = self.next()?;
        if self.is_own_name(lexeme) {
            let message = "POV-Ray warns of functions that call themselves, and crashes on some";
            self.warn("recursion", message, self.span(lexeme));
            return self.body_call(With::new(Callee::Itself(draft.function.params)), lexeme, draft);
        }
        let called = match self.name_value(lexeme)? {
            Value::Function(called) => Called::clone(&called),
            Value::Spline(spline) => With::new(Callee::Spline(spline)),
            Value::Number(num) => {
                let num = self.suffix(num)?;
                if num.n == 1 {
                    return Ok(Operand::Constant(num.v[0]));
                }
                return Err(self.error("expected a float in a function, found a vector", self.span(lexeme)));
            }
            Value::Poison => return Err(Stop::Silent),
            other => {
                let message = format!("expected a float in a function, found {}", other.kind());
                return Err(self.error(message, self.span(lexeme)));
            }
        };
        self.body_call(called, lexeme, draft)
    }

    /// True of a call by the name that the function under way is declared by, if that stands for nothing yet.
    fn is_own_name(&self, lexeme: Lexeme) -> bool {
        let Token::Name(symbol) = lexeme.token else { return false };
        self.declaring == Some(symbol)
            && self.scopes.get(symbol).is_none()
            && self.peek_raw() == Token::Mark(Mark::OpenParen)
    }

    /// The arguments of a call in a body, and which number of the value is meant.
    fn body_call(&mut self, called: Called, lexeme: Lexeme, draft: &mut Draft) -> Res<Operand> {
        let arguments: SmallVec<[Operand; 4]> = self.body_arguments(draft)?.into();
        self.check_arguments(&called.value, arguments.len(), lexeme)?;
        let mut component = Component::Index(0);
        if self.peek()? == Token::Mark(Mark::Dot) {
            component = self.component()?;
        } else if called.value.is_vector() {
            return self.expected("`.x`, `.red` or the like: the function gives a vector");
        }
        draft.lacks.add(&called.lacks);
        match &called.value {
            Callee::Function(function) => {
                draft.function.depth = draft.function.depth.max(function.depth + 1);
                draft.function.asks_pigments |= function.asks_pigments;
            }
            Callee::Pigment(_) | Callee::Pattern(_) => draft.function.asks_pigments = true,
            _ => {}
        }
        let out = self.register(draft)?;
        draft.function.ops.push(Op::Call { out, callee: Box::new(called.value), arguments, component });
        Ok(Operand::Register(out))
    }

    fn body_arguments(&mut self, draft: &mut Draft) -> Res<Vec<Operand>> {
        self.expect(Mark::OpenParen)?;
        let mut arguments = Vec::new();
        while self.peek()? != Token::Mark(Mark::CloseParen) {
            arguments.push(self.body_logical(draft)?);
            self.comma()?;
        }
        self.next()?;
        Ok(arguments)
    }

    fn body_word(&mut self, word: Keyword, draft: &mut Draft) -> Res<Operand> {
        use Keyword as K;
        if let Some(f) = unary(word) {
            self.next()?;
            let [argument] = self.body_exactly::<1>(draft, word)?;
            return self.op_one(draft, f, argument);
        }
        let f = match word {
            K::Atan2 => Binary::Atan2,
            K::Pow | K::Pwr => Binary::Power,
            K::Mod => Binary::Remainder,
            K::Div => Binary::Quotient,
            K::Min => Binary::Min,
            K::Max => Binary::Max,
            K::Select => return self.body_select(draft),
            K::Sum | K::Prod => return self.body_series(word == K::Prod, draft),
            _ => {
                return match self.builtin(word)? {
                    Some(num) => match self.suffix(num)? {
                        num if num.n == 1 => Ok(Operand::Constant(num.v[0])),
                        _ => self.expected("a number, a parameter or a function"),
                    },
                    None => self.expected("a number, a parameter or a function"),
                };
            }
        };
        self.next()?;
        let mut nodes = self.body_arguments(draft)?.into_iter();
        let Some(mut left) = nodes.next() else { return self.expected("an argument") };
        for right in nodes {
            left = self.op_two(draft, f, left, right)?;
        }
        Ok(left)
    }

    /// `select(v, negative, other)` or `select(v, negative, zero, positive)`.
    fn body_select(&mut self, draft: &mut Draft) -> Res<Operand> {
        self.next()?;
        self.expect(Mark::OpenParen)?;
        let v = self.body_logical(draft)?;
        self.comma()?;
        // Each choice with the `When` before its steps, if it has any: only the last knows what it is a choice for.
        let mut choices: SmallVec<[(Operand, Option<usize>); 3]> = SmallVec::new();
        while self.peek()? != Token::Mark(Mark::CloseParen) {
            let when = draft.function.ops.len();
            draft.function.ops.push(Op::When { v, sign: Sign::Negative, steps: 0 });
            let choice = self.body_logical(draft)?;
            let count = draft.function.ops.len() - when - 1;
            if count == 0 {
                draft.function.ops.pop();
            } else if let Op::When { steps, .. } = &mut draft.function.ops[when] {
                *steps = count as u32;
            }
            choices.push((choice, (count > 0).then_some(when)));
            self.comma()?;
        }
        self.next()?;
        let (signs, [negative, zero, positive]): (&[Sign], _) = match choices[..] {
            [(negative, _), (other, _)] => (&[Sign::Negative, Sign::NotNegative], [negative, other, other]),
            [(negative, _), (zero, _), (positive, _)] => {
                (&[Sign::Negative, Sign::Zero, Sign::Positive], [negative, zero, positive])
            }
            _ => return Err(self.error_here("`select` wants 3 or 4 arguments")),
        };
        for ((_, when), own) in choices.iter().zip(signs) {
            if let Some(Op::When { sign, .. }) = when.map(|when| &mut draft.function.ops[when]) {
                *sign = *own;
            }
        }
        let out = self.register(draft)?;
        draft.function.ops.push(Op::Select { out, v, negative, zero, positive });
        Ok(Operand::Register(out))
    }

    fn body_exactly<const N: usize>(&mut self, draft: &mut Draft, word: Keyword) -> Res<[Operand; N]> {
        let arguments = self.body_arguments(draft)?;
        let found = arguments.len();
        <[Operand; N]>::try_from(arguments)
            .map_err(|_| self.error_here(format!("`{}` wants {N} argument, found {found}", word.text())))
    }

    /// `sum(i, from, to, body)`.
    fn body_series(&mut self, product: bool, draft: &mut Draft) -> Res<Operand> {
        self.next()?;
        self.expect(Mark::OpenParen)?;
        let name = self.next()?.token;
        self.comma()?;
        let from = self.body_logical(draft)?;
        self.comma()?;
        let to = self.body_logical(draft)?;
        self.comma()?;
        let variable = self.register(draft)?;
        let out = self.register(draft)?;
        let term = Operand::Constant(0.0);
        let at = draft.function.ops.len();
        draft.function.ops.push(Op::Series { out, product, variable, from, to, body: 0, term });
        draft.names.push((name, variable));
        let result = self.body_logical(draft);
        draft.names.pop();
        let result = result?;
        self.expect(Mark::CloseParen)?;
        let length = (draft.function.ops.len() - at - 1) as u32;
        if let Op::Series { body, term, .. } = &mut draft.function.ops[at] {
            (*body, *term) = (length, result);
        }
        Ok(Operand::Register(out))
    }

    // ----------------------------------------------------------------------------------------------------------
    // Operations

    fn register(&mut self, draft: &mut Draft) -> Res<u16> {
        if draft.function.registers >= LONGEST {
            return Err(self.error_here(format!("a function of more than {LONGEST} operations")));
        }
        draft.function.registers += 1;
        Ok(draft.function.registers as u16 - 1)
    }

    fn op_one(&mut self, draft: &mut Draft, f: Unary, a: Operand) -> Res<Operand> {
        if let Operand::Constant(a) = a {
            return Ok(Operand::Constant(f.apply(a)));
        }
        let out = self.register(draft)?;
        draft.function.ops.push(Op::One { out, f, a });
        Ok(Operand::Register(out))
    }

    fn op_two(&mut self, draft: &mut Draft, f: Binary, a: Operand, b: Operand) -> Res<Operand> {
        if let (Operand::Constant(a), Operand::Constant(b)) = (a, b) {
            return Ok(Operand::Constant(f.apply(a, b)));
        }
        let out = self.register(draft)?;
        draft.function.ops.push(Op::Two { out, f, a, b });
        Ok(Operand::Register(out))
    }
}

fn unary(word: Keyword) -> Option<Unary> {
    use Keyword as K;
    Some(match word {
        K::Sqr => Unary::Square,
        K::Abs => Unary::Abs,
        K::Acos => Unary::Acos,
        K::Acosh => Unary::Acosh,
        K::Asin => Unary::Asin,
        K::Asinh => Unary::Asinh,
        K::Atan => Unary::Atan,
        K::Atanh => Unary::Atanh,
        K::Ceil => Unary::Ceil,
        K::Cos => Unary::Cos,
        K::Cosh => Unary::Cosh,
        K::Degrees => Unary::Degrees,
        K::Radians => Unary::Radians,
        K::Exp => Unary::Exp,
        K::Floor => Unary::Floor,
        K::Int => Unary::Int,
        K::Ln => Unary::Ln,
        K::Log => Unary::Log,
        K::Sin => Unary::Sin,
        K::Sinh => Unary::Sinh,
        K::Sqrt => Unary::Sqrt,
        K::Tan => Unary::Tan,
        K::Tanh => Unary::Tanh,
        _ => return None,
    })
}
