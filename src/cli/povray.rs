//! The installed POV-Ray: found, run, and its statistics read.

use crate::cli::Failure;
use crate::cli::scene::SceneArgs;
use octray::compare::clipped;
use octray::film::Film;
use octray::image_io::{self, Assume};
use octray::transfer::Transfer;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// POV-Ray gives up if its own threads take too long to start, as they do on a busy machine.
const TOO_BUSY: &str = "Timed out waiting for worker thread startup";

/// Then it is asked again, so many times.
const TRIES: usize = 5;

pub struct PovRay {
    program: PathBuf,
    /// As it says, e.g. "3.7.0.10.unofficial".
    pub version: String,
}

pub struct PovRun {
    /// Linear light, opaque, ending at 1.
    pub film: Film,
    /// Seconds of wall clock that tracing alone took, as POV-Ray says: in steps of a millisecond.
    pub trace_s: f64,
}

impl PovRay {
    /// Asks `program` for its version.
    pub fn find(program: &Path) -> Result<Self, Failure> {
        let asked = Command::new(program).arg("--version").stdin(Stdio::null()).output().map_err(|error| {
            Failure::Machine(format!(
                "the cross-check needs POV-Ray 3.7, and `{}` cannot be run ({error}); on Debian and Ubuntu, \
                 `apt-get install povray` brings it",
                program.display()
            ))
        })?;
        let said = said(&asked);
        let version = said
            .split_once("POV-Ray ")
            .and_then(|(_, rest)| rest.split_whitespace().next())
            .ok_or_else(|| Failure::Machine(format!("`{}` does not look like POV-Ray", program.display())))?;
        Ok(Self { program: program.into(), version: version.into() })
    }

    /// Renders with one thread, without anti-aliasing, to 16-bit linear light. Fails with the last lines of what POV-Ray
    /// says.
    pub fn render(
        &self,
        scene: &Path,
        args: &SceneArgs,
        (width, height): (usize, usize),
    ) -> Result<PovRun, String> {
        let folder = tempfile::tempdir().map_err(|error| format!("no temporary folder: {error}"))?;
        let picture = folder.path().join("povray.png");
        let mut command = Command::new(&self.program);
        command.arg(with_path("+I", scene)).arg(with_path("+O", &picture));
        command.arg(format!("+W{width}")).arg(format!("+H{height}"));
        command.args(["+FN16", "File_Gamma=1.0", "-A", "-D", "-V", "-P", "+WT1"]);
        command.arg(format!("+K{}", args.clock));
        // POV-Ray looks for includes in its working folder, octray in the scene's.
        let beside = scene.parent().filter(|folder| !folder.as_os_str().is_empty());
        command.args(beside.map(|folder| with_path("+L", folder)));
        command.args(args.library_paths.iter().map(|path| with_path("+L", path)));
        command.args(args.declares.iter().map(|(name, value)| format!("Declare={name}={value}")));
        let mut run = || command.stdin(Stdio::null()).output().map_err(|error| format!("POV-Ray: {error}"));
        let mut ran = run()?;
        for _ in 1..TRIES {
            if ran.status.success() || !said(&ran).contains(TOO_BUSY) {
                break;
            }
            ran = run()?;
        }
        let said = said(&ran);
        if !ran.status.success() {
            return Err(format!("POV-Ray cannot render it: {}", reason(&said)));
        }
        // Said outright, because a scene without gamma correction gives a file that says nothing.
        let film = image_io::read(&picture, Assume::Transfer(Transfer::LINEAR)).map_err(|e| e.to_string())?;
        let trace_s = trace_seconds(&said).ok_or("POV-Ray told no time")?;
        Ok(PovRun { film, trace_s })
    }
}

/// POV-Ray's file has no alpha here and ends at 1.
pub fn as_povray_writes(film: Film) -> Film {
    let mut film = clipped(film);
    film.pixels.iter_mut().for_each(|pixel| pixel.transmit = 0.0);
    film
}

/// POV-Ray writes on both streams.
fn said(output: &Output) -> String {
    String::from_utf8_lossy(&[&output.stderr[..], &output.stdout[..]].concat()).into_owned()
}

/// One argument of switch and path, which need not be UTF-8.
fn with_path(switch: &str, path: &Path) -> std::ffi::OsString {
    let mut argument = std::ffi::OsString::from(switch);
    argument.push(path);
    argument
}

/// The line that names the error, or else the last one.
fn reason(said: &str) -> &str {
    let lines = || said.lines().map(str::trim).filter(|line| !line.is_empty());
    lines().find(|line| line.contains("Error:")).or_else(|| lines().next_back()).unwrap_or("it says nothing")
}

/// From `Trace Time:       0 hours  0 minutes  0 seconds (0.246 seconds)`.
fn trace_seconds(said: &str) -> Option<f64> {
    let line = said.lines().find(|line| line.trim_start().starts_with("Trace Time:"))?;
    let (_, rest) = line.split_once('(')?;
    rest.split_once(" seconds)")?.0.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_and_reasons_are_found() {
        let said = "Parser Time\n  Parse Time: 0 hours 0 minutes 0 seconds (0.900 seconds)\nRender Time:\n  \
                    Trace Time:       0 hours  1 minutes  2 seconds (62.246 seconds)\n     using 1 thread(s)\n";
        assert_eq!(trace_seconds(said), Some(62.246));
        assert_eq!(trace_seconds("nothing"), None);
        assert_eq!(
            reason("File 'a' line 3: Parse Error: No matching }\n\nRender failed\n"),
            "File 'a' line 3: Parse Error: No matching }"
        );
        assert_eq!(reason(""), "it says nothing");
    }

    #[test]
    fn an_absent_program_is_told_with_what_brings_it() {
        let Err(Failure::Machine(said)) = PovRay::find(Path::new("/nowhere/povray")) else { panic!("found") };
        assert!(said.contains("apt-get install povray"), "{said}");
    }
}
