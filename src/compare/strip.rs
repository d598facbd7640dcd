//! `expected | difference | actual`, side by side.

use crate::film::{Film, Pixel};

/// What differences are multiplied by, in linear light, to be seen: one of 1/20 is white, one of 2e-3 a dark grey.
pub const AMPLIFY: f32 = 20.0;

/// Columns of mid grey between the pictures.
const GAP: usize = 2;

/// The two pictures with their difference, channel by channel and amplified, between them; alpha is not shown.
///
/// # Panics
/// If the sizes differ; [`super::compare`] has told by then.
pub fn strip(expected: &Film, actual: &Film, amplify: f32) -> Film {
    let (width, height) = (expected.width, expected.height);
    assert_eq!((width, height), (actual.width, actual.height), "two sizes");
    let gap = Pixel { rgb: [0.2; 3], transmit: 0.0 };
    let mut pixels = Vec::with_capacity((3 * width + 2 * GAP) * height);
    for y in 0..height {
        let row = |film: &Film| film.pixels[y * width..][..width].to_vec();
        let (left, right) = (row(expected), row(actual));
        let between = left.iter().zip(&right).map(|(e, a)| {
            let rgb = [0, 1, 2].map(|c| (e.rgb[c] - a.rgb[c]).abs() * amplify);
            // A NaN must be seen, and would be written as black.
            Pixel { rgb: rgb.map(|d| if d.is_nan() { f32::INFINITY } else { d }), transmit: 0.0 }
        });
        let between: Vec<_> = between.collect();
        pixels.extend([left, vec![gap; GAP], between, vec![gap; GAP], right].concat());
    }
    Film { width: 3 * width + 2 * GAP, height, pixels }
}
