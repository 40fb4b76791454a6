//! The estimated error of a render against its time, as SVG: both axes logarithmic, so that power laws are straight.

use crate::jobs::Milestone;
use nephroid::lab::axis::{LogAxis, escaped, plain};
use nephroid::lab::svg::{INK, line, text};
use std::fmt::Write;

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 400.0;
/// Left, right, top and bottom of the plot.
const BOX: [f64; 4] = [72.0, 620.0, 56.0, 340.0];
const LINE: &str = "#b25a00";

/// Draws the history of the render of this name. Colours are attributes, so that no policy forbids them.
#[must_use]
pub(crate) fn draw(name: &str, history: &[Milestone]) -> String {
    let points: Vec<(f64, f64)> = history
        .iter()
        .map(|at| (at.seconds, f64::from(at.error)))
        .filter(|&(seconds, error)| seconds > 0.0 && error > 0.0 && error.is_finite())
        .collect();
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" width=\"{WIDTH}\" \
         height=\"{HEIGHT}\" role=\"img\" font-family=\"system-ui, sans-serif\" font-size=\"13\" fill=\"{INK}\">\n\
         <title>Estimated error of {name} against seconds of rendering</title>\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fffdf9\"/>\n",
        name = escaped(name)
    );
    text(&mut svg, (WIDTH / 2.0, 28.0), "middle", &escaped(name));
    if points.is_empty() {
        text(&mut svg, (WIDTH / 2.0, HEIGHT / 2.0), "middle", "No estimate of the error yet.");
    } else {
        plot(&mut svg, &points);
    }
    svg.push_str("</svg>\n");
    svg
}

fn plot(svg: &mut String, points: &[(f64, f64)]) {
    let [left, right, top, bottom] = BOX;
    let (x, y) = (
        LogAxis::around(points.iter().map(|p| p.0), left, right),
        LogAxis::around(points.iter().map(|p| p.1), bottom, top),
    );
    for tick in x.ticks() {
        line(svg, (x.at(tick), top), (x.at(tick), bottom));
        text(svg, (x.at(tick), bottom + 20.0), "middle", &format!("{} s", plain(tick)));
    }
    for tick in y.ticks() {
        line(svg, (left, y.at(tick)), (right, y.at(tick)));
        text(svg, (left - 8.0, y.at(tick) + 4.0), "end", &format!("{} %", plain(100.0 * tick)));
    }
    text(svg, (f64::midpoint(left, right), bottom + 44.0), "middle", "time spent rendering");
    let path: Vec<String> = points.iter().map(|p| format!("{:.1},{:.1}", x.at(p.0), y.at(p.1))).collect();
    let _ = writeln!(
        svg,
        "<polyline points=\"{}\" fill=\"none\" stroke=\"{LINE}\" stroke-width=\"2.5\" stroke-linejoin=\"round\"/>",
        path.join(" ")
    );
    for p in points {
        let _ = writeln!(
            svg,
            "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"3.5\" fill=\"{LINE}\"/>",
            x.at(p.0),
            y.at(p.1)
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(seconds: f64, error: f32) -> Milestone {
        Milestone { rounds: 1, seconds, error }
    }

    #[test]
    fn a_name_cannot_break_out_of_the_picture() {
        let svg = draw("<script>\u{1}\"&", &[]);
        assert!(svg.contains("&lt;script&gt;&quot;&amp;") && !svg.contains("<script"));
    }

    #[test]
    fn the_line_falls_from_left_to_right_within_the_axes() {
        let svg = draw("ball", &[at(0.1, 0.2), at(1.0, 0.06), at(9.0, 0.021)]);
        let points = svg.split("points=\"").nth(1).unwrap().split('"').next().unwrap();
        let points: Vec<Vec<f64>> =
            points.split(' ').map(|p| p.split(',').map(|v| v.parse().unwrap()).collect()).collect();
        assert!(points.is_sorted_by(|a, b| a[0] < b[0] && a[1] < b[1]), "{points:?}");
        assert!(points.iter().all(|p| p[0] > BOX[0] && p[0] < BOX[1] && p[1] > BOX[2] && p[1] < BOX[3]));
        assert!(svg.contains(">1 s<") && svg.contains(">10 %<"), "{svg}");
    }
}
