//! Text to tokens: the reading half of the scene language.
//!
//! In comes the text of a file, out goes a [`Program`]: its tokens with their places, directives paired with their
//! `#end`. Knows the words of the language and where directives nest; does not know values, geometry or files.
//! The grammar itself is `grammar/scene.pest`, which can be read as the language's manual.

mod diagnostic;
mod ends;
mod keyword;
mod nest;
mod plain;
mod program;
mod read;
mod skim;
mod source;
mod symbol;

pub use diagnostic::{Diagnostic, Severity};
pub use keyword::Keyword;
pub use program::{Directive, Mark, Program, Token};
pub use read::{Manner, read, read_part};
pub use source::{FileId, SourceFile, SourceMap, Span};
pub use symbol::{Symbol, Symbols};
