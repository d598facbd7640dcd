//! Pixels to rows of integer codes or floats: the part that all formats share.

use super::Encoding;
use crate::film::{Film, Pixel};
use crate::transfer::quantise;

/// Interleaved 8 or 16-bit codes, 3 channels a pixel or 4 with alpha; 16-bit ones big-endian, as PNG and PPM hold
/// them.
pub(super) fn integer_codes(film: &Film, encoding: &Encoding) -> Vec<u8> {
    let channels = if encoding.alpha { 4 } else { 3 };
    let mut bytes = Vec::with_capacity(film.pixels.len() * channels * if encoding.deep { 2 } else { 1 });
    let mut put = |code: f64| {
        if encoding.deep {
            bytes.extend_from_slice(&quantise(code, 65535).to_be_bytes());
        } else {
            bytes.push(quantise(code, 255) as u8);
        }
    };
    for pixel in &film.pixels {
        let alpha = encoding.alpha.then(|| alpha_of(pixel));
        for value in pixel.rgb {
            put(encoding.transfer.encode(unassociated(f64::from(value), alpha)));
        }
        if let Some(alpha) = alpha {
            put(alpha);
        }
    }
    bytes
}

/// Interleaved linear floats, 3 channels a pixel or 4 with associated alpha.
pub(super) fn float_codes(film: &Film, alpha: bool) -> Vec<f32> {
    let mut values = Vec::with_capacity(film.pixels.len() * 4);
    for pixel in &film.pixels {
        values.extend_from_slice(&pixel.rgb);
        values.extend(alpha.then(|| alpha_of(pixel) as f32));
    }
    values
}

/// The colour without its alpha; nothing is seen of a pixel with alpha 0, so it is black.
fn unassociated(value: f64, alpha: Option<f64>) -> f64 {
    match alpha {
        None => value,
        Some(alpha) if alpha > 0.0 => value / alpha,
        Some(_) => 0.0,
    }
}

/// The pixel's alpha, 0 to 1.
fn alpha_of(pixel: &Pixel) -> f64 {
    (1.0 - f64::from(pixel.transmit)).clamp(0.0, 1.0)
}
