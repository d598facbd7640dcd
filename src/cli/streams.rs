//! The standard streams, which may be closed or full: neither is a reason to panic, as `println!` does.

use super::Failure;
use std::fmt::Display;
use std::io::{self, ErrorKind, Write};

/// Writes to the standard output. Nobody reading it any more (`octray rays ... | head -1`) is no failure: whoever stopped has
/// seen enough, and files are still to be written.
pub fn to_stdout(bytes: impl AsRef<[u8]>) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    match out.write_all(bytes.as_ref()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Failure::Machine(format!("cannot write to standard output: {error}")))
        }
        _ => Ok(()),
    }
}

/// A line to the standard output; see [`to_stdout`].
pub fn line_to_stdout(line: impl Display) -> Result<(), Failure> {
    to_stdout(format!("{line}\n"))
}

/// A line to the standard error stream. There is nowhere left to tell that this did not work.
pub fn line_to_stderr(line: impl Display) {
    let _ = writeln!(io::stderr().lock(), "{line}");
}
