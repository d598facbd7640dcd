//! Scene text to [`Scene`]: runs the script that a scene file is.
//!
//! In come a file (or a text), a library path and values from outside ([`Options`]); out goes the plain description that
//! renderers read, with everything there is to say about the text ([`Evaluation`]). Knows the language's values,
//! directives and objects; does not know how a picture is traced. Reads only the files that the scene names.
//!
//! ```
//! let done = octray::eval::from_text("ball.scn", "sphere { <0, 1, 5>, 1 pigment { rgb 1 } }", &Default::default());
//! assert!(!done.has_errors());
//! assert_eq!(done.scene.objects.len(), 1);
//! ```

mod advice;
mod any_value;
mod atmosphere;
mod builtin;
mod camera;
mod color;
mod compiled;
mod complaint;
mod composite;
mod cursor;
mod curved_shape;
mod data_file;
mod declaration;
mod directive;
mod expr;
mod files;
mod finish;
mod finish_interior;
mod follows;
mod function;
mod geometry;
mod image;
mod item;
mod later;
mod light;
mod machine;
mod media;
mod mesh;
mod missing;
mod normal;
mod object;
mod other_shape;
mod pattern;
mod patterned;
mod pigment;
mod placing;
mod polynomial;
mod scope;
mod settings;
mod shape;
mod spline;
mod statement;
mod string;
mod texture;
mod transform;
mod value;

pub use missing::{Effect, Missing};

use crate::lang::{Diagnostic, Severity, SourceMap};
use crate::scene::Scene;
use std::path::{Path, PathBuf};

/// What a scene is told from outside.
#[derive(Debug, Clone)]
pub struct Options {
    /// Identifiers that are there before the first line: `(name, value)`; a value that is a number is a float, any
    /// other is a string, as for POV-Ray's `Declare=`.
    pub declares: Vec<(String, String)>,
    /// The value of `clock`.
    pub clock: f64,
    /// The value of `image_width`; it does not change the camera.
    pub image_width: usize,
    /// The value of `image_height`.
    pub image_height: usize,
    /// Where includes are looked for after the scene's own folder, in order.
    pub library_paths: Vec<PathBuf>,
    /// What is not modelled yet is a warning instead of an error, and left out.
    pub allow_missing: bool,
    /// What is not modelled yet is told in [`Evaluation::missing`] alone, not in the diagnostics.
    pub list_missing: bool,
    /// Folders in and below which `#fopen` may write. What is written elsewhere stays in memory.
    pub write_paths: Vec<PathBuf>,
    /// Warns also of what a whole scene lacks: a `#version`, an `assumed_gamma`, a camera, objects, lights.
    pub advise: bool,
    /// What a script may use before it is stopped.
    pub limits: Limits,
}

/// Bounds on a script, so that none hangs or eats the machine.
#[derive(Debug, Clone)]
pub struct Limits {
    /// Tokens evaluated; 10^8 take some seconds.
    pub steps: u64,
    /// Macro calls and includes within each other.
    pub calls: usize,
    /// Bytes of values and objects, estimated.
    pub memory: u64,
    /// Errors told before giving up.
    pub errors: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            declares: Vec::new(),
            clock: 0.0,
            image_width: 320,
            image_height: 240,
            library_paths: Vec::new(),
            allow_missing: false,
            list_missing: false,
            write_paths: Vec::new(),
            advise: false,
            limits: Limits::default(),
        }
    }
}

impl Default for Limits {
    fn default() -> Self {
        Self { steps: 2_000_000_000, calls: 10_000, memory: 4 << 30, errors: 50 }
    }
}

/// A scene, and what there is to say about its text.
#[derive(Debug, Clone, Default)]
pub struct Evaluation {
    /// Everything that could be read; not to be rendered if [`Evaluation::has_errors`].
    pub scene: Scene,
    /// In order of appearance; what is not modelled comes last.
    pub diagnostics: Vec<Diagnostic>,
    /// What `#debug`, `#warning`, `#render` and the like wrote, in order.
    pub messages: Vec<Message>,
    /// The texts that the diagnostics' spans point into.
    pub sources: SourceMap,
    /// What the scene asks for and octray does not model, one entry a feature; what is refused comes first.
    pub missing: Vec<Missing>,
    /// Every file read from disk, the scene first.
    pub files_read: Vec<PathBuf>,
}

/// One piece of text written by the script. POV-Ray adds no line end; nor do we.
#[derive(Debug, Clone, PartialEq)]
pub struct Message {
    /// Where to.
    pub stream: Stream,
    /// What.
    pub text: String,
}

/// The streams that a script writes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stream {
    /// `#debug`.
    Debug,
    /// `#warning`.
    Warning,
    /// `#error`.
    Error,
    /// `#render`.
    Render,
    /// `#statistics`.
    Statistics,
}

impl Evaluation {
    /// True if the scene must not be rendered.
    pub fn has_errors(&self) -> bool {
        self.diagnostics.iter().any(|d| d.severity == Severity::Error)
    }

    /// How many diagnostics there are of one severity.
    pub fn count(&self, severity: Severity) -> usize {
        self.diagnostics.iter().filter(|d| d.severity == severity).count()
    }

    /// All text written to one stream.
    pub fn stream(&self, stream: Stream) -> String {
        self.messages.iter().filter(|m| m.stream == stream).map(|m| m.text.as_str()).collect()
    }
}

/// Evaluates a scene file. A file that cannot be read is a diagnostic like any other.
pub fn load(path: &Path, options: &Options) -> Evaluation {
    match files::read_scene(path) {
        Ok(bytes) => files::run(&path.display().to_string(), Some(path), bytes, options),
        Err(message) => Evaluation {
            diagnostics: vec![Diagnostic::new(Severity::Error, message, None)],
            ..Evaluation::default()
        },
    }
}

/// Evaluates a text; `name` is what diagnostics call it. Includes are looked for in the working folder first.
pub fn from_text(name: &str, text: &str, options: &Options) -> Evaluation {
    files::run(name, None, text.as_bytes().to_vec(), options)
}
