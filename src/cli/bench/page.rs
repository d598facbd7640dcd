//! The run as one HTML file that holds everything it shows.

use super::Run;
use super::kinds::{KINDS, WALKS};
use super::table::{COLUMNS, LANE_COLUMNS, cells, lanes};
use crate::cli::html::{base64, escaped};
use octray::compare::AMPLIFY;
use std::fmt::Write;

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:92rem;margin:2rem auto;padding:0 1rem;color:#222}\
table{border-collapse:collapse;font-variant-numeric:tabular-nums;font-size:13px;display:block;overflow-x:auto}td,th{padding:.1rem .4rem;white-space:nowrap;\
text-align:right;border-bottom:1px solid #ddd}td:first-child,th:first-child,td:nth-child(2),th:nth-child(2){text-align:\
left}tr.first td{border-top:2px solid #bbb}tr.groups th{text-align:center;border-bottom:none;color:#555;\
border-left:8px solid #fff;border-right:8px solid #fff;background:#f1f3f5}img,svg{max-width:100%;height:auto}img{image-rendering:pixelated;display:block;margin:.3rem 0}\
h2{font-size:1.15rem;margin:2rem 0 .4rem}h3{font-size:1rem;margin:1.2rem 0 .2rem}.note{color:#555}";

/// Above the heads of [`COLUMNS`].
const GROUPS: &str = "<tr class=\"groups\"><th></th><th></th><th colspan=\"2\">speed</th><th colspan=\"4\">picture against strict</th>\
<th colspan=\"3\">t of camera hits</th><th colspan=\"3\">their point</th><th colspan=\"2\">camera hits</th>\
<th colspan=\"2\">with POV-Ray</th></tr>\n";

/// Plot, tables, pictures, machine.
pub fn page(run: &Run, plot: &str) -> String {
    let mut page = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>octray: speed against error</title>\
         <style>{STYLE}</style></head><body>\n<h1>Speed against error</h1>\n<p>{}.</p>\n{plot}\n<p class=\"note\">A \
         colour is a scene; f, e and s are octray's fast, exact and strict, 1 is exact with every ray walking the tree by itself, o the oracle, POV is POV-Ray, whose speed \
         is octray's number of rays over POV-Ray's time. Further right is faster, further down is nearer to strict; \
         the bottom line stands for no difference at all.</p>\n<h2>By scene and mode</h2>\n<p class=\"note\">Seconds \
         of tracing alone. Errors of pictures are in linear light; <em>t</em> is the relative error of the distance of \
         camera hits, <em>point</em> that of their place, as a share of the distance. <em>Within 2e-3</em>: share of \
         pixels off edges that are as near to POV-Ray's picture.</p>\n<table>{GROUPS}<tr><th>scene</th><th>mode</th>",
        escaped(&run.machine.told())
    );
    COLUMNS.iter().for_each(|column| page += &format!("<th>{column}</th>"));
    page += "</tr>\n";
    for scene in &run.scenes {
        for (number, mode) in scene.modes.iter().enumerate() {
            let class = if number == 0 { " class=\"first\"" } else { "" };
            // Writing to a string cannot fail.
            let _ = write!(page, "<tr{class}><td>{}</td><td>{}</td>", escaped(&scene.scene), mode.name);
            cells(mode).iter().for_each(|cell| page += &format!("<td>{cell}</td>"));
            page += "</tr>\n";
        }
    }
    page += "</table>\n";
    page += &ray_tables(run);
    page += &lane_table(run);
    let _ = writeln!(
        page,
        "<h2>Pictures</h2>\n<p class=\"note\">Strict, the difference times {AMPLIFY}, and fast; below POV-Ray's, the \
         difference times {AMPLIFY}, and exact.</p>"
    );
    for scene in &run.scenes {
        let _ = writeln!(
            page,
            "<h3>{}</h3>{}{}",
            escaped(&scene.scene),
            image(&scene.strip),
            scene.povray_strip.as_deref().map(image).unwrap_or_default()
        );
    }
    page + "</body></html>\n"
}

fn image(png: &[u8]) -> String {
    format!("<img alt=\"\" src=\"data:image/png;base64,{}\">", base64(png))
}

/// How many rays of each kind a picture takes, and how fast each kind is.
fn ray_tables(run: &Run) -> String {
    let mut tables = String::from(
        "<h2>Rays</h2>\n<p class=\"note\">Rays of exact by kind, in thousands.</p>\n<table><tr><th>scene</th><th></th>\
         <th>camera</th><th>shadow</th><th>reflected</th><th>refracted</th></tr>\n",
    );
    for scene in &run.scenes {
        let rays = &scene.rays;
        // Writing to a string cannot fail.
        let _ = write!(tables, "<tr><td>{}</td><td></td>", escaped(&scene.scene));
        for count in [rays.camera, rays.shadow, rays.reflect, rays.refract] {
            let _ = write!(tables, "<td>{:.1}</td>", count as f64 * 1e-3);
        }
        tables += "</tr>\n";
    }
    tables += "</table>\n<p class=\"note\">Millions of rays a second by kind, to their hits, without shading: a square of \
               camera rays, from their hits to the first light, mirrored there, and scattered there by the cosine; eight \
               at a time (packets) and one by one (single).</p>\n<table><tr><th>scene</th><th>mode</th>";
    KINDS.iter().for_each(|kind| {
        WALKS.iter().for_each(|(walk, _)| tables += &format!("<th>{kind}, {walk}</th>"));
    });
    tables += "</tr>\n";
    for scene in &run.scenes {
        for (number, walks) in scene.walks.chunks(WALKS.len()).enumerate() {
            let class = if number == 0 { " class=\"first\"" } else { "" };
            let precision = walks.first().map_or("", |walk| walk.precision);
            let _ = write!(tables, "<tr{class}><td>{}</td><td>{precision}</td>", escaped(&scene.scene));
            for kind in 0..KINDS.len() {
                for walk in walks {
                    let cell =
                        walk.mrays_per_s[kind].map_or_else(|| "-".into(), |speed| format!("{speed:.2}"));
                    let _ = write!(tables, "<td>{cell}</td>");
                }
            }
            tables += "</tr>\n";
        }
    }
    tables + "</table>\n"
}

/// How full the lanes are, where there are lanes.
fn lane_table(run: &Run) -> String {
    let mut table = String::from(
        "<h2>Lanes at work</h2>\n<p class=\"note\">Of eight, mean: in tests of boxes and of primitives in leaves, \
         and in the packets that leave the queues of rays and of hits. In single the tests are of eight boxes or \
         primitives against one ray.</p>\n<table><tr><th>scene</th><th>mode</th>",
    );
    LANE_COLUMNS.iter().for_each(|column| table += &format!("<th>{column}</th>"));
    table += "</tr>\n";
    for scene in &run.scenes {
        let modes = scene.modes.iter().filter(|mode| mode.occupancy.is_some());
        for (number, mode) in modes.enumerate() {
            let class = if number == 0 { " class=\"first\"" } else { "" };
            // Writing to a string cannot fail.
            let _ = write!(table, "<tr{class}><td>{}</td><td>{}</td>", escaped(&scene.scene), mode.name);
            for lanes in lanes(mode) {
                let cell = lanes.map_or_else(|| "-".into(), |lanes| format!("{lanes:.2}"));
                let _ = write!(table, "<td>{cell}</td>");
            }
            table += "</tr>\n";
        }
    }
    table + "</table>\n"
}
