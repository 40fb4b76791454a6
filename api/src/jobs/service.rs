//! All of the jobs for the handlers: submit, look, wait, cancel, delete, drain.

use super::answers::Answers;
use super::assets::{Assets, OwnAssets, Upload};
use super::attempt::Limits;
use super::deadlines::{self, NewDeadline};
use super::files::{Files, hex};
use super::keys::KeyTable;
use super::live::{Change, Progress, Registry};
use super::retention::{self, Policy};
use super::scheduler::{Scheduler, Wake};
use super::sql::{self, IdempotencyKey, NewJob, QueueLimits, Submitted};
use super::store::Store;
use super::watchdog::Watchdog;
use super::{Event, Job, JobId, JobState, Owner, StoreError, query};
use crate::config::Settings;
use crate::engine::LoadedScene;
use crate::metrics::Metrics;
use sha2::{Digest, Sha256};
use std::collections::HashMap;
use std::fs::{File, TryLockError};
use std::io;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use tokio::sync::broadcast;

/// Many times what a render takes to stop.
const STOP_TIME: Duration = Duration::from_secs(5);
/// Scenes up to this size go into the database: one wait for the disk instead of several.
const INLINE_SCENE: usize = 64 << 10;

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
    /// Whose it is.
    pub owner: Owner,
    /// What its owner calls it.
    pub label: Option<String>,
    /// After this time it is cancelled if it is not done.
    pub cancel_after: Option<Duration>,
    /// The client's own name for the request.
    pub idempotency_key: Option<String>,
}

/// What became of a submission.
#[derive(Debug)]
pub struct Accepted {
    /// The job.
    pub status: Status,
    /// True if the same request had made the job before.
    pub replayed: bool,
}

/// A job, and what is known of it since the database was written.
#[derive(Debug)]
pub struct Status {
    /// The job.
    pub job: Job,
    /// When it will be forgotten, in milliseconds since 1970, once it is done.
    pub expires_ms: Option<i64>,
    /// How far its render is, if it runs.
    pub progress: Option<Progress>,
    /// How many jobs are before it, if it waits.
    pub queue_position: Option<u32>,
    /// Seconds of rendering that a job takes, by those that have ended.
    pub seconds_per_job: f64,
}

/// The picture so far, or why there is none.
#[derive(Debug)]
pub enum PreviewState {
    /// PNG of the finished rounds.
    Ready(Arc<[u8]>),
    /// The job is done; here is its picture.
    Final(Vec<u8>),
    /// Nothing to see in this state.
    Nothing(JobState),
}

/// All jobs of this service.
#[derive(Debug)]
pub struct Jobs {
    pub(super) store: Store,
    pub(super) files: Files,
    pub(super) registry: Arc<Registry>,
    pub(super) answers: Answers,
    assets: Assets,
    keys: KeyTable,
    wake: mpsc::Sender<Wake>,
    new_deadline: mpsc::Sender<NewDeadline>,
    render_thread: Mutex<Option<JoinHandle<()>>>,
    queue_limits: QueueLimits,
    min_free: u64,
    pub(super) keep_age_ms: i64,
    /// Held as long as the data folder is in use.
    _lock: File,
}

impl Jobs {
    /// Opens the data folder, puts what had been running back into the queue and starts to render.
    pub fn open(settings: &Settings, metrics: Arc<Metrics>) -> Result<Self, OpenError> {
        let files = Files::new(settings.data.join("jobs"))?;
        let lock = lock_folder(settings)?;
        let store = Store::open(&settings.data.join("jobs.sqlite"))?;
        let recovered = {
            let most = settings.max_deaths;
            store.write_blocking(move |db| sql::recover(db, most, now_ms()))?
        };
        if recovered > 0 {
            tracing::warn!(recovered, "jobs had been running when the service ended");
        }
        files.sweep(&store.write_blocking(sql::ids)?)?;
        let assets = Assets::new(store.clone(), settings.data.join("assets"))?;
        let registry = Arc::<Registry>::default();
        let (wake, inbox) = mpsc::channel();
        let (ended, endings) = mpsc::channel();
        let scheduler = Scheduler {
            store: store.clone(),
            files: files.clone(),
            assets: assets.clone(),
            metrics: Arc::clone(&metrics),
            ended,
            registry: Arc::clone(&registry),
            pool: render_pool(settings)?,
            watchdog: Watchdog::start()?,
            concurrent: usize::from(settings.concurrent),
            limits: Limits {
                max_seconds: settings.max_seconds,
                max_memory: settings.max_memory as u64,
                max_photons: settings.max_photons,
            },
            running: Vec::new(),
            shares: HashMap::new(),
        };
        let thread =
            std::thread::Builder::new().name("render".into()).spawn(move || scheduler.run(&inbox))?;
        let policy =
            Policy { age: settings.keep_age, jobs: settings.keep_jobs, bytes: settings.keep_bytes as u64 };
        let (own_store, own_files, own_assets) = (store.clone(), files.clone(), assets.clone());
        std::thread::Builder::new()
            .name("retention".into())
            .spawn(move || retention::run(policy, &own_store, (&own_files, &own_assets), &endings))?;
        let new_deadline = deadlines::start(store.clone(), Arc::clone(&registry), metrics)?;
        Ok(Self {
            keys: KeyTable::new(store.clone()),
            store,
            files,
            registry,
            assets,
            answers: Answers::default(),
            wake,
            new_deadline,
            render_thread: Mutex::new(Some(thread)),
            queue_limits: QueueLimits { queued: settings.queue, unfinished: settings.jobs_per_key },
            min_free: settings.min_free as u64,
            keep_age_ms: retention::millis(settings.keep_age),
            _lock: lock,
        })
    }

    /// Takes a job; when this returns, it is on disk.
    pub async fn submit(&self, submission: Submission) -> Result<Accepted, StoreError> {
        self.require_room()?;
        let Submission { text, scene, owner, label, cancel_after, idempotency_key } = submission;
        let fingerprint = || hex(&Sha256::digest(text.as_bytes()));
        let idempotency = idempotency_key.map(|key| IdempotencyKey { key, fingerprint: fingerprint() });
        let id = JobId::fresh();
        let created_ms = now_ms();
        let cancel_ms = cancel_after.map(|time| created_ms.saturating_add(retention::millis(time)));
        let bytes = text.len() as u64;
        let inline = text.len() <= INLINE_SCENE;
        let job = NewJob {
            id,
            owner: owner.clone(),
            name: scene.name().to_owned(),
            label,
            size: scene.size(),
            created_ms,
            cancel_ms,
            scene: None,
            bytes,
            assets: scene.assets,
            idempotency,
        };
        let job =
            if inline { NewJob { scene: Some(text), ..job } } else { self.save_scene(id, text, job).await? };
        let limits = self.queue_limits;
        let insert = move |db: &rusqlite::Connection| {
            let submitted = sql::insert(db, &job, limits)?;
            let (Submitted::New(id, _) | Submitted::Replayed(id)) = submitted;
            Ok((submitted, query::get(db, &job.owner, id)?))
        };
        let submitted = self.store.write(insert).await;
        if !inline && !matches!(submitted, Ok((Submitted::New(..), _))) {
            self.files.remove(id);
        }
        match submitted? {
            (Submitted::New(id, before), job) => {
                self.registry.announce(id);
                // The render thread is gone only while the service drains.
                let _ = self.wake.send(Wake);
                if cancel_ms.is_some() {
                    let _ = self.new_deadline.send(NewDeadline);
                }
                let status = Status {
                    job,
                    expires_ms: None,
                    progress: None,
                    queue_position: Some(before),
                    seconds_per_job: self.seconds_per_job(),
                };
                Ok(Accepted { status, replayed: false })
            }
            (Submitted::Replayed(id), _) => {
                Ok(Accepted { status: self.status(&owner, id).await?, replayed: true })
            }
        }
    }

    async fn save_scene(&self, id: JobId, text: String, job: NewJob) -> Result<NewJob, StoreError> {
        let files = self.files.clone();
        let saving = tokio::task::spawn_blocking(move || files.save_scene(id, &text)).await;
        let Err(error) = saving.map_err(io::Error::other).flatten() else { return Ok(job) };
        tracing::error!(%error, "a scene could not be stored");
        self.files.remove(id);
        let full = error.kind() == io::ErrorKind::StorageFull;
        Err(if full { StoreError::StorageFull } else { StoreError::NotCommitted })
    }

    /// Refuses what is new while the disk is nearly full, so that what exists can be finished.
    pub(crate) fn require_room(&self) -> Result<(), StoreError> {
        match self.files.free_bytes() {
            Some(free) if free < self.min_free => Err(StoreError::StorageFull),
            _ => Ok(()),
        }
    }

    /// Seconds of rendering that a job takes, by those that have ended.
    pub(crate) fn seconds_per_job(&self) -> f64 {
        self.registry.seconds_per_job()
    }

    /// Cancels a job; one that is done stays as it is. True if it was not done.
    pub async fn cancel(&self, owner: &Owner, id: JobId) -> Result<bool, StoreError> {
        let whose = owner.clone();
        let cancel = move |db: &rusqlite::Connection| {
            query::get(db, &whose, id)?;
            sql::apply(db, id, Event::Cancel, None, now_ms())
        };
        match self.store.write(cancel).await {
            Ok(_) => {
                self.registry.stop(id);
                Ok(true)
            }
            Err(StoreError::IllegalMove(_)) => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// Cancels a job if it is not done, and forgets it.
    pub async fn delete(&self, owner: &Owner, id: JobId) -> Result<(), StoreError> {
        let mut changes = self.registry.listen();
        self.cancel(owner, id).await?;
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

    /// Calls out whatever changes from now on.
    pub(crate) fn listen(&self) -> broadcast::Receiver<Change> {
        self.registry.listen()
    }

    /// Begins to take an asset.
    pub(crate) fn begin_upload(&self, owner: Owner) -> Result<Upload, StoreError> {
        self.require_room()?;
        self.assets.begin_upload(owner).map_err(|error| {
            tracing::error!(%error, "an upload could not begin");
            StoreError::NotCommitted
        })
    }

    /// The file of an asset and its size.
    pub(crate) async fn asset(&self, owner: &Owner, sha256: String) -> Result<(PathBuf, u64), StoreError> {
        let (assets, owner) = (self.assets.clone(), owner.clone());
        let found = tokio::task::spawn_blocking(move || assets.find(&owner, &sha256)).await;
        found.map_err(|_| StoreError::NotCommitted)??.ok_or(StoreError::NotFound)
    }

    /// What the scenes of an owner may refer to.
    pub(crate) fn assets_of(&self, owner: Owner) -> OwnAssets {
        self.assets.of(owner)
    }

    /// Whose token this is.
    pub(crate) async fn owner_of(&self, token: &str) -> Result<Option<Owner>, StoreError> {
        self.keys.owner_of(token).await
    }

    /// True once a key was made.
    pub(crate) async fn has_keys(&self) -> Result<bool, StoreError> {
        self.keys.exist().await
    }

    /// How many jobs wait and how many run.
    pub(crate) async fn counts(&self) -> Result<(u32, u32), StoreError> {
        self.store.read(query::counts).await
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
pub(crate) async fn heard_of(changes: &mut broadcast::Receiver<Change>, id: JobId) {
    loop {
        match changes.recv().await {
            Ok(Change(other)) if other != id => {}
            Ok(_) | Err(broadcast::error::RecvError::Lagged(_)) => return,
            // Cannot happen while the registry lives; wait for the deadline.
            Err(broadcast::error::RecvError::Closed) => std::future::pending().await,
        }
    }
}

/// The threads that render.
fn render_pool(settings: &Settings) -> Result<rayon::ThreadPool, rayon::ThreadPoolBuildError> {
    let threads = settings.threads.map_or(0, usize::from);
    let name = |index| format!("render-{index}");
    rayon::ThreadPoolBuilder::new().num_threads(threads).thread_name(name).build()
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
