//! What the last benches found against what is stored in `bench/baseline.json`: nanoseconds of CPU time per ray, photon,
//! look-up, triangle or pixel. `cargo bench --bench baseline` after the others; with `-- --save` they become the baseline.
//!
//! Times of another machine tell little: the table says whose they are.
#![expect(clippy::print_stdout, reason = "the table is for whoever runs it")]

use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

const STORED: &str = "bench/baseline.json";

/// Where criterion leaves what it found.
const FOUND: &str = "target/criterion";

/// Beyond this the table points at a change: runs of the same binary differ by less, but for a few.
const NOTABLE: f64 = 0.1;

#[derive(Serialize, Deserialize)]
struct Baseline {
    machine: String,
    date: String,
    /// By name.
    nanoseconds: BTreeMap<String, f64>,
}

fn main() -> ExitCode {
    let mut found = BTreeMap::new();
    collect(Path::new(FOUND), &mut found);
    if found.is_empty() {
        eprintln!("baseline: nothing in {FOUND}; the other benches go first");
        return ExitCode::FAILURE;
    }
    if std::env::args().any(|argument| argument == "--save") {
        let baseline = Baseline { machine: machine(), date: date(), nanoseconds: found };
        let text = serde_json::to_string_pretty(&baseline).expect("numbers and strings are JSON");
        std::fs::write(STORED, text + "\n").expect("bench/ can be written to");
        println!("stored in {STORED}");
        return ExitCode::SUCCESS;
    }
    match std::fs::read_to_string(STORED) {
        Ok(text) => {
            compare(&serde_json::from_str(&text).expect("the baseline is as --save writes it"), &found)
        }
        Err(_) => println!("baseline: no {STORED}; `cargo bench --bench baseline -- --save` makes it"),
    }
    ExitCode::SUCCESS
}

fn compare(stored: &Baseline, found: &BTreeMap<String, f64>) {
    println!("stored on {} on {}; this is {}", stored.date, stored.machine, machine());
    println!("| bench | stored, ns | now, ns | now / stored | |");
    println!("|---|---|---|---|---|");
    let mut logarithms = Vec::new();
    for (name, now) in found {
        let Some(before) = stored.nanoseconds.get(name) else {
            println!("| {name} | | {now:.1} | | new |");
            continue;
        };
        let ratio = now / before;
        logarithms.push(ratio.ln());
        let note = if ratio > 1.0 + NOTABLE {
            "slower"
        } else if ratio < 1.0 / (1.0 + NOTABLE) {
            "faster"
        } else {
            ""
        };
        println!("| {name} | {before:.1} | {now:.1} | {ratio:.2} | {note} |");
    }
    let mean = (logarithms.iter().sum::<f64>() / logarithms.len().max(1) as f64).exp();
    println!("mean over {} benches: {mean:.2} times the stored time", logarithms.len());
}

/// Medians per element of every bench below a folder.
fn collect(folder: &Path, found: &mut BTreeMap<String, f64>) {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let below: Vec<PathBuf> = entries.map(|entry| entry.path()).filter(|path| path.is_dir()).collect();
    for path in below {
        match measured(&path.join("new")) {
            Some((name, nanoseconds)) => _ = found.insert(name, nanoseconds),
            None => collect(&path, found),
        }
    }
}

fn measured(folder: &Path) -> Option<(String, f64)> {
    let read = |name| -> Option<Value> {
        serde_json::from_str(&std::fs::read_to_string(folder.join(name)).ok()?).ok()
    };
    let (bench, estimates) = (read("benchmark.json")?, read("estimates.json")?);
    let elements = bench["throughput"]["Elements"].as_f64().unwrap_or(1.0);
    let nanoseconds = estimates["median"]["point_estimate"].as_f64()? / elements;
    // Four digits: more are noise.
    let rounded = format!("{nanoseconds:.3e}").parse().ok()?;
    Some((bench["full_id"].as_str()?.to_owned(), rounded))
}

fn machine() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model =
        text.lines().find_map(|line| Some(line.strip_prefix("model name")?.split_once(": ")?.1.trim()));
    let cores = std::thread::available_parallelism().map_or(0, usize::from);
    format!("{}, {cores} cores", model.unwrap_or(std::env::consts::ARCH))
}

/// Today, by the command that every system has.
fn date() -> String {
    let output = std::process::Command::new("date").arg("+%F").output();
    output.map_or_else(|_| "?".to_owned(), |output| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}
