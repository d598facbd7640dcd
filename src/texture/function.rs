//! Functions of floats at eight points at a time (manual section 3.1.7).
//!
//! The compiled list of [`crate::scene::function`] is run with eight numbers a register, to the very bits that it comes to
//! at each point alone. Sine, cosine, exponential, logarithm and small whole powers are computed in lanes and differ from
//! the one point's by what their constants here say; the other transcendental functions are asked lane by lane.

use super::noise;
use crate::lane::{LANES, Lane, Mask, Vec3, each_lane, f64x8};
use crate::scene::function::{
    Binary, Callee, Component, EQUAL_WITHIN, Function, Op, Operand, Sign, Surroundings, Unary,
};
use crate::scene::internal;
use crate::scene::number::Number;
use smallvec::SmallVec;

/// Sines and cosines of angles up to this are computed in lanes, within 2^-52; of larger ones lane by lane.
const LARGEST_ANGLE: f64 = 65536.0;
/// Exponentials of numbers up to this are computed in lanes, within 2^-51 of their value; of larger ones lane by lane.
const LARGEST_EXPONENT: f64 = 700.0;
/// Logarithms of numbers from 2^-1000 to 2^1000 are computed in lanes, within 2^-51 of their value or 2^-52.
const LARGEST_LOGARITHM: f64 = 1.0715086071862673e301;
/// Powers up to this are products, within `power * 2^-53` of their value.
const LARGEST_POWER: f64 = 16.0;

impl Number for f64x8 {
    #[inline(always)]
    fn lit(value: f64) -> Self {
        Lane::lit(value)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Lane::sqrt(self)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Lane::abs(self)
    }
    #[inline(always)]
    fn if_less(self, other: Self, yes: Self, no: Self) -> Self {
        self.lt(other).select(yes, no)
    }
    #[inline(always)]
    fn whole(self) -> Self {
        Lane::trunc(self)
    }
    fn sine(self) -> Self {
        one(Unary::Sin, self, !0)
    }
    fn raised(self, exponent: f64) -> Self {
        self.pow_const(exponent)
    }
    fn lattice<const N: usize>(p: [Self; 3]) -> [Self; N] {
        noise::lattice(p)
    }
    fn everywhere(self) -> Option<f64> {
        let first = self.lanes()[0];
        self.equal(Lane::splat(first)).all().then_some(first)
    }
    fn each<const N: usize>(arguments: [Self; N], f: impl Fn([f64; N]) -> f64) -> Self {
        let lanes = arguments.map(Lane::to_array);
        Lane::from_array(each_lane(|k| f(lanes.map(|argument| argument[k]))))
    }
}

/// The values of a function of x, y and z at eight points; 0 where it has none or takes more than `steps` steps.
pub fn values(function: &Function, point: Vec3<f64x8>, steps: u64) -> f64x8 {
    let mut left = steps;
    let arguments = [point.x, point.y, point.z];
    // Each lane alone takes no more steps than the eight together.
    run(function, &arguments, !0, &mut left).unwrap_or_else(|| {
        Number::each(arguments, |point| {
            function.value(&point, &mut Surroundings::new(steps, &|_, _| [0.0; 5])).unwrap_or(0.0)
        })
    })
}

/// Some steps that only some lanes need: of a choice, or of a series.
struct Section {
    /// The step behind them.
    end: usize,
    /// The lanes that were live before it.
    live: u8,
    series: Option<Series>,
}

/// A sum or product under way: its step, the variable, its last values, and the results so far.
struct Series {
    head: usize,
    at: f64x8,
    to: f64x8,
    value: f64x8,
}

/// The values in the lanes that are `live`; others hold anything. `None` as for [`Function::value`].
fn run(function: &Function, arguments: &[f64x8], mut live: u8, steps: &mut u64) -> Option<f64x8> {
    if arguments.len() != function.params {
        return None;
    }
    let mut registers: SmallVec<[f64x8; 16]> = SmallVec::from_elem(f64x8::ZERO, function.registers);
    registers[..function.params].copy_from_slice(arguments);
    let mut sections: SmallVec<[Section; 2]> = SmallVec::new();
    let mut next = 0;
    loop {
        while let Some(section) = sections.last_mut().filter(|section| section.end == next) {
            if let Some(series) = &mut section.series {
                let Op::Series { out, product, variable, term, .. } = function.ops[series.head] else {
                    return None;
                };
                let term = read(term, &registers);
                let grown = if product { series.value * term } else { series.value + term };
                series.value = Mask::from_bits(live).select(grown, series.value);
                series.at += 1.0;
                live &= series.at.le(series.to).bits();
                if live != 0 {
                    *steps = steps.checked_sub(1)?;
                    registers[usize::from(variable)] = series.at;
                    next = series.head + 1;
                    continue;
                }
                registers[usize::from(out)] = series.value;
            }
            live = section.live;
            sections.pop();
        }
        let Some(op) = function.ops.get(next) else { return Some(read(function.result, &registers)) };
        *steps = steps.checked_sub(1)?;
        next += 1;
        let (out, value) = match *op {
            Op::One { out, f, a } => (out, one(f, read(a, &registers), live)),
            Op::Two { out, f, a, b } => (out, two(f, read(a, &registers), b, read(b, &registers))),
            Op::Select { out, v, negative, zero, positive } => {
                let v = read(v, &registers);
                let other = v.gt(Lane::zero()).select(read(positive, &registers), read(zero, &registers));
                (out, v.lt(Lane::zero()).select(read(negative, &registers), other))
            }
            Op::When { v, sign, steps } => {
                let end = next + steps as usize;
                let needed = live & lanes_of(sign, read(v, &registers));
                if needed == 0 {
                    next = end;
                } else if needed != live {
                    sections.push(Section { end, live, series: None });
                    live = needed;
                }
                continue;
            }
            Op::Call { out, ref callee, ref arguments, component } => {
                let arguments: SmallVec<[f64x8; 8]> =
                    arguments.iter().map(|a| read(*a, &registers)).collect();
                (out, call(callee, &arguments, component, live, steps)?)
            }
            Op::Series { out, product, variable, from, to, body, .. } => {
                let (at, to) = (read(from, &registers), read(to, &registers));
                let (head, end) = (next - 1, next + body as usize);
                let value = Lane::lit(f64::from(u8::from(product)));
                let running = live & at.le(to).bits();
                if running != 0 {
                    *steps = steps.checked_sub(1)?;
                    sections.push(Section { end, live, series: Some(Series { head, at, to, value }) });
                    live = running;
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

#[inline(always)]
fn read(operand: Operand, registers: &[f64x8]) -> f64x8 {
    match operand {
        Operand::Constant(value) => Lane::lit(value),
        Operand::Register(index) => registers[usize::from(index)],
    }
}

/// The lanes whose number has this sign.
fn lanes_of(sign: Sign, v: f64x8) -> u8 {
    let (below, above) = (v.lt(Lane::zero()).bits(), v.gt(Lane::zero()).bits());
    match sign {
        Sign::Negative => below,
        Sign::Zero => !(below | above),
        Sign::Positive => above,
        Sign::NotNegative => !below,
    }
}

fn one(f: Unary, a: f64x8, live: u8) -> f64x8 {
    let one = || Lane::lit(1.0);
    // True if that holds in every lane that counts.
    let everywhere = |mask: Mask<f64x8>| mask.bits() | !live == !0;
    let below = |limit: f64| everywhere(Lane::abs(a).le(Lane::lit(limit)));
    match f {
        Unary::Minus => -a,
        Unary::Not => a.equal(Lane::zero()).keep(one()),
        Unary::Square => a * a,
        Unary::Abs => Lane::abs(a),
        Unary::Ceil => -Lane::floor(-a),
        Unary::Floor => Lane::floor(a),
        Unary::Degrees => a * (180.0 / std::f64::consts::PI),
        Unary::Radians => a * (std::f64::consts::PI / 180.0),
        Unary::Sqrt => Lane::sqrt(a),
        Unary::Sin if below(LARGEST_ANGLE) => Lane::sin_cos(a).0,
        Unary::Cos if below(LARGEST_ANGLE) => Lane::sin_cos(a).1,
        Unary::Exp if below(LARGEST_EXPONENT) => Lane::exp(a),
        Unary::Ln if below(LARGEST_LOGARITHM) && everywhere(a.ge(Lane::lit(1.0 / LARGEST_LOGARITHM))) => {
            Lane::ln(a)
        }
        _ => a.map(|a| f.apply(a)),
    }
}

/// `exponent` is `b` as the function has it: the same in all lanes if it is a constant.
fn two(f: Binary, a: f64x8, exponent: Operand, b: f64x8) -> f64x8 {
    let holds = |mask: Mask<f64x8>| mask.keep(Lane::lit(1.0));
    let not_zero = |v: f64x8| !v.equal(Lane::zero());
    let distance = || Lane::abs(a - b);
    match f {
        Binary::Add => a + b,
        Binary::Subtract => a - b,
        Binary::Multiply => a * b,
        Binary::Divide => b.equal(Lane::zero()).select(Lane::lit(f64::INFINITY), a / b),
        Binary::Power => match exponent {
            Operand::Constant(y) if y.fract() == 0.0 && (1.0..=LARGEST_POWER).contains(&y) => a.pow_const(y),
            _ => a.power(b),
        },
        Binary::Remainder => match exponent {
            // Exact, and of the sign of `a`.
            Operand::Constant(1.0) => Lane::copysign(a - Lane::trunc(a), a),
            _ => Number::each([a, b], |[a, b]| a % b),
        },
        Binary::Quotient => Lane::trunc(a / b),
        Binary::Atan2 => Number::each([a, b], |[a, b]| a.atan2(b)),
        Binary::Min => a.smaller(b),
        Binary::Max => a.larger(b),
        Binary::And => holds(not_zero(a) & not_zero(b)),
        Binary::Or => holds(not_zero(a) | not_zero(b)),
        Binary::Less => holds(a.lt(b)),
        Binary::LessEqual => holds(a.le(b)),
        Binary::Greater => holds(a.gt(b)),
        Binary::GreaterEqual => holds(a.ge(b)),
        Binary::Equal => holds(distance().lt(Lane::lit(EQUAL_WITHIN))),
        Binary::NotEqual => holds(distance().ge(Lane::lit(EQUAL_WITHIN))),
    }
}

fn call(
    callee: &Callee,
    arguments: &[f64x8],
    component: Component,
    live: u8,
    steps: &mut u64,
) -> Option<f64x8> {
    let (least, most) = callee.arguments();
    if !(least..=most).contains(&arguments.len()) {
        return None;
    }
    Some(match callee {
        Callee::Function(function) => run(function, arguments, live, steps)?,
        Callee::Internal(number) => internal::value(*number, arguments).unwrap_or(Lane::zero()),
        // A table, looked up at each point.
        Callee::Spline(spline) => arguments[0].map(|at| component.of(&spline.value(at))),
        Callee::Transform(_) => {
            let mut around = Surroundings::new(LANES as u64, &|_, _| [0.0; 5]);
            let lanes = arguments.iter().map(|a| a.to_array()).collect::<SmallVec<[_; 3]>>();
            let mut value = |k: usize| callee.values(&[lanes[0][k], lanes[1][k], lanes[2][k]], &mut around);
            Lane::from_array(each_lane(|k| value(k).map_or(0.0, |v| component.of(&v))))
        }
        // Lanes would go on as long as any of them does, in deep frames: each point alone.
        Callee::Itself(_) => return None,
        // Patterns of the renderer ask no pigments.
        Callee::Pigment(_) | Callee::Pattern(_) | Callee::Missing => Lane::zero(),
    })
}
