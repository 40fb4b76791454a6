//! What is known of running jobs between two writes to the database: progress, preview, the stop signal.

use super::{JobId, Milestone};
use crate::engine::{Control, Picture};
use serde::Serialize;
use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use tokio::sync::broadcast;
use utoipa::ToSchema;

/// Changes that a slow listener may fall behind before it is told to look again.
const BACKLOG: usize = 256;

/// Something about this job is new: look again. A hint, never the news itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change(pub JobId);

/// What is being done for a job that runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// Finding out what the scene needs.
    #[default]
    Planning,
    /// Photons and eye rays.
    Rendering,
    /// Writing the pictures.
    Encoding,
}

/// How far a render is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Progress {
    /// What is being done.
    pub phase: Phase,
    /// Seconds spent rendering.
    pub seconds: f64,
    /// From 0 to 1, a guess from the rule that will end the render.
    pub fraction: f32,
    /// Rounds that are finished.
    pub rounds: u32,
    /// Estimated error after those.
    pub error_estimate: Option<f32>,
}

/// One running job.
#[derive(Debug, Default)]
pub(super) struct Live {
    /// Stops the round that runs.
    pub(super) control: Control,
    /// True once its time is over; its picture is then that of the rounds before.
    out_of_time: AtomicBool,
    /// True if somebody has looked at the picture since that was asked last.
    looked_at: AtomicBool,
    state: Mutex<LiveState>,
}

#[derive(Debug, Default)]
struct LiveState {
    progress: Progress,
    /// What the latest round added to the fraction: the guess for the one that runs.
    last_step: f32,
    history: Vec<Milestone>,
    preview: Option<Arc<Preview>>,
}

/// The picture after some rounds; encoded at most once, and only if somebody looks.
#[derive(Debug)]
pub(super) struct Preview {
    picture: Picture,
    png: OnceLock<Option<Arc<[u8]>>>,
}

impl Live {
    pub(super) fn round_finished(&self, progress: Progress) {
        let mut state = lock(&self.state);
        state.last_step = (progress.fraction - state.progress.fraction).max(0.0);
        state.progress = progress;
        let Some(error) = progress.error_estimate else { return };
        // The estimate is renewed at some rounds only.
        if state.history.last().is_none_or(|last| last.error != error && last.rounds < progress.rounds) {
            state.history.push(Milestone { rounds: progress.rounds, seconds: progress.seconds, error });
        }
    }

    /// The render goes on from a checkpoint.
    pub(super) fn resume(&self, history: Vec<Milestone>) {
        lock(&self.state).history = history;
    }

    pub(super) fn history(&self) -> Vec<Milestone> {
        lock(&self.state).history.clone()
    }

    pub(super) fn enter_phase(&self, phase: Phase) {
        lock(&self.state).progress.phase = phase;
    }

    pub(super) fn show(&self, picture: Picture) {
        lock(&self.state).preview = Some(Arc::new(Preview { picture, png: OnceLock::new() }));
    }

    pub(super) fn preview(&self) -> Option<Arc<Preview>> {
        self.looked_at.store(true, Ordering::Relaxed);
        lock(&self.state).preview.clone()
    }

    /// Whether somebody has looked at the picture since the last call.
    pub(super) fn was_looked_at(&self) -> bool {
        self.looked_at.swap(false, Ordering::Relaxed)
    }

    /// Stops the round that runs because the job has had its time.
    pub(super) fn end_its_time(&self) {
        self.out_of_time.store(true, Ordering::SeqCst);
        self.control.cancel();
    }

    pub(super) fn is_out_of_time(&self) -> bool {
        self.out_of_time.load(Ordering::SeqCst)
    }

    /// How far it is by now, the round that runs included.
    pub(super) fn progress(&self) -> Progress {
        let state = lock(&self.state);
        let guess = state.last_step * self.control.round_fraction();
        Progress { fraction: (state.progress.fraction + guess).clamp(0.0, 1.0), ..state.progress }
    }
}

impl Preview {
    /// The PNG; `None` if it cannot be encoded. Takes milliseconds the first time.
    pub(super) fn png(&self) -> Option<Arc<[u8]>> {
        self.png.get_or_init(|| self.picture.to_png().ok().map(Arc::from)).clone()
    }
}

/// All running jobs, and the place where changes are called out.
#[derive(Debug)]
pub(super) struct Registry {
    jobs: Mutex<HashMap<JobId, Arc<Live>>>,
    changes: broadcast::Sender<Change>,
    draining: AtomicBool,
    /// Seconds of rendering that a job takes, by those that have ended.
    pace: Mutex<f64>,
}

/// What a job is taken to need before any has ended, in seconds.
const FIRST_PACE: f64 = 1.0;
/// How much each job that ends moves what the next one is taken to need.
const PACE_WEIGHT: f64 = 0.25;

impl Default for Registry {
    fn default() -> Self {
        let (changes, _) = broadcast::channel(BACKLOG);
        Self {
            jobs: Mutex::default(),
            changes,
            draining: AtomicBool::new(false),
            pace: Mutex::new(FIRST_PACE),
        }
    }
}

impl Registry {
    pub(super) fn enter(&self, id: JobId) -> Arc<Live> {
        let live = Arc::new(Live::default());
        let mut jobs = lock(&self.jobs);
        jobs.insert(id, Arc::clone(&live));
        // Under the lock: either `drain` finds this job in the map, or it is seen here.
        if self.is_draining() {
            live.control.cancel();
        }
        live
    }

    pub(super) fn leave(&self, id: JobId) {
        lock(&self.jobs).remove(&id);
        self.announce(id);
    }

    /// Stops the round of a job that was cancelled, and calls it out.
    pub(super) fn stop(&self, id: JobId) {
        if let Some(live) = self.get(id) {
            live.control.cancel();
        }
        self.announce(id);
    }

    pub(super) fn get(&self, id: JobId) -> Option<Arc<Live>> {
        lock(&self.jobs).get(&id).cloned()
    }

    pub(super) fn announce(&self, id: JobId) {
        // Nobody may be listening; that is fine.
        drop(self.changes.send(Change(id)));
    }

    pub(super) fn listen(&self) -> broadcast::Receiver<Change> {
        self.changes.subscribe()
    }

    /// A job has ended after so many seconds of rendering.
    pub(super) fn job_took(&self, seconds: f64) {
        let mut pace = lock(&self.pace);
        *pace += PACE_WEIGHT * (seconds - *pace);
    }

    /// Seconds of rendering that a job takes, by those that have ended.
    pub(super) fn seconds_per_job(&self) -> f64 {
        *lock(&self.pace)
    }

    /// Stops every round that runs, so that the jobs can be put aside.
    pub(super) fn drain(&self) {
        self.draining.store(true, Ordering::SeqCst);
        lock(&self.jobs).values().for_each(|live| live.control.cancel());
    }

    pub(super) fn is_draining(&self) -> bool {
        self.draining.load(Ordering::SeqCst)
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // What is kept here is whole after every statement: a panic elsewhere does not spoil it.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pace_follows_the_jobs_that_end() {
        let registry = Registry::default();
        (0..40).for_each(|_| registry.job_took(20.0));
        assert!((registry.seconds_per_job() - 20.0).abs() < 0.1);
        registry.job_took(0.0);
        assert!(registry.seconds_per_job() > 10.0, "one small job says little of the next");
    }
}
