//! What every command that reads scenes shares: its arguments, and telling what is wrong.

use super::Failure;
use super::number::number;
use octray::eval::{self, Evaluation, Stream};
use octray::lang::{Keyword, Severity};
use octray::render::{kept_shapes, shape_counts};
use octray::scene::Scene;
use std::collections::BTreeMap;
use std::io::{BufWriter, IsTerminal, Write};
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
    #[arg(long, value_name = "X", default_value_t = 0.0, allow_negative_numbers = true, value_parser = number(f64::MIN..=f64::MAX, "a finite number"))]
    pub clock: f64,
    /// Leave out what octray does not model yet, with a warning, instead of refusing the scene
    #[arg(long)]
    pub allow_missing: bool,
    /// Let the scene's #fopen write in and below this folder; may be given several times
    #[arg(long = "allow-write", value_name = "DIR")]
    pub write_paths: Vec<PathBuf>,
    /// Render no scene of more shapes than this: each takes 300 to 700 bytes while it is rendered. A script of a few lines
    /// can ask for more than any memory holds. (A mesh, or a composite of meshes, that is placed many times counts once)
    #[arg(long, value_name = "N", default_value_t = 20_000_000)]
    pub max_shapes: u64,
    /// Stop a script after so many evaluated tokens: a hundred million take some seconds
    #[arg(long, value_name = "N", default_value_t = eval::Limits::default().steps)]
    pub max_evaluation_steps: u64,
    /// Stop a script whose values and objects take more than this, in MiB
    #[arg(long, value_name = "MIB", default_value_t = eval::Limits::default().memory >> 20)]
    pub max_memory: u64,
    /// Stop a script whose macros and includes call each other deeper than this
    #[arg(long, value_name = "N", default_value_t = eval::Limits::default().calls)]
    pub max_call_depth: usize,
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

/// A scene that can be rendered, and what reading it has shown.
pub struct Loaded {
    pub scene: Scene,
    /// Every file that was read for it.
    pub files_read: Vec<PathBuf>,
    /// How many shapes of all kinds it has.
    pub shapes: u64,
}

/// Reads a scene and prints its diagnostics, and unless `quiet` what its `#debug` and `#warning` write, to the
/// standard error stream. `Failure::Scene` if it has errors, or too many shapes to be rendered.
pub fn load(path: &Path, args: &SceneArgs, size: (usize, usize), quiet: bool) -> Result<Scene, Failure> {
    load_whole(path, args, size, quiet).map(|loaded| loaded.scene)
}

/// The same, with all that is known of it.
pub fn load_whole(
    path: &Path,
    args: &SceneArgs,
    size: (usize, usize),
    quiet: bool,
) -> Result<Loaded, Failure> {
    let found = eval::load(path, &options(args, size));
    print_messages(&found, quiet, args.message_format);
    if found.has_errors() {
        return Err(Failure::Scene);
    }
    let shapes = shapes(&shape_counts(&found.scene));
    if is_over_limit(&found.scene, shapes, args.max_shapes) {
        let name = path.display();
        return Err(Failure::Large(format!("{name} has {}; {}", many(shapes), over_limit(args.max_shapes))));
    }
    Ok(Loaded { scene: found.scene, files_read: found.files_read, shapes })
}

/// How many shapes of all kinds.
pub fn shapes(counts: &BTreeMap<&'static str, u64>) -> u64 {
    counts.values().fold(0, |sum, count| sum.saturating_add(*count))
}

/// A number of shapes in words; counting stops at the largest number there is.
pub fn many(shapes: u64) -> String {
    match shapes {
        u64::MAX => format!("over {} shapes", u64::MAX - 1),
        1 => "1 shape".into(),
        _ => format!("{shapes} shapes"),
    }
}

/// True if a scene of so many shapes is more than `limit` when it is rendered: meshes that it shares are few.
pub fn is_over_limit(scene: &Scene, shapes: u64, limit: u64) -> bool {
    shapes > limit && kept_shapes(scene, limit) > limit
}

/// What to do about too many shapes.
pub fn over_limit(limit: u64) -> String {
    format!("octray render takes at most {limit}: raise --max-shapes if there is memory for more")
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
        advise: true,
        limits: eval::Limits {
            steps: args.max_evaluation_steps,
            memory: args.max_memory.saturating_mul(1 << 20),
            calls: args.max_call_depth,
            ..eval::Limits::default()
        },
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
    // There is nowhere left to tell that nobody reads this. A script may have written a million pieces: not one by one.
    let mut out = BufWriter::new(std::io::stderr().lock());
    let _ = write_messages(&mut out, found, quiet, format).and_then(|()| out.flush());
}

fn write_messages(
    out: &mut impl Write,
    found: &Evaluation,
    quiet: bool,
    format: MessageFormat,
) -> std::io::Result<()> {
    // Programs that read diagnostics want nothing else between them.
    if !quiet && format == MessageFormat::Human {
        // What `#error` writes is in its diagnostic.
        for message in found.messages.iter().filter(|message| message.stream != Stream::Error) {
            out.write_all(message.text.as_bytes())?;
        }
        if found.messages.last().is_some_and(|last| !last.text.ends_with('\n')) {
            writeln!(out)?;
        }
    }
    let color = std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    let least = if quiet { Severity::Error } else { Severity::Note };
    for diagnostic in found.diagnostics.iter().filter(|d| d.severity >= least) {
        match format {
            MessageFormat::Human => writeln!(out, "{}\n", diagnostic.render(&found.sources, color))?,
            MessageFormat::Short => writeln!(out, "{}", diagnostic.short(&found.sources))?,
            MessageFormat::Json => writeln!(out, "{}", diagnostic.json(&found.sources))?,
        }
    }
    match found.count(Severity::Error) {
        errors @ 1.. if format == MessageFormat::Human => writeln!(out, "{}", plural(errors, "error")),
        _ => Ok(()),
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
    // It would be there, and nothing could read it.
    if Keyword::from_text(name).is_some() {
        let hint = if name == "clock" { "; use --clock" } else { "" };
        return Err(format!("`{name}` is a word of the language{hint}"));
    }
    Ok((name.into(), value.into()))
}
