//! Terrains of noise whose roughness depends on their height (Musgrave, in Ebert et al., Texturing and Modeling, ch. 16),
//! computed point by point.

use super::{Number, noise::Generator};
use glam::DVec3;

/// More octaves than that are left out, so that none hangs; beyond it the noise is finer than any number tells apart.
const MOST_OCTAVES: f64 = 256.0;
/// Highest power by which a heterogeneous terrain counts its height.
const HIGHEST_POWER: f64 = 1000.0;

/// The value; `p` are the parameters. `None` for other numbers and too few parameters.
pub fn value<T: Number>(number: u16, [x, y, z]: [T; 3], p: &[T]) -> Option<T> {
    let f = match number {
        29 => heterogeneous,
        58 => ridge,
        59 => ridged,
        78 => {
            return Some(T::each([x, y, z, *p.first()?], |[x, y, z, generator]| {
                generated(generator, DVec3::new(x, y, z))
            }));
        }
        _ => return None,
    };
    let &[a, b, c, d, e, generator, ..] = p else { return None };
    Some(T::each([x, y, z, a, b, c, d, e, generator], |[x, y, z, a, b, c, d, e, generator]| {
        f(DVec3::new(x, y, z), &|point| generated(generator, point), [a, b, c, d, e])
    }))
}

/// Noise of a generator: 0 and 1 are the original one, others that of the full range. (Perlin's, 3, is not modelled.)
fn generated(generator: f64, point: DVec3) -> f64 {
    let generator = match generator as i64 & 3 {
        0 | 1 => Generator::Original,
        _ => Generator::Corrected,
    };
    generator.noise(point.to_array())
}

type Noise<'a> = &'a dyn Fn(DVec3) -> f64;

/// `[H, lacunarity, octaves, offset, T]`: each octave counts by the height so far, to the power of T.
fn heterogeneous(mut point: DVec3, noise: Noise, [h, lacunarity, octaves, offset, power]: [f64; 5]) -> f64 {
    let signed = |point: DVec3| 2.0 * noise(point) - 1.0 + offset;
    let octaves = octaves.min(MOST_OCTAVES);
    let power = power.clamp(0.0, HIGHEST_POWER) as i32;
    let mut height = signed(point);
    point *= lacunarity;
    let mut octave = 1.0;
    while octave < octaves {
        height += signed(point) * lacunarity.powf(-h * octave) * height.powi(power);
        point *= lacunarity;
        octave += 1.0;
    }
    let rest = octaves - octaves.floor();
    if rest != 0.0 {
        height += rest * signed(point) * lacunarity.powf(-h * octave) * height;
    }
    height
}

/// `[lambda, octaves, omega, offset, ridge]`: noise folded at `ridge`, averaged over octaves.
fn ridge(mut point: DVec3, noise: Noise, [lambda, octaves, omega, offset, ridge]: [f64; 5]) -> f64 {
    let folded = |point: DVec3| (noise(point) - ridge).abs() / ridge.max(1.0 - ridge);
    let octaves = octaves.min(MOST_OCTAVES);
    let (mut sum, mut total, mut weight, mut octave) = (folded(point), 1.0, 1.0, 2.0);
    while octave <= octaves {
        point *= lambda;
        weight *= omega;
        sum += weight * folded(point);
        total += weight;
        octave += 1.0;
    }
    let rest = octaves - octaves.floor();
    if rest != 0.0 {
        sum += rest * weight * omega * folded(point * lambda);
        total += rest * weight * omega;
    }
    (sum / total - offset) / offset.max(1.0 - offset)
}

/// `[H, lacunarity, octaves, offset, gain]`: crests where noise is 0; each octave counts by the one before.
fn ridged(mut point: DVec3, noise: Noise, [h, lacunarity, octaves, offset, gain]: [f64; 5]) -> f64 {
    let crest = |point: DVec3| (offset - (2.0 * noise(point) - 1.0).abs()).powi(2);
    let mut signal = crest(point);
    let (mut height, mut octave) = (signal, 1.0);
    while octave < octaves.min(MOST_OCTAVES) {
        point *= lacunarity;
        signal = crest(point) * (signal * gain).clamp(0.0, 1.0);
        height += signal * lacunarity.powf(-h * octave);
        octave += 1.0;
    }
    height
}
