//! Random scenes: a seed in, the text of a scene that any POV-Ray 3.7 reads out.
//!
//! Every shape, transform, composite, flag, light, pigment and finish that octray renders turns up, in scenes of a few
//! objects some units apart. The text knows neither evaluator nor engines; a scene that fails is named by its seed and
//! comes back.
//!
//! A scene can be asked for in other words: the right picture depends on none of the declarations that follow, and a
//! renderer whose picture does contradicts itself. All lengths are multiples of `U`, 1 unless declared from outside; opaque
//! colours have `transmit T`, 0 unless declared; the eye is moved by `EYE`, 0 unless declared; polynomials are written in
//! units of which `P` are 1, 1 unless declared; with `STURM` declared quartics and cubics say `sturm`; and with `MESHED`
//! declared each triangle by itself is a mesh of one.

mod look;
mod polynomial;
mod shape;

use glam::DVec3;
use look::rgb;
use std::fmt::Write;

/// Numbers that a seed decides: Numerical Recipes' 64-bit congruential generator, upper bits; enough to scatter objects.
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// Well apart for neighbouring seeds.
    pub fn new(seed: u64) -> Self {
        let mut random = Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(1));
        for _ in 0..8 {
            random.unit();
        }
        random
    }

    /// From 0 to 1, 1 excluded.
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// From `low` to `high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// 0 to `n - 1`.
    pub fn below(&mut self, n: usize) -> usize {
        (self.unit() * n as f64) as usize
    }

    /// True in `share` of all cases.
    pub fn chance(&mut self, share: f64) -> bool {
        self.unit() < share
    }

    /// Each coordinate from `-reach` to `reach`.
    pub fn point(&mut self, reach: f64) -> [f64; 3] {
        [(); 3].map(|()| self.between(-reach, reach))
    }

    /// The same as a vector.
    pub fn vector(&mut self, reach: f64) -> DVec3 {
        DVec3::from_array(self.point(reach))
    }

    /// A direction of length 1.
    pub fn direction(&mut self) -> [f64; 3] {
        loop {
            let p = self.point(1.0);
            let length = p.iter().map(|x| x * x).sum::<f64>().sqrt();
            if (0.1..1.0).contains(&length) {
                return p.map(|x| x / length);
            }
        }
    }
}

/// A number with four decimals: what is written is what is meant.
fn n(x: f64) -> String {
    format!("{x:.4}")
}

/// A vector of plain numbers.
fn v([x, y, z]: [f64; 3]) -> String {
    format!("<{x:.4}, {y:.4}, {z:.4}>")
}

/// A point: a vector of lengths.
fn p(point: [f64; 3]) -> String {
    format!("{}*U", v(point))
}

/// A length.
fn l(x: f64) -> String {
    format!("{x:.4}*U")
}

/// The text of scene `seed`.
pub fn scene(seed: u64) -> String {
    let r = &mut Random::new(seed);
    let mut text = format!("// Random scene {seed}.\n#version 3.7;\n#ifndef (U) #declare U = 1; #end\n");
    text += "#ifndef (T) #declare T = 0; #end\n#ifndef (EYE) #declare EYE = 0; #end\n";
    text += "#ifndef (P) #declare P = 1; #end\n";
    // Writing to a string cannot fail.
    let _ =
        writeln!(text, "global_settings {{ assumed_gamma {} }}", if r.chance(0.1) { "2.2" } else { "1.0" });
    let _ = writeln!(text, "global_settings {{ max_trace_level {} }}", 2 + r.below(6));
    if r.chance(0.1) {
        let _ = writeln!(text, "global_settings {{ adc_bailout {} }}", n(r.between(0.001, 0.2)));
    }
    if r.chance(0.1) {
        let _ = writeln!(text, "global_settings {{ ambient_light {} }}", rgb(r));
    }
    if r.chance(0.1) {
        let wavelengths = [(); 3].map(|()| r.between(0.4, 0.8));
        let _ = writeln!(text, "global_settings {{ irid_wavelength rgb {} }}", v(wavelengths));
    }
    text += &camera(r);
    if r.chance(0.7) {
        let transmit = if r.chance(0.2) { format!(" transmit {}", n(r.unit())) } else { String::new() };
        let _ = writeln!(text, "background {{ {}{transmit} }}", rgb(r));
    }
    for _ in 0..1 + r.below(3) {
        text += &light(r);
    }
    for _ in 0..2 + r.below(8) {
        text += &shape::object(r);
    }
    if r.chance(0.6) {
        let _ = writeln!(text, "plane {{ y, {} {} }}", l(-3.0), look::texture(r));
    }
    // Last, so that a seed's scene keeps what it had without them.
    for _ in 0..r.below(3) {
        text += &shape::late_object(r);
    }
    text
}

fn camera(r: &mut Random) -> String {
    let distance = r.between(4.0, 9.0);
    let eye = r.direction().map(|x| x * distance);
    let (eye, target) = (p(eye), p(r.point(0.5)));
    let text = match r.below(5) {
        0 => format!(
            "camera {{ orthographic location {eye} right {}*x up {}*y look_at {target}",
            l(6.67),
            l(5.0)
        ),
        1 => format!(
            "camera {{ location {eye} direction {}*z right -4/3*x up y sky {} look_at {target}",
            n(r.between(0.6, 1.5)),
            v(r.direction())
        ),
        2 => format!(
            "camera {{ location {eye} right 4/3*x angle {} look_at {target} translate {} rotate {}",
            n(r.between(30.0, 90.0)),
            p(r.point(0.3)),
            v(r.point(20.0))
        ),
        _ => format!("camera {{ location {eye} right 4/3*x look_at {target}"),
    };
    // A step along no axis.
    text + " translate EYE*U*<0.6, 0.64, 0.48> }\n"
}

fn light(r: &mut Random) -> String {
    let distance = r.between(6.0, 20.0);
    let place = r.direction().map(|x| x * distance);
    let rgb = [(); 3].map(|()| r.between(0.0, 1.2));
    let mut text = format!("light_source {{ {}, rgb {}", p(place), v(rgb));
    let aim = format!(" point_at {}", p(r.point(1.0)));
    match r.below(4) {
        0 => {
            let radius = r.between(5.0, 25.0);
            let falloff = radius + r.between(0.5, 20.0);
            let _ = write!(text, " spotlight radius {} falloff {}{aim}", n(radius), n(falloff));
            if r.chance(0.5) {
                let _ = write!(text, " tightness {}", n(r.between(0.0, 10.0)));
            }
        }
        1 => {
            let radius = r.between(0.5, 2.0);
            let falloff = radius + r.between(0.1, 2.0);
            let _ = write!(text, " cylinder radius {} falloff {}{aim}", l(radius), l(falloff));
            if r.chance(0.5) {
                let _ = write!(text, " tightness {}", n(r.between(0.0, 2.0)));
            }
        }
        _ if r.chance(0.2) => text = text + " parallel" + &aim,
        _ => {}
    }
    if r.chance(0.1) {
        // Said after `spotlight` or `cylinder` it undoes them, but for the parallel rays.
        text += " shadowless";
    }
    if r.chance(0.3) {
        // Behind a parallel light POV-Ray raises a negative distance to the power: an even one, or it is no number.
        let power =
            if text.contains("parallel") || text.contains("cylinder") { 2.0 } else { r.between(1.0, 2.0) };
        let distance = r.between(5.0, 15.0);
        let _ = write!(text, " fade_distance {} fade_power {}", l(distance), n(power));
    }
    text + " }\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// What the generator is for: a word that never turns up is a thing that is never tested.
    #[test]
    fn everything_turns_up() {
        let text: String = (0..400).map(scene).collect();
        let words: BTreeSet<&str> = text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').collect();
        let all = "sphere box cylinder cone torus plane disc triangle smooth_triangle polygon mesh mesh2 open \
                   inside_vector union merge intersection difference cutaway_textures clipped_by bounded_by inverse \
                   no_shadow no_image no_reflection hollow double_illuminate scale rotate translate matrix texture \
                   interior_texture material interior ior fade_distance fade_power fade_color caustics pigment checker \
                   brick mortar hexagon gradient color_map ramp_wave triangle_wave sine_wave scallop_wave cubic_wave \
                   poly_wave frequency phase finish ambient emission diffuse albedo brilliance phong phong_size \
                   specular roughness metallic irid thickness reflection fresnel falloff exponent conserve_energy \
                   filter transmit spotlight tightness parallel shadowless orthographic max_trace_level adc_bailout \
                   ambient_light irid_wavelength texture_list quadric cubic quartic poly";
        let missing: Vec<_> = all.split_whitespace().filter(|word| !words.contains(word)).collect();
        assert!(missing.is_empty(), "{missing:?}");
        assert!(text.contains(" scale <-1, 1, 1>"), "nothing is mirrored");
    }

    #[test]
    fn a_seed_is_a_scene() {
        assert_eq!(scene(7), scene(7));
        assert_ne!(scene(7), scene(8));
    }
}
