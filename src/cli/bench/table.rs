//! The figures as lines for a terminal and as CSV.

use super::measure::{HitErrors, Measured, Mode};
use crate::cli::paths::{csv_field, shortened};
use std::fmt::Write;

/// Above the lines.
pub const HEAD: &str = "\
scene          mode     trace s  Mrays/s | against strict: rmse    p99.9      max   >1/255 | t of camera hits: median    p99.9      max point max  missed  false | POV-Ray, off edges <=2e-3";

/// Below the lines.
pub const FOOT: &str = "\
Seconds of tracing alone, median; pictures in linear light; camera hits against strict, relative. POV-Ray's Mrays/s
are octray's rays for the same picture over POV-Ray's time.";

/// A line a mode.
pub fn lines(measured: &Measured) -> String {
    let mut text = String::new();
    for mode in &measured.modes {
        let [time, speed, rmse, p999, max, over] = &speed_and_picture(mode);
        let [t_median, t_p999, t_max, _, _, point_max, missed, false_hits] = &camera_hits(mode);
        let [povray, _] = &with_povray(mode);
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{:14} {:8} {time:>7} {speed:>8} | {rmse:>20} {p999:>8} {max:>8} {over:>8} | {t_median:>24} {t_p999:>8} \
             {t_max:>8} {point_max:>9} {missed:>7} {false_hits:>6} | {povray:>12}",
            shortened(&measured.scene, 14),
            mode.name,
        );
    }
    text
}

/// In the order of [`COLUMNS`], behind scene and mode.
pub fn cells(mode: &Mode) -> Vec<String> {
    [&speed_and_picture(mode)[..], &camera_hits(mode), &with_povray(mode)].concat()
}

fn error(x: f64) -> String {
    if x == 0.0 { "0".into() } else { format!("{x:.1e}") }
}

fn speed_and_picture(mode: &Mode) -> [String; 6] {
    let picture = &mode.against_strict.all;
    [
        format!("{:.3}", mode.trace_s),
        mode.mrays_per_s.map_or_else(|| "-".into(), |speed| format!("{speed:.2}")),
        error(picture.rmse),
        error(picture.p999),
        error(picture.max),
        format!("{:.3} %", picture.over_1_255 * 100.0),
    ]
}

fn camera_hits(mode: &Mode) -> [String; 8] {
    let Some(HitErrors { t, point, misses, false_hits, .. }) = &mode.hits else {
        return std::array::from_fn(|_| "-".into());
    };
    let [a, b, c, d, e, f] = [t.median, t.p999, t.max, point.median, point.p999, point.max].map(error);
    [a, b, c, d, e, f, misses.to_string(), false_hits.to_string()]
}

fn with_povray(mode: &Mode) -> [String; 2] {
    mode.against_povray.as_ref().map_or_else(
        || ["-".into(), "-".into()],
        |c| [format!("{:.3} %", c.off_edges.within * 100.0), error(c.all.rmse)],
    )
}

/// Heads of [`cells`], under those of their groups.
pub const COLUMNS: [&str; 16] = [
    "trace s",
    "Mrays/s",
    "rmse",
    "p99.9",
    "max",
    "over 1/255",
    "median",
    "p99.9",
    "max",
    "median",
    "p99.9",
    "max",
    "missed",
    "false hits",
    "within 2e-3",
    "rmse",
];

/// Mean lanes of eight, in the order of [`LANE_COLUMNS`], behind scene and mode; `None` where there are none.
pub fn lanes(mode: &Mode) -> [Option<f64>; 7] {
    let (tests, queues) = (mode.occupancy.as_ref(), mode.queues.as_ref());
    [
        tests.and_then(|tests| tests.boxes),
        tests.and_then(|tests| tests.leaf),
        queues.and_then(|queues| queues.camera),
        queues.and_then(|queues| queues.shadow),
        queues.and_then(|queues| queues.reflect),
        queues.and_then(|queues| queues.refract),
        queues.and_then(|queues| queues.hits),
    ]
}

/// Heads of [`lanes`].
pub const LANE_COLUMNS: [&str; 7] = ["box", "leaf", "camera", "shadow", "reflect", "refract", "hits"];

/// One line a scene and mode, numbers in full.
pub fn csv(scenes: &[Measured]) -> String {
    let mut text = String::from(
        "scene,mode,trace_s,mrays_per_s,rmse,p999,max,over_1_255,t_median,t_p999,t_max,\
         point_median,point_p999,point_max,misses,false_hits,\
         povray_rmse,povray_off_edges_within",
    );
    LANE_COLUMNS.iter().for_each(|column| text += &format!(",lanes_{column}"));
    text.push('\n');
    for measured in scenes {
        for mode in &measured.modes {
            let picture = &mode.against_strict.all;
            let _ = write!(
                text,
                "{},{},{},{},{},{},{},{}",
                csv_field(&measured.scene),
                mode.name,
                mode.trace_s,
                mode.mrays_per_s.map(|speed| speed.to_string()).unwrap_or_default(),
                picture.rmse,
                picture.p999,
                picture.max,
                picture.over_1_255
            );
            match &mode.hits {
                Some(h) => {
                    let _ = write!(
                        text,
                        ",{},{},{},{},{},{},{},{}",
                        h.t.median,
                        h.t.p999,
                        h.t.max,
                        h.point.median,
                        h.point.p999,
                        h.point.max,
                        h.misses,
                        h.false_hits
                    );
                }
                None => text.push_str(",,,,,,,,"),
            }
            match &mode.against_povray {
                Some(c) => {
                    let _ = write!(text, ",{},{}", c.all.rmse, c.off_edges.within);
                }
                None => text.push_str(",,"),
            }
            for lanes in lanes(mode) {
                text += &lanes.map_or_else(|| ",".into(), |lanes| format!(",{lanes}"));
            }
            text.push('\n');
        }
    }
    text
}
