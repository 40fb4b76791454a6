//! All charts on one page that needs no other file.

use super::axis::escaped;
use super::table::{LEVELS, SceneResults, end};
use super::{Chart, Curve, LabError, Origin, Reference, Scaling, Timing, scaling, svg};
use crate::compare::flip::ldr_flip;
use crate::image_io::{LinearImage, encode_png};
use crate::scene::ImageSettings;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::fmt::Write;

const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;max-width:1100px;margin:2em auto;padding:0 1em;\
    color:#1d2126;background:#fffdf9}svg{max-width:100%;height:auto}table{border-collapse:collapse;margin:1em 0}\
    td,th{padding:.25em .8em;border-bottom:1px solid #d8d3c8;text-align:right}td:first-child,th:first-child\
    {text-align:left}figure{display:inline-block;margin:0 1em 1em 0;max-width:320px;vertical-align:top}\
    figure img{width:100%}figcaption{font-size:14px}";

/// The page; `settings` say how a scene's pictures are developed.
///
/// # Errors
/// If a picture cannot be encoded.
pub fn page(results: &[(SceneResults, ImageSettings)], scalings: &[Scaling]) -> Result<String, LabError> {
    let mut html = format!(
        "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>Speed against accuracy</title>\
         <style>{STYLE}</style>\n<h1>Speed against accuracy</h1>\n<p>Each line is one method in one render that goes \
         on; its error is measured between rounds while the clock stands. CPU seconds hold the plan and all threads. \
         Slopes are least squares over the later half of the points: −0.5 is the rate of independent samples.</p>\n"
    );
    for (scene, settings) in results {
        let _ = writeln!(html, "<h2>{}</h2>", escaped(&scene.scene));
        for chart in &scene.charts {
            html.push_str(&svg::draw(chart));
            reference_words(&mut html, &chart.reference);
            times(&mut html, chart);
            pictures(&mut html, chart, settings)?;
        }
        structures(&mut html, &scene.timings);
        honesty(&mut html, scene);
    }
    growth(&mut html, scalings);
    html.push_str("</html>\n");
    Ok(html)
}

fn growth(html: &mut String, scalings: &[Scaling]) {
    if scalings.is_empty() {
        return;
    }
    html.push_str("<h2>Time over the size of the work</h2>\n");
    for measured in scalings {
        let _ = writeln!(html, "{}<p>Expected: {}.</p>", scaling::draw(measured), measured.theory);
    }
}

fn reference_words(html: &mut String, reference: &Reference) {
    let _ = write!(
        html,
        "<p>Reference: {}, {} rounds in {:.0} CPU seconds; its own standard error is {} of the mean. Known by two \
         independent halves it tells errors down to about {}; a line ends where it tells no more.",
        reference.estimator,
        reference.rounds,
        reference.cpu,
        percent(reference.error),
        percent(reference.floor())
    );
    if reference.mask.is_some() {
        html.push_str(" Pixels that show a lamp, straight, in a mirror or through glass, are left out.");
    }
    if let Some(rival) = &reference.rival {
        let _ = write!(
            html,
            " Tried beside it: {}, standard error {}; it differs from the reference by {}, its mean is {:.4} times \
             as large.",
            rival.estimator,
            percent(rival.error),
            percent(rival.difference),
            rival.mean_ratio
        );
    }
    html.push_str("</p>\n");
}

fn times(html: &mut String, chart: &Chart) {
    let heads: String = LEVELS.iter().map(|&level| format!("<th>{}</th>", percent(level))).collect();
    let _ = writeln!(
        html,
        "<table><tr><th>CPU seconds to an error of</th>{heads}<th>slope</th><th>end</th></tr>"
    );
    for curve in &chart.curves {
        let cells: String = LEVELS
            .iter()
            .map(|&level| match curve.time_to_reach(level) {
                // The first point is an upper bound: there is no smaller budget.
                Some(time) if curve.points.first().is_some_and(|p| p.error <= level) => {
                    format!("<td>≤ {time:.2}</td>")
                }
                Some(time) => format!("<td>{time:.2}</td>"),
                None => "<td>–</td>".to_owned(),
            })
            .collect();
        let slope = curve.slope().map_or_else(|| "–".to_owned(), |s| format!("{s:.2}"));
        let (name, why) = (escaped(&curve.method.name), escaped(&end(&curve.end)));
        let _ = writeln!(html, "<tr><td>{name}</td>{cells}<td>{slope}</td><td>{why}</td></tr>");
    }
    html.push_str("</table>\n");
}

fn pictures(html: &mut String, chart: &Chart, settings: &ImageSettings) -> Result<(), LabError> {
    html.push_str("<h3>At equal time</h3>\n");
    for curve in &chart.curves {
        picture(html, curve, chart, settings)?;
    }
    figure(html, &chart.reference.image, settings, "reference")
}

fn picture(
    html: &mut String,
    curve: &Curve,
    chart: &Chart,
    settings: &ImageSettings,
) -> Result<(), LabError> {
    let Some((point, image)) = &curve.picture else { return Ok(()) };
    let flip = ldr_flip(image, &chart.reference.image, settings)?.mean;
    let mut words = format!(
        "{}: {:.2} s, error {}, FLIP {flip:.3}",
        escaped(&curve.method.name),
        point.cpu,
        percent(point.error)
    );
    if curve.peer == Some(Origin::SameRun) {
        words.push_str(", rendered in the same run");
    }
    for warning in &curve.warnings {
        let _ = write!(words, "<br>{}", escaped(warning));
    }
    figure(html, image, settings, &words)
}

fn figure(
    html: &mut String,
    image: &LinearImage,
    settings: &ImageSettings,
    words: &str,
) -> Result<(), LabError> {
    let png = STANDARD.encode(encode_png(image, settings)?);
    let (w, h) = (image.width, image.height);
    let _ = writeln!(
        html,
        "<figure><img width=\"{w}\" height=\"{h}\" alt=\"\" src=\"data:image/png;base64,{png}\">\
         <figcaption>{words}</figcaption></figure>"
    );
    Ok(())
}

fn structures(html: &mut String, timings: &[Timing]) {
    if timings.is_empty() {
        return;
    }
    html.push_str(
        "<h3>Structures: plan and first round</h3>\n<table><tr><th>structure</th><th>CPU s</th></tr>\n",
    );
    for timing in timings {
        let _ = writeln!(html, "<tr><td>{}</td><td>{:.3}</td></tr>", timing.structure, timing.cpu);
    }
    html.push_str("</table>\n");
}

fn honesty(html: &mut String, scene: &SceneResults) {
    let Some((rows, own)) = &scene.honesty else { return };
    let _ = write!(
        html,
        "<h3>Renders that stop by their own estimate</h3>\n<p>Small pictures, many seeds. In this measure the reference's own error is {}, \
         and is taken off by its two halves.</p>",
        percent(*own)
    );
    html.push_str(
        "\n<table><tr><th>error asked for</th><th>stopped</th>\
         <th>within it</th><th>share</th><th>not reached</th><th>largest error</th><th>time over need</th></tr>\n",
    );
    for row in rows {
        let _ = writeln!(
            html,
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{:.2}</td></tr>",
            percent(row.target),
            row.stopped,
            row.within,
            row.share().map_or_else(|| "–".to_owned(), percent),
            row.not_reached,
            percent(row.worst),
            row.waste
        );
    }
    html.push_str("</table>\n");
}

fn percent(part: f64) -> String {
    format!("{} %", super::axis::plain((100.0 * part).max(1e-4)))
}
