//! Picture files to films in linear light.

use super::{ImageError, png};
use crate::file_io::{LONGEST_DATA, read_file};
use crate::film::{Film, Pixel};
use crate::transfer::Transfer;
use image::{DynamicImage, ImageFormat};
use std::path::Path;

/// What to take an integer file's codes for.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Assume {
    /// What the file says (PNG); sRGB if it says nothing.
    #[default]
    File,
    /// This, whatever the file says.
    Transfer(Transfer),
}

/// Reads PNG, EXR, HDR, PNM and JPEG, told apart by their first bytes.
///
/// # Errors
/// If the file cannot be read or is not such a picture.
pub fn read(path: &Path, assume: Assume) -> Result<Film, ImageError> {
    decode(&read_file(path, LONGEST_DATA)?, assume)
        .map_err(|reason| ImageError::Broken { path: path.into(), reason })
}

/// The same from a file's bytes. Alpha is multiplied into the colour; without alpha `transmit` is 0.
///
/// # Errors
/// What is wrong with the bytes.
pub fn decode(bytes: &[u8], assume: Assume) -> Result<Film, String> {
    let format = image::guess_format(bytes).map_err(|_| "it is not PNG, EXR, HDR, PPM or JPEG".to_owned())?;
    let picture = image::load_from_memory_with_format(bytes, format).map_err(|error| error.to_string())?;
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let associated_linear = matches!(format, ImageFormat::OpenExr | ImageFormat::Hdr);
    let pixels = if associated_linear {
        float_pixels(picture)
    } else {
        let said = if format == ImageFormat::Png { png::transfer_of(bytes) } else { None };
        integer_pixels(
            picture,
            match assume {
                Assume::File => said.unwrap_or_default(),
                Assume::Transfer(transfer) => transfer,
            },
        )
    };
    Ok(Film { width, height, pixels })
}

/// 8-bit codes are widened to 16 bits exactly (`c * 257`), so one table serves both.
fn integer_pixels(picture: DynamicImage, transfer: Transfer) -> Vec<Pixel> {
    let light: Vec<f64> = (0..=65535u32).map(|code| transfer.decode(f64::from(code) / 65535.0)).collect();
    let pixel = |codes: &[u16; 4]| {
        let alpha = f64::from(codes[3]) / 65535.0;
        let rgb = [0, 1, 2].map(|channel| (light[usize::from(codes[channel])] * alpha) as f32);
        Pixel { rgb, transmit: (1.0 - alpha) as f32 }
    };
    picture.into_rgba16().pixels().map(|p| pixel(&p.0)).collect()
}

fn float_pixels(picture: DynamicImage) -> Vec<Pixel> {
    let has_alpha = picture.color().has_alpha();
    let pixel = |[r, g, b, alpha]: [f32; 4]| Pixel {
        rgb: [r, g, b],
        transmit: if has_alpha { 1.0 - alpha } else { 0.0 },
    };
    picture.into_rgba32f().pixels().map(|p| pixel(p.0)).collect()
}
