//! Camera rays that are held against what their pixels may see find what they find by the tree.

use octray::eval;
use octray::film::Film;
use octray::render::{LightBuffers, Occupancy, Precision, RenderOptions, Schedule, Traversal, render};

/// Things of all kinds and sizes before, beside, behind and around the eye, on a floor.
const THINGS: &str = "#version 3.7; global_settings { assumed_gamma 1 max_trace_level 3 }
#declare S = seed(5);
#declare I = 0;
#while (I < 60)
  object {
    #switch (mod(I, 12))
      #case (0) torus { 0.35, 0.1 } #break
      #case (1) torus { 0.2, 0.3 scale <1, 0.6, 1> rotate 60*x } #break
      #case (2) difference { box { -0.35, 0.35 } cylinder { -y, y, 0.25 } rotate 25*I*y } #break
      #case (3) intersection { sphere { -0.3*y, 0.5 } sphere { 0.3*y, 0.5 } rotate 60*x } #break
      #case (4) merge { cylinder { -0.4*x, 0.4*x, 0.1 } cylinder { -0.4*z, 0.4*z, 0.1 } sphere { 0, 0.2 } } #break
      #case (5) union { box { <-0.4, 0, -0.05>, <0.4, 0.1, 0.05> } cone { 0, 0.2, 0.7*y, 0.02 } rotate 40*I*y } #break
      #case (6) difference { cone { 0, 0.42, 0.9*y, 0.05 } box { <-0.05, 0.1, -1>, <0.05, 0.7, 1> } } #break
      #case (7) box { -0.3, 0.3 rotate 30*z } #break
      #case (8) cylinder { -0.4*y, 0.4*y, 0.2 open rotate 9*I*x } #break
      #case (9) sphere { 0, 0.3 scale <1, 0.02, 1> rotate 13*I*x } #break
      #case (10) disc { 0, y + 0.5*x, 0.4, 0.1 } #break
      #else sphere { 0, 0.02 }
    #end
    translate <mod(I, 8)*1.2 - 4, 0.3 + 1.5*rand(S), div(I, 8)*1.2 - 5>
    pigment { rgb <rand(S), rand(S), rand(S)> filter (mod(I, 10) = 0)*0.8 }
    finish { ambient 0.3 reflection (mod(I, 5) = 0)*0.4 }
    #if (mod(I, 9) = 0) no_image #end
  }
  #declare I = I + 1;
#end
sphere { <0, 2, -4>, 7 hollow pigment { rgbf <0.9, 0.9, 1, 0.95> } finish { ambient 0 } }
plane { y, 0 pigment { checker rgb 0.9, rgb 0.5 } }
background { rgb <0.2, 0.3, 0.5> }";

/// Eyes above, among and behind the things, and one whose picture is askew and mirrored.
const CAMERAS: [&str; 4] = [
    "camera { location <-5, 6, -9> look_at <0, 0.5, 0> angle 50 }",
    "camera { location <0.4, 1.1, -1.7> look_at <3, 0.4, 2> angle 120 }",
    "camera { location <0, 3, 8> look_at <0, 30, 40> angle 90 }",
    "camera { location <-3, 5, -8> direction <0.4, -0.6, 1> right <-1.2, 0.1, 0.3> up <0.2, 0.9, 0.1> }",
];

/// A picture, by the tree or not, and what was tested.
fn picture(
    text: &str,
    (width, height): (usize, usize),
    precision: Precision,
    traversal: Traversal,
) -> (Film, Occupancy) {
    let read = eval::from_text("things", text, &eval::Options::default());
    assert!(!read.has_errors(), "{:?}", read.diagnostics);
    let schedule = Schedule { traversal, light_buffers: LightBuffers::Never, ..Schedule::default() };
    let options =
        RenderOptions { width, height, precision, schedule, occupancy: true, ..RenderOptions::default() };
    let (film, stats) = render(&read.scene, &options, &|_| {}).expect("threads start");
    (film, stats.occupancy.expect("it was asked for"))
}

#[test]
fn pixels_see_what_the_tree_finds() {
    for camera in CAMERAS {
        let text = format!("{THINGS}\n{camera}\nlight_source {{ <8, 12, -9>, 0.7 }}");
        // The second is not made of whole blocks.
        for size in [(320, 240), (157, 121)] {
            for precision in [Precision::Exact, Precision::Fast, Precision::Strict] {
                let (by_tree, _) = picture(&text, size, precision, Traversal::Packet);
                let (by_pixel, _) = picture(&text, size, precision, Traversal::Auto);
                assert!(by_tree.pixels == by_pixel.pixels, "{camera}, {size:?}, {precision:?}");
            }
        }
    }
}

/// Camera rays test no boxes.
#[test]
fn no_tree_is_walked() {
    let text = format!("{THINGS}\n{}", CAMERAS[0]).replace("reflection (mod(I, 5) = 0)*0.4", "");
    let text = text.replace("filter (mod(I, 10) = 0)*0.8", "").replace("rgbf <0.9, 0.9, 1, 0.95>", "rgb 1");
    let text = text.replace("sphere { <0, 2, -4>, 7 hollow", "sphere { <0, 2, -40>, 7 hollow");
    let boxes = |traversal| picture(&text, (320, 256), Precision::Exact, traversal).1.boxes;
    // (A test is one of eight boxes, and of many packets.)
    let [by_tree, by_pixel] = [Traversal::Packet, Traversal::Auto].map(|traversal| boxes(traversal).tests);
    assert!(by_tree > 1_000, "{by_tree} by tree");
    assert_eq!(by_pixel, 0);
}
