//! Speed against error: a line a scene, a point a mode.

use super::measure::{Measured, Mode};
use plotters::prelude::*;

const SIZE: (u32, u32) = (960, 600);

/// Errors are drawn from here on; what is less (`strict` against itself) stands on the bottom line.
const FLOOR: f64 = 1e-9;

/// Told apart on white; after the eighth scene they come again.
const COLORS: [RGBColor; 8] = [
    RGBColor(31, 90, 166),
    RGBColor(200, 60, 40),
    RGBColor(40, 130, 70),
    RGBColor(130, 60, 150),
    RGBColor(190, 125, 0),
    RGBColor(0, 130, 140),
    RGBColor(205, 70, 140),
    RGBColor(90, 90, 90),
];

/// Letters of the modes beside their points.
fn letter(mode: &str) -> &'static str {
    match mode {
        "fast" => "f",
        "exact" => "e",
        "strict" => "s",
        "single" => "1",
        "oracle" => "o",
        _ => "POV",
    }
}

/// Where the letter stands from its point: strict's below, where it does not meet exact's.
fn letter_offset(mode: &str) -> (i32, i32) {
    match mode {
        "exact" | "single" | "oracle" => (-3, -18),
        "strict" => (-3, 8),
        _ => (6, -6),
    }
}

/// An error as it is said.
fn told(error: f64) -> String {
    if error < FLOOR * 1.5 { "none".into() } else { format!("{error:.0e}") }
}

/// A speed as it is said: the axis' marks are products, 0.1 times 3 among them.
fn plain(x: f64) -> String {
    format!("{x:.3e}").parse::<f64>().unwrap_or(x).to_string()
}

/// Both axes are logarithmic. Fast, exact and strict are joined; the oracle and POV-Ray stand alone.
pub fn svg(scenes: &[Measured]) -> Result<String, String> {
    let points = || scenes.iter().flat_map(|scene| &scene.modes);
    let speeds = points().filter_map(|mode| mode.mrays_per_s).filter(|speed| *speed > 0.0);
    let (low, high) =
        speeds.fold((f64::INFINITY, 0.0f64), |(low, high), speed| (low.min(speed), high.max(speed)));
    if !(low <= high) {
        return Err("there is nothing to plot".into());
    }
    let worst = points().map(|mode| mode.against_strict.all.rmse).fold(1e-3, f64::max);
    let mut svg = String::new();
    // Room for the names of the scenes is beside the fastest.
    draw(&mut svg, scenes, low / 1.5..high * 4.0, FLOOR / 3.0..worst * 3.0)
        .map_err(|error| error.to_string())?;
    Ok(svg)
}

fn draw(
    svg: &mut String,
    scenes: &[Measured],
    speeds: std::ops::Range<f64>,
    errors: std::ops::Range<f64>,
) -> Result<(), Box<dyn std::error::Error>> {
    let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .margin(14)
        .x_label_area_size(46)
        .y_label_area_size(72)
        .build_cartesian_2d(speeds.log_scale(), errors.log_scale())?;
    chart
        .configure_mesh()
        .light_line_style(BLACK.mix(0.04))
        .bold_line_style(BLACK.mix(0.12))
        .x_desc("million rays a second (log)")
        .y_desc("rmse of the picture against strict (log)")
        .x_label_formatter(&|x| plain(*x))
        .y_label_formatter(&|y| told(*y))
        .label_style(("sans-serif", 14))
        .axis_desc_style(("sans-serif", 16))
        .draw()?;
    for (number, scene) in scenes.iter().enumerate() {
        let color = COLORS[number % COLORS.len()].to_rgba();
        let at = |mode: &Mode| Some((mode.mrays_per_s?, mode.against_strict.all.rmse.max(FLOOR)));
        let ours = scene.modes.iter().filter(|mode| ["fast", "exact", "strict"].contains(&mode.name));
        let ours = ours.filter_map(at);
        chart
            .draw_series(LineSeries::new(ours, color.mix(0.6).stroke_width(2)))?
            .label(scene.scene.as_str())
            .legend(move |(x, y)| Rectangle::new([(x, y - 5), (x + 14, y + 5)], color.filled()));
        let marks = scene.modes.iter().filter_map(|mode| Some((mode, at(mode)?)));
        chart.draw_series(marks.map(|(mode, at)| {
            EmptyElement::at(at)
                + Circle::new((0, 0), 4, color.filled())
                + Text::new(
                    letter(mode.name),
                    letter_offset(mode.name),
                    ("sans-serif", 13).into_font().color(&color),
                )
        }))?;
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.2))
        .label_font(("sans-serif", 14))
        .draw()?;
    root.present()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_of_the_axis_are_plain_numbers() {
        let marks = [(0.1 * 3.0, "0.3"), (0.001 * 7.0, "0.007"), (2.0, "2"), (40.0, "40")];
        for (x, expected) in marks {
            assert_eq!(plain(x), expected);
        }
    }
}
