//! The curves between light and the codes of picture files (sRGB: IEC 61966-2-1).
//!
//! Numbers in, numbers out: it knows neither films nor files.

/// How codes stand for light.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Transfer {
    /// The sRGB curve, POV-Ray's default for every 8 and 16-bit file.
    #[default]
    Srgb,
    /// `code = light^(1/gamma)`; 1 is linear, what POV-Ray writes under `File_Gamma=1.0`.
    Power(f64),
    /// Codes are the numbers themselves: a scene without gamma correction, written as it is.
    AsIs,
}

impl Transfer {
    /// Linear light in the code.
    pub const LINEAR: Self = Self::Power(1.0);

    /// The code, 0 to 1, of `light`; light outside 0 to 1 is cut off, NaN is black.
    pub fn encode(self, light: f64) -> f64 {
        // Written so that a NaN fails the comparison and becomes black.
        let light = if light > 0.0 { light.min(1.0) } else { 0.0 };
        match self {
            Self::Srgb if light <= 0.003_130_8 => 12.92 * light,
            Self::Srgb => 1.055 * light.powf(1.0 / 2.4) - 0.055,
            Self::Power(1.0) | Self::AsIs => light,
            Self::Power(gamma) => light.powf(1.0 / gamma),
        }
    }

    /// The light of `code`. Codes over 1 go on along the curve; those under 0 are black, but for the two
    /// transfers that change nothing.
    pub fn decode(self, code: f64) -> f64 {
        match self {
            Self::Srgb if code < 0.040_45 => code.max(0.0) / 12.92,
            Self::Srgb => ((code + 0.055) / 1.055).powf(2.4),
            Self::Power(1.0) | Self::AsIs => code,
            Self::Power(gamma) => code.max(0.0).powf(gamma),
        }
    }

    /// The same as a film holds it.
    pub fn decode_single(self, code: f32) -> f32 {
        self.decode(f64::from(code)) as f32
    }
}

/// The nearest of the codes `0..=highest` (255, 65535) to `code` in 0 to 1: `floor(highest * code + 1/2)`,
/// POV-Ray's rounding.
pub fn quantise(code: f64, highest: u16) -> u16 {
    // `as` saturates, and `code` comes clamped from `encode`.
    (code * f64::from(highest) + 0.5).floor() as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Codes POV-Ray 3.7.0.10 wrote (`+FP16 +W16`, sRGB) for linear greys, and the greys themselves, which it wrote
    /// under `File_Gamma=1.0`: the first row is the second through the curve.
    const POVRAY: [(u16, u16); 8] = [
        (32, 413),
        (359, 4291),
        (1104, 9006),
        (2314, 13562),
        (4022, 18009),
        (16298, 35114),
        (25943, 43389),
        (61114, 63552),
    ];

    #[test]
    fn srgb_gives_povrays_codes() {
        for (linear, code) in POVRAY {
            let got = quantise(Transfer::Srgb.encode(f64::from(linear) / 65535.0), 65535);
            // The linear code stands for all light that rounds to it; one more step for POV-Ray's f32.
            let edge = |light: f64| 65535.0 * Transfer::Srgb.encode(light / 65535.0);
            let allowed = (edge(f64::from(linear) + 0.5) - edge(f64::from(linear) - 0.5)) / 2.0 + 1.0;
            assert!(f64::from(got.abs_diff(code)) <= allowed, "{linear}: {got}, POV-Ray wrote {code}");
        }
    }

    #[test]
    fn all_256_codes_come_back() {
        for transfer in [Transfer::Srgb, Transfer::LINEAR, Transfer::Power(2.2), Transfer::AsIs] {
            for code in 0..=255u16 {
                let light = transfer.decode(f64::from(code) / 255.0);
                // Through f32, as a film holds it.
                assert_eq!(quantise(transfer.encode(f64::from(light as f32)), 255), code, "{transfer:?}");
            }
        }
    }

    #[test]
    fn light_is_cut_off_at_both_ends() {
        for (light, code) in
            [(-1.0, 0), (f64::NEG_INFINITY, 0), (f64::NAN, 0), (7.0, 255), (f64::INFINITY, 255)]
        {
            assert_eq!(quantise(Transfer::Srgb.encode(light), 255), code, "{light}");
        }
    }
}
