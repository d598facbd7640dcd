//! Random polynomial surfaces: closed ones as they are, endless ones clipped.
//!
//! Each is written in units of its own, `P` of which are 1: the surface is the same for every `P`, while what a solver holds
//! against fixed numbers is not.

use super::{Random, l, n, p, v};

/// By POV-Ray's other solver, where there is a choice.
const STURM: &str = "#ifdef (STURM) sturm #end";

/// Not closed, for more to be said of it. All are drawn about the middle in units of 1 and lie within 2 `U` of it.
pub fn polynomial(r: &mut Random) -> String {
    match r.below(7) {
        0 => ellipsoid(r),
        1 => hyperboloid(r),
        2 => {
            let terms = terms(3, |_, degree| match degree {
                0 => r.between(-0.3, 0.0),
                3 => sparse(r, 1.0),
                _ => sparse(r, 0.5),
            });
            clipped(r, &format!("cubic {{ {terms} {STURM}"))
        }
        3 => {
            // A drop along x from 0 to its length, pointed at 0.
            let (length, width) = (r.between(0.8, 1.6), r.between(0.8, 2.0));
            let terms = terms(4, |powers, _| match powers {
                [4, 0, 0] => length.powi(-4),
                [3, 0, 0] => -length.powi(-3),
                [0, 2, 0] | [0, 0, 2] => width,
                _ => 0.0,
            });
            format!("quartic {{ {terms} {STURM} scale U/P translate {}", p([-0.5 * length, 0.0, 0.0]))
        }
        4 => {
            // Goursat's surface: eight bulbs, joined or apart.
            let swelling = r.between(10.0, 12.0);
            let terms = terms(4, |powers, degree| match (degree, powers.iter().max()) {
                (4, Some(4)) => 1.0,
                (2, Some(2)) => -5.0,
                (0, _) => swelling,
                _ => 0.0,
            });
            format!("quartic {{ {terms} {STURM} scale {}/P", l(r.between(0.3, 0.5)))
        }
        5 => {
            let terms = terms(5, |_, degree| match degree {
                0 => r.between(-0.3, 0.0),
                _ if r.chance(0.3) => r.between(-1.0, 1.0),
                _ => 0.0,
            });
            clipped(r, &format!("poly {{ 5, {terms}"))
        }
        _ => {
            // Nearly a rounded box; the mixed terms are too small to open it.
            let terms = terms(6, |powers, degree| match (degree, powers.iter().max()) {
                (6, Some(6)) => 1.0,
                (6, Some(2)) => r.between(-0.5, 2.0),
                (3, Some(1)) => r.between(-0.5, 0.5),
                (0, _) => -r.between(0.3, 1.0),
                _ => 0.0,
            });
            format!("poly {{ 6, {terms} scale U/P")
        }
    }
}

/// The coefficients of order `order`, each from its powers of x, y and z and their sum, as POV-Ray lists them.
fn terms(order: usize, mut coefficient: impl FnMut([usize; 3], usize) -> f64) -> String {
    let mut list = Vec::new();
    for i in (0..=order).rev() {
        for j in (0..=order - i).rev() {
            for k in (0..=order - i - j).rev() {
                list.push(term(coefficient([i, j, k], i + j + k), order - i - j - k));
            }
        }
    }
    format!("<{}>", list.join(", "))
}

/// A coefficient `c`, whose term lacks `below` of the order.
fn term(c: f64, below: usize) -> String {
    if below == 0 || c == 0.0 { n(c) } else { format!("{}*pow(P, {below})", n(c)) }
}

/// 0 as often as not.
fn sparse(r: &mut Random, reach: f64) -> f64 {
    if r.chance(0.5) { r.between(-reach, reach) } else { 0.0 }
}

/// Leaning: the mixed terms stay below the squares, so that it is closed.
fn ellipsoid(r: &mut Random) -> String {
    let squares = [(); 3].map(|()| r.between(1.0, 4.0));
    let (mixed, linear) = (r.point(0.9), r.point(0.3));
    let constant = term(-r.between(0.3, 1.0), 2);
    format!("quadric {{ {}, {}, {}*P, {constant} scale U/P", v(squares), v(mixed), v(linear))
}

/// Of one sheet, of two, or nearly a cone.
fn hyperboloid(r: &mut Random) -> String {
    let squares = [r.between(1.0, 4.0), -r.between(0.5, 2.0), r.between(1.0, 4.0)];
    let mixed = r.point(0.3);
    let text = format!("quadric {{ {}, {}, 0, {}", v(squares), v(mixed), term(r.between(-0.4, 0.2), 2));
    clipped(r, &text)
}

/// `text` at its size, cut by a ball or a box. It is not bounded by it: POV-Ray takes no other clip after that.
fn clipped(r: &mut Random, text: &str) -> String {
    let reach = r.between(0.8, 1.2);
    let cutter = if r.chance(0.5) {
        format!("sphere {{ 0, {} }}", l(reach))
    } else {
        format!("box {{ {}, {} }}", p([-reach; 3]), p([reach; 3]))
    };
    format!("{text} scale U/P clipped_by {{ {cutter} }}")
}
