//! The tables of the database, and how those of an older service become those of this one.

use super::StoreError;
use rusqlite::Connection;

/// Each brings the tables from one version to the next; what has run once is never changed.
const STEPS: [&str; 3] = [JOBS, OWNERS, DEADLINES];

const JOBS: &str = "
CREATE TABLE jobs (
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
CREATE INDEX jobs_by_state ON jobs (state, seq);
CREATE TABLE artifacts (
    job TEXT NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    name TEXT NOT NULL,
    attempt INTEGER NOT NULL,
    sha256 TEXT NOT NULL,
    PRIMARY KEY (job, name)
) STRICT;
CREATE TABLE idempotency (
    key TEXT PRIMARY KEY,
    fingerprint TEXT NOT NULL,
    job TEXT NOT NULL REFERENCES jobs (id) ON DELETE CASCADE
) STRICT;
";

/// Keys and what belongs to them, assets, what has expired. `waiting` counts the unfinished jobs of each owner,
/// so that a long queue costs nothing at admission.
const OWNERS: &str = "
ALTER TABLE jobs ADD COLUMN owner TEXT NOT NULL DEFAULT '';
ALTER TABLE jobs ADD COLUMN label TEXT;
ALTER TABLE jobs ADD COLUMN bytes INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN history TEXT;
CREATE INDEX idempotency_by_job ON idempotency (job);
CREATE INDEX jobs_by_owner ON jobs (owner, seq);
CREATE INDEX jobs_by_owner_and_state ON jobs (owner, state, seq);
CREATE INDEX jobs_by_end ON jobs (finished_ms) WHERE finished_ms IS NOT NULL;
ALTER TABLE artifacts ADD COLUMN data BLOB;
CREATE TABLE scenes (
    job TEXT PRIMARY KEY REFERENCES jobs (id) ON DELETE CASCADE,
    text TEXT NOT NULL
) STRICT;
CREATE TABLE keys (
    id TEXT PRIMARY KEY,
    name TEXT NOT NULL,
    hash BLOB NOT NULL,
    created_ms INTEGER NOT NULL,
    revoked_ms INTEGER
) STRICT;
CREATE TABLE assets (
    owner TEXT NOT NULL,
    sha256 TEXT NOT NULL,
    bytes INTEGER NOT NULL,
    used_ms INTEGER NOT NULL,
    PRIMARY KEY (owner, sha256)
) STRICT;
CREATE TABLE job_assets (
    job TEXT NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    sha256 TEXT NOT NULL,
    PRIMARY KEY (job, sha256)
) STRICT;
CREATE INDEX job_assets_by_asset ON job_assets (sha256);
CREATE TABLE expired (
    id TEXT PRIMARY KEY,
    owner TEXT NOT NULL,
    expired_ms INTEGER NOT NULL
) STRICT;
CREATE INDEX expired_by_time ON expired (expired_ms);
CREATE TABLE waiting (
    owner TEXT PRIMARY KEY,
    queued INTEGER NOT NULL,
    running INTEGER NOT NULL
) STRICT;
INSERT INTO waiting SELECT owner, sum(state = 'queued'), sum(state = 'running') FROM jobs GROUP BY owner;
CREATE TRIGGER job_comes AFTER INSERT ON jobs BEGIN
    INSERT INTO waiting VALUES (NEW.owner, NEW.state = 'queued', NEW.state = 'running')
    ON CONFLICT DO UPDATE SET queued = queued + excluded.queued, running = running + excluded.running;
END;
CREATE TRIGGER job_moves AFTER UPDATE OF state ON jobs BEGIN
    UPDATE waiting SET queued = queued + (NEW.state = 'queued') - (OLD.state = 'queued'),
        running = running + (NEW.state = 'running') - (OLD.state = 'running') WHERE owner = NEW.owner;
END;
CREATE TRIGGER job_goes AFTER DELETE ON jobs BEGIN
    UPDATE waiting SET queued = queued - (OLD.state = 'queued'),
        running = running - (OLD.state = 'running') WHERE owner = OLD.owner;
END;
";

/// When a job is cancelled if it is not done.
const DEADLINES: &str = "
ALTER TABLE jobs ADD COLUMN cancel_ms INTEGER;
CREATE INDEX jobs_by_deadline ON jobs (cancel_ms) WHERE cancel_ms IS NOT NULL AND finished_ms IS NULL;
";

/// Makes the tables that are missing. Two processes may try at once: one of them finds nothing left to do.
pub(super) fn create_tables(db: &Connection) -> Result<(), StoreError> {
    db.execute_batch("BEGIN IMMEDIATE")?;
    let outcome = take_steps(db);
    db.execute_batch(if outcome.is_ok() { "COMMIT" } else { "ROLLBACK" })?;
    outcome
}

fn take_steps(db: &Connection) -> Result<(), StoreError> {
    let version: usize = db.pragma_query_value(None, "user_version", |row| row.get(0))?;
    if version > STEPS.len() {
        return Err(StoreError::Newer);
    }
    for step in &STEPS[version..] {
        db.execute_batch(step)?;
    }
    db.pragma_update(None, "user_version", STEPS.len())?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tables_of_an_older_service_are_brought_up_to_date() {
        let db = Connection::open_in_memory().unwrap();
        db.execute_batch(JOBS).unwrap();
        let old = "INSERT INTO jobs (id, state, name, width, height, created_ms)
                   VALUES ('a', 'queued', '', 1, 1, 0), ('b', 'succeeded', '', 1, 1, 0)";
        db.execute_batch(&format!("PRAGMA user_version = 1; {old}")).unwrap();
        create_tables(&db).unwrap();
        create_tables(&db).unwrap();
        let counted = |db: &Connection| {
            db.query_row("SELECT queued, running FROM waiting WHERE owner = ''", [], |row| {
                Ok((row.get::<_, u32>(0)?, row.get::<_, u32>(1)?))
            })
        };
        assert_eq!(counted(&db), Ok((1, 0)));
        db.execute_batch("UPDATE jobs SET state = 'running' WHERE id = 'a'").unwrap();
        assert_eq!(counted(&db), Ok((0, 1)));
        db.execute_batch("DELETE FROM jobs WHERE id = 'a'").unwrap();
        assert_eq!(counted(&db), Ok((0, 0)));
    }

    #[test]
    fn the_tables_of_a_newer_service_are_left_alone() {
        let db = Connection::open_in_memory().unwrap();
        db.execute_batch("PRAGMA user_version = 99").unwrap();
        assert!(matches!(create_tables(&db), Err(StoreError::Newer)));
    }
}
