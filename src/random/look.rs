//! Random looks: pigments, finishes, textures, interiors.

use super::{Random, l, n, p, v};
use std::fmt::Write;

/// `rgb <...>`.
pub fn rgb(r: &mut Random) -> String {
    format!("rgb {}", v([(); 3].map(|()| r.unit())))
}

/// A pigment's colour, with filter and transmit if it is to be `clear`.
fn color(r: &mut Random, clear: bool) -> String {
    let rgb = rgb(r);
    if clear {
        format!("{rgb} filter {} transmit {}", n(r.between(0.0, 0.6)), n(r.between(0.0, 0.4)))
    } else {
        format!("{rgb} transmit T")
    }
}

fn pigment(r: &mut Random, clear: bool) -> String {
    let pattern = match r.below(7) {
        0 => format!("checker {}, {}", color(r, clear), color(r, false)),
        1 => format!(
            "brick {}, {} brick_size {} mortar {}",
            color(r, clear),
            color(r, clear),
            v([0.8, 0.3, 0.45]),
            n(r.between(0.02, 0.1))
        ),
        2 => format!("hexagon {}, {}, {}", color(r, clear), color(r, clear), color(r, clear)),
        3 | 4 => {
            let wave =
                ["ramp_wave", "triangle_wave", "sine_wave", "scallop_wave", "cubic_wave", "poly_wave 2.5"]
                    [r.below(6)];
            let mut text = format!("gradient {} color_map {{", v(r.direction()));
            for place in ["0.1", "0.5", "0.5", "0.9"] {
                let _ = write!(text, " [{place} {}]", color(r, clear));
            }
            format!("{text} }} {wave} frequency {} phase {}", n(r.between(0.5, 3.0)), n(r.unit()))
        }
        _ => return format!("pigment {{ {} }}", color(r, clear)),
    };
    format!("pigment {{ {pattern} scale U{} }}", transform(r))
}

fn finish(r: &mut Random) -> String {
    let mut text = format!("finish {{ ambient rgb {}", v([(); 3].map(|()| 0.2 * r.unit())));
    let albedo = if r.chance(0.1) { "albedo " } else { "" };
    let _ = write!(text, " diffuse {albedo}{}", n(r.unit()));
    if r.chance(0.3) {
        let _ = write!(text, ", {}", n(r.between(0.0, 0.5)));
    }
    if r.chance(0.1) {
        let _ = write!(text, " emission {}", n(r.between(0.0, 0.3)));
    }
    if r.chance(0.2) {
        let _ = write!(text, " brilliance {}", n(r.between(0.5, 4.0)));
    }
    if r.chance(0.4) {
        let (amount, albedo) = if r.chance(0.1) { (0.05, "albedo ") } else { (r.unit(), "") };
        let _ = write!(text, " phong {albedo}{} phong_size {}", n(amount), n(r.between(5.0, 100.0)));
    }
    if r.chance(0.4) {
        let (amount, albedo) = if r.chance(0.1) { (0.05, "albedo ") } else { (r.unit(), "") };
        let _ = write!(text, " specular {albedo}{} roughness {}", n(amount), n(r.between(0.005, 0.2)));
    }
    if r.chance(0.2) {
        let _ = write!(text, " metallic {}", n(r.unit()));
    }
    if r.chance(0.1) {
        let _ = write!(text, " irid {{ {} thickness {} }}", n(r.between(0.1, 0.5)), n(r.unit()));
    }
    if r.chance(0.4) {
        text += &reflection(r);
        if r.chance(0.3) {
            text += " conserve_energy";
        }
    }
    text + " }"
}

fn reflection(r: &mut Random) -> String {
    let max = v([(); 3].map(|()| 0.7 * r.unit()));
    if r.chance(0.2) {
        return format!(" reflection rgb {max}");
    }
    let mut text = String::from(" reflection {");
    if r.chance(0.5) {
        let min = v([(); 3].map(|()| 0.2 * r.unit()));
        let _ = write!(text, " rgb {min},");
    }
    let _ = write!(text, " rgb {max}");
    if r.chance(0.3) {
        text += " fresnel";
    }
    if r.chance(0.3) {
        let _ = write!(text, " falloff {}", n(r.between(0.5, 3.0)));
    }
    if r.chance(0.2) {
        let _ = write!(text, " exponent {}", n(r.between(0.6, 1.5)));
    }
    if r.chance(0.2) {
        let _ = write!(text, " metallic {}", n(r.unit()));
    }
    text + " }"
}

/// One texture, or two over each other.
pub fn texture(r: &mut Random) -> String {
    let clear = r.chance(0.35);
    let layers = if r.chance(0.15) { 2 } else { 1 };
    let layer =
        |r: &mut Random, clear| format!("texture {{ {} {}{} }}", pigment(r, clear), finish(r), transform(r));
    (0..layers).map(|k| layer(r, clear || k > 0)).collect::<Vec<_>>().join(" ")
}

/// An opaque texture of one colour, for a list.
pub fn plain_texture(r: &mut Random) -> String {
    format!("texture {{ pigment {{ {} }} finish {{ diffuse {} }} }}", color(r, false), n(r.unit()))
}

/// Glass of some kind.
pub fn interior(r: &mut Random) -> String {
    let mut text = format!("interior {{ ior {}", n(r.between(1.0, 1.8)));
    if r.chance(0.5) {
        let power = if r.chance(0.2) { 1001.0 } else { r.between(1.0, 2.0) };
        let _ = write!(text, " fade_distance {} fade_power {}", l(r.between(0.3, 3.0)), n(power));
        let _ = write!(text, " fade_color {}", rgb(r));
    }
    if r.chance(0.3) {
        let _ = write!(text, " caustics {}", n(r.unit()));
    }
    text + " }"
}

/// None, or some transforms in a row, each with a space before it.
pub fn transform(r: &mut Random) -> String {
    if r.chance(0.3) {
        return String::new();
    }
    let mut text = match r.below(4) {
        0 => String::new(),
        1 => format!(" scale {}", n(r.between(0.5, 1.5))),
        2 => format!(" scale {}", v([(); 3].map(|()| r.between(0.5, 1.5)))),
        _ => {
            let mut entry = |diagonal: f64| n(diagonal + r.between(-0.25, 0.25));
            let rows: Vec<String> =
                [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0].map(&mut entry).into_iter().collect();
            format!(" matrix <{}, {}*U, {}*U, {}*U>", rows.join(", "), n(0.1), n(-0.2), n(0.3))
        }
    };
    let _ = write!(text, " rotate {}", v(r.point(180.0)));
    if r.chance(0.7) {
        let _ = write!(text, " translate {}", p(r.point(0.5)));
    }
    text
}
