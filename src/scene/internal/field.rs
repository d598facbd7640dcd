//! Fields of space that are multiplied by a strength: polynomials.

use super::Number;

/// Enneper's surface divides by no smaller z than this (measured).
const LEAST_ENNEPER_Z: f64 = 0.2;

/// The value without the strength; `p` are the parameters behind it. `None` for other numbers and too few parameters.
pub fn value<T: Number>(number: u16, point: [T; 3], p: &[T]) -> Option<T> {
    let [x, y, z] = point;
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
            let side = x2 + z2 + s * 2.0 * y - s * s;
            y2 * (s * s - x2 - z2) - side * side
        }
        // f_bifolia
        5 => get(0)? * y * (x2 + z2) - all * all,
        // f_boy_surface
        8 => get(0)? * boy(point),
        // f_crossed_trough
        11 => x2 * z2 - y,
        // f_cubic_saddle
        12 => y.cubed() + z - x.cubed(),
        // f_cushion, f_odd
        13 | 43 => {
            let sheet = x2 - z;
            z2 * (x2 - z2) - z * 2.0 * (x2 - z2) + x2 - z2 - sheet * sheet - y2 * (y2 + x2 * 2.0 + z2)
                + y2 * 2.0 * z
                + y2
        }
        // f_devils_curve
        14 => y2 * (y2 - 0.25) - (x2 + z2) * (x2 + z2) + x2 * 0.36,
        // f_dupin_cyclid
        16 => dupin(point, p.get(..5)?),
        // f_enneper: POV-Ray has none of the surface's constants but 2/9, and keeps the z it divides by off 0.
        18 => {
            let difference = y2 - x2;
            let least = T::lit(LEAST_ENNEPER_Z);
            let divisor = z.abs().if_less(least, least, z);
            let (a, b) =
                (difference / (divisor * 2.0) + z2 * 2.0 * (1.0 / 9.0), difference / (divisor * 4.0));
            -(a.cubed() - b * b * 6.0)
        }
        // f_folium_surface
        20 => folium(x, y2 + z2, get(0)?, get(1)?),
        // f_glob
        22 => x2 * 0.5 * x2 * (x + 1.0) - y2 - z2,
        // f_heart
        23 => (x2 * 0.1 + y2) * z.cubed() - (x2 + all - 1.0).cubed(),
        // f_hunt_surface
        30 => (all - 13.0).cubed() * -4.0 - (x2 * 3.0 + y2 - z2 * 4.0 - 12.0).squared() * 27.0,
        // f_hyperbolic_torus
        31 => {
            let (sum, difference) = radii()?;
            sum * 2.0 * (x2 - z2) - difference * 2.0 * y2 - difference.squared() - (x2 + y2 - z2).squared()
        }
        // f_kampyle_of_eudoxus
        33 => {
            let (a, b) = (get(0)?, get(1)?);
            b * b * x2 * (x2 - a * a) - y2 - z2
        }
        // f_klein_bottle
        35 => {
            let (outer, inner) = (all + y * 2.0 - 1.0, all - y * 2.0 - 1.0);
            -outer * (inner * inner - z2 * 8.0) - x * 16.0 * z * inner
        }
        // f_kummer_surface_v1, f_kummer_surface_v2
        36 | 37 => {
            let one = T::lit(1.0);
            let (constant, squares, products, product) =
                if number == 36 { (-one, -one, -one, T::lit(0.0)) } else { (one, get(0)?, get(1)?, get(2)?) };
            constant
                - (x2 * x2 + y2 * y2 + z2 * z2)
                - squares * all
                - products * (x2 * y2 + y2 * z2 + z2 * x2)
                - product * x * y * z
        }
        // f_lemniscate_of_gerono
        38 => x2 * (-x2 + 1.0) - y2 - z2,
        // f_mitre
        41 => y2 * (-y2 + 1.0 - z2) - x2 * 4.0 * all,
        // f_nodal_cubic
        42 => y * 6.0 * z - y.cubed() - z.cubed(),
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
            sum * (x2 - z) - difference * y2 - difference.squared() - (x2 + y2 - z).squared()
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
            sum * 2.0 * (x2 + z2) - difference * 2.0 * y2 - difference.squared() - all * all
        }
        // f_torus_gumdrop
        72 => {
            let r2 = y2 + z2;
            all * 20.0 - x2 * 4.0 * x2 - r2 * 4.0 * r2 - x2 * 17.0 * r2 - 17.0
        }
        // f_umbrella
        73 => y * z2 - x2,
        // f_witch_of_agnesi
        74 => get(0)? * (-y + 1.0) - y * (x2 + z2),
        _ => return None,
    })
}

/// A torus turned inside out by a sphere about the origin; `p` is `[major, minor, shift x, shift y, sphere's radius]`.
///
/// One term has the other sign in POV-Ray (measured).
fn dupin<T: Number>([x, y, z]: [T; 3], p: &[T]) -> T {
    let (major, minor, dx, dy, sphere) = (p[0], p[1], p[2], p[3], p[4] * p[4]);
    let q = x * x + y * y + z * z;
    let difference = major * major - minor * minor;
    let along = x * dx + y * dy;
    let ring = sphere * sphere - sphere * 2.0 * along + (dx * dx + dy * dy + difference) * q;
    let level = sphere * sphere * (x * x + z * z) - sphere * 2.0 * x * dx * q + dx * dx * q * q;
    -(ring * ring - major * major * 4.0 * level) - sphere * 8.0 * dy * difference * y * q
}

/// Boy's surface (Apéry's polynomial of sixth degree).
fn boy<T: Number>([x, y, z]: [T; 3]) -> T {
    let (q, w, z2) = (x * x + y * y, -z + 1.0, z * z);
    let root = std::f64::consts::SQRT_2;
    w.cubed() * 64.0 * z.cubed() - w * w * 48.0 * z2 * (q * 3.0 + z2 * 2.0)
        + w * 12.0
            * z
            * (q * 27.0 * q - z2 * 24.0 * q + y * z * (36.0 * root) * (y * y - x * 3.0 * x) + z2 * 4.0 * z2)
        + (q * 9.0 - z2 * 2.0)
            * (q * -81.0 * q - z2 * 72.0 * q + x * z * (108.0 * root) * (x * x - y * 3.0 * y) + z2 * 4.0 * z2)
}

/// `r2` is the squared distance from the x axis.
pub fn folium<T: Number>(x: T, r2: T, neck: T, divergence: T) -> T {
    (divergence + 1.0) * x * x + r2 * (x * (divergence - neck * 4.0) + 1.0)
}

/// `r2` is the squared distance from the x axis.
pub fn strophoid<T: Number>(x: T, r2: T, size: T, sharpness: T, fatness: T) -> T {
    (x - sharpness) * r2 + fatness * fatness * x * x * (x + size)
}
