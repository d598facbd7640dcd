//! Where a picture has silhouettes, shadow borders and texture edges.

use crate::film::Film;

/// Contrast in linear light, in any channel, that makes two neighbours an edge: ten times the difference that
/// [`super::WITHIN`] allows, so that what it hides would need a step it can see, and small enough to find the border of
/// a soft shadow only where it is steep.
pub const EDGE_CONTRAST: f32 = 0.02;

/// True for each pixel that differs from any of its eight neighbours by more than [`EDGE_CONTRAST`].
///
/// Which side of such an edge a pixel's middle falls on can hang on the last bit, so errors there are counted apart.
pub fn edge_mask(film: &Film) -> Vec<bool> {
    let (width, height) = (film.width, film.height);
    let is_edge = |x: usize, y: usize| {
        let here = film.pixel(x, y).rgb;
        let columns = x.saturating_sub(1)..=(x + 1).min(width - 1);
        let mut rows = y.saturating_sub(1)..=(y + 1).min(height - 1);
        rows.any(|row| {
            columns.clone().any(|column| contrast(here, film.pixel(column, row).rgb) > EDGE_CONTRAST)
        })
    };
    (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| is_edge(x, y)).collect()
}

fn contrast(a: [f32; 3], b: [f32; 3]) -> f32 {
    [0, 1, 2].map(|channel| (a[channel] - b[channel]).abs()).into_iter().fold(0.0, f32::max)
}
