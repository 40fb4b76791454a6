//! Time over the size of the work: primitives, photons, lights, pixels and threads.

use super::LabError;
use super::axis::{LogAxis, plain};
use super::svg::{self, COLOURS};
use crate::plan::Plan;
use crate::render::{Control, Render};
use crate::scene::{NoAssets, Scene};
use cpu_time::ProcessTime;
use serde_json::{Value, json};
use std::fmt::Write;
use std::sync::Arc;
use std::time::Instant;

/// The quicker of so many counts: the other was disturbed.
const REPEATS: usize = 2;

/// Times of one part of the work over its size.
#[derive(Clone, Debug)]
pub struct Series {
    /// The part.
    pub name: &'static str,
    /// Size and seconds.
    pub points: Vec<(f64, f64)>,
}

/// Times over one kind of size.
#[derive(Clone, Debug)]
pub struct Scaling {
    /// What grows.
    pub over: &'static str,
    /// What is rendered.
    pub scene: &'static str,
    /// What the times are: seconds of CPU time or of the clock.
    pub unit: &'static str,
    /// What theory lets expect.
    pub theory: &'static str,
    /// The parts.
    pub series: Vec<Series>,
}

/// Measures all. `most` bounds the sizes: 1 measures primitives to 10⁶, 0.01 to 10⁴.
///
/// # Errors
/// If a scene cannot be rendered.
pub fn measure_scaling(most: f64) -> Result<Vec<Scaling>, LabError> {
    Ok(vec![primitives(most)?, photons(most)?, lights(most)?, pixels(most)?, threads(most)?])
}

/// Powers of ten, and those in the middle between them.
fn sizes(from: f64, to: f64) -> impl Iterator<Item = f64> {
    (0..).map(move |i| from * 10_f64.powf(f64::from(i) / 2.0)).take_while(move |size| *size <= to * 1.001)
}

/// Time of reading, and of some rounds.
struct Spent {
    read: f64,
    cpu: f64,
    wall: f64,
    pass1: f64,
    pass2: f64,
}

fn spend(value: &Value, rounds: u32, change: impl Fn(&mut Plan)) -> Result<Spent, LabError> {
    let text = value.to_string();
    let mut best: Option<Spent> = None;
    for _ in 0..REPEATS {
        let start = ProcessTime::now();
        let scene = Arc::new(Scene::from_json(&text, &NoAssets)?);
        let read = start.elapsed().as_secs_f64();
        let (start, wall) = (ProcessTime::now(), Instant::now());
        let mut plan = Plan::new(&scene);
        change(&mut plan);
        let mut render = Render::new(scene, plan);
        for _ in 0..rounds {
            render.run_round(&Control::new())?;
        }
        let (cpu, wall) = (start.elapsed().as_secs_f64(), wall.elapsed().as_secs_f64());
        let stats = render.stats();
        let spent = Spent { read, cpu, wall, pass1: stats.pass1.cpu, pass2: stats.pass2.cpu };
        best = Some(match best {
            Some(best) if best.cpu <= spent.cpu => best,
            _ => spent,
        });
    }
    best.ok_or(LabError::NotAnObject)
}

/// A glass ball over a floor under one lamp.
fn scene(width: u32, height: u32) -> Value {
    json!({ "nephroid": 1, "image": { "width": width, "height": height },
        "camera": { "type": "perspective", "eye": [0, 2.4, 4.2], "target": [-0.3, 0.2, 0], "fov": 36 },
        "materials": { "floor": { "type": "diffuse", "albedo": [0.7, 0.7, 0.7] }, "glass": { "type": "glass", "ior": 1.5 } },
        "objects": [
            { "type": "polygon", "material": "floor", "vertices": [[-3, 0, 3], [3, 0, 3], [3, 0, -3], [-3, 0, -3]] },
            { "type": "sphere", "material": "glass", "center": [0, 0.55, 0], "radius": 0.5 } ],
        "lights": [{ "type": "quad", "center": [1.2, 3, 0.6], "size": [0.2, 0.2], "towards": [0, 0.55, 0], "radiance": [120, 120, 120] }] })
}

/// A hilly ground of about so many triangles, under one lamp; a list would take time in proportion.
fn primitives(most: f64) -> Result<Scaling, LabError> {
    let mut series =
        ["read and build", "render: bvh", "render: list"].map(|name| Series { name, points: Vec::new() });
    for size in sizes(100.0, 1e6 * most) {
        let side = (size / 2.0).sqrt().round() as usize;
        let height = |i: usize, j: usize| {
            let (x, z) = (i as f64 / side as f64, j as f64 / side as f64);
            let rounded = 0.1 * ((7.0 * x).sin() * (5.0 * z).cos() + 0.3 * (31.0 * x + 17.0 * z).sin());
            (rounded * 1e4).round() / 1e4
        };
        let heights: Vec<Vec<f64>> = (0..=side).map(|j| (0..=side).map(|i| height(i, j)).collect()).collect();
        let mut value = scene(120, 90);
        value["objects"] =
            json!([{ "type": "heightfield", "material": "floor", "size": [6, 6], "heights": heights }]);
        let count = (2 * side * side) as f64;
        for structure in ["bvh", "list"] {
            if structure == "list" && count > 1500.0 {
                continue;
            }
            value["render"] = json!({ "structure": structure });
            let spent = spend(&value, 4, |_| ())?;
            if structure == "bvh" {
                series[0].points.push((count, spent.read));
                series[1].points.push((count, spent.cpu));
            } else {
                series[2].points.push((count, spent.cpu));
            }
        }
    }
    Ok(Scaling {
        over: "triangles",
        scene: "hills, 120 × 90 pixels, 4 rounds",
        unit: "CPU seconds",
        theory: "a tree: log n per ray and n log n to build, once n is larger than the rays; a list: n per ray",
        series: series.into(),
    })
}

/// Photons per round and half, which pass 1 sends and pass 2 counts on the pixels.
fn photons(most: f64) -> Result<Scaling, LabError> {
    let mut series =
        ["pass 1: trace, tree", "pass 2: count, light"].map(|name| Series { name, points: Vec::new() });
    let value = scene(160, 120);
    for log2 in (10..=20).step_by(2).filter(|log2| 2_f64.powi(*log2) <= 1e6 * most.max(0.05) * 1.1) {
        let spent =
            spend(&value, 1, |plan| plan.photons.iter_mut().for_each(|b| b.log2_block = log2 as u32))?;
        let count = 2.0 * 2_f64.powi(log2);
        series[0].points.push((count, spent.pass1));
        series[1].points.push((count, spent.pass2));
    }
    Ok(Scaling {
        over: "photons",
        scene: "the glass ball, 160 × 120 pixels, 1 round of that many photons",
        unit: "CPU seconds",
        theory: "n to trace, n log n for the tree; counting grows with what lies on each pixel",
        series: series.into(),
    })
}

/// Lamps in a square grid over a floor, without caustics.
fn lights(most: f64) -> Result<Scaling, LabError> {
    let mut series = vec![Series { name: "render", points: Vec::new() }];
    for size in sizes(1.0, 1000.0 * most.max(0.1)) {
        let side = size.sqrt().round().max(1.0) as u32;
        let at = |k: u32| 5.0 * (f64::from(k) + 0.5) / f64::from(side) - 2.5;
        let power = 3.0 / f64::from(side * side);
        let lamps: Vec<Value> = (0..side * side)
            .map(|k| json!({ "type": "point", "position": [at(k % side), 2, at(k / side)], "intensity": [power, power, power] }))
            .collect();
        let mut value = scene(160, 120);
        value["lights"] = json!(lamps);
        value["render"] = json!({ "paths": "whitted" });
        series[0].points.push((f64::from(side * side), spend(&value, 4, |_| ())?.cpu));
    }
    Ok(Scaling {
        over: "lights",
        scene: "point lights over the glass ball, `whitted`, 160 × 120 pixels, 4 rounds",
        unit: "CPU seconds",
        theory: "n while each is asked; a few of them, log n, once a tree picks",
        series,
    })
}

fn pixels(most: f64) -> Result<Scaling, LabError> {
    let mut series = vec![Series { name: "render", points: Vec::new() }];
    for size in sizes(1000.0, 1e6 * most.max(0.01)) {
        let height = (size * 0.75).sqrt().round() as u32;
        let width = height * 4 / 3;
        let spent = spend(&scene(width, height), 4, |_| ())?;
        series[0].points.push((f64::from(width * height), spent.cpu));
    }
    Ok(Scaling {
        over: "pixels",
        scene: "the glass ball, 4 rounds, photons in proportion",
        unit: "CPU seconds",
        theory: "n",
        series,
    })
}

/// The same render on more threads, by the clock.
fn threads(most: f64) -> Result<Scaling, LabError> {
    let (width, height) = if most < 0.5 { (160, 120) } else { (400, 300) };
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let mut series = ["seconds by the clock", "CPU seconds"].map(|name| Series { name, points: Vec::new() });
    for count in (0..).map(|k| 1 << k).take_while(|count| *count <= cores) {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build();
        let Ok(pool) = pool else { break };
        let spent = pool.install(|| spend(&scene(width, height), 8, |_| ()))?;
        series[0].points.push((count as f64, spent.wall));
        series[1].points.push((count as f64, spent.cpu));
    }
    Ok(Scaling {
        over: "threads",
        scene: "the glass ball, 8 rounds",
        unit: "seconds",
        theory: "1/n by the clock, and CPU time that stays",
        series: series.into(),
    })
}

/// One chart: both axes logarithmic.
#[must_use]
pub fn draw(scaling: &Scaling) -> String {
    let (left, right, top, bottom) = (76.0, 560.0, 56.0, 356.0);
    let mut out = svg::head((800.0, 430.0), &format!("{}: {}", scaling.over, scaling.unit));
    svg::text(&mut out, (left, 28.0), "start", &format!("{} over {}", scaling.unit, scaling.over));
    svg::text(&mut out, (left, 46.0), "start", scaling.scene);
    let all = || scaling.series.iter().flat_map(|s| &s.points);
    if all().next().is_none() {
        out.push_str("</svg>\n");
        return out;
    }
    let x = LogAxis::around(all().map(|p| p.0).collect::<Vec<_>>().into_iter(), left, right);
    let y = LogAxis::around(all().map(|p| p.1).collect::<Vec<_>>().into_iter(), bottom, top);
    for tick in x.ticks() {
        svg::line(&mut out, (x.at(tick), top), (x.at(tick), bottom));
        svg::text(&mut out, (x.at(tick), bottom + 20.0), "middle", &count(tick));
    }
    for tick in y.ticks() {
        svg::line(&mut out, (left, y.at(tick)), (right, y.at(tick)));
        svg::text(&mut out, (left - 8.0, y.at(tick) + 4.0), "end", &format!("{} s", plain(tick)));
    }
    svg::text(&mut out, (f64::midpoint(left, right), bottom + 44.0), "middle", scaling.over);
    for (index, series) in scaling.series.iter().enumerate() {
        let colour = COLOURS[index % COLOURS.len()];
        let places: Vec<(f64, f64)> = series.points.iter().map(|p| (x.at(p.0), y.at(p.1))).collect();
        svg::polyline(&mut out, &places, colour, "");
        let at = top + 14.0 + 24.0 * index as f64;
        svg::polyline(&mut out, &[(right + 16.0, at), (right + 40.0, at)], colour, "");
        svg::text(&mut out, (right + 48.0, at + 5.0), "start", series.name);
    }
    out.push_str("</svg>\n");
    out
}

/// 1000000 as 10⁶.
fn count(value: f64) -> String {
    const RAISED: [&str; 10] = ["⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"];
    let power = value.log10();
    if value >= 1000.0 && (power - power.round()).abs() < 1e-9 {
        return format!("10{}", RAISED.get(power.round() as usize).unwrap_or(&"…"));
    }
    plain(value)
}

/// One line per time.
#[must_use]
pub fn csv(all: &[Scaling]) -> String {
    let mut text = "over,size,part,seconds\n".to_owned();
    for scaling in all {
        for series in &scaling.series {
            for (size, seconds) in &series.points {
                let _ = writeln!(text, "{},{size},\"{}\",{seconds:.5}", scaling.over, series.name);
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_half_decades_with_their_end() {
        let all: Vec<f64> = sizes(100.0, 1e4).map(f64::round).collect();
        assert_eq!(all, [100.0, 316.0, 1000.0, 3162.0, 10_000.0]);
        assert_eq!([100.0, 1000.0, 1e6].map(count), ["100", "10³", "10⁶"]);
    }
}
