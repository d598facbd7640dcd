//! What a texture does at eight points.

use super::{PatternProgram, TextureTable};
use crate::lane::{LANES, Lane, Vec3, equal_lanes, f32x8};
use crate::scene::{Color, Finish, Opacity};

/// The layers of a texture, top layer first.
#[derive(Debug, Clone)]
pub struct Program {
    /// Never empty.
    pub layers: Vec<LayerProgram>,
}

/// One layer.
#[derive(Debug, Clone)]
pub struct LayerProgram {
    /// Its answer to light.
    pub finish: Finish,
    /// Where its highlights end.
    pub highlights: Highlights,
    /// Where its colours come from.
    pub pigment: PigmentProgram,
    /// What they leave of its own light: the scene's rule.
    pub opacity: Opacity,
}

/// The cosines at or below which a finish's highlights are as good as black, so that no power need be taken.
#[derive(Debug, Clone, Copy)]
pub struct Highlights {
    /// Between the light and the mirrored eye.
    pub least_phong: f64,
    /// Between the normal and the direction half-way from the light to the eye.
    pub least_specular: f64,
}

/// Highlights of less than this share of the light are below the last bit of what else a lit surface shows, in single
/// precision.
const NO_HIGHLIGHT: f64 = 1.0 / (1u64 << 32) as f64;

/// The cosine at which POV-Ray leaves out highlights of a large exponent.
const FAINT_PHONG: f64 = 0.0008;

impl Highlights {
    /// Of a finish, whether it has any or not.
    pub fn of(finish: &Finish) -> Self {
        // A power below 0 grows towards the rim.
        let least = |amount: f64, exponent: f64| {
            if exponent > 0.0 { (NO_HIGHLIGHT / amount).powf(1.0 / exponent).min(1.0) } else { 0.0 }
        };
        let faint = if finish.phong_size >= 60.0 { FAINT_PHONG } else { 0.0 };
        Self {
            least_phong: least(finish.phong, finish.phong_size).max(faint),
            least_specular: least(finish.specular, 1.0 / finish.roughness),
        }
    }
}

/// Where a layer's colours come from.
#[derive(Debug, Clone)]
pub enum PigmentProgram {
    /// From the texture's row: one colour.
    Plain,
    /// From the point.
    Pattern(Box<PatternProgram>),
}

/// Eight colours with filter and transmit, in single precision whatever rays are traced in (as POV-Ray's are).
#[derive(Debug, Clone, Copy, Default)]
pub struct Colors {
    /// Linear RGB.
    pub rgb: Vec3<f32x8>,
    /// Share of light that passes tinted.
    pub filter: f32x8,
    /// Share of light that passes untinted.
    pub transmit: f32x8,
}

impl Colors {
    /// The same colour in every lane.
    #[inline(always)]
    pub fn splat(color: &Color) -> Self {
        Self {
            rgb: Vec3::splat(color.rgb),
            filter: f32x8::lit(color.filter),
            transmit: f32x8::lit(color.transmit),
        }
    }

    /// The colour in a lane.
    pub fn lane(&self, lane: usize) -> Color {
        let of = |lanes: f32x8| f64::from(lanes.lanes()[lane]);
        Color { rgb: self.rgb.lane(lane), filter: of(self.filter), transmit: of(self.transmit) }
    }

    /// What the surface's own light is multiplied by.
    #[inline(always)]
    pub fn opacity(&self, rule: Opacity) -> f32x8 {
        match rule {
            Opacity::Share => f32x8::lit(1.0) - self.filter - self.transmit,
            Opacity::Filtered => f32x8::lit(1.0) - self.filter * self.rgb.max_element() - self.transmit,
        }
    }

    /// What light from behind is multiplied by.
    #[inline(always)]
    pub fn transmittance(&self) -> Vec3<f32x8> {
        let t = self.transmit;
        (self.rgb * self.filter).map(|c| c + t)
    }
}

impl LayerProgram {
    /// The colours of layer `layer` (0 on top) of eight textures that share this program, at `point` (compiled space), into
    /// `colors`: they are as large as a ray.
    #[inline]
    pub fn paint<L: Lane>(
        &self,
        table: &TextureTable,
        textures: &[u32; LANES],
        layer: usize,
        point: Vec3<L>,
        colors: &mut Colors,
    ) {
        *colors = match &self.pigment {
            PigmentProgram::Pattern(pattern) => pattern.colors(point),
            PigmentProgram::Plain if equal_lanes(textures, textures[0]) == !0 => {
                Colors::splat(&table.textures[textures[0] as usize].colors[layer])
            }
            PigmentProgram::Plain => {
                let color = |k: usize| &table.textures[textures[k] as usize].colors[layer];
                Colors {
                    rgb: Vec3::from_fn(|k| color(k).rgb),
                    filter: f32x8::from_fn(|k| color(k).filter as f32),
                    transmit: f32x8::from_fn(|k| color(k).transmit as f32),
                }
            }
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn highlights_end_where_their_power_is_next_to_nothing() {
        for (phong, phong_size, specular, roughness) in [(0.6, 40.0, 0.9, 0.002), (1e3, 1.0, 2.0, 0.5)] {
            let finish = Finish { phong, phong_size, specular, roughness, ..Finish::default() };
            let Highlights { least_phong, least_specular } = Highlights::of(&finish);
            let left =
                [phong * least_phong.powf(phong_size), specular * least_specular.powf(1.0 / roughness)];
            // A rounding of the cosine counts as often as the exponent says.
            left.iter().for_each(|left| assert!((left / NO_HIGHLIGHT - 1.0).abs() < 1e-12, "{left}"));
        }
    }

    #[test]
    fn powers_below_zero_have_no_end() {
        let finish =
            Finish { phong: 1.0, phong_size: -2.0, specular: 1.0, roughness: -1.0, ..Finish::default() };
        let Highlights { least_phong, least_specular } = Highlights::of(&finish);
        assert_eq!([least_phong, least_specular], [0.0, 0.0]);
    }
}
