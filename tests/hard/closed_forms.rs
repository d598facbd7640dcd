//! Pictures whose every pixel has a value that can be written down.

use super::table::{Figure, Row};
use super::{WAYS, picture, povray, scene};
use octray::film::Film;
use octray::render::Precision;

/// A scene of one colour.
struct Picture {
    name: String,
    text: String,
    expected: [f64; 3],
    /// What `fast` may be off by instead, and why: these bounds may only shrink.
    fast: Option<(f64, &'static str)>,
}

/// Errors over this share of light are two different surfaces: another pixel altogether.
const ANOTHER: f64 = 1.0;

fn case(name: &str, text: &str, expected: [f64; 3], fast: Option<(f64, &'static str)>) -> Picture {
    Picture { name: name.into(), text: format!("#version 3.7;\n{text}"), expected, fast }
}

/// The largest error of any pixel; a NaN is the largest of all.
fn worst(film: &Film, expected: [f64; 3]) -> f64 {
    let errors = film.pixels.iter().flat_map(|pixel| {
        pixel.rgb.iter().zip(expected).map(|(found, right)| (f64::from(*found) - right).abs())
    });
    errors.fold(0.0, |worst: f64, e| if e.is_nan() { f64::INFINITY } else { worst.max(e) })
}

/// Every case, rendered in every way.
pub fn rows() -> Vec<Row> {
    cases().iter().map(row).collect()
}

fn row(case: &Picture) -> Row {
    let scene = scene(&case.text);
    let figures = WAYS.map(|(way, engine, precision, bound)| {
        let bound = match case.fast {
            Some((fast, _)) if precision == Precision::Fast => fast,
            _ => bound,
        };
        let error = worst(&picture(&scene, engine, precision, 1), case.expected);
        Figure { way, said: format!("{error:.0e}"), bound: format!("{bound:.0e}"), holds: error <= bound }
    });
    let povray = povray::picture(&case.text).map(|film| match worst(&film, case.expected) {
        // Steps of the 16-bit file.
        small if small < 2e-5 => "< 2e-5".into(),
        error => format!("{error:.0e}"),
    });
    let reason =
        case.fast.map_or("roundings of f32 and f64, kept in f32 pixels, over tens of operations", |f| f.1);
    let [r, g, b] = case.expected;
    let expected = if r == g && g == b { format!("{r:.4}") } else { format!("{r:.4} {g:.4} {b:.4}") };
    Row { case: case.name.clone(), expected, figures, povray, reason: reason.into() }
}

/// Light `e` and mirrors of strength `r`, seen through `n` bounces: a geometric series.
fn series(e: f64, r: f64, n: i32) -> f64 {
    e * (1.0 - r.powi(n)) / (1.0 - r)
}

const LINEAR: &str = "global_settings { assumed_gamma 1 }\n";

fn cases() -> Vec<Picture> {
    let mut all = vec![
        case(
            "200 bounces between mirrors",
            "global_settings { assumed_gamma 1 max_trace_level 200 adc_bailout 0 }
             camera { orthographic location 0 direction z right 0.4*x up 0.3*y }
             #default { pigment { rgb 1 } finish { ambient 0 diffuse 0 emission 0.004 reflection 0.99 } }
             plane { z, 1 } plane { z, -1 inverse }",
            [series(0.004, 0.99, 200); 3],
            None,
        ),
        case(
            "furnace: all surfaces glow and mirror alike",
            "global_settings { assumed_gamma 1 max_trace_level 20 adc_bailout 0 }
             camera { location <0.3, 0.2, -4> look_at 0 right x*4/3 }
             #default { pigment { rgb 1 } finish { ambient 0 diffuse 0 emission 0.05 reflection rgb <0.5, 0.7, 0.9> } }
             sphere { 0, 9 } torus { 1.2, 0.3 rotate <50, 20, 0> } box { <-2, -2, 1>, <-1, -1, 2> rotate 30*y }
             cone { <1, -1, 0>, 0.6, <1.5, 1, 0.5>, 0 } cylinder { <-1.5, 1, 0>, <-0.5, 1.6, 0.4>, 0.3 }
             difference { sphere { <0, 0, 2>, 1 } sphere { <0, 0.3, 1.2>, 0.8 } }",
            [0.5, 0.7, 0.9].map(|r| series(0.05, r, 20)),
            None,
        ),
        case(
            // A ramp of brightness along x, 1 a unit, from x = 0.25, 4 units of z at a slope of 3/4: a turn of the ray by
            // 1e-6 would show.
            "window 1e-6 thick turns no ray",
            "global_settings { assumed_gamma 1 }
             camera { orthographic location <0.25, 0, -3> direction <0.6, 0, 0.8> right 1e-7*x up 1e-7*y }
             box { <-20, -20, 0>, <20, 20, 1e-6> pigment { rgbt 1 } finish { ambient 0 diffuse 0 } interior { ior 1.5 } }
             plane { -z, -1
               pigment { gradient x color_map { [0 rgb 0] [1 rgb 1] } scale 8 }
               finish { ambient 1 diffuse 0 } }",
            [3.25 / 8.0; 3],
            Some((0.04, "f32 moves the bent ray off the face by more than the window is thick: it stays in the glass")),
        ),
        case(
            "planet: eye 1.7 above radius 6.4e6",
            "global_settings { assumed_gamma 1 }
             camera { orthographic location <0, 1.7, 0> direction -y right 0.1*x up 0.1*z }
             light_source { <0, 1e9, 0>, rgb 1 }
             sphere { <0, -6.4e6, 0>, 6.4e6 pigment { rgb 1 } finish { ambient 0 diffuse 0.75 } }",
            [0.75; 3],
            None,
        ),
    ];
    slabs(&mut all);
    refraction(&mut all);
    lights(&mut all);
    composites(&mut all);
    own_surface(&mut all);
    slivers(&mut all);
    all
}

/// A slab over a floor, whose gap and thickness are under POV-Ray's tolerances.
fn slabs(all: &mut Vec<Picture>) {
    let lost = Some((
        ANOTHER,
        "f32, 1 from the origin: slabs nearer or thinner than some 1e-6 are one with the floor",
    ));
    for (gap, thick, fast) in [
        (0.0, 1e-6, lost),
        (1e-12, 1e-9, lost),
        (1e-9, 1e-12, lost),
        (1e-6, 1e-3, None),
        (1e-3, 1e-6, None),
        (0.0, 5e-4, None),
    ] {
        let text = format!(
            "{LINEAR} camera {{ orthographic location <0, -0.5, 0> direction -y right 0.1*x up 0.1*z }}
             light_source {{ <0, 50, 0>, rgb 1 }}
             plane {{ y, -1 pigment {{ rgb 1 }} finish {{ ambient 0 diffuse 1 }} }}
             box {{ <-5, {gap:e} - 1, -5>, <5, {gap:e} + {thick:e} - 1, 5> pigment {{ rgb 1 }} no_image }}"
        );
        all.push(case(
            &format!("shadow of a slab {thick:.0e} thick, {gap:.0e} above"),
            &text,
            [0.0; 3],
            fast,
        ));
    }
}

/// Rays in glass around the critical angle: what leaves sees the sky, what is thrown back the wall.
fn refraction(all: &mut Vec<Picture>) {
    let (sky, wall) = ([0.25, 0.5, 0.75], [1.0, 0.5, 0.25]);
    let undecided = Some((
        ANOTHER,
        "1 - sin² of the angle is rounded to 6e-8 in f32: within 4e-4 of the angle either may come out",
    ));
    let start = |angle: &str| {
        format!(
            "{LINEAR} #declare A = {angle};
             camera {{ orthographic location 0 direction <cos(A), 0, sin(A)> right 1e-9*x up 1e-9*y }}
             background {{ rgb <0.25, 0.5, 0.75> }}
             #default {{ pigment {{ rgbt 1 }} finish {{ ambient 0 diffuse 0 }} }}
             plane {{ x, -5 pigment {{ rgb <1, 0.5, 0.25> }} finish {{ emission 1 }} }}\n"
        )
    };
    let glass = "box { <-60, -50, -50>, <1, 50, 60> interior { ior 1.5 } }";
    for (side, seen) in [("-", sky), ("+", wall)] {
        let text = start(&format!("asin(1/1.5)*(1 {side} 1e-9)")) + glass;
        all.push(case(&format!("critical angle times 1 {side} 1e-9"), &text, seen, undecided));
        let text = start(&format!("asin(1.33/1.5)*(1 {side} 1e-9)"))
            + "box { <-70, -60, -60>, <3, 60, 70> interior { ior 1.33 } }"
            + glass;
        all.push(case(&format!("the same of glass in water, 1 {side} 1e-9"), &text, seen, undecided));
    }
    for (x, seen, what) in
        [(30, sky, "leaves the second by its end"), (3, wall, "is thrown back in the second")]
    {
        // The first is left while in the second, entered later: that bends nothing, at whatever angle.
        let text = start("radians(80)")
            + glass
            + &format!("box {{ <-70, -60, -60>, <{x}, 60, 70> interior {{ ior 1.33 }} }}");
        all.push(case(&format!("overlapping glasses: leaves the first at 80°, {what}"), &text, seen, None));
    }
}

/// Lights on and in surfaces, and shading normals that disagree with the surface.
fn lights(all: &mut Vec<Picture>) {
    let floor = "plane { y, -2 pigment { rgb 1 } finish { ambient 0 diffuse 0.8 } }";
    let down = |x: f64| {
        format!(
            "{LINEAR} #default {{ finish {{ ambient 0 }} }}
             camera {{ orthographic location <{x}, -1.5, 0> direction -y right 1e-4*x up 1e-4*z }}\n"
        )
    };
    for (name, x, light, rest, expected) in [
        ("light in an opaque ball", 3.0, "<0, 0, 0>", "sphere { 0, 1 pigment { rgb 1 } }", 0.0),
        (
            "light on a ball's surface, ball behind it",
            0.0,
            "<0, -1, 0>",
            "sphere { 0, 1 pigment { rgb 1 } }",
            0.8,
        ),
        ("light on a box's face, box behind it", 0.0, "<0, -1, 0>", "box { -1, 1 pigment { rgb 1 } }", 0.8),
        ("light on the floor itself", 1.0, "<0, -2, 0>", "", 0.0),
        ("light in the plane of a disc", 0.0, "<0, -1, 0>", "disc { -y, y, 1 pigment { rgb 1 } }", 0.8),
    ] {
        let text = down(x) + &format!("light_source {{ {light}, rgb 1 }} {floor} {rest}");
        all.push(case(name, &text, [expected; 3], None));
    }
    // 10 degrees under the face, 50 from the normal it is shaded by.
    all.push(case(
        "light under a face, before its shading normal",
        &format!(
            "{LINEAR} camera {{ orthographic location <0, 1, 0> direction -y right 1e-3*x up 1e-3*z }}
             #declare A = radians(-10);
             light_source {{ 100*<cos(A), sin(A), 0>, rgb 1 parallel point_at 0 }}
             #declare N = <cos(radians(40)), sin(radians(40)), 0>;
             smooth_triangle {{ <-1, 0, -1>, N, <1, 0, -1>, N, <0, 0, 2>, N
               pigment {{ rgb 1 }} finish {{ ambient 0 diffuse 0.5 }} }}"
        ),
        [0.5 * 50f64.to_radians().cos(); 3],
        None,
    ));
    // The other faces are in the light's way: the terminator follows the faces, not the normals.
    all.push(case(
        "terminator of a coarse smooth mesh",
        &format!(
            "{LINEAR} light_source {{ 100*<0.9, 0.3, 0.3>, rgb 1 parallel point_at 0 }}
             camera {{ orthographic location <-1.1, 1.8, 1.1> direction <1, -1, -1> right 1e-3*x up 1e-3*z }}
             mesh {{
               #for (I, -1, 1, 2) #for (J, -1, 1, 2) #for (K, -1, 1, 2)
                 smooth_triangle {{ I*x, I*x, J*y, J*y, K*z, K*z }}
               #end #end #end
               pigment {{ rgb 1 }} finish {{ ambient 0 diffuse 1 }} }}"
        ),
        [0.0; 3],
        None,
    ));
}

/// Faces that coincide.
fn composites(all: &mut Vec<Picture>) {
    let window = format!(
        "{LINEAR} camera {{ orthographic location -3*z direction z right 0.4*x up 0.3*y }}
         background {{ rgb 0.25 }} #default {{ pigment {{ rgb 1 }} finish {{ ambient 0 diffuse 0 emission 0.5 }} }}\n"
    );
    for (name, body, expected) in [
        ("intersection of a ball with itself", "intersection { sphere { 0, 1 } sphere { 0, 1 } }", 0.5),
        ("difference of a ball and itself", "difference { sphere { 0, 1 } sphere { 0, 1 } }", 0.25),
        (
            "difference of a box and one flush with it",
            "difference { box { -1, 1 } box { <-1, -1, -1>, <1, 1, 1> } }",
            0.25,
        ),
        (
            "intersection of a ball and its inverse",
            "intersection { sphere { 0, 1 } sphere { 0, 1 inverse } }",
            0.25,
        ),
        (
            "lens 1e-7 thick",
            "intersection { sphere { <0, 0, 1 - 0.5e-7>, 1 } sphere { <0, 0, -1 + 0.5e-7>, 1 } scale <1e4, 1e4, 1> }",
            0.5,
        ),
    ] {
        let text = window.clone() + body;
        all.push(case(name, &text, [expected; 3], None));
    }
    // A column of pixels whose light comes along the shared face, exactly.
    for (name, boxes) in [
        (
            "shadow under a face that two boxes share",
            "box { <-2, 0, -2>, <0, 1, 2> } box { <0, 0, -2>, <2, 1, 2> }",
        ),
        (
            "shadow under an edge that two boxes share",
            "box { <-2, 0, -2>, <0, 1, 2> } box { <0, 1, -2>, <2, 2, 2> }",
        ),
    ] {
        let text = format!(
            "{LINEAR} camera {{ orthographic location <-0.0015625, -0.25, 0> direction -y right 0.1*x up 0.1*z }}
             light_source {{ <0, 10, 0>, rgb 1 }} #default {{ pigment {{ rgb 1 }} finish {{ ambient 0 diffuse 1 }} }}
             plane {{ y, -0.5 }} {boxes}"
        );
        all.push(case(name, &text, [0.0; 3], None));
    }
}

/// A ball of radius 1 as `poly` of order 6: `(x^2 + y^2 + z^2)^3 - 1`.
pub fn ball_of_order_6() -> String {
    let mut terms = Vec::new();
    for i in (0..=6).rev() {
        for j in (0..=6 - i).rev() {
            for k in (0..=6 - i - j).rev() {
                let even = i % 2 == 0 && j % 2 == 0 && k % 2 == 0 && i + j + k == 6;
                // 3! over the factorials of the halves: 1, 3 or 6.
                let ways = [1, 1, 2, 6];
                let c = if even { 6 / (ways[i / 2] * ways[j / 2] * ways[k / 2]) } else { 0 };
                terms.push(if i + j + k == 0 { "-1".into() } else { c.to_string() });
            }
        }
    }
    format!("poly {{ 6, <{}> }}", terms.join(","))
}

/// Rays to the light that start on the surface they light: outward none may meet it again, inward all must.
fn own_surface(all: &mut Vec<Picture>) {
    let ball = ball_of_order_6();
    // Seen within the outline by 0.4 of a unit either way; their light falls flat on the axis z.
    for (name, object) in [
        ("ball", "sphere { 0, 1 }"),
        ("ball 1e-3 wide, 10 away", "sphere { 0, 1 scale 5e-4 translate <6, 8, 0> }"),
        ("ball at 1e6", "sphere { 0, 1 translate <1e6, 2e6, 0> }"),
        ("ellipsoid", "sphere { 0, 1 scale <2, 1, 1e-3> }"),
        ("box", "box { -1, 1 rotate 20*x rotate 30*y }"),
        ("cone", "cone { 2*y, 0, -2*y, 2 }"),
        ("torus", "torus { 3, 1 translate 3*x }"),
        ("quadric", "quadric { <1, 1, 1>, 0, 0, -1 }"),
        ("poly of order 6", &ball),
        (
            "mesh",
            "mesh { triangle { -9*x - 9*y, 9*x - 9*y, 9*y } triangle { -9*x - 9*y + z, 9*x - 9*y + z, 9*y + z } }",
        ),
    ] {
        let (at, size) = match name {
            "ball 1e-3 wide, 10 away" => ("<6, 8, 0>", 5e-4),
            "ball at 1e6" => ("<1e6, 2e6, 0>", 1.0),
            _ => ("<0, 0, 0>", 1.0),
        };
        let view = |light: &str, finish: &str| {
            format!(
                "{LINEAR} camera {{ orthographic location {at} - 5*z direction z right {size:e}*0.8*x up {size:e}*0.6*y }}
                 light_source {{ {at} + {light}, rgb 1 parallel point_at {at} }}
                 #default {{ pigment {{ rgb 1 }} finish {{ ambient 0 {finish} brilliance 0 }} }}
                 {object}"
            )
        };
        all.push(case(
            &format!("{name}, lit from before: no shadow on itself"),
            &view("<1, 2, -100>", "diffuse 0.75"),
            [0.75; 3],
            None,
        ));
        all.push(case(
            &format!("{name}, lit from behind: all in its own shadow"),
            &view("<1, 2, 100>", "diffuse 0, 0.75"),
            [0.0; 3],
            None,
        ));
    }
}

/// Triangles and boxes of nearly no or of no width.
fn slivers(all: &mut Vec<Picture>) {
    for width in [1e-4, 1e-7] {
        let text = format!(
            "{LINEAR} #declare W = {width:e};
             camera {{ orthographic location <0.013, 0.017, -3> direction z right 800*W*x up 1.5*y }}
             background {{ rgb 0.25 }}
             mesh {{
               #for (I, -500, 500)
                 triangle {{ <I*W, -1, 0>, <(I + 1)*W, -1, 0>, <I*W, 1, 0> }}
                 triangle {{ <(I + 1)*W, -1, 0>, <I*W, 1, 0>, <(I + 1)*W, 1, 0> }}
               #end
               translate 0.013*x
               pigment {{ rgb 1 }} finish {{ ambient 0 diffuse 0 emission 0.5 }} }}"
        );
        all.push(case(&format!("wall of needles 2 long and {width:.0e} wide"), &text, [0.5; 3], None));
    }
    let text = format!(
        "{LINEAR} camera {{ orthographic location -3*z direction z right 0.4*x up 0.3*y }} background {{ rgb 0.25 }}
         box {{ <-1, -1, 0>, <1, 1, 0> pigment {{ rgb 1 }} finish {{ ambient 0 diffuse 0 emission 0.5 }} }}"
    );
    all.push(case("box without depth", &text, [0.5; 3], None));
}
