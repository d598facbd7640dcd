//! Items of a block that are a word and a value, read by a table of where each value goes.

use super::machine::{Machine, Res};
use super::value::Value;
use crate::lang::{Keyword, Token};
use glam::DVec3;

/// Bounds of a float, both included.
pub(super) type Bounds = (f64, f64);

/// Any finite float.
pub(super) const ANY: Bounds = (f64::NEG_INFINITY, f64::INFINITY);
/// Above 0.
pub(super) const POSITIVE: Bounds = (f64::MIN_POSITIVE, f64::INFINITY);
/// 0 and above, but below 1.
pub(super) const BELOW_ONE: Bounds = (0.0, 1.0 - f64::EPSILON);
/// 0 and above.
pub(super) const NOT_NEGATIVE: Bounds = (0.0, f64::INFINITY);

impl Machine<'_> {
    /// The block behind the word `what`, of items in any order. It starts from the value whose name comes first, if
    /// `named` finds one, else from `base`. `item` reads one item, or says that the next token begins none.
    pub fn block<T>(
        &mut self,
        what: &str,
        named: impl Fn(&Value) -> Option<T>,
        base: T,
        mut item: impl FnMut(&mut Self, &mut T, Keyword) -> Res<bool>,
    ) -> Res<T> {
        self.deeper(|m| {
            let open = m.open(what)?;
            let mut value = m.take_named(named)?.unwrap_or(base);
            while let Some(word) = m.item_word()?
                && item(m, &mut value, word)?
            {}
            m.close(what, open)?;
            Ok(value)
        })
    }

    /// The word that begins an item. A colour may begin with its name: that counts as if `color` stood before.
    fn item_word(&mut self) -> Res<Option<Keyword>> {
        Ok(match self.peek()? {
            Token::Word(word) => Some(word),
            _ if self.starts_color()? => Some(Keyword::Color),
            _ => None,
        })
    }

    /// Takes the next word if it is one of the table's, and reads its value. False if it is none of them.
    fn item<T, E>(
        &mut self,
        table: &mut [E],
        word_of: impl Fn(&E) -> Keyword,
        read: impl FnOnce(&mut Self, &E) -> Res<T>,
        put: impl FnOnce(&mut E, T),
    ) -> Res<bool> {
        let Token::Word(word) = self.peek()? else { return Ok(false) };
        let Some(entry) = table.iter_mut().find(|entry| word_of(entry) == word) else { return Ok(false) };
        self.next()?;
        let value = read(self, entry)?;
        put(entry, value);
        Ok(true)
    }

    /// A word and a float.
    pub fn float_item(&mut self, table: &mut [(Keyword, &mut f64)]) -> Res<bool> {
        self.item(table, |e| e.0, |m, _| m.finite(), |e, value| *e.1 = value)
    }

    /// A word and a float between two bounds.
    pub fn bounded_item(&mut self, table: &mut [(Keyword, &mut f64, Bounds)]) -> Res<bool> {
        self.item(table, |e| e.0, |m, e| m.bounded(e.0, e.2), |e, value| *e.1 = value)
    }

    /// A word and a vector.
    pub fn vector_item(&mut self, table: &mut [(Keyword, &mut DVec3)]) -> Res<bool> {
        self.item(table, |e| e.0, |m, _| m.vector(), |e, value| *e.1 = value)
    }

    /// A word and a colour without filter and transmit.
    pub fn rgb_item(&mut self, table: &mut [(Keyword, &mut DVec3)]) -> Res<bool> {
        self.item(table, |e| e.0, |m, _| m.rgb(), |e, value| *e.1 = value)
    }

    /// A word and `on`, `off`, a number, or nothing, which is on.
    pub fn switch_item(&mut self, table: &mut [(Keyword, &mut bool)]) -> Res<bool> {
        self.item(table, |e| e.0, |m, _| m.switch_value(), |e, value| *e.1 = value)
    }

    /// A word and a string.
    pub fn string_item(&mut self, table: &mut [(Keyword, &mut Option<String>)]) -> Res<bool> {
        self.item(table, |e| e.0, |m, _| m.string(), |e, value| *e.1 = Some(value.to_string()))
    }

    /// The float behind `word`, which has been taken.
    pub fn bounded(&mut self, word: Keyword, (least, most): Bounds) -> Res<f64> {
        let start = self.peek_lexeme()?;
        let value = self.finite()?;
        if least <= value && value <= most {
            return Ok(value);
        }
        let bounds = match (least, most) {
            POSITIVE => "be positive".to_string(),
            BELOW_ONE => "be from 0 to below 1".to_string(),
            NOT_NEGATIVE => "not be negative".to_string(),
            (least, f64::INFINITY) => format!("be at least {least}"),
            (least, most) => format!("be from {least} to {most}"),
        };
        let span = self.span(start).to(self.span(self.last));
        Err(self.error(format!("`{}` must {bounds}, found {value}", word.text()), span))
    }
}
