//! The figures of a comparison, over all pixels and over those off edges.

use super::edge_mask;
use crate::film::Film;
use serde::Serialize;

/// The difference, in linear light, that counts as agreement with POV-Ray: half a step of an 8-bit file.
pub const WITHIN: f64 = 2e-3;

/// Two pictures held against each other. All light is linear.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Pixels per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Over every pixel.
    pub all: Difference,
    /// Over the pixels that are not on an edge of the expected picture ([`edge_mask`]).
    pub off_edges: Difference,
}

/// Figures over some of the pixels. A pixel's difference is that of its worst channel; alpha counts as a channel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Difference {
    /// How many pixels.
    pub pixels: usize,
    /// Root of the mean square over pixels and channels red, green and blue.
    pub rmse: f64,
    /// 99 % of the pixels differ by no more.
    pub p99: f64,
    /// 99.9 % of the pixels differ by no more.
    pub p999: f64,
    /// Share of pixels that differ by more than 1/255.
    pub over_1_255: f64,
    /// Share of pixels that differ by more than 4/255.
    pub over_4_255: f64,
    /// Share of pixels that differ by [`WITHIN`] or less; 1 if there are no pixels.
    pub within: f64,
    /// Largest difference.
    pub max: f64,
    /// Where that is, the first in reading order; `None` if nothing differs.
    pub worst: Option<Worst>,
}

/// The pixel that differs most.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Worst {
    /// Column, 0 at the left.
    pub x: usize,
    /// Row, 0 at the top.
    pub y: usize,
    /// Its colour in the expected picture.
    pub expected: [f32; 3],
    /// And in the actual one.
    pub actual: [f32; 3],
}

/// Holds `actual` against `expected`.
///
/// Neither is clipped: use [`clipped`] first if one comes from a file that ends at 1. A NaN differs infinitely from
/// everything but a NaN.
///
/// # Errors
/// If the sizes differ, saying both.
pub fn compare(expected: &Film, actual: &Film) -> Result<Comparison, String> {
    let (width, height) = (expected.width, expected.height);
    if (width, height) != (actual.width, actual.height) {
        return Err(format!(
            "the pictures differ in size: {width} by {height} and {} by {}",
            actual.width, actual.height
        ));
    }
    let edges = edge_mask(expected);
    let everywhere = 0..width * height;
    Ok(Comparison {
        width,
        height,
        all: difference(expected, actual, everywhere.clone()),
        off_edges: difference(expected, actual, everywhere.filter(|&i| !edges[i])),
    })
}

/// Light cut off at 0 and 1, as in an integer file.
pub fn clipped(mut film: Film) -> Film {
    for value in film.pixels.iter_mut().flat_map(|pixel| &mut pixel.rgb) {
        *value = value.clamp(0.0, 1.0);
    }
    film
}

fn difference(expected: &Film, actual: &Film, indices: impl Iterator<Item = usize>) -> Difference {
    let mut squares = 0.0;
    let mut largest: Vec<f64> = Vec::new();
    let (mut max, mut worst) = (0.0, None);
    for i in indices {
        let (e, a) = (expected.pixels[i], actual.pixels[i]);
        let colors = [0, 1, 2].map(|channel| apart(e.rgb[channel], a.rgb[channel]));
        squares += colors.iter().map(|d| d * d).sum::<f64>();
        let here = colors.into_iter().fold(apart(e.transmit, a.transmit), f64::max);
        if here > max {
            max = here;
            let (x, y) = (i % expected.width, i / expected.width);
            worst = Some(Worst { x, y, expected: e.rgb, actual: a.rgb });
        }
        largest.push(here);
    }
    largest.sort_unstable_by(f64::total_cmp);
    let pixels = largest.len();
    // Ranks from the sorted list: how many are at most `bound`.
    let up_to = |bound: f64| largest.partition_point(|&d| d <= bound);
    let share = |count: usize, of_none: f64| if pixels == 0 { of_none } else { count as f64 / pixels as f64 };
    Difference {
        pixels,
        rmse: share_of(squares, 3 * pixels).sqrt(),
        p99: rank(pixels * 99, 100).map_or(0.0, |rank| largest[rank]),
        p999: rank(pixels * 999, 1000).map_or(0.0, |rank| largest[rank]),
        over_1_255: share(pixels - up_to(1.0 / 255.0), 0.0),
        over_4_255: share(pixels - up_to(4.0 / 255.0), 0.0),
        within: share(up_to(WITHIN), 1.0),
        max,
        worst,
    }
}

/// Row of a quantile in a sorted list, `None` if the list is empty.
fn rank(of: usize, per: usize) -> Option<usize> {
    of.div_ceil(per).checked_sub(1)
}

fn share_of(sum: f64, count: usize) -> f64 {
    if count == 0 { 0.0 } else { sum / count as f64 }
}

/// How far two numbers are apart; a NaN infinitely, but from another.
pub fn apart(a: f32, b: f32) -> f64 {
    let apart = (f64::from(a) - f64::from(b)).abs();
    match (a.is_nan(), b.is_nan()) {
        (false, false) if !apart.is_nan() => apart,
        // Two infinities of one sign, or two NaN, are the same.
        (false, false) | (true, true) => 0.0,
        _ => f64::INFINITY,
    }
}
