//! The render thread: takes jobs from the queue and gives each running job one round at a time.
//!
//! The next round goes to the owner who has had the least time, and of that owner's running jobs to the one that
//! has had the least: small renders pass between the rounds of a long one, and many jobs of one key take no more
//! than one of another. Rounds use all threads of the pool; nothing else does.

use super::assets::Assets;
use super::attempt::{self, Attempt, Limits, Turn};
use super::files::Files;
use super::live::{Live, Registry};
use super::retention::Ended;
use super::sql::{self, Claim, Outcome};
use super::store::{Store, StoreError};
use super::watchdog::Watchdog;
use super::{Event, Failure, JobId, Owner, service::now_ms};
use crate::engine::PlannedScene;
use crate::metrics::Metrics;
use serde_json::Value;
use std::any::Any;
use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, mpsc};
use std::time::Duration;

/// After this time is tried again what the database or the disk refused.
const RETRY: Duration = Duration::from_secs(1);

/// Wakes the render thread: there is a new job, or it is time to stop.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wake;

/// The render thread's own things.
pub(super) struct Scheduler {
    pub(super) store: Store,
    pub(super) files: Files,
    pub(super) assets: Assets,
    pub(super) metrics: Arc<Metrics>,
    pub(super) ended: mpsc::Sender<Ended>,
    pub(super) registry: Arc<Registry>,
    pub(super) pool: rayon::ThreadPool,
    pub(super) watchdog: Watchdog,
    pub(super) concurrent: usize,
    pub(super) limits: Limits,
    pub(super) running: Vec<Attempt>,
    /// Seconds of rendering of each owner for whom something runs, counted from what the others had then.
    pub(super) shares: HashMap<Owner, f64>,
}

impl Scheduler {
    /// Renders until the service drains; then puts aside what runs.
    pub(super) fn run(mut self, inbox: &mpsc::Receiver<Wake>) {
        while !self.registry.is_draining() {
            self.admit();
            match self.neediest() {
                Some(index) => self.give_turn(index),
                // A wake that came since `admit` is still in the inbox; without one, the database is asked again.
                None => match inbox.recv_timeout(RETRY) {
                    Err(mpsc::RecvTimeoutError::Disconnected) => break,
                    _ => while inbox.try_recv().is_ok() {},
                },
            }
        }
        self.put_all_aside();
    }

    fn admit(&mut self) {
        while self.running.len() < self.concurrent && !self.registry.is_draining() {
            // If this is taken back by a crash, the job waits still; what this attempt made is then refused.
            match self.store.write_early(|db| sql::claim(db, now_ms())) {
                Ok(Some(job)) => self.begin(job),
                Ok(None) => return,
                Err(error) => {
                    tracing::error!(%error, "no job could be taken from the queue");
                    return;
                }
            }
        }
    }

    fn begin(&mut self, claim: Claim) {
        let (id, fence, owner) = (claim.id, claim.attempt, claim.owner.clone());
        // If it runs already, the claim of that attempt was not committed, and its result would be refused.
        if let Some(index) = self.running.iter().position(|attempt| attempt.id == id) {
            self.remove(index);
        }
        let live = self.registry.enter(id);
        self.registry.announce(id);
        let begun = self.prepare(&claim).and_then(|(planned, report)| {
            self.record_plan(&claim, &live, report);
            guarded(|| Attempt::begin(claim, planned, live, &self.files))
        });
        match begun {
            Ok(mut attempt) => {
                let least = self.running.iter().map(|rival| rival.share).reduce(f64::min);
                attempt.share = least.unwrap_or(0.0);
                let others = self.shares.values().copied().reduce(f64::min).unwrap_or(0.0);
                self.shares.entry(owner).or_insert(others);
                self.running.push(attempt);
                tracing::info!(job = %id, attempt = fence, "started");
            }
            Err(failure) => self.conclude((id, fence), Err(failure)),
        }
    }

    /// Nobody waits for it. Where it is refused, the job was cancelled before it was seen to run, or its claim was not
    /// committed: the render stops.
    fn record_plan(&self, claim: &Claim, live: &Arc<Live>, report: Value) {
        let (id, fence, live) = (claim.id, claim.attempt, Arc::clone(live));
        let record = move |db: &rusqlite::Connection| {
            sql::record_plan(db, id, fence, &report).inspect_err(|_| live.control.cancel())
        };
        if let Err(error) = self.store.write_soon(record) {
            tracing::warn!(job = %id, %error, "a plan was not recorded");
        }
    }

    fn prepare(&self, claim: &Claim) -> Result<(PlannedScene, Value), Failure> {
        let id = claim.id;
        let text = claim.scene.clone().map_or_else(|| self.files.scene(id), Ok).map_err(|error| {
            tracing::error!(job = %id, %error, "a scene could not be read");
            Failure::internal("The service could not read its scene.")
        })?;
        let prepare = || attempt::prepare(&text, (&self.assets, &claim.owner), self.limits);
        guarded(|| self.pool.install(prepare))
    }

    /// The running job whose turn it is.
    fn neediest(&self) -> Option<usize> {
        let share =
            |attempt: &Attempt| (self.shares.get(&attempt.owner).copied().unwrap_or_default(), attempt.share);
        let order = |a: (f64, f64), b: (f64, f64)| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1));
        (0..self.running.len()).min_by(|&a, &b| order(share(&self.running[a]), share(&self.running[b])))
    }

    fn give_turn(&mut self, index: usize) {
        let Self { pool, files, running, metrics, shares, watchdog, limits, .. } = self;
        let attempt = &mut running[index];
        let before = attempt.seconds();
        let (live, left) = (Arc::clone(&attempt.live), limits.max_seconds - before);
        let round = || pool.install(|| attempt.take_turn(files, metrics));
        let turn = guarded(|| Ok(watchdog.during(&live, left, round)));
        // A floor, so that rounds that take no time still pass the turn on.
        let took = (attempt.seconds() - before).max(1e-6);
        attempt.share += took;
        shares.entry(attempt.owner.clone()).and_modify(|share| *share += took);
        match turn.unwrap_or_else(|failure| Turn::Over(Err(failure))) {
            Turn::Continue => self.registry.announce(self.running[index].id),
            Turn::Over(end) => {
                let attempt = self.remove(index);
                self.registry.job_took(attempt.seconds());
                self.metrics
                    .job_ended(end.as_ref().err().map(|failure| failure.code.as_str()), attempt.age());
                self.conclude((attempt.id, attempt.fence), end);
            }
            Turn::NoRoom => {
                tracing::error!(job = %self.running[index].id, "the disk has no room for a picture");
                std::thread::sleep(RETRY);
            }
            // Left in place, to be put aside.
            Turn::Stopped if self.registry.is_draining() => {}
            Turn::Stopped => {
                let attempt = self.remove(index);
                self.files.discard_checkpoint(attempt.id);
                self.registry.leave(attempt.id);
            }
        }
    }

    fn remove(&mut self, index: usize) -> Attempt {
        let attempt = self.running.swap_remove(index);
        if self.running.iter().all(|other| other.owner != attempt.owner) {
            self.shares.remove(&attempt.owner);
        }
        attempt
    }

    fn conclude(&self, (id, fence): (JobId, u32), end: Result<Outcome, Failure>) {
        let (event, outcome) = match end {
            Ok(outcome) => (Event::Finish, outcome),
            Err(failure) => (Event::Fail, Outcome { failure: Some(failure), ..Outcome::default() }),
        };
        tracing::info!(job = %id, attempt = fence, rounds = outcome.rounds, failure = ?outcome.failure, "ended");
        let outcome = Arc::new(outcome);
        loop {
            let same = Arc::clone(&outcome);
            match self.store.write_blocking(move |db| sql::conclude(db, (id, fence), event, &same, now_ms()))
            {
                Ok(()) => self.files.discard_checkpoint(id),
                // Cancelled or deleted at the last moment: its owner does not want the result.
                Err(StoreError::IllegalMove(_) | StoreError::NotFound | StoreError::StaleAttempt) => {}
                // As long as this cannot be written nothing can, and nothing is lost by waiting.
                Err(error) if !self.registry.is_draining() => {
                    tracing::error!(job = %id, %error, "a result could not be recorded");
                    std::thread::sleep(RETRY);
                    continue;
                }
                Err(error) => tracing::error!(job = %id, %error, "a result is lost; it will be made again"),
            }
            break;
        }
        self.registry.leave(id);
        // The other end is gone only while the service stops.
        let _ = self.ended.send(Ended);
    }

    fn put_all_aside(&mut self) {
        for attempt in std::mem::take(&mut self.running) {
            let (id, fence) = (attempt.id, attempt.fence);
            attempt.put_aside(&self.files);
            let requeue = move |db: &rusqlite::Connection| {
                sql::apply(db, id, Event::Requeue, Some(fence), now_ms()).map(drop)
            };
            match self.store.write_blocking(requeue) {
                Ok(()) => tracing::info!(job = %id, rounds = attempt.live.progress().rounds, "put aside"),
                Err(StoreError::IllegalMove(_) | StoreError::NotFound) => {}
                Err(error) => tracing::error!(job = %id, %error, "a job could not be put aside"),
            }
            self.registry.leave(id);
        }
    }
}

/// Runs a part of a render; a panic in it is that job's failure and nobody else's.
fn guarded<T>(work: impl FnOnce() -> Result<T, Failure>) -> Result<T, Failure> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        tracing::error!(panic = panic_text(panic.as_ref()), "the renderer panicked");
        Err(Failure::internal("The renderer failed; the log says how."))
    })
}

fn panic_text(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("(no text)")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jobs::query;
    use crate::jobs::sql::{NewJob, QueueLimits};
    use std::path::Path;

    fn scheduler(folder: &Path) -> Scheduler {
        let store = Store::open(&folder.join("jobs.sqlite")).unwrap();
        Scheduler {
            files: Files::new(folder.join("jobs")).unwrap(),
            assets: Assets::new(store.clone(), folder.join("assets")).unwrap(),
            store,
            metrics: Arc::default(),
            ended: mpsc::channel().0,
            registry: Arc::default(),
            pool: rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap(),
            watchdog: Watchdog::start().unwrap(),
            concurrent: 1,
            limits: Limits { max_seconds: 60.0, max_memory: 1 << 30, max_photons: 1 << 26 },
            running: Vec::new(),
            shares: HashMap::new(),
        }
    }

    fn submit_and_claim(db: &rusqlite::Connection) -> Result<Claim, StoreError> {
        sql::insert(db, &NewJob::sample(), QueueLimits { queued: 1, unfinished: 1 })?;
        Ok(sql::claim(db, 0)?.expect("it has just been submitted"))
    }

    #[test]
    fn a_job_can_start_while_its_submission_is_on_its_way_to_the_disk() {
        let folder = tempfile::tempdir().unwrap();
        let scheduler = scheduler(folder.path());
        let (gather, gathered) = mpsc::channel::<()>();
        let (commit, committed) = mpsc::channel::<()>();
        let (claims, claimed) = mpsc::channel();
        // While the first holds the writer, the others come together into one group, which the last holds open.
        let wait = |gate: mpsc::Receiver<()>| {
            move |_: &rusqlite::Connection| {
                let _ = gate.recv();
                Ok(())
            }
        };
        scheduler.store.write_soon(wait(gathered)).unwrap();
        let submit = move |db: &rusqlite::Connection| {
            claims.send(submit_and_claim(db)?).map_err(|_| StoreError::NotCommitted)
        };
        scheduler.store.write_soon(submit).unwrap();
        scheduler.store.write_soon(wait(committed)).unwrap();
        drop(gather);
        let claim = claimed.recv().unwrap();
        let unseen = scheduler.store.read_blocking(|db| query::scene(db, claim.id)).unwrap();
        assert_eq!(unseen, None, "the submission is not on the disk");
        assert!(scheduler.prepare(&claim).is_ok());
        drop(commit);
    }

    #[test]
    fn a_job_that_is_cancelled_between_its_claim_and_its_start_stops() {
        let folder = tempfile::tempdir().unwrap();
        let mut scheduler = scheduler(folder.path());
        let claim = scheduler.store.write_blocking(submit_and_claim).unwrap();
        let id = claim.id;
        let cancel = move |db: &rusqlite::Connection| sql::apply(db, id, Event::Cancel, None, 0).map(drop);
        scheduler.store.write_blocking(cancel).unwrap();
        scheduler.begin(claim);
        scheduler.store.write_blocking(|_| Ok(())).unwrap();
        assert!(scheduler.running[0].live.control.is_cancelled());
    }

    #[test]
    fn a_job_whose_claim_was_taken_back_runs_once() {
        let folder = tempfile::tempdir().unwrap();
        let mut scheduler = scheduler(folder.path());
        let claim = scheduler.store.write_blocking(submit_and_claim).unwrap();
        scheduler.begin(claim.clone());
        scheduler.begin(claim);
        assert_eq!(scheduler.running.len(), 1);
    }

    #[test]
    fn a_panic_is_the_failure_of_its_job() {
        let failure = guarded::<()>(|| panic!("index out of bounds")).unwrap_err();
        assert_eq!(failure.code, "internal");
        assert!(!failure.detail.contains("index"), "internal text belongs in the log");
    }
}
