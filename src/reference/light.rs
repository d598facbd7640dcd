//! Lights: what arrives at a point if nothing is in the way.

use crate::scene::{Light, LightKind, Rgb};
use glam::DVec3;

/// Light on its way to a point.
pub struct Arriving {
    /// Unit, from the point towards the light.
    pub toward: DVec3,
    /// How far the light is, along `toward`. Negative behind a parallel light's plane.
    pub distance: f64,
    /// Its colour there.
    pub color: Rgb,
}

/// Light weaker than this in all channels counts as none (POV-Ray's bound).
const DARK: f64 = 1e-10;

/// True if no channel carries light worth a ray.
pub fn is_dark(color: Rgb) -> bool {
    color.abs().max_element() < DARK
}

/// What reaches `point` from `light`; `None` if it is dark there.
pub fn arriving(light: &Light, point: DVec3) -> Option<Arriving> {
    let axis = (light.point_at - light.location).normalize_or_zero();
    let to_light = light.location - point;
    let is_parallel = light.parallel || matches!(light.kind, LightKind::Cylinder { .. });
    let (toward, distance) = if is_parallel && axis != DVec3::ZERO {
        (-axis, -to_light.dot(axis))
    } else {
        (to_light.normalize_or_zero(), to_light.length())
    };
    let beam = match light.kind {
        LightKind::Point => 1.0,
        LightKind::Spot { radius, falloff, tightness } => {
            // The cosine from the axis, turned round behind a parallel light's plane.
            let cosine = if distance > 0.0 { -toward.dot(axis) } else { toward.dot(axis) };
            if cosine > 0.0 { cosine.powf(tightness) * spot_edge(radius, falloff, cosine) } else { 0.0 }
        }
        LightKind::Cylinder { radius, falloff, tightness } => {
            let along = -to_light.dot(axis);
            let from_axis = (-to_light - along * axis).length();
            let inward = 1.0 - from_axis / falloff;
            if along > 0.0 && from_axis < falloff {
                inward.powf(tightness) * cylinder_edge(radius, falloff, from_axis, inward)
            } else {
                0.0
            }
        }
    };
    let color = light.color * beam * fading(light, distance);
    (!is_dark(color)).then_some(Arriving { toward, distance, color })
}

fn spot_edge(radius: f64, falloff: f64, cosine: f64) -> f64 {
    let full = radius.cos();
    if full > 0.0 && cosine < full { smooth_step(falloff.cos(), full, cosine) } else { 1.0 }
}

fn cylinder_edge(radius: f64, falloff: f64, from_axis: f64, inward: f64) -> f64 {
    if radius > 0.0 && from_axis > radius { smooth_step(0.0, 1.0 - radius / falloff, inward) } else { 1.0 }
}

/// 0 below `lo`, 1 from `hi` on, a cubic with level ends between.
fn smooth_step(lo: f64, hi: f64, x: f64) -> f64 {
    if x < lo {
        0.0
    } else if x >= hi {
        1.0
    } else {
        let y = (x - lo) / (hi - lo);
        y * y * (3.0 - 2.0 * y)
    }
}

/// `2 / (1 + (d / distance)^power)`: over 1 nearer than the distance. Dark where that is no number.
fn fading(light: &Light, distance: f64) -> f64 {
    light.fade.map_or(1.0, |fade| {
        if fade.power > 0.0 && fade.distance.abs() > DARK {
            let fading = 2.0 / (1.0 + (distance / fade.distance).powf(fade.power));
            if fading.is_nan() { 0.0 } else { fading }
        } else {
            1.0
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Fade;

    /// At height 4, looking down.
    fn light(kind: LightKind) -> Light {
        Light {
            location: DVec3::Y * 4.0,
            color: Rgb::ONE,
            kind,
            point_at: DVec3::ZERO,
            parallel: false,
            shadowless: false,
            fade: None,
            more: None,
        }
    }

    /// What arrives on the ground at `x`.
    fn at(light: &Light, x: f64) -> f64 {
        arriving(light, DVec3::X * x).map_or(0.0, |arriving| arriving.color.x)
    }

    #[test]
    fn spot_is_full_within_its_radius_and_dark_beyond_its_falloff() {
        let (full, none) = (0.8f64.acos(), 0.6f64.acos());
        let spot = light(LightKind::Spot { radius: full, falloff: none, tightness: 2.0 });
        assert_eq!(at(&spot, 0.0), 1.0);
        // Cosine 0.8 at the rim of the full light.
        assert!((at(&spot, 3.0 - 1e-9) - 0.64).abs() < 1e-9);
        // Half way between the cosines the smooth step is a half.
        let between = 4.0 * (1.0f64 / 0.49 - 1.0).sqrt();
        assert!((at(&spot, between) - 0.5 * 0.49).abs() < 1e-12);
        assert_eq!(at(&spot, 5.34), 0.0);
        assert!(arriving(&spot, DVec3::Y * 5.0).is_none(), "behind the spot");
    }

    #[test]
    fn cylinder_is_measured_across_its_axis() {
        let beam = light(LightKind::Cylinder { radius: 1.0, falloff: 3.0, tightness: 1.0 });
        for (x, expected) in [(0.0, 1.0), (0.9, 0.7), (2.0, 1.0 / 3.0 * 0.5), (3.0, 0.0)] {
            assert!((at(&beam, x) - expected).abs() < 1e-12, "at {x}: {}", at(&beam, x));
        }
        let arriving = arriving(&beam, DVec3::new(0.5, 1.0, 0.0)).unwrap();
        assert_eq!((arriving.toward, arriving.distance), (DVec3::Y, 3.0));
    }

    #[test]
    fn fading_is_one_at_its_distance_and_two_at_most() {
        let mut point = light(LightKind::Point);
        point.fade = Some(Fade { distance: 5.0, power: 2.0 });
        assert!((at(&point, 3.0) - 1.0).abs() < 1e-15);
        assert!((at(&point, 0.0) - 2.0 / (1.0 + 0.64)).abs() < 1e-15);
    }
}
