//! Helices, spirals, woven threads and the like: functions with angles and choices, computed point by point.

use super::Number;
use std::f64::consts::{PI, TAU};

/// Of all these functions: coordinates and parameters.
const MOST_ARGUMENTS: usize = 13;
/// More tubes than that are left out, so that none hangs.
const MOST_TUBES: f64 = 1000.0;
/// Where POV-Ray has no tube at all (measured).
const NO_TUBE: f64 = 10_000.0;
/// POV-Ray moves a comma's point on the y axis to here, where there is an angle (measured).
const OFF_AXIS: f64 = 1e-4;

/// A function of a point and parameters.
type AtPoint = fn([f64; 3], &[f64]) -> f64;

/// The value; `p` are the parameters. `None` for other numbers and too few parameters.
pub fn value<T: Number>(number: u16, [x, y, z]: [T; 3], p: &[T]) -> Option<T> {
    let (count, f): (usize, AtPoint) = match number {
        9 => (1, comma),
        24 => (10, helical_torus),
        25 => (7, helix1),
        26 => (7, helix2),
        // The one parameter of f_hex_x and f_hex_y has no effect.
        27 => (0, |point, _| hexagon(point).0),
        28 => (0, |point, _| hexagon(point).1),
        40 => (5, mesh1),
        52 => (6, polytubes),
        64 => (6, spiral),
        _ => return None,
    };
    let mut arguments = [T::lit(0.0); MOST_ARGUMENTS];
    arguments[..3].copy_from_slice(&[x, y, z]);
    arguments[3..3 + count].copy_from_slice(p.get(..count)?);
    Some(T::each(arguments, |a| f([a[0], a[1], a[2]], &a[3..])))
}

/// The smaller; `at_most` where `value` is no number.
fn capped(value: f64, at_most: f64) -> f64 {
    if value < at_most { value } else { at_most }
}

fn length(a: f64, b: f64) -> f64 {
    (a * a + b * b).sqrt()
}

/// How far out a point lies on a section: a square (0), a circle (1), a diamond (2), concave beyond.
fn section(a: f64, b: f64, kind: f64) -> f64 {
    let (a, b) = (a.abs(), b.abs());
    if kind == 0.0 {
        a.max(b)
    } else if kind == 1.0 {
        length(a, b)
    } else {
        (a.powf(2.0 / kind) + b.powf(2.0 / kind)).powf(kind / 2.0)
    }
}

fn turned(a: f64, b: f64, angle: f64) -> (f64, f64) {
    let (sin, cos) = angle.sin_cos();
    (a * cos - b * sin, a * sin + b * cos)
}

/// A sphere with a tail that thins out along half a circle.
fn comma([x, y, z]: [f64; 3], p: &[f64]) -> f64 {
    let size = p[0];
    let x = if x == 0.0 && z == 0.0 { OFF_AXIS } else { x };
    let out = x - 0.5 * size;
    let head = (out * out + y * y + z * z).sqrt() - 0.5 * size;
    let spine = length(x + 0.25 * size, z) - 0.75 * size;
    let tail = length(spine, y) - 0.5 * size * (z.atan2(x) / 2.0).cos();
    head.min(tail.max(-z))
}

fn helical_torus([x, y, z]: [f64; 3], p: &[f64]) -> f64 {
    let &[major, loops, twist, fatness, threshold, minor, thickness, period, amplitude, phase, ..] = p else {
        return 0.0;
    };
    let out = length(x, z);
    let around = x.atan2(z);
    let from_ring = length(out - major, y);
    let turn = (loops * around + twist * (out - major).atan2(y)).rem_euclid(TAU) - PI;
    let beyond = from_ring - minor;
    let groove = -(period * (amplitude * turn).atan2(beyond) + phase * around).cos();
    let winding = (beyond * beyond + thickness * turn * turn).sqrt();
    // Without a number the cap alone is left.
    let winding = if winding < from_ring + minor || winding.is_nan() { winding } else { from_ring + minor };
    capped(winding + fatness * groove, out + major - minor) - threshold
}

/// Several helices about the y axis; distances are taken along the turn.
fn helix1([x, y, z]: [f64; 3], p: &[f64]) -> f64 {
    let &[count, period, minor, major, shape, kind, angle, ..] = p else { return 0.0 };
    let out = length(x, z);
    let spacing = TAU / count;
    let turn = (y * period + z.atan2(x)).rem_euclid(spacing) - spacing / 2.0;
    let (a, b) = turned(out - major, turn / period / shape, angle.to_radians());
    capped(section(a, b, kind), out + major) - minor
}

/// One helix about the y axis, cut level.
fn helix2([x, y, z]: [f64; 3], p: &[f64]) -> f64 {
    let &[_, period, minor, major, _, kind, ..] = p else { return 0.0 };
    let turn = period * y;
    let (a, b) = turned(x - major * turn.cos(), z - major * turn.sin(), -turn);
    section(a, b, kind) - minor
}

/// In the plane's hexagons of side 1: the distance from the middle towards the nearest side, and that along it.
fn hexagon([x, y, _]: [f64; 3]) -> (f64, f64) {
    // Half the width of a hexagon; rows are 1.5 apart, every other one shifted by this.
    let half = 0.75f64.sqrt();
    let row = (y / 1.5).floor();
    let cell = |row: f64| {
        let shift = if row.rem_euclid(2.0) == 0.0 { 0.0 } else { half };
        let column = ((x - shift) / (2.0 * half)).round();
        let (dx, dy) = ((x - shift - column * 2.0 * half).abs(), (y - 1.5 * row).abs());
        let slanted = 0.5 * dx + half * dy;
        if dx > slanted { (dx, dy) } else { (slanted, (half * dx - 0.5 * dy).abs()) }
    };
    let (below, above) = (cell(row), cell(row + 1.0));
    if below.0 < above.0 { below } else { above }
}

/// Threads along x and z that go over and under each other; the nearest two of either kind count.
fn mesh1([x, y, z]: [f64; 3], p: &[f64]) -> f64 {
    let &[apart_x, apart_z, thin, amplitude, flat, ..] = p else { return 0.0 };
    let thread = |across: f64, apart: f64, along: f64, sign: f64| {
        let first = (across / apart).floor();
        let wave = sign * amplitude * (PI * along).cos();
        let distance = |index: f64| {
            let lift = if index.rem_euclid(2.0) == 0.0 { wave } else { -wave };
            length((across - index * apart) * thin, (y - lift) * flat)
        };
        distance(first).min(distance(first + 1.0))
    };
    thread(x, apart_x, z / apart_z, -1.0).min(thread(z, apart_z, x / apart_x, 1.0))
}

/// Tubes around the y axis, as far from it as a polynomial of y says.
fn polytubes([x, y, z]: [f64; 3], p: &[f64]) -> f64 {
    let &[count, c0, c1, c2, c3, c4, ..] = p else { return 0.0 };
    let out = c0 + y * (c1 + y * (c2 + y * (c3 + y * c4)));
    let mut nearest = NO_TUBE;
    for tube in 0..count.clamp(0.0, MOST_TUBES) as u32 {
        let (sin, cos) = (TAU * f64::from(tube) / count).sin_cos();
        nearest = capped(length(x - out * sin, z - out * cos), nearest);
    }
    nearest
}

/// A band wound about the y axis, within a sphere.
fn spiral([x, y, z]: [f64; 3], p: &[f64]) -> f64 {
    let &[apart, thickness, radius, _, _, kind, ..] = p else { return 0.0 };
    let out = length(x, z);
    let start = apart * z.atan2(x) / TAU;
    let winding = ((out + start) / apart).floor();
    let mut across = out + start - winding * apart - apart / 2.0;
    // What would lie on the other side of the axis is not there: the next winding is the nearest.
    if apart / 2.0 + winding * apart - start < 0.0 {
        across -= apart;
    }
    let band = length(out, y).min(section(across, y, kind));
    (band - thickness).max((x * x + y * y + z * z).sqrt() - radius)
}
