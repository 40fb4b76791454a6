//! The statements that change jobs, and what they are about.

use super::query::{self, parsed, state_of};
use super::{Event, Failure, JobId, JobState, Milestone, Owner, StoreError};
use rusqlite::{Connection, OptionalExtension, named_params, params};
use serde_json::Value;
use std::collections::HashSet;

/// A picture of a finished job, as a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Artifact {
    /// Its path below the job: `image.png`, `layers/caustic.png`.
    pub name: String,
    /// The attempt that wrote it.
    pub attempt: u32,
    /// Its SHA-256 in hexadecimal.
    pub sha256: String,
}

/// A job that asks to be admitted.
#[derive(Clone, Debug)]
pub(super) struct NewJob {
    pub id: JobId,
    pub owner: Owner,
    pub name: String,
    pub label: Option<String>,
    pub size: [u32; 2],
    pub created_ms: i64,
    pub cancel_ms: Option<i64>,
    /// The scene, unless it is large enough for a file of its own.
    pub scene: Option<String>,
    pub bytes: u64,
    /// What the scene refers to, by SHA-256.
    pub assets: Vec<String>,
    pub idempotency: Option<IdempotencyKey>,
}

/// How many jobs may be unfinished.
#[derive(Clone, Copy, Debug)]
pub(super) struct QueueLimits {
    /// Of all owners, waiting.
    pub queued: u32,
    /// Of one owner that has a key, waiting or running.
    pub unfinished: u32,
}

/// A client's own name for a request, and what the request was.
#[derive(Clone, Debug)]
pub(super) struct IdempotencyKey {
    pub key: String,
    pub fingerprint: String,
}

/// What an attempt leaves when it ends.
#[derive(Clone, Debug, Default)]
pub(super) struct Outcome {
    pub rounds: u32,
    pub error_estimate: Option<f32>,
    pub stop_reason: Option<String>,
    pub stats: Option<Value>,
    pub history: Vec<Milestone>,
    pub failure: Option<Failure>,
    pub artifacts: Vec<NewArtifact>,
}

/// A picture to be recorded: with its bytes, unless they are in a file.
#[derive(Clone, Debug)]
pub(super) struct NewArtifact {
    pub artifact: Artifact,
    pub bytes: u64,
    pub data: Option<Vec<u8>>,
}

/// Which jobs to list: newest first, at most `limit`, older than `before`.
#[derive(Clone, Debug)]
pub struct Page {
    /// Only jobs of this owner.
    pub owner: Owner,
    /// Only jobs with this label.
    pub label: Option<String>,
    /// Only jobs in this state.
    pub state: Option<JobState>,
    /// Only jobs submitted before the one at this position.
    pub before: Option<i64>,
    /// At most so many.
    pub limit: u32,
}

/// Whether a submission made a job, and how many wait before it, or found the one that the same request had made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Submitted {
    New(JobId, u32),
    Replayed(JobId),
}

pub(super) fn insert(db: &Connection, job: &NewJob, limits: QueueLimits) -> Result<Submitted, StoreError> {
    if let Some(known) =
        job.idempotency.as_ref().map(|key| find_key(db, &job.owner, key)).transpose()?.flatten()
    {
        return Ok(Submitted::Replayed(known));
    }
    let before = admit(db, &job.owner, limits)?;
    db.prepare_cached(
        "INSERT INTO jobs (id, state, owner, name, label, width, height, created_ms, bytes, cancel_ms)
         VALUES (?1, 'queued', ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)",
    )?
    .execute(params![
        job.id.to_string(),
        job.owner.as_str(),
        job.name,
        job.label,
        job.size[0],
        job.size[1],
        job.created_ms,
        job.bytes,
        job.cancel_ms
    ])?;
    if let Some(scene) = &job.scene {
        db.prepare_cached("INSERT INTO scenes (job, text) VALUES (?1, ?2)")?
            .execute(params![job.id.to_string(), scene])?;
    }
    for sha256 in &job.assets {
        db.execute(
            "INSERT INTO job_assets (job, sha256) VALUES (?1, ?2)",
            params![job.id.to_string(), sha256],
        )?;
        db.execute(
            "UPDATE assets SET used_ms = ?3 WHERE owner = ?1 AND sha256 = ?2",
            params![job.owner.as_str(), sha256, job.created_ms],
        )?;
    }
    if let Some(key) = &job.idempotency {
        db.execute(
            "INSERT INTO idempotency (key, fingerprint, job) VALUES (?1, ?2, ?3)",
            params![job.owner.scoped(&key.key), key.fingerprint, job.id.to_string()],
        )?;
    }
    Ok(Submitted::New(job.id, before))
}

/// How many jobs wait before a new one of this owner, if it may have one.
fn admit(db: &Connection, owner: &Owner, limits: QueueLimits) -> Result<u32, StoreError> {
    let queued: u32 = db
        .prepare_cached("SELECT total(queued) FROM waiting")?
        .query_row([], |row| Ok(row.get::<_, f64>(0)? as u32))?;
    if queued >= limits.queued {
        return Err(StoreError::QueueFull(queued));
    }
    let own: Option<u32> = db
        .prepare_cached("SELECT queued + running FROM waiting WHERE owner = ?1")?
        .query_row([owner.as_str()], |row| row.get(0))
        .optional()?;
    if !owner.is_anonymous() && own.unwrap_or(0) >= limits.unfinished {
        return Err(StoreError::TooManyJobs(limits.unfinished));
    }
    Ok(queued)
}

/// The job that this key made before, if it did.
pub(super) fn find_key(
    db: &Connection,
    owner: &Owner,
    key: &IdempotencyKey,
) -> Result<Option<JobId>, StoreError> {
    let known = db
        .query_row(
            "SELECT fingerprint, job FROM idempotency WHERE key = ?1",
            [owner.scoped(&key.key)],
            |row| Ok((row.get::<_, String>(0)?, parsed::<JobId>(row, 1)?)),
        )
        .optional()?;
    match known {
        Some((fingerprint, _)) if fingerprint != key.fingerprint => Err(StoreError::KeyReused),
        known => Ok(known.map(|(_, id)| id)),
    }
}

/// Moves a job to another state: the only statement that does. `fence` is the attempt that asks.
pub(super) fn apply(
    db: &Connection,
    id: JobId,
    event: Event,
    fence: Option<u32>,
    now_ms: i64,
) -> Result<(JobState, u32), StoreError> {
    let (state, attempt) = db
        .query_row("SELECT state, attempt FROM jobs WHERE id = ?1", [id.to_string()], |row| {
            Ok((state_of(row, 0)?, row.get::<_, u32>(1)?))
        })
        .optional()?
        .ok_or(StoreError::NotFound)?;
    if fence.is_some_and(|fence| fence != attempt) {
        return Err(StoreError::StaleAttempt);
    }
    let next = state.after(event).ok_or(StoreError::IllegalMove(state))?;
    let starts = event == Event::Start;
    let attempt = attempt + u32::from(starts);
    db.execute(
        "UPDATE jobs SET state = :state, attempt = :attempt,
             started_ms = iif(:starts, :now, started_ms), finished_ms = iif(:done, :now, finished_ms)
         WHERE id = :id",
        named_params! {
            ":state": next.as_str(), ":attempt": attempt, ":starts": starts,
            ":done": next.is_done(), ":now": now_ms, ":id": id.to_string(),
        },
    )?;
    Ok((next, attempt))
}

/// Ends an attempt and records what it left, in one transaction.
pub(super) fn conclude(
    db: &Connection,
    (id, fence): (JobId, u32),
    event: Event,
    outcome: &Outcome,
    now_ms: i64,
) -> Result<(), StoreError> {
    apply(db, id, event, Some(fence), now_ms)?;
    db.execute(
        "UPDATE jobs SET rounds = ?2, error_estimate = ?3, stop_reason = ?4, stats = ?5,
             failure_code = ?6, failure_detail = ?7, history = ?8, bytes = bytes + ?9 WHERE id = ?1",
        params![
            id.to_string(),
            outcome.rounds,
            outcome.error_estimate,
            outcome.stop_reason,
            outcome.stats.as_ref().map(Value::to_string),
            outcome.failure.as_ref().map(|failure| &failure.code),
            outcome.failure.as_ref().map(|failure| &failure.detail),
            serde_json::to_string(&outcome.history).ok(),
            outcome.artifacts.iter().map(|new| new.bytes).sum::<u64>(),
        ],
    )?;
    for NewArtifact { artifact, data, .. } in &outcome.artifacts {
        db.execute(
            "INSERT INTO artifacts (job, name, attempt, sha256, data) VALUES (?1, ?2, ?3, ?4, ?5)",
            params![id.to_string(), artifact.name, artifact.attempt, artifact.sha256, data],
        )?;
    }
    Ok(())
}

/// Starts the job that has waited longest of the owner for whom the fewest run.
pub(super) fn claim(db: &Connection, now_ms: i64) -> Result<Option<Claim>, StoreError> {
    let next = db
        .prepare_cached(
            "SELECT id, owner FROM jobs WHERE seq = (
                 SELECT (SELECT min(seq) FROM jobs WHERE owner = waiting.owner AND state = 'queued') AS first
                 FROM waiting WHERE queued > 0 ORDER BY running, first LIMIT 1)",
        )?
        .query_row([], |row| Ok((parsed::<JobId>(row, 0)?, Owner::of(row.get::<_, String>(1)?))))
        .optional()?;
    let Some((id, owner)) = next else { return Ok(None) };
    let (_, attempt) = apply(db, id, Event::Start, None, now_ms)?;
    Ok(Some(Claim { id, attempt, owner, scene: query::scene(db, id)? }))
}

/// A job that has just been started.
#[derive(Clone, Debug)]
pub(super) struct Claim {
    pub id: JobId,
    pub attempt: u32,
    pub owner: Owner,
    /// Its scene, unless it has a file of its own. It comes with the claim, since the submission may be on its way to
    /// the disk still, where no other connection sees it.
    pub scene: Option<String>,
}

/// Keeps the plan of a running attempt.
pub(super) fn record_plan(db: &Connection, id: JobId, fence: u32, plan: &Value) -> Result<(), StoreError> {
    let changed = db.execute(
        "UPDATE jobs SET plan = ?3 WHERE id = ?1 AND attempt = ?2 AND state = 'running'",
        params![id.to_string(), fence, plan.to_string()],
    )?;
    if changed == 0 { Err(StoreError::StaleAttempt) } else { Ok(()) }
}

/// Called on start: what still says `running` died with the last process. It waits again, or fails if
/// it has taken the service down too often.
pub(super) fn recover(db: &Connection, max_deaths: u32, now_ms: i64) -> Result<usize, StoreError> {
    let dead: Vec<(JobId, u32, u32)> = db
        .prepare("SELECT id, attempt, deaths FROM jobs WHERE state = 'running' ORDER BY seq")?
        .query_map([], |row| Ok((parsed::<JobId>(row, 0)?, row.get(1)?, row.get(2)?)))?
        .collect::<Result<_, _>>()?;
    for &(id, attempt, deaths) in &dead {
        db.execute("UPDATE jobs SET deaths = deaths + 1 WHERE id = ?1", [id.to_string()])?;
        if deaths + 1 < max_deaths {
            apply(db, id, Event::Requeue, Some(attempt), now_ms)?;
            continue;
        }
        let failure = Failure {
            code: "attempts_exhausted".into(),
            detail: format!("The service died {max_deaths} times while it rendered this job."),
        };
        let outcome = Outcome { failure: Some(failure), ..Outcome::default() };
        conclude(db, (id, attempt), Event::Fail, &outcome, now_ms)?;
    }
    Ok(dead.len())
}

pub(super) fn delete(db: &Connection, id: JobId) -> Result<(), StoreError> {
    match db.execute("DELETE FROM jobs WHERE id = ?1", [id.to_string()])? {
        0 => Err(StoreError::NotFound),
        _ => Ok(()),
    }
}

/// The names of all jobs, to tell folders that belong to one from folders that were left behind.
pub(super) fn ids(db: &Connection) -> Result<HashSet<String>, StoreError> {
    let mut statement = db.prepare("SELECT id FROM jobs")?;
    Ok(statement.query_map([], |row| row.get(0))?.collect::<Result<_, _>>()?)
}

#[cfg(test)]
impl NewJob {
    /// A sample that nobody has submitted yet.
    pub(super) fn sample() -> Self {
        let text = crate::samples::find("glass-ball").expect("it is embedded").text;
        Self {
            id: JobId::fresh(),
            owner: Owner::anonymous(),
            name: String::new(),
            label: None,
            size: [400, 300],
            created_ms: 0,
            cancel_ms: None,
            scene: Some(text.into()),
            bytes: text.len() as u64,
            assets: Vec::new(),
            idempotency: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jobs::store::open_for_writing;

    #[test]
    fn what_an_attempt_out_of_date_brings_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let db = open_for_writing(&folder.path().join("jobs.sqlite")).unwrap();
        insert(&db, &NewJob::sample(), QueueLimits { queued: 1, unfinished: 1 }).unwrap();
        let old = claim(&db, 0).unwrap().unwrap();
        apply(&db, old.id, Event::Requeue, Some(old.attempt), 0).unwrap();
        let new = claim(&db, 0).unwrap().unwrap();
        assert_eq!((old.id, old.attempt + 1), (new.id, new.attempt));
        let end = |attempt| conclude(&db, (new.id, attempt), Event::Finish, &Outcome::default(), 0);
        assert!(matches!(end(old.attempt), Err(StoreError::StaleAttempt)));
        assert!(end(new.attempt).is_ok());
        assert!(matches!(end(new.attempt), Err(StoreError::IllegalMove(JobState::Succeeded))), "once");
    }
}
