//! All of the jobs for the handlers: submit, look, wait, cancel, delete, drain.

use super::attempt::Limits;
use super::files::{Files, hex};
use super::live::{Change, Progress, Registry};
use super::scheduler::{Scheduler, Wake};
use super::sql::{self, IdempotencyKey, NewJob, Submitted};
use super::store::Store;
use super::{Artifact, Event, Job, JobId, JobState, Page, StoreError};
use crate::config::Settings;
use crate::engine::LoadedScene;
use sha2::{Digest, Sha256};
use std::fs::{File, TryLockError};
use std::io;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use tokio::sync::broadcast;
use tokio::time::Instant;

/// Many times what a render takes to stop.
const STOP_TIME: Duration = Duration::from_secs(5);

/// Why the service could not start.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The data folder cannot be used.
    #[error("the data folder cannot be used: {0}")]
    Folder(#[from] io::Error),
    /// Another process uses the data folder.
    #[error("another nephroid-api uses the data folder {0}")]
    InUse(PathBuf),
    /// The database cannot be used.
    #[error("the job database cannot be used: {0}")]
    Store(#[from] StoreError),
    /// The threads that render could not be started.
    #[error("the render threads could not be started: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// A request to render.
#[derive(Debug)]
pub struct Submission {
    /// The scene as it came.
    pub text: String,
    /// The same, read.
    pub scene: LoadedScene,
    /// The client's own name for the request.
    pub idempotency_key: Option<String>,
}

/// A job, and what is known of it since the database was written.
#[derive(Debug)]
pub struct Status {
    /// The job.
    pub job: Job,
    /// How far its render is, if it runs.
    pub progress: Option<Progress>,
    /// How many jobs are before it, if it waits.
    pub queue_position: Option<u32>,
}

/// The picture so far, or why there is none.
#[derive(Debug)]
pub enum PreviewState {
    /// PNG of the finished rounds.
    Ready(Arc<[u8]>),
    /// The job is done; here is its picture.
    Final(PathBuf),
    /// Nothing to see in this state.
    Nothing(JobState),
}

/// All jobs of this service.
#[derive(Debug)]
pub struct Jobs {
    store: Store,
    files: Files,
    registry: Arc<Registry>,
    wake: mpsc::Sender<Wake>,
    render_thread: Mutex<Option<JoinHandle<()>>>,
    max_queue: u32,
    /// Held as long as the data folder is in use.
    _lock: File,
}

impl Jobs {
    /// Opens the data folder, puts what had been running back into the queue and starts to render.
    pub fn open(settings: &Settings) -> Result<Self, OpenError> {
        let files = Files::new(settings.data.join("jobs"))?;
        let lock = lock_folder(settings)?;
        let store = Store::open(&settings.data.join("jobs.sqlite"))?;
        let recovered = store.write_blocking(|db| sql::recover(db, now_ms()))?;
        if recovered > 0 {
            tracing::warn!(recovered, "jobs had been running when the service ended");
        }
        files.sweep(&store.write_blocking(sql::ids)?)?;
        let registry = Arc::<Registry>::default();
        let (wake, inbox) = mpsc::channel();
        let threads = settings.threads.map_or(0, usize::from);
        let name = |index| format!("render-{index}");
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).thread_name(name).build()?;
        let limits = Limits { max_seconds: settings.max_seconds, max_memory: settings.max_memory as u64 };
        let scheduler = Scheduler {
            store: store.clone(),
            files: files.clone(),
            registry: Arc::clone(&registry),
            pool,
            concurrent: usize::from(settings.concurrent),
            limits,
            running: Vec::new(),
        };
        let thread =
            std::thread::Builder::new().name("render".into()).spawn(move || scheduler.run(&inbox))?;
        let render_thread = Mutex::new(Some(thread));
        Ok(Self { store, files, registry, wake, render_thread, max_queue: settings.queue, _lock: lock })
    }

    /// Takes a job; when this returns, it is on disk. True if the same request had made the job before.
    pub async fn submit(&self, submission: Submission) -> Result<(JobId, bool), StoreError> {
        let Submission { text, scene, idempotency_key } = submission;
        let fingerprint = || hex(&Sha256::digest(text.as_bytes()));
        let idempotency = idempotency_key.map(|key| IdempotencyKey { key, fingerprint: fingerprint() });
        let id = JobId::fresh();
        let name = scene.name().to_owned();
        let job = NewJob { id, name, size: scene.size(), created_ms: now_ms(), idempotency };
        let files = self.files.clone();
        let saving = tokio::task::spawn_blocking(move || files.save_scene(id, &text));
        if let Err(error) = saving.await.map_err(io::Error::other).flatten() {
            tracing::error!(%error, "a scene could not be stored");
            self.files.remove(id);
            return Err(StoreError::NotCommitted);
        }
        let max_queue = self.max_queue;
        let submitted = self.store.write(move |db| sql::insert(db, &job, max_queue)).await;
        match submitted {
            Ok(Submitted::New(id)) => {
                self.registry.announce(id);
                // The render thread is gone only while the service drains.
                let _ = self.wake.send(Wake);
                Ok((id, false))
            }
            Ok(Submitted::Replayed(known)) => {
                self.files.remove(id);
                Ok((known, true))
            }
            Err(error) => {
                self.files.remove(id);
                Err(error)
            }
        }
    }

    /// A job and how far it is.
    pub async fn status(&self, id: JobId) -> Result<Status, StoreError> {
        // Looked up first: if the job ends in between, the database has the news.
        let live = self.registry.get(id);
        let find = move |db: &rusqlite::Connection| {
            let job = sql::get(db, id)?.ok_or(StoreError::NotFound)?;
            let waits = job.state == JobState::Queued;
            let position = waits.then(|| sql::queue_position(db, job.seq)).transpose()?;
            Ok((job, position))
        };
        let (job, queue_position) = self.store.read(find).await?;
        let progress = live.filter(|_| job.state == JobState::Running).map(|live| live.progress());
        Ok(Status { job, progress, queue_position })
    }

    /// The same, once the job is done or the time is over.
    pub async fn status_within(&self, id: JobId, wait: Duration) -> Result<Status, StoreError> {
        let deadline = Instant::now() + wait;
        let mut changes = self.registry.listen();
        loop {
            let status = self.status(id).await?;
            if status.job.state.is_done() || self.registry.is_draining() {
                return Ok(status);
            }
            if tokio::time::timeout_at(deadline, heard_of(&mut changes, id)).await.is_err() {
                return Ok(status);
            }
        }
    }

    /// Jobs, newest first.
    pub async fn list(&self, page: Page) -> Result<Vec<Status>, StoreError> {
        let jobs = self.store.read(move |db| sql::list(db, page)).await?;
        let status = |job: Job| {
            let live = self.registry.get(job.id).filter(|_| job.state == JobState::Running);
            Status { job, progress: live.map(|live| live.progress()), queue_position: None }
        };
        Ok(jobs.into_iter().map(status).collect())
    }

    /// Cancels a job; one that is done stays as it is.
    pub async fn cancel(&self, id: JobId) -> Result<(), StoreError> {
        let cancel = move |db: &rusqlite::Connection| sql::apply(db, id, Event::Cancel, None, now_ms());
        match self.store.write(cancel).await {
            Ok(_) => {
                if let Some(live) = self.registry.get(id) {
                    live.control.cancel();
                }
                self.registry.announce(id);
                Ok(())
            }
            Err(StoreError::IllegalMove(_)) => Ok(()),
            Err(error) => Err(error),
        }
    }

    /// Cancels a job if it is not done, and forgets it.
    pub async fn delete(&self, id: JobId) -> Result<(), StoreError> {
        let mut changes = self.registry.listen();
        self.cancel(id).await?;
        // While it still stops, it may write into its folder.
        while self.registry.get(id).is_some() {
            if tokio::time::timeout(STOP_TIME, heard_of(&mut changes, id)).await.is_err() {
                break;
            }
        }
        self.store.write(move |db| sql::delete(db, id)).await?;
        let files = self.files.clone();
        // What a crash leaves here is swept on the next start.
        drop(tokio::task::spawn_blocking(move || files.remove(id)).await);
        self.registry.announce(id);
        Ok(())
    }

    /// The file of a picture; `Err` holds the state of a job that has no such picture.
    pub async fn artifact(
        &self,
        id: JobId,
        name: &str,
    ) -> Result<Result<(Artifact, PathBuf), JobState>, StoreError> {
        let job = self.status(id).await?.job;
        let found = job.artifacts.into_iter().find(|artifact| artifact.name == name);
        Ok(found
            .map(|artifact| {
                let path = self.files.artifact_path(id, &artifact);
                (artifact, path)
            })
            .ok_or(job.state))
    }

    /// The scene of a job, as it came.
    pub async fn scene(&self, id: JobId) -> Result<String, StoreError> {
        self.status(id).await?;
        let files = self.files.clone();
        let read = tokio::task::spawn_blocking(move || files.scene(id)).await;
        // A job without its scene has just been deleted.
        read.ok().and_then(Result::ok).ok_or(StoreError::NotFound)
    }

    /// The picture so far.
    pub async fn preview(&self, id: JobId) -> Result<PreviewState, StoreError> {
        if let Some(preview) = self.registry.get(id).and_then(|live| live.preview()) {
            let encoded = tokio::task::spawn_blocking(move || preview.png()).await;
            return encoded.ok().flatten().map(PreviewState::Ready).ok_or(StoreError::NotCommitted);
        }
        Ok(match self.artifact(id, "image.png").await? {
            Ok((_, path)) => PreviewState::Final(path),
            Err(state) => PreviewState::Nothing(state),
        })
    }

    /// True once the service takes no more jobs.
    #[must_use]
    pub fn is_draining(&self) -> bool {
        self.registry.is_draining()
    }

    /// Takes no more jobs, puts aside what runs, and returns when that is on disk.
    pub async fn drain(&self) {
        self.registry.drain();
        let _ = self.wake.send(Wake);
        let thread = self.render_thread.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(thread) = thread {
            let joined = tokio::task::spawn_blocking(move || thread.join()).await;
            if !matches!(joined, Ok(Ok(()))) {
                tracing::error!("the render thread ended badly");
            }
        }
    }

    /// Whether the database answers.
    pub async fn is_healthy(&self) -> bool {
        self.store.write(|_| Ok(())).await.is_ok()
    }
}

/// Returns when something about this job, or an unknown number of jobs, is new.
async fn heard_of(changes: &mut broadcast::Receiver<Change>, id: JobId) {
    loop {
        match changes.recv().await {
            Ok(Change(other)) if other != id => {}
            Ok(_) | Err(broadcast::error::RecvError::Lagged(_)) => return,
            // Cannot happen while the registry lives; wait for the deadline.
            Err(broadcast::error::RecvError::Closed) => std::future::pending().await,
        }
    }
}

fn lock_folder(settings: &Settings) -> Result<File, OpenError> {
    let lock = File::create(settings.data.join("lock"))?;
    match lock.try_lock() {
        Ok(()) => Ok(lock),
        Err(TryLockError::WouldBlock) => Err(OpenError::InUse(settings.data.clone())),
        Err(TryLockError::Error(error)) => Err(error.into()),
    }
}

/// Milliseconds since 1970.
pub(super) fn now_ms() -> i64 {
    let elapsed = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    i64::try_from(elapsed.as_millis()).unwrap_or(i64::MAX)
}
