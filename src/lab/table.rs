//! Charts as CSV and JSON.

use super::reference::mean_of;
use super::{Chart, Curve, End, Honesty, Origin, Reference, Rival, Scaling, Timing};
use crate::image_io::LinearImage;
use serde_json::{Value, json};
use std::fmt::Write;

/// The errors whose times are tabled.
pub const LEVELS: [f64; 4] = [0.1, 0.05, 0.02, 0.01];

/// What was found of one scene.
#[derive(Debug)]
pub struct SceneResults {
    /// The scene's name.
    pub scene: String,
    /// One per task that applies.
    pub charts: Vec<Chart>,
    /// Structures and their times.
    pub timings: Vec<Timing>,
    /// Renders that stopped by their own estimate, if that was asked for, and the reference's own error in their measure.
    pub honesty: Option<(Vec<Honesty>, f64)>,
}

/// One line per measurement.
#[must_use]
pub fn csv(results: &[&SceneResults]) -> String {
    let mut text = "scene,task,method,rounds,cpu_seconds,rel_rmse\n".to_owned();
    for chart in results.iter().flat_map(|r| &r.charts) {
        for curve in &chart.curves {
            for p in &curve.points {
                let (task, name) = (chart.task.name(), &curve.method.name);
                let _ = writeln!(
                    text,
                    "{},{task},\"{name}\",{},{:.4},{:.6}",
                    chart.scene, p.rounds, p.cpu, p.error
                );
            }
        }
    }
    text
}

/// Tables for a text: CPU seconds to each error, slopes, and the words that renders kept.
#[must_use]
pub fn markdown(results: &[&SceneResults]) -> String {
    let mut text = String::new();
    let heads: String = LEVELS.iter().map(|level| format!(" {} % |", 100.0 * level)).collect();
    for chart in results.iter().flat_map(|r| &r.charts) {
        let (own, least) = (100.0 * chart.reference.error, 100.0 * chart.reference.floor());
        let _ = writeln!(
            text,
            "### {}: {}\n\nReference: {}, its own error {own:.2} %; the least that it tells {least:.2} %.\n\n| CPU seconds to |{heads} slope | last error |\n|---|{}---|---|",
            chart.scene,
            chart.task.title(),
            chart.reference.estimator,
            "---|".repeat(LEVELS.len())
        );
        for curve in &chart.curves {
            let cells: String = LEVELS
                .iter()
                .map(|&level| {
                    curve.time_to_reach(level).map_or_else(|| " – |".to_owned(), |t| format!(" {t:.2} |"))
                })
                .collect();
            let slope = curve.slope().map_or_else(|| "–".to_owned(), |slope| format!("{slope:.2}"));
            let last = curve.points.last();
            let last = last
                .map_or_else(|| "–".to_owned(), |p| format!("{:.1} % at {:.1} s", 100.0 * p.error, p.cpu));
            let _ = writeln!(text, "| {} |{cells} {slope} | {last} |", curve.method.name);
        }
        text.push('\n');
    }
    for (scene, (rows, _)) in results.iter().filter_map(|r| Some((&r.scene, r.honesty.as_ref()?))) {
        let _ = writeln!(
            text,
            "### {scene}: renders that stop by their own estimate\n\n| asked | stopped | within | worst | time over need |\n|---|---|---|---|---|"
        );
        for row in rows {
            let (target, worst) = (100.0 * row.target, 100.0 * row.worst);
            let _ = writeln!(
                text,
                "| {target} % | {} | {} | {worst:.1} % | {:.2} |",
                row.stopped, row.within, row.waste
            );
        }
        text.push('\n');
    }
    text
}

/// Everything but the pictures.
#[must_use]
pub fn json(results: &[&SceneResults], scaling: &[Scaling]) -> Value {
    let of_scene = |r: &SceneResults| {
        let charts: Vec<Value> = r.charts.iter().map(chart_json).collect();
        let honesty: Vec<Value> = r.honesty.iter().flat_map(|(rows, _)| rows).map(honesty_json).collect();
        let structures: Vec<Value> =
            r.timings.iter().map(|t| json!({ "structure": t.structure, "cpu_seconds": t.cpu })).collect();
        json!({ "scene": r.scene, "charts": charts, "structures": structures, "honesty": honesty })
    };
    let of_scaling = |s: &Scaling| {
        let series: Vec<Value> =
            s.series.iter().map(|part| json!({ "part": part.name, "points": part.points })).collect();
        json!({ "over": s.over, "scene": s.scene, "unit": s.unit, "theory": s.theory, "series": series })
    };
    json!({ "scaling": scaling.iter().map(of_scaling).collect::<Vec<_>>(),
            "scenes": results.iter().copied().map(of_scene).collect::<Vec<_>>() })
}

fn chart_json(chart: &Chart) -> Value {
    json!({
        "task": chart.task.name(),
        "reference": reference_json(&chart.reference),
        "methods": chart.curves.iter().map(curve_json).collect::<Vec<_>>(),
    })
}

/// What is known of a reference, without its picture.
#[must_use]
pub fn reference_json(reference: &Reference) -> Value {
    let rival = reference.rival.as_ref().map(|r| {
        json!({ "estimator": r.estimator, "standard_error": r.error, "rel_rmse": r.difference,
                "mean_ratio": r.mean_ratio })
    });
    json!({
        "estimator": reference.estimator, "standard_error": reference.error,
        "relative_standard_error": reference.relative_error,
        "rounds": reference.rounds, "cpu_seconds": reference.cpu, "rival": rival,
    })
}

/// A reference that was written down, with its two halves; of all pixels.
#[must_use]
pub fn reference_from(json: &Value, halves: [LinearImage; 2]) -> Option<Reference> {
    let number = |value: &Value, key: &str| value[key].as_f64();
    let text = |value: &Value| Some(value["estimator"].as_str()?.to_owned());
    let rival = |r: &Value| {
        Some(Rival {
            estimator: text(r)?,
            error: number(r, "standard_error")?,
            difference: number(r, "rel_rmse")?,
            mean_ratio: number(r, "mean_ratio")?,
        })
    };
    Some(Reference {
        image: mean_of(&halves),
        halves,
        error: number(json, "standard_error")?,
        relative_error: number(json, "relative_standard_error")?,
        estimator: text(json)?,
        rounds: json["rounds"].as_u64()? as u32,
        cpu: number(json, "cpu_seconds")?,
        rival: rival(&json["rival"]),
        mask: None,
    })
}

fn curve_json(curve: &Curve) -> Value {
    let points: Vec<Value> = curve
        .points
        .iter()
        .map(|p| json!({ "rounds": p.rounds, "cpu_seconds": p.cpu, "rel_rmse": p.error }))
        .collect();
    let times: Vec<Value> = LEVELS
        .iter()
        .map(|&level| json!({ "rel_rmse": level, "cpu_seconds": curve.time_to_reach(level) }))
        .collect();
    json!({
        "method": curve.method.name, "settings": curve.method.settings, "points": points,
        "slope": curve.slope(), "time_to_reach": times, "end": end(&curve.end), "warnings": curve.warnings,
        "peer": curve.peer.as_ref().map(|origin| match origin { Origin::SameRun => "same run", Origin::Stored(words) => words }),
    })
}

/// Why a curve ends, in words.
#[must_use]
pub fn end(end: &End) -> String {
    match end {
        End::Time => "its time was up".to_owned(),
        End::Reference => "the reference cannot tell more".to_owned(),
        End::Measured => "there are no more pictures".to_owned(),
        End::Failed(error) => format!("it failed: {error}"),
    }
}

fn honesty_json(row: &Honesty) -> Value {
    json!({
        "target": row.target, "stopped": row.stopped, "within": row.within, "not_reached": row.not_reached,
        "worst": row.worst, "mean_waste": row.waste,
    })
}
