//! `nephroid stability`: scenes in which methods break, rendered by every method.

use super::Failure;
use super::files::{cannot, save, say};
use clap::Args;
use nephroid::lab::stability::{Effort, Row, cases, csv, json, page, run_case};
use std::path::PathBuf;

#[derive(Args, Debug)]
pub(super) struct StabilityArguments {
    /// Folder for the page and the tables.
    #[arg(short, long, value_name = "DIR", default_value = "stability")]
    output: PathBuf,
    /// Renders of each scene by each method, of which the mean is judged.
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u64).range(2..=1000))]
    seeds: u64,
    /// Rounds of each render.
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u32).range(2..=4096))]
    rounds: u32,
    /// Only the failures of these numbers, as `F33`.
    #[arg(long, value_name = "FAILURE")]
    only: Vec<String>,
}

pub(super) fn run(arguments: &StabilityArguments) -> Result<(), Failure> {
    let folder = &arguments.output;
    std::fs::create_dir_all(folder).map_err(|e| cannot("make", folder, &e))?;
    let effort = Effort { seeds: arguments.seeds, rounds: arguments.rounds };
    let mut rows: Vec<Row> = Vec::new();
    for case in cases() {
        let asked = |number: &String| case.rows.split(", ").any(|row| row.eq_ignore_ascii_case(number));
        if !arguments.only.is_empty() && !arguments.only.iter().any(asked) {
            continue;
        }
        let row = run_case(&case, effort);
        for cell in row.cells.iter().filter(|cell| cell.outcome.is_fault()) {
            let detail = cell.outcome.detail().unwrap_or_default();
            let error = cell.error.map_or_else(String::new, |e| format!(", error {:.2} %", 100.0 * e));
            let noise = cell.noise.map_or_else(String::new, |e| format!(" ± {:.2} %", 100.0 * e));
            say(format!(
                "{} {}: {}: {}{error}{noise} {detail}",
                case.rows,
                case.title,
                cell.method,
                cell.outcome.word()
            ));
        }
        rows.push(row);
    }
    if rows.is_empty() {
        return Err(Failure::Usage("--only names no failure that has a case".to_owned()));
    }
    save(&folder.join("stability.csv"), csv(&rows).as_bytes())?;
    save(&folder.join("stability.json"), format!("{:#}\n", json(&rows)).as_bytes())?;
    save(&folder.join("index.html"), page(&rows).map_err(Failure::Lab)?.as_bytes())?;
    let faults = rows.iter().flat_map(|row| &row.cells).filter(|cell| cell.outcome.is_fault()).count();
    say(format!("{} scenes, {faults} faults; wrote {}", rows.len(), folder.join("index.html").display()));
    Ok(())
}
