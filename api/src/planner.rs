//! Reads and plans scenes for requests: beside the render thread, never on the I/O threads.

use crate::config::Settings;
use crate::engine::{LoadedScene, PlannedScene, SceneFiles};
use crate::problem::Problem;
use serde_json::Value;
use std::sync::Arc;
use tokio::sync::Semaphore;

/// Scenes that are read at once; more wait their turn, so that large ones do not add up in memory.
const AT_ONCE: usize = 2;

/// Reads and plans scenes.
#[derive(Clone, Debug)]
pub(crate) struct Planner {
    turns: Arc<Semaphore>,
    pool: Arc<rayon::ThreadPool>,
    settings: Arc<Settings>,
}

impl Planner {
    pub(crate) fn new(settings: Arc<Settings>) -> Result<Self, rayon::ThreadPoolBuildError> {
        // One thread: plans are small, and the cores belong to the renders.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).thread_name(|_| "plan".into()).build()?;
        Ok(Self { turns: Arc::new(Semaphore::new(AT_ONCE)), pool: Arc::new(pool), settings })
    }

    /// Reads a scene and holds it against the limits of a job; gives the text back with it. One that may be too much is
    /// planned, to know.
    pub(crate) async fn read<F>(&self, text: String, files: F) -> Result<(String, LoadedScene), Problem>
    where
        F: SceneFiles + 'static,
    {
        let planner = self.clone();
        let work = move || {
            let scene = planner.read_now(&text, &files)?;
            let limits = &planner.settings;
            if scene.may_exceed(limits.max_memory as u64, limits.max_photons) {
                planner.plan_now(&scene)?;
            }
            Ok((text, scene))
        };
        self.run(work).await
    }

    /// Reads a scene and plans it.
    pub(crate) async fn plan<F>(&self, text: String, files: F) -> Result<PlannedScene, Problem>
    where
        F: SceneFiles + 'static,
    {
        let planner = self.clone();
        self.run(move || planner.plan_now(&planner.read_now(&text, &files)?)).await
    }

    fn plan_now(&self, scene: &LoadedScene) -> Result<PlannedScene, Problem> {
        let limits = &self.settings;
        let planned = self.pool.install(|| scene.plan());
        within("/image", planned.memory_bytes(), limits.max_memory as u64, "bytes of memory")?;
        within("/render", planned.photons_per_round(), limits.max_photons, "photons per round")?;
        Ok(planned)
    }

    fn read_now(&self, text: &str, files: &dyn SceneFiles) -> Result<LoadedScene, Problem> {
        let limits = &self.settings;
        let scene = LoadedScene::read(text, files, limits.max_seconds)
            .map_err(|issues| Problem::bad_scene(&issues))?;
        let [width, height] = scene.size().map(u64::from);
        within("/image", width * height, limits.max_pixels, "pixels")?;
        within("/objects", scene.primitives(), limits.max_primitives, "primitives")?;
        within("/lights", scene.lights(), limits.max_lights, "lights")?;
        within("/image", scene.least_memory_bytes(), limits.max_memory as u64, "bytes of memory")?;
        if let Some(asked) = scene.asked_seconds {
            within("/render/stop/seconds", asked, limits.max_seconds, "seconds")?;
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

fn within<T>(pointer: &str, asked: T, limit: T, what: &str) -> Result<(), Problem>
where
    T: PartialOrd + Into<Value>,
{
    if asked > limit { Err(Problem::over_limit(pointer, asked.into(), limit.into(), what)) } else { Ok(()) }
}
