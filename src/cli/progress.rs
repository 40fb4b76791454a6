//! What a render tells while it runs: a bar on a terminal, JSON lines, or nothing.

use super::files::say;
use indicatif::{ProgressBar, ProgressStyle};
use nephroid::render::{Render, RoundReport};
use nephroid::scene::Warning;
use serde_json::json;
use std::io::IsTerminal;

/// How progress is shown.
pub(super) enum Reporter {
    /// A bar on the terminal.
    Bar(ProgressBar),
    /// One JSON object per line on standard output.
    Json,
    /// Silence.
    Quiet,
}

/// The bar counts in thousandths.
const BAR_LENGTH: u64 = 1000;

impl Reporter {
    pub(super) fn new(json: bool, quiet: bool) -> Self {
        if json {
            return Self::Json;
        }
        if quiet || !std::io::stderr().is_terminal() {
            return Self::Quiet;
        }
        let bar = ProgressBar::new(BAR_LENGTH);
        if let Ok(style) =
            ProgressStyle::with_template("{bar:32} {percent:>3} %  {msg}  {elapsed} (left {eta})")
        {
            bar.set_style(style);
        }
        Self::Bar(bar)
    }

    pub(super) fn round(&self, render: &Render, report: &RoundReport) {
        match self {
            Self::Quiet => {}
            Self::Json => say(json!({
                "event": "round",
                "round": report.rounds,
                "error_estimate": report.error,
                "seconds": report.seconds,
                "progress": render.progress(),
            })),
            Self::Bar(bar) => {
                bar.set_position((f64::from(render.progress()) * BAR_LENGTH as f64) as u64);
                let error = report.error.map_or(String::new(), |e| format!(", error {:.2} %", 100.0 * e));
                bar.set_message(format!("round {}{error}", report.rounds));
            }
        }
    }

    pub(super) fn warning(&self, warning: &Warning) {
        match self {
            Self::Quiet => {}
            Self::Json => {
                let Warning { code, pointer, message } = warning;
                say(json!({ "event": "warning", "code": code, "pointer": pointer, "message": message }));
            }
            Self::Bar(bar) => bar.println(format!("warning: {warning}")),
        }
    }

    pub(super) fn done(&self, render: &Render, outputs: &[String]) {
        match self {
            Self::Quiet => {}
            Self::Json => say(json!({
                "event": "done",
                "rounds": render.rounds(),
                "stop_reason": render.stop_reason().map(|r| r.as_str()),
                "error_estimate": render.error_estimate(),
                "seconds": render.seconds(),
                "outputs": outputs,
            })),
            Self::Bar(bar) => {
                bar.finish_and_clear();
                let error = render.error_estimate().map_or(0.0, |e| 100.0 * e);
                say(format!(
                    "{}: {} rounds, estimated error {error:.2} %, {:.2} s",
                    outputs.join(", "),
                    render.rounds(),
                    render.seconds(),
                ));
            }
        }
    }
}
