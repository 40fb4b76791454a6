//! The statements that look at jobs, and how a row becomes a job.

use super::sql::{Artifact, Page};
use super::{Failure, Job, JobId, JobState, Owner, StoreError};
use rusqlite::types::Type;
use rusqlite::{Connection, OptionalExtension, Row, params};
use serde_json::Value;

/// How many jobs wait and how many run.
pub(super) fn counts(db: &Connection) -> Result<(u32, u32), StoreError> {
    Ok(db.query_row("SELECT total(queued), total(running) FROM waiting", [], |row| {
        Ok((row.get::<_, f64>(0)? as u32, row.get::<_, f64>(1)? as u32))
    })?)
}

/// A job of this owner.
pub(super) fn get(db: &Connection, owner: &Owner, id: JobId) -> Result<Job, StoreError> {
    let job = db
        .prepare_cached("SELECT * FROM jobs WHERE id = ?1 AND owner = ?2")?
        .query_row([&id.to_string(), owner.as_str()], job_of)
        .optional()?;
    let Some(mut job) = job else { return Err(why_missing(db, owner, id)?) };
    job.artifacts = db
        .prepare_cached("SELECT name, attempt, sha256 FROM artifacts WHERE job = ?1 ORDER BY name")?
        .query_map([id.to_string()], |row| {
            Ok(Artifact { name: row.get(0)?, attempt: row.get(1)?, sha256: row.get(2)? })
        })?
        .collect::<Result<_, _>>()?;
    Ok(job)
}

/// Whether there never was such a job, or it has expired.
fn why_missing(db: &Connection, owner: &Owner, id: JobId) -> Result<StoreError, StoreError> {
    let expired = db
        .prepare_cached("SELECT 1 FROM expired WHERE id = ?1 AND owner = ?2")?
        .exists([&id.to_string(), owner.as_str()])?;
    Ok(if expired { StoreError::Expired } else { StoreError::NotFound })
}

/// The bytes of a picture, if they are kept in the database.
pub(super) fn artifact_data(db: &Connection, id: JobId, name: &str) -> Result<Option<Vec<u8>>, StoreError> {
    let mut find = db.prepare_cached("SELECT data FROM artifacts WHERE job = ?1 AND name = ?2")?;
    Ok(find.query_row([&id.to_string(), name], |row| row.get(0)).optional()?.flatten())
}

/// The text of a job's scene, if it is kept in the database.
pub(super) fn scene(db: &Connection, id: JobId) -> Result<Option<String>, StoreError> {
    let mut find = db.prepare_cached("SELECT text FROM scenes WHERE job = ?1")?;
    Ok(find.query_row([id.to_string()], |row| row.get(0)).optional()?)
}

pub(super) fn list(db: &Connection, page: &Page) -> Result<Vec<Job>, StoreError> {
    let mut statement = db.prepare_cached(
        "SELECT * FROM jobs WHERE owner = ?1 AND seq < ?2 AND (?3 IS NULL OR state = ?3)
             AND (?4 IS NULL OR label = ?4) ORDER BY seq DESC LIMIT ?5",
    )?;
    let before = page.before.unwrap_or(i64::MAX);
    let state = page.state.map(JobState::as_str);
    let rows =
        statement.query_map(params![page.owner.as_str(), before, state, page.label, page.limit], job_of)?;
    Ok(rows.collect::<Result<_, _>>()?)
}

/// How many jobs are before this one in the queue; counted up to a thousand, so that the answer never takes long.
pub(super) fn queue_position(db: &Connection, seq: i64) -> Result<u32, StoreError> {
    let count = "SELECT count(*) FROM (SELECT 1 FROM jobs WHERE state = 'queued' AND seq < ?1 LIMIT 1000)";
    Ok(db.prepare_cached(count)?.query_row([seq], |row| row.get(0))?)
}

/// When the next job is to be cancelled.
pub(super) fn next_deadline(db: &Connection) -> Result<Option<i64>, StoreError> {
    let next = "SELECT min(cancel_ms) FROM jobs WHERE cancel_ms IS NOT NULL AND finished_ms IS NULL";
    Ok(db.prepare_cached(next)?.query_row([], |row| row.get(0))?)
}

/// The jobs that are to be cancelled by now.
pub(super) fn due(db: &Connection, now_ms: i64) -> Result<Vec<JobId>, StoreError> {
    let due = "SELECT id FROM jobs WHERE cancel_ms <= ?1 AND cancel_ms IS NOT NULL AND finished_ms IS NULL";
    let mut find = db.prepare_cached(due)?;
    Ok(find.query_map([now_ms], |row| parsed(row, 0))?.collect::<Result<_, _>>()?)
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
        cancel_ms: row.get("cancel_ms")?,
        rounds: row.get("rounds")?,
        error_estimate: row.get("error_estimate")?,
        stop_reason: row.get("stop_reason")?,
        plan: json_of(row, "plan")?,
        stats: json_of(row, "stats")?,
        owner: Owner::of(row.get::<_, String>("owner")?),
        label: row.get("label")?,
        bytes: row.get("bytes")?,
        history: json_of(row, "history")?
            .and_then(|list| serde_json::from_value(list).ok())
            .unwrap_or_default(),
        failure: failure.map(|(code, detail)| Failure { code, detail }),
        artifacts: Vec::new(),
    })
}

fn json_of(row: &Row<'_>, column: &str) -> Result<Option<Value>, rusqlite::Error> {
    let text: Option<String> = row.get(column)?;
    Ok(text.and_then(|text| serde_json::from_str(&text).ok()))
}

pub(super) fn state_of(row: &Row<'_>, column: usize) -> Result<JobState, rusqlite::Error> {
    let text: String = row.get(column)?;
    let found = JobState::ALL.into_iter().find(|state| state.as_str() == text);
    found.ok_or_else(|| unreadable(column, format!("unknown state {text:?}").into()))
}

pub(super) fn parsed<T>(row: &Row<'_>, column: usize) -> Result<T, rusqlite::Error>
where
    T: std::str::FromStr<Err: std::error::Error + Send + Sync + 'static>,
{
    row.get::<_, String>(column)?.parse().map_err(|error: T::Err| unreadable(column, error.into()))
}

fn unreadable(column: usize, error: Box<dyn std::error::Error + Send + Sync>) -> rusqlite::Error {
    rusqlite::Error::FromSqlConversionFailure(column, Type::Text, error)
}
