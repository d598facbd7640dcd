//! Numbers out of reach in a script: each ends in a message or in a picture of finite light, never in a panic or a hang.

use super::table::{Figure, Row};
use super::{HEIGHT, WAYS, WIDTH, picture, povray};
use octray::eval;

/// How a script makes a number that is none, too large or too small.
const NUMBERS: [&str; 12] = [
    "(1/0)",
    "(0/0)",
    "log(0)",
    "sqrt(-1)",
    "acos(2)",
    "1e400",
    "(1e300*1e300)",
    "(-1e300*1e300)",
    "1e-320",
    "-0.0",
    "pow(0, -1)",
    "(1e308*10 - 1e308*10)",
];

/// Where it goes.
const PLACES: [&str; 10] = [
    "sphere { 0, N }",
    "sphere { <N, 0, 0>, 1 }",
    "box { <-1, -1, N>, 1 }",
    "torus { 1, N }",
    "cone { 0, N, y, 1 }",
    "sphere { 0, 1 scale N }",
    "sphere { 0, 1 rotate N*y }",
    "sphere { 0, 1 pigment { rgb N } finish { phong 1 phong_size N reflection N } }",
    "sphere { 0, 1 pigment { rgbf 1 } interior { ior N fade_distance N fade_power 2 } }",
    "triangle { <N, 0, 0>, x, y }",
];

/// Each number in every place.
pub fn rows() -> Vec<Row> {
    NUMBERS.iter().map(|number| row(number)).collect()
}

fn row(number: &str) -> Row {
    let (mut refused, mut spoilt, mut by_povray) = (0, [0; 4], Some(0));
    for place in PLACES {
        let text = format!(
            "#version 3.7; global_settings {{ assumed_gamma 1 }}\n#declare N = {number};\ncamera {{ location -5*z }}\n\
             light_source {{ <2, 5, -9>, rgb 1 }} plane {{ y, -2 pigment {{ rgb 1 }} }}\n{place}\n"
        );
        by_povray = by_povray.zip(povray::takes(&text)).map(|(n, takes)| n + usize::from(!takes));
        let options = eval::Options { image_width: WIDTH, image_height: HEIGHT, ..eval::Options::default() };
        let read = eval::from_text("scene", &text, &options);
        if read.has_errors() {
            refused += 1;
            continue;
        }
        for (k, (_, engine, precision, _)) in WAYS.into_iter().enumerate() {
            let film = picture(&read.scene, engine, precision, 1);
            let whole = film.pixels.iter().all(|p| p.rgb.iter().chain([&p.transmit]).all(|x| !x.is_nan()));
            spoilt[k] += usize::from(!whole);
        }
    }
    let places = PLACES.len();
    let said = format!("{refused} refused, {} drawn", places - refused);
    Row {
        case: format!("`{number}` in {places} places"),
        expected: "a message, or a picture without NaN".into(),
        figures: std::array::from_fn(|k| Figure {
            way: WAYS[k].0,
            said: if spoilt[k] == 0 { said.clone() } else { format!("{} pictures with NaN", spoilt[k]) },
            bound: "0 pictures with NaN".into(),
            holds: spoilt[k] == 0,
        }),
        povray: by_povray.map(|refused| format!("{refused} refused, {} drawn", places - refused)),
        reason: "no number may spoil a picture unsaid".into(),
    }
}
