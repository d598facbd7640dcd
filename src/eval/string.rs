//! Strings (manual section 3.1.8).

use super::machine::{Machine, Res, Stop};
use super::value::{Num, Value};
use crate::lang::{Keyword, Mark, Token};
use std::sync::Arc;

/// Bytes of the longest string; a script that doubles one over and over must be stopped in time.
const LONGEST: usize = 1 << 24;

impl Machine<'_> {
    /// A string literal, name or function.
    pub fn string(&mut self) -> Res<Arc<str>> {
        self.string_or_path(false)
    }

    /// The name of a file: a backslash in it is no escape.
    pub fn file_name(&mut self) -> Res<Arc<str>> {
        self.string_or_path(true)
    }

    /// True if a string is next.
    pub fn begins_string(&mut self) -> Res<bool> {
        Ok(match self.peek()? {
            Token::String(_) => true,
            Token::Word(word) => is_string_function(word),
            Token::Name(symbol) => match self.scopes.get(symbol) {
                Some(Value::String(_)) => true,
                Some(Value::Array(_)) => matches!(self.array_sample(symbol), Some(Value::String(_))),
                _ => false,
            },
            _ => false,
        })
    }

    /// `"a" = S` and the like: strings compare by their characters' codes.
    pub fn string_relation(&mut self) -> Res<Num> {
        let left = self.string()?;
        let Token::Mark(mark) = self.peek()? else { return self.expected("a comparison of strings") };
        use std::cmp::Ordering;
        let holds: fn(Ordering) -> bool = match mark {
            Mark::Less => Ordering::is_lt,
            Mark::LessEqual => Ordering::is_le,
            Mark::Equal => Ordering::is_eq,
            Mark::NotEqual => Ordering::is_ne,
            Mark::GreaterEqual => Ordering::is_ge,
            Mark::Greater => Ordering::is_gt,
            _ => return self.expected("a comparison of strings"),
        };
        self.next()?;
        let right = self.string()?;
        Ok(Num::float(f64::from(holds(left.cmp(&right)))))
    }

    fn string_or_path(&mut self, path: bool) -> Res<Arc<str>> {
        match self.peek()? {
            Token::String(index) => {
                let lexeme = self.next()?;
                let text = &self.programs[lexeme.program as usize].strings[index as usize];
                Ok(if path { text.clone() } else { unescaped(text) })
            }
            Token::Name(_) => {
                let lexeme = self.next()?;
                match self.name_value(lexeme)? {
                    Value::String(text) => Ok(text),
                    Value::Poison => Err(Stop::Silent),
                    other => {
                        let message = format!("expected a string, found {}", other.kind());
                        Err(self.error(message, self.span(lexeme)))
                    }
                }
            }
            Token::Word(word) if is_string_function(word) => {
                self.next()?;
                let text = self.deeper(|m| m.string_call(word, path))?;
                self.charge(text.len())?;
                Ok(text.into())
            }
            _ => self.expected("a string"),
        }
    }

    fn string_call(&mut self, word: Keyword, path: bool) -> Res<String> {
        self.expect(Mark::OpenParen)?;
        let text = match word {
            Keyword::Concat => {
                let mut text = self.string_or_path(path)?.to_string();
                while self.peek()? != Token::Mark(Mark::CloseParen) {
                    self.comma()?;
                    text.push_str(&self.string_or_path(path)?);
                    if text.len() > LONGEST {
                        return Err(self.halt(format!("stopped: a string of more than {LONGEST} bytes")));
                    }
                }
                text
            }
            Keyword::Chr => {
                let code = self.float()?;
                char::from_u32(code as u32).map_or(String::new(), String::from)
            }
            Keyword::Str => {
                let value = self.float()?;
                self.comma()?;
                let width = self.float()?;
                self.comma()?;
                let digits = self.float()?;
                format_number(value, width, digits)
            }
            Keyword::Vstr => {
                let count = self.float()?.clamp(2.0, 5.0) as usize;
                self.comma()?;
                let value = self.expr()?.promoted(count as u8);
                self.comma()?;
                let between = self.string()?;
                self.comma()?;
                let width = self.float()?;
                self.comma()?;
                let digits = self.float()?;
                let parts: Vec<String> =
                    value[..count].iter().map(|v| format_number(*v, width, digits)).collect();
                parts.join(&between)
            }
            Keyword::Strlwr => self.string()?.to_lowercase(),
            Keyword::Strupr => self.string()?.to_uppercase(),
            Keyword::Substr => {
                let text = self.string()?;
                self.comma()?;
                let start = self.float()?;
                self.comma()?;
                let len = self.float()?;
                let count = text.chars().count() as f64;
                if !(start >= 1.0 && len >= 0.0 && start + len - 1.0 <= count) {
                    let message =
                        format!("the string has {count} characters, found `substr` of {start}, {len}");
                    return Err(self.error_here(message));
                }
                text.chars().skip(start as usize - 1).take(len as usize).collect()
            }
            // `datetime` would make a scene mean something else every second.
            _ => {
                self.float()?;
                if self.accept(Mark::Comma)? {
                    self.string()?;
                }
                "1970-01-01 00:00:00Z".into()
            }
        };
        self.expect(Mark::CloseParen)?;
        Ok(text)
    }
}

/// True if the word begins a string.
pub(super) fn is_string_function(word: Keyword) -> bool {
    use Keyword as K;
    matches!(word, K::Concat | K::Chr | K::Str | K::Vstr | K::Strlwr | K::Strupr | K::Substr | K::Datetime)
}

/// As C's `printf` with `%*.*f`; a negative number of digits means six, a width below 0 fills with zeros
/// (manual section 3.1.8.2).
pub(super) fn format_number(value: f64, width: f64, digits: f64) -> String {
    let digits = if digits < 0.0 { 6 } else { digits.min(100.0) as usize };
    let fill = width.abs().min(1000.0) as usize;
    if !value.is_finite() {
        let text = if value.is_nan() { "nan" } else { "inf" };
        let sign = if value.is_sign_negative() { "-" } else { "" };
        return format!("{:>fill$}", format!("{sign}{text}"));
    }
    if width < 0.0 { format!("{value:0fill$.digits$}") } else { format!("{value:fill$.digits$}") }
}

/// A literal's text with its escapes resolved.
pub(super) fn unescaped(text: &Arc<str>) -> Arc<str> {
    if text.contains('\\') { unescape(text).into() } else { text.clone() }
}

fn unescape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut chars = text.chars();
    while let Some(c) = chars.next() {
        if c != '\\' {
            out.push(c);
            continue;
        }
        match chars.next() {
            Some('a') => out.push('\u{7}'),
            Some('b') => out.push('\u{8}'),
            Some('f') => out.push('\u{c}'),
            Some('n') => out.push('\n'),
            Some('r') => out.push('\r'),
            Some('t') => out.push('\t'),
            Some('v') => out.push('\u{b}'),
            Some('u') => {
                let code: String = chars.clone().take(4).collect();
                match u32::from_str_radix(&code, 16).ok().and_then(char::from_u32) {
                    Some(c) if code.len() == 4 => {
                        out.push(c);
                        chars.nth(3);
                    }
                    _ => out.push('u'),
                }
            }
            Some(other) => out.push(other),
            None => {}
        }
    }
    out
}
