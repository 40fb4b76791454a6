//! The command `nephroid-api`: read the settings, bind, serve until a signal.

use clap::Parser;
use nephroid_api::AppState;
use nephroid_api::config::{Cli, Settings};
use std::error::Error;
use std::io::{IsTerminal, Write};
use std::net::TcpListener;
use std::process::ExitCode;
use tokio::signal::unix::{SignalKind, signal};
use tracing_subscriber::EnvFilter;

fn main() -> ExitCode {
    let settings = Cli::parse().into_settings();
    if let Some(refusal) = settings.refusal() {
        eprintln!("nephroid-api: {refusal}");
        return ExitCode::from(2);
    }
    let filter = EnvFilter::try_from_env("NEPHROID_LOG").unwrap_or_else(|_| EnvFilter::new("info"));
    let ansi = std::io::stderr().is_terminal();
    tracing_subscriber::fmt().with_env_filter(filter).with_ansi(ansi).with_writer(std::io::stderr).init();
    match run(settings) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("nephroid-api: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(settings: Settings) -> Result<(), Box<dyn Error>> {
    let listener = TcpListener::bind(settings.listen)
        .map_err(|error| format!("cannot listen on {}: {error}", settings.listen))?;
    listener.set_nonblocking(true)?;
    let runtime = tokio::runtime::Runtime::new()?;
    // Before rendering starts, so that a signal from then on puts the jobs aside.
    let shutdown = runtime.block_on(async { stop_signal() })?;
    let state = AppState::open(settings)?;
    let mut stdout = std::io::stdout();
    writeln!(stdout, "listening on http://{}", listener.local_addr()?)?;
    stdout.flush()?;
    runtime.block_on(async { nephroid_api::serve(listener.try_into()?, state, shutdown).await })?;
    Ok(())
}

/// Completes when the process is asked to end.
fn stop_signal() -> std::io::Result<impl Future<Output = ()>> {
    let (mut terminate, mut interrupt) = (signal(SignalKind::terminate())?, signal(SignalKind::interrupt())?);
    Ok(async move {
        tokio::select! {
            _ = terminate.recv() => {}
            _ = interrupt.recv() => {}
        }
    })
}
