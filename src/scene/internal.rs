//! POV-Ray's own functions of space, which `functions.inc` names: `function { internal(n) }`.
//!
//! Formulas as measured on POV-Ray 3.7: polynomials were fitted to its values, the rest follows from its shapes. Those
//! that are not here are refused.

use super::noise;
use glam::DVec3;

/// POV-Ray takes this off the distance from a rounded box (measured).
const ROUNDED_BOX_OFFSET: f64 = 1e-6;

/// Fields that have a strength stay within this (measured).
const FIELD_LIMIT: f64 = 10.0;

/// The value of `internal(number)` at `[x, y, z, parameters...]`; `None` if it is not modelled or has too few arguments.
pub fn value(number: u16, a: &[f64]) -> Option<f64> {
    let (xyz, p) = a.split_at_checked(3)?;
    let point = DVec3::new(xyz[0], xyz[1], xyz[2]);
    let rest = p.get(1..).unwrap_or(&[]);
    if let Some(value) = field(number, point, rest).or_else(|| curve(number, point, rest)) {
        return Some((p.first()? * value).clamp(-FIELD_LIMIT, FIELD_LIMIT));
    }
    if let Some(value) = algebraic_cylinder(number, point, p) {
        return Some(value);
    }
    distance(number, point, p)
}

/// Fields of space that are multiplied by a strength: polynomials. `p` are the parameters behind the strength.
fn field(number: u16, point: DVec3, p: &[f64]) -> Option<f64> {
    let DVec3 { x, y, z } = point;
    let (x2, y2, z2) = (x * x, y * y, z * z);
    let all = x2 + y2 + z2;
    let get = |i: usize| p.get(i).copied();
    // Of tori: the sum and difference of the squared radii.
    let radii = || {
        let (major, minor) = (get(0)?, get(1)?);
        Some((major * major + minor * minor, major * major - minor * minor))
    };
    Some(match number {
        // f_bicorn
        4 => {
            let s = get(0)?;
            let side = x2 + z2 + 2.0 * s * y - s * s;
            y2 * (s * s - x2 - z2) - side * side
        }
        // f_bifolia
        5 => get(0)? * y * (x2 + z2) - all * all,
        // f_boy_surface
        8 => get(0)? * boy(point),
        // f_crossed_trough
        11 => x2 * z2 - y,
        // f_cubic_saddle
        12 => y.powi(3) + z - x.powi(3),
        // f_cushion, f_odd
        13 | 43 => {
            let sheet = x2 - z;
            z2 * (x2 - z2) - 2.0 * z * (x2 - z2) + x2 - z2 - sheet * sheet - y2 * (y2 + 2.0 * x2 + z2)
                + 2.0 * y2 * z
                + y2
        }
        // f_devils_curve
        14 => y2 * (y2 - 0.25) - (x2 + z2) * (x2 + z2) + 0.36 * x2,
        // f_folium_surface
        20 => folium(x, y2 + z2, get(0)?, get(1)?),
        // f_glob
        22 => 0.5 * x2 * x2 * (x + 1.0) - y2 - z2,
        // f_heart
        23 => (0.1 * x2 + y2) * z.powi(3) - (x2 + all - 1.0).powi(3),
        // f_hunt_surface
        30 => -4.0 * (all - 13.0).powi(3) - 27.0 * (3.0 * x2 + y2 - 4.0 * z2 - 12.0).powi(2),
        // f_hyperbolic_torus
        31 => {
            let (sum, difference) = radii()?;
            2.0 * sum * (x2 - z2) - 2.0 * difference * y2 - difference.powi(2) - (x2 + y2 - z2).powi(2)
        }
        // f_kampyle_of_eudoxus
        33 => {
            let (a, b) = (get(0)?, get(1)?);
            b * b * x2 * (x2 - a * a) - y2 - z2
        }
        // f_klein_bottle
        35 => {
            let (outer, inner) = (all + 2.0 * y - 1.0, all - 2.0 * y - 1.0);
            -outer * (inner * inner - 8.0 * z2) - 16.0 * x * z * inner
        }
        // f_kummer_surface_v1, f_kummer_surface_v2
        36 | 37 => {
            let (squares, products, product) =
                if number == 36 { (-1.0, -1.0, 0.0) } else { (get(0)?, get(1)?, get(2)?) };
            let constant = if number == 36 { -1.0 } else { 1.0 };
            constant
                - (x2 * x2 + y2 * y2 + z2 * z2)
                - squares * all
                - products * (x2 * y2 + y2 * z2 + z2 * x2)
                - product * x * y * z
        }
        // f_lemniscate_of_gerono
        38 => x2 * (1.0 - x2) - y2 - z2,
        // f_mitre
        41 => y2 * (1.0 - y2 - z2) - 4.0 * x2 * all,
        // f_nodal_cubic
        42 => 6.0 * y * z - y.powi(3) - z.powi(3),
        // f_ovals_of_cassini
        44 => {
            let (a, b, c) = (get(0)?, get(1)?, get(2)?);
            let ring = all + a * a;
            c * a * a * (x2 + z2) + b * b - ring * ring
        }
        // f_paraboloid
        45 => y - x2 - z2,
        // f_parabolic_torus
        46 => {
            let (sum, difference) = radii()?;
            sum * (x2 - z) - difference * y2 - difference.powi(2) - (x2 + y2 - z).powi(2)
        }
        // f_pillow
        48 => x2 * x2 + y2 * y2 + z2 * z2 - all,
        // f_piriform
        49 => x2 * x * (x - 1.0) + y2 + z2,
        // f_quartic_paraboloid
        54 => y - x2 * x2 - z2 * z2,
        // f_quartic_saddle
        55 => y + z2 * z2 - x2 * x2,
        // f_quartic_cylinder
        56 => {
            let (a, b) = (get(0)?, get(1)?);
            a * a * b * b - (x2 + z2) * (y2 + b * b)
        }
        // f_steiners_roman
        65 => -(x2 * y2 + y2 * z2 + z2 * x2 + x * y * z),
        // f_strophoid
        66 => strophoid(x, y2 + z2, get(0)?, get(1)?, get(2)?),
        // f_torus2
        71 => {
            let (sum, difference) = radii()?;
            2.0 * sum * (x2 + z2) - 2.0 * difference * y2 - difference.powi(2) - all * all
        }
        // f_torus_gumdrop
        72 => {
            let r2 = y2 + z2;
            20.0 * all - 4.0 * x2 * x2 - 4.0 * r2 * r2 - 17.0 * x2 * r2 - 17.0
        }
        // f_umbrella
        73 => y * z2 - x2,
        // f_witch_of_agnesi
        74 => get(0)? * (1.0 - y) - y * (x2 + z2),
        _ => return None,
    })
}

/// Boy's surface (Apéry's polynomial of sixth degree).
fn boy(DVec3 { x, y, z }: DVec3) -> f64 {
    let (q, w, z2) = (x * x + y * y, 1.0 - z, z * z);
    let root = std::f64::consts::SQRT_2;
    64.0 * w.powi(3) * z.powi(3) - 48.0 * w * w * z2 * (3.0 * q + 2.0 * z2)
        + 12.0
            * w
            * z
            * (27.0 * q * q - 24.0 * z2 * q + 36.0 * root * y * z * (y * y - 3.0 * x * x) + 4.0 * z2 * z2)
        + (9.0 * q - 2.0 * z2)
            * (-81.0 * q * q - 72.0 * z2 * q + 108.0 * root * x * z * (x * x - 3.0 * y * y) + 4.0 * z2 * z2)
}

/// `r2` is the squared distance from the x axis.
fn folium(x: f64, r2: f64, neck: f64, divergence: f64) -> f64 {
    (1.0 + divergence) * x * x + r2 * (1.0 + x * (divergence - 4.0 * neck))
}

/// `r2` is the squared distance from the x axis.
fn strophoid(x: f64, r2: f64, size: f64, sharpness: f64, fatness: f64) -> f64 {
    (x - sharpness) * r2 + fatness * fatness * x * x * (x + size)
}

/// Fields of the xy plane that are multiplied by a strength. The last three of `p` say how the plane is turned about
/// the y axis.
fn curve(number: u16, point: DVec3, p: &[f64]) -> Option<f64> {
    let own = match number {
        15 | 21 | 34 | 39 | 75 => 2,
        50 | 67 => 3,
        _ => return None,
    };
    let (x, y) = revolved(point, p.get(own..)?)?;
    let (a, b) = (p[0], p[1]);
    let (x2, y2) = (x * x, y * y);
    Some(match number {
        // f_devils_curve_2d
        15 => y2 * (y2 - b * b) - x2 * (x2 - a * a),
        // f_folium_surface_2d
        21 => -folium(x, y2, a, b),
        // f_kampyle_of_eudoxus_2d
        34 => b * b * x2 * (x2 - a * b) - y2,
        // f_lemniscate_of_gerono_2d
        39 => b * b * x2 * (a * a - x2) - y2,
        // f_piriform_2d
        50 => p[2] * p[2] * x2 * x * (a + b * x) - y2,
        // f_strophoid_2d
        67 => strophoid(x, y2, a, b, p[2]),
        // f_witch_of_agnesi_2d
        _ => b - a * a * y - x2 * y,
    })
}

/// Fields of the xy plane that have a strength and a limit: `f_algbr_cyl2` to `f_algbr_cyl4`.
fn algebraic_cylinder(number: u16, point: DVec3, p: &[f64]) -> Option<f64> {
    if !(1..=3).contains(&number) {
        return None;
    }
    let (x, y) = revolved(point, p.get(2..)?)?;
    let (x2, y2) = (x * x, y * y);
    let value = match number {
        1 => 3.0 * x2 * y - 2.0 * x2 * x2 - y2 * (y - 1.0) * (y - 1.0),
        2 => x * y2 - x2 * y2 - (x2 - y) * (x2 - y),
        _ => y2 * y - 3.0 * x2 * y - (x2 + y2) * (x2 + y2),
    };
    let limit = p[1].abs();
    Some((p[0] * value).clamp(-limit, limit))
}

/// Where a point lies in the plane of a curve, given `[switch, offset, angle in degrees]`: in the xy plane, or with the
/// switch on at its distance from the y axis less the offset, turned by the angle.
fn revolved(DVec3 { x, y, z }: DVec3, sweep: &[f64]) -> Option<(f64, f64)> {
    let &[switch, offset, angle, ..] = sweep else { return None };
    if switch < 0.5 {
        return Some((x, y));
    }
    let (sin, cos) = angle.to_radians().sin_cos();
    let out = (x * x + z * z).sqrt() - offset;
    Some((out * cos - y * sin, out * sin + y * cos))
}

/// Functions without a strength.
fn distance(number: u16, p: DVec3, parameters: &[f64]) -> Option<f64> {
    let DVec3 { x, y, z } = p;
    let get = |i: usize| parameters.get(i).copied();
    let r2 = p.length_squared();
    // The squared distance with one axis counted otherwise than the other two, for each axis.
    let stretched = |axis: f64, others: f64| [x, y, z].map(|v| axis * v * v + others * (r2 - v * v));
    Some(match number {
        // f_blob: two bumps on the x axis
        6 => {
            let half = get(0)? / 2.0;
            let bump = |center: f64, strength: f64, inverse: f64| {
                let d = (p - DVec3::X * center).length_squared() * inverse * inverse;
                if d < 1.0 { strength * (1.0 - d) * (1.0 - d) } else { 0.0 }
            };
            -bump(-half, get(1)?, get(2)?) - bump(half, get(3)?, get(4)?)
        }
        // f_blob2
        7 => {
            let bump = |at: DVec3, inverse: f64| (-inverse * (p - at).length_squared()).exp();
            let inverse = get(1)?;
            get(3)? - get(2)? * (bump(DVec3::ZERO, inverse) + bump(DVec3::X * get(0)?, inverse))
        }
        // f_cross_ellipsoids, f_isect_ellipsoids: the nearest, the farthest of three
        10 | 32 => {
            let pick = if number == 10 { f64::min } else { f64::max };
            let [a, b, c] = stretched(1.0, get(0)?);
            get(3)? - get(2)? * (-get(1)? * pick(pick(a, b), c)).exp()
        }
        // f_ellipsoid
        17 => (p * DVec3::new(get(0)?, get(1)?, get(2)?)).length(),
        // f_flange_cover
        19 => {
            let inverse = get(1)?;
            let sum: f64 = stretched(1.0, get(0)?).iter().map(|q| (-inverse * q).exp()).sum();
            get(3)? - get(2)? * sum
        }
        // f_ph: the angle down from the y axis
        47 => x.hypot(z).atan2(y),
        // f_poly4
        51 => {
            let radius = get(0)? + y * (get(1)? + y * (get(2)? + y * (get(3)? + y * get(4)?)));
            (x * x + z * z).sqrt() - radius
        }
        // f_r
        57 => p.length(),
        // f_rounded_box
        60 => {
            let radius = get(0)?;
            let inner = DVec3::new(get(1)?, get(2)?, get(3)?) - radius;
            (p.abs() - inner).max(DVec3::ZERO).length() - radius - ROUNDED_BOX_OFFSET
        }
        // f_sphere
        61 => p.length() - get(0)?,
        // f_spikes_2d
        63 => {
            let (height, across, along, rate) = (get(0)?, get(1)?, get(2)?, get(3)?);
            y - height * (across * x).cos() * (along * z).cos() * (-rate * (x * x + z * z)).exp()
        }
        // f_superellipsoid
        68 => {
            let (e, n) = (get(0)?, get(1)?);
            let around = (x.abs().powf(2.0 / e) + y.abs().powf(2.0 / e)).powf(e / n);
            1.0 - (around + z.abs().powf(2.0 / n)).powf(n / 2.0)
        }
        // f_th: the angle about the y axis
        69 => x.atan2(z),
        // f_torus
        70 => (x.hypot(z) - get(0)?).hypot(y) - get(1)?,
        // f_noise3d
        76 => noise::noise(p),
        // f_noise_generator
        78 => match get(0)? as i64 {
            1 => noise::original_noise(p),
            _ => noise::noise(p),
        },
        _ => return None,
    })
}

/// True if [`value`] knows it.
pub fn is_modelled(number: u16) -> bool {
    value(number, &[0.5; 16]).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Printed by POV-Ray 3.7 at <0.3, 0.5, 0.7>.
    #[test]
    fn values_are_pov_ray_s() {
        let table: [(u16, &[f64], f64); 14] = [
            (12, &[1.1], 0.87780000000000),
            (17, &[1.1, 1.2, 1.3], 1.13885907820063),
            (45, &[1.1], -0.08800000000000),
            (47, &[], 0.98984277264978),
            (54, &[1.1], 0.27698000000000),
            (55, &[1.1], 0.80520000000000),
            (57, &[], 0.91104335791443),
            (60, &[0.1, 0.4, 0.45, 0.5], 0.23540919662497),
            (61, &[1.1], -0.18895664208557),
            (68, &[0.6, 0.8], 0.17919365841127),
            (69, &[], 0.40489178628508),
            (70, &[1.1, 0.3], 0.30376312963772),
            (76, &[], 0.53782843244855),
            (78, &[1.0], 0.54551210673408),
        ];
        for (number, parameters, expected) in table {
            let arguments = [&[0.3, 0.5, 0.7], parameters].concat();
            // The noise table has seven digits, POV-Ray printed fourteen.
            let within = if number >= 76 { 1e-6 } else { 1e-13 };
            let found = value(number, &arguments).unwrap();
            assert!((found - expected).abs() < within, "internal({number}): {found}");
        }
    }
}
