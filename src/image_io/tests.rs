//! Every format there and back, and what files look like from outside.

use super::*;
use crate::film::{Film, Pixel};

/// Six pixels: dark, middling, bright, over 1, and two half transparent.
fn film() -> Film {
    let pixel = |rgb, transmit| Pixel { rgb, transmit };
    let pixels = vec![
        pixel([0.0, 0.001, 0.003], 0.0),
        pixel([0.18, 0.5, 0.75], 0.0),
        pixel([1.0, 0.25, 0.0], 0.0),
        pixel([4.0, 2.5, 1.5], 0.0),
        pixel([0.25, 0.125, 0.0], 0.5),
        pixel([0.0, 0.0, 0.0], 1.0),
    ];
    Film { width: 3, height: 2, pixels }
}

fn there_and_back(encoding: &Encoding, assume: Assume) -> Film {
    decode(&encode(&film(), encoding).unwrap(), assume).unwrap()
}

/// Largest difference of the colours after cutting the original at `most`.
fn largest_difference(back: &Film, most: f32) -> f32 {
    assert_eq!((back.width, back.height), (3, 2));
    let original = film();
    let pairs = back.pixels.iter().zip(&original.pixels);
    let apart = pairs.flat_map(|(a, b)| [0, 1, 2].map(|c| (a.rgb[c] - b.rgb[c].min(most)).abs()));
    apart.fold(0.0, f32::max)
}

#[test]
fn integer_formats_come_back_within_half_a_step() {
    let transfers = [Transfer::Srgb, Transfer::LINEAR, Transfer::Power(2.2)];
    for (format, transfer) in [Format::Png, Format::Ppm].into_iter().flat_map(|f| transfers.map(|t| (f, t))) {
        for deep in [false, true] {
            let encoding = Encoding { format, deep, transfer, alpha: false };
            // PNG says what its codes mean, PPM has to be told.
            let assume = if format == Format::Png { Assume::File } else { Assume::Transfer(transfer) };
            // Half a step of code, times the steepest slope of code to light: 2.28 (sRGB), 2.2, 1.
            let allowed = 0.5 / if deep { 65535.0 } else { 255.0 } * 2.3;
            let off = largest_difference(&there_and_back(&encoding, assume), 1.0);
            assert!(off <= allowed, "{encoding:?}: {off} > {allowed}");
        }
    }
}

#[test]
fn exr_comes_back_exactly() {
    let back =
        there_and_back(&Encoding { format: Format::Exr, alpha: true, ..Encoding::default() }, Assume::File);
    assert_eq!(back, film());
    let back = there_and_back(&Encoding { format: Format::Exr, ..Encoding::default() }, Assume::File);
    assert_eq!(largest_difference(&back, f32::MAX), 0.0);
    assert!(back.pixels.iter().all(|p| p.transmit == 0.0));
}

#[test]
fn hdr_comes_back_within_its_shared_exponent() {
    let back = there_and_back(&Encoding { format: Format::Hdr, ..Encoding::default() }, Assume::File);
    // 8 bits of mantissa: at most 1/128 of the pixel's largest channel, 4.
    let off = largest_difference(&back, f32::MAX);
    assert!(off <= 4.0 / 128.0, "{off}");
}

#[test]
fn jpeg_comes_back_as_a_picture() {
    let back = there_and_back(&Encoding { format: Format::Jpeg, ..Encoding::default() }, Assume::File);
    // Six unlike pixels are the worst that can happen to a lossy format; this only tells a picture from noise.
    assert!(largest_difference(&back, 1.0) < 0.3);
}

#[test]
fn alpha_is_stored_unassociated_in_png() {
    let file = encode(&film(), &Encoding { alpha: true, ..Encoding::default() }).unwrap();
    let picture = image::load_from_memory(&file).unwrap().into_rgba8();
    // As POV-Ray's +UA: half transparent, premultiplied .25 is .5 in light, code 188; nothing at all is black.
    assert_eq!(picture.get_pixel(1, 1).0, [188, 137, 0, 128]);
    assert_eq!(picture.get_pixel(2, 1).0, [0, 0, 0, 0]);
    assert_eq!(picture.get_pixel(2, 0).0, [255, 137, 0, 255]);
}

#[test]
fn alpha_comes_back_associated() {
    let back = there_and_back(&Encoding { deep: true, alpha: true, ..Encoding::default() }, Assume::File);
    assert!((back.pixels[4].transmit - 0.5).abs() < 1e-5 && (back.pixels[4].rgb[0] - 0.25).abs() < 3e-5);
}

#[test]
fn povrays_gama_chunks_are_honoured() {
    let png = |transfer| encode(&film(), &Encoding { transfer, ..Encoding::default() }).unwrap();
    assert_eq!(super::png::transfer_of(&png(Transfer::Srgb)), Some(Transfer::Srgb));
    // 1/2.2 is held as 45455 hundred-thousandths.
    assert_eq!(super::png::transfer_of(&png(Transfer::Power(2.2))), Some(Transfer::Power(1.0 / 0.45455)));
    assert_eq!(super::png::transfer_of(&png(Transfer::LINEAR)), Some(Transfer::LINEAR));
    assert_eq!(super::png::transfer_of(&png(Transfer::AsIs)), None);
}

#[test]
fn broken_files_are_told_not_panicked_at() {
    let whole = encode(&film(), &Encoding::default()).unwrap();
    for broken in [&b""[..], b"P6\n", b"P6\n99999999 99999999\n255\n", b"hello", &whole[..40]] {
        assert!(decode(broken, Assume::File).is_err());
    }
}

#[test]
fn formats_are_known_by_their_endings() {
    let of = |name: &str| Format::of_path(Path::new(name));
    assert_eq!(of("a/b.PNG"), Some(Format::Png));
    assert_eq!(of("b.c.jpeg"), Some(Format::Jpeg));
    assert_eq!((of("png"), of("x.gif"), of(".exr")), (None, None, None));
}
