//! The texts that diagnostics point into.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

/// Index of a file in its [`SourceMap`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct FileId(pub u32);

/// A stretch of a file's text, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Span {
    /// Which file.
    pub file: FileId,
    /// First byte.
    pub start: u32,
    /// One past the last byte.
    pub end: u32,
}

impl Span {
    /// From the start of `self` to the end of `other`; only `self` if they are in different files or out of order
    /// (as they are when a macro's text stands between).
    pub fn to(self, other: Span) -> Span {
        if self.file == other.file && other.end >= self.start {
            Span { end: other.end, ..self }
        } else {
            self
        }
    }
}

/// A text and its name.
#[derive(Debug, Clone)]
pub struct SourceFile {
    /// As diagnostics show it.
    pub name: String,
    /// Where it was read from; `None` if it did not come from a file.
    pub path: Option<PathBuf>,
    /// With line ends as `\n` and without a byte order mark.
    pub text: Arc<String>,
    /// Found when a diagnostic first asks.
    line_starts: OnceLock<Vec<u32>>,
}

impl SourceFile {
    /// The first byte of every line.
    fn line_starts(&self) -> &[u32] {
        self.line_starts.get_or_init(|| {
            let ends = self.text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
            std::iter::once(0).chain(ends.map(|(i, _)| i as u32 + 1)).collect()
        })
    }
}

/// Every text of one evaluation, in order of reading.
#[derive(Debug, Clone, Default)]
pub struct SourceMap {
    files: Vec<SourceFile>,
}

impl SourceMap {
    /// Takes in a file's bytes: UTF-8, or else Latin-1 (as scenes of the last century are); any line ends.
    pub fn add(&mut self, name: &str, path: Option<&Path>, bytes: Vec<u8>) -> FileId {
        let mut text = String::from_utf8(bytes)
            .unwrap_or_else(|error| error.as_bytes().iter().map(|&byte| byte as char).collect());
        if text.starts_with('\u{feff}') {
            text.remove(0);
        }
        if memchr::memchr(b'\r', text.as_bytes()).is_some() {
            text = text.replace("\r\n", "\n").replace('\r', "\n");
        }
        let text = Arc::new(text);
        let line_starts = OnceLock::new();
        self.files.push(SourceFile { name: name.into(), path: path.map(Into::into), text, line_starts });
        FileId(self.files.len() as u32 - 1)
    }

    /// A file by its id.
    pub fn file(&self, id: FileId) -> &SourceFile {
        &self.files[id.0 as usize]
    }

    /// All files, in order of reading.
    pub fn files(&self) -> &[SourceFile] {
        &self.files
    }

    /// Line and column, both from 1, of a span's first character; columns count characters.
    pub fn position(&self, span: Span) -> (usize, usize) {
        let file = self.file(span.file);
        let line = file.line_starts().partition_point(|&start| start <= span.start);
        let start = file.line_starts()[line - 1] as usize;
        (line, file.text[start..span.start as usize].chars().count() + 1)
    }

    /// The text of a span.
    pub fn text(&self, span: Span) -> &str {
        &self.file(span.file).text[span.start as usize..span.end as usize]
    }

    /// The lines around a span: byte range of the text from `context` lines before to `context` after, and the
    /// number of its first line.
    pub(crate) fn lines_around(&self, span: Span, context: usize) -> (std::ops::Range<usize>, usize) {
        let file = self.file(span.file);
        let line_of = |byte: u32| file.line_starts().partition_point(|&start| start <= byte) - 1;
        let first = line_of(span.start).saturating_sub(context);
        let last = line_of(span.end.max(span.start + 1) - 1) + context;
        let end = file.line_starts().get(last + 1).map_or(file.text.len(), |&start| start as usize - 1);
        (file.line_starts()[first] as usize..end, first + 1)
    }
}
