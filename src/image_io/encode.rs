//! A film to the bytes of a file.

use super::codes::{float_codes, integer_codes};
use super::{Encoding, Format, ImageError, png};
use crate::file_io::replace_file;
use crate::film::{Film, Picture};
use image::ExtendedColorType::{Rgb8, Rgb32F, Rgba32F};
use image::ImageEncoder;
use std::io::Cursor;
use std::path::Path;

/// JPEG's 0 to 100; 95 leaves errors of a code or two on smooth pictures.
const JPEG_QUALITY: u8 = 95;

/// The whole file's bytes.
///
/// # Errors
/// If the format cannot hold the picture (JPEG: over 65535 pixels a side).
pub fn encode(film: &Film, encoding: &Encoding) -> Result<Vec<u8>, ImageError> {
    // What the format cannot hold is dropped here, once, instead of being a case below.
    let encoding = &Encoding {
        alpha: encoding.alpha && matches!(encoding.format, Format::Png | Format::Exr),
        deep: encoding.deep && matches!(encoding.format, Format::Png | Format::Ppm),
        ..*encoding
    };
    let size = (side(film.width)?, side(film.height)?);
    match encoding.format {
        Format::Png | Format::Ppm | Format::Jpeg => of_codes(size, &integer_codes(film, encoding), encoding),
        Format::Exr | Format::Hdr => of_light(size, film, encoding),
    }
}

/// The same of pixels that a [`Developer`](super::Developer) of `encoding` has turned to codes.
///
/// # Errors
/// As [`encode`].
pub fn encode_developed(picture: &Picture<[u8; 3]>, encoding: &Encoding) -> Result<Vec<u8>, ImageError> {
    let size = (side(picture.width)?, side(picture.height)?);
    of_codes(size, picture.pixels.as_flattened(), encoding)
}

/// A file of integers.
fn of_codes((width, height): (u32, u32), codes: &[u8], encoding: &Encoding) -> Result<Vec<u8>, ImageError> {
    let mut file = Vec::new();
    match encoding.format {
        Format::Ppm => {
            let highest = if encoding.deep { 65535 } else { 255 };
            let head = format!("P6\n{width} {height}\n{highest}\n");
            return Ok([head.as_bytes(), codes].concat());
        }
        Format::Jpeg => image::codecs::jpeg::JpegEncoder::new_with_quality(&mut file, JPEG_QUALITY)
            .write_image(codes, width, height, Rgb8)
            .map_err(failed)?,
        _ => png::write(&mut file, (width, height), codes, encoding)?,
    }
    Ok(file)
}

/// A file of floats.
fn of_light((width, height): (u32, u32), film: &Film, encoding: &Encoding) -> Result<Vec<u8>, ImageError> {
    let mut file = Cursor::new(Vec::new());
    match encoding.format {
        Format::Exr => {
            let values = float_codes(film, encoding.alpha);
            let color = if encoding.alpha { Rgba32F } else { Rgb32F };
            image::codecs::openexr::OpenExrEncoder::new(&mut file)
                .write_image(bytemuck::cast_slice(&values), width, height, color)
                .map_err(failed)?;
        }
        _ => {
            // Radiance has neither negative light nor NaN.
            let cut = |value: f32| if value > 0.0 { value.min(f32::MAX) } else { 0.0 };
            let values: Vec<_> = film.pixels.iter().map(|pixel| image::Rgb(pixel.rgb.map(cut))).collect();
            image::codecs::hdr::HdrEncoder::new(&mut file)
                .encode(&values, film.width, film.height)
                .map_err(failed)?;
        }
    }
    Ok(file.into_inner())
}

/// Writes the file at `path`, whole or not at all.
///
/// # Errors
/// If the picture cannot be encoded or the file not be written; what stood at `path` is then as it was.
pub fn write(path: &Path, film: &Film, encoding: &Encoding) -> Result<(), ImageError> {
    Ok(replace_file(path, &encode(film, encoding)?)?)
}

fn side(pixels: usize) -> Result<u32, ImageError> {
    u32::try_from(pixels).map_err(|_| ImageError::Encode(format!("a side of {pixels} pixels is too long")))
}

fn failed(error: image::ImageError) -> ImageError {
    ImageError::Encode(error.to_string())
}
