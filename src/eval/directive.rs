//! Directives: what each does when evaluation meets it (manual section 3.2).

use super::compiled::Level;
use super::machine::{FrameKind, Lexeme, Loop, Machine, Res, Stop};
use super::scope::Place;
use super::value::{Num, Value};
use super::{Message, Stream};
use crate::lang::{Diagnostic, Directive, Mark, Token};

/// Floats nearer than this are equal to `=`, `#case` and the last turn of `#for` (measured: 1e-11 is, 1e-9 is not).
pub(super) const EQUAL_WITHIN: f64 = 1e-10;

impl Machine<'_> {
    /// Carries out the directive at hand if that takes no reading: the end of a branch or a `#while`, or one whose
    /// expression has been compiled. Nothing but speed: what it does is what [`Machine::directive`] does.
    #[inline]
    pub fn quick_directive(&mut self, directive: Directive, jump: u32) -> bool {
        match directive {
            Directive::EndBranch => self.jump(self.at + 1),
            Directive::EndWhile => self.jump_back(jump),
            Directive::EndFor => return self.quick_end_for(),
            Directive::Declare => return self.quick_declare(false).is_some(),
            Directive::Local => return self.quick_declare(true).is_some(),
            Directive::While | Directive::If => {
                if let Token::Directive(Directive::Elseif, _) = self.text.tokens[jump as usize] {
                    return false;
                }
                match self.quick_condition() {
                    None => return false,
                    Some(true) => {}
                    Some(false) => self.jump(jump + 1),
                }
            }
            _ => return false,
        }
        true
    }

    /// The end of a turn of `#for` whose variable is a float as it was.
    fn quick_end_for(&mut self) -> bool {
        let Some(&Loop { symbol, step, body, .. }) = self.loops.last() else { return false };
        let Some(value) = self.scopes.float(symbol) else { return false };
        if self.scopes.older_than_blocks(symbol).is_some() {
            return false;
        }
        let exit = self.at + 1;
        let value = value + step;
        self.scopes.declare(symbol, Value::Number(Num::float(value)));
        self.jump_back(body);
        self.turn(value, exit);
        true
    }

    /// `(condition)` that has been compiled and is a float.
    fn quick_condition(&mut self) -> Option<bool> {
        let Token::Mark(Mark::OpenParen) = *self.text.tokens.get(self.at as usize + 1)? else { return None };
        let before = (self.at, self.steps);
        let value = self.compiled_between(self.at + 2, Level::Choice, Mark::CloseParen)?;
        if value.n != 1 {
            // An error that the reader tells; a condition that draws random numbers and is a vector may draw twice.
            self.steps = before.1;
            self.jump(before.0);
            return None;
        }
        Some(value.is_true())
    }

    /// Carries out one directive; its word has been taken.
    pub fn directive(&mut self, directive: Directive, jump: u32, at: Lexeme) -> Res<()> {
        self.last = at;
        match directive {
            Directive::If => {
                let holds = self.condition()?;
                self.branch(holds, jump)
            }
            Directive::Ifdef | Directive::Ifndef => {
                let declared = self.is_declared()?;
                self.branch(declared == (directive == Directive::Ifdef), jump)
            }
            // Met by falling out of the branch before: the rest is not for us.
            Directive::Elseif | Directive::Else => {
                let end = self.chain_end(at.program, at.index);
                self.jump(end + 1);
                Ok(())
            }
            // In a branch that is passed over, as in POV-Ray, it is none.
            Directive::LateBranch => {
                let stop = self.error("expected `#end`: its `#if` has had its `#else`", self.span(at));
                self.report(stop);
                let end = self.chain_end(at.program, at.index);
                self.jump(end + 1);
                Ok(())
            }
            Directive::EndBranch | Directive::SwitchElse => Ok(()),
            Directive::While => {
                if !self.condition()? {
                    self.jump(jump + 1);
                }
                Ok(())
            }
            Directive::EndWhile => {
                self.jump_back(jump);
                Ok(())
            }
            Directive::For => self.begin_for(jump),
            Directive::EndFor => self.next_for(at),
            Directive::Break => {
                match self.programs[at.program as usize].tokens[jump as usize] {
                    // Whoever meets the end of a macro leaves it.
                    Token::Directive(Directive::EndMacro, _) => self.jump(jump),
                    Token::Directive(Directive::EndFor, _) => {
                        self.loops.pop();
                        self.jump(jump + 1);
                    }
                    _ => self.jump(jump + 1),
                }
                Ok(())
            }
            Directive::Switch => self.switch(jump),
            Directive::Case | Directive::Range => match self.switch_before(at.index) {
                Some(value) => self.choose_case(value, at.index),
                // Met by falling through from the case before: its bounds do not matter.
                None if directive == Directive::Case => self.condition_value().map(|_| ()),
                None => self.range().map(|_| ()),
            },
            Directive::Macro => self.define_macro(jump, at),
            Directive::EndMacro => {
                self.leave_frame();
                Ok(())
            }
            Directive::Declare => self.declare(false),
            Directive::Local => self.declare(true),
            Directive::Undef => {
                let (symbol, at) = self.raw_name("undef")?;
                self.before_change(symbol)?;
                if self.peek_raw() == Token::Mark(Mark::OpenBracket) {
                    let place = self.element(symbol, at)?;
                    self.charge(self.scopes.copied_by_write(&place))?;
                    self.scopes.clear_at(&place);
                } else {
                    if self.scopes.get(symbol).is_none() {
                        let message =
                            format!("there is no `{}` that could be forgotten", self.symbols.name(symbol));
                        self.warn("undef", message, self.span(self.last));
                    }
                    self.scopes.undef(symbol);
                }
                self.optional_semicolon();
                Ok(())
            }
            Directive::Include => self.include(at),
            Directive::Version => self.set_version(),
            Directive::Default => self.set_default(),
            Directive::Debug => self.write_message(Stream::Debug),
            Directive::Warning => self.write_message(Stream::Warning),
            Directive::Render | Directive::Statistics => {
                let message = format!("`#{}` writes to the stream of `#debug`", directive.name());
                self.warn("old stream", message, self.span(at));
                let render = directive == Directive::Render;
                self.write_message(if render { Stream::Render } else { Stream::Statistics })
            }
            Directive::Error => {
                let text = self.string()?;
                self.say(Stream::Error, text.to_string());
                let message = format!("the scene says: {}", text.trim());
                Err(Stop::Halt(Some(Box::new(Diagnostic::error(message, self.span(at))))))
            }
            Directive::Fopen => self.fopen(at),
            Directive::Fclose => self.fclose(at),
            Directive::Read => self.read_data(),
            Directive::Write => self.write_data(),
        }
    }

    // ----------------------------------------------------------------------------------------------------------
    // Branches

    /// The number in parentheses after `#if`, `#while` and the like. Nothing after its `)` is looked at: it belongs
    /// to the branch.
    pub fn condition_value(&mut self) -> Res<Num> {
        self.in_parentheses(Self::expect, Self::choice)
    }

    /// What stands in the parentheses of a directive that jumps, of which `open` takes the first. An error if directives in
    /// them have led out of the text that they began in: the jump means nothing elsewhere.
    fn in_parentheses<T, O>(
        &mut self,
        open: impl FnOnce(&mut Self, Mark) -> Res<O>,
        read: impl FnOnce(&mut Self) -> Res<T>,
    ) -> Res<T> {
        let program = self.program;
        open(self, Mark::OpenParen)?;
        let value = read(self)?;
        self.expect(Mark::CloseParen)?;
        match self.program == program {
            true => Ok(value),
            false => {
                Err(self.error_here("expected `)` before the end of the file or macro that the `(` is in"))
            }
        }
    }

    fn condition(&mut self) -> Res<bool> {
        let value = self.condition_value()?;
        if value.n != 1 {
            return Err(self.error_here("expected a float as condition, found a vector"));
        }
        Ok(value.is_true())
    }

    /// What `#switch` and `#case` compare.
    fn compared_value(&mut self) -> Res<f64> {
        let value = self.condition_value()?;
        if value.n != 1 {
            return Err(self.error_here("`#switch` compares floats, found a vector"));
        }
        Ok(value.v[0])
    }

    /// `(Name)` or `(Name[i])`.
    fn is_declared(&mut self) -> Res<bool> {
        self.in_parentheses(Self::expect_raw, |m| {
            Ok(match m.named_place()? {
                Some(place) => m.is_there(m.scopes.at(&place)),
                None => false,
            })
        })
    }

    /// The place that `Name` or `Name[i]` means, if there is one; `None` for a word of the language or a literal too.
    pub fn named_place(&mut self) -> Res<Option<Place>> {
        let expand = std::mem::replace(&mut self.expand, false);
        let lexeme = self.next();
        self.expand = expand;
        let mut place = match lexeme?.token {
            Token::Name(symbol) => self.scopes.place(symbol),
            Token::Word(_) | Token::Number(_) | Token::Vector(..) | Token::String(_) => return Ok(None),
            _ => return Err(self.error_here("expected an identifier")),
        };
        while self.peek()? == Token::Mark(Mark::OpenBracket) {
            let array = place.as_ref().and_then(|p| self.scopes.at(p)).cloned();
            let index = self.subscripts(array.as_ref())?;
            place = match (place, index) {
                (Some(mut place), Some(index)) => {
                    place.path.push(index);
                    Some(place)
                }
                _ => None,
            };
        }
        Ok(place)
    }

    /// A value that counts as declared: any but a file that is closed.
    pub fn is_there(&self, value: Option<&Value>) -> bool {
        match value {
            Some(Value::File(handle)) => self.data_files.is_open(*handle),
            value => value.is_some(),
        }
    }

    /// An opening parenthesis after which a name is wanted as it stands.
    pub fn expect_raw(&mut self, mark: Mark) -> Res<()> {
        let expand = std::mem::replace(&mut self.expand, false);
        let result = self.expect(mark);
        self.expand = expand;
        result.map(|_| ())
    }

    /// Goes on here if `holds`, else at the next branch that does.
    fn branch(&mut self, mut holds: bool, mut jump: u32) -> Res<()> {
        while !holds {
            let next = self.text.tokens[jump as usize];
            self.jump(jump + 1);
            let Token::Directive(Directive::Elseif, next) = next else { break };
            (holds, jump) = (self.condition()?, next);
        }
        Ok(())
    }

    /// The `#end` of the chain of branches that the one at `index` belongs to.
    fn chain_end(&self, program: u32, mut index: u32) -> u32 {
        let tokens = &self.programs[program as usize].tokens;
        while let Token::Directive(Directive::Elseif | Directive::Else | Directive::LateBranch, jump) =
            tokens[index as usize]
        {
            index = jump;
        }
        index
    }

    /// What stands between a `#switch` and its first `#case` belongs to no case and is carried out whatever the value is
    /// (measured).
    fn switch(&mut self, first: u32) -> Res<()> {
        let value = self.compared_value()?;
        if !matches!(
            self.text.tokens[first as usize],
            Token::Directive(Directive::Case | Directive::Range, _)
        ) {
            let message = "expected `#case` or `#range` as the first branch of the `#switch`";
            let stop = self.error(message, self.text.span(first as usize));
            self.report(stop);
        }
        if self.at == first {
            return self.choose_case(value, first);
        }
        // A `#break` in that text may have left the same `#switch` before.
        self.switch_before(first);
        if let Some(frame) = self.frames.last_mut() {
            frame.switches.push((first, value));
        }
        Ok(())
    }

    /// The value of the `#switch` under way whose first `#case` is the token at `first`, and forgets it.
    fn switch_before(&mut self, first: u32) -> Option<f64> {
        let switches = &mut self.frames.last_mut()?.switches;
        let found = switches.iter().rposition(|(case, _)| *case == first)?;
        let value = switches[found].1;
        switches.truncate(found);
        Some(value)
    }

    /// Goes on behind the first `#case` or `#range`, from the token at `jump` on, that the value fits.
    fn choose_case(&mut self, value: f64, mut jump: u32) -> Res<()> {
        loop {
            let branch = self.text.tokens[jump as usize];
            self.jump(jump + 1);
            let (matches, next) = match branch {
                Token::Directive(Directive::Case, next) => {
                    ((self.compared_value()? - value).abs() < EQUAL_WITHIN, next)
                }
                Token::Directive(Directive::Range, next) => {
                    let (low, high) = self.range()?;
                    (low <= value && value <= high, next)
                }
                _ => return Ok(()),
            };
            if matches {
                return Ok(());
            }
            jump = next;
        }
    }

    fn range(&mut self) -> Res<(f64, f64)> {
        self.in_parentheses(Self::expect, |m| {
            let low = m.float()?;
            m.comma()?;
            Ok((low, m.float()?))
        })
    }

    // ----------------------------------------------------------------------------------------------------------
    // Loops

    fn begin_for(&mut self, end: u32) -> Res<()> {
        let (symbol, first, last, step) = self.in_parentheses(Self::expect_raw, |m| {
            let (symbol, _) = m.raw_name("for")?;
            m.comma()?;
            let first = m.float()?;
            m.comma()?;
            let last = m.float()?;
            m.comma()?;
            let step = if m.peek()? == Token::Mark(Mark::CloseParen) { 1.0 } else { m.float()? };
            if step.abs() < EQUAL_WITHIN {
                return Err(m.error_here("the step of `#for` must not be 0"));
            }
            Ok((symbol, first, last, step))
        })?;
        self.before_change(symbol)?;
        // A local of the macro or include that the loop is in, whatever there is outside of it (measured).
        self.scopes.local(symbol, Value::Number(Num::float(first)));
        let body = self.at;
        self.loops.push(Loop { symbol, last, step, body });
        self.turn(first, end + 1);
        Ok(())
    }

    fn next_for(&mut self, at: Lexeme) -> Res<()> {
        let Some(&Loop { symbol, step, body, .. }) = self.loops.last() else { return Ok(()) };
        let value = match self.scopes.get(symbol) {
            Some(Value::Number(num)) => num.v[0] + step,
            _ => return Err(self.error_here("the variable of `#for` is no float any more")),
        };
        self.before_change(symbol)?;
        self.scopes.declare(symbol, Value::Number(Num::float(value)));
        self.jump_back(body);
        self.turn(value, at.index + 1);
        Ok(())
    }

    /// Leaves the loop if the variable is past its end.
    fn turn(&mut self, value: f64, exit: u32) {
        let Some(Loop { last, step, .. }) = self.loops.last() else { return };
        let go_on = if *step > 0.0 { value < last + EQUAL_WITHIN } else { value > last - EQUAL_WITHIN };
        if !go_on {
            self.loops.pop();
            self.jump(exit);
        }
    }

    // ----------------------------------------------------------------------------------------------------------
    // The rest

    fn include(&mut self, at: Lexeme) -> Res<()> {
        let name = self.file_name()?;
        let program = self.find_include(&name, at)?;
        self.enter_frame(program, 0, FrameKind::Include, Some(at))
    }

    fn set_version(&mut self) -> Res<()> {
        self.note_late_version();
        // Old scenes have no semicolon here: the directives behind are for the version that this one says.
        let plain = matches!(self.peek_raw(), Token::Number(_));
        let before = self.version;
        if plain {
            self.version = 1.0;
        }
        let version = self.float();
        self.version = before;
        let version = version?;
        self.optional_semicolon();
        if !(1.0..=3.8).contains(&version) {
            let message = format!("expected a version of POV-Ray up to 3.8, found {version}");
            let span = self.span(self.last);
            self.warn("version", message, span);
        }
        self.version = version;
        self.version_set = true;
        Ok(())
    }

    /// What `version` reads: 3.7 as long as nobody has set it.
    pub fn version_read(&self) -> f64 {
        if self.version_set { self.version } else { 3.7 }
    }

    fn write_message(&mut self, stream: Stream) -> Res<()> {
        let text = self.string()?;
        // An empty text is kept too, and the list of texts may have room for twice as many.
        self.charge(text.len() + 2 * size_of::<Message>())?;
        self.say(stream, text.to_string());
        Ok(())
    }
}
