//! The command `nephroid-api`: read the settings, bind, serve until a signal.

use clap::Parser;
use nephroid_api::AppState;
use nephroid_api::config::{Cli, Settings};
use std::error::Error;
use std::io::Write;
use std::process::ExitCode;
use tokio::net::TcpListener;
use tokio::signal::unix::{SignalKind, signal};
use tracing_subscriber::EnvFilter;

fn main() -> ExitCode {
    let settings = Cli::parse().into_settings();
    if let Some(refusal) = settings.refusal() {
        eprintln!("nephroid-api: {refusal}");
        return ExitCode::from(2);
    }
    let filter = EnvFilter::try_from_env("NEPHROID_LOG").unwrap_or_else(|_| EnvFilter::new("info"));
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).init();
    match run(settings) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("nephroid-api: {error}");
            ExitCode::FAILURE
        }
    }
}

#[tokio::main]
async fn run(settings: Settings) -> Result<(), Box<dyn Error>> {
    // Before anything else, so that a signal during start is not lost.
    let (mut terminate, mut interrupt) = (signal(SignalKind::terminate())?, signal(SignalKind::interrupt())?);
    let listener = TcpListener::bind(settings.listen)
        .await
        .map_err(|error| format!("cannot listen on {}: {error}", settings.listen))?;
    let state = AppState::open(settings)?;
    let mut stdout = std::io::stdout();
    writeln!(stdout, "listening on http://{}", listener.local_addr()?)?;
    stdout.flush()?;
    let shutdown = async move {
        tokio::select! {
            _ = terminate.recv() => {}
            _ = interrupt.recv() => {}
        }
    };
    nephroid_api::serve(listener, state, shutdown).await?;
    Ok(())
}
