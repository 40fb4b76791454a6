//! Reads and plans scenes for requests: beside the render thread, never on the I/O threads.

use crate::config::Settings;
use crate::engine::{LoadedScene, PlannedScene};
use crate::problem::Problem;
use serde_json::json;
use std::sync::Arc;
use tokio::sync::Semaphore;

/// Scenes that are read at once; more wait their turn, so that large ones do not add up in memory.
const AT_ONCE: usize = 2;

/// Reads and plans scenes.
#[derive(Clone, Debug)]
pub(crate) struct Planner {
    turns: Arc<Semaphore>,
    pool: Arc<rayon::ThreadPool>,
    max_pixels: u64,
    max_seconds: f64,
    max_memory: u64,
}

impl Planner {
    pub(crate) fn new(settings: &Settings) -> Result<Self, rayon::ThreadPoolBuildError> {
        // One thread: plans are small, and the cores belong to the renders.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).thread_name(|_| "plan".into()).build()?;
        Ok(Self {
            turns: Arc::new(Semaphore::new(AT_ONCE)),
            pool: Arc::new(pool),
            max_pixels: settings.max_pixels,
            max_seconds: settings.max_seconds,
            max_memory: settings.max_memory as u64,
        })
    }

    /// Reads a scene and holds it against the limits of a job; gives the text back with it.
    pub(crate) async fn read(&self, text: String) -> Result<(String, LoadedScene), Problem> {
        let planner = self.clone();
        self.run(move || planner.read_now(&text).map(|scene| (text, scene))).await
    }

    /// Reads a scene and plans it.
    pub(crate) async fn plan(&self, text: String) -> Result<PlannedScene, Problem> {
        let planner = self.clone();
        let work = move || {
            let scene = planner.read_now(&text)?;
            let planned = planner.pool.install(|| scene.plan());
            let (needed, limit) = (planned.memory_bytes(), planner.max_memory);
            if needed > limit {
                return Err(Problem::over_limit("/image", json!(needed), json!(limit), "bytes of memory"));
            }
            Ok(planned)
        };
        self.run(work).await
    }

    fn read_now(&self, text: &str) -> Result<LoadedScene, Problem> {
        let scene =
            LoadedScene::read(text, self.max_seconds).map_err(|issues| Problem::bad_scene(&issues))?;
        let [width, height] = scene.size().map(u64::from);
        if width * height > self.max_pixels {
            let (asked, limit) = (json!(width * height), json!(self.max_pixels));
            return Err(Problem::over_limit("/image", asked, limit, "pixels"));
        }
        if let Some(asked) = scene.asked_seconds.filter(|&asked| asked > self.max_seconds) {
            let (asked, limit) = (json!(asked), json!(self.max_seconds));
            return Err(Problem::over_limit("/render/stop/seconds", asked, limit, "seconds"));
        }
        Ok(scene)
    }

    async fn run<T, F>(&self, work: F) -> Result<T, Problem>
    where
        T: Send + 'static,
        F: FnOnce() -> Result<T, Problem> + Send + 'static,
    {
        let _turn = self.turns.acquire().await.map_err(Problem::internal)?;
        tokio::task::spawn_blocking(work).await.map_err(Problem::internal)?
    }
}
