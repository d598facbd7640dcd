//! Files that a script itself reads and writes: `#fopen`, `#read`, `#write`, `#fclose` (manual section 3.2.4).
//!
//! What a script writes stays in memory, where it can read it again, unless the user has named the folder it lies in
//! ([`super::Options::write_paths`]): a scene from a stranger must not touch the disk.

use super::files::{Found, PROGRAM_BYTES, read_text};
use super::machine::{Lexeme, Machine, Res};
use super::string::general;
use super::value::{Num, Value};
use crate::file_io::{folder_of, replace_file};
use crate::lang::{Keyword, Manner, Mark, Program, Symbol, Token, read};
use rustc_hash::FxHashMap;
use std::path::PathBuf;
use std::sync::Arc;

/// Bytes of the longest file that a script may write.
const LONGEST: usize = 1 << 28;

/// Digits of the numbers that `#write` writes.
const DIGITS: usize = 6;

/// All files that the script has opened, and the texts that it has written.
#[derive(Debug, Default)]
pub(super) struct DataFiles {
    /// By handle; `None` when closed.
    handles: Vec<Option<DataFile>>,
    /// Texts of files that were written and closed, by the name the script gave them.
    written: FxHashMap<Arc<str>, String>,
}

#[derive(Debug)]
enum DataFile {
    /// The file's tokens, and which one is next.
    Reading { program: Arc<Program>, next: usize },
    /// What has been written so far.
    Writing { name: Arc<str>, text: String },
}

impl DataFiles {
    /// True if the handle is open. At the end of what it reads, a handle closes by itself.
    pub fn is_open(&self, handle: u32) -> bool {
        self.handles.get(handle as usize).is_some_and(Option::is_some)
    }

    /// What the script has written under this name.
    pub fn written(&self, name: &str) -> Option<&str> {
        self.written.get(name).map(String::as_str)
    }

    /// The name, if the script has written a file of it.
    pub fn written_name(&self, name: &str) -> Option<&Arc<str>> {
        self.written.get_key_value(name).map(|(name, _)| name)
    }
}

impl Machine<'_> {
    /// `#fopen Name "file" read`; the directive has been taken.
    pub fn fopen(&mut self, at: Lexeme) -> Res<()> {
        let (symbol, _) = self.raw_name("fopen")?;
        let name = self.file_name()?;
        let file = match self.next()?.token {
            Token::Word(Keyword::Read) => {
                let program = self.data_tokens(&name, at)?;
                let ended = program.tokens.first() == Some(&Token::End);
                (!ended).then_some(DataFile::Reading { program, next: 0 })
            }
            Token::Word(word @ (Keyword::Write | Keyword::Append)) => {
                let before = match word {
                    Keyword::Append => self.data_text(&name)?,
                    _ => None,
                };
                let text = before.unwrap_or_default();
                self.charge(text.len())?;
                Some(DataFile::Writing { name, text })
            }
            _ => return Err(self.error_here("expected `read`, `write` or `append`")),
        };
        let handle = self.data_files.handles.len() as u32;
        self.data_files.handles.push(file);
        self.before_change(symbol)?;
        self.scopes.declare(symbol, Value::File(handle));
        Ok(())
    }

    /// `#fclose Name`.
    pub fn fclose(&mut self, at: Lexeme) -> Res<()> {
        let (symbol, _) = self.raw_name("fclose")?;
        // Closing what is not open is no mistake (measured).
        if let Some(Value::File(handle)) = self.scopes.get(symbol) {
            let handle = *handle;
            self.close_data_file(handle, at);
        }
        self.optional_semicolon();
        Ok(())
    }

    /// Closes what the script has left open at its end.
    pub fn close_data_files(&mut self) {
        for handle in 0..self.data_files.handles.len() as u32 {
            self.close_data_file(handle, self.last);
        }
    }

    fn close_data_file(&mut self, handle: u32, at: Lexeme) {
        let file = self.data_files.handles.get_mut(handle as usize).and_then(Option::take);
        let Some(DataFile::Writing { name, text }) = file else { return };
        match self.writable(&name) {
            None => self.ignore("#write to a file (kept in memory; --allow-write lets it)", at),
            Some(path) => {
                if let Err(error) = replace_file(&path, text.as_bytes()) {
                    let stop = self.error(error.to_string(), self.span(at));
                    self.report(stop);
                }
            }
        }
        // An `#include` of it from now on reads what it holds now.
        self.program_of.remove(&self.beside_scene(&name));
        self.data_files.written.insert(name, text);
    }

    /// Where a file may be written, if anywhere: in or below one of the folders that the user has named.
    fn writable(&self, name: &str) -> Option<PathBuf> {
        let path = self.beside_scene(name);
        let file = folder_of(&path).canonicalize().ok()?.join(path.file_name()?);
        // A link is as good as what it leads to.
        let file = file.canonicalize().unwrap_or(file);
        let allowed = |root: &PathBuf| root.canonicalize().is_ok_and(|root| file.starts_with(root));
        self.options.write_paths.iter().any(allowed).then_some(file)
    }

    /// `#write (Name, value, ...)`.
    pub fn write_data(&mut self) -> Res<()> {
        self.expect(Mark::OpenParen)?;
        let handle = self.data_handle("write")?;
        while self.accept(Mark::Comma)? || self.peek()? != Token::Mark(Mark::CloseParen) {
            let piece = if self.begins_string()? {
                self.string()?.to_string()
            } else {
                let value = self.expr()?;
                match value.n {
                    1 => general(value.v[0], DIGITS),
                    n => {
                        let parts: Vec<_> =
                            value.v[..usize::from(n)].iter().map(|v| general(*v, DIGITS)).collect();
                        // With a blank behind, as POV-Ray writes it.
                        format!("<{}> ", parts.join(","))
                    }
                }
            };
            self.charge(piece.len())?;
            match self.data_files.handles.get_mut(handle as usize) {
                Some(Some(DataFile::Writing { text, .. })) if text.len() + piece.len() <= LONGEST => {
                    text.push_str(&piece);
                }
                Some(Some(DataFile::Writing { .. })) => {
                    return Err(self.halt(format!("stopped: a file of more than {LONGEST} bytes")));
                }
                _ => return Err(self.error_here("the file is not open for writing")),
            }
        }
        self.expect(Mark::CloseParen)?;
        Ok(())
    }

    /// `#read (Name, A, B, ...)`. When its last value has been read the file closes, and its name is no longer defined.
    pub fn read_data(&mut self) -> Res<()> {
        self.expect_raw(Mark::OpenParen)?;
        let handle = self.data_handle("read")?;
        loop {
            self.comma()?;
            if self.accept(Mark::CloseParen)? {
                return Ok(());
            }
            let (symbol, at) = self.raw_name("read")?;
            let place = match self.peek_raw() {
                Token::Mark(Mark::OpenBracket) => Some(self.element(symbol, at)?),
                _ => None,
            };
            // The rest of the names stay as they are when the file has ended.
            let Some(value) = self.next_datum(handle)? else { continue };
            self.before_change(symbol)?;
            match place {
                Some(place) => {
                    self.scopes.set_at(&place, value);
                }
                None => self.scopes.declare(symbol, value),
            }
        }
    }

    fn data_handle(&mut self, directive: &str) -> Res<u32> {
        let (symbol, at) = self.raw_name(directive)?;
        match self.scopes.get(symbol) {
            Some(Value::File(handle)) => Ok(*handle),
            Some(other) => {
                let message = format!("expected a file opened by `#fopen`, found {}", other.kind());
                Err(self.error(message, self.span(at)))
            }
            None => self.unknown(symbol, at),
        }
    }

    /// The next number, vector or string of a file, with the comma behind it.
    fn next_datum(&mut self, handle: u32) -> Res<Option<Value>> {
        let Some(slot) = self.data_files.handles.get_mut(handle as usize) else { return Ok(None) };
        let (program, next) = match slot {
            Some(DataFile::Reading { program, next }) => (program.clone(), *next),
            Some(DataFile::Writing { .. }) => return Err(self.error_here("the file is not open for reading")),
            None => return Ok(None),
        };
        let Some((value, after)) = datum(&program, next) else {
            let (line, _) = self.sources.position(program.span(next));
            let message = format!("expected a float, a vector or a string in line {line} of the data file");
            return Err(self.error_here(message));
        };
        let after = after + usize::from(program.tokens[after] == Token::Mark(Mark::Comma));
        self.data_files.handles[handle as usize] =
            (program.tokens[after] != Token::End).then_some(DataFile::Reading { program, next: after });
        Ok(Some(value))
    }

    /// The text of a file that the script has written, or that is on the disk.
    /// `None` if there is none.
    fn data_text(&mut self, name: &str) -> Res<Option<String>> {
        Ok(match self.locate(name) {
            Some(Found::Written(name)) => self.data_files.written(&name).map(str::to_string),
            Some(Found::File { path, .. }) => {
                // Not as if it were empty: `append` would write it anew.
                let bytes = read_text(&path).map_err(|error| self.halt(error.to_string()))?;
                self.files_read.push(path);
                Some(String::from_utf8_lossy(&bytes).into_owned())
            }
            Some(Found::Embedded(_, text)) => Some(text.to_string()),
            None => None,
        })
    }

    fn data_tokens(&mut self, name: &str, at: Lexeme) -> Res<Arc<Program>> {
        let Some(text) = self.data_text(name)? else {
            return Err(self.error(format!("cannot read the file `{name}`"), self.span(at)));
        };
        self.charge(PROGRAM_BYTES + text.len() * 8)?;
        let file = self.sources.add(name, None, text.into_bytes());
        let text = self.sources.file(file).text.clone();
        match read(file, &text, &mut self.symbols, Manner::Whole) {
            Ok(program) => Ok(Arc::new(program)),
            Err(_) => Err(self.error(format!("`{name}` is no file of values"), self.span(at))),
        }
    }
}

/// One value from the token `at` on, and where the next begins.
fn datum(program: &Program, mut at: usize) -> Option<(Value, usize)> {
    let number = |at: &mut usize| {
        let sign = match program.tokens[*at] {
            Token::Mark(mark @ (Mark::Minus | Mark::Plus)) => {
                *at += 1;
                if mark == Mark::Minus { -1.0 } else { 1.0 }
            }
            _ => 1.0,
        };
        match program.tokens[*at] {
            Token::Number(value) => {
                *at += 1;
                Some(sign * value)
            }
            _ => None,
        }
    };
    match program.tokens[at] {
        Token::String(index) => {
            let text = super::string::unescaped(&program.strings[index as usize]).ok()?;
            Some((Value::String(text), at + 1))
        }
        Token::Vector(first, count @ 2..=5) => {
            let mut v = [0.0; 5];
            let numbers = &program.numbers[first as usize..][..usize::from(count)];
            v[..numbers.len()].copy_from_slice(numbers);
            Some((Value::Number(Num { n: count as u8, v }), at + 1))
        }
        Token::Mark(Mark::Less) => {
            at += 1;
            let mut num = Num { n: 0, v: [0.0; 5] };
            while program.tokens[at] != Token::Mark(Mark::Greater) {
                *num.v.get_mut(usize::from(num.n))? = number(&mut at)?;
                num.n += 1;
                at += usize::from(program.tokens[at] == Token::Mark(Mark::Comma));
            }
            (num.n >= 2).then_some((Value::Number(num), at + 1))
        }
        _ => number(&mut at).map(|value| (Value::Number(Num::float(value)), at)),
    }
}

impl Machine<'_> {
    /// The element that `Name[i][j]` means; the name has been taken.
    pub fn element(&mut self, symbol: Symbol, at: Lexeme) -> Res<super::scope::Place> {
        let Some(mut place) = self.scopes.place(symbol) else { return self.unknown(symbol, at) };
        while self.peek_raw() == Token::Mark(Mark::OpenBracket) {
            let array = self.scopes.at(&place).cloned();
            let Some(index) = self.subscripts(array.as_ref())? else {
                let message = format!("`{}` has no such element", self.symbols.name(symbol));
                return Err(self.error(message, self.span(at)));
            };
            place.path.push(index);
        }
        Ok(place)
    }
}
