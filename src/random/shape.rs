//! Random objects: solids, flat shapes, meshes and composites, with what is said of them.

use super::look::{interior, plain_texture, texture, transform};
use super::polynomial::polynomial;
use super::{Random, l, p, v};
use std::fmt::Write;

/// Composites within composites.
const DEEPEST: usize = 3;

/// One object of the scene, with a texture.
pub fn object(r: &mut Random) -> String {
    let place = r.point(2.0);
    nested(r, 0, false, &format!(" translate {}", p(place))) + "\n"
}

/// One object more: of a polynomial, by itself or cut, or any object in a mirror.
pub fn late_object(r: &mut Random) -> String {
    let mirror = if r.chance(0.4) { " scale <-1, 1, 1>" } else { "" };
    let last = format!("{mirror} translate {}", p(r.point(2.0)));
    let text = match r.below(4) {
        0 => return nested(r, 0, false, &last) + "\n",
        1 => {
            let kind = r.below(4);
            let operation = ["union", "merge", "intersection", "difference"][kind];
            let text = polynomial(r);
            let other = nested(r, DEEPEST, kind >= 2, "");
            format!("{operation} {{ {} {other}", dressed(r, text, false, DEEPEST, false, ""))
        }
        _ => polynomial(r),
    };
    dressed(r, text, false, 0, false, &last) + "\n"
}

/// `last` is said after everything else. Only what is cut by something finite (`cut`) may be turned inside out or fill
/// half of space: of such objects POV-Ray asks whether the eye is in them only if it is in their box, as if they were
/// finite.
fn nested(r: &mut Random, depth: usize, cut: bool, last: &str) -> String {
    let mut hollow_only = false;
    let text = match r.below(10) {
        0 | 1 if depth < DEEPEST => composite(r, depth),
        2 if depth == 0 => {
            hollow_only = true;
            flat(r)
        }
        3 if depth == 0 && r.chance(0.5) => mesh(r),
        _ => solid(r),
    };
    dressed(r, text, hollow_only, depth, cut, last)
}

/// What is said of a shape, which it closes.
fn dressed(
    r: &mut Random,
    mut text: String,
    hollow_only: bool,
    depth: usize,
    cut: bool,
    last: &str,
) -> String {
    // What is said before a transform is moved by it.
    if r.chance(0.5) {
        text += &transform(r);
    }
    let textured = depth == 0 || r.chance(0.3);
    match (textured, r.chance(0.3) && !hollow_only) {
        (true, true) if r.chance(0.2) => {
            let _ = write!(text, " material {{ {} {} }}", texture(r), interior(r));
        }
        (textured, filled) => {
            if textured {
                let _ = write!(text, " {}", texture(r));
            }
            if filled {
                let _ = write!(text, " {}", interior(r));
            }
        }
    }
    if textured && r.chance(0.1) {
        let _ = write!(text, " {}", texture(r).replace("texture {", "interior_texture {"));
    }
    if r.chance(0.1) {
        // In POV-Ray a mesh that clips a mesh takes away nearly all of it.
        let cutter = if text.starts_with("mesh") || text.contains("inside_vector") {
            format!("box {{ {}, {}", p(r.point(1.0)), p(r.point(1.0)))
        } else {
            solid(r)
        };
        let _ = write!(text, " clipped_by {{ {cutter} }} }}");
        if r.chance(0.3) {
            text += " bounded_by { clipped_by }";
        }
    } else if r.chance(0.05) {
        // Far enough to bound anything that is made here.
        let _ = write!(text, " bounded_by {{ sphere {{ 0, {} }} }}", l(12.0));
    }
    text += &transform(r);
    for (flag, share) in [
        (" no_shadow", 0.05),
        (" no_image", if depth == 0 { 0.03 } else { 0.0 }),
        (" no_reflection", if depth == 0 { 0.05 } else { 0.0 }),
        (" hollow", 0.05),
        (" inverse", if cut { 0.1 } else { 0.0 }),
        (" double_illuminate", 0.1),
    ] {
        if r.chance(share) {
            text += flag;
        }
    }
    text + last + " }"
}

/// Not closed, as all shapes here: more is to be said.
fn composite(r: &mut Random, depth: usize) -> String {
    let operation = ["union", "merge", "intersection", "difference"][r.below(4)];
    let mut text = format!("{operation} {{");
    let cuts = operation == "intersection" || operation == "difference";
    let children = 2 + r.below(2);
    for k in 0..children {
        if cuts && k > 0 && r.chance(0.15) {
            let _ = write!(
                text,
                " plane {{ {}, {}{} }}",
                v(r.direction()),
                l(r.between(-0.2, 0.3)),
                transform(r)
            );
        } else {
            let _ = write!(text, " {}", nested(r, depth + 1, cuts && k > 0, ""));
        }
    }
    if cuts && r.chance(0.15) {
        text += " cutaway_textures";
    }
    text
}

fn solid(r: &mut Random) -> String {
    match r.below(8) {
        0 | 1 => format!("sphere {{ {}, {}", p(r.point(0.5)), l(r.between(0.3, 1.0))),
        2 => format!("box {{ {}, {}", p(r.point(1.0)), p(r.point(1.0))),
        3 => format!("cylinder {{ {}, {}, {}", p(r.point(0.8)), p(r.point(0.8)), l(r.between(0.1, 0.6))),
        4 => {
            let tip = if r.chance(0.3) { 0.0 } else { r.between(0.1, 0.6) };
            let base = r.between(0.2, 0.8);
            format!("cone {{ {}, {}, {}, {}", p(r.point(0.8)), l(base), p(r.point(0.8)), l(tip))
        }
        5 | 6 => format!("torus {{ {}, {}", l(r.between(0.4, 0.9)), l(r.between(0.05, 0.3))),
        _ => {
            // Opposite corners of an octahedron with six ends of any length.
            let ends = [(); 6].map(|()| r.between(0.4, 1.1));
            let corner = |axis: usize, side: usize| {
                let mut point = [0.0; 3];
                point[axis] = if side == 0 { ends[axis] } else { -ends[axis + 3] };
                p(point)
            };
            let mut text = String::from("mesh {");
            for face in 0..8 {
                let sides = [face & 1, face >> 1 & 1, face >> 2];
                let _ = write!(
                    text,
                    " triangle {{ {}, {}, {} }}",
                    corner(0, sides[0]),
                    corner(1, sides[1]),
                    corner(2, sides[2])
                );
            }
            format!("{text} inside_vector {}", v(r.direction()))
        }
    }
}

fn flat(r: &mut Random) -> String {
    match r.below(6) {
        0 => format!(
            "#ifdef (MESHED) mesh {{ #end triangle {{ {}, {}, {} #ifdef (MESHED) }} #end",
            p(r.point(1.2)),
            p(r.point(1.2)),
            p(r.point(1.2))
        ),
        1 => {
            let [a, b, c] = [(); 3].map(|()| r.point(1.2));
            let [na, nb, nc] = bent_normals(r, a, b, c);
            format!("smooth_triangle {{ {}, {na}, {}, {nb}, {}, {nc}", p(a), p(b), p(c))
        }
        2 => {
            let hole = if r.chance(0.5) { format!(", {}", l(0.3)) } else { String::new() };
            format!("disc {{ {}, {}, {}{hole}", p(r.point(0.5)), v(r.direction()), l(r.between(0.5, 1.2)))
        }
        3 => {
            // A pentagon with a pentagonal hole, in the plane z = 0; the transforms turn it.
            let ring = |size: f64| {
                let corner = |k: usize| {
                    let (y, x) = (k as f64 * 1.256637).sin_cos();
                    p([size * x, size * y, 0.0])
                };
                (0..5).chain([0]).map(corner).collect::<Vec<_>>().join(", ")
            };
            format!("polygon {{ 12, {}, {} rotate {}", ring(1.0), ring(0.4), v(r.point(180.0)))
        }
        4 => {
            let (base, cap) = (r.between(0.2, 0.8), r.between(0.1, 0.6));
            format!("cone {{ {}, {}, {}, {} open", p(r.point(0.8)), l(base), p(r.point(0.8)), l(cap))
        }
        _ => {
            format!("cylinder {{ {}, {}, {} open", p(r.point(0.8)), p(r.point(0.8)), l(r.between(0.2, 0.6)))
        }
    }
}

/// A patch of triangles, some with textures of their own, some smooth.
fn mesh(r: &mut Random) -> String {
    let [a, b, c, d] = [(); 4].map(|()| r.point(1.2));
    if r.chance(0.5) {
        let [na, nb, nc] = bent_normals(r, a, b, c);
        let mut text =
            format!("mesh {{ smooth_triangle {{ {}, {na}, {}, {nb}, {}, {nc} }}", p(a), p(b), p(c));
        let _ = write!(text, " triangle {{ {}, {}, {}", p(b), p(c), p(d));
        // A mesh names textures that were declared.
        return text + " }";
    }
    let mut text = format!("mesh2 {{ vertex_vectors {{ 4, {}, {}, {}, {} }}", p(a), p(b), p(c), p(d));
    if r.chance(0.4) {
        let [na, nb, nc] = bent_normals(r, a, b, c);
        let _ = write!(text, " normal_vectors {{ 4, {na}, {nb}, {nc}, {} }}", v(r.direction()));
    }
    let textures = [(); 3].map(|()| plain_texture(r));
    let _ = write!(text, " texture_list {{ 3, {} }}", textures.join(" "));
    let blend = if r.chance(0.6) { "0, 1, 2" } else { "1" };
    text + &format!(" face_indices {{ 2, <0, 1, 2>, {blend}, <1, 2, 3>, 2 }}")
}

/// Unit normals near that of the triangle.
fn bent_normals(r: &mut Random, a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> [String; 3] {
    let (e, f) = ([0, 1, 2].map(|k| b[k] - a[k]), [0, 1, 2].map(|k| c[k] - a[k]));
    let cross = [e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]];
    let length = cross.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-3);
    [(); 3].map(|()| {
        let bend = r.point(0.3);
        v([0, 1, 2].map(|k| cross[k] / length + bend[k]))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn braces_close() {
        for seed in 0..200 {
            let text = object(&mut Random::new(seed));
            assert_eq!(text.matches('{').count(), text.matches('}').count(), "{text}");
        }
    }
}
