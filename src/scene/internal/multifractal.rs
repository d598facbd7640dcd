//! Terrains of noise whose roughness depends on their height (Musgrave, in Ebert et al., Texturing and Modeling, ch. 16),
//! computed for all points at once where their parameters are the same.

use super::{Number, noise::Generator};

/// More octaves than that are left out, so that none hangs; beyond it the noise is finer than any number tells apart.
const MOST_OCTAVES: f64 = 256.0;
/// Highest power by which a heterogeneous terrain counts its height.
const HIGHEST_POWER: f64 = 1000.0;

/// The value; `p` are the parameters. `None` for other numbers and too few parameters.
pub fn value<T: Number>(number: u16, point: [T; 3], p: &[T]) -> Option<T> {
    let terrain = match number {
        29 => Terrain::Heterogeneous,
        58 => Terrain::Ridge,
        59 => Terrain::Ridged,
        78 => {
            let generator = p.first()?;
            return Some(match generator.everywhere() {
                Some(number) => generator_of(number).noise(point),
                None => {
                    let [x, y, z] = point;
                    T::each([x, y, z, *generator], |[x, y, z, number]| generator_of(number).noise([x, y, z]))
                }
            });
        }
        _ => return None,
    };
    let &[a, b, c, d, e, generator, ..] = p else { return None };
    let all = [a, b, c, d, e, generator];
    let shared = all.map(T::everywhere);
    if let [Some(a), Some(b), Some(c), Some(d), Some(e), Some(generator)] = shared {
        return Some(terrain.height(point, generator_of(generator), [a, b, c, d, e]));
    }
    let [x, y, z] = point;
    Some(T::each([x, y, z, a, b, c, d, e, generator], |[x, y, z, a, b, c, d, e, generator]| {
        terrain.height([x, y, z], generator_of(generator), [a, b, c, d, e])
    }))
}

/// Generators by number: 0 and 1 are the original one, others that of the full range. (Perlin's, 3, is not modelled.)
fn generator_of(number: f64) -> Generator {
    match number as i64 & 3 {
        0 | 1 => Generator::Original,
        _ => Generator::Corrected,
    }
}

#[derive(Clone, Copy)]
enum Terrain {
    /// `[H, lacunarity, octaves, offset, T]`: each octave counts by the height so far, to the power of T.
    Heterogeneous,
    /// `[lambda, octaves, omega, offset, ridge]`: noise folded at `ridge`, averaged over octaves.
    Ridge,
    /// `[H, lacunarity, octaves, offset, gain]`: crests where noise is 0; each octave counts by the one before.
    Ridged,
}

impl Terrain {
    fn height<T: Number>(self, point: [T; 3], generator: Generator, parameters: [f64; 5]) -> T {
        match self {
            Self::Heterogeneous => heterogeneous(point, generator, parameters),
            Self::Ridge => ridge(point, generator, parameters),
            Self::Ridged => ridged(point, generator, parameters),
        }
    }
}

fn scaled<T: Number>(point: [T; 3], by: f64) -> [T; 3] {
    point.map(|v| v * by)
}

fn heterogeneous<T: Number>(
    mut point: [T; 3],
    generator: Generator,
    [h, lacunarity, octaves, offset, power]: [f64; 5],
) -> T {
    let signed = |point: [T; 3]| generator.noise(point) * 2.0 - 1.0 + offset;
    let octaves = octaves.min(MOST_OCTAVES);
    let power = power.clamp(0.0, HIGHEST_POWER) as i32;
    let mut height = signed(point);
    point = scaled(point, lacunarity);
    let mut octave = 1.0;
    while octave < octaves {
        height = height + signed(point) * lacunarity.powf(-h * octave) * height.map(|v| v.powi(power));
        point = scaled(point, lacunarity);
        octave += 1.0;
    }
    let rest = octaves - octaves.floor();
    if rest != 0.0 {
        height = height + signed(point) * rest * lacunarity.powf(-h * octave) * height;
    }
    height
}

fn ridge<T: Number>(
    mut point: [T; 3],
    generator: Generator,
    [lambda, octaves, omega, offset, ridge]: [f64; 5],
) -> T {
    let folded = |point: [T; 3]| (generator.noise(point) - ridge).abs() / T::lit(ridge.max(1.0 - ridge));
    let octaves = octaves.min(MOST_OCTAVES);
    let (mut sum, mut total, mut weight, mut octave) = (folded(point), 1.0, 1.0, 2.0);
    while octave <= octaves {
        point = scaled(point, lambda);
        weight *= omega;
        sum = sum + folded(point) * weight;
        total += weight;
        octave += 1.0;
    }
    let rest = octaves - octaves.floor();
    if rest != 0.0 {
        sum = sum + folded(scaled(point, lambda)) * (rest * weight * omega);
        total += rest * weight * omega;
    }
    (sum / T::lit(total) - offset) / T::lit(offset.max(1.0 - offset))
}

fn ridged<T: Number>(
    mut point: [T; 3],
    generator: Generator,
    [h, lacunarity, octaves, offset, gain]: [f64; 5],
) -> T {
    let crest = |point: [T; 3]| (T::lit(offset) - (generator.noise(point) * 2.0 - 1.0).abs()).squared();
    let mut signal = crest(point);
    let (mut height, mut octave) = (signal, 1.0);
    while octave < octaves.min(MOST_OCTAVES) {
        point = scaled(point, lacunarity);
        signal = crest(point) * (signal * gain).unit();
        height = height + signal * lacunarity.powf(-h * octave);
        octave += 1.0;
    }
    height
}
