//! POV-Ray's own functions of space, which `functions.inc` names: `function { internal(n) }`.
//!
//! Formulas as measured on POV-Ray 3.7. Those that are not here are of little use outside of isosurfaces.

use super::noise;
use glam::DVec3;

/// POV-Ray takes this off the distance from a rounded box (measured).
const ROUNDED_BOX_OFFSET: f64 = 1e-6;

/// The value of `internal(number)` at `[x, y, z, parameters...]`; `None` if it is not modelled or has too few arguments.
pub fn value(number: u16, a: &[f64]) -> Option<f64> {
    if a.len() < 3 {
        return None;
    }
    let p = DVec3::new(a[0], a[1], a[2]);
    let DVec3 { x, y, z } = p;
    let parameter = |i: usize| a.get(3 + i).copied();
    Some(match number {
        // f_cubic_saddle
        12 => -parameter(0)? * (x.powi(3) - y.powi(3) - z),
        // f_ellipsoid
        17 => (p * DVec3::new(parameter(0)?, parameter(1)?, parameter(2)?)).length(),
        // f_paraboloid
        45 => -parameter(0)? * (x * x - y + z * z),
        // f_ph: the angle down from the y axis
        47 => x.hypot(z).atan2(y),
        // f_quartic_paraboloid
        54 => -parameter(0)? * (x.powi(4) + z.powi(4) - y),
        // f_quartic_saddle
        55 => -parameter(0)? * (x.powi(4) - z.powi(4) - y),
        // f_r
        57 => p.length(),
        // f_rounded_box
        60 => {
            let radius = parameter(0)?;
            let inner = DVec3::new(parameter(1)?, parameter(2)?, parameter(3)?) - radius;
            (p.abs() - inner).max(DVec3::ZERO).length() - radius - ROUNDED_BOX_OFFSET
        }
        // f_sphere
        61 => p.length() - parameter(0)?,
        // f_superellipsoid
        68 => {
            let (e, n) = (parameter(0)?, parameter(1)?);
            let around = (x.abs().powf(2.0 / e) + y.abs().powf(2.0 / e)).powf(e / n);
            1.0 - (around + z.abs().powf(2.0 / n)).powf(n / 2.0)
        }
        // f_th: the angle about the y axis
        69 => x.atan2(z),
        // f_torus
        70 => (x.hypot(z) - parameter(0)?).hypot(y) - parameter(1)?,
        // f_noise3d
        76 => noise::noise(p),
        // f_noise_generator
        78 => match parameter(0)? as i64 {
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
