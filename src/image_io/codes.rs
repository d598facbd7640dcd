//! Pixels to rows of integer codes or floats: the part that all formats share.

use super::Encoding;
use crate::film::{Film, Pixel};
use crate::transfer::{Transfer, quantise};

/// Interleaved 8 or 16-bit codes, 3 channels a pixel or 4 with alpha; 16-bit ones big-endian, as PNG and PPM hold
/// them.
pub(super) fn integer_codes(film: &Film, encoding: &Encoding) -> Vec<u8> {
    if !encoding.alpha && !encoding.deep {
        let steps = Steps::new(encoding.transfer);
        return film.pixels.iter().flat_map(|pixel| pixel.rgb.map(|value| steps.code(value))).collect();
    }
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

/// A transfer to 8-bit codes as the lights at which the code changes: the same codes without a power a pixel.
struct Steps([f32; 255]);

impl Steps {
    fn new(transfer: Transfer) -> Self {
        let code = |light: f32| quantise(transfer.encode(f64::from(light)), 255);
        // Bits of floats from 0 to 1 are in the order of the floats, and so are the codes: bisect.
        let first_of = |wanted: u16| {
            let (mut below, mut at) = (0, 1f32.to_bits());
            while at - below > 1 {
                let middle = below.midpoint(at);
                if code(f32::from_bits(middle)) < wanted { below = middle } else { at = middle }
            }
            f32::from_bits(at)
        };
        Self(std::array::from_fn(|k| first_of(k as u16 + 1)))
    }

    fn code(&self, light: f32) -> u8 {
        self.0.partition_point(|&first| light >= first) as u8
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_give_the_codes_of_the_curve() {
        for transfer in [Transfer::Srgb, Transfer::LINEAR, Transfer::Power(2.2)] {
            let steps = Steps::new(transfer);
            let lights = (0..=100_000).map(|k| k as f32 * 1.1e-5 - 0.05);
            for light in
                lights.chain([f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1.0, 0.0, f32::MIN_POSITIVE])
            {
                let expected = quantise(transfer.encode(f64::from(light)), 255);
                assert_eq!(u16::from(steps.code(light)), expected, "{transfer:?} of {light}");
            }
        }
    }
}
