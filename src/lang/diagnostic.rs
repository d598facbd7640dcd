//! What is wrong, where, and how we got there.

use super::{SourceMap, Span};
use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use serde_json::json;

/// How bad it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Nothing is wrong; something was left aside that does not change the picture much.
    Note,
    /// The picture may not be what the writer thinks.
    Warning,
    /// There is no picture.
    Error,
}

/// One thing to tell the scene's writer.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnostic {
    /// How bad it is.
    pub severity: Severity,
    /// Lower case, without a full stop: found and expected.
    pub message: String,
    /// Where; `None` if it is not in any text (a file that cannot be opened).
    pub span: Option<Span>,
    /// What to do about it.
    pub help: Option<String>,
    /// The way there, innermost first: "in macro `M`, called here".
    pub notes: Vec<(String, Option<Span>)>,
}

/// Notes beyond this many are left out in the middle: an endless recursion has thousands.
const NOTES_SHOWN: usize = 6;

impl Diagnostic {
    /// A diagnostic without help or notes.
    pub fn new(severity: Severity, message: impl Into<String>, span: Option<Span>) -> Self {
        Self { severity, message: message.into(), span, help: None, notes: Vec::new() }
    }

    /// An error at a place.
    pub fn error(message: impl Into<String>, span: Span) -> Self {
        Self::new(Severity::Error, message, Some(span))
    }

    /// With a proposal.
    pub fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// One line for editors: `file:line:column: error: message`.
    pub fn short(&self, sources: &SourceMap) -> String {
        let severity = self.severity.word();
        match self.span {
            Some(span) => {
                let (line, column) = sources.position(span);
                format!("{}:{line}:{column}: {severity}: {}", sources.file(span.file).name, self.message)
            }
            None => format!("{severity}: {}", self.message),
        }
    }

    /// One JSON object for programs: `severity`, `message`, `help` if there is one, `place` if there is one, and `notes`, the
    /// way there, innermost first, each with `message` and `place`. A place has `file`, `line` and `column` (from 1, in
    /// characters) and the byte range `start`, `end`.
    pub fn json(&self, sources: &SourceMap) -> String {
        let place = |span: &Option<Span>| {
            span.map(|span| {
                let (line, column) = sources.position(span);
                let file = &sources.file(span.file).name;
                json!({"file": file, "line": line, "column": column, "start": span.start, "end": span.end})
            })
        };
        let notes: Vec<_> = self
            .notes
            .iter()
            .map(|(message, span)| json!({"message": message, "place": place(span)}))
            .collect();
        json!({
            "severity": self.severity.word(),
            "message": self.message,
            "place": place(&self.span),
            "help": self.help,
            "notes": notes,
        })
        .to_string()
    }

    /// In the form of rustc, with the lines in question; with colours for terminals if `color`.
    pub fn render(&self, sources: &SourceMap, color: bool) -> String {
        let level = match self.severity {
            Severity::Note => Level::NOTE,
            Severity::Warning => Level::WARNING,
            Severity::Error => Level::ERROR,
        };
        let mut main = Group::with_title(level.primary_title(self.message.as_str()));
        if let Some(span) = self.span {
            main = main.element(snippet(sources, span));
        }
        if let Some(help) = &self.help {
            main = main.element(Level::HELP.message(help.as_str()));
        }
        let mut groups = vec![main];
        let skipped = self.notes.len().saturating_sub(NOTES_SHOWN);
        let more = format!("... and {skipped} calls more");
        for (index, (message, span)) in self.notes.iter().enumerate() {
            if skipped > 0 && (NOTES_SHOWN / 2..NOTES_SHOWN / 2 + skipped).contains(&index) {
                if index == NOTES_SHOWN / 2 {
                    groups.push(Group::with_title(Level::NOTE.secondary_title(more.as_str())));
                }
                continue;
            }
            let mut group = Group::with_title(Level::NOTE.secondary_title(message.as_str()));
            if let Some(span) = span {
                group = group.element(snippet(sources, *span));
            }
            groups.push(group);
        }
        let renderer = if color { Renderer::styled() } else { Renderer::plain() };
        renderer.render(&groups)
    }
}

impl Severity {
    /// As diagnostics say it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Note => "note",
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

/// The line of a span with the span underlined. Only the line itself is handed over: the files may be huge.
fn snippet(sources: &SourceMap, span: Span) -> Snippet<'_, annotate_snippets::Annotation<'_>> {
    let file = sources.file(span.file);
    // A span over many lines (an unclosed block) is shown by its first.
    let first_line = Span { end: span.start + 1, ..span };
    let (range, line) = sources.lines_around(first_line, 0);
    let start = (span.start as usize).min(range.end) - range.start;
    let end = (span.end as usize).min(range.end).saturating_sub(range.start).max(start);
    Snippet::source(&file.text[range])
        .line_start(line)
        .path(file.name.as_str())
        .annotation(AnnotationKind::Primary.span(start..end))
}
