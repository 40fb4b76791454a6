//! The command line: what was typed, and the failures that become exit codes.

mod chart;
mod check;
mod compare;
mod convert;
mod files;
mod peers;
mod plan;
mod png;
mod progress;
mod render;
mod schema;
mod stability;

use clap::{Parser, Subcommand};
use nephroid::scene::SceneErrors;
use std::path::PathBuf;

/// Caustics by two-pass photon mapping.
#[derive(Debug, Parser)]
#[command(name = "nephroid", version, about, arg_required_else_help = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Render a scene to a picture.
    Render(render::RenderArguments),
    /// Say what a render would run, what it would leave out, and why.
    Plan(plan::PlanArguments),
    /// Read a scene and report everything that is wrong with it.
    Check(check::CheckArguments),
    /// Measure how one picture differs from another.
    Compare(compare::CompareArguments),
    /// Chart the error of every method against its CPU time.
    Chart(chart::ChartArguments),
    /// Render the scenes in which methods of this kind break, by every method, and table what happened.
    Stability(stability::StabilityArguments),
    /// Turn a model in binary glTF into a scene file.
    Convert(convert::ConvertArguments),
    /// Print the JSON Schema of scene files.
    Schema(schema::SchemaArguments),
}

/// Runs what was typed.
pub(crate) fn run(arguments: Arguments) -> Result<(), Failure> {
    match arguments.command {
        Command::Render(arguments) => render::run(&arguments),
        Command::Plan(arguments) => plan::run(&arguments),
        Command::Check(arguments) => check::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Chart(arguments) => chart::run(&arguments),
        Command::Stability(arguments) => stability::run(&arguments),
        Command::Convert(arguments) => convert::run(&arguments),
        Command::Schema(arguments) => schema::run(&arguments),
    }
}

/// Why a command failed. Wrong usage is exit code 2, as for the arguments themselves.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Failure {
    /// The scene is wrong.
    #[error("{}", list_issues(.path, .errors))]
    Scene {
        /// The scene file.
        path: PathBuf,
        /// Everything wrong with it.
        errors: SceneErrors,
    },
    /// The model is wrong.
    #[error("{}: {error}", .path.display())]
    Model {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        error: nephroid::import::ImportError,
    },
    /// A file cannot be read or written, or an argument makes no sense.
    #[error("{0}")]
    Usage(String),
    /// Stopped by a signal; finished rounds were written.
    #[error("cancelled; rounds finished: {rounds}")]
    Cancelled {
        /// Rounds that are in the picture.
        rounds: u32,
    },
    /// The render failed.
    #[error("{0}")]
    Render(#[from] nephroid::render::RenderError),
    /// A scene cannot be charted.
    #[error("{0}")]
    Lab(nephroid::lab::LabError),
}

impl Failure {
    pub(crate) fn exit_code(&self) -> u8 {
        match self {
            Self::Scene { .. } | Self::Model { .. } => 1,
            Self::Usage(_) => 2,
            Self::Cancelled { .. } | Self::Render(_) | Self::Lab(_) => 3,
        }
    }
}

/// One line per issue: file, line and column, pointer, message.
fn list_issues(path: &std::path::Path, errors: &SceneErrors) -> String {
    let lines: Vec<String> = errors
        .issues
        .iter()
        .map(|issue| {
            let place = match issue.line {
                0 => path.display().to_string(),
                line => format!("{}:{line}:{}", path.display(), issue.column),
            };
            let pointer = if issue.pointer.is_empty() { "/" } else { &issue.pointer };
            format!("{place}: {pointer}: {} [{}]", issue.message, issue.code.as_str())
        })
        .collect();
    let count = errors.issues.len();
    let noun = if count == 1 { "error" } else { "errors" };
    format!("{}\n{count} {noun} in {}", lines.join("\n"), path.display())
}
