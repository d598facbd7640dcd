//! The colour of a pigment at a point.

use crate::scene::noise::Generator;
use crate::scene::{BlockPattern, Blocks, Color, ColorMap, Mapped, Pattern, Pigment, PigmentKind, Wave};
use glam::DVec3;

/// Block patterns are shifted by this, so that a surface in the very plane between two blocks has one colour (POV-Ray's value,
/// in units of the pattern).
const NUDGE: f64 = 1e-10;

/// The colour at `point`, given in the space of the texture, in a scene with that generator of noise.
pub fn color(pigment: &Pigment, point: DVec3, generator: Generator) -> Color {
    let point = || pigment.transform.inverted().point(point);
    match &pigment.kind {
        PigmentKind::Solid(color) => *color,
        PigmentKind::Other { stand_in, .. } => **stand_in,
        PigmentKind::Blocks(blocks) => {
            let Blocks { wave, frequency, phase, .. } = **blocks;
            shown(&blocks.map(), block(&blocks.pattern, point()) as f64, (wave, frequency, phase))
        }
        PigmentKind::Mapped(mapped) => {
            let Mapped { pattern, wave, frequency, phase, generator: own, map } = &**mapped;
            shown(map, value(pattern, point(), own.unwrap_or(generator)), (*wave, *frequency, *phase))
        }
    }
}

/// The colour of a number. A frequency of 0 leaves it as it is, the phase too (measured in POV-Ray 3.7).
fn shown(map: &ColorMap, value: f64, (wave, frequency, phase): (Wave, f64, f64)) -> Color {
    let v = if frequency == 0.0 { value } else { fold(value * frequency + phase) };
    look_up(map, shape(wave, v))
}

/// Which of its colours a block pattern shows.
fn block(pattern: &BlockPattern, p: DVec3) -> usize {
    match pattern {
        BlockPattern::Checker => {
            let cell = (p + NUDGE).floor();
            usize::from((cell.x + cell.y + cell.z).rem_euclid(2.0) >= 1.0)
        }
        BlockPattern::Brick { size, mortar } => usize::from(is_brick(p, *size, *mortar)),
        BlockPattern::Hexagon => hexagon(p.x, p.z),
    }
}

/// Courses of bricks, every other one set off by half a brick.
fn is_brick(p: DVec3, size: DVec3, mortar: f64) -> bool {
    // POV-Ray keeps the mortar in single precision.
    let mortar = f64::from(mortar as f32);
    let p = (p + (NUDGE + mortar)) / size;
    let joint = mortar / size;
    let fraction = |x: f64| x - x.floor();
    if fraction(p.y) <= joint.y {
        return false;
    }
    let shifted = fraction(p.y / 2.0) <= 0.5;
    let (x, z) = if shifted { (p.x, p.z + 0.5) } else { (p.x + 0.5, p.z) };
    fraction(x) > joint.x && fraction(z) > joint.z
}

/// Hexagons of side 1, one about the origin, three colours, no two alike touching.
///
/// The plane is cut into cells half a hexagon's side wide and half its height high, which repeat after six each way; in every
/// third column of cells a diagonal divides two hexagons.
fn hexagon(x: f64, z: f64) -> usize {
    /// Six cells' height: three times the root of 3.
    const PERIOD: f64 = 5.196152424;
    /// Half the height of a hexagon of side 1.
    const HALF_HEIGHT: f64 = 0.866025404;
    let x = x.abs();
    let z = if z < 0.0 { PERIOD - z.abs() } else { z };
    let wrap = |v: f64| v - 6.0 * (v / 6.0).floor();
    let (x, z) = (wrap(x / 0.5), wrap(z / HALF_HEIGHT));
    let (column, row) = (x.trunc(), z.trunc());
    let (pair, row_of_three) = ((row as usize / 2) % 3, row as usize % 3);
    match column as usize % 6 {
        0 | 5 => [0, 1, 1, 2, 2, 0][row as usize % 6],
        2 | 3 => [2, 0, 1][pair],
        _ => {
            let across = if (column + row) % 2.0 == 1.0 { 1.0 - x.fract() } else { x.fract() };
            let across = if across == 0.0 { 1e-4 } else { across };
            if z.fract() / across < 1.0 { [0, 2, 1][row_of_three] } else { [2, 1, 0][row_of_three] }
        }
    }
}

/// The number of a pattern, before the wave.
fn value(pattern: &Pattern, p: DVec3, generator: Generator) -> f64 {
    match pattern {
        Pattern::Gradient(direction) => {
            let along = p.dot(*direction);
            if along > 1.0 { along % 1.0 } else { along }
        }
        // The formulas are the description's own; POV-Ray's pictures are what they are held against.
        other => other.value(p.to_array(), generator),
    }
}

/// Wraps a number to -1..1: a little over 1, so that 1 itself stays 1 and has the map's last colour (POV-Ray's value).
fn fold(v: f64) -> f64 {
    v % 1.00001
}

/// Lays the wave over a number; negative ones are wrapped to 0..1 first.
fn shape(wave: Wave, v: f64) -> f64 {
    let v = if v < 0.0 { v - v.floor() } else { v };
    match wave {
        Wave::Ramp => v,
        Wave::Sine => (1.0 + cycle(v)) / 2.0,
        Wave::Triangle => {
            let w = v.fract();
            if w >= 0.5 { 2.0 * (1.0 - w) } else { 2.0 * w }
        }
        Wave::Scallop => cycle(v / 2.0).abs(),
        Wave::Cubic => v * v * (3.0 - 2.0 * v),
        Wave::Poly(exponent) => v.powf(exponent),
    }
}

/// A sine with period 1.
fn cycle(v: f64) -> f64 {
    (v.fract() * std::f64::consts::TAU).sin()
}

/// Linear between the two entries about `v`, constant beyond the ends.
fn look_up(map: &ColorMap, v: f64) -> Color {
    let Some((last_place, last)) = map.entries.last() else { return Color::default() };
    if v >= *last_place {
        return *last;
    }
    let i = map.entries.iter().position(|(place, _)| v <= *place).unwrap_or(0);
    let (place, color) = map.entries[i];
    if i == 0 || v == place {
        return color;
    }
    let (from_place, from) = map.entries[i - 1];
    from.lerp(&color, (v - from_place) / (place - from_place))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checker_changes_at_every_face_and_has_one_colour_in_a_face() {
        let at = |x: f64, y: f64, z: f64| block(&BlockPattern::Checker, DVec3::new(x, y, z));
        assert_eq!(
            [at(0.5, 0.5, 0.5), at(1.5, 0.5, 0.5), at(-0.5, 0.5, 0.5), at(-0.5, -0.5, 0.5)],
            [0, 1, 1, 0]
        );
        // A plane exactly between two layers of cubes belongs to the upper one, rounded a little or not.
        assert_eq!([at(0.5, 1.0, 0.5), at(0.5, 1.0 - 1e-16, 0.5), at(0.5, 1.0 - 1e-9, 0.5)], [1, 1, 0]);
    }

    #[test]
    fn hexagons_turn_about_the_origin_s() {
        // The middles of the hexagon about the origin and of its six neighbours, going round: no two neighbours alike.
        let middles = (0..6).map(|i| (30.0 + 60.0 * i as f64).to_radians().sin_cos());
        let around: Vec<_> = middles.map(|(s, c)| hexagon(3f64.sqrt() * c, 3f64.sqrt() * s)).collect();
        assert_eq!(hexagon(0.0, 0.0), 0);
        for i in 0..6 {
            assert!(around[i] != 0 && around[i] != around[(i + 1) % 6], "{around:?}");
        }
    }

    #[test]
    fn bricks_lie_in_courses_set_off_by_half() {
        let at =
            |x: f64, y: f64| usize::from(is_brick(DVec3::new(x, y, 1.0), DVec3::new(8.0, 3.0, 4.5), 0.5));
        // Along the middle of a course a joint comes once in 8, in the next course 4 further on.
        let joints = |y: f64| (0..16i32).filter(|&i| at(0.75 + f64::from(i), y) == 0).collect::<Vec<_>>();
        let (first, second) = (joints(1.0), joints(4.0));
        assert!(!first.is_empty() && first.len() == second.len());
        assert!(first.iter().zip(&second).all(|(a, b)| a.abs_diff(*b) == 4), "{first:?} {second:?}");
    }

    #[test]
    fn waves_have_their_shapes() {
        for (wave, quarter, three_quarters) in [
            (Wave::Ramp, 0.25, 0.75),
            (Wave::Triangle, 0.5, 0.5),
            (Wave::Sine, 1.0, 0.0),
            (Wave::Scallop, 0.5f64.sqrt(), 0.5f64.sqrt()),
            (Wave::Cubic, 0.15625, 0.84375),
            (Wave::Poly(2.0), 0.0625, 0.5625),
        ] {
            assert!((shape(wave, 0.25) - quarter).abs() < 1e-15, "{wave:?}");
            assert!((shape(wave, -0.25) - three_quarters).abs() < 1e-15, "{wave:?}");
        }
        // 1 is not wrapped to 0.
        assert_eq!(shape(Wave::Ramp, fold(1.0)), 1.0);
    }

    #[test]
    fn map_is_linear_with_jumps_and_level_ends() {
        let grey = |v: f64| Color::opaque(v, v, v);
        let map = ColorMap {
            entries: vec![(0.2, grey(0.0)), (0.5, grey(0.6)), (0.5, grey(0.1)), (0.8, grey(1.0))],
        };
        for (v, expected) in
            [(0.0, 0.0), (0.2, 0.0), (0.3, 0.2), (0.5, 0.6), (0.65, 0.55), (0.8, 1.0), (0.9, 1.0)]
        {
            assert!((look_up(&map, v).rgb.x - expected).abs() < 1e-15, "at {v}");
        }
        assert_eq!(look_up(&ColorMap::default(), 0.5), Color::default());
    }
}
