//! Files: the scene, its includes, and the includes that octray brings along.

use super::machine::{FrameKind, Lexeme, Machine, Res, STACK_BYTES, Stop};
use super::value::{Num, Value};
use super::{Evaluation, Options};
use crate::file_io::{FileError, read_file};
use crate::lang::{Diagnostic, FileId, Manner, Program, Severity, read};
use corosensei::{on_stack, stack::DefaultStack};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// octray's own includes, for scenes that need no more of POV-Ray's than these; used if no library path has the file.
const EMBEDDED: &[(&str, &str)] = &[
    ("colors.inc", include_str!("includes/colors.inc")),
    ("consts.inc", include_str!("includes/consts.inc")),
    ("finish.inc", include_str!("includes/finish.inc")),
    ("functions.inc", include_str!("includes/functions.inc")),
    ("glass.inc", include_str!("includes/glass.inc")),
    ("math.inc", include_str!("includes/math.inc")),
    ("metals.inc", include_str!("includes/metals.inc")),
    ("rand.inc", include_str!("includes/rand.inc")),
    ("shapes.inc", include_str!("includes/shapes.inc")),
    ("textures.inc", include_str!("includes/textures.inc")),
    ("transforms.inc", include_str!("includes/transforms.inc")),
];

/// Where an include was found.
pub(super) enum Found {
    File {
        path: PathBuf,
        /// The name that it has, if that is not quite the one asked for.
        odd: Option<String>,
        /// It is not the scene's own but of a library.
        library: bool,
    },
    /// What the script itself has written under the name.
    Written(Arc<str>),
    Embedded(&'static str, &'static str),
}

/// A scene file's bytes, or why not.
pub(super) fn read_scene(path: &Path) -> Result<Vec<u8>, String> {
    if path.is_dir() {
        return Err(format!("expected a scene file, found a directory: {}", path.display()));
    }
    read_text(path).map_err(|error| error.to_string())
}

/// Evaluates a text on a stack of its own, deep enough for whatever nesting is allowed. A thread would do too, but not for
/// scenes that are read in less time than one takes to begin (and to get memory of its own).
pub(super) fn run(name: &str, path: Option<&Path>, bytes: Vec<u8>, options: &Options) -> Evaluation {
    match DefaultStack::new(STACK_BYTES) {
        Ok(stack) => on_stack(stack, || evaluate(name, path, bytes, options)),
        Err(error) => {
            let message = format!("no {} MB of memory for the evaluator's stack: {error}", STACK_BYTES >> 20);
            let diagnostics = vec![Diagnostic::new(Severity::Error, message, None)];
            Evaluation { diagnostics, ..Evaluation::default() }
        }
    }
}

fn evaluate(name: &str, path: Option<&Path>, bytes: Vec<u8>, options: &Options) -> Evaluation {
    let mut machine = Machine::new(options);
    let file = machine.sources.add(name, path, bytes);
    if let Some(path) = path {
        machine.files_read.push(path.into());
        machine.folder = path.parent().map(Into::into);
    }
    // These can be declared anew, as POV-Ray lets them: they are no keywords. One picture is the one frame of a film:
    // scenes that are made for films count on it. (POV-Ray has 0 everywhere then.)
    let given = [
        ("image_width", options.image_width as f64),
        ("image_height", options.image_height as f64),
        ("clock_delta", 1.0),
        ("initial_clock", 0.0),
        ("final_clock", 1.0),
        ("frame_number", 1.0),
        ("initial_frame", 1.0),
        ("final_frame", 1.0),
    ];
    for (name, value) in given {
        let symbol = machine.symbols.intern(name);
        machine.scopes.declare(symbol, Value::Number(Num::float(value)));
    }
    let symbol = machine.symbols.intern("input_file_name");
    machine.scopes.declare(symbol, Value::String(name.into()));
    for (name, value) in &options.declares {
        let symbol = machine.symbols.intern(name);
        let value = match value.trim().parse() {
            Ok(number) => Value::Number(Num::float(number)),
            Err(_) => Value::String(value.trim_matches('"').into()),
        };
        machine.scopes.declare(symbol, value);
    }
    match machine.compile(file, Manner::Whole) {
        Ok(program) => {
            if machine.enter_frame(program, 0, FrameKind::Scene, None).is_ok() {
                machine.run();
            }
        }
        Err(errors) => machine.diagnostics.extend(errors),
    }
    machine.close_data_files();
    let missing = machine.finish_missing();
    Evaluation {
        missing,
        scene: machine.scene,
        diagnostics: machine.diagnostics,
        messages: machine.messages,
        sources: machine.sources,
        files_read: machine.files_read,
    }
}

/// Bytes of the longest text that is read: no scene's is a hundredth of it, and a device's has no end.
const LONGEST_TEXT: u64 = 1 << 30;

/// The bytes of a scene, an include or a file of values.
pub(super) fn read_text(path: &Path) -> Result<Vec<u8>, FileError> {
    read_file(path, LONGEST_TEXT)
}

/// Bytes that a text takes beside what it holds, about: a script may write and include an empty one without end.
pub(super) const PROGRAM_BYTES: usize = 1000;

impl Machine<'_> {
    /// Reads a file's text into a program.
    fn compile(&mut self, file: FileId, manner: Manner) -> Result<u32, Vec<Diagnostic>> {
        let text = self.sources.file(file).text.clone();
        let program: Program = read(file, &text, &mut self.symbols, manner)?;
        self.programs.push(Arc::new(program));
        Ok(self.programs.len() as u32 - 1)
    }

    /// The program of the file that an `#include` names.
    pub fn find_include(&mut self, name: &str, at: Lexeme) -> Res<u32> {
        let (key, display, bytes, library) = match self.locate(name) {
            None => {
                let mut diagnostic =
                    Diagnostic::error(format!("cannot find the include file `{name}`"), self.span(self.last));
                diagnostic.help = Some(
                    "looked in the scene's folder, the library paths (-L) and octray's own includes".into(),
                );
                return Err(Stop::Halt(Some(Box::new(diagnostic))));
            }
            Some(Found::Embedded(name, text)) => (
                PathBuf::from(format!("<octray>/{name}")),
                format!("<octray>/{name}"),
                text.as_bytes().to_vec(),
                true,
            ),
            Some(Found::Written(name)) => {
                let text = self.data_files.written(&name).unwrap_or_default();
                (self.beside_scene(&name), name.to_string(), text.as_bytes().to_vec(), false)
            }
            Some(Found::File { path, odd, library }) => {
                if let Some(odd) = odd {
                    let span = self.span(self.last);
                    self.warn(
                        "include name",
                        format!("`{name}` is there as {odd}; POV-Ray would not find it"),
                        span,
                    );
                }
                if self.program_of.contains_key(&path) {
                    (path, String::new(), Vec::new(), library)
                } else {
                    let bytes = read_text(&path).map_err(|error| self.halt(error.to_string()))?;
                    self.files_read.push(path.clone());
                    (path.clone(), path.display().to_string(), bytes, library)
                }
            }
        };
        if let Some(program) = self.program_of.get(&key) {
            return Ok(*program);
        }
        self.charge(PROGRAM_BYTES + bytes.len() * 8)?;
        let file = self.sources.add(&display, Some(&key), bytes);
        // All of what the user has written is looked at, of a library no more than is used.
        let manner = if library { Manner::Skim } else { Manner::Whole };
        if library {
            self.scopes.expect_library();
        }
        match self.compile(file, manner) {
            Ok(program) => {
                self.program_of.insert(key, program);
                Ok(program)
            }
            Err(errors) => {
                let _ = at;
                for error in errors {
                    self.tell(error);
                }
                Err(Stop::Halt(None))
            }
        }
    }

    /// The path that a name means beside the scene.
    pub fn beside_scene(&self, name: &str) -> PathBuf {
        self.folder.clone().unwrap_or_default().join(name)
    }

    /// Looks for a file: beside the scene, where the script's own are too, in the library paths, among octray's own; with
    /// `.inc` added, and at last with `\` as `/` and without regard to case.
    pub fn locate(&self, name: &str) -> Option<Found> {
        let here = self.folder.clone().unwrap_or_default();
        let folders: Vec<&Path> = std::iter::once(here.as_path())
            .chain(self.options.library_paths.iter().map(PathBuf::as_path))
            .collect();
        let names = [name.to_string(), format!("{name}.inc"), format!("{name}.INC")];
        for (index, folder) in folders.iter().enumerate() {
            for name in &names {
                if index == 0
                    && let Some(name) = self.data_files.written_name(name)
                {
                    return Some(Found::Written(name.clone()));
                }
                let path = folder.join(name);
                if path.is_file() {
                    return Some(Found::File { path, odd: None, library: index > 0 });
                }
            }
        }
        let embedded =
            EMBEDDED.iter().find(|(own, _)| *own == name || own.strip_suffix(".inc") == Some(name));
        if let Some((name, text)) = embedded {
            return Some(Found::Embedded(name, text));
        }
        for (index, folder) in folders.iter().enumerate() {
            for name in &names {
                if let Some(path) = find_loosely(folder, &name.replace('\\', "/")) {
                    let odd = Some(path.display().to_string());
                    return Some(Found::File { path, odd, library: index > 0 });
                }
            }
        }
        None
    }
}

/// Goes down a path without regard to case.
fn find_loosely(folder: &Path, name: &str) -> Option<PathBuf> {
    let mut path = folder.to_path_buf();
    for part in name.split('/').filter(|part| !part.is_empty()) {
        let exact = path.join(part);
        if exact.exists() {
            path = exact;
            continue;
        }
        let listing = if path.as_os_str().is_empty() { Path::new(".") } else { &path };
        let mut entries: Vec<_> =
            std::fs::read_dir(listing).ok()?.flatten().map(|entry| entry.file_name()).collect();
        entries.sort();
        let entry = entries.into_iter().find(|entry| entry.to_string_lossy().eq_ignore_ascii_case(part))?;
        path = path.join(entry);
    }
    path.is_file().then_some(path)
}
