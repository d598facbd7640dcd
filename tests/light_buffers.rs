//! Shadow rays that are answered by what is known of a light's surroundings have the answers that tracing gives.

use octray::eval;
use octray::film::Film;
use octray::render::{LightBuffers, Precision, RenderOptions, Schedule, render};

/// Rows of solids of every convex kind, things that are none, glass, and what casts no shadow; some close to a lamp. Of `Count` from
/// `First` on.
const YARD: &str = "#version 3.7; global_settings { assumed_gamma 1 max_trace_level 4 }
camera { location <-7, 6, -9> look_at <0, 0.5, 0> angle 50 }
#ifndef (First) #declare First = 0; #declare Count = 144; #end
#declare S = seed(3 + First);
#declare I = First;
#while (I < First + Count)
  object {
    #switch (mod(I, 9))
      #case (0) sphere { 0, 0.4 } #break
      #case (1) box { <-0.3, -0.6, -0.3>, <0.3, 0.5, 0.3> } #break
      #case (2) box { -0.35, 0.35 rotate <20, 30*I, 10> } #break
      #case (3) cylinder { -0.6*y, 0.6*y, 0.3 rotate 7*I*z } #break
      #case (4) cone { -0.5*y, 0.4, 0.6*y, 0.1 } #break
      #case (5) sphere { 0, 0.3 scale <1, 2, 1> rotate 11*I*x } #break
      #case (6) torus { 0.3, 0.1 rotate 40*x } #break
      #case (7) difference { box { -0.35, 0.35 } cylinder { -y, y, 0.25 } } #break
      #else disc { 0, y + 0.5*x, 0.4 }
    #end
    translate <mod(I, 12) - 5.5, 0.6 + 0.5*rand(S), div(I, 12) - 5.5>
    pigment { rgb <rand(S), rand(S), rand(S)> filter (mod(I, 10) = 0)*0.8 }
    finish { ambient 0.1 diffuse 0.7 reflection (mod(I, 5) = 0)*0.4 diffuse mod(I, 4)*0.2, mod(I, 3)*0.1 }
    #if (mod(I, 7) = 0) double_illuminate #end
    #if (mod(I, 11) = 0) no_shadow #end
    #if (mod(I, 13) = 0) hollow #end
  }
  #declare I = I + 1;
#end
plane { y, 0 pigment { checker rgb 0.9, rgb 0.5 } }";

const LIGHTS: &str = "light_source { <8, 12, -9>, 0.6 }
light_source { <0.3, 2.2, 0.4>, <0.5, 0.4, 0.3> fade_distance 3 fade_power 2 }
light_source { <-5.5, 0.9, -2.4>, <0.3, 0.4, 0.5> }
light_source { <3, 8, 5>, 0.5 spotlight radius 20 falloff 40 point_at 0 }
light_source { <1e7, 2e7, -1e7>, 0.2 }";

/// Rooms around it all, which the lights are in or out of.
const ROOMS: [&str; 3] = [
    "",
    "sphere { 0, 20 pigment { rgb 0.8 } }",
    "box { -15, 15 pigment { rgb 0.8 } finish { diffuse 0.6, 0.3 } }",
];

/// The pixels that differ by more than `tolerance`.
fn differences(one: &Film, other: &Film, tolerance: f32) -> usize {
    let channels = |film: &Film, k: usize| film.pixels[k].rgb;
    let differs = |k: &usize| {
        channels(one, *k).iter().zip(channels(other, *k)).any(|(a, b)| !((a - b).abs() <= tolerance))
    };
    (0..one.pixels.len()).filter(differs).count()
}

/// A picture, and which share of its shadow rays was answered.
fn picture(text: &str, precision: Precision, light_buffers: LightBuffers) -> (Film, f64) {
    picture_of((160, 120), text, precision, light_buffers)
}

/// The same of so many columns and rows.
fn picture_of(
    (width, height): (usize, usize),
    text: &str,
    precision: Precision,
    light_buffers: LightBuffers,
) -> (Film, f64) {
    let read = eval::from_text("yard", text, &eval::Options::default());
    assert!(!read.has_errors(), "{:?}", read.diagnostics);
    let schedule = Schedule { light_buffers, ..Schedule::default() };
    let options = RenderOptions { width, height, precision, schedule, ..RenderOptions::default() };
    let (film, stats) = render(&read.scene, &options, &|_| {}).expect("threads start");
    (film, stats.rays.packets.answered as f64 / stats.rays.shadow as f64)
}

#[test]
fn answers_are_those_of_tracing() {
    for room in ROOMS {
        let text = format!("{YARD}\n{LIGHTS}\n{room}");
        // Light is summed in another order. In single precision a ray that a cell's corners decide may round otherwise
        // than one that is traced: outlines of shadows, by a pixel here and there.
        for (precision, tolerance, outlines) in [(Precision::Exact, 1e-6, 0), (Precision::Fast, 1e-4, 4)] {
            let (traced, none) = picture(&text, precision, LightBuffers::Never);
            let (answered, share) = picture(&text, precision, LightBuffers::Always);
            let over = differences(&traced, &answered, tolerance);
            assert!(over <= outlines, "{room}: {over} pixels in {precision:?}");
            assert_eq!(none, 0.0);
            // A third is, with the few cells of so small a picture; in single precision nothing is known of the far light.
            assert!(share > 0.28, "{room}: {share} answered in {precision:?}");
        }
    }
}

/// A closed torus of triangles, an open sheet with hills, one with a hole, loose triangles that shade each other, and spheres and a
/// box among them; a wall that both the sheet and the floor run into.
const MESHES: &str = "#version 3.7; global_settings { assumed_gamma 1 max_trace_level 4 }
camera { location <-4, 5, -7> look_at <0, 0.5, 0> angle 50 }
#macro P(U, V) <(1.2 + 0.4*cos(2*pi*V))*cos(2*pi*U), 1.4 + 0.4*sin(2*pi*V), (1.2 + 0.4*cos(2*pi*V))*sin(2*pi*U)> #end
#macro H(X, Z) <X, 0.15*sin(3*X)*cos(2*Z) + 0.2, Z> #end
mesh {
  #for (I, 0, 39) #for (K, 0, 19)
    triangle { P(I/40, K/20), P((I+1)/40, K/20), P(I/40, (K+1)/20) }
    triangle { P((I+1)/40, (K+1)/20), P((I+1)/40, K/20), P(I/40, (K+1)/20) }
  #end #end
  pigment { rgb <0.9, 0.7, 0.3> } finish { diffuse 0.6 reflection 0.3 }
}
mesh {
  #for (I, -12, 11) #for (K, -12, 11)
    #if (I*I + K*K > 9)
      triangle { H(I/4, K/4), H((I+1)/4, K/4), H(I/4, (K+1)/4) }
      triangle { H((I+1)/4, K/4), H((I+1)/4, (K+1)/4), H(I/4, (K+1)/4) }
    #end
  #end #end
  pigment { rgb <0.4, 0.8, 0.5> } finish { diffuse 0.7, 0.3 }
}
#declare S = seed(8);
#for (I, 0, 59)
  #local A = <4*rand(S) - 2, 0.5 + 2*rand(S), 4*rand(S) - 2>;
  triangle { A, A + 0.4*<rand(S), rand(S), rand(S)>, A + 0.4*<rand(S), -rand(S), rand(S)>
    pigment { rgb rand(S) filter (mod(I, 12) = 0)*0.7 } #if (mod(I, 7) = 0) no_shadow #end }
#end
#for (I, 0, 19) sphere { <4*rand(S) - 2, 0.5 + 2*rand(S), 4*rand(S) - 2>, 0.1 pigment { rgb 0.8 } } #end
box { <2.4, -1, -2>, <2.6, 1.5, 2> pigment { rgb <0.5, 0.6, 0.9> } }
plane { y, 0 pigment { checker rgb 0.9, rgb 0.5 } }";

#[test]
fn triangles_answer_as_tracing_does() {
    let text = format!("{MESHES}\n{LIGHTS}");
    // Where a triangle is see-through or casts no shadow, sheets tell nothing of the points on them.
    let opaque =
        text.replace("filter (mod(I, 12) = 0)*0.7", "").replace("#if (mod(I, 7) = 0) no_shadow #end", "");
    for (text, least) in [(&text, 0.3), (&opaque, 0.4)] {
        for (precision, tolerance, outlines) in [(Precision::Exact, 1e-6, 0), (Precision::Fast, 1e-4, 4)] {
            let (traced, _) = picture(text, precision, LightBuffers::Never);
            let (answered, share) = picture(text, precision, LightBuffers::Always);
            let over = differences(&traced, &answered, tolerance);
            assert!(over <= outlines, "{over} pixels in {precision:?}");
            // With the few cells of so small a picture.
            assert!(share > least, "{share} answered in {precision:?}");
        }
    }
}

/// Few things are held against the ways to a light one by one, in cones: by themselves, in pictures of any size.
#[test]
fn few_things_answer_as_tracing_does() {
    for (number, first) in (0..144).step_by(12).enumerate() {
        let room = ROOMS[number % ROOMS.len()];
        // Some things more than a cone each: a triangle, what is seen edge-on, and what stretches beyond everything.
        let more = "triangle { <-3, 0.2, -3>, <2, 3, -2>, <0, 0.1, 3> pigment { rgb 0.7 } }
            box { <-9, -0.2, -9>, <9, -0.1, 9> pigment { rgb 0.5 } } plane { x, 9 pigment { rgb 0.6 } }";
        let text =
            format!("#declare First = {first}; #declare Count = 12;\n{YARD}\n{LIGHTS}\n{room}\n{more}");
        for (precision, tolerance, outlines) in [(Precision::Exact, 1e-6, 0), (Precision::Fast, 1e-4, 4)] {
            let (traced, none) = picture(&text, precision, LightBuffers::Never);
            let (answered, share) = picture(&text, precision, LightBuffers::Auto);
            let over = differences(&traced, &answered, tolerance);
            assert!(over <= outlines, "{first}: {over} pixels in {precision:?}");
            assert_eq!(none, 0.0);
            // Of what five lights, some of them among the things, do not see.
            assert!(share > 0.15, "{first}: {share} answered in {precision:?}");
        }
    }
}

/// Rows of tori, of things that are built of others, and of some that stand alone, on a floor with a wall. None is next to all of its
/// neighbours, so that the floor is seen between them.
const FORGE: &str = "#version 3.7; global_settings { assumed_gamma 1 max_trace_level 4 }
camera { location <-7, 9, -10> look_at <0, 0.5, 0> angle 55 }
#declare S = seed(11);
#declare I = 0;
#while (I < 100)
  object {
    #switch (mod(I, 14))
      #case (0) torus { 0.35, 0.1 } #break
      #case (1) torus { 0.3, 0.08 rotate <70, 30*I, 0> } #break
      #case (2) torus { 0.2, 0.3 scale <1, 0.6, 1> } #break
      #case (3) difference { box { -0.35, 0.35 } cylinder { -y, y, 0.25 } rotate 25*I*y } #break
      #case (4) intersection { sphere { -0.3*y, 0.5 } sphere { 0.3*y, 0.5 } rotate 60*x } #break
      #case (5) merge { cylinder { -0.4*x, 0.4*x, 0.1 } cylinder { -0.4*z, 0.4*z, 0.1 } sphere { 0, 0.2 } } #break
      #case (6) union { box { <-0.4, 0, -0.05>, <0.4, 0.1, 0.05> } cone { 0, 0.2, 0.7*y, 0.02 } rotate 40*I*y } #break
      #case (7) difference { cone { 0, 0.42, 0.9*y, 0.05 } box { <-0.05, 0.1, -1>, <0.05, 0.7, 1> } torus { 0.3, 0.05 } } #break
      #case (8) intersection { box { -0.3, 0.3 } sphere { 0, 0.3 inverse } rotate 30*z } #break
      #case (9) quadric { <1, 1, 1>, <0, 0, 0>, <0, 0, 0>, -0.09 clipped_by { plane { y, 0.1 } } } #break
      #case (10) difference { union { cylinder { 0, 0.3*y, 0.3 } box { <0, 0, -0.1>, <0.45, 0.3, 0.1> } } plane { y, 0.1 rotate 20*z } } #break
      #case (11) union { triangle { 0, 0.5*x, 0.5*y } sphere { 0, 0.1 } } #break
      #case (12) cylinder { -0.3*y, 0.3*y, 0.2 open rotate 9*I*x } #break
      #else sphere { 0, 0.3 scale <1, 0.02, 1> rotate 13*I*x }
    #end
    translate <mod(I, 10)*1.3 - 5.8, 0.4 + 0.6*rand(S), div(I, 10)*1.3 - 5.8>
    pigment { rgb <rand(S), rand(S), rand(S)> filter (mod(I, 10) = 0)*0.8 }
    finish { ambient 0.1 diffuse 0.7 reflection (mod(I, 5) = 0)*0.4 diffuse mod(I, 4)*0.2, mod(I, 3)*0.1 }
    #if (mod(I, 9) = 0) no_shadow #end
    #if (mod(I, 13) = 0) hollow #end
  }
  #declare I = I + 1;
#end
plane { y, 0 pigment { checker rgb 0.9, rgb 0.5 } finish { reflection 0.1 } }
plane { x, 9 pigment { rgb <0.6, 0.7, 0.8> } finish { diffuse 0.6, 0.2 } }";

/// Where nothing is before a light, shadow rays are not traced.
#[test]
fn open_ways_are_those_that_tracing_finds() {
    let size = (320, 240);
    let above = "light_source { <-9, 14, -8>, 0.5 }";
    let others = [
        ("light_source { <7, 9, 12>, 0.4 spotlight radius 20 falloff 40 point_at 0 }", 0.4),
        // Low, and beside all of it; far away; under the floor; among the things, where nothing is told.
        ("light_source { <-8, 1.3, 0>, <0.5, 0.4, 0.3> }", 0.25),
        ("light_source { <1e7, 2e7, -1e7>, 0.4 }", 0.2),
        ("light_source { <1, -3, 0>, 0.4 }", 0.2),
        ("light_source { <0.3, 1.2, 0.4>, <0.5, 0.4, 0.3> fade_distance 3 fade_power 2 }", 0.15),
    ];
    for (light, least) in others {
        let text = format!("{FORGE}\n{above}\n{light}");
        for (precision, tolerance, outlines) in [(Precision::Exact, 1e-6, 0), (Precision::Fast, 1e-4, 4)] {
            let (traced, none) = picture_of(size, &text, precision, LightBuffers::Never);
            let (answered, share) = picture_of(size, &text, precision, LightBuffers::Auto);
            let over = differences(&traced, &answered, tolerance);
            assert!(over <= outlines, "{light}: {over} pixels in {precision:?}");
            assert_eq!(none, 0.0);
            assert!(share > least, "{light}: {share} answered in {precision:?}");
        }
    }
}

/// What stands foremost before a light has only itself in its way, also where a floor with bounds is in every cell.
#[test]
fn what_is_foremost_is_lit_as_tracing_finds() {
    let plane = "plane { y, 0 pigment { checker rgb 0.9, rgb 0.5 } finish { reflection 0.1 } }";
    let floor =
        "box { <-9, -0.2, -9>, <9, 0, 9> pigment { checker rgb 0.9, rgb 0.5 } finish { reflection 0.1 } }";
    assert!(FORGE.contains(plane));
    let forge = FORGE.replace(plane, floor);
    // From above, so low that most stands before something, and through all of it.
    for (light, least) in [("<-9, 14, -8>", 0.5), ("<-40, 4, -30>", 0.55), ("<3, 60, 2>", 0.5)] {
        let text = format!("{forge}\nlight_source {{ {light}, 0.8 }}");
        for (precision, tolerance, outlines) in [(Precision::Exact, 1e-6, 0), (Precision::Fast, 1e-4, 4)] {
            let (traced, none) = picture_of((320, 240), &text, precision, LightBuffers::Never);
            let (answered, share) = picture_of((320, 240), &text, precision, LightBuffers::Auto);
            let over = differences(&traced, &answered, tolerance);
            assert!(over <= outlines, "{light}: {over} pixels in {precision:?}");
            assert_eq!(none, 0.0);
            assert!(share > least, "{light}: {share} answered in {precision:?}");
        }
    }
}

#[test]
fn lights_without_a_place_have_none() {
    let lights = "light_source { <3, 8, 5>, 0.5 parallel point_at 0 }
        light_source { <3, 8, 5>, 0.5 cylinder radius 2 falloff 4 point_at 0 }
        light_source { <3, 8, -5>, 0.5 shadowless }";
    for (part, buffers) in
        [("", LightBuffers::Always), ("#declare First = 0; #declare Count = 9;", LightBuffers::Auto)]
    {
        let (_, share) = picture(&format!("{part}{YARD}\n{lights}"), Precision::Exact, buffers);
        assert_eq!(share, 0.0);
    }
}
