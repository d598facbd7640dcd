//! POV-Ray's own functions of space, which `functions.inc` names: `function { internal(n) }`.
//!
//! Formulas as measured on POV-Ray 3.7: polynomials were fitted to its values, the rest follows from its shapes. Each is
//! written over [`Number`], so that one text serves a point and eight points. A number without a function is refused.

mod curve;
mod distance;
mod field;
mod multifractal;
mod winding;

use super::noise;
use super::number::{self, Number};

/// Fields that have a strength stay within this (measured).
const FIELD_LIMIT: f64 = 10.0;

/// The value of `internal(number)` at `[x, y, z, parameters...]`; `None` if it is not modelled or has too few arguments.
pub fn value<T: Number>(number: u16, a: &[T]) -> Option<T> {
    let (xyz, p) = a.split_at_checked(3)?;
    let point = [xyz[0], xyz[1], xyz[2]];
    let rest = p.get(1..).unwrap_or(&[]);
    if let Some(value) = field::value(number, point, rest).or_else(|| curve::value(number, point, rest)) {
        return Some((*p.first()? * value).within(T::lit(FIELD_LIMIT)));
    }
    curve::limited(number, point, p)
        .or_else(|| distance::value(number, point, p))
        .or_else(|| winding::value(number, point, p))
        .or_else(|| multifractal::value(number, point, p))
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
