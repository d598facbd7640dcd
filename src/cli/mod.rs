//! The command line: arguments in; files, progress, diagnostics and reports out.
//!
//! One file per subcommand. Knows the library's public doors only; how rays are traced is none of its business.

mod bench;
mod check;
mod compare;
mod cpu;
mod crosscheck;
mod html;
mod number;
mod overwrite;
mod pages;
mod paths;
mod povray;
mod progress;
mod rays;
mod render;
mod scene;
mod stats;
mod streams;

use clap::{Parser, Subcommand};
use octray::file_io::FileError;
use octray::image_io::ImageError;
use std::process::ExitCode;

/// Renders POV-Ray scenes, eight rays at a time.
///
/// A scene is a POV-Ray 3.7 text file; `.scn` and `.pov` are the same to octray. What it does not model yet it refuses,
/// saying where.
#[derive(Debug, Parser)]
#[command(version, after_help = EXIT_CODES, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const EXIT_CODES: &str = "Exit codes: 0 all is well; 1 a scene has errors, or pictures differ more than --gate \
allows; 2 the command line is wrong; 3 a file could not be written, or a picture, mesh or set of rays not \
read, POV-Ray is missing, or this CPU cannot run this build.";

#[derive(Debug, Subcommand)]
enum Command {
    /// Render a scene to a picture file
    Render(render::Args),
    /// Read scenes and say what is wrong with them, without rendering
    Check(check::Args),
    /// Say how far two picture files are apart
    Compare(compare::Args),
    /// Measure speed against error: every precision, the oracle and POV-Ray on the same scenes
    Bench(bench::Args),
    /// Render scenes with octray and with the installed POV-Ray, and compare pictures and times
    Crosscheck(crosscheck::Args),
    /// Trace ray sets without a picture: how many a second, and what they hit
    Rays(rays::Args),
}

/// Why a command did not do what it was asked to. Diagnostics of scenes have been printed by then.
#[derive(Debug)]
enum Failure {
    /// A scene has errors: exit code 1.
    Scene,
    /// A scene is too large to be rendered: exit code 1.
    Large(String),
    /// Pictures differ more than allowed: exit code 1.
    Differs(String),
    /// The command line asks for something that makes no sense: exit code 2.
    Usage(String),
    /// A file, POV-Ray or the CPU: exit code 3.
    Machine(String),
}

impl From<FileError> for Failure {
    fn from(error: FileError) -> Self {
        Self::Machine(error.to_string())
    }
}

impl From<ImageError> for Failure {
    fn from(error: ImageError) -> Self {
        Self::Machine(error.to_string())
    }
}

pub use cpu::refuse_if_too_old;

/// Runs what the arguments say. Not to be mixed with what comes before it, which must run on any CPU.
#[inline(never)]
pub fn main() -> ExitCode {
    pages::keep_small();
    cpu::warn_if_too_plain();
    let command = Cli::parse().command;
    if matches!(command, Command::Bench(_) | Command::Crosscheck(_) | Command::Rays(_)) {
        pages::let_be();
    }
    let done = match command {
        Command::Render(args) => render::run(&args),
        Command::Check(args) => check::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Crosscheck(args) => crosscheck::run(&args),
        Command::Rays(args) => rays::run(&args),
    };
    let (message, code) = match done {
        Ok(()) => return ExitCode::SUCCESS,
        Err(Failure::Scene) => return ExitCode::from(1),
        Err(Failure::Large(message) | Failure::Differs(message)) => (message, 1),
        Err(Failure::Usage(message)) => (message, 2),
        Err(Failure::Machine(message)) => (message, 3),
    };
    streams::line_to_stderr(format_args!("error: {message}"));
    ExitCode::from(code)
}
