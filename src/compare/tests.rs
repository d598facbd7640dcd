//! Known pictures with known figures.

use super::*;
use crate::film::{Film, Pixel};

fn grey(width: usize, height: usize, value: impl Fn(usize, usize) -> f32) -> Film {
    let mut film = Film::new(width, height);
    for y in 0..height {
        for x in 0..width {
            film.pixels[y * width + x] = Pixel { rgb: [value(x, y); 3], transmit: 0.0 };
        }
    }
    film
}

#[test]
fn equal_pictures_do_not_differ() {
    let a = grey(7, 5, |x, y| (x * y) as f32);
    let found = compare(&a, &a).unwrap();
    assert_eq!((found.all.rmse, found.all.max, found.all.within, found.all.worst), (0.0, 0.0, 1.0, None));
}

#[test]
fn figures_of_one_wrong_pixel_in_a_hundred_and_one_of_them_in_one_channel() {
    let expected = grey(10, 20, |_, _| 0.5);
    let mut actual = expected.clone();
    actual.pixels[37].rgb[1] = 0.8;
    actual.pixels[12].rgb = [0.51; 3];
    let found = compare(&expected, &actual).unwrap().all;
    let close = |a: f64, b: f64| (a - b).abs() < 1e-7; // f32 pixels
    assert!(close(found.rmse, ((0.3f64.powi(2) + 3.0 * 0.01f64.powi(2)) / 600.0).sqrt()), "{found:?}");
    assert!(close(found.max, 0.3) && found.p99 == 0.0, "{found:?}");
    // .51 - .5 is over 1/255 = .0039 and under 4/255 = .0157.
    assert_eq!((found.over_1_255, found.over_4_255, found.within), (0.01, 0.005, 0.99));
    let worst = found.worst.unwrap();
    assert_eq!((worst.x, worst.y, worst.expected, worst.actual), (7, 3, [0.5; 3], [0.5, 0.8, 0.5]));
}

#[test]
fn errors_on_edges_are_counted_apart() {
    // A step between columns 3 and 4: both are edge, the other six columns are not.
    let expected = grey(8, 4, |x, _| if x < 4 { 0.2 } else { 0.6 });
    let actual = grey(8, 4, |x, _| if x < 5 { 0.2 } else { 0.6 });
    let found = compare(&expected, &actual).unwrap();
    assert_eq!((found.all.pixels, found.off_edges.pixels), (32, 24));
    assert_eq!((found.all.within, found.off_edges.within), (28.0 / 32.0, 1.0));
    // Away from the step the same error counts.
    let actual = grey(8, 4, |x, _| if x < 4 { 0.2 } else { 0.61 });
    assert_eq!(compare(&expected, &actual).unwrap().off_edges.within, 0.5);
}

#[test]
fn contrast_decides_what_an_edge_is() {
    let step = |height: f32| grey(2, 1, |x, _| x as f32 * height);
    assert_eq!(edge_mask(&step(EDGE_CONTRAST)), [false, false]);
    assert_eq!(edge_mask(&step(EDGE_CONTRAST * 1.01)), [true, true]);
}

#[test]
fn nan_and_infinity_are_seen() {
    let expected = grey(2, 2, |_, _| 0.5);
    let mut actual = expected.clone();
    actual.pixels[3].rgb[2] = f32::NAN;
    let found = compare(&expected, &actual).unwrap().all;
    assert_eq!((found.max, found.over_4_255), (f64::INFINITY, 0.25));
    assert!(strip(&expected, &actual, AMPLIFY).pixel(2 + 2 + 1, 1).rgb[2].is_infinite());
    let infinite = grey(2, 2, |_, _| f32::INFINITY);
    assert_eq!(compare(&infinite, &infinite).unwrap().all.max, 0.0);
}

#[test]
fn alpha_counts() {
    let expected = grey(2, 2, |_, _| 0.5);
    let mut actual = expected.clone();
    actual.pixels[0].transmit = 0.25;
    assert_eq!(compare(&expected, &actual).unwrap().all.max, 0.25);
}

#[test]
fn sizes_must_agree() {
    let said = compare(&Film::new(2, 3), &Film::new(3, 2)).unwrap_err();
    assert_eq!(said, "the pictures differ in size: 2 by 3 and 3 by 2");
}

#[test]
fn an_empty_picture_is_no_trouble() {
    assert_eq!(compare(&Film::new(0, 0), &Film::new(0, 0)).unwrap().all.within, 1.0);
}

#[test]
fn the_strip_shows_all_three() {
    let strip = strip(&grey(4, 3, |_, _| 0.5), &grey(4, 3, |_, _| 0.52), 20.0);
    assert_eq!((strip.width, strip.height), (16, 3));
    let at = |x| strip.pixel(x, 1).rgb[0];
    assert_eq!((at(0), at(15)), (0.5, 0.52));
    assert!((at(6) - 0.4).abs() < 1e-5); // 20 times .02, in f32
}
