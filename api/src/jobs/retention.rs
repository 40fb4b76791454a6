//! What is forgotten, and when: finished jobs by age, by number and by size; assets that nothing uses.

use super::assets::Assets;
use super::files::Files;
use super::service::now_ms;
use super::store::Store;
use super::{JobId, StoreError};
use rusqlite::{Connection, params};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::Duration;

/// Jobs that are forgotten in one transaction, so that others need not wait for it.
const AT_ONCE: u32 = 200;
/// Jobs of which it is remembered that they have expired.
const MOST_EXPIRED: u32 = 100_000;
/// How often is looked, if nothing ends.
const INTERVAL: Duration = Duration::from_secs(30);

/// How much is kept of what is done.
#[derive(Clone, Copy, Debug)]
pub(super) struct Policy {
    pub(super) age: Duration,
    pub(super) jobs: u32,
    pub(super) bytes: u64,
}

/// A job has ended: look whether another has to go.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ended;

/// Forgets what has to go, now and whenever a job ends, until the last sender is gone.
pub(super) fn run(
    policy: Policy,
    store: &Store,
    (files, assets): (&Files, &Assets),
    inbox: &mpsc::Receiver<Ended>,
) {
    let interval = INTERVAL.min(policy.age / 4).max(Duration::from_millis(50));
    loop {
        if let Err(error) = tidy(policy, store, files, assets) {
            tracing::error!(%error, "what has expired could not be forgotten");
        }
        match inbox.recv_timeout(interval) {
            Ok(Ended) => while inbox.try_recv().is_ok() {},
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return,
        }
    }
}

fn tidy(policy: Policy, store: &Store, files: &Files, assets: &Assets) -> Result<(), StoreError> {
    loop {
        let now = now_ms();
        // Looked up by the reader first: mostly there is nothing to write.
        if store.read_blocking(|db| due(db, policy, now))?.is_empty() {
            break;
        }
        let gone = store.write_blocking(move |db| forget(db, &due(db, policy, now)?, now))?;
        tracing::info!(jobs = gone.len(), "expired");
        gone.into_iter().for_each(|id| files.remove(id));
    }
    let oldest = now_ms().saturating_sub(millis(policy.age));
    if store.read_blocking(|db| unused_assets(db, oldest))?.is_empty() {
        return Ok(());
    }
    assets.remove(&store.write_blocking(move |db| forget_assets(db, oldest))?);
    Ok(())
}

pub(super) fn millis(age: Duration) -> i64 {
    i64::try_from(age.as_millis()).unwrap_or(i64::MAX)
}

/// Finished jobs that have to go, oldest first.
fn due(db: &Connection, policy: Policy, now_ms: i64) -> Result<Vec<(String, String)>, StoreError> {
    let (count, bytes): (u32, u64) = db
        .prepare_cached("SELECT count(finished_ms), total(bytes) FROM jobs")?
        .query_row([], |row| Ok((row.get(0)?, row.get::<_, f64>(1)? as u64)))?;
    let too_many = count.saturating_sub(policy.jobs);
    let mut too_large = bytes.saturating_sub(policy.bytes);
    let oldest = now_ms.saturating_sub(millis(policy.age));
    let mut find = db.prepare_cached(
        "SELECT id, owner, finished_ms, bytes FROM jobs WHERE finished_ms IS NOT NULL ORDER BY finished_ms LIMIT ?1",
    )?;
    let mut rows = find.query([AT_ONCE])?;
    let mut due = Vec::new();
    while let Some(row) = rows.next()? {
        let is_old = row.get::<_, i64>(2)? < oldest;
        if !(is_old || due.len() < too_many as usize || too_large > 0) {
            break;
        }
        too_large = too_large.saturating_sub(row.get(3)?);
        due.push((row.get(0)?, row.get(1)?));
    }
    Ok(due)
}

fn forget(db: &Connection, due: &[(String, String)], now_ms: i64) -> Result<Vec<JobId>, StoreError> {
    for (id, owner) in due {
        db.execute("DELETE FROM jobs WHERE id = ?1", [id])?;
        db.execute(
            "INSERT INTO expired (id, owner, expired_ms) VALUES (?1, ?2, ?3)",
            params![id, owner, now_ms],
        )?;
    }
    db.execute(
        "DELETE FROM expired WHERE id IN (SELECT id FROM expired ORDER BY expired_ms DESC LIMIT -1 OFFSET ?1)",
        [MOST_EXPIRED],
    )?;
    Ok(due.iter().filter_map(|(id, _)| id.parse().ok()).collect())
}

/// Assets that no scene has named for long, and no job that is still known.
fn unused_assets(db: &Connection, oldest_ms: i64) -> Result<Vec<String>, StoreError> {
    let mut find = db.prepare_cached(
        "SELECT sha256 FROM assets WHERE used_ms < ?1
             AND NOT EXISTS (SELECT 1 FROM job_assets WHERE job_assets.sha256 = assets.sha256) LIMIT 1000",
    )?;
    Ok(find.query_map([oldest_ms], |row| row.get(0))?.collect::<Result<_, _>>()?)
}

/// Forgets them; those that nobody has any more, whose files can go.
fn forget_assets(db: &Connection, oldest_ms: i64) -> Result<Vec<String>, StoreError> {
    let mut gone = unused_assets(db, oldest_ms)?;
    for sha256 in &gone {
        db.execute("DELETE FROM assets WHERE sha256 = ?1 AND used_ms < ?2", params![sha256, oldest_ms])?;
    }
    gone.dedup();
    let mut known = db.prepare_cached("SELECT 1 FROM assets WHERE sha256 = ?1")?;
    gone.retain(|sha256| known.exists([sha256]).is_ok_and(|known| !known));
    Ok(gone)
}
