//! Rays whose first meeting is known from double-double: how many are lost or won, and how far along they are off.

use super::dd::Dd;
use super::oracle::{OwnRay, Solid, reach};
use super::povray;
use super::scene;
use super::support::Rng;
use super::table::{Figure, Row};
use glam::{DMat3, DVec3};
use octray::compile::Compiled;
use octray::scene::Transform;
use octray::{reference, wave};
use std::sync::LazyLock;

/// One shape and rays at it.
struct Case {
    name: &'static str,
    /// In its own space, in the words of a scene.
    object: &'static str,
    solid: Solid,
    place: Transform,
    lay: fn(&Solid, &Transform, &mut Rng) -> (DVec3, DVec3),
    /// Most rays of [`RAYS`] that `fast` may lose or win, and its largest share of error in `t`: these may only shrink.
    fast: (usize, f64),
    /// The same of `exact`, `strict` and the oracle, for meetings that f64 can tell from misses.
    exact: f64,
    reason: &'static str,
}

/// Rays of each case.
const RAYS: usize = 4000;

/// Roundings between a ray and a meeting; see `tests/kernels/exact.rs`.
const ROUNDINGS: f64 = 8.0;

fn unit(d: DVec3) -> DVec3 {
    d.normalize()
}

fn placed(scale: f64, offset: DVec3) -> Transform {
    Transform::scale(DVec3::splat(scale)).then(&Transform::translate(offset))
}

/// To a random point in the shape's box, from `far` sizes away.
fn across(far: f64, place: &Transform, rng: &mut Rng) -> (DVec3, DVec3) {
    let size = place.vector(DVec3::X).length();
    let target = place.point(rng.cube() * 0.98);
    let from = place.forward.translation + rng.direction() * size * far;
    (from, unit(target - from))
}

/// Along a tangent, off the surface by `off` sizes to either side.
fn graze(far: f64, off: f64, solid: &Solid, place: &Transform, rng: &mut Rng) -> (DVec3, DVec3) {
    let p = solid.surface(rng);
    let n = solid.normal(p);
    let off = if rng.unit() < 0.5 { off } else { -off };
    let tangent = unit(place.vector(n.cross(rng.direction())));
    (place.point(p + n * off) - tangent * place.vector(DVec3::X).length() * far, tangent)
}

/// At an edge, rim, corner or apex, and on into the shape's middle.
fn feature(far: f64, solid: &Solid, place: &Transform, rng: &mut Rng) -> (DVec3, DVec3) {
    let p = solid.feature(rng);
    let outward = (unit(p - DVec3::new(0.0, 0.0, 0.3)) + rng.direction() * 0.3).normalize();
    let from = place.point(p + outward * far);
    (from, unit(place.point(p) - from))
}

const TORUS: &str = "torus { 0.75, 0.25 rotate 90*x }";
const THIN: &str = "torus { 1 - 1/1024, 1/1024 rotate 90*x }";
const THIN_SOLID: Solid = Solid::Torus { major: 1.0 - 1.0 / 1024.0, minor: 1.0 / 1024.0 };
/// The torus, multiplied out.
const QUARTIC: &str =
    "quartic { <1,0,0,0,2,0,0,2,0,-1.25, 0,0,0,0,0,0,0,0,0,0, 1,0,0,2,0,-1.25,0,0,0,0, 1,0,1,0,0.25> }";
/// The ball, cubed.
static SIXTH: LazyLock<String> = LazyLock::new(super::closed_forms::ball_of_order_6);
const TORUS_SOLID: Solid = Solid::Torus { major: 0.75, minor: 0.25 };
const FEW: &str = "t to the roundings of the rays' f32; lost or won where a ray passes the outline by less";

#[rustfmt::skip]
fn cases() -> Vec<Case> {
    let at = DVec3::new(1.0, -2.0, 3.0);
    let zero = DVec3::ZERO;
    let ball = |name, place, lay, fast, exact, reason| Case { name, object: "sphere { 0, 1 }", solid: Solid::Ball, place, lay, fast, exact, reason };
    let torus = |name, place, lay, fast, exact, reason| Case { name, object: TORUS, solid: TORUS_SOLID, place, lay, fast, exact, reason };
    let quartic = |name, place, lay, fast, exact, reason| Case { name, object: QUARTIC, solid: TORUS_SOLID, place, lay, fast, exact, reason };
    let sixth = |name, place, lay, fast, exact, reason| Case { name, object: SIXTH.as_str(), solid: Solid::Ball, place, lay, fast, exact, reason };
    let thin = |name, place, lay, fast, exact, reason| Case { name, object: THIN, solid: THIN_SOLID, place, lay, fast, exact, reason };
    let half = DVec3::new(1.0, 0.5, 0.25);
    let bar = |name, place, lay, fast, exact, reason| Case { name, object: "box { -<1, 0.5, 0.25>, <1, 0.5, 0.25> }", solid: Solid::Box { half }, place, lay, fast, exact, reason };
    vec![
        ball("ball, 3 radii away", placed(1.0, zero), |_, t, r| across(3.0, t, r), (4, 4e-6), 1e-14, FEW),
        ball("ball, 1e6 radii away", placed(1.0, zero), |_, t, r| across(1e6, t, r), (120, 1e-6), 1e-14, FEW),
        ball("ball of radius 2^-20", placed(2f64.powi(-20), zero), |_, t, r| across(1e4, t, r), (8, 4e-6), 1e-14, FEW),
        ball("ball at 1e6", placed(1.0, at * 1e6), |_, t, r| across(3.0, t, r), (4, 4e-6), 1e-14, FEW),
        ball("ball at 1e8", placed(1.0, at * 1e8), |_, t, r| across(3.0, t, r), (4, 4e-6), 1e-14, FEW),
        ball("grazing a ball by 1e-3", placed(1.0, zero), |s, t, r| graze(3.0, 1e-3, s, t, r), (0, 1e-5), 2e-14, FEW),
        ball("grazing a ball by 1e-6", placed(1.0, zero), |s, t, r| graze(3.0, 1e-6, s, t, r), (0, 2e-4), 5e-13, FEW),
        ball("grazing a ball by 1e-9", placed(1.0, zero), |s, t, r| graze(3.0, 1e-9, s, t, r), (2100, 1e-3), 2e-11, FEW),
        ball("planet: 1.7 above radius 6.4e6, to the horizon", placed(6.4e6, zero), |s, t, r| {
            let p = s.surface(r);
            let n = s.normal(p);
            let height: f64 = 1.7 / 6.4e6;
            let down = (2.0 * height).sqrt() * 10f64.powf(3.0 * r.unit() - 0.1);
            (t.point(p * (1.0 + height)), unit(n.cross(r.direction()) - n * down))
        }, (60, 1.0), 5e-8, "the height itself is rounded: 7e-10 in f64, 0.5 in f32"),
        bar("box, rays at edges and corners", placed(1.0, zero), |s, t, r| feature(3.0, s, t, r), (700, 1e-5), 1e-14, FEW),
        bar("box, along an axis, some directions -0", placed(1.0, zero), |_, t, r| {
            let mut dir = DVec3::ZERO;
            let sign = if r.unit() < 0.5 { -1.0 } else { 1.0 };
            dir[(r.unit() * 3.0) as usize] = sign;
            (t.point(r.cube() * DVec3::new(1.0, 0.5, 0.25) * 1.2) - dir * 3.0, if r.unit() < 0.5 { dir } else { -(DVec3::ZERO - dir) })
        }, (0, 1e-6), 1e-15, FEW),
        bar("box, along an axis in a face", placed(1.0, zero), |_, _, r| {
            let from = DVec3::new(-3.0, 0.5, (r.unit() - 0.5) * 0.4);
            (from, DVec3::X)
        }, (0, 1e-6), 1e-15, "a face belongs to its box"),
        Case { name: "cone, at its apex", object: "cone { 0, 1, z, 0 }", solid: Solid::Cone { taper: 1.0, open: false }, place: placed(1.0, zero),
            lay: |_, _, r| {
                let from = DVec3::new(3.0 * r.unit() - 1.5, 3.0 * r.unit() - 1.5, 1.5 + 3.0 * r.unit());
                (from, unit(DVec3::Z - from))
            }, fast: (2300, 2e-4), exact: 1e-11, reason: "the ray is rounded too, and passes the apex by that much on either side" },
        Case { name: "cylinder, at the rims of its caps", object: "cylinder { 0, z, 1 }", solid: Solid::Cone { taper: 0.0, open: false }, place: placed(1.0, zero),
            lay: |s, t, r| feature(3.0, s, t, r), fast: (40, 1e-6), exact: 1e-14, reason: FEW },
        torus("torus, 3 sizes away", placed(1.0, zero), |_, t, r| across(3.0, t, r), (0, 4e-6), 1e-14, "tori are double in every precision, on rays of f32"),
        torus("torus, 1e4 sizes away", placed(1.0, zero), |_, t, r| across(1e4, t, r), (0, 1e-6), 1e-14, FEW),
        torus("torus at 1e6", placed(1.0, at * 1e6), |_, t, r| across(3.0, t, r), (0, 4e-6), 1e-14, FEW),
        torus("torus, in its equator's plane", placed(1.0, zero), |_, _, r| {
            let a = r.angle();
            let from = DVec3::new(a.cos(), a.sin(), 0.0) * 3.0;
            let to = DVec3::new(r.unit() - 0.5, r.unit() - 0.5, 0.0) * 1.9;
            (from, unit(to - from))
        }, (0, 4e-6), 1e-14, "double roots lie together at the inner equator"),
        torus("torus, grazed by 1e-6", placed(1.0, zero), |s, t, r| graze(3.0, 1e-6, s, t, r), (0, 4e-4), 2e-12, "what is missed at the tangent may be met elsewhere"),
        torus("torus, grazed by 1e-9", placed(1.0, zero), |s, t, r| graze(3.0, 1e-9, s, t, r), (1700, 1e-2), 5e-11, "what is missed at the tangent may be met elsewhere"),
        torus("torus, along the circle it stands on, off by 1e-7", placed(1.0, zero), |_, _, r| {
            let a = r.angle();
            let from = DVec3::new(3.0 * a.cos(), 3.0 * a.sin(), 0.25 * (1.0 - 1e-7));
            let to = DVec3::new(0.7 * (r.unit() - 0.5), 0.7 * (r.unit() - 0.5), from.z);
            (from, unit(to - from))
        }, (0, 2e-5), 1e-12, "two pairs of nearly double roots at once"),
        quartic("torus as quartic, 3 sizes away", placed(1.0, zero), |_, t, r| across(3.0, t, r), (0, 4e-6), 1e-13, "polynomials are double in every precision, on rays of f32"),
        quartic("torus as quartic, 1e4 sizes away", placed(1.0, zero), |_, t, r| across(1e4, t, r), (0, 1e-6), 1e-13, FEW),
        quartic("torus as quartic, grazed by 1e-6", placed(1.0, zero), |s, t, r| graze(3.0, 1e-6, s, t, r), (0, 4e-4), 1e-12, "what is missed at the tangent may be met elsewhere"),
        sixth("ball as poly of order 6, 3 radii away", placed(1.0, zero), |_, t, r| across(3.0, t, r), (4, 4e-6), 1e-13, FEW),
        sixth("ball as poly of order 6, of radius 2^-20", placed(2f64.powi(-20), zero), |_, t, r| across(1e4, t, r), (8, 4e-6), 1e-13, FEW),
        sixth("ball as poly of order 6, grazed by 1e-6", placed(1.0, zero), |s, t, r| graze(3.0, 1e-6, s, t, r), (0, 2e-4), 1e-12, FEW),
        thin("torus of a tube 1e-3, 100 away", placed(1.0, zero), |_, t, r| {
            let a = r.angle();
            let target = t.point(DVec3::new(a.cos(), a.sin(), 0.0) * (1.0 - 1.0 / 1024.0) + r.cube() / 800.0);
            let from = r.direction() * 100.0;
            (from, unit(target - from))
        }, (12, 4e-6), 5e-14, FEW),
        thin("torus of a tube 1e-3, grazed by 1e-9", placed(1.0, zero), |s, t, r| graze(3.0, 1e-9, s, t, r), (2100, 1e-2), 2e-11, FEW),
    ]
}

/// A ray and what it meets first.
struct Known {
    origin: DVec3,
    dir: DVec3,
    own: OwnRay,
    first: Option<Dd>,
}

fn first(roots: &[Dd]) -> Option<Dd> {
    roots.iter().copied().find(|t| t.f64() > 0.0)
}

/// How a set of answers fares.
#[derive(Default)]
struct Tally {
    /// Lost or won.
    wrong: usize,
    /// Of those, meetings that are lost or won as well when the shape grows by the rounding of the ray.
    undecided: usize,
    /// The largest share of `t` that a meeting is off.
    error: f64,
}

impl Tally {
    fn said(&self) -> String {
        match (self.wrong, self.undecided) {
            (0, _) => format!("0, {:.0e}", self.error),
            (wrong, undecided) if undecided == wrong => format!("{wrong} on the outline, {:.0e}", self.error),
            (wrong, undecided) => format!("{wrong} ({undecided} on the outline), {:.0e}", self.error),
        }
    }
}

fn tally(case: &Case, rays: &[Known], found: &[Option<f64>], roundoff: f64) -> Tally {
    let m: DMat3 = case.place.inverse.matrix3;
    let mut tally = Tally::default();
    for (Known { origin: o, dir: d, own, first: expected }, found) in rays.iter().zip(found) {
        let expected = *expected;
        let far = expected.map_or(0.0, Dd::f64).max(o.length());
        let slack = ROUNDINGS
            * roundoff
            * (1.0 + reach(&m, o.abs() + case.place.forward.translation.abs()) + reach(&m, *d) * far);
        let near = |a: Dd, b: Dd| (a - b).f64().abs() <= 8.0 * slack.sqrt() / reach(&m, *d);
        let is_open = || {
            case.solid.hopeless(own, slack)
                || case.solid.neighbours(own, slack).iter().any(|roots| match (first(roots), expected) {
                    (Some(a), Some(b)) => !near(a, b),
                    (a, b) => a.is_some() != b.is_some(),
                })
        };
        match (expected, found) {
            (None, None) => {}
            // Another surface than the first: one was lost.
            (Some(right), Some(t)) if near(right, Dd::from(*t)) => {
                tally.error = tally.error.max((Dd::from(*t) - right).f64().abs() / right.f64());
            }
            _ => {
                tally.wrong += 1;
                tally.undecided += usize::from(is_open());
            }
        }
    }
    tally
}

/// Every case, along every way.
pub fn rows() -> Vec<Row> {
    let mut rows: Vec<Row> = cases().iter().map(row).collect();
    rows.push(leaks());
    rows
}

fn row(case: &Case) -> Row {
    let rng = &mut Rng(7);
    let rays: Vec<_> = (0..RAYS).map(|_| (case.lay)(&case.solid, &case.place, rng)).collect();
    let m = case.place.forward;
    let columns = [m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis, m.translation];
    let numbers: Vec<String> = columns.iter().flat_map(|c| c.to_array()).map(|x| format!("{x:e}")).collect();
    let (body, _) = case.object.rsplit_once('}').expect("an object ends in a brace");
    let object = format!("{body} matrix <{}> }}", numbers.join(", "));
    let scene = scene(&format!("#version 3.7; {object}"));
    let known = |&(origin, dir): &(DVec3, DVec3)| {
        let own = OwnRay::new(&case.place, origin, dir);
        Known { origin, dir, own, first: first(&case.solid.roots(&own)) }
    };
    let known: Vec<Known> = rays.iter().map(known).collect();
    let tallies =
        ways(&scene, &rays).map(|(way, roundoff, found)| (way, tally(case, &known, &found, roundoff)));
    let povray =
        povray::trace(&object, &rays).map(|found| tally(case, &known, &found, f64::EPSILON / 2.0).said());
    let figures = tallies.map(|(way, tally)| match way {
        "fast" => {
            let (most, error) = case.fast;
            let holds = tally.wrong <= most && tally.error <= error;
            Figure { way, said: tally.said(), bound: format!("{most}, {error:.0e}"), holds }
        }
        _ => {
            let holds = tally.wrong == tally.undecided && tally.error <= case.exact;
            Figure { way, said: tally.said(), bound: format!("0, {:.0e}", case.exact), holds }
        }
    });
    let expected = format!("{RAYS} rays");
    Row { case: case.name.into(), expected, figures, povray, reason: case.reason.into() }
}

/// First meetings in every way, with the way's rounding.
#[allow(clippy::type_complexity, reason = "a table")]
fn ways(scene: &octray::scene::Scene, rays: &[(DVec3, DVec3)]) -> [(&'static str, f64, Vec<Option<f64>>); 4] {
    let (single, double) = (f64::from(f32::EPSILON) / 2.0, f64::EPSILON / 2.0);
    let t = |found: Vec<Option<wave::FirstHit>>| found.into_iter().map(|hit| hit.map(|hit| hit.t)).collect();
    let oracle = reference::nearest_hits(scene, rays).into_iter().map(|hit| hit.map(|hit| hit.t)).collect();
    [
        ("fast", single, t(wave::nearest_hits(&Compiled::<f32, f32>::new(scene), rays))),
        ("exact", double, t(wave::nearest_hits(&Compiled::<f64, f32>::new(scene), rays))),
        ("strict", double, t(wave::nearest_hits(&Compiled::<f64, f64>::new(scene), rays))),
        ("oracle", double, oracle),
    ]
}

/// Rays from inside a closed mesh at its edges and corners: a million for packets.
const LEAK_RAYS: usize = 1_000_000;
/// The oracle asks every triangle for every ray, and POV-Ray reads every ray from a file.
const FEW_LEAK_RAYS: usize = 20_000;

fn leaks() -> Row {
    let (vertices, faces) = ball_of_triangles(2);
    let rng = &mut Rng(11);
    let rays: Vec<_> = (0..LEAK_RAYS)
        .map(|k| {
            let [a, b, _] = faces[(rng.unit() * faces.len() as f64) as usize].map(|i| vertices[i]);
            let target = if k % 4 == 0 { a } else { a + (b - a) * rng.unit() };
            let from = rng.cube() * 0.3;
            (from, unit(target - from))
        })
        .collect();
    let list = |points: &[DVec3]| {
        points.iter().map(|p| format!("<{:e},{:e},{:e}>", p.x, p.y, p.z)).collect::<Vec<_>>().join(",")
    };
    let indices: Vec<_> = faces.iter().map(|[a, b, c]| format!("<{a},{b},{c}>")).collect();
    let object = format!(
        "mesh2 {{ vertex_vectors {{ {}, {} }} face_indices {{ {}, {} }} }}",
        vertices.len(),
        list(&vertices),
        faces.len(),
        indices.join(",")
    );
    let scene = scene(&format!("#version 3.7; {object}"));
    let lost = |found: &[bool]| found.iter().filter(|hit| !**hit).count();
    let packets =
        |found: Vec<Option<wave::FirstHit>>| lost(&found.iter().map(Option::is_some).collect::<Vec<_>>());
    let few = &rays[..FEW_LEAK_RAYS];
    let oracle: Vec<bool> = reference::nearest_hits(&scene, few).iter().map(Option::is_some).collect();
    let counts = [
        ("fast", packets(wave::nearest_hits(&Compiled::<f32, f32>::new(&scene), &rays))),
        ("exact", packets(wave::nearest_hits(&Compiled::<f64, f32>::new(&scene), &rays))),
        ("strict", packets(wave::nearest_hits(&Compiled::<f64, f64>::new(&scene), &rays))),
        ("oracle", lost(&oracle)),
    ];
    let povray = povray::trace(&object, few)
        .map(|found| format!("{} of {FEW_LEAK_RAYS}", found.iter().filter(|t| t.is_none()).count()));
    Row {
        case: "closed mesh, from inside at edges and corners".into(),
        expected: format!("no leak in {LEAK_RAYS} rays"),
        figures: counts.map(|(way, lost)| Figure {
            way,
            said: lost.to_string(),
            bound: "0".into(),
            holds: lost == 0,
        }),
        povray,
        reason: format!(
            "the test of a triangle is watertight in any precision; the oracle is asked {FEW_LEAK_RAYS}"
        ),
    }
}

/// An octahedron whose faces are cut into four, `times` times, corners pushed out to the unit sphere.
fn ball_of_triangles(times: usize) -> (Vec<DVec3>, Vec<[usize; 3]>) {
    let mut vertices = vec![DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    let mut faces: Vec<[usize; 3]> = (0..8).map(|i| [i & 1, 2 + (i >> 1 & 1), 4 + (i >> 2 & 1)]).collect();
    for _ in 0..times {
        let mut middles = std::collections::HashMap::new();
        let mut cut = Vec::new();
        for [a, b, c] in faces {
            let mut middle = |a: usize, b: usize| {
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    vertices.push(vertices[a].midpoint(vertices[b]).normalize());
                    vertices.len() - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            cut.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        faces = cut;
    }
    (vertices, faces)
}
