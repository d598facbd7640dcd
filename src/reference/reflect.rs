//! How much a surface mirrors.

use super::surface::metallic;
use crate::scene::{Finish, Rgb};

/// A mirror's answer at one angle.
pub struct Reflectivity {
    /// What the reflected light is multiplied by.
    pub color: Rgb,
    /// What the ray's weight is multiplied by. Without Fresnel this is the larger of the two ends, not the value at the
    /// angle (POV-Ray's rule).
    pub weight: f64,
}

/// The reflection of a finish, seen at `cosine` from the normal.
///
/// `relative_ior` is that of the far side over that of the near side; only `fresnel` asks.
pub fn reflectivity(finish: &Finish, cosine: f64, relative_ior: f64, pigment: Rgb) -> Reflectivity {
    let reflection = &finish.reflection;
    let (min, max) = (reflection.min, reflection.max);
    let (color, weight) = if reflection.fresnel {
        let color = match fresnel(cosine, relative_ior) {
            Some(share) => share * max + (1.0 - share) * min,
            None => max,
        };
        (color, color.max_element())
    } else {
        let grazing = (1.0 - cosine).max(0.0).powf(reflection.falloff);
        (grazing * max + (1.0 - grazing) * min, max.max_element().max(min.max_element()))
    };
    Reflectivity { color: color * metallic(reflection.metallic, cosine, pigment), weight }
}

/// Fresnel's law for unpolarised light; `None` is total reflection.
fn fresnel(cosine: f64, ior: f64) -> Option<f64> {
    let (c, s) = (cosine, ior * ior + cosine * cosine - 1.0);
    if !(s > 0.0) {
        return None;
    }
    let g = s.sqrt();
    let perpendicular = (g - c) / (g + c);
    let ratio = (c * (g + c) - 1.0) / (c * (g - c) + 1.0);
    Some((0.5 * perpendicular * perpendicular * (1.0 + ratio * ratio)).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Reflection;

    fn at(fresnel: bool, cosine: f64, ior: f64) -> f64 {
        let reflection = Reflection { max: Rgb::ONE, fresnel, falloff: 2.0, ..Reflection::default() };
        let finish = Finish { reflection, ..Finish::default() };
        reflectivity(&finish, cosine, ior, Rgb::ONE).color.x
    }

    #[test]
    fn glass_mirrors_four_per_cent_head_on_and_all_at_grazing() {
        for ior in [1.5, 1.0 / 1.5] {
            assert!((at(true, 1.0, ior) - 0.04).abs() < 1e-15);
        }
        assert!((at(true, 0.0, 1.5) - 1.0).abs() < 1e-15);
        assert_eq!(at(true, 1.0, 1.0), 0.0);
    }

    #[test]
    fn beyond_the_critical_angle_all_is_mirrored() {
        let critical = (1.0 - (2.0f64 / 3.0).powi(2)).sqrt();
        assert!(at(true, critical + 1e-3, 1.0 / 1.5) < 1.0);
        assert_eq!(at(true, critical - 1e-3, 1.0 / 1.5), 1.0);
    }

    #[test]
    fn without_fresnel_the_falloff_leads_from_min_to_max() {
        for (cosine, expected) in [(1.0, 0.0), (0.5, 0.25), (0.0, 1.0)] {
            assert_eq!(at(false, cosine, 1.5), expected);
        }
    }
}
