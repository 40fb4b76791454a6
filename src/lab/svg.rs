//! A chart as SVG: both axes logarithmic, so that power laws are straight.

use super::axis::{LogAxis, escaped, plain};
use super::{Chart, Curve, Origin};
use std::fmt::Write;

const WIDTH: f64 = 1080.0;
const HEIGHT: f64 = 520.0;
/// Left, right, top and bottom of the plot; the legend stands to the right.
const BOX: [f64; 4] = [76.0, 640.0, 56.0, 456.0];
/// Colour of words and axes.
pub const INK: &str = "#1d2126";
/// Colour of the lines at the ticks.
pub const GRID: &str = "#d8d3c8";
/// Colours that stay apart for most eyes (Okabe and Ito), the default first.
pub(super) const COLOURS: [&str; 8] =
    ["#d55e00", "#0072b2", "#009e73", "#cc79a7", "#8a6d00", "#56b4e9", "#000000", "#7a7f87"];

/// Dashes of other renderers' lines.
const DASHES: &str = " stroke-dasharray=\"8 5\"";
/// Dashes of lines that were measured elsewhere.
const SHORT_DASHES: &str = " stroke-dasharray=\"2 4\"";

/// The chart as a picture; colours are attributes, so that no policy forbids them.
#[must_use]
pub fn draw(chart: &Chart) -> String {
    let title = escaped(&format!("{}: {}", chart.scene, chart.task.title()));
    let mut svg = head((WIDTH, HEIGHT), &format!("{title}: error against CPU seconds"));
    text(&mut svg, (BOX[0], 30.0), "start", &title);
    let all = || chart.curves.iter().flat_map(|curve| &curve.points);
    if all().next().is_none() {
        text(&mut svg, (BOX[0], 100.0), "start", "The reference tells no error.");
    } else {
        let x = LogAxis::around(all().map(|p| p.cpu).collect::<Vec<_>>().into_iter(), BOX[0], BOX[1]);
        let floor = chart.reference.floor();
        let errors: Vec<f64> = all().map(|p| p.error).chain([floor]).collect();
        let y = LogAxis::around(errors.into_iter(), BOX[3], BOX[2]);
        axes(&mut svg, &x, &y);
        floor_line(&mut svg, y.at(floor));
        let first =
            all().fold((f64::INFINITY, 0.0_f64), |(cpu, error), p| (cpu.min(p.cpu), error.max(p.error)));
        guide(&mut svg, first, (&x, &y));
        for (index, curve) in chart.curves.iter().enumerate() {
            draw_curve(&mut svg, curve, COLOURS[index % COLOURS.len()], (&x, &y));
        }
    }
    legend(&mut svg, &chart.curves);
    svg.push_str("</svg>\n");
    svg
}

/// The beginning of a picture of this size; colours are attributes, so that no policy forbids them.
pub(super) fn head((width, height): (f64, f64), title: &str) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
         height=\"{height}\" role=\"img\" font-family=\"system-ui, sans-serif\" font-size=\"14\" fill=\"{INK}\">\n\
         <title>{title}</title>\n<rect width=\"100%\" height=\"100%\" fill=\"#fffdf9\"/>\n"
    )
}

fn axes(svg: &mut String, x: &LogAxis, y: &LogAxis) {
    let [left, right, top, bottom] = BOX;
    for tick in x.ticks() {
        line(svg, (x.at(tick), top), (x.at(tick), bottom));
        text(svg, (x.at(tick), bottom + 20.0), "middle", &format!("{} s", plain(tick)));
    }
    for tick in y.ticks() {
        line(svg, (left, y.at(tick)), (right, y.at(tick)));
        text(svg, (left - 8.0, y.at(tick) + 4.0), "end", &format!("{} %", plain(100.0 * tick)));
    }
    let middle = f64::midpoint(left, right);
    text(svg, (middle, bottom + 44.0), "middle", "CPU seconds, all threads together");
    let words = "error: root mean square over the mean of the reference";
    text(svg, (left, top - 8.0), "start", words);
}

fn floor_line(svg: &mut String, y: f64) {
    let [left, right, ..] = BOX;
    let _ = writeln!(
        svg,
        "<line x1=\"{left}\" y1=\"{y:.1}\" x2=\"{right}\" y2=\"{y:.1}\" stroke=\"{INK}\" stroke-dasharray=\"2 5\"/>"
    );
    text(svg, (right + 16.0, y + 4.0), "start", "the least that the reference tells");
}

/// The rate of independent samples, from the upper left.
fn guide(svg: &mut String, (cpu, error): (f64, f64), (x, y): (&LogAxis, &LogAxis)) {
    let [left, right, top, bottom] = BOX;
    let at = |cpu_now: f64| (x.at(cpu_now), y.at(error * (cpu / cpu_now).sqrt()));
    // A straight line, followed in small steps to where it leaves the plot.
    let inside = |(x, y): (f64, f64)| (left..=right).contains(&x) && (top..=bottom).contains(&y);
    let places: Vec<(f64, f64)> =
        (0..400).map(|i| at(cpu * 10_f64.powf(f64::from(i) / 100.0))).take_while(|p| inside(*p)).collect();
    if let (Some(from), Some(to)) = (places.first(), places.last()) {
        let _ = writeln!(
            svg,
            "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"#a9a294\" stroke-dasharray=\"1 4\"/>",
            from.0, from.1, to.0, to.1
        );
        text(svg, (to.0 - 4.0, to.1 - 6.0), "end", "slope −½");
    }
}

fn dashes(curve: &Curve) -> &'static str {
    match curve.peer {
        None => "",
        Some(Origin::SameRun) => DASHES,
        Some(Origin::Stored(_)) => SHORT_DASHES,
    }
}

fn draw_curve(svg: &mut String, curve: &Curve, colour: &str, (x, y): (&LogAxis, &LogAxis)) {
    let places: Vec<(f64, f64)> = curve.points.iter().map(|p| (x.at(p.cpu), y.at(p.error))).collect();
    polyline(svg, &places, colour, dashes(curve));
}

/// Points and the lines between them.
pub(super) fn polyline(svg: &mut String, places: &[(f64, f64)], colour: &str, dashes: &str) {
    let path: Vec<String> = places.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
    let _ = writeln!(
        svg,
        "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2.5\" stroke-linejoin=\"round\"{dashes}/>",
        path.join(" ")
    );
    for (x, y) in places {
        let _ = writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\" fill=\"{colour}\"/>");
    }
}

/// One line per method, and its slope.
fn legend(svg: &mut String, curves: &[Curve]) {
    let left = BOX[1] + 16.0;
    for (index, curve) in curves.iter().enumerate() {
        let y = BOX[2] + 14.0 + 24.0 * index as f64;
        let colour = COLOURS[index % COLOURS.len()];
        let _ = writeln!(
            svg,
            "<line x1=\"{left}\" y1=\"{y}\" x2=\"{}\" y2=\"{y}\" stroke=\"{colour}\" stroke-width=\"3\"{}/>",
            left + 24.0,
            dashes(curve)
        );
        let slope = curve.slope().map_or_else(String::new, |slope| format!(", slope {slope:.2}"));
        let words = escaped(&format!("{}{slope}", curve.method.name));
        text(svg, (left + 32.0, y + 5.0), "start", &words);
    }
}

/// A line of the grid.
pub fn line(svg: &mut String, from: (f64, f64), to: (f64, f64)) {
    let _ = writeln!(
        svg,
        "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"{GRID}\"/>",
        from.0, from.1, to.0, to.1
    );
}

/// Words, escaped already.
pub fn text(svg: &mut String, (x, y): (f64, f64), anchor: &str, words: &str) {
    let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{words}</text>");
}
