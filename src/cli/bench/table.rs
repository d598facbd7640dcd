//! The figures as lines for a terminal and as CSV.

use super::measure::{Measured, Mode};
use crate::cli::crosscheck::shortened;
use std::fmt::Write;

/// Above the lines.
pub const HEAD: &str = "\
scene          mode     trace s  Mrays/s | against strict: rmse    p99.9      max   >1/255 | t of camera hits: median    p99.9      max  missed  false | POV-Ray, off edges <=2e-3";

/// Below the lines.
pub const FOOT: &str = "\
Seconds of tracing alone, median; pictures in linear light; camera hits against strict, relative. POV-Ray's Mrays/s
are octray's rays for the same picture over POV-Ray's time.";

/// A line a mode.
pub fn lines(measured: &Measured) -> String {
    let mut text = String::new();
    for mode in &measured.modes {
        let cells = cells(mode);
        let [time, speed, rmse, p999, max, over, t_median, t_p999, t_max, missed, false_hits, povray] =
            &cells;
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{:14} {:8} {time:>7} {speed:>8} | {rmse:>20} {p999:>8} {max:>8} {over:>8} | {t_median:>24} {t_p999:>8} \
             {t_max:>8} {missed:>7} {false_hits:>6} | {povray:>12}",
            shortened(&measured.scene, 14),
            mode.name,
        );
    }
    text
}

/// In the order of [`COLUMNS`], behind scene and mode.
pub fn cells(mode: &Mode) -> [String; 12] {
    let picture = &mode.against_strict.all;
    let error = |x: f64| if x == 0.0 { "0".into() } else { format!("{x:.1e}") };
    let hits = |figure: &dyn Fn(&super::measure::HitErrors) -> String| {
        mode.hits.as_ref().map_or_else(|| "-".into(), figure)
    };
    [
        format!("{:.3}", mode.trace_s),
        format!("{:.2}", mode.mrays_per_s),
        error(picture.rmse),
        error(picture.p999),
        error(picture.max),
        format!("{:.3} %", picture.over_1_255 * 100.0),
        hits(&|h| error(h.t.median)),
        hits(&|h| error(h.t.p999)),
        hits(&|h| error(h.t.max)),
        hits(&|h| h.misses.to_string()),
        hits(&|h| h.false_hits.to_string()),
        mode.against_povray
            .as_ref()
            .map_or_else(|| "-".into(), |c| format!("{:.3} %", c.off_edges.within * 100.0)),
    ]
}

/// Heads of [`cells`].
pub const COLUMNS: [&str; 12] = [
    "trace s",
    "Mrays/s",
    "rmse",
    "p99.9",
    "max",
    "over 1/255",
    "t median",
    "t p99.9",
    "t max",
    "missed",
    "false hits",
    "with POV-Ray",
];

/// Mean lanes of eight, in the order of [`LANE_COLUMNS`], behind scene and mode; `None` where there are none.
pub fn lanes(mode: &Mode) -> [Option<f64>; 7] {
    let (tests, queues) = (mode.occupancy.as_ref(), mode.queues.as_ref());
    [
        tests.map(|tests| tests.boxes),
        tests.map(|tests| tests.leaf),
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
        "scene,mode,trace_s,mrays_per_s,rmse,p999,max,over_1_255,t_median,t_p999,t_max,point_max,misses,false_hits,\
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
                measured.scene.replace([',', '"', '\n'], "_"),
                mode.name,
                mode.trace_s,
                mode.mrays_per_s,
                picture.rmse,
                picture.p999,
                picture.max,
                picture.over_1_255
            );
            match &mode.hits {
                Some(h) => {
                    let _ = write!(
                        text,
                        ",{},{},{},{},{},{}",
                        h.t.median, h.t.p999, h.t.max, h.point.max, h.misses, h.false_hits
                    );
                }
                None => text.push_str(",,,,,,"),
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
