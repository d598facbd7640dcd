//! Patterns: a number at every point of space (manual section 3.4.7.1; formulas as measured on POV-Ray 3.7).

use super::function::{Function, Surroundings};
use super::noise::{self, Generator, Octaves};
use super::number::{Number, length};
use glam::DVec3;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// Steps of a function at one point; one that takes more counts as 0, so that none hangs.
pub const FUNCTION_STEPS: u64 = 10_000_000;

/// Patterns that give a number.
#[derive(Debug, Clone, PartialEq)]
pub enum Pattern {
    /// Distance along a unit direction, wrapped to 0..1.
    Gradient(DVec3),
    /// Layers of stone, by turbulence of this strength.
    Agate(f64, Octaves),
    /// 1 at the origin, falling to 0 on the unit cube's faces.
    Boxed,
    /// Noise.
    Bozo,
    /// 1 on the y axis, falling to 0 at distance 1.
    Cylindrical,
    /// The third power of noise.
    Dents,
    /// A function of x, y and z that asks no pigment (`Function::asks_pigments`).
    Function(Arc<Function>),
    /// Noise of ever finer grain.
    Granite,
    /// Spots on a wave in each direction.
    Leopard,
    /// Waves along x, put out of order by turbulence of this strength.
    Marble(f64, Octaves),
    /// Spheres about the origin.
    Onion,
    /// 1 on the plane y = 0, falling to 0 at distance 1.
    Planar,
    /// The angle about the y axis.
    Radial,
    /// 1 at the origin, falling to 0 at distance 1.
    Spherical,
    /// This many arms winding about the z axis, put out of order by turbulence of this strength.
    Spiral1(f64, f64, Octaves),
    /// Rings about the z axis, put out of order by turbulence.
    Wood(DVec3, Octaves),
    /// Folds of noise.
    Wrinkles,
    /// Another pattern at a point moved by turbulence, `amount` along each axis.
    Turbulent {
        /// The other pattern.
        pattern: Arc<Pattern>,
        /// How far.
        amount: DVec3,
        /// Of what noise.
        octaves: Octaves,
    },
}

impl Pattern {
    /// The number at a point, before frequency, phase and wave. NaN or infinite only where the point or its square is.
    pub fn value<T: Number>(&self, p: [T; 3], generator: Generator) -> T {
        let [x, y, z] = p;
        match self {
            Self::Agate(strength, octaves) => {
                let layers = noise::turbulence(p, octaves, generator) * (1.3 * strength) + z * 1.1;
                ((cycle(layers) + 1.0) * 0.5).unit().raised(0.77)
            }
            Self::Bozo => generator.noise(p),
            Self::Dents => generator.noise(p).cubed(),
            Self::Granite => {
                sum(6, |scale| generator.grain(p.map(|v| v * (4.0 * scale))).abs().smaller(T::lit(0.5)))
            }
            Self::Marble(strength, octaves) => match *strength {
                0.0 => x,
                strength => x + noise::turbulence(p, octaves, generator) * strength,
            },
            Self::Spiral1(arms, strength, octaves) => {
                let order = T::each(p, |[x, y, z]| {
                    let r = x.hypot(y);
                    let tilt = if r > 0.0 { (y / r).asin() } else { 0.0 };
                    let angle = if x < 0.0 { 1.5 * PI - tilt } else { 0.5 * PI + tilt };
                    z + r + arms * angle / TAU
                });
                match *strength {
                    0.0 => order,
                    strength => order + noise::turbulence(p, octaves, generator) * strength,
                }
            }
            Self::Wood(amount, octaves) => {
                if *amount == DVec3::ZERO {
                    return across(x, y);
                }
                let [shift_x, shift_y] = noise::turbulence_vector(p, octaves);
                let moved = |v: T, shift: T, amount: f64| v + cycle((v + shift) * amount);
                across(moved(x, shift_x, amount.x), moved(y, shift_y, amount.y))
            }
            Self::Wrinkles => {
                let fold = |scale: f64| generator.octave(p.map(|v| v * scale)).unit();
                sum(10, fold) * 0.5
            }
            Self::Turbulent { pattern, amount, octaves } => {
                let shift: [T; 3] = noise::turbulence_vector(p, octaves);
                pattern.value(std::array::from_fn(|axis| p[axis] + shift[axis] * amount[axis]), generator)
            }
            Self::Gradient(direction) => T::each(p, |p| wrapped(DVec3::from(p).dot(*direction))),
            Self::Boxed => falling(x.abs().larger(y.abs()).larger(z.abs())),
            Self::Cylindrical => falling(across(x, z)),
            Self::Function(function) => T::each(p, |p| {
                let mut around = Surroundings::new(FUNCTION_STEPS, &|_, _| [0.0; 5]);
                wrapped(function.value(&p, &mut around).unwrap_or(0.0))
            }),
            Self::Leopard => ((x.sine() + y.sine() + z.sine()) / T::lit(3.0)).squared(),
            Self::Onion => {
                let distance = length(p);
                distance - distance.whole()
            }
            Self::Planar => falling(y.abs()),
            Self::Radial => T::each([x, z], |[x, z]| {
                // On the axis there is no angle.
                let on_axis = x.abs() < 0.001 && z.abs() < 0.001;
                0.25 + if on_axis { 0.0 } else { (x.atan2(z) + PI) / TAU }
            }),
            Self::Spherical => falling(length(p)),
        }
    }

    /// The same, put out of order: by its own turbulence if it has one, by moving its points, or (agate, spirals) by both.
    pub fn turbulent(self, amount: DVec3, octaves: Octaves) -> Self {
        let pattern = match self {
            Self::Marble(..) => return Self::Marble(amount.x, octaves),
            Self::Wood(..) => return Self::Wood(amount, octaves),
            Self::Agate(strength, _) => Self::Agate(strength, octaves),
            Self::Spiral1(arms, ..) => Self::Spiral1(arms, amount.x, octaves),
            pattern => pattern,
        };
        if amount == DVec3::ZERO {
            return pattern;
        }
        Self::Turbulent { pattern: Arc::new(pattern), amount, octaves }
    }
}

impl Pattern {
    /// Takes [`Pattern::turbulent`] back: the pattern in order, the amount and the octaves.
    pub fn in_order(&self) -> (Self, DVec3, Octaves) {
        match self {
            Self::Marble(strength, octaves) => {
                (Self::Marble(0.0, *octaves), DVec3::splat(*strength), *octaves)
            }
            Self::Wood(amount, octaves) => (Self::Wood(DVec3::ZERO, *octaves), *amount, *octaves),
            Self::Agate(strength, octaves) => (Self::Agate(*strength, *octaves), DVec3::ZERO, *octaves),
            Self::Spiral1(arms, _, octaves) => (Self::Spiral1(*arms, 0.0, *octaves), DVec3::ZERO, *octaves),
            Self::Turbulent { pattern, amount, octaves } => (pattern.in_order().0, *amount, *octaves),
            pattern => (pattern.clone(), DVec3::ZERO, Octaves::default()),
        }
    }
}

/// 1 at no distance, falling to 0 at 1.
fn falling<T: Number>(distance: T) -> T {
    let one = T::lit(1.0);
    one - one.smaller(distance)
}

/// How far a point is from an axis: by squares, as POV-Ray has it.
fn across<T: Number>(x: T, y: T) -> T {
    (x * x + y * y).sqrt()
}

/// Noises of ever finer grain and as much less weight: each half of the one before.
fn sum<T: Number>(count: i32, noise: impl Fn(f64) -> T) -> T {
    let scales = (1..count).map(|i| f64::from(1 << i));
    scales.fold(noise(1.0), |sum, scale| sum + noise(scale) * (1.0 / scale))
}

/// What lies above 1 wrapped to 0..1, and only that: the fold behind the frequency takes care of the rest.
fn wrapped(v: f64) -> f64 {
    if v > 1.0 { v % 1.0 } else { v }
}

/// A sine with period 1.
fn cycle<T: Number>(v: T) -> T {
    ((v - v.whole()) * TAU).sine()
}
