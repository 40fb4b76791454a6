//! The table as one page that needs no other file.

use super::{Cell, Outcome, Row};
use crate::image_io::{LinearImage, encode_png};
use crate::lab::LabError;
use crate::lab::axis::escaped;
use crate::scene::{ImageSettings, Tone};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::fmt::Write;

const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;max-width:1200px;margin:2em auto;padding:0 1em;\
    color:#1d2126;background:#fffdf9}h2{font-size:1.05em;margin:1.6em 0 0}h2 b{color:#8a6d00}p{margin:0 0 .4em}\
    .cells{display:flex;flex-wrap:wrap;gap:.6em}.cell{width:8.6em;font-size:13px;line-height:1.35;overflow-wrap:anywhere;border-top:4px \
    solid #009e73;padding-top:.2em}.cell.soft{border-color:#56b4e9}.cell.warned{border-color:#e69f00}.cell.fault\
    {border-color:#d50000;background:#ffe9e4}.cell img{width:64px;height:64px;image-rendering:pixelated;\
    object-fit:contain;background:#000}.cell strong{display:block}";

/// The page.
///
/// # Errors
/// If a picture cannot be encoded.
pub fn page(rows: &[Row]) -> Result<String, LabError> {
    let mut html = format!(
        "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>Where methods fail</title>\
         <style>{STYLE}</style>\n<h1>Where methods fail</h1>\n"
    );
    summary(&mut html, rows);
    for row in rows {
        let case = &row.case;
        let _ = writeln!(
            html,
            "<h2><b>{}</b> {}</h2>\n<p>What breaks elsewhere: {}.</p>\n<div class=\"cells\">",
            escaped(case.rows),
            escaped(case.title),
            escaped(case.breaks)
        );
        let exposure = exposure(row);
        for cell in &row.cells {
            write_cell(&mut html, cell, exposure)?;
        }
        html.push_str("</div>\n");
    }
    html.push_str("</html>\n");
    Ok(html)
}

fn summary(html: &mut String, rows: &[Row]) {
    let cells = || rows.iter().flat_map(|row| &row.cells);
    let faults = cells().filter(|cell| cell.outcome.is_fault()).count();
    let _ = writeln!(
        html,
        "<p>{} scenes in which a method of this kind is known to break, each rendered by every method that can run it: \
         {} renders of several seeds. The error is that of the picture's mean against what is known, ± its standard \
         error; where nothing may be seen, the mean itself. Times are CPU seconds of one render, its plan included. <b>right</b>: \
         within its tolerance. <b>finite</b>: nothing more is known. <b>noisy</b>: too noisy to tell, and the render's own \
         estimate says so. <b>warned</b>: wrong, and the plan says so. <b>known limit</b>: wrong as the method is \
         documented to be. <b>refused</b>: no render, an error at the place in the scene. Anything else would be a fault: \
         there are {faults}.</p>",
        rows.len(),
        cells().count()
    );
    let mut counts: Vec<(&str, usize)> = Vec::new();
    for cell in cells() {
        let word = cell.outcome.word();
        match counts.iter_mut().find(|(known, _)| *known == word) {
            Some((_, count)) => *count += 1,
            None => counts.push((word, 1)),
        }
    }
    let words: Vec<String> = counts.iter().map(|(word, count)| format!("{count} {word}")).collect();
    let _ = writeln!(html, "<p>{}.</p>", words.join(", "));
}

/// Stops by which the pictures of a row are shown: all alike, the mean of the brightest at a middle grey.
fn exposure(row: &Row) -> f32 {
    let mean = |image: &LinearImage| {
        image.pixels.iter().map(|p| p[1].clamp(0.0, 1e6)).sum::<f32>() / image.pixels.len() as f32
    };
    let first = row.cells.iter().filter_map(|cell| cell.picture.as_ref()).map(mean).find(|mean| *mean > 0.0);
    first.map_or(0.0, |mean| (0.35 / mean).log2().clamp(-64.0, 64.0))
}

fn write_cell(html: &mut String, cell: &Cell, exposure: f32) -> Result<(), LabError> {
    let class = match cell.outcome {
        Outcome::Right | Outcome::Refused => "cell",
        Outcome::Finite | Outcome::Noisy | Outcome::Known(_) => "cell soft",
        Outcome::Warned => "cell warned",
        Outcome::Wrong | Outcome::Unwarned(_) | Outcome::NotRefused(_) | Outcome::Failed(_) => "cell fault",
    };
    let _ = write!(html, "<div class=\"{class}\">");
    if let Some(image) = &cell.picture {
        let settings =
            ImageSettings { width: image.width, height: image.height, exposure, tone: Tone::Linear };
        let png = STANDARD.encode(encode_png(image, &settings)?);
        let _ = write!(html, "<img alt=\"\" src=\"data:image/png;base64,{png}\">");
    }
    let _ = write!(html, "<strong>{}</strong>{}<br>", escaped(&cell.method), cell.outcome.word());
    if let (Some(error), Some(noise)) = (cell.error, cell.noise) {
        let _ = write!(html, "{:+.2} ± {:.2} %<br>", 100.0 * error, 100.0 * noise);
    } else if let Some(error) = cell.error {
        let _ = write!(html, "{:+.2} %<br>", 100.0 * error);
    }
    let _ = write!(html, "{:.3} s", cell.cpu);
    for note in cell.outcome.detail().iter().chain(&cell.warnings) {
        let _ = write!(html, "<br>{}", escaped(note));
    }
    html.push_str("</div>\n");
    Ok(())
}
