//! Pixels to rows of integer codes or floats: the part that all formats share.

use super::{Encoding, Format};
use crate::film::{Film, Pixel};
use crate::transfer::{Transfer, quantise};

/// Interleaved 8 or 16-bit codes, 3 channels a pixel or 4 with alpha; 16-bit ones big-endian, as PNG and PPM hold
/// them.
pub(super) fn integer_codes(film: &Film, encoding: &Encoding) -> Vec<u8> {
    if let Some(developer) = Developer::of(encoding, Transfer::LINEAR) {
        let mut codes = Vec::with_capacity(film.pixels.len());
        developer.develop(&film.pixels, &mut codes);
        return codes.into_flattened();
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

/// Turns pixels to the codes of a file of three 8-bit channels.
pub struct Developer(Steps);

impl Developer {
    /// Of an encoding that is of that kind, for pixels that stand for light as `working_space` says.
    pub fn of(encoding: &Encoding, working_space: Transfer) -> Option<Self> {
        let bytes = matches!(encoding.format, Format::Png | Format::Ppm | Format::Jpeg);
        (bytes && !encoding.alpha && !encoding.deep)
            .then(|| Self(Steps::new(encoding.transfer, working_space)))
    }

    /// Adds the pixels' codes to `codes`.
    pub fn develop(&self, pixels: &[Pixel], codes: &mut Vec<[u8; 3]>) {
        let Self(steps) = self;
        // sRGB is one step beyond a start at most: a loop that says so is laid out flat.
        match steps.beyond {
            1 => steps.codes(pixels, codes, 1),
            beyond => steps.codes(pixels, codes, beyond),
        }
    }
}

/// A transfer to 8-bit codes as the numbers at which the code changes, in whatever space those stand for light: the same codes without
/// a power a pixel, or two.
struct Steps {
    /// The least light of each code but 0, and infinity.
    first: [f32; 256],
    /// The code of the least light of each exponent and its highest bits of mantissa, from those of code 1 on.
    start: Vec<u8>,
    /// The least of these lights.
    least: f32,
    /// How many codes a light may be beyond that of its start.
    beyond: usize,
}

/// Bits of a float that do not tell its start: 1024 starts for each power of two, so that no two of sRGB's steps lie in one. (A light
/// before the first step or beyond a start's takes no other way than the rest: which it is would be guessed, mostly wrongly.)
const BELOW_START: u32 = 13;

/// Pixels that are coded together.
const TOGETHER: usize = 8;

/// Numbers of a pixel.
const CHANNELS: usize = 4;

impl Steps {
    fn new(transfer: Transfer, working_space: Transfer) -> Self {
        let code = |light: f32| quantise(transfer.encode(f64::from(working_space.decode_single(light))), 255);
        // Bits of floats from 0 to 1 are in the order of the floats, and so are the codes: bisect.
        let first_of = |wanted: u16| {
            let (mut below, mut at) = (0, 1f32.to_bits());
            while at - below > 1 {
                let middle = below.midpoint(at);
                if code(f32::from_bits(middle)) < wanted { below = middle } else { at = middle }
            }
            f32::from_bits(at)
        };
        let first: [f32; 256] =
            std::array::from_fn(|k| if k < 255 { first_of(k as u16 + 1) } else { f32::INFINITY });
        let starts = first[0].to_bits() >> BELOW_START..=1f32.to_bits() >> BELOW_START;
        let lights = starts.map(|start| f32::from_bits(start << BELOW_START));
        let least = lights.clone().next().unwrap_or_default();
        let mut code = 0;
        let start: Vec<u8> = lights
            .map(|light| {
                code += first[usize::from(code)..].iter().take_while(|&&first| light >= first).count() as u8;
                code
            })
            .collect();
        let beyond = start.iter().zip(&start[1..]).map(|(this, next)| usize::from(next - this)).max();
        Self { first, start, least, beyond: beyond.unwrap_or(0) }
    }

    /// Adds the pixels' codes to `codes`, each of which is at most `beyond` codes beyond that of its light's start.
    #[inline(always)]
    fn codes(&self, pixels: &[Pixel], codes: &mut Vec<[u8; 3]>, beyond: usize) {
        let (eights, rest) = pixels.as_chunks::<TOGETHER>();
        for eight in eights {
            // What needs no table comes first, for several at once. (What shows through is coded with the rest, and left out.)
            let mut lights: [f32; TOGETHER * CHANNELS] = bytemuck::cast(*eight);
            let mut starts = [0; TOGETHER * CHANNELS];
            for (light, start) in lights.iter_mut().zip(&mut starts) {
                *light = self.within(*light);
                *start = self.start_of(*light);
            }
            let mut coded = [[0; 3]; TOGETHER];
            for (k, pixel) in coded.iter_mut().enumerate() {
                for (channel, code) in pixel.iter_mut().enumerate() {
                    let place = k * CHANNELS + channel;
                    *code = self.code(lights[place], starts[place], beyond);
                }
            }
            codes.extend_from_slice(&coded);
        }
        codes.extend(rest.iter().map(|pixel| pixel.rgb.map(|light| self.code_of(light, beyond))));
    }

    /// The code of one light.
    #[inline(always)]
    fn code_of(&self, light: f32, beyond: usize) -> u8 {
        let light = self.within(light);
        self.code(light, self.start_of(light), beyond)
    }

    /// A light between the first step and 1; the former for NaN.
    #[inline(always)]
    fn within(&self, light: f32) -> f32 {
        // (`max` would ask for NaN once more.)
        let light = if light > self.least { light } else { self.least };
        if light < 1.0 { light } else { 1.0 }
    }

    /// Number of the start of such a light.
    #[inline(always)]
    fn start_of(&self, light: f32) -> u32 {
        (light.to_bits() >> BELOW_START) - (self.least.to_bits() >> BELOW_START)
    }

    /// The code of such a light with this start.
    #[inline(always)]
    fn code(&self, light: f32, start: u32, beyond: usize) -> u8 {
        let mut code = self.start.get(start as usize).copied().unwrap_or(255);
        for _ in 0..beyond {
            code += u8::from(light >= self.first[usize::from(code)]);
        }
        code
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
        let transfers = [Transfer::Srgb, Transfer::LINEAR, Transfer::Power(2.2), Transfer::Power(0.5)];
        for (transfer, space) in transfers.into_iter().flat_map(|a| transfers.map(|b| (a, b))) {
            let steps = Steps::new(transfer, space);
            let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1.0, 0.0, -0.0, f32::MIN_POSITIVE];
            let lights: Vec<_> = (0..=100_000).map(|k| k as f32 * 1.1e-5 - 0.05).chain(odd).collect();
            // (A number of pixels that eights leave some of.)
            let pixels = lights.windows(3).map(|rgb| Pixel { rgb: [rgb[0], rgb[1], rgb[2]], transmit: 0.5 });
            let (pixels, mut found) = (pixels.collect::<Vec<_>>(), Vec::new());
            Developer(steps).develop(&pixels, &mut found);
            assert!(pixels.len() % TOGETHER != 0 && found.len() == pixels.len());
            for (pixel, found) in pixels.iter().zip(found) {
                let expected = pixel
                    .rgb
                    .map(|x| quantise(transfer.encode(f64::from(space.decode_single(x))), 255) as u8);
                assert_eq!(found, expected, "{transfer:?} of {pixel:?} in {space:?}");
            }
        }
    }
}
