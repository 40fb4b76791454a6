//! Connections: a bound on their number, a bound on their patience, and how they end.

use crate::access::Peer;
use crate::{AppState, router};
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::server::graceful::GracefulShutdown;
use hyper_util::service::TowerToHyperService;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use std::future::Future;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tower_http::add_extension::AddExtension;

/// How long open connections may finish their answers after the jobs are put aside.
const LAST_ANSWERS: Duration = Duration::from_secs(3);
/// Open files that the service needs for itself.
const OWN_FILES: u64 = 64;
/// A connection, and a picture or an asset that goes through it.
const FILES_PER_CONNECTION: u64 = 2;
/// Without room for another connection (too many open files), accepting is tried again after this time.
const ACCEPT_AGAIN: Duration = Duration::from_millis(100);

/// Serves until `shutdown`; then takes no more jobs, puts aside what runs and finishes its answers.
///
/// # Errors
/// None so far: a listener that fails is tried again.
pub async fn serve(
    listener: TcpListener,
    state: AppState,
    shutdown: impl Future<Output = ()> + Send,
) -> io::Result<()> {
    let jobs = Arc::clone(&state.jobs);
    let room = Arc::new(Semaphore::new(connections_within_reason(state.settings.connections)));
    let head_time = state.settings.head_time;
    let router = router(state);
    let graceful = GracefulShutdown::new();
    // While it drains, the service still answers: not ready, no new jobs.
    let drain = async {
        shutdown.await;
        tracing::info!("draining");
        jobs.drain().await;
    };
    tokio::pin!(drain);
    loop {
        let accepted = tokio::select! {
            accepted = accept(&listener, &room) => accepted,
            () = &mut drain => break,
        };
        let (stream, peer, permit) = accepted;
        let service = AddExtension::new(router.clone(), Peer(peer));
        let service = TowerToHyperService::new(tower_http::map_request_body::MapRequestBody::new(
            service,
            |body: Incoming| axum::body::Body::new(body),
        ));
        let connection = http1::Builder::new()
            .timer(TokioTimer::new())
            .header_read_timeout(head_time)
            .serve_connection(TokioIo::new(stream), service);
        let watched = graceful.watch(connection);
        tokio::spawn(async move {
            // A client that breaks the rules or the connection is no concern of anyone else's.
            if let Err(error) = watched.await {
                tracing::trace!(%error, "a connection broke");
            }
            drop(permit);
        });
    }
    drop(listener);
    // Whoever does not take the last answer in time goes without.
    let _ = tokio::time::timeout(LAST_ANSWERS, graceful.shutdown()).await;
    Ok(())
}

/// How many connections may be open at once: as many as wanted, if this process may open so many files. It asks for as
/// many as it can get, since many systems begin with 1024; what is left over is for pictures and the database, which
/// must not fail because of clients.
fn connections_within_reason(wanted: u32) -> usize {
    let limit = getrlimit(Resource::Nofile);
    // Where this is refused, the limit stays as it is.
    let _ = setrlimit(Resource::Nofile, Rlimit { current: limit.maximum, ..limit });
    let files = getrlimit(Resource::Nofile).current.unwrap_or(u64::MAX);
    let room = files.saturating_sub(OWN_FILES) / FILES_PER_CONNECTION;
    let most = u32::try_from(room).unwrap_or(u32::MAX).clamp(1, wanted.max(1));
    if most < wanted {
        tracing::warn!(wanted, most, files, "fewer connections than wanted: too few files may be open");
    }
    most as usize
}

/// The next connection, once there is room for it.
async fn accept(
    listener: &TcpListener,
    room: &Arc<Semaphore>,
) -> (TcpStream, SocketAddr, Option<OwnedSemaphorePermit>) {
    // The semaphore is never closed.
    let permit = Arc::clone(room).acquire_owned().await.ok();
    loop {
        match listener.accept().await {
            Ok((stream, peer)) => {
                // Answers are small and wanted at once.
                let _ = stream.set_nodelay(true);
                return (stream, peer, permit);
            }
            Err(error) => {
                tracing::warn!(%error, "a connection could not be accepted");
                tokio::time::sleep(ACCEPT_AGAIN).await;
            }
        }
    }
}
