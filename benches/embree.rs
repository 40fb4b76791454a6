//! Rays against Embree on one thread: the same meshes and the same rays, in turn, by CPU time.
//!
//! `sh bench/embree/build.sh && cargo bench --bench embree`; without the yardstick only this library is timed. Embree is
//! asked ray by ray, as a path asks. Its plain test may lose rays at shared edges; its robust one, like this library's,
//! does not. `--quick` leaves out the largest meshes.
#![expect(clippy::print_stdout, reason = "the table is for whoever runs it")]

#[path = "common/meshes.rs"]
mod meshes;
#[path = "common/ray_sets.rs"]
mod ray_sets;

use cpu_time::ThreadTime;
use nephroid::geometry::{Geometry, GeometryBuilder, MeshData, Ray};
use nephroid::scene::ObjectId;
use ray_sets::{RaySet, SIZES};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{ChildStdin, ChildStdout, Command, Stdio};
use std::time::Duration;

/// The other side, if it is built.
const YARDSTICK: &str = "target/embree-yardstick";

/// Turns of each side; their median counts.
const TURNS: usize = 9;

/// The classes of rays, and how the yardstick is asked for them.
const CLASSES: [(&str, &str); 3] = [("primary", "closest 0"), ("bounce", "closest 1"), ("shadow", "any 2")];

/// Embree's plain test loses a few rays in a million at shared edges.
const LOST: f64 = 20e-6;

fn main() {
    let quick = std::env::args().any(|argument| argument == "--quick");
    if !Path::new(YARDSTICK).exists() {
        eprintln!(
            "embree: no {YARDSTICK}; sh bench/embree/build.sh makes it (Debian: apt-get install libembree-dev)"
        );
    }
    println!("| mesh | rays | Mray/s | Embree | ratio | Embree robust | ratio | Embree by 8 |");
    println!("|---|---|---|---|---|---|---|---|");
    let mut ratios = [Vec::new(), Vec::new()];
    for (size, cells) in SIZES.iter().filter(|(size, _)| !quick || *size != "1M") {
        for (name, mesh) in meshes::both(*cells) {
            compare(&format!("{name}{size}"), &mesh, &mut ratios);
        }
    }
    for (name, ratios) in ["Embree", "Embree robust"].iter().zip(ratios).filter(|(_, r)| !r.is_empty()) {
        let mean = (ratios.iter().map(|r: &f64| r.ln()).sum::<f64>() / ratios.len() as f64).exp();
        let (least, most) = ratios.iter().fold((f64::MAX, 0.0_f64), |(a, b), r| (a.min(*r), b.max(*r)));
        println!("rays per second against {name}: {least:.2} to {most:.2}, mean {mean:.2}");
    }
}

fn compare(name: &str, mesh: &MeshData, ratios: &mut [Vec<f64>; 2]) {
    let mut builder = GeometryBuilder::default();
    builder.mesh(ObjectId(0), mesh);
    let start = ThreadTime::now();
    let geometry = builder.build();
    let build = start.elapsed();
    let rays = RaySet::new(&geometry);
    let file = format!("target/{name}.rays");
    std::fs::write(&file, bytes(mesh, &rays)).expect("target can be written to");
    let mut others: Vec<Other> =
        ["plain", "robust"].iter().filter_map(|kind| Other::start(&file, kind)).collect();
    for (class, command) in CLASSES {
        let ours = || run(&geometry, &rays, class);
        let mut times = vec![Vec::new(); 4];
        for _ in 0..TURNS {
            let (hits, time) = ours();
            times[0].push(time);
            for (other, times) in others.iter_mut().zip(&mut times[1..]) {
                let (found, time) = other.run(command);
                assert!(
                    found.abs_diff(hits) as f64 <= 2.0 + LOST * rays.primary.len() as f64,
                    "{name} {class}: {hits} hits, Embree {found}"
                );
                times.push(time);
            }
            if class == "primary"
                && let [plain, _] = &mut others[..]
            {
                times[3].push(plain.run("closest8 0").1);
            }
        }
        let count = if class == "primary" { rays.primary.len() } else { rays.bounce.len() };
        let rates: Vec<Option<f64>> = times.into_iter().map(|times| rate(count, times)).collect();
        let ratio = |i: usize| Some(rates[0]? / rates[i]?);
        for (kept, ratio) in ratios.iter_mut().zip([ratio(1), ratio(2)]) {
            kept.extend(ratio);
        }
        let cells = [rates[0], rates[1], ratio(1), rates[2], ratio(2), rates[3]];
        println!("| {name} | {class} | {} |", cells.map(cell).join(" | "));
    }
    let seconds = |time: Duration| time.as_secs_f64() * 1e3;
    let theirs = others.first().map(|other| format!(", Embree {:.0} ms", seconds(other.build)));
    println!(
        "| {name} | build, CPU time | {:.0} ms{} | | | | | |",
        seconds(build),
        theirs.unwrap_or_default()
    );
}

fn cell(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| format!("{value:.2}"))
}

/// Millions of rays a second, by the median.
fn rate(count: usize, mut times: Vec<Duration>) -> Option<f64> {
    times.sort();
    Some(count as f64 / 1e6 / times.get(times.len() / 2)?.as_secs_f64())
}

/// Hits and CPU time.
fn run(geometry: &Geometry, rays: &RaySet, class: &str) -> (usize, Duration) {
    let start = ThreadTime::now();
    let closest = |rays: &[Ray]| rays.iter().filter(|ray| geometry.closest_hit(ray).is_some()).count();
    let hits = match class {
        "primary" => closest(&rays.primary),
        "bounce" => closest(&rays.bounce),
        _ => rays.shadow.iter().filter(|(ray, far)| geometry.any_hit(ray, *far)).count(),
    };
    (hits, start.elapsed())
}

/// What the yardstick reads.
fn bytes(mesh: &MeshData, rays: &RaySet) -> Vec<u8> {
    let mut bytes = Vec::new();
    let count = |bytes: &mut Vec<u8>, n: usize| bytes.extend((n as u32).to_le_bytes());
    count(&mut bytes, mesh.positions.len());
    bytes.extend(mesh.positions.iter().flat_map(|p| p.to_array()).flat_map(f32::to_le_bytes));
    count(&mut bytes, mesh.triangles.len());
    bytes.extend(mesh.triangles.iter().flatten().copied().flat_map(u32::to_le_bytes));
    let far = |rays: &[Ray]| rays.iter().map(|ray| (*ray, f32::INFINITY)).collect::<Vec<_>>();
    for set in [&far(&rays.primary), &far(&rays.bounce), &rays.shadow] {
        count(&mut bytes, set.len());
        for (ray, far) in set {
            let numbers = ray.origin.to_array().into_iter().chain(ray.direction.to_array()).chain([*far]);
            bytes.extend(numbers.flat_map(f32::to_le_bytes));
        }
    }
    bytes
}

/// The yardstick, waiting for commands.
struct Other {
    commands: ChildStdin,
    answers: BufReader<ChildStdout>,
    build: Duration,
}

impl Other {
    fn start(file: &str, kind: &str) -> Option<Self> {
        let mut child = Command::new(YARDSTICK)
            .args([file, kind])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .ok()?;
        let commands = child.stdin.take()?;
        let answers = BufReader::new(child.stdout.take()?);
        let mut other = Self { commands, answers, build: Duration::ZERO };
        let (_, time) = other.answer();
        Some(Self { build: time, ..other })
    }

    /// Number of hits and CPU time.
    fn run(&mut self, command: &str) -> (usize, Duration) {
        writeln!(self.commands, "{command}").expect("the yardstick listens");
        let (hits, time) = self.answer();
        (hits.parse().expect("a number of hits"), time)
    }

    fn answer(&mut self) -> (String, Duration) {
        let mut line = String::new();
        self.answers.read_line(&mut line).expect("the yardstick answers");
        let (word, time) = line.trim().split_once(' ').expect("two words");
        (word.to_owned(), Duration::from_nanos(time.parse().expect("nanoseconds")))
    }
}
