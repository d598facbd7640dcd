//! Pictures whose every pixel has a value that can be written down.

use super::{WAYS, picture, scene};
use octray::render::Precision;

/// Every pixel must be `expected`; prints what each way of rendering makes of it. `fast` may be off by as much as is said,
/// where single precision cannot do better: these bounds may only shrink.
fn check(name: &str, text: &str, expected: [f64; 3], fast: Option<f64>) {
    let scene = scene(text);
    let mut wrong = Vec::new();
    for (way, engine, precision, bound) in WAYS {
        let bound = fast.filter(|_| precision == Precision::Fast).unwrap_or(bound);
        let film = picture(&scene, engine, precision, 1);
        let errors = film.pixels.iter().flat_map(|pixel| {
            pixel.rgb.iter().zip(expected).map(|(found, right)| (f64::from(*found) - right).abs())
        });
        // A NaN is the largest error.
        let worst = errors.fold(0.0, |worst: f64, e| if e.is_nan() { f64::INFINITY } else { worst.max(e) });
        println!("{name:24} {way:8} {worst:.1e} of {bound:.0e}");
        if worst > bound {
            wrong.push((way, worst));
        }
    }
    assert!(wrong.is_empty(), "{name}: {wrong:?}, right is {expected:?}");
}

/// Light `e` and mirrors of strength `r`, seen through `n` bounces: a geometric series.
fn series(e: f64, r: f64, n: i32) -> f64 {
    e * (1.0 - r.powi(n)) / (1.0 - r)
}

/// POV-Ray agrees within the steps of its file.
#[test]
fn two_hundred_bounces_between_mirrors_keep_their_energy() {
    let (e, r) = (0.004, 0.99);
    check(
        "200 mirrors",
        "#version 3.7; global_settings { assumed_gamma 1 max_trace_level 200 adc_bailout 0 }
         camera { orthographic location 0 direction z right 0.4*x up 0.3*y }
         #default { pigment { rgb 1 } finish { ambient 0 diffuse 0 emission 0.004 reflection 0.99 } }
         plane { z, 1 } plane { z, -1 inverse }",
        [series(e, r, 200); 3],
        None,
    );
}

/// Whatever stands in it and wherever rays go: all surfaces glow and mirror alike.
#[test]
fn a_furnace_is_everywhere_as_bright() {
    let rgb = [0.5, 0.7, 0.9].map(|r| series(0.05, r, 20));
    check(
        "furnace",
        "#version 3.7; global_settings { assumed_gamma 1 max_trace_level 20 adc_bailout 0 }
         camera { location <0.3, 0.2, -4> look_at 0 right x*4/3 }
         #default { pigment { rgb 1 } finish { ambient 0 diffuse 0 emission 0.05 reflection rgb <0.5, 0.7, 0.9> } }
         sphere { 0, 9 } torus { 1.2, 0.3 rotate <50, 20, 0> } box { <-2, -2, 1>, <-1, -1, 2> rotate 30*y }
         cone { <1, -1, 0>, 0.6, <1.5, 1, 0.5>, 0 } cylinder { <-1.5, 1, 0>, <-0.5, 1.6, 0.4>, 0.3 }
         difference { sphere { <0, 0, 2>, 1 } sphere { <0, 0.3, 1.2>, 0.8 } }",
        rgb,
        None,
    );
}

/// A parallel window shifts rays by a share of its thickness and turns none.
#[test]
fn light_through_a_window_a_millionth_thick_keeps_its_direction() {
    // A ramp of brightness along x, 1 a unit: a turn of the ray by 1e-6 would show.
    check(
        "thin window",
        "#version 3.7; global_settings { assumed_gamma 1 }
         camera { orthographic location <0.25, 0, -3> direction <0.6, 0, 0.8> right 1e-7*x up 1e-7*y }
         box { <-20, -20, 0>, <20, 20, 1e-6> pigment { rgbt 1 } finish { ambient 0 diffuse 0 } interior { ior 1.5 } }
         plane { -z, -1
           pigment { gradient x color_map { [0 rgb 0] [1 rgb 1] } scale 8 }
           finish { ambient 1 diffuse 0 } }",
        // From x = 0.25, 4 units of z at a slope of 3/4.
        [3.25 / 8.0; 3],
        // The start of the bent ray is moved off the surface by more than the window is thick: it never leaves the glass.
        Some(0.04),
    );
}

/// The slab's gap and thickness are under POV-Ray's tolerances: it lets the light through.
#[test]
fn the_thinnest_slab_throws_a_shadow() {
    // In single precision, 1 from the origin, slabs nearer or thinner than some 1e-6 are one with the floor.
    let lost = Some(1.0);
    for (gap, thick, fast) in
        [(0.0, 1e-6, lost), (1e-12, 1e-9, lost), (1e-9, 1e-12, lost), (1e-6, 1e-3, None), (1e-3, 1e-6, None)]
    {
        let text = format!(
            "#version 3.7; global_settings {{ assumed_gamma 1 }}
             camera {{ orthographic location <0, -0.5, 0> direction -y right 0.1*x up 0.1*z }}
             light_source {{ <0, 50, 0>, rgb 1 }}
             plane {{ y, -1 pigment {{ rgb 1 }} finish {{ ambient 0 diffuse 1 }} }}
             box {{ <-5, {gap:e} - 1, -5>, <5, {gap:e} + {thick:e} - 1, 5> pigment {{ rgb 1 }} no_image }}"
        );
        check(&format!("slab {gap:.0e} {thick:.0e}"), &text, [0.0; 3], fast);
    }
}

/// The foot is 1.7 under the eye, 6.4e6 from the centre.
#[test]
fn a_planet_under_the_feet_is_a_floor() {
    check(
        "planet",
        "#version 3.7; global_settings { assumed_gamma 1 }
         camera { orthographic location <0, 1.7, 0> direction -y right 0.1*x up 0.1*z }
         light_source { <0, 1e9, 0>, rgb 1 }
         sphere { <0, -6.4e6, 0>, 6.4e6 pigment { rgb 1 } finish { ambient 0 diffuse 0.75 } }",
        [0.75; 3],
        None,
    );
}
