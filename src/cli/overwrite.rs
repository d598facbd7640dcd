//! Results that would replace what a command reads, or each other.

use super::Failure;
use octray::file_io::is_same_file;
use std::path::Path;

/// What a file is to a command ("scene", "picture"), and where it is.
pub type Named<'a> = (&'a str, &'a Path);

/// Refuses to write over anything in `read`, or over another one of `written`.
pub fn refuse_overwrites(read: &[Named], written: &[Named]) -> Result<(), Failure> {
    for (number, &(what, path)) in written.iter().enumerate() {
        let mut others = read.iter().chain(&written[..number]);
        if let Some((other, _)) = others.find(|(_, other)| is_same_file(path, other)) {
            let path = path.display();
            return Err(Failure::Usage(format!("the {what} would overwrite the {other}: {path}")));
        }
    }
    Ok(())
}
