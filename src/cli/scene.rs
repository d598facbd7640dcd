//! What every command that reads scenes shares: its arguments, and telling what is wrong.

use super::Failure;
use octray::eval::{self, Evaluation, Stream};
use octray::lang::Severity;
use octray::scene::Scene;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};

/// What scenes are told from outside.
#[derive(Debug, Clone, clap::Args)]
pub struct SceneArgs {
    /// Look for included files here too, after the scene's own folder and before an installed POV-Ray's; may be given several times
    #[arg(short = 'L', long = "library-path", value_name = "DIR")]
    pub library_paths: Vec<PathBuf>,
    /// Declare an identifier before the scene begins: a number, or any other text as a string; may be given several times
    #[arg(short = 'D', long = "declare", value_name = "NAME=VALUE", value_parser = name_and_value)]
    pub declares: Vec<(String, String)>,
    /// What the scene finds in `clock`
    #[arg(long, value_name = "X", default_value_t = 0.0, allow_negative_numbers = true)]
    pub clock: f64,
    /// Leave out what octray does not model yet, with a warning, instead of refusing the scene
    #[arg(long)]
    pub allow_missing: bool,
    /// Let the scene's #fopen write in and below this folder; may be given several times
    #[arg(long = "allow-write", value_name = "DIR")]
    pub write_paths: Vec<PathBuf>,
    /// How errors and warnings are shown
    #[arg(long, value_enum, value_name = "FORMAT", default_value_t = MessageFormat::Human)]
    pub message_format: MessageFormat,
}

/// The form of diagnostics on the standard error stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum MessageFormat {
    /// With the lines in question
    Human,
    /// One line each, as editors like it: `file:line:column: error: message`
    Short,
    /// One JSON object a line: severity, message, place, help, and the way there
    Json,
}

/// Reads a scene and prints its diagnostics, and unless `quiet` what its `#debug` and `#warning` write, to the
/// standard error stream. `Failure::Scene` if it has errors.
pub fn load(path: &Path, args: &SceneArgs, size: (usize, usize), quiet: bool) -> Result<Scene, Failure> {
    let found = evaluate(path, args, size);
    print_messages(&found, quiet, args.message_format);
    if found.has_errors() { Err(Failure::Scene) } else { Ok(found.scene) }
}

/// Reads a scene and says nothing.
pub fn evaluate(path: &Path, args: &SceneArgs, size: (usize, usize)) -> Evaluation {
    eval::load(path, &options(args, size))
}

/// What the arguments tell a scene.
pub fn options(args: &SceneArgs, (image_width, image_height): (usize, usize)) -> eval::Options {
    eval::Options {
        declares: args.declares.clone(),
        clock: args.clock,
        image_width,
        image_height,
        library_paths: args.library_paths.iter().cloned().chain(standard_includes()).collect(),
        allow_missing: args.allow_missing,
        write_paths: args.write_paths.clone(),
        ..eval::Options::default()
    }
}

/// Folders where an installed POV-Ray keeps its includes, as far as they are there.
fn standard_includes() -> impl Iterator<Item = PathBuf> {
    const USUAL: [&str; 5] = [
        "/usr/share/povray-3.7/include",
        "/usr/local/share/povray-3.7/include",
        "/usr/share/povray/include",
        "/opt/homebrew/share/povray-3.7/include",
        "/opt/local/share/povray-3.7/include",
    ];
    USUAL.into_iter().map(PathBuf::from).filter(|path| path.is_dir())
}

/// Prints diagnostics in rustc's form, and a line that counts them. Warnings and the script's own streams are left out
/// if `quiet`.
pub fn print_messages(found: &Evaluation, quiet: bool, format: MessageFormat) {
    // Programs that read diagnostics want nothing else between them.
    if !quiet && format == MessageFormat::Human {
        for message in &found.messages {
            // What `#error` writes is in its diagnostic.
            if message.stream != Stream::Error {
                eprint!("{}", message.text);
            }
        }
        if found.messages.last().is_some_and(|last| !last.text.ends_with('\n')) {
            eprintln!();
        }
    }
    let color = std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    let least = if quiet { Severity::Error } else { Severity::Note };
    for diagnostic in found.diagnostics.iter().filter(|d| d.severity >= least) {
        match format {
            MessageFormat::Human => eprintln!("{}\n", diagnostic.render(&found.sources, color)),
            MessageFormat::Short => eprintln!("{}", diagnostic.short(&found.sources)),
            MessageFormat::Json => eprintln!("{}", diagnostic.json(&found.sources)),
        }
    }
    if format != MessageFormat::Human {
        return;
    }
    if let errors @ 1.. = found.count(Severity::Error) {
        eprintln!("{}", plural(errors, "error"));
    }
}

/// "1 error", "2 errors".
pub fn plural(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

fn name_and_value(text: &str) -> Result<(String, String), String> {
    let (name, value) = text.split_once('=').ok_or("expected NAME=VALUE")?;
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
    if name.is_empty() || name.starts_with(|c: char| c.is_ascii_digit()) || !name.chars().all(is_name) {
        return Err(format!("`{name}` is not an identifier"));
    }
    Ok((name.into(), value.into()))
}
