//! The Nephroid renderer as an asynchronous HTTP service: a JSON scene comes in, a picture is ready later.
//!
//! Read in this order:
//! - [`routes`]: every address on one screen; handlers convert, call and convert.
//! - [`wire`] and [`problem`]: what goes out, `body`: what comes in; [`openapi`]: both, as a document.
//! - `access`: who is asking. `request`: what happens to every request. [`serve()`]: connections.
//! - [`jobs`]: the database, the files and the thread that renders.
//! - [`engine`]: the joint to the renderer; `error_map` and `chart`: its error as pictures. `metrics`: numbers.
//! - [`samples`]: the embedded scenes. [`config`]: all settings.

mod access;
mod body;
mod chart;
pub mod config;
pub mod engine;
mod error_map;
pub mod jobs;
mod metrics;
pub mod openapi;
mod planner;
pub mod problem;
mod request;
pub mod routes;
pub mod samples;
mod serve;
pub mod wire;

pub use routes::router;
pub use serve::serve;

use access::Rates;
use body::Room;
use config::Settings;
use jobs::service::{Jobs, OpenError};
use metrics::Metrics;
use planner::Planner;
use std::sync::Arc;

/// What all handlers share.
#[derive(Clone, Debug)]
pub struct AppState {
    pub(crate) jobs: Arc<Jobs>,
    pub(crate) planner: Planner,
    pub(crate) metrics: Arc<Metrics>,
    pub(crate) rates: Arc<Rates>,
    /// For the scenes that are on their way in.
    pub(crate) room: Room,
    pub(crate) settings: Arc<Settings>,
}

impl AppState {
    /// Opens the data folder and starts to render what waits there. Waits for the disk: not to be called
    /// on a thread that serves.
    ///
    /// # Errors
    /// If the data folder, the database or the render threads cannot be used.
    pub fn open(settings: Settings) -> Result<Self, OpenError> {
        let (settings, metrics) = (Arc::new(settings), Arc::<Metrics>::default());
        let jobs = Arc::new(Jobs::open(&settings, Arc::clone(&metrics))?);
        let planner = Planner::new(Arc::clone(&settings))?;
        let (rates, room) = (Arc::new(Rates::new(&settings)), Room::new(settings.max_body));
        Ok(Self { jobs, planner, metrics, rates, room, settings })
    }
}
