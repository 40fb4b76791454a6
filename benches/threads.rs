//! Whole renders with one thread and with two, in turn, as the command does them: `cargo bench --bench threads`.
//!
//! A ratio of clocks means something only while nothing else runs: the cores that two threads were given say whether. What
//! does not depend on it is how many threads wanted to run, in the mean over the render: two, but for what is done by one.
#![expect(clippy::print_stdout, reason = "the table is for whoever runs it")]

use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// The command, built as for a release.
const NEPHROID: &str = env!("CARGO_BIN_EXE_nephroid");

/// Turns of each side; the quickest counts: the others were disturbed.
const TURNS: usize = 3;

fn main() {
    println!("load when it began: {}", load());
    println!(
        "| scene | clock s, 1 thread | 2 | ratio | CPU s, 1 thread | 2 | cores given | threads at work |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for scene in ["glass-ball", "ring", "pool"] {
        let mut best = [Spent { clock: f64::INFINITY, cpu: 0.0, at_work: 0.0 }; 2];
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
            "| {scene} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} |",
            one.clock,
            two.clock,
            one.clock / two.clock,
            one.cpu,
            two.cpu,
            two.cpu / two.clock,
            two.at_work
        );
    }
    println!("load when it ended: {}", load());
}

/// What a render took.
#[derive(Clone, Copy)]
struct Spent {
    /// s.
    clock: f64,
    /// s.
    cpu: f64,
    /// Mean number of threads that ran or waited for a core.
    at_work: f64,
}

fn render(scene: &str, threads: &str) -> Spent {
    let (start, before) = (Instant::now(), children_cpu());
    let mut child = Command::new(NEPHROID)
        .args(["render", &format!("scenes/{scene}.json"), "--rounds", "4", "--threads", threads])
        .args(["--quiet", "--output", "target/threads.png"])
        .stdin(Stdio::null())
        .spawn()
        .expect("the command starts");
    let (mut at_work, mut looks) = (0, 0);
    let status = loop {
        if let Some(status) = child.try_wait().expect("the command is a child") {
            break status;
        }
        at_work += running(&child);
        looks += 1;
        std::thread::sleep(LOOK);
    };
    assert!(status.success(), "{scene}: {status}");
    Spent {
        clock: start.elapsed().as_secs_f64(),
        cpu: children_cpu() - before,
        at_work: f64::from(at_work) / f64::from(looks),
    }
}

/// Between two looks at the threads.
const LOOK: Duration = Duration::from_millis(2);

/// Number of its threads that run or wait for a core.
fn running(child: &Child) -> u32 {
    let threads = std::fs::read_dir(format!("/proc/{}/task", child.id())).into_iter().flatten().flatten();
    let runs = |stat: String| stat.rsplit(')').next().is_some_and(|fields| fields.starts_with(" R"));
    threads.map(|thread| u32::from(std::fs::read_to_string(thread.path().join("stat")).is_ok_and(runs))).sum()
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
