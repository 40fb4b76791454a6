//! The Nephroid renderer as an asynchronous HTTP service: a JSON scene comes in, a picture is ready later.
//!
//! Read in this order:
//! - [`routes`]: every address on one screen; handlers convert, call and convert.
//! - [`wire`] and [`problem`]: what goes out, [`body`]: what comes in.
//! - [`jobs`]: the database, the files and the thread that renders.
//! - [`engine`]: the joint to the renderer. [`samples`]: the embedded scenes. [`config`]: all settings.

pub mod body;
pub mod config;
pub mod engine;
pub mod jobs;
mod planner;
pub mod problem;
pub mod routes;
pub mod samples;
pub mod wire;

pub use routes::router;

use config::Settings;
use jobs::service::{Jobs, OpenError};
use planner::Planner;
use std::future::Future;
use std::io;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::TcpListener;

/// How long open connections may finish their answers after the jobs are put aside.
const LAST_ANSWERS: Duration = Duration::from_secs(3);

/// What all handlers share.
#[derive(Clone, Debug)]
pub struct AppState {
    pub(crate) jobs: Arc<Jobs>,
    pub(crate) planner: Planner,
    pub(crate) settings: Arc<Settings>,
}

impl AppState {
    /// Opens the data folder and starts to render what waits there. Waits for the disk: not to be called
    /// on a thread that serves.
    ///
    /// # Errors
    /// If the data folder, the database or the render threads cannot be used.
    pub fn open(settings: Settings) -> Result<Self, OpenError> {
        let jobs = Arc::new(Jobs::open(&settings)?);
        Ok(Self { jobs, planner: Planner::new(&settings)?, settings: Arc::new(settings) })
    }
}

/// Serves until `shutdown`; then takes no more jobs, puts aside what runs and finishes its answers.
///
/// # Errors
/// If the listener fails.
pub async fn serve(
    listener: TcpListener,
    state: AppState,
    shutdown: impl Future<Output = ()> + Send + 'static,
) -> io::Result<()> {
    let (drained, mut is_drained) = tokio::sync::watch::channel(false);
    let jobs = Arc::clone(&state.jobs);
    // While it drains, the service still answers: not ready, no new jobs.
    let drain = async move {
        shutdown.await;
        tracing::info!("draining");
        jobs.drain().await;
        drained.send_replace(true);
    };
    let server = axum::serve(listener, router(state)).with_graceful_shutdown(drain);
    let give_up = async {
        // An error means that the server, and with it the sender, has gone.
        if is_drained.wait_for(|drained| *drained).await.is_ok() {
            tokio::time::sleep(LAST_ANSWERS).await;
        }
    };
    tokio::select! {
        ended = server => ended,
        () = give_up => Ok(()),
    }
}
