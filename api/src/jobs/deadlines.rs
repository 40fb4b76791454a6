//! Cancels the jobs that are not done when their owners will have given up on them: `cancel_after` of a submission.
//!
//! The moment is kept with the job, so that it holds for one that waits, and outlives a crash.

use super::live::Registry;
use super::service::now_ms;
use super::store::Store;
use super::{Event, JobId, StoreError, query, sql};
use crate::metrics::Metrics;
use rusqlite::Connection;
use std::io;
use std::sync::Arc;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::Duration;

/// Longest time between two looks: a clock that is set must not hold a cancellation up for ever.
const INTERVAL: Duration = Duration::from_secs(30);
/// After this time is tried again what the database refused.
const RETRY: Duration = Duration::from_secs(1);

/// There is a new job that has such a moment.
#[derive(Clone, Copy, Debug)]
pub(super) struct NewDeadline;

/// Starts a thread that cancels what is due, until the sender is gone.
pub(super) fn start(
    store: Store,
    registry: Arc<Registry>,
    metrics: Arc<Metrics>,
) -> io::Result<mpsc::Sender<NewDeadline>> {
    let (sender, inbox) = mpsc::channel();
    let watch = move || run(&store, &registry, &metrics, &inbox);
    std::thread::Builder::new().name("deadlines".into()).spawn(watch)?;
    Ok(sender)
}

fn run(store: &Store, registry: &Registry, metrics: &Metrics, inbox: &mpsc::Receiver<NewDeadline>) {
    loop {
        let heard = match cancel_due(store, registry, metrics) {
            Ok(None) => inbox.recv().map_err(|_| RecvTimeoutError::Disconnected),
            Ok(Some(next_ms)) => inbox.recv_timeout(time_until(next_ms).min(INTERVAL)),
            Err(error) => {
                tracing::error!(%error, "jobs that are due could not be cancelled");
                inbox.recv_timeout(RETRY)
            }
        };
        match heard {
            Ok(NewDeadline) => while inbox.try_recv().is_ok() {},
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return,
        }
    }
}

/// Cancels what is due; when to look again, if anything else will be.
fn cancel_due(store: &Store, registry: &Registry, metrics: &Metrics) -> Result<Option<i64>, StoreError> {
    // Looked up by the reader first: mostly there is nothing to write.
    let next = store.read_blocking(query::next_deadline)?;
    if next.is_none_or(|next_ms| next_ms > now_ms()) {
        return Ok(next);
    }
    for id in store.write_blocking(move |db| cancel(db, now_ms()))? {
        registry.stop(id);
        metrics.job("cancelled");
        tracing::info!(job = %id, "cancelled: its time was over");
    }
    store.read_blocking(query::next_deadline)
}

fn cancel(db: &Connection, now_ms: i64) -> Result<Vec<JobId>, StoreError> {
    let due = query::due(db, now_ms)?;
    for &id in &due {
        sql::apply(db, id, Event::Cancel, None, now_ms)?;
    }
    Ok(due)
}

fn time_until(moment_ms: i64) -> Duration {
    Duration::from_millis(u64::try_from(moment_ms.saturating_sub(now_ms())).unwrap_or(0))
}
