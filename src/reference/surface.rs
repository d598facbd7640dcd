//! How a lit surface answers: diffuse light, highlights, thin film (Phong 1975, Blinn 1977).

use crate::scene::{Color, Finish, Globals, Rgb};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, TAU};

/// From this `phong_size` on, cosines under [`PHONG_FLOOR`] give no highlight (POV-Ray's rule).
const LARGE_PHONG_SIZE: f64 = 60.0;
/// See [`LARGE_PHONG_SIZE`].
const PHONG_FLOOR: f64 = 0.0008;

/// Light that arrives at a surface.
#[derive(Debug, Clone, Copy)]
pub struct Lit {
    /// Unit, towards the viewer.
    pub normal: DVec3,
    /// Unit, the direction of sight.
    pub view: DVec3,
    /// Unit, towards the light.
    pub toward: DVec3,
    /// What arrives.
    pub light: Rgb,
    /// The light is on the far side: no highlights, and `diffuse_back` in place of `diffuse`.
    pub behind: bool,
    /// The light is a fill light: no highlights.
    pub fill: bool,
}

impl Lit {
    /// What the viewer sees of this light.
    pub fn answer(&self, finish: &Finish, color: &Color, globals: &Globals) -> Rgb {
        let Self { normal, view, toward, light, behind, fill } = *self;
        let cosine = normal.dot(toward);
        let amount = if behind { finish.diffuse_back } else { finish.diffuse };
        let mut sum = if amount != 0.0 {
            cosine.abs().powf(finish.brilliance) * amount * color.opacity(globals.opacity) * color.rgb * light
        } else {
            Rgb::ZERO
        };
        if !behind && !fill {
            sum += self.highlights(finish) * light * metallic(finish.metallic, cosine, color.rgb);
        }
        if finish.irid != 0.0 {
            sum *= interference(finish, cosine.abs() + normal.dot(view).abs(), globals.irid_wavelength);
        }
        sum
    }

    fn highlights(&self, finish: &Finish) -> f64 {
        let mut sum = 0.0;
        if finish.phong > 0.0 {
            let cosine = mirror(self.view, self.normal).dot(self.toward);
            if cosine > 0.0 && (finish.phong_size < LARGE_PHONG_SIZE || cosine > PHONG_FLOOR) {
                sum += finish.phong * cosine.powf(finish.phong_size);
            }
        }
        if finish.specular > 0.0 {
            let cosine = (self.toward - self.view).normalize_or_zero().dot(self.normal);
            if cosine > 0.0 {
                sum += finish.specular * cosine.powf(1.0 / finish.roughness);
            }
        }
        sum
    }
}

/// `dir` mirrored at the plane of unit `normal`.
pub fn mirror(dir: DVec3, normal: DVec3) -> DVec3 {
    dir - 2.0 * dir.dot(normal) * normal
}

/// The factor by which a metal tints a highlight or reflection seen at this cosine: its own colour but for grazing sight.
pub fn metallic(amount: f64, cosine: f64, color: Rgb) -> Rgb {
    if amount == 0.0 {
        return Rgb::ONE;
    }
    // POV-Ray's empirical stand-in for Fresnel's law, from the angle in units of a right angle.
    let x = cosine.clamp(-1.0, 1.0).acos().abs() / FRAC_PI_2;
    let grazing = (0.014567225 / ((x - 1.12) * (x - 1.12)) - 0.011612903).clamp(0.0, 1.0);
    1.0 + amount * (1.0 - grazing) * (color - 1.0)
}

/// What thin-film interference leaves of each channel, for light that comes and goes at cosines of sum `cosines`. It
/// multiplies mirrored light as well as direct (measured in POV-Ray 3.7).
pub fn interference(finish: &Finish, cosines: f64, wavelength: Rgb) -> Rgb {
    if finish.irid == 0.0 {
        return Rgb::ONE;
    }
    let path = TAU * finish.irid_thickness * cosines;
    1.0 + finish.irid * (path / wavelength).map(f64::cos)
}
