//! PNG with the chunks that say what its codes mean: `sRGB`, or `gAMA` as POV-Ray writes it.

use super::{Encoding, ImageError};
use crate::transfer::Transfer;
use png::{BitDepth, ColorType, ScaledFloat, SrgbRenderingIntent};
use std::io::{Cursor, Write};

pub(super) fn write(
    file: &mut impl Write,
    (width, height): (u32, u32),
    codes: &[u8],
    encoding: &Encoding,
) -> Result<(), ImageError> {
    let failed = |error: png::EncodingError| ImageError::Encode(error.to_string());
    let mut encoder = png::Encoder::new(file, width, height);
    encoder.set_color(if encoding.alpha { ColorType::Rgba } else { ColorType::Rgb });
    encoder.set_depth(if encoding.deep { BitDepth::Sixteen } else { BitDepth::Eight });
    // A tenth of the time of the default, for files some tenths longer.
    encoder.set_compression(png::Compression::Fast);
    match encoding.transfer {
        Transfer::Srgb => encoder.set_source_srgb(SrgbRenderingIntent::Perceptual),
        Transfer::Power(gamma) => {
            // `ScaledFloat::new` would cut 45454.5 off; the standard's rounding is 45455.
            encoder.set_source_gamma(ScaledFloat::from_scaled((100_000.0 / gamma).round() as u32));
        }
        Transfer::AsIs => {}
    }
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(codes).map_err(failed)?;
    writer.finish().map_err(failed)
}

/// What the file's chunks say of its codes; `None` if they say nothing. `sRGB` comes before `gAMA`, as its standard
/// has it: POV-Ray writes both by default, and `gAMA` alone under `File_Gamma`.
pub(super) fn transfer_of(bytes: &[u8]) -> Option<Transfer> {
    let reader = png::Decoder::new(Cursor::new(bytes)).read_info().ok()?;
    let info = reader.info();
    if info.srgb.is_some() {
        return Some(Transfer::Srgb);
    }
    // In hundred-thousandths of the encoding exponent; the decoder drops a 0.
    let exponent = f64::from(info.gama_chunk?.into_scaled()) / 100_000.0;
    Some(Transfer::Power(1.0 / exponent))
}
