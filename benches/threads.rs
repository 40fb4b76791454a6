//! Whole renders with one thread and with two, in turn, as the command does them: `cargo bench --bench threads`.
//!
//! A ratio of clocks means something only while nothing else runs. Where something does, the clock of two threads tells how
//! many cores were left; what the second thread costs in CPU time, and how much of it both were given, tells more.

use std::process::{Command, Stdio};
use std::time::Instant;

/// The command, built as for a release.
const NEPHROID: &str = env!("CARGO_BIN_EXE_nephroid");

/// Turns of each side; the quickest counts: the others were disturbed.
const TURNS: usize = 5;

fn main() {
    println!("load when it began: {}", load());
    println!("| scene | 1 thread, clock s | 2 threads, clock s | ratio | CPU s, 1 thread | 2 threads | cores in use |");
    println!("|---|---|---|---|---|---|---|");
    for scene in ["glass-ball", "ring", "pool"] {
        let mut best = [Spent { clock: f64::INFINITY, cpu: 0.0 }; 2];
        for _ in 0..TURNS {
            for (best, threads) in best.iter_mut().zip(["1", "2"]) {
                let spent = render(scene, threads);
                if spent.clock < best.clock {
                    *best = spent;
                }
            }
        }
        let [one, two] = best;
        println!(
            "| {scene} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} |",
            one.clock,
            two.clock,
            one.clock / two.clock,
            one.cpu,
            two.cpu,
            two.cpu / two.clock
        );
    }
    println!("load when it ended: {}", load());
}

/// What a render took, s.
#[derive(Clone, Copy)]
struct Spent {
    clock: f64,
    cpu: f64,
}

fn render(scene: &str, threads: &str) -> Spent {
    let (start, before) = (Instant::now(), children_cpu());
    let status = Command::new(NEPHROID)
        .args(["render", &format!("scenes/{scene}.json"), "--rounds", "8", "--threads", threads])
        .args(["--quiet", "--output", "target/threads.png"])
        .stdin(Stdio::null())
        .status()
        .expect("the command starts");
    assert!(status.success(), "{scene}: {status}");
    Spent { clock: start.elapsed().as_secs_f64(), cpu: children_cpu() - before }
}

/// User and system time of all processes that were waited for, s; 0 where the system does not tell.
fn children_cpu() -> f64 {
    /// Ticks of Linux' accounting per second, on every machine that Rust runs on.
    const TICKS: f64 = 100.0;
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // After the name, which is in parentheses, cutime and cstime are the 14th and 15th.
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace();
    fields.skip(13).take(2).filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / TICKS
}

fn load() -> String {
    std::fs::read_to_string("/proc/loadavg").unwrap_or_else(|_| "unknown\n".to_owned()).trim().to_owned()
}
