//! Patterned pigments in lanes (manual section 3.4.7; block patterns as measured on POV-Ray 3.7).

use super::{Colors, Ramp, function};
use crate::lane::{Lane, Mask, Vec3, f32x8, f64x8};
use crate::scene::noise::Generator;
use crate::scene::pattern::FUNCTION_STEPS;
use crate::scene::{BlockPattern, Blocks, Color, Mapped, Pattern, PigmentKind, Transform, Wave};
use glam::{DMat3, DVec3};

/// POV-Ray's nudge before a block pattern's floor, in pattern space: points on a cell's border that rounding put
/// just below it count as on it.
const BLOCK_EPSILON: f64 = 1e-10;
/// POV-Ray folds pattern values at a little over 1, so that 1 itself is the map's end and not its start.
const FOLD: f64 = 1.00001;

/// A pattern in its place.
#[derive(Debug, Clone)]
pub struct PatternProgram {
    /// From compiled space to the pattern's: `matrix * point + offset`.
    matrix: DMat3,
    offset: DVec3,
    kind: PatternKind,
}

#[derive(Debug, Clone)]
enum PatternKind {
    /// And the colour of each block.
    Blocks(BlockPattern, Vec<Color>),
    Mapped {
        pattern: Pattern,
        wave: Wave,
        frequency: f64,
        phase: f64,
        generator: Generator,
        ramp: Ramp,
    },
}

impl PatternProgram {
    /// `kind` with its pattern space at `place` in the world, in a scene with that generator of noise; points come relative to `origin`.
    pub fn new(kind: &PigmentKind, place: &Transform, origin: DVec3, generator: Generator) -> Self {
        let one_color = |color: Color| PatternKind::Blocks(BlockPattern::Checker, vec![color; 2]);
        let kind = match kind {
            PigmentKind::Solid(color) => one_color(*color),
            PigmentKind::Other { stand_in, .. } => one_color(**stand_in),
            PigmentKind::Blocks(blocks) => PatternKind::Blocks(blocks.pattern, shown(blocks)),
            PigmentKind::Mapped(mapped) => {
                let Mapped { pattern, wave, frequency, phase, generator: own, map } = Mapped::clone(mapped);
                let (generator, ramp) = (own.unwrap_or(generator), Ramp::new(&map));
                PatternKind::Mapped { pattern, wave, frequency, phase, generator, ramp }
            }
        };
        Self { matrix: place.inverse.matrix3, offset: place.inverse.transform_point3(origin), kind }
    }

    /// Pattern space from compiled space.
    fn to_pattern<L: Lane>(&self, point: Vec3<L>) -> Vec3<L> {
        let m = &self.matrix;
        let row = |r: usize| {
            point.x * L::lit(m.x_axis[r])
                + point.y * L::lit(m.y_axis[r])
                + point.z * L::lit(m.z_axis[r])
                + L::lit(self.offset[r])
        };
        Vec3::new(row(0), row(1), row(2))
    }

    /// Colours at `point` (compiled space).
    pub fn colors<L: Lane>(&self, point: Vec3<L>) -> Colors {
        // Cells end where POV-Ray's nudge of 1e-10 says, and faces of boxes love to lie there: double precision always.
        let wide = || self.to_pattern(point.cast::<f64x8>());
        match &self.kind {
            PatternKind::Blocks(pattern, colors) => match pattern {
                BlockPattern::Checker => {
                    let odd = checker_is_odd(wide()).cast();
                    pick(odd, &colors[1], Colors::splat(&colors[0]))
                }
                BlockPattern::Brick { size, mortar } => {
                    let in_mortar = brick_is_mortar(wide(), *size, *mortar).cast();
                    pick(in_mortar, &colors[0], Colors::splat(&colors[1]))
                }
                BlockPattern::Hexagon => {
                    let (second, third) = hexagon_cells(wide());
                    pick(third.cast(), &colors[2], pick(second.cast(), &colors[1], Colors::splat(&colors[0])))
                }
            },
            PatternKind::Mapped { pattern, wave, frequency, phase, generator, ramp } => {
                let p = self.to_pattern(point);
                let value = match pattern {
                    Pattern::Gradient(direction) => gradient(p, *direction),
                    Pattern::Function(function) => {
                        L::from_f64s(wrapped(function::values(function, p.cast(), FUNCTION_STEPS)))
                    }
                    other => {
                        let Vec3 { x, y, z } = p.cast::<f64x8>();
                        L::from_f64s(other.value([x, y, z], *generator))
                    }
                };
                ramp.look_up(shape(value, *wave, *frequency, *phase))
            }
        }
    }
}

/// The colours of blocks, looked up by their numbers once for all points.
fn shown(blocks: &Blocks) -> Vec<Color> {
    let Blocks { wave, frequency, phase, .. } = *blocks;
    if (wave, frequency) == (Wave::Ramp, 0.0) {
        return blocks.colors.clone();
    }
    let ramp = Ramp::new(&blocks.map());
    let number = |block: usize| shape(f64x8::splat(block as f64), wave, frequency, phase);
    (0..blocks.colors.len()).map(|block| ramp.look_up(number(block)).lane(0)).collect()
}

fn pick(mask: Mask<f32x8>, yes: &Color, no: Colors) -> Colors {
    let yes = Colors::splat(yes);
    Colors {
        rgb: Vec3::select(mask, yes.rgb, no.rgb),
        filter: mask.select(yes.filter, no.filter),
        transmit: mask.select(yes.transmit, no.transmit),
    }
}

/// `v - n * floor(v / n)`.
fn modulo<L: Lane>(v: L, n: f64) -> L {
    v - (v / L::lit(n)).floor() * L::lit(n)
}

fn checker_is_odd<L: Lane>(p: Vec3<L>) -> Mask<L> {
    let cells = p.map(|x| (x + L::lit(BLOCK_EPSILON)).floor());
    let sum = cells.x + cells.y + cells.z;
    modulo(sum, 2.0).gt(L::lit(0.5))
}

fn brick_is_mortar<L: Lane>(p: Vec3<L>, size: DVec3, mortar: f64) -> Mask<L> {
    // POV-Ray keeps the mortar in single precision and takes two nudges off it.
    let mortar = f64::from((mortar - 2.0 * BLOCK_EPSILON) as f32);
    let p = p.map(|x| x + L::lit(BLOCK_EPSILON + mortar));
    let fraction = |x: L| {
        let f = x - x.trunc();
        f.lt(L::zero()).select(f + L::lit(1.0), f)
    };
    let (x, y, z) = (p.x / L::lit(size.x), p.y / L::lit(size.y), p.z / L::lit(size.z));
    let half = L::lit(0.5);
    let thin = |value: L, length: f64| value.le(L::lit(mortar / length));
    let even_row = fraction(y * half).gt(half);
    let odd = thin(fraction(x), size.x) | thin(fraction(z + half), size.z);
    let even = thin(fraction(x + half), size.x) | thin(fraction(z), size.z);
    thin(fraction(y), size.y) | (even_row & even) | (!even_row & odd)
}

/// Lanes in the second and in the third colour.
fn hexagon_cells<L: Lane>(p: Vec3<L>) -> (Mask<L>, Mask<L>) {
    /// Half of a hexagon's height and the height of three rows, as POV-Ray rounds them.
    const HALF_HEIGHT: f64 = 0.866025404;
    const PERIOD: f64 = 5.196152424;
    let x = p.x.abs();
    let z = p.z.lt(L::zero()).select(L::lit(PERIOD) - p.z.abs(), p.z);
    let x = modulo(x / L::lit(0.5), 6.0);
    let z = modulo(z / L::lit(HALF_HEIGHT), 6.0);
    let (column, row) = (x.floor(), z.floor());
    let (x, z) = (x - column, z - row);
    let column_in = |a: f64, b: f64| column.equal(L::lit(a)) | column.equal(L::lit(b));
    let row_in = |a: f64, b: f64| row.equal(L::lit(a)) | row.equal(L::lit(b));
    let (r12, r34) = (row_in(1.0, 2.0), row_in(3.0, 4.0));
    let (s01, s45) = (row_in(0.0, 1.0), row_in(4.0, 5.0));
    let edge = column_in(0.0, 5.0);
    let middle = column_in(2.0, 3.0);
    let slanted = column_in(1.0, 4.0);
    // In slanted columns the border between two hexagons runs across the cell.
    let odd = modulo(column + row, 2.0).gt(L::lit(0.5));
    let x = odd.select(L::lit(1.0) - x, x);
    let x = x.equal(L::zero()).select(L::lit(1e-4), x);
    let below = (z / x).lt(L::lit(1.0));
    let (t03, t25, t14) = (row_in(0.0, 3.0), row_in(2.0, 5.0), row_in(1.0, 4.0));
    let second = (edge & r12) | (middle & s45) | (slanted & ((below & t25) | (!below & t14)));
    let third = (edge & r34) | (middle & s01) | (slanted & ((below & t14) | (!below & t03)));
    (second, third)
}

fn gradient<L: Lane>(p: Vec3<L>, direction: DVec3) -> L {
    wrapped(p.dot(Vec3::splat(direction)))
}

/// What lies above 1 wrapped to 0..1, and only that: `wrapped` of [`crate::scene::Pattern`] in lanes, which it must not know.
fn wrapped<L: Lane>(v: L) -> L {
    v.gt(L::lit(1.0)).select(v - v.trunc(), v)
}

/// Frequency, phase, folding into 0..1 and the wave form (povray's order). A frequency of 0 leaves out the first three.
fn shape<L: Lane>(value: L, wave: Wave, frequency: f64, phase: f64) -> L {
    let one = L::lit(1.0);
    let mut v = value;
    if frequency != 0.0 {
        v = v * L::lit(frequency) + L::lit(phase);
        v -= (v / L::lit(FOLD)).trunc() * L::lit(FOLD);
    }
    let v = v.lt(L::zero()).select(v - v.floor(), v);
    match wave {
        Wave::Ramp => v,
        Wave::Sine => (one + cycle(v)) * L::lit(0.5),
        Wave::Triangle => {
            let w = v - v.floor();
            w.ge(L::lit(0.5)).select(one - w, w) * L::lit(2.0)
        }
        Wave::Scallop => cycle(v * L::lit(0.5)).abs(),
        Wave::Cubic => v * v * (L::lit(3.0) - v * L::lit(2.0)),
        Wave::Poly(exponent) => v.pow_const(exponent),
    }
}

/// A sine of period 1.
fn cycle<L: Lane>(v: L) -> L {
    ((v - v.trunc()) * L::lit(std::f64::consts::TAU)).sin_cos().0
}
