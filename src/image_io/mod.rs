//! Films to picture files and back.
//!
//! In come a [`Film`](crate::film::Film) and an [`Encoding`], out go the bytes of a file, and the reverse. Knows formats and curves; knows
//! nothing of scenes or of how a film was made.

mod codes;
mod encode;
mod png;
mod read;

pub use codes::Developer;
pub use encode::{encode, encode_developed, write};
pub use read::{Assume, decode, read};

use crate::file_io::FileError;
use crate::transfer::Transfer;
use std::path::{Path, PathBuf};

/// The picture files there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Format {
    /// 8 or 16 bits, lossless; with alpha if asked for.
    #[default]
    Png,
    /// OpenEXR: 32-bit floats in linear light, unclamped.
    Exr,
    /// Radiance: linear light, unclamped, 8 bits of mantissa shared by each pixel's three channels.
    Hdr,
    /// Portable pixmap: 8 or 16 bits, plain.
    Ppm,
    /// 8 bits, lossy.
    Jpeg,
}

impl Format {
    /// All of them, with the endings of their names.
    pub const ALL: [(Self, &[&str]); 5] = [
        (Self::Png, &["png"]),
        (Self::Exr, &["exr"]),
        (Self::Hdr, &["hdr"]),
        (Self::Ppm, &["ppm"]),
        (Self::Jpeg, &["jpg", "jpeg"]),
    ];

    /// The format that a file's name ends in, in any case.
    pub fn of_path(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_str()?;
        let known = |(_, endings): &&(Self, &[&str])| endings.iter().any(|e| e.eq_ignore_ascii_case(ending));
        Self::ALL.iter().find(known).map(|&(format, _)| format)
    }

    /// True if values over 1 are kept, and always as linear light.
    pub fn is_float(self) -> bool {
        matches!(self, Self::Exr | Self::Hdr)
    }
}

/// How a film becomes a file.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Encoding {
    /// Which kind of file.
    pub format: Format,
    /// 16 bits a channel instead of 8 (PNG, PPM).
    pub deep: bool,
    /// The curve of integer formats; float formats are linear whatever it says.
    pub transfer: Transfer,
    /// Write alpha, `1 - transmit` (PNG, EXR), as POV-Ray's `+UA`. PNG holds the colour divided by alpha, EXR the colour as
    /// it is ("associated" alpha, as its standard says).
    pub alpha: bool,
}

/// Why a picture could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The file system said no.
    #[error(transparent)]
    File(#[from] FileError),
    /// The file is not a picture, or a broken one.
    #[error("{} is not a picture that can be read: {reason}", path.display())]
    Broken {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// The encoder failed.
    #[error("cannot make the picture file: {0}")]
    Encode(String),
}

#[cfg(test)]
mod tests;
