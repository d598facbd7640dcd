//! `function { ... }` (manual section 3.1.7): kept as text until functions are modelled.

use super::machine::{Lexeme, Machine, Res};
use super::value::{Num, Value};
use crate::lang::{Mark, Token};
use std::sync::Arc;

/// A function that has been declared.
#[derive(Debug)]
pub(super) struct Function {
    at: Lexeme,
}

impl Machine<'_> {
    /// What stands behind `function`.
    pub fn function(&mut self) -> Res<Value> {
        let at = self.last;
        if self.peek()? == Token::Mark(Mark::OpenParen) {
            while self.next()?.token != Token::Mark(Mark::CloseParen) {
                if self.peek()? == Token::End {
                    return self.expected("`)`");
                }
            }
        }
        self.block_left_out("function")?;
        Ok(Value::Function(Arc::new(Function { at })))
    }

    /// A call of one.
    pub fn call_function(&mut self, function: &Function) -> Res<Num> {
        let message = "not modelled yet: a call of a `function`";
        Err(self.error(message, self.span(function.at)))
    }
}
