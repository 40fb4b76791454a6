//! The render thread: takes jobs from the queue and gives each running job one round at a time.
//!
//! The next round goes to the running job that has had the least time, so that small renders pass
//! between the rounds of a long one. Rounds use all threads of the pool; nothing else does.

use super::attempt::{self, Attempt, Limits, Turn};
use super::files::Files;
use super::live::Registry;
use super::sql::{self, Outcome};
use super::store::{Store, StoreError};
use super::{Event, Failure, JobId, service::now_ms};
use serde_json::Value;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, mpsc};

/// Wakes the render thread: there is a new job, or it is time to stop.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wake;

/// What became of the first write of an attempt.
enum Recorded {
    Wanted,
    /// The job was cancelled or deleted while it was planned.
    Unwanted,
    Failed,
}

/// The render thread's own things.
pub(super) struct Scheduler {
    pub(super) store: Store,
    pub(super) files: Files,
    pub(super) registry: Arc<Registry>,
    pub(super) pool: rayon::ThreadPool,
    pub(super) concurrent: usize,
    pub(super) limits: Limits,
    pub(super) running: Vec<Attempt>,
}

impl Scheduler {
    /// Renders until the service drains; then puts aside what runs.
    pub(super) fn run(mut self, inbox: &mpsc::Receiver<Wake>) {
        while !self.registry.is_draining() {
            self.admit();
            match self.neediest() {
                Some(index) => self.give_turn(index),
                // A wake that came since `admit` is still in the inbox.
                None if inbox.recv().is_err() => break,
                None => while inbox.try_recv().is_ok() {},
            }
        }
        self.put_all_aside();
    }

    fn admit(&mut self) {
        while self.running.len() < self.concurrent && !self.registry.is_draining() {
            match self.store.write_blocking(|db| sql::claim(db, now_ms())) {
                Ok(Some(job)) => self.begin(job),
                Ok(None) => return,
                Err(error) => {
                    tracing::error!(%error, "no job could be taken from the queue");
                    return;
                }
            }
        }
    }

    fn begin(&mut self, (id, fence): (JobId, u32)) {
        let live = self.registry.enter(id);
        self.registry.announce(id);
        let prepare = || self.pool.install(|| attempt::prepare(&self.files, id, self.limits));
        let planned = match guarded(prepare) {
            Ok((planned, report)) => match self.record_plan((id, fence), report) {
                Recorded::Wanted => Ok(planned),
                Recorded::Unwanted => return self.registry.leave(id),
                Recorded::Failed => Err(Failure::internal("The service could not record the plan.")),
            },
            Err(failure) => Err(failure),
        };
        match planned.and_then(|planned| guarded(|| Attempt::begin((id, fence), planned, live, &self.files)))
        {
            Ok(mut attempt) => {
                let least = self.running.iter().map(|rival| rival.share).reduce(f64::min);
                attempt.share = least.unwrap_or(0.0);
                self.running.push(attempt);
                tracing::info!(job = %id, attempt = fence, "started");
            }
            Err(failure) => self.conclude((id, fence), Err(failure)),
        }
    }

    fn record_plan(&self, (id, fence): (JobId, u32), report: Value) -> Recorded {
        match self.store.write_blocking(move |db| sql::record_plan(db, id, fence, &report)) {
            Ok(()) => Recorded::Wanted,
            Err(StoreError::StaleAttempt) => Recorded::Unwanted,
            Err(error) => {
                tracing::error!(job = %id, %error, "a plan could not be recorded");
                Recorded::Failed
            }
        }
    }

    /// The running job that has had the least time.
    fn neediest(&self) -> Option<usize> {
        (0..self.running.len()).min_by(|&a, &b| self.running[a].share.total_cmp(&self.running[b].share))
    }

    fn give_turn(&mut self, index: usize) {
        let Self { pool, files, running, .. } = self;
        let attempt = &mut running[index];
        let before = attempt.seconds();
        let turn = guarded(|| Ok(pool.install(|| attempt.take_turn(files))));
        // A floor, so that rounds that take no time still pass the turn on.
        attempt.share += (attempt.seconds() - before).max(1e-6);
        match turn.unwrap_or_else(|failure| Turn::Over(Err(failure))) {
            Turn::Continue => self.registry.announce(self.running[index].id),
            Turn::Over(end) => {
                let attempt = self.running.swap_remove(index);
                self.conclude((attempt.id, attempt.fence), end);
            }
            // Left in place, to be put aside.
            Turn::Stopped if self.registry.is_draining() => {}
            Turn::Stopped => {
                let attempt = self.running.swap_remove(index);
                self.files.discard_checkpoint(attempt.id);
                self.registry.leave(attempt.id);
            }
        }
    }

    fn conclude(&self, (id, fence): (JobId, u32), end: Result<Outcome, Failure>) {
        let (event, outcome) = match end {
            Ok(outcome) => (Event::Finish, outcome),
            Err(failure) => (Event::Fail, Outcome { failure: Some(failure), ..Outcome::default() }),
        };
        tracing::info!(job = %id, attempt = fence, rounds = outcome.rounds, failure = ?outcome.failure, "ended");
        let recorded =
            self.store.write_blocking(move |db| sql::conclude(db, (id, fence), event, &outcome, now_ms()));
        match recorded {
            Ok(()) => self.files.discard_checkpoint(id),
            // Cancelled or deleted at the last moment: its owner does not want the result.
            Err(StoreError::IllegalMove(_) | StoreError::NotFound) => {}
            Err(error) => tracing::error!(job = %id, %error, "a result could not be recorded"),
        }
        self.registry.leave(id);
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

    #[test]
    fn a_panic_is_the_failure_of_its_job() {
        let failure = guarded::<()>(|| panic!("index out of bounds")).unwrap_err();
        assert_eq!(failure.code, "internal");
        assert!(!failure.detail.contains("index"), "internal text belongs in the log");
    }
}
