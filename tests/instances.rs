//! Meshes and composites that stand in several places and are kept once: pictures of them against those of the oracle, which knows no
//! tree.

use octray::compile::{Compiled, Instancing, Primitives, kept_shapes};
use octray::film::Film;
use octray::render::{Engine, Precision, RenderOptions, render};
use octray::scene::Scene;
use octray::{eval, wave};

const WIDTH: usize = 64;
const HEIGHT: usize = 48;

/// An eye before a floor and a light, a mesh of 24 triangles, half of them smooth, one that has textures of its own, one that is a
/// solid, and panes, half of which are glass of their own.
const BEGIN: &str = "#version 3.7;
    global_settings { assumed_gamma 1 max_trace_level 4 }
    background { color rgb <0.2, 0.3, 0.5> }
    camera { location <0, 3, -9> look_at <0, 0.6, 0> angle 40 right 4/3*x }
    light_source { <-5, 8, -7> color rgb 0.9 }
    light_source { <6, 5, -2> color rgb <0.4, 0.3, 0.2> }
    plane { y, -0.3 pigment { checker color rgb 0.9 color rgb 0.4 } finish { reflection 0.2 } }
    #declare Cap = mesh {
        #declare I = 0;
        #while (I < 12)
            #declare A = pi*I/6; #declare B = pi*(I + 1)/6;
            smooth_triangle { <0, 1.2, 0>, y, <cos(A), 0.5, sin(A)>, <cos(A), 1, sin(A)>, <cos(B), 0.5, sin(B)>, <cos(B), 1, sin(B)> }
            triangle { <0.3, 0, 0>, <cos(A), 0.5, sin(A)>, <cos(B), 0.5, sin(B)> }
            #declare I = I + 1;
        #end
    }
    #declare Hat = mesh {
        #declare I = 0;
        #while (I < 12)
            #declare A = pi*I/6; #declare B = pi*(I + 1)/6;
            triangle { <0, 1.6, 0>, <cos(A), 0, sin(A)>, <cos(B), 0, sin(B)>
                texture { pigment { color rgb <mod(I, 3)/2, 0.5, mod(I, 2)> } } }
            triangle { <cos(A), 0, sin(A)>, <1.4*cos(B), 0, 1.4*sin(B)>, <cos(B), 0, sin(B)> }
            #declare I = I + 1;
        #end
    }
    #declare Solid = mesh {
        triangle { <-1, 0, -1>, <1, 0, -1>, <0, 0, 1> } triangle { <-1, 0, -1>, <1, 0, -1>, <0, 1.4, 0> }
        triangle { <1, 0, -1>, <0, 0, 1>, <0, 1.4, 0> } triangle { <0, 0, 1>, <-1, 0, -1>, <0, 1.4, 0> }
        inside_vector <0.1, 1, 0.2>
    }
    #declare Amber = texture { pigment { color rgbf <1, 0.7, 0.2, 0.7> } };
    #declare Clear = texture { pigment { color rgbft <0.3, 0.6, 1, 0.4, 0.3> } finish { reflection 0.1 } };
    #declare Pane = mesh {
        #declare I = 0;
        #while (I < 6)
            triangle { <I/4 - 0.8, 0, 0>, <I/4 - 0.6, 0, 0>, <I/4 - 0.7, 1.2, 0.1> texture { #if (mod(I, 2)) Amber #else Clear #end } }
            triangle { <I/4 - 0.8, 0.2, 0.3>, <I/4 - 0.6, 0, 0.3>, <I/4 - 0.8, 1.2, 0.5> }
            #declare I = I + 1;
        #end
    }
    #declare Cut = difference {
        object { Solid pigment { color rgb <0.9, 0.7, 0.2> } }
        sphere { <0, 0.3, -0.6>, 0.4 pigment { color rgb <0.2, 0.8, 0.4> } }
        box { -1, 0.2 clipped_by { plane { z, 0.1 } } rotate 30*y translate <0.4, 0.8, 0> }
    }
    #declare Bowl = intersection {
        merge { sphere { 0, 0.8 } object { Solid scale 0.9 translate -0.3*y } torus { 0.8, 0.2 } inverse inverse }
        plane { y, 0.3 pigment { color rgb 0.8 } }
        union { box { -2, <2, 2, 0.5> } cylinder { -2*y, 2*y, 0.6 } }
    }
    #declare Late = intersection {
        sphere { 0, 1 clipped_by { plane { y, 0.4 clipped_by { box { -2, 2 } } } } pigment { color rgb <0.3, 0.7, 0.3> } }
        object { Hat translate -0.4*y } plane { -y, 0.9 pigment { color rgb <0.6, 0.3, 0.7> } }
    }
    #declare Red = pigment { color rgb <0.9, 0.2, 0.1> };
    #declare Blue = pigment { color rgb <0.1, 0.3, 0.9> };
    #declare Chess = pigment { checker color rgb <0.9, 0.9, 0.7> color rgb <0.2, 0.3, 0.6> scale 0.3 };
    #declare Glass = texture { pigment { color rgbf <0.9, 1, 0.9, 0.8> } finish { reflection 0.1 } };
    ";

/// Scenes, and how many places of meshes and composites are kept as such.
const SCENES: &[(usize, &str)] = &[
    // Moved, turned, stretched, mirrored and sheared.
    (
        6,
        "object { Cap pigment { Red } translate <-2, 0, 1> } object { Cap pigment { Blue } rotate <30, 70, 10> }
        object { Cap pigment { Red } scale <0.5, 2, 1> translate <2, 0, 0> } object { Hat scale <-1, 1, 1> translate <-1, 0, -2> }
        object { Hat pigment { Blue } matrix <1, 0.3, 0, 0, 1, 0.4, 0.2, 0, 1, 1.5, 0, -2> }
        object { Cap pigment { Red } scale 1e-3 scale 800 translate <0, 1.5, 0> }",
    ),
    // At one place: of objects the first is seen, of a union that is one object the last.
    (
        6,
        "object { Cap pigment { Red } translate -2*x } object { Cap pigment { Blue } translate -2*x }
        union { object { Cap pigment { Red } } object { Cap pigment { Blue } } }
        union { object { Cap pigment { Red } } object { Cap pigment { Blue } } bounded_by { sphere { 0, 3 } } translate 2*x }",
    ),
    // Beside what lies in the same plane, and with what hides it from some rays.
    (
        5,
        "object { Hat translate -0.3*y } disc { <0, -0.3, 0>, y, 0.5 pigment { Red } }
        object { Hat no_shadow pigment { Red } translate <-2.2, 0, 0> } object { Hat no_image translate <2.2, 0, 0> }
        object { Hat no_reflection pigment { Blue } translate <2, 0, -2> }
        object { Hat no_reflection no_shadow inverse pigment { Blue } translate <-2, 0, -2> }",
    ),
    // Seen from inside, lit from both sides, mirrors.
    (
        4,
        "object { Cap texture { pigment { Red } } interior_texture { pigment { Blue } } rotate 150*x translate <-1.6, 1, 0> }
        object { Hat texture { pigment { Blue } } interior_texture { pigment { Red } } rotate -120*x translate <1, 0.6, 1> }
        object { Cap pigment { Blue } double_illuminate translate <1.8, 0.3, -1> }
        object { Hat finish { reflection 0.7 ambient 0 } scale 1.3 translate <-0.6, 0, -1> }",
    ),
    // Not kept: what is cut. The same meshes elsewhere are.
    (
        5,
        "object { Cap texture { Glass } translate <-2, 0, -1> } object { Cap pigment { Red } }
        object { Cap pigment { Blue } clipped_by { plane { x, 0.4 } } translate <2, 0, -1> }
        object { Solid pigment { Blue } translate <1, 0, 1.5> } object { Solid pigment { Red } translate <-1, 0, 1.5> }
        difference { box { <2, 0, 0>, <3, 1, 1> } object { Solid translate <2.5, 0.2, 0> } pigment { Red } }
        object { Cap pigment { Red } rotate 180*z translate <0, 2.2, 0> } object { Hat translate <0, 0, 3> }",
    ),
    // What lets light through: rays go from surface to surface of one place and of several, where these are moved, turned, stretched,
    // mirrored and sheared, and shadows are tinted; some triangles stop all light.
    (
        7,
        "object { Cap texture { Glass } translate <-2, 0, -1> } object { Cap pigment { Red } translate <-2, 1, -1.2> }
        object { Cap texture { Glass } interior { ior 1.3 fade_distance 0.5 fade_power 2 } scale <-1, 1.4, 1> translate <0, 0.4, 0> }
        object { Hat texture { Glass } matrix <1, 0.3, 0, 0, 1, 0.4, 0.2, 0, 1, 1.8, 0, -1> }
        object { Pane scale <1, 2, 1> translate <0.4, 0, -2> } object { Pane pigment { Blue } rotate 60*y translate <-1, 0.4, 1.5> }
        object { Hat texture { Glass } scale 0.5 translate <0.6, 0.2, -1> }",
    ),
    // The same at one place (without mirrors: what grazes one of two such surfaces meets the other, or not, by a rounding), in unions,
    // with what hides it from some rays, around a light, and seen from inside.
    (
        9,
        "object { Cap texture { Amber } translate -2*x } object { Cap texture { Amber } translate -2*x }
        union { object { Pane pigment { Red } } object { Pane pigment { Blue } translate 0.2*z } rotate 20*y translate <0, 0, -2> }
        object { Cap texture { Glass } no_shadow translate <2, 0, -2> } object { Pane no_image translate <1.6, 0, 0> }
        object { Pane no_reflection scale 1.5 translate <-1, 0.4, 2> } object { Cap texture { Glass } scale 2 translate <-5, 7, -7> }
        object { Cap texture { Glass } interior_texture { pigment { Red } } rotate 160*x translate <0.6, 1.4, 0> }",
    ),
    // Glass that is solid: around the eye, beside it, and turned inside out.
    (
        3,
        "object { Solid texture { Glass } interior { ior 1.2 } scale 3 translate <0, 2, -9> }
        object { Solid texture { Glass } interior { ior 1.5 } translate <-1.2, 0, 0> }
        object { Solid texture { Glass } interior { ior 1.5 caustics 0.6 } rotate 100*y translate <1.2, 0.2, 0> }
        object { Solid inverse texture { Glass } translate <0, 0.2, 2> }",
    ),
    // Composites moved, turned, stretched, mirrored and sheared.
    (
        7,
        "object { Cut translate <-2, 0, 1> } object { Cut rotate <10, 70, 20> } object { Cut scale <-1, 1.5, 1> translate <2, 0, 1> }
        object { Bowl pigment { Red } translate <-2, 0.6, -2> } object { Bowl pigment { Blue } rotate <-40, 60, 0> translate <0, 0.7, -2> }
        object { Bowl pigment { Red } matrix <1, 0.3, 0, 0, 1, 0.4, 0.2, 0, 1, 2, 0.6, -2> }
        object { Bowl pigment { Blue } scale <0.5, 0.5, -0.5> translate <0, 2.4, 0> }",
    ),
    // At one place, alone and in unions, and with what hides it from some rays.
    (
        9,
        "object { Cut translate -2*x } object { Cut pigment { Blue } translate -2*x }
        union { object { Bowl pigment { Red } } object { Bowl pigment { Blue } } translate 0.6*y }
        union { object { Bowl pigment { Red } } object { Bowl pigment { Blue } } bounded_by { sphere { 0, 3 } } translate <2, 0.6, 0> }
        object { Cut no_shadow translate <-1.6, 0, -2> } object { Cut no_image translate <0, 0, -2> }
        object { Cut no_reflection translate <1.6, 0, -2> }",
    ),
    // Parts that are clipped, before a mesh with textures of its own.
    (2, "object { Late pigment { Red } translate <-1.2, 0.8, 0> } object { Late pigment { Blue } rotate 40*x translate <1.2, 0.8, 0> }"),
    // Seen from inside, lit from both sides, mirrors; rays that leave them and meet them again.
    (
        4,
        "object { Bowl texture { pigment { Blue } } interior_texture { pigment { Red } } rotate -110*x translate <-1.4, 0.8, 0> }
        object { Bowl texture { pigment { Red } } interior_texture { pigment { Blue } } rotate 20*x translate <1.4, 0.8, 0> }
        object { Bowl pigment { Red } double_illuminate scale 0.7 translate <0, 0.4, -2> }
        object { Bowl pigment { Red } finish { reflection 0.8 ambient 0 } scale 1.2 translate <0, 0.8, 2> }",
    ),
    // Not kept: what is nowhere, what lets light through, what has no look where it is cut, what is clipped, turned, without end, or hidden in part.
    (
        2,
        "object { Bowl texture { Glass } translate <-2, 0.6, -1> } object { Bowl pigment { Red } translate <-2, 0.6, 1> }
        object { Bowl pigment { Blue } clipped_by { plane { x, 0.4 } } translate <0, 0.6, -1> }
        object { Bowl inverse pigment { Blue } clipped_by { box { -1, 1 } } translate <0, 0.6, 1> }
        object { Bowl pigment { Blue } translate <2, 0.6, 1> }
        #declare Hole = difference { plane { y, -0.3 } object { Solid } pigment { Blue } } object { Hole } object { Hole translate -0.1*y }
        #declare Odd = merge { object { Solid no_image } sphere { y, 0.4 } pigment { Red } }
        object { Odd translate <2, 0, -1> } object { Odd translate <3, 0, -1> }
        #declare None = intersection { object { Solid } sphere { 9, 1 } pigment { Blue } } object { None } object { None translate y }
        #declare Bare = difference { object { Solid pigment { Red } } sphere { <0, 0.3, -0.6>, 0.4 } cutaway_textures }
        object { Bare translate <-3, 0, -1> } object { Bare translate <-3, 0, -2> }",
    ),
    // Around the eye, which rays into glass start from: a solid alone, and inside out, which is not kept.
    (
        3,
        "object { Solid scale 3 pigment { Chess } finish { ambient 1 } interior { ior 1.6 } translate <0, 2, -9> }
        object { Solid pigment { Red } translate <-1.5, 0, 0> } object { Solid pigment { Red } translate <1.5, 0, 0> }
        object { Solid inverse pigment { Red } scale <1, 1, -1> } sphere { <0, 2.8, -8>, 0.3 texture { Glass } interior { ior 1.4 } }",
    ),
    // The same with a composite.
    (
        3,
        "object { Cut scale 3 finish { ambient 1 } interior { ior 1.6 } translate <0, 2.4, -10.5> } object { Cut translate <-1.5, 0, 0> }
        object { Cut translate <1.5, 0, 0> } sphere { <0, 2.8, -8.2>, 0.2 texture { Glass } interior { ior 1.4 } }",
    ),
    // Around a light, and around the eye.
    (
        3,
        "object { Cap pigment { Red } scale 2 translate <-5, 7, -7> } object { Cap pigment { Blue } scale 2 translate <0, 2.4, -9> }
        object { Cap pigment { Red } }",
    ),
];

fn scene(text: &str) -> Scene {
    let options = eval::Options { image_width: WIDTH, image_height: HEIGHT, ..eval::Options::default() };
    let evaluation = eval::from_text("instances", &format!("{BEGIN}{text}"), &options);
    assert!(!evaluation.has_errors(), "{:?}", evaluation.diagnostics);
    evaluation.scene
}

fn picture(scene: &Scene, engine: Engine, precision: Precision, instancing: Instancing) -> Film {
    let (width, height) = (WIDTH, HEIGHT);
    let options = RenderOptions { width, height, precision, engine, instancing, ..RenderOptions::default() };
    render(scene, &options, &|_| {}).unwrap().0
}

/// Pixels that differ by more than `bound` in a channel.
fn differing(a: &Film, b: &Film, bound: f32) -> usize {
    let near = |a: f32, b: f32| (a - b).abs() <= bound;
    let pixels = a.pixels.iter().zip(&b.pixels);
    pixels.filter(|(a, b)| !(0..3).all(|k| near(a.rgb[k], b.rgb[k])) || !near(a.transmit, b.transmit)).count()
}

#[test]
fn what_is_kept_once_looks_as_to_the_oracle() {
    for (number, (_, text)) in SCENES.iter().enumerate() {
        let scene = scene(text);
        let oracle = picture(&scene, Engine::Reference, Precision::Exact, Instancing::Never);
        for precision in [Precision::Exact, Precision::Strict] {
            let ours = picture(&scene, Engine::Packets, precision, Instancing::Always);
            // Roundings of single precision, which light is kept in; pixels where a ray runs along an edge to the last digit.
            let off = differing(&ours, &oracle, 1e-6);
            assert!(off <= 2, "{off} pixels of scene {number} in {precision:?}");
        }
        // In single precision points are off by 1e-6 or so, which edges and small highlights show.
        let fast = picture(&scene, Engine::Packets, Precision::Fast, Instancing::Always);
        let off = differing(&fast, &oracle, 1.0 / 255.0);
        assert!(off * 100 <= WIDTH * HEIGHT, "{off} pixels of scene {number} in single precision");
    }
}

/// That the pictures above are of what they are said to be.
#[test]
fn what_stands_in_several_places_is_kept_once_where_it_can_be() {
    for (number, (places, text)) in SCENES.iter().enumerate() {
        let scene = scene(text);
        let rows = |instancing| {
            let compiled: Compiled<f64, f32> =
                Primitives::with(&scene, instancing).compile(&scene, Default::default());
            compiled.geometry.instances.rows.len()
        };
        assert_eq!(rows(Instancing::Always), *places, "scene {number}");
        assert_eq!(rows(Instancing::Never), 0, "scene {number}");
        assert_eq!(rows(Instancing::Auto), 0, "scene {number} is small");
    }
}

/// A thousand places of a mesh take little more than one, and rays find the one they meet.
#[test]
fn a_thousand_places_take_the_room_of_a_few_triangles() {
    let text = "#declare Ball = mesh2 { vertex_vectors { 33*33,
            #declare I = 0; #while (I < 33*33)
                #declare A = pi*mod(I, 33)/16; #declare B = pi*div(I, 33)/32;
                <cos(A)*sin(B), cos(B), sin(A)*sin(B)>,
            #declare I = I + 1; #end }
        face_indices { 2*32*32, #declare I = 0; #while (I < 32*32)
            #declare A = div(I, 32)*33 + mod(I, 32);
            <A, A + 1, A + 33>, <A + 1, A + 34, A + 33>,
        #declare I = I + 1; #end } }
        #declare K = 0; #while (K < 1000) object { Ball translate <3*K, 0, 0> } #declare K = K + 1; #end";
    let scene = scene(text);
    let compiled = |instancing| -> Compiled<f64, f32> {
        Primitives::with(&scene, instancing).compile(&scene, Default::default())
    };
    let kept = compiled(Instancing::Auto);
    assert_eq!(kept.geometry.instances.rows.len(), 1000);
    // A triangle takes a few hundred bytes: 2,048 of them half a megabyte, a thousand times as many half a gigabyte.
    assert!(kept.geometry.bytes() < 3 << 20, "{}", kept.geometry.bytes());
    let at = |x: f64| (glam::DVec3::new(x, 20.0, 0.01), glam::DVec3::NEG_Y);
    let rays: Vec<_> = [0.001, 3.002, 1499.998, 1501.5, 2997.001].into_iter().map(at).collect();
    let found = wave::nearest_hits(&kept, &rays);
    for (ray, found) in rays.iter().zip(&found) {
        let meets = (ray.0.x / 3.0).fract().min(1.0 - (ray.0.x / 3.0).fract()) < 0.1;
        assert_eq!(found.is_some_and(|found| (found.point.y - 1.0).abs() < 0.01), meets, "{ray:?} {found:?}");
    }
}

/// Squares of lengths that a place makes a trillion times as long are beyond single precision.
#[test]
fn extreme_places_are_told() {
    for (scale, is_extreme) in [("1e3", false), ("1e-9", false), ("1e13", true), ("1e-13", true)] {
        let text = format!("object {{ Cap }} object {{ Cap scale <1, {scale}, 1> }}");
        let primitives = Primitives::<f32>::with(&scene(&text), Instancing::Always);
        assert_eq!(primitives.have_extreme_places(), is_extreme, "{scale}");
    }
}

/// Composites of composites of composites are not walked to their ends before they are refused, and what has no end is not kept once
/// and so is counted in each place.
#[test]
fn what_is_too_large_is_told_at_once() {
    const LIMIT: u64 = 20_000_000;
    let twice = "#declare A = merge { object { A } object { A translate x } }\n".repeat(60);
    let endless = "#declare A = difference { plane { y, 0 } mesh { #declare I = 0; #while (I < 2000)
        triangle { I*x, I*x + y, I*x + z } #declare I = I + 1; #end } }\n"
        .to_string()
        + &"#declare A = union { object { A } object { A translate x } }\n".repeat(14);
    for text in [
        format!("#declare A = sphere {{ 0, 1 }} {twice} object {{ A pigment {{ Red }} }}"),
        endless + "object { A pigment { Red } }",
    ] {
        assert!(kept_shapes(&scene(&text), LIMIT) > LIMIT);
    }
}

/// A mesh counts once, but there are not more numbers than 2^31 for the surfaces of its places: those beyond it count by themselves.
#[test]
fn places_beyond_all_numbers_are_not_kept_once() {
    const LIMIT: u64 = 20_000_000;
    for (doublings, fits) in [(19, true), (21, false)] {
        let twice = "#declare A = union { object { A } object { A translate x } }\n".repeat(doublings);
        let text = format!(
            "#declare A = mesh {{ #declare I = 0; #while (I < 2000) triangle {{ I*x, I*x + y, I*x + z }}
            #declare I = I + 1; #end }} {twice} object {{ A }}"
        );
        assert_eq!(kept_shapes(&scene(&text), LIMIT) <= LIMIT, fits, "2,000 triangles 2^{doublings} times");
    }
}
