//! Functions without a strength.

use super::noise;
use super::number::{Number, length};

/// How fast the density of an orbital falls off; POV-Ray has no more digits of 4/3 (measured).
const ORBITAL_RATE: f64 = 1.33333332;

/// POV-Ray takes this off the distance from a rounded box (measured).
const ROUNDED_BOX_OFFSET: f64 = 1e-6;

/// The value; `p` are the parameters. `None` for other numbers and too few parameters.
pub fn value<T: Number>(number: u16, point: [T; 3], p: &[T]) -> Option<T> {
    let [x, y, z] = point;
    let get = |i: usize| p.get(i).copied();
    let zero = T::lit(0.0);
    let r2 = x * x + y * y + z * z;
    let exp = |v: T| v.map(f64::exp);
    // The squared distance with one axis counted otherwise than the other two, for each axis.
    let stretched = |axis: T, others: T| [x, y, z].map(|v| axis * v * v + others * (r2 - v * v));
    Some(match number {
        // f_blob: two bumps on the x axis
        6 => {
            let half = get(0)? * 0.5;
            let bump = |center: T, strength: T, inverse: T| {
                let out = x - center;
                let d = (out * out + y * y + z * z) * inverse * inverse;
                let inside = -d + 1.0;
                d.if_less(T::lit(1.0), strength * inside * inside, zero)
            };
            -bump(-half, get(1)?, get(2)?) - bump(half, get(3)?, get(4)?)
        }
        // f_blob2
        7 => {
            let (distance, inverse) = (get(0)?, get(1)?);
            let bump = |x: T| exp(-inverse * (x * x + y * y + z * z));
            get(3)? - get(2)? * (bump(x) + bump(x - distance))
        }
        // f_cross_ellipsoids, f_isect_ellipsoids: the nearest, the farthest of three
        10 | 32 => {
            let pick = if number == 10 { T::smaller } else { T::larger };
            let [a, b, c] = stretched(T::lit(1.0), get(0)?);
            get(3)? - get(2)? * exp(-get(1)? * pick(pick(a, b), c))
        }
        // f_ellipsoid
        17 => length([x * get(0)?, y * get(1)?, z * get(2)?]),
        // f_flange_cover
        19 => {
            let inverse = get(1)?;
            let [a, b, c] = stretched(T::lit(1.0), get(0)?).map(|q| exp(-inverse * q));
            get(3)? - get(2)? * (a + b + c)
        }
        // f_ph: the angle down from the y axis
        47 => T::each([(x * x + z * z).sqrt(), y], |[out, y]| out.atan2(y)),
        // f_quantum: the density of an orbital
        53 => {
            let lobes = x * x + z * z - y * y * 2.0;
            -(lobes * lobes) * 1.6 * exp(r2.sqrt() * -ORBITAL_RATE) + 1.2
        }
        // f_poly4
        51 => {
            let radius = get(0)? + y * (get(1)? + y * (get(2)? + y * (get(3)? + y * get(4)?)));
            (x * x + z * z).sqrt() - radius
        }
        // f_r
        57 => r2.sqrt(),
        // f_rounded_box
        60 => {
            let radius = get(0)?;
            let beyond = |v: T, size: T| (v.abs() - (size - radius)).larger(zero);
            let out = [beyond(x, get(1)?), beyond(y, get(2)?), beyond(z, get(3)?)];
            length(out) - radius - ROUNDED_BOX_OFFSET
        }
        // f_sphere
        61 => r2.sqrt() - get(0)?,
        // f_spikes_2d
        63 => {
            let (height, across, along, rate) = (get(0)?, get(1)?, get(2)?, get(3)?);
            let wave = |v: T| v.map(f64::cos);
            y - height * wave(across * x) * wave(along * z) * exp(-rate * (x * x + z * z))
        }
        // f_spikes
        62 => {
            let (spikiness, inverse, size) = (get(0)?, get(1)?, get(2)?);
            let (roundness, fatness) = (get(3)?, get(4)?);
            let [a, b, c] = stretched(T::lit(1.0), spikiness).map(|q| exp(-inverse * q));
            size * (a + b + c - fatness * exp(-roundness * r2))
        }
        // f_superellipsoid
        68 => {
            let (e, n) = (get(0)?, get(1)?);
            let two = T::lit(2.0);
            let around = (x.abs().power(two / e) + y.abs().power(two / e)).power(e / n);
            -(around + z.abs().power(two / n)).power(n * 0.5) + 1.0
        }
        // f_th: the angle about the y axis
        69 => T::each([x, z], |[x, z]| x.atan2(z)),
        // f_torus
        70 => {
            let out = (x * x + z * z).sqrt() - get(0)?;
            (out * out + y * y).sqrt() - get(1)?
        }
        // f_noise3d
        76 => noise::noise(point),
        _ => return None,
    })
}
