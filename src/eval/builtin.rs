//! Built-in numbers and functions of floats and vectors (manual sections 3.1.4 to 3.1.6).

use super::machine::{Lexeme, Machine, Res};
use super::value::{Num, Value};
use crate::lang::{Keyword, Mark, Token};
use crate::scene::function::truncated;
use crate::scene::noise::{self, Octaves};
use glam::{DMat3, DVec3};
use std::f64::consts::PI;
use std::sync::atomic::{AtomicU32, Ordering};

impl Machine<'_> {
    /// A built-in number, vector or call of a function; `None` (and nothing taken) if the word is none.
    pub fn builtin(&mut self, word: Keyword) -> Res<Option<Num>> {
        use Keyword as K;
        let value = match word {
            K::Clock => Num::float(self.options.clock),
            K::ClockOn => Num::float(0.0),
            K::Version => Num::float(self.version_read()),
            K::Now => Num::float(now()),
            _ => match constant(word) {
                Some(value) => value,
                None => return self.deeper(|m| m.builtin_call(word)),
            },
        };
        self.next()?;
        Ok(Some(value))
    }

    /// The argument as POV-Ray takes it: arc sine and cosine of what is over 1 are those of 1, roots and logarithms of what
    /// has none are errors (measured).
    fn in_domain(&mut self, word: Keyword, argument: f64, at: Lexeme) -> Res<f64> {
        use Keyword as K;
        match word {
            K::Asin | K::Acos if argument.abs() > 1.0 => {
                let nearest = argument.signum();
                let message = format!("`{}` of {argument} counts as that of {nearest}", word.text());
                self.warn("outside of -1 to 1", message, self.span(at));
                Ok(nearest)
            }
            K::Sqrt if argument < 0.0 => {
                Err(self.error(format!("`sqrt` of a negative number, {argument}"), self.span(at)))
            }
            K::Ln | K::Log if argument <= 0.0 => {
                let message = format!("`{}` wants a positive number, found {argument}", word.text());
                Err(self.error(message, self.span(at)))
            }
            _ => Ok(argument),
        }
    }

    fn builtin_call(&mut self, word: Keyword) -> Res<Option<Num>> {
        use Keyword as K;
        if let Some(f) = float_function(word) {
            self.next()?;
            self.expect(Mark::OpenParen)?;
            let argument = self.float()?;
            let at = self.last;
            self.expect(Mark::CloseParen)?;
            let value = self.in_domain(word, argument, at)?;
            return Ok(Some(Num::float(f(value))));
        }
        if !is_call(word) {
            return Ok(None);
        }
        self.next()?;
        self.expect(Mark::OpenParen)?;
        let value = match word {
            K::Atan2 | K::Pow | K::Mod | K::Div => self.two(word)?,
            K::BitwiseAnd => self.fold_bits(|a, b| a & b)?,
            K::BitwiseOr => self.fold_bits(|a, b| a | b)?,
            K::BitwiseXor => self.fold_bits(|a, b| a ^ b)?,
            K::Min => self.fold(f64::min)?,
            K::Max => self.fold(f64::max)?,
            K::Log => Num::float(self.float()?.log10()),
            K::Select => self.select()?,
            K::Seed => {
                let seed = self.float()?;
                return self.close_call(Num::float(seed)).map(Some);
            }
            K::Rand => self.random()?,
            K::Defined => {
                let place = self.named_place()?;
                let value = place.as_ref().and_then(|place| self.scopes.at(place));
                Num::float(f64::from(self.is_there(value)))
            }
            K::Dimensions => {
                let dims = self.array_dims()?;
                Num::float(dims.len() as f64)
            }
            K::DimensionSize => {
                let dims = self.array_dims()?;
                self.comma()?;
                let which = self.float()?;
                // There is nothing in a dimension that it does not have (measured).
                Num::float(dims.get((which as usize).wrapping_sub(1)).map_or(0.0, |size| *size as f64))
            }
            K::Strlen => Num::float(self.string()?.chars().count() as f64),
            K::Strcmp => {
                let a = self.string()?;
                self.comma()?;
                let b = self.string()?;
                Num::float(compared(&a, &b))
            }
            K::Asc => Num::float(self.string()?.chars().next().map_or(0.0, |c| f64::from(c as u32))),
            K::Val => {
                let text = self.string()?;
                Num::float(leading_number(&text))
            }
            K::FileExists => {
                let name = self.file_name()?;
                Num::float(f64::from(self.locate(&name).is_some()))
            }
            K::Vlength => Num::float(self.vector()?.length()),
            K::Vdot => {
                let (a, b) = self.two_vectors()?;
                Num::float(a.dot(b))
            }
            K::Vcross => {
                let (a, b) = self.two_vectors()?;
                Num::vector(a.cross(b))
            }
            K::Vnormalize => {
                let v = self.vector()?;
                Num::vector(normalized(v))
            }
            K::Vrotate => {
                let (v, degrees) = self.two_vectors()?;
                Num::vector(rotated(v, degrees))
            }
            K::VaxisRotate => {
                let (v, axis) = self.two_vectors()?;
                self.comma()?;
                Num::vector(rotated_about(v, axis, self.float()?))
            }
            K::Vturbulence => self.vturbulence()?,
            _ => self.geometry_call(word)?,
        };
        self.close_call(value).map(Some)
    }

    fn close_call(&mut self, value: Num) -> Res<Num> {
        self.expect(Mark::CloseParen)?;
        Ok(value)
    }

    /// `atan2(a, b)` and the like. POV-Ray has no direction from 0 to 0, and no 0 to the power of 0.
    fn two(&mut self, word: Keyword) -> Res<Num> {
        let start = self.peek_lexeme()?;
        let a = self.float()?;
        self.comma()?;
        let b = self.float()?;
        if matches!(word, Keyword::Atan2 | Keyword::Pow) && a == 0.0 && b == 0.0 {
            let span = self.span(start).to(self.span(self.last));
            return Err(self.error(format!("`{}` of 0 and 0 has no value", word.text()), span));
        }
        let f = float_function_of_two(word).unwrap_or(f64::powf);
        Ok(Num::float(f(a, b)))
    }

    fn two_vectors(&mut self) -> Res<(DVec3, DVec3)> {
        let a = self.vector()?;
        self.comma()?;
        Ok((a, self.vector()?))
    }

    /// `vturbulence(lambda, omega, octaves, point)`.
    fn vturbulence(&mut self) -> Res<Num> {
        let lambda = self.float()?;
        self.comma()?;
        let omega = self.float()?;
        self.comma()?;
        // POV-Ray's bounds.
        let count = self.float()?.clamp(1.0, 10.0) as u32;
        self.comma()?;
        let point = self.vector()?;
        let octaves = Octaves { count, omega, lambda: Octaves::kept(lambda) };
        Ok(Num::vector(DVec3::from_array(noise::turbulence_vector(point.to_array(), &octaves))))
    }

    /// One or more floats, folded from the left.
    fn fold(&mut self, f: impl Fn(f64, f64) -> f64) -> Res<Num> {
        let mut value = self.float()?;
        while self.peek()? != Token::Mark(Mark::CloseParen) {
            self.comma()?;
            value = f(value, self.float()?);
        }
        Ok(Num::float(value))
    }

    fn fold_bits(&mut self, f: impl Fn(i64, i64) -> i64) -> Res<Num> {
        self.fold(|a, b| f(truncated(a) as i64, truncated(b) as i64) as f64)
    }

    /// `select(v, negative, zero, positive)` or `select(v, negative, other)`.
    fn select(&mut self) -> Res<Num> {
        let v = self.float()?;
        self.comma()?;
        let negative = self.expr()?;
        self.comma()?;
        let zero = self.expr()?;
        let positive = if self.peek()? == Token::Mark(Mark::CloseParen) {
            zero
        } else {
            self.comma()?;
            self.expr()?
        };
        Ok(if v < 0.0 {
            negative
        } else if v == 0.0 {
            zero
        } else {
            positive
        })
    }

    /// `rand(S)`: POV-Ray's generator, x = x * 1812433253 + 12345 mod 2^32; the value is x / (2^32 - 1).
    fn random(&mut self) -> Res<Num> {
        if self.peek()? == Token::Word(Keyword::Seed) {
            let seed = self.factor()?.v[0];
            return Ok(Num::float(next_random(&random_stream(seed))));
        }
        let lexeme = self.next()?;
        let stream = match lexeme.token {
            Token::Name(_) => self.name_value(lexeme)?,
            _ => {
                return Err(
                    self.error_here("expected the name of a random number stream (`#declare S = seed(1);`)")
                );
            }
        };
        let Value::Random(state) = stream else {
            let message = format!("expected a random number stream, found {}", stream.kind());
            return Err(self.error(message, self.span(lexeme)));
        };
        Ok(Num::float(next_random(&state)))
    }

    fn array_dims(&mut self) -> Res<smallvec::SmallVec<[usize; 2]>> {
        let lexeme = self.next()?;
        if let Token::Name(_) = lexeme.token
            && let Value::Array(array) = self.name_value(lexeme)?
        {
            return Ok(array.dims.clone());
        }
        let found = self.describe(lexeme);
        Err(self.error(format!("expected an array, found {found}"), self.span(lexeme)))
    }
}

/// A stream from its seed, truncated; one beyond 32 bits counts as the least number there is (measured).
pub(super) fn random_stream(seed: f64) -> AtomicU32 {
    let whole = seed.trunc();
    let fits = f64::from(i32::MIN) <= whole && whole <= f64::from(i32::MAX);
    AtomicU32::new(if fits { whole as i32 } else { i32::MIN } as u32)
}

/// The next value of a stream, in 0..1.
pub(super) fn next_random(state: &AtomicU32) -> f64 {
    let next = state.load(Ordering::Relaxed).wrapping_mul(1_812_433_253).wrapping_add(12_345);
    state.store(next, Ordering::Relaxed);
    f64::from(next) / f64::from(u32::MAX)
}

/// A vector at unit length. A zero vector stays one, as in POV-Ray 3.7.
pub(super) fn normalized(v: DVec3) -> DVec3 {
    v.try_normalize().unwrap_or(DVec3::ZERO)
}

/// `vrotate`: about x, then y, then z.
pub(super) fn rotated(v: DVec3, degrees: DVec3) -> DVec3 {
    let r = degrees * (PI / 180.0);
    let turn = DMat3::from_rotation_z(r.z) * DMat3::from_rotation_y(r.y) * DMat3::from_rotation_x(r.x);
    turn * v
}

/// `vaxis_rotate`.
pub(super) fn rotated_about(v: DVec3, axis: DVec3, degrees: f64) -> DVec3 {
    let Some(k) = axis.try_normalize() else { return v };
    let (s, c) = (degrees * (PI / 180.0)).sin_cos();
    // Rodrigues' formula, as the matrix whose rows are the images of the axes.
    let x = DVec3::new(
        k.x * k.x + c * (1.0 - k.x * k.x),
        k.x * k.y * (1.0 - c) + k.z * s,
        k.x * k.z * (1.0 - c) - k.y * s,
    );
    let y = DVec3::new(
        k.x * k.y * (1.0 - c) - k.z * s,
        k.y * k.y + c * (1.0 - k.y * k.y),
        k.y * k.z * (1.0 - c) + k.x * s,
    );
    let z = DVec3::new(
        k.x * k.z * (1.0 - c) + k.y * s,
        k.y * k.z * (1.0 - c) - k.x * s,
        k.z * k.z + c * (1.0 - k.z * k.z),
    );
    v.x * x + v.y * y + v.z * z
}

/// Words that stand for one number or vector, always the same.
pub(super) fn constant(word: Keyword) -> Option<Num> {
    use Keyword as K;
    Some(match word {
        K::Pi => Num::float(PI),
        K::True | K::Yes | K::On => Num::float(1.0),
        K::False | K::No | K::Off => Num::float(0.0),
        K::X => Num { n: 3, v: [1.0, 0.0, 0.0, 0.0, 0.0] },
        K::Y => Num { n: 3, v: [0.0, 1.0, 0.0, 0.0, 0.0] },
        K::Z => Num { n: 3, v: [0.0, 0.0, 1.0, 0.0, 0.0] },
        K::T => Num { n: 4, v: [0.0, 0.0, 0.0, 1.0, 0.0] },
        K::U => Num { n: 2, v: [1.0, 0.0, 0.0, 0.0, 0.0] },
        K::V => Num { n: 2, v: [0.0, 1.0, 0.0, 0.0, 0.0] },
        _ => return None,
    })
}

/// Functions of two floats; no number where the reader finds an error.
pub(super) fn float_function_of_two(word: Keyword) -> Option<fn(f64, f64) -> f64> {
    use Keyword as K;
    Some(match word {
        K::Atan2 => |a, b| if a == 0.0 && b == 0.0 { f64::NAN } else { a.atan2(b) },
        K::Pow => |a, b| if a == 0.0 && b == 0.0 { f64::NAN } else { a.powf(b) },
        // C's fmod: the sign is the first one's.
        K::Mod => remainder,
        K::Div => |a, b| truncated(a / b),
        _ => return None,
    })
}

/// As `a % b`; small whole numbers, the most usual ones, take a tenth of the time.
fn remainder(a: f64, b: f64) -> f64 {
    // Exact both ways. A zero has the sign of `a`.
    const SMALL: f64 = (1u64 << 31) as f64;
    if a >= 0.0 && b > 0.0 && a < SMALL && b < SMALL {
        let (x, y) = (a as u32, b as u32);
        if f64::from(x) == a && f64::from(y) == b && a.is_sign_positive() {
            return f64::from(x % y);
        }
    }
    a % b
}

/// Functions of one float. Trigonometry in radians.
pub(super) fn float_function(word: Keyword) -> Option<fn(f64) -> f64> {
    use Keyword as K;
    Some(match word {
        K::Abs => f64::abs,
        K::Acos => f64::acos,
        K::Acosh => f64::acosh,
        K::Asin => f64::asin,
        K::Asinh => f64::asinh,
        K::Atan => f64::atan,
        K::Atanh => f64::atanh,
        K::Ceil => f64::ceil,
        K::Cos => f64::cos,
        K::Cosh => f64::cosh,
        K::Degrees => |v| v * (180.0 / PI),
        K::Radians => |v| v * (PI / 180.0),
        K::Exp => f64::exp,
        K::Floor => f64::floor,
        K::Int => truncated,
        K::Ln => f64::ln,
        K::Log => f64::log10,
        K::Sin => f64::sin,
        K::Sinh => f64::sinh,
        K::Sqrt => f64::sqrt,
        K::Tan => f64::tan,
        K::Tanh => f64::tanh,
        _ => return None,
    })
}

/// True of a word that begins a number or a vector.
pub(super) fn is_number(word: Keyword) -> bool {
    use Keyword as K;
    matches!(word, K::Clock | K::ClockOn | K::Version | K::Now)
        || constant(word).is_some()
        || float_function(word).is_some()
        || is_call(word)
}

fn is_call(word: Keyword) -> bool {
    use Keyword as K;
    matches!(
        word,
        K::Atan2
            | K::Pow
            | K::Mod
            | K::Div
            | K::BitwiseAnd
            | K::BitwiseOr
            | K::BitwiseXor
            | K::Min
            | K::Max
            | K::Select
            | K::Seed
            | K::Rand
            | K::Defined
            | K::Dimensions
            | K::DimensionSize
            | K::Strlen
            | K::Strcmp
            | K::Asc
            | K::Val
            | K::FileExists
            | K::Vlength
            | K::Vdot
            | K::Vcross
            | K::Vnormalize
            | K::Vrotate
            | K::VaxisRotate
            | K::Vturbulence
            | K::Trace
            | K::MinExtent
            | K::MaxExtent
            | K::Inside
    )
}

/// Below, at or above 0 as the first string stands before, with or behind the second: the difference of the first characters
/// that differ (measured).
fn compared(a: &str, b: &str) -> f64 {
    let (mut a, mut b) = (a.chars(), b.chars());
    loop {
        let (left, right) = (a.next(), b.next());
        if left != right || left.is_none() {
            let code = |c: Option<char>| c.map_or(0.0, |c| f64::from(c as u32));
            return code(left) - code(right);
        }
    }
}

/// `val("12.5 mm")` is 12.5, as C's `atof` has it: `0x1f`, `inf` and `nan` are numbers too.
fn leading_number(text: &str) -> f64 {
    let text = text.trim_start();
    let (sign, bare) = match text.as_bytes().first() {
        Some(b'-') => (-1.0, &text[1..]),
        Some(b'+') => (1.0, &text[1..]),
        _ => (1.0, text),
    };
    let begins = |word: &str| bare.get(..word.len()).is_some_and(|head| head.eq_ignore_ascii_case(word));
    if begins("inf") {
        return sign * f64::INFINITY;
    }
    if begins("nan") {
        return f64::NAN;
    }
    if begins("0x") {
        return sign * leading_hexadecimal(&bare[2..]);
    }
    let numeric = |c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.' | 'e' | 'E');
    let mut end = text.find(|c| !numeric(c)).unwrap_or(text.len());
    while end > 0 {
        if let Ok(value) = text[..end].parse() {
            return value;
        }
        end -= 1;
    }
    0.0
}

/// `1f.8p3`: hexadecimal digits, a fraction, and a power of two in decimals.
fn leading_hexadecimal(text: &str) -> f64 {
    let (mut value, mut scale, mut behind_point) = (0.0, 1.0, false);
    let mut chars = text.chars().peekable();
    while let Some(&c) = chars.peek() {
        match c.to_digit(16) {
            Some(digit) => value = value * 16.0 + f64::from(digit),
            None if c == '.' && !behind_point => behind_point = true,
            None => break,
        }
        if behind_point && c != '.' {
            scale /= 16.0;
        }
        chars.next();
    }
    let power: String = match chars.next() {
        Some('p' | 'P') => chars.take_while(|c| c.is_ascii_digit() || matches!(c, '-' | '+')).collect(),
        _ => String::new(),
    };
    value * scale * 2f64.powi(power.parse().unwrap_or(0))
}

/// Days since 2000-01-01.
fn now() -> f64 {
    let since_1970 = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    since_1970.map_or(0.0, |time| time.as_secs_f64() / 86_400.0 - 10_957.0)
}
