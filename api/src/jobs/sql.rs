//! The statements: every reading and every change of the job tables.

use super::{Event, Failure, Job, JobId, JobState, StoreError};
use rusqlite::types::Type;
use rusqlite::{Connection, OptionalExtension, Row, named_params, params};
use serde_json::Value;

/// Attempts that may die with the service before the job itself is blamed.
const MAX_DEATHS: u32 = 3;

const TABLES: &str = "
CREATE TABLE IF NOT EXISTS jobs (
    seq INTEGER PRIMARY KEY AUTOINCREMENT,
    id TEXT NOT NULL UNIQUE,
    state TEXT NOT NULL,
    attempt INTEGER NOT NULL DEFAULT 0,
    deaths INTEGER NOT NULL DEFAULT 0,
    name TEXT NOT NULL,
    width INTEGER NOT NULL,
    height INTEGER NOT NULL,
    created_ms INTEGER NOT NULL,
    started_ms INTEGER,
    finished_ms INTEGER,
    rounds INTEGER NOT NULL DEFAULT 0,
    error_estimate REAL,
    stop_reason TEXT,
    plan TEXT,
    stats TEXT,
    failure_code TEXT,
    failure_detail TEXT
) STRICT;
CREATE INDEX IF NOT EXISTS jobs_by_state ON jobs (state, seq);
CREATE TABLE IF NOT EXISTS artifacts (
    job TEXT NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    name TEXT NOT NULL,
    attempt INTEGER NOT NULL,
    sha256 TEXT NOT NULL,
    PRIMARY KEY (job, name)
) STRICT;
CREATE TABLE IF NOT EXISTS idempotency (
    key TEXT PRIMARY KEY,
    fingerprint TEXT NOT NULL,
    job TEXT NOT NULL REFERENCES jobs (id) ON DELETE CASCADE
) STRICT;
PRAGMA user_version = 1;
";

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
    pub name: String,
    pub size: [u32; 2],
    pub created_ms: i64,
    pub idempotency: Option<IdempotencyKey>,
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
    pub failure: Option<Failure>,
    pub artifacts: Vec<Artifact>,
}

/// Which jobs to list: newest first, at most `limit`, older than `before`.
#[derive(Clone, Copy, Debug)]
pub struct Page {
    /// Only jobs in this state.
    pub state: Option<JobState>,
    /// Only jobs submitted before the one at this position.
    pub before: Option<i64>,
    /// At most so many.
    pub limit: u32,
}

/// Whether a submission made a job or found the one that the same request had made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Submitted {
    New(JobId),
    Replayed(JobId),
}

pub(super) fn create_tables(db: &Connection) -> Result<(), rusqlite::Error> {
    db.execute_batch(TABLES)
}

pub(super) fn insert(db: &Connection, job: &NewJob, max_queue: u32) -> Result<Submitted, StoreError> {
    if let Some(known) = job.idempotency.as_ref().map(|key| find_key(db, key)).transpose()?.flatten() {
        return Ok(Submitted::Replayed(known));
    }
    let waiting: u32 =
        db.query_row("SELECT count(*) FROM jobs WHERE state = 'queued'", [], |row| row.get(0))?;
    if waiting >= max_queue {
        return Err(StoreError::QueueFull(waiting));
    }
    db.execute(
        "INSERT INTO jobs (id, state, name, width, height, created_ms) VALUES (?1, 'queued', ?2, ?3, ?4, ?5)",
        params![job.id.to_string(), job.name, job.size[0], job.size[1], job.created_ms],
    )?;
    if let Some(key) = &job.idempotency {
        db.execute(
            "INSERT INTO idempotency (key, fingerprint, job) VALUES (?1, ?2, ?3)",
            params![key.key, key.fingerprint, job.id.to_string()],
        )?;
    }
    Ok(Submitted::New(job.id))
}

/// The job that this key made before, if it did.
pub(super) fn find_key(db: &Connection, key: &IdempotencyKey) -> Result<Option<JobId>, StoreError> {
    let known = db
        .query_row("SELECT fingerprint, job FROM idempotency WHERE key = ?1", [&key.key], |row| {
            Ok((row.get::<_, String>(0)?, parsed::<JobId>(row, 1)?))
        })
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
             failure_code = ?6, failure_detail = ?7 WHERE id = ?1",
        params![
            id.to_string(),
            outcome.rounds,
            outcome.error_estimate,
            outcome.stop_reason,
            outcome.stats.as_ref().map(Value::to_string),
            outcome.failure.as_ref().map(|failure| &failure.code),
            outcome.failure.as_ref().map(|failure| &failure.detail),
        ],
    )?;
    for artifact in &outcome.artifacts {
        db.execute(
            "INSERT INTO artifacts (job, name, attempt, sha256) VALUES (?1, ?2, ?3, ?4)",
            params![id.to_string(), artifact.name, artifact.attempt, artifact.sha256],
        )?;
    }
    Ok(())
}

/// Starts the job that has waited longest.
pub(super) fn claim(db: &Connection, now_ms: i64) -> Result<Option<(JobId, u32)>, StoreError> {
    let next = db
        .query_row("SELECT id FROM jobs WHERE state = 'queued' ORDER BY seq LIMIT 1", [], |row| {
            parsed::<JobId>(row, 0)
        })
        .optional()?;
    let Some(id) = next else { return Ok(None) };
    let (_, attempt) = apply(db, id, Event::Start, None, now_ms)?;
    Ok(Some((id, attempt)))
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
pub(super) fn recover(db: &Connection, now_ms: i64) -> Result<usize, StoreError> {
    let dead: Vec<(JobId, u32, u32)> = db
        .prepare("SELECT id, attempt, deaths FROM jobs WHERE state = 'running' ORDER BY seq")?
        .query_map([], |row| Ok((parsed::<JobId>(row, 0)?, row.get(1)?, row.get(2)?)))?
        .collect::<Result<_, _>>()?;
    for &(id, attempt, deaths) in &dead {
        db.execute("UPDATE jobs SET deaths = deaths + 1 WHERE id = ?1", [id.to_string()])?;
        if deaths + 1 < MAX_DEATHS {
            apply(db, id, Event::Requeue, Some(attempt), now_ms)?;
            continue;
        }
        let failure = Failure {
            code: "attempts_exhausted".into(),
            detail: format!("The service died {MAX_DEATHS} times while it rendered this job."),
        };
        let outcome = Outcome { failure: Some(failure), ..Outcome::default() };
        conclude(db, (id, attempt), Event::Fail, &outcome, now_ms)?;
    }
    Ok(dead.len())
}

pub(super) fn get(db: &Connection, id: JobId) -> Result<Option<Job>, StoreError> {
    let job = db.query_row("SELECT * FROM jobs WHERE id = ?1", [id.to_string()], job_of).optional()?;
    let Some(mut job) = job else { return Ok(None) };
    job.artifacts = db
        .prepare_cached("SELECT name, attempt, sha256 FROM artifacts WHERE job = ?1 ORDER BY name")?
        .query_map([id.to_string()], |row| {
            Ok(Artifact { name: row.get(0)?, attempt: row.get(1)?, sha256: row.get(2)? })
        })?
        .collect::<Result<_, _>>()?;
    Ok(Some(job))
}

pub(super) fn list(db: &Connection, page: Page) -> Result<Vec<Job>, StoreError> {
    let mut statement = db.prepare_cached(
        "SELECT * FROM jobs WHERE seq < ?1 AND (?2 IS NULL OR state = ?2) ORDER BY seq DESC LIMIT ?3",
    )?;
    let before = page.before.unwrap_or(i64::MAX);
    let rows = statement.query_map(params![before, page.state.map(JobState::as_str), page.limit], job_of)?;
    Ok(rows.collect::<Result<_, _>>()?)
}

/// How many jobs are before this one in the queue.
pub(super) fn queue_position(db: &Connection, seq: i64) -> Result<u32, StoreError> {
    let count = "SELECT count(*) FROM jobs WHERE state = 'queued' AND seq < ?1";
    Ok(db.query_row(count, [seq], |row| row.get(0))?)
}

pub(super) fn delete(db: &Connection, id: JobId) -> Result<(), StoreError> {
    match db.execute("DELETE FROM jobs WHERE id = ?1", [id.to_string()])? {
        0 => Err(StoreError::NotFound),
        _ => Ok(()),
    }
}

/// The names of all jobs, to tell folders that belong to one from folders that were left behind.
pub(super) fn ids(db: &Connection) -> Result<Vec<String>, StoreError> {
    let mut statement = db.prepare("SELECT id FROM jobs")?;
    Ok(statement.query_map([], |row| row.get(0))?.collect::<Result<_, _>>()?)
}

fn job_of(row: &Row<'_>) -> Result<Job, rusqlite::Error> {
    let failure = row.get::<_, Option<String>>("failure_code")?.zip(row.get("failure_detail")?);
    Ok(Job {
        seq: row.get("seq")?,
        id: parsed(row, row.as_ref().column_index("id")?)?,
        state: state_of(row, row.as_ref().column_index("state")?)?,
        attempt: row.get("attempt")?,
        deaths: row.get("deaths")?,
        name: row.get("name")?,
        size: [row.get("width")?, row.get("height")?],
        created_ms: row.get("created_ms")?,
        started_ms: row.get("started_ms")?,
        finished_ms: row.get("finished_ms")?,
        rounds: row.get("rounds")?,
        error_estimate: row.get("error_estimate")?,
        stop_reason: row.get("stop_reason")?,
        plan: json_of(row, "plan")?,
        stats: json_of(row, "stats")?,
        failure: failure.map(|(code, detail)| Failure { code, detail }),
        artifacts: Vec::new(),
    })
}

fn json_of(row: &Row<'_>, column: &str) -> Result<Option<Value>, rusqlite::Error> {
    let text: Option<String> = row.get(column)?;
    Ok(text.and_then(|text| serde_json::from_str(&text).ok()))
}

fn state_of(row: &Row<'_>, column: usize) -> Result<JobState, rusqlite::Error> {
    let text: String = row.get(column)?;
    let found = JobState::ALL.into_iter().find(|state| state.as_str() == text);
    found.ok_or_else(|| unreadable(column, format!("unknown state {text:?}").into()))
}

fn parsed<T>(row: &Row<'_>, column: usize) -> Result<T, rusqlite::Error>
where
    T: std::str::FromStr<Err: std::error::Error + Send + Sync + 'static>,
{
    row.get::<_, String>(column)?.parse().map_err(|error: T::Err| unreadable(column, error.into()))
}

fn unreadable(column: usize, error: Box<dyn std::error::Error + Send + Sync>) -> rusqlite::Error {
    rusqlite::Error::FromSqlConversionFailure(column, Type::Text, error)
}
