//! Fields of the xy plane. The last three parameters say how the plane is turned about the y axis.

use super::Number;
use super::field::{folium, strophoid};

/// Fields that are multiplied by a strength; `p` are the parameters behind it.
pub fn value<T: Number>(number: u16, point: [T; 3], p: &[T]) -> Option<T> {
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

/// Fields that have a strength and a limit: `f_algbr_cyl1` to `f_algbr_cyl4`.
pub fn limited<T: Number>(number: u16, point: [T; 3], p: &[T]) -> Option<T> {
    if number > 3 {
        return None;
    }
    let (x, y) = revolved(point, p.get(2..)?)?;
    let (x2, y2) = (x * x, y * y);
    let value = match number {
        0 => y2 - x2 + x2 * x.abs(),
        1 => x2 * 3.0 * y - x2 * 2.0 * x2 - y2 * (y - 1.0) * (y - 1.0),
        2 => x * y2 - x2 * y2 - (x2 - y) * (x2 - y),
        _ => y2 * y - x2 * 3.0 * y - (x2 + y2) * (x2 + y2),
    };
    Some((p[0] * value).within(p[1].abs()))
}

/// Where a point lies in the plane of a curve, given `[switch, offset, angle in degrees]`: in the xy plane, or with the
/// switch on at its distance from the y axis less the offset, turned by the angle.
fn revolved<T: Number>([x, y, z]: [T; 3], sweep: &[T]) -> Option<(T, T)> {
    let &[switch, offset, angle, ..] = sweep else { return None };
    let (sin, cos) = (angle.map(|a| a.to_radians().sin()), angle.map(|a| a.to_radians().cos()));
    let out = (x * x + z * z).sqrt() - offset;
    let flat = |own: T, turned: T| switch.if_less(T::lit(0.5), own, turned);
    Some((flat(x, out * cos - y * sin), flat(y, out * sin + y * cos)))
}
