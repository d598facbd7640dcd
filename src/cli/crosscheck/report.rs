//! The cross-check told: lines for a terminal, a page for a browser, JSON for programs.

use super::{Args, Figures, Row};
use crate::cli::Failure;
use crate::cli::html::{base64, escaped};
use crate::cli::paths::shortened;
use octray::compare::{AMPLIFY, EDGE_CONTRAST};
use octray::file_io::replace_file;
use std::fmt::Write;
use std::path::Path;

/// Above the lines.
pub const HEAD: &str = "\
scene                            octray s povray s  ratio      rmse   >1/255       max | off edges: <=2e-3      max  verdict";

/// Below the lines.
pub const FOOT: &str = "\
Seconds of tracing alone; ratio: how many times as long POV-Ray takes (~: POV-Ray's clock, in ms, is too coarse).
Light is linear. Off edges: pixels whose neighbours in POV-Ray's picture all differ by 0.02 or less.";

/// One scene's line.
pub fn line(row: &Row) -> String {
    let name = shortened(&row.scene, 32);
    let mut line = match &row.figures {
        Some(figures) => {
            let [octray, povray, ratio, rmse, over, max, within, off_max] = cells(figures);
            format!(
                "{name:32} {octray:>8} {povray:>8} {ratio:>6} {rmse:>9} {over:>8} {max:>9} | {within:>17} {off_max:>8}"
            )
        }
        None => format!("{name:32} -"),
    };
    if let Some(verdict) = &row.verdict {
        let _ = write!(line, "  {verdict}");
    }
    if let Some(why) = &row.failed {
        let _ = write!(line, "  FAILED: {why}");
    }
    line
}

/// In the columns' order.
fn cells(figures: &Figures) -> [String; 8] {
    let (all, off) = (&figures.comparison.all, &figures.comparison.off_edges);
    [
        format!("{:.3}", figures.octray_s),
        format!("{:.3}", figures.povray_s),
        figures.ratio(),
        format!("{:.1e}", all.rmse),
        format!("{:.3} %", all.over_1_255 * 100.0),
        format!("{:.1e}", all.max),
        format!("{:.3} %", off.within * 100.0),
        format!("{:.1e}", off.max),
    ]
}

/// Writes `index.html`, which holds everything it shows, the strips and `figures.json`.
pub fn write(folder: &Path, rows: &[Row], version: &str, args: &Args) -> Result<(), Failure> {
    replace_file(&folder.join("index.html"), page(rows, version, args).as_bytes())?;
    for row in rows.iter().filter(|row| is_shown(row, args)) {
        replace_file(&folder.join(strip_name(&row.scene)), &row.strip)?;
    }
    let json = serde_json::to_vec_pretty(rows).expect("plain numbers and names");
    Ok(replace_file(&folder.join("figures.json"), &json)?)
}

/// One name for each scene of a folder: of `scenes/show/glass.scn` it is `scenes-show-glass.scn.png`.
fn strip_name(scene: &str) -> String {
    let name = scene.trim_start_matches(['.', '/', '\\']).replace(['/', '\\', ':'], "-");
    format!("{name}.png")
}

/// Of random scenes only those that differ have strips.
fn is_shown(row: &Row, args: &Args) -> bool {
    !row.strip.is_empty() && (args.random.is_none() || !row.is_agreed())
}

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:76rem;margin:2rem auto;padding:0 1rem;color:#222}\
table{border-collapse:collapse;font-variant-numeric:tabular-nums}td,th{padding:.15rem .7rem;text-align:right;\
border-bottom:1px solid #ddd}td:first-child,th:first-child{text-align:left}.failed{color:#b00020}\
img{max-width:100%;image-rendering:pixelated}h2{font-size:1.1rem;margin:2rem 0 .3rem}";

fn page(rows: &[Row], version: &str, args: &Args) -> String {
    let mut page = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>octray cross-check</title>\
         <style>{STYLE}</style></head><body>\n<h1>octray {} against POV-Ray {}</h1>\n\
         <p>{}, without anti-aliasing; seconds of tracing alone. {}. Figures are in linear light; <em>ratio</em> says how many times as long POV-Ray takes (~: too quick for its \
         clock, which counts milliseconds). <em>Off edges</em> are the pixels whose neighbours in POV-Ray's picture \
         all differ by {EDGE_CONTRAST} or less. Strips show POV-Ray's picture, the difference times {AMPLIFY}, and \
         octray's picture.</p>\n<table><tr><th>scene</th><th>octray s</th><th>POV-Ray s</th><th>ratio</th>\
         <th>rmse</th><th>over 1/255</th><th>max</th><th>off edges, within 2e-3</th><th>off edges, max</th>\
         <th>verdict</th></tr>\n",
        env!("CARGO_PKG_VERSION"),
        escaped(version),
        args.terms(),
        super::verdict::counts(rows),
    );
    let shown = |row: &Row| row.failed.is_some() || is_shown(row, args);
    // Writing to a string cannot fail.
    for (index, row) in rows.iter().enumerate() {
        let class = if row.failed.is_some() { " class=\"failed\"" } else { "" };
        let name = escaped(&row.scene);
        let name = if shown(row) { format!("<a href=\"#s{index}\">{name}</a>") } else { name };
        let _ = write!(page, "<tr{class}><td>{name}</td>");
        match &row.figures {
            Some(figures) => cells(figures).iter().for_each(|cell| {
                let _ = write!(page, "<td>{cell}</td>");
            }),
            None => page.push_str("<td colspan=\"8\">no picture</td>"),
        }
        if let Some(verdict) = &row.verdict {
            let _ = write!(page, "<td>{}</td>", verdict.name());
        }
        page.push_str("</tr>\n");
    }
    page.push_str("</table>\n");
    for (index, row) in rows.iter().enumerate().filter(|(_, row)| shown(row)) {
        let _ = writeln!(page, "<h2 id=\"s{index}\">{}</h2>", escaped(&row.scene));
        if let Some(why) = &row.failed {
            let _ = writeln!(page, "<p class=\"failed\">{}</p>", escaped(why));
        }
        if let Some(verdict) = &row.verdict {
            let _ = writeln!(page, "<p>{}.</p>", escaped(&verdict.to_string()));
        }
        if let Some(worst) = row.figures.as_ref().and_then(|figures| figures.comparison.all.worst) {
            let _ = writeln!(
                page,
                "<p>Largest difference in column {}, row {}: expected {:?}, actual {:?}.</p>",
                worst.x, worst.y, worst.expected, worst.actual
            );
        }
        if !row.strip.is_empty() {
            let _ = writeln!(page, "<img alt=\"\" src=\"data:image/png;base64,{}\">", base64(&row.strip));
        }
    }
    page.push_str("</body></html>\n");
    page
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_and_its_namesake_have_strips_of_their_own() {
        assert_eq!(strip_name("./scenes/show/glass.scn"), "scenes-show-glass.scn.png");
        assert_ne!(strip_name("a.scn"), strip_name("a.pov"));
    }

    #[test]
    fn a_scene_that_failed_is_on_the_page_and_escaped() {
        let row = Row {
            scene: "<a>".into(),
            failed: Some("\"no\" & never".into()),
            figures: None,
            verdict: None,
            strip: vec![],
        };
        assert!(line(&row).ends_with("FAILED: \"no\" & never"));
    }
}
