//! Strings (manual section 3.1.8).

use super::machine::{Machine, Res, Stop};
use super::value::{Num, Value};
use crate::lang::{Keyword, Mark, Token};
use chrono::format::StrftimeItems;
use std::fmt::Write;
use std::sync::Arc;

/// Characters of the longest number that POV-Ray writes; it takes a shorter form for a longer one.
const LONGEST_NUMBER: usize = 254;

/// 2000-01-01 00:00:00 UTC, in seconds since 1970.
const YEAR_2000: f64 = 946_684_800.0;

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
                let text = self.programs[lexeme.program as usize].strings[index as usize].clone();
                if path {
                    return Ok(text);
                }
                if let Some(odd) = text.chars().find(|c| self.ascii && !c.is_ascii()) {
                    let message = format!("`{odd}` is no ASCII: POV-Ray has blanks for it");
                    self.warn("not ASCII", message, self.span(lexeme));
                }
                unescaped(&text).map_err(|why| self.error(why, self.span(lexeme)))
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
                let start = self.peek_lexeme()?;
                let code = self.float()?.trunc();
                if !(0.0..=65535.0).contains(&code) {
                    let span = self.span(start).to(self.span(self.last));
                    return Err(
                        self.error(format!("expected a character's code of 0 to 65535, found {code}"), span)
                    );
                }
                match code as u32 {
                    // The end of the string.
                    0 => String::new(),
                    code => char::from_u32(code).unwrap_or(char::REPLACEMENT_CHARACTER).into(),
                }
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
                // A float is the first component (measured).
                let value = self.expr()?.v;
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
                if start.trunc() == 0.0 {
                    let message = "`substr` counts characters from 1: from 0 on it gives nothing";
                    self.warn("substr from 0", message, self.span(self.last));
                    self.expect(Mark::CloseParen)?;
                    return Ok(String::new());
                }
                if !(start >= 1.0 && len >= 0.0 && start + len - 1.0 <= count) {
                    let message =
                        format!("the string has {count} characters, found `substr` of {start}, {len}");
                    return Err(self.error_here(message));
                }
                text.chars().skip(start as usize - 1).take(len as usize).collect()
            }
            _ => self.date_and_time()?,
        };
        self.expect(Mark::CloseParen)?;
        Ok(text)
    }

    /// `datetime(days since 2000, format)`: the format is that of C's `strftime`, the time UTC.
    fn date_and_time(&mut self) -> Res<String> {
        let start = self.peek_lexeme()?;
        let days = self.float()?;
        let format: Arc<str> = match self.accept(Mark::Comma)? {
            true => self.string()?,
            false => "%Y-%m-%d %H:%M:%SZ".into(),
        };
        let span = self.span(start).to(self.span(self.last));
        let Some(date) = chrono::DateTime::from_timestamp((YEAR_2000 + days * 86400.0).floor() as i64, 0)
        else {
            return Err(self.error(format!("there is no date {days} days after 2000-01-01"), span));
        };
        let items: Vec<_> = StrftimeItems::new(&format).collect();
        let mut text = String::new();
        let written = write!(text, "{}", date.format_with_items(items.iter()));
        if items.is_empty() || written.is_err() {
            return Err(self.error("expected a format such as \"%Y-%m-%d %H:%M:%S\"", span));
        }
        Ok(text)
    }
}

/// True if the word begins a string.
pub(super) fn is_string_function(word: Keyword) -> bool {
    use Keyword as K;
    matches!(word, K::Concat | K::Chr | K::Str | K::Vstr | K::Strlwr | K::Strupr | K::Substr | K::Datetime)
}

/// As C's `printf` with `%*.*f`; a negative number of digits means six, a width below 0 fills with zeros
/// (manual section 3.1.8.2). What is too long for POV-Ray's buffer is written as by `%*.*g`, or not at all (measured).
pub(super) fn format_number(value: f64, width: f64, digits: f64) -> String {
    let digits = if digits < 0.0 { 6 } else { digits.min(1000.0) as usize };
    let fill = width.abs().min(1000.0) as usize;
    if !value.is_finite() {
        let text = if value.is_nan() { "nan" } else { "inf" };
        let sign = if value.is_sign_negative() { "-" } else { "" };
        return format!("{:>fill$}", format!("{sign}{text}"));
    }
    let text = if width < 0.0 { format!("{value:0fill$.digits$}") } else { format!("{value:fill$.digits$}") };
    if text.len() <= LONGEST_NUMBER {
        return text;
    }
    let text = general(value, digits);
    let zeros = fill.saturating_sub(text.len());
    let text = match text.strip_prefix('-') {
        _ if width >= 0.0 => format!("{text:>fill$}"),
        Some(digits) => format!("-{:0>zeros$}{digits}", ""),
        None => format!("{:0>zeros$}{text}", ""),
    };
    if text.len() <= LONGEST_NUMBER { text } else { "<invalid>".into() }
}

/// As C's `%.*g`: so many digits in all, without needless zeros, with an exponent where it is shorter.
pub(super) fn general(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return format_number(value, 0.0, 0.0);
    }
    let behind_first = digits.max(1) - 1;
    let scientific = format!("{value:.behind_first$e}");
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let trimmed = |text: &str| match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_string(),
        false => text.to_string(),
    };
    if (-4..=behind_first as i32).contains(&exponent) {
        trimmed(&format!("{value:.*}", (behind_first as i32 - exponent) as usize))
    } else {
        let sign = if exponent < 0 { '-' } else { '+' };
        format!("{}e{sign}{:02}", trimmed(mantissa), exponent.abs())
    }
}

/// A literal's text with its escapes resolved, or what is wrong with them.
pub(super) fn unescaped(text: &Arc<str>) -> Result<Arc<str>, String> {
    if text.contains('\\') { unescape(text).map(Into::into) } else { Ok(text.clone()) }
}

fn unescape(text: &str) -> Result<String, String> {
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
                let code: String = chars.by_ref().take(4).collect();
                let digits = code.len() == 4 && code.bytes().all(|b| b.is_ascii_hexdigit());
                match u32::from_str_radix(&code, 16) {
                    Ok(code) if digits => {
                        out.push(char::from_u32(code).unwrap_or(char::REPLACEMENT_CHARACTER))
                    }
                    _ => return Err(format!("expected four hexadecimal digits after `\\u`, found `{code}`")),
                }
            }
            Some(same @ ('\\' | '"' | '\'')) => out.push(same),
            Some(other) => {
                return Err(format!(
                    "there is no escape `\\{}` in strings: for a backslash write two",
                    other.escape_debug()
                ));
            }
            None => {}
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::general;

    #[test]
    fn numbers_are_written_as_c_s_percent_g() {
        for (value, expected) in [
            (1.0, "1"),
            (1.5, "1.5"),
            (-2.25e-7, "-2.25e-07"),
            (1e20, "1e+20"),
            (std::f64::consts::PI, "3.14159"),
            (123456789.123, "1.23457e+08"),
            (0.0001, "0.0001"),
            (999999.5, "1e+06"),
            (100000.0, "100000"),
            (0.0, "0"),
        ] {
            assert_eq!(general(value, 6), expected);
        }
    }
}
