//! The command `nephroid-api`: read the settings, bind, serve until a signal; or make and revoke keys.

use clap::Parser;
use nephroid_api::AppState;
use nephroid_api::config::{Cli, Command, KeyAction, LogFormat, Settings};
use nephroid_api::jobs::KeyAdmin;
use std::error::Error;
use std::io::{IsTerminal, Read, Write};
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::process::ExitCode;
use std::time::Duration;
use tokio::signal::unix::{SignalKind, signal};
use tracing_subscriber::EnvFilter;

/// The service must not be started like this.
const REFUSED: u8 = 2;

/// Threads that wait for the disk. More would only wait for each other, and take memory: the database has one reader.
const BLOCKING_THREADS: usize = 128;

/// How long the health check waits for the service.
const PATIENCE: Duration = Duration::from_secs(3);

fn main() -> ExitCode {
    let done = match Cli::parse().into_command() {
        Command::Serve(settings) => serve(*settings),
        Command::Keys { data, action } => {
            KeyAdmin::open(&data).map_err(Into::into).and_then(|keys| manage(&keys, action))
        }
        Command::Ready { listen } => ask_ready(listen).map_err(Into::into),
        Command::Openapi => print(&nephroid_api::openapi::text()),
    };
    done.unwrap_or_else(|error| {
        eprintln!("nephroid-api: {error}");
        ExitCode::FAILURE
    })
}

fn serve(settings: Settings) -> Result<ExitCode, Box<dyn Error>> {
    let has_keys = KeyAdmin::open(&settings.data)?.list()?.iter().any(|key| key.revoked_ms.is_none());
    if let Some(refusal) = settings.refusal(has_keys) {
        eprintln!("nephroid-api: {refusal}");
        return Ok(ExitCode::from(REFUSED));
    }
    start_log(settings.log_format);
    let listener = TcpListener::bind(settings.listen)
        .map_err(|error| format!("cannot listen on {}: {error}", settings.listen))?;
    listener.set_nonblocking(true)?;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .max_blocking_threads(BLOCKING_THREADS)
        .build()?;
    // Before rendering starts, so that a signal from then on puts the jobs aside.
    let shutdown = runtime.block_on(async { stop_signal() })?;
    let state = AppState::open(settings)?;
    print(&format!("listening on http://{}\n", listener.local_addr()?))?;
    runtime.block_on(async { nephroid_api::serve(listener.try_into()?, state, shutdown).await })?;
    Ok(ExitCode::SUCCESS)
}

fn start_log(format: LogFormat) {
    let filter = EnvFilter::try_from_env("NEPHROID_LOG").unwrap_or_else(|_| EnvFilter::new("info"));
    let log = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr);
    match format {
        LogFormat::Text => log.with_ansi(std::io::stderr().is_terminal()).init(),
        LogFormat::Json => log.json().init(),
    }
}

fn manage(keys: &KeyAdmin, action: KeyAction) -> Result<ExitCode, Box<dyn Error>> {
    match action {
        KeyAction::Add { name } => print(&format!("{}\n", keys.add(&name)?)),
        KeyAction::List => {
            for key in keys.list()? {
                let state = if key.revoked_ms.is_some() { "revoked" } else { "active" };
                print(&format!("{}  {state:7}  {}\n", key.id, key.name))?;
            }
            Ok(ExitCode::SUCCESS)
        }
        KeyAction::Revoke { id } => {
            if keys.revoke(&id)? {
                return Ok(ExitCode::SUCCESS);
            }
            Err(format!("there is no key {id} in force").into())
        }
    }
}

/// The health check of the container, which has no other client in it.
fn ask_ready(mut listen: SocketAddr) -> std::io::Result<ExitCode> {
    if listen.ip().is_unspecified() {
        listen.set_ip(IpAddr::V4(Ipv4Addr::LOCALHOST));
    }
    let mut stream = TcpStream::connect_timeout(&listen, PATIENCE)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.write_all(b"GET /readyz HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n\r\n")?;
    let mut answer = [0; 12];
    stream.read_exact(&mut answer)?;
    Ok(if answer.ends_with(b" 200") { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn print(text: &str) -> Result<ExitCode, Box<dyn Error>> {
    let mut stdout = std::io::stdout();
    stdout.write_all(text.as_bytes())?;
    stdout.flush()?;
    Ok(ExitCode::SUCCESS)
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
