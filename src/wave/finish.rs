//! What finishes do to light, eight times at once (formulas as measured on POV-Ray 3.7: manual section 3.4.6.3).
//!
//! Angles, and what is steep in them, are in the precision that rays are traced in; what light is multiplied by is not.

use crate::lane::{Lane, Vec3, f32x8};
use crate::scene::{Finish, Rgb};
use crate::texture::Colors;

/// True if light that falls on it goes to the eye.
pub fn answers_light(finish: &Finish) -> bool {
    finish.diffuse != 0.0 || finish.diffuse_back != 0.0 || finish.phong != 0.0 || finish.specular != 0.0
}

/// POV-Ray's tint of metallic highlights and reflections at the angle whose cosine is `cos`: white at grazing angles.
pub fn metal<L: Lane>(cos: L, colors: &Colors, metallic: f64) -> Vec3<f32x8> {
    let one = L::lit(1.0);
    let cos = cos.min(one).max(-one);
    let x = cos.acos().abs() / L::lit(std::f64::consts::FRAC_PI_2);
    let d = x - L::lit(1.12);
    let f = (L::lit(0.014567225) / (d * d) - L::lit(0.011612903)).min(one).max(L::zero());
    let share: f32x8 = ((one - f) * L::lit(metallic)).cast();
    let one = f32x8::lit(1.0);
    colors.rgb.map(|c| one + share * (c - one))
}

/// Thin-film interference over a path of `cos` towards the light plus `cos` towards the eye.
pub fn interference<L: Lane>(finish: &Finish, path: L, wavelength: Rgb) -> Vec3<f32x8> {
    let phase = path * L::lit(std::f64::consts::TAU * finish.irid_thickness);
    let channel = |w: f64| L::lit(1.0) + (phase / L::lit(w)).sin_cos().1 * L::lit(finish.irid);
    Vec3::new(channel(wavelength.x), channel(wavelength.y), channel(wavelength.z)).cast()
}

/// Fresnel's reflectance of unpolarised light for a surface of relative index `ior` (Cook and Torrance 1982, A
/// reflectance model for computer graphics, section on Fresnel); 1 beyond the critical angle.
pub fn fresnel<L: Lane>(cos: L, ior: L) -> L {
    let one = L::lit(1.0);
    let square = ior * ior + cos * cos - one;
    let g = square.max(L::zero()).sqrt();
    let (minus, plus) = (g - cos, g + cos);
    let a = minus / plus;
    let b = (cos * plus - one) / (cos * minus + one);
    let f = (a * a * (one + b * b) * L::lit(0.5)).min(one).max(L::zero());
    square.gt(L::zero()).select(f, one)
}
