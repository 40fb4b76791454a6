//! Connections: a bound on their number, a bound on their patience, and how they end.

use crate::access::Peer;
use crate::{AppState, router};
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::server::graceful::GracefulShutdown;
use hyper_util::service::TowerToHyperService;
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
    let room = Arc::new(Semaphore::new(state.settings.connections as usize));
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
