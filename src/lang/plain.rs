//! The plain items of a text, in bulk: words, numbers, vectors of numbers, marks, and the blanks between them.
//!
//! In comes a text and a place in it; out go the tokens of the grammar's `plain` items, read from there as far as
//! they go. pest takes some 50 ns a character for these, and they are nearly all of a text. `read.rs` tests that
//! this and the grammar agree.

use super::{Keyword, Mark, Program, Symbols, Token};

/// Adds the tokens of the plain items at `at`; returns where they end.
pub(super) fn scan(text: &str, at: usize, program: &mut Program, symbols: &mut Symbols) -> usize {
    let bytes = text.as_bytes();
    let mut at = at;
    while let Some(&byte) = bytes.get(at) {
        let (token, end) = match byte {
            b' ' | b'\t' | b'\n' | b'\r' => {
                at += 1;
                continue;
            }
            b'a'..=b'z' | b'A'..=b'Z' | b'_' => {
                let end = at + bytes[at..].iter().take_while(|byte| is_word(**byte)).count();
                let word = &text[at..end];
                let token = match Keyword::from_text(word) {
                    Some(keyword) => Token::Word(keyword),
                    None => Token::Name(symbols.intern(word)),
                };
                (token, end)
            }
            b'/' => match bytes.get(at + 1) {
                Some(b'/') => {
                    at = line_end(bytes, at);
                    continue;
                }
                Some(b'*') => return at,
                _ => (Token::Mark(Mark::Slash), at + 1),
            },
            b'<' => match vector(bytes, at, &mut program.numbers) {
                Some(vector) => vector,
                None => mark(text, at, 1 + usize::from(bytes.get(at + 1) == Some(&b'='))),
            },
            b'>' | b'!' => mark(text, at, 1 + usize::from(bytes.get(at + 1) == Some(&b'='))),
            b'0'..=b'9' | b'.' => match number(bytes, at) {
                Some((value, end)) => (Token::Number(value), end),
                None => (Token::Mark(Mark::Dot), at + 1),
            },
            b'('..=b'-' | b'{'..=b'}' | b':' | b';' | b'=' | b'?' | b'[' | b']' | b'&' => mark(text, at, 1),
            _ => return at,
        };
        program.tokens.push(token);
        program.places.push((at as u32, (end - at) as u32));
        at = end;
    }
    at
}

/// The mark of `len` characters at `at`, and where it ends.
fn mark(text: &str, at: usize, len: usize) -> (Token, usize) {
    let end = at + len;
    (Mark::from_text(&text[at..end]).map_or(Token::Junk(' '), Token::Mark), end)
}

fn is_word(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || byte == b'_'
}

/// Where the line that `at` is in ends.
fn line_end(bytes: &[u8], at: usize) -> usize {
    at + bytes[at..].iter().take_while(|byte| !matches!(byte, b'\n' | b'\r')).count()
}

/// `<`, two or more numbers with a comma between each two, `>`: its token and where it ends. The numbers
/// go to `numbers`; if there is no such vector nothing does.
fn vector(bytes: &[u8], open: usize, numbers: &mut Vec<f64>) -> Option<(Token, usize)> {
    let first = numbers.len();
    let mut at = open + 1;
    loop {
        at = behind_gap(bytes, at);
        let negative = bytes.get(at) == Some(&b'-');
        let Some((value, end)) = number(bytes, at + usize::from(negative)) else { break };
        numbers.push(if negative { -value } else { value });
        at = behind_gap(bytes, end);
        match bytes.get(at) {
            Some(b',') => at += 1,
            Some(b'>') if numbers.len() - first > 1 => {
                // Longer than any vector or polynomial; the evaluator says that it is too long.
                let count = (numbers.len() - first).min(usize::from(u16::MAX));
                return Some((Token::Vector(first as u32, count as u16), at + 1));
            }
            _ => break,
        }
    }
    numbers.truncate(first);
    None
}

fn behind_gap(bytes: &[u8], mut at: usize) -> usize {
    while let Some(b' ' | b'\t' | b'\n' | b'\r') = bytes.get(at) {
        at += 1;
    }
    at
}

/// Powers of ten that doubles hold exactly.
const EXACT_POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
    1e19, 1e20, 1e21, 1e22,
];

/// The number without a sign that stands at `start`, correctly rounded, and where it ends.
///
/// A whole number of up to 2^53 times or over a power of ten up to 10^22 is one exact operation (Clinger, How to read
/// floating point numbers accurately, section 4); others go to the standard library.
fn number(bytes: &[u8], start: usize) -> Option<(f64, usize)> {
    let mut digits = 0u64;
    let mut at = start;
    let mut take = |at: &mut usize| {
        let from = *at;
        while let Some(digit) = bytes.get(*at).map(|byte| byte.wrapping_sub(b'0')).filter(|digit| *digit < 10)
        {
            digits = digits.wrapping_mul(10).wrapping_add(u64::from(digit));
            *at += 1;
        }
        *at - from
    };
    let whole = take(&mut at);
    let mut fraction = 0;
    if bytes.get(at) == Some(&b'.') {
        let mut behind = at + 1;
        fraction = take(&mut behind);
        if whole + fraction > 0 {
            at = behind;
        }
    }
    if whole + fraction == 0 {
        return None;
    }
    let mut exponent = -(fraction as i64);
    if let Some(b'e' | b'E') = bytes.get(at) {
        let mut behind = at + 1;
        let negative = bytes.get(behind) == Some(&b'-');
        behind += usize::from(matches!(bytes.get(behind), Some(b'-' | b'+')));
        let from = behind;
        let mut power = 0i64;
        while let Some(digit) = bytes.get(behind).filter(|byte| byte.is_ascii_digit()) {
            power = (power * 10 + i64::from(digit - b'0')).min(1 << 32);
            behind += 1;
        }
        if behind > from {
            exponent += if negative { -power } else { power };
            at = behind;
        }
    }
    // 19 digits do not overflow.
    let value = if whole + fraction <= 19 && digits <= 1 << 53 && exponent.abs() <= 22 {
        let power = EXACT_POWERS[exponent.unsigned_abs() as usize];
        if exponent < 0 { digits as f64 / power } else { digits as f64 * power }
    } else {
        std::str::from_utf8(&bytes[start..at]).ok()?.parse().unwrap_or(f64::NAN)
    };
    Some((value, at))
}
