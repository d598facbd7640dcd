//! The items of a text, in bulk: words, numbers, vectors, marks, strings, directives, and the blanks and comments between them.
//!
//! In comes a text and a place in it; out go its tokens, as the grammar has them, read from there up to the next character that
//! nobody writes (`odd_blank`, `junk`). pest takes some 50 ns a character, and more to begin. `read.rs` tests that this
//! and the grammar agree on any text.

use super::ends::{behind_gap, comment_end, line_end, string_end, word_end};
use super::nest::directive_of;
use super::skim::{behind_declare, behind_parameters, block_end, body_end};
use super::{Keyword, Mark, Program, Symbols, Token};

/// Adds the tokens of the items at `at`; returns where they end. If `skim`, what can wait is one token each.
pub(super) fn scan(text: &str, at: usize, program: &mut Program, symbols: &mut Symbols, skim: bool) -> usize {
    let bytes = text.as_bytes();
    let mut at = at;
    // Where the lists of a mesh2 may have rows.
    let mut rows_at = usize::MAX;
    while let Some(&byte) = bytes.get(at) {
        let (token, end) = match byte {
            b' ' | b'\t' | b'\n' | b'\r' => {
                at = behind_gap(bytes, at + 1);
                continue;
            }
            b'a'..=b'z' | b'A'..=b'Z' | b'_' => {
                let end = word_end(bytes, at);
                let word = &text[at..end];
                // No keyword begins with a capital.
                let keyword = if byte >= b'_' { Keyword::from_text(word) } else { None };
                match keyword {
                    Some(keyword) => {
                        if is_list(keyword) {
                            rows_at = behind_count(bytes, end).unwrap_or(usize::MAX);
                        }
                        let block = if skim && behind_declare(&program.tokens) {
                            block_end(text, keyword, end)
                        } else {
                            None
                        };
                        match block {
                            Some(end) => (Token::Block(keyword), end),
                            None => (Token::Word(keyword), end),
                        }
                    }
                    None => (Token::Name(symbols.intern(word)), end),
                }
            }
            b'/' => match bytes.get(at + 1) {
                Some(b'/') => {
                    at = line_end(bytes, at);
                    continue;
                }
                Some(b'*') => match comment_end(bytes, at) {
                    Some(end) => {
                        at = end;
                        continue;
                    }
                    None => {
                        // It runs to the end of the file; its place is its start only, as that of a broken string.
                        push(program, Token::BrokenComment, at, 2);
                        return bytes.len();
                    }
                },
                _ => (Token::Mark(Mark::Slash), at + 1),
            },
            b'<' => {
                let numbers = &mut program.numbers;
                let rows = if at == rows_at { rows(bytes, at, numbers) } else { None };
                rows.or_else(|| vector(bytes, at, numbers))
                    .unwrap_or_else(|| or_equal(bytes, at, Mark::Less, Mark::LessEqual))
            }
            b'>' => or_equal(bytes, at, Mark::Greater, Mark::GreaterEqual),
            b'!' => or_equal(bytes, at, Mark::Not, Mark::NotEqual),
            b'0'..=b'9' | b'.' => match number(bytes, at) {
                Some((value, end)) => (Token::Number(value), end),
                None => (Token::Mark(Mark::Dot), at + 1),
            },
            b'"' => match string_end(bytes, at + 1) {
                (end, true) => {
                    program.strings.push(text[at + 1..end].into());
                    (Token::String(program.strings.len() as u32 - 1), end + 1)
                }
                (end, false) => {
                    push(program, Token::BrokenString, at, 1);
                    at = end;
                    continue;
                }
            },
            b'#' => {
                let start = behind_gap(bytes, at + 1);
                let end = word_end(bytes, start);
                match Keyword::from_text(&text[start..end]).and_then(directive_of) {
                    Some(directive) => (Token::Directive(directive, 0), end),
                    None => (Token::Junk('#'), at + 1),
                }
            }
            b')' if skim && behind_parameters(&program.tokens) => {
                push(program, Token::Mark(Mark::CloseParen), at, 1);
                at += 1;
                match body_end(text, at) {
                    Some(end) => (Token::Body, end),
                    None => continue,
                }
            }
            _ => match MARKS[usize::from(byte)] {
                Some(mark) => (Token::Mark(mark), at + 1),
                None => return at,
            },
        };
        push(program, token, at, end - at);
        at = end;
    }
    at
}

#[inline]
fn push(program: &mut Program, token: Token, at: usize, len: usize) {
    program.tokens.push(token);
    program.places.push((at as u32, len as u32));
}

/// The marks of one character that begin no other token.
const MARKS: [Option<Mark>; 256] = {
    use Mark::*;
    let mut marks = [None; 256];
    let all = [
        (b'{', OpenBrace),
        (b'}', CloseBrace),
        (b'(', OpenParen),
        (b')', CloseParen),
        (b'[', OpenBracket),
        (b']', CloseBracket),
        (b'=', Equal),
        (b'&', And),
        (b'|', Or),
        (b'?', Question),
        (b':', Colon),
        (b';', Semicolon),
        (b',', Comma),
        (b'+', Plus),
        (b'-', Minus),
        (b'*', Star),
    ];
    let mut i = 0;
    while i < all.len() {
        marks[all[i].0 as usize] = Some(all[i].1);
        i += 1;
    }
    marks
};

/// A mark and where it ends; the second one if a `=` follows.
fn or_equal(bytes: &[u8], at: usize, alone: Mark, equal: Mark) -> (Token, usize) {
    match bytes.get(at + 1) {
        Some(b'=') => (Token::Mark(equal), at + 2),
        _ => (Token::Mark(alone), at + 1),
    }
}

/// Words whose lists are long.
fn is_list(word: Keyword) -> bool {
    use Keyword::{FaceIndices, NormalIndices, NormalVectors, VertexVectors};
    matches!(word, VertexVectors | NormalVectors | FaceIndices | NormalIndices)
}

/// Where the rows of a list begin whose word ends at `at`: behind `{ 123,`.
fn behind_count(bytes: &[u8], at: usize) -> Option<usize> {
    let at = behind_gap(bytes, at);
    let at = (bytes.get(at) == Some(&b'{')).then(|| behind_gap(bytes, at + 1))?;
    let at = behind_gap(bytes, number(bytes, at)?.1);
    (bytes.get(at) == Some(&b',')).then(|| behind_gap(bytes, at + 1))
}

/// Vectors of three numbers with a comma between each two, before a comma or `}`: their token and where they end. The numbers
/// go to `numbers`.
fn rows(bytes: &[u8], start: usize, numbers: &mut Vec<f64>) -> Option<(Token, usize)> {
    let first = numbers.len();
    let (mut at, mut end) = (start, None);
    while bytes.get(at) == Some(&b'<') {
        let before = numbers.len();
        let Some((Token::Vector(_, count), behind)) = vector(bytes, at, numbers) else { break };
        at = behind_gap(bytes, behind);
        // Not what an operator or a directive may follow.
        if count != 3 || !matches!(bytes.get(at), Some(b',' | b'}')) {
            numbers.truncate(before);
            break;
        }
        end = Some(behind);
        if bytes[at] != b',' {
            break;
        }
        at = behind_gap(bytes, at + 1);
    }
    let token = Token::Rows(first as u32, ((numbers.len() - first) / 3) as u32);
    end.map(|end| (token, end))
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
    // Where what the standard library understands ends.
    let mut spelled = at;
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
        exponent += if negative { -power } else { power };
        // Without digits behind it the letter means nothing, but belongs to the number (measured).
        if behind > from {
            spelled = behind;
        }
        at = behind;
    }
    // 19 digits do not overflow.
    let value = if whole + fraction <= 19 && digits <= 1 << 53 && exponent.abs() <= 22 {
        let power = EXACT_POWERS[exponent.unsigned_abs() as usize];
        if exponent < 0 { digits as f64 / power } else { digits as f64 * power }
    } else {
        std::str::from_utf8(&bytes[start..spelled]).ok()?.parse().unwrap_or(f64::NAN)
    };
    Some((value, at))
}
