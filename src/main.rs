//! `nephroid`: the renderer on the command line.

mod cli;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    match cli::run(cli::Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            #[expect(clippy::print_stderr, reason = "this is where a command reports its failure")]
            {
                eprintln!("{failure}");
            }
            ExitCode::from(failure.exit_code())
        }
    }
}
