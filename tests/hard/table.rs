//! The hard cases as a table: what is right, how far each way of rendering is off, and what POV-Ray makes of it.
//!
//! The table in `docs/hard-cases.md` is written by
//! `OCTRAY_HARD_TABLE=docs/hard-cases.md cargo test --release --test hard -- hard_cases --nocapture`,
//! with POV-Ray's column measured if `povray` is installed. Without the variable the cases are only held to their bounds.

use std::fmt::Write;

/// How one way of rendering fares.
pub struct Figure {
    pub way: &'static str,
    /// What was seen.
    pub said: String,
    /// What is allowed.
    pub bound: String,
    pub holds: bool,
}

/// One case.
pub struct Row {
    pub case: String,
    pub expected: String,
    /// In the order of `WAYS`.
    pub figures: [Figure; 4],
    /// `None` if POV-Ray was not asked.
    pub povray: Option<String>,
    /// Why no less is asked of `fast`, or of all.
    pub reason: String,
}

/// Where the table stands.
pub const DOCUMENT: &str = "docs/hard-cases.md";

/// Whether POV-Ray is to be asked.
pub fn is_written() -> bool {
    std::env::var_os("OCTRAY_HARD_TABLE").is_some()
}

/// One line of Markdown for each case, with each figure and the bound it is held to.
pub fn lines(rows: &[Row]) -> String {
    let mut text = String::from(
        "| case | right | fast | exact | strict | oracle | POV-Ray 3.7 | bounds of fast, and the others | why |\n|---|---|---|---|---|---|---|---|---|\n",
    );
    for row in rows {
        let _ = write!(text, "| {} | {} |", row.case, row.expected);
        for figure in &row.figures {
            let _ = write!(text, " {} |", figure.said);
        }
        let povray = row.povray.as_deref().unwrap_or("not asked");
        let [fast, exact, ..] = &row.figures;
        let _ = writeln!(text, " {povray} | {}; {} | {} |", fast.bound, exact.bound, row.reason);
    }
    text
}

/// What does not hold.
pub fn broken(rows: &[Row]) -> Vec<String> {
    let figures = rows.iter().flat_map(|row| row.figures.iter().map(move |figure| (row, figure)));
    figures
        .filter(|(_, figure)| !figure.holds)
        .map(|(row, figure)| format!("{}, {}: {} over {}", row.case, figure.way, figure.said, figure.bound))
        .collect()
}

/// The page, from its three tables.
pub fn document([pictures, rays, scripts]: &[String; 3]) -> String {
    format!(
        "# Hard cases\n\n\
         What is right, and how far each way of rendering is off. Written by the test that holds the figures to their bounds:\n\
         `OCTRAY_HARD_TABLE=docs/hard-cases.md cargo test --release --test hard -- hard_cases`, with POV-Ray's column from the\n\
         installed `povray`. `fast` computes in f32, `exact` in f64 with boxes in f32, `strict` in f64, boxes too; light is in f32\n\
         in all three. The oracle is the scalar f64 engine that asks every object. Bounds may only shrink.\n\n\
         ## Pictures of one colour\n\nThe largest error of any pixel and channel; 1 is another surface altogether.\n\n{pictures}\n\
         ## Rays\n\nRays lost or won, and the largest error of `t` as a share of it, against double-double. `on the outline`: lost \
         or won too\nwhen the shape grows or shrinks by eight roundings of the ray, in the precision at hand (POV-Ray: f64): the format cannot tell.\n\n{rays}\n\
         ## Numbers out of reach\n\n{scripts}"
    )
}
