//! The job database: one writer thread that commits in groups, and one connection for readers.

use super::JobState;
use rusqlite::{Connection, OpenFlags};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::time::Duration;
use tokio::sync::oneshot;

/// Most changes in one commit: enough to share the cost of the disk, few enough to answer soon.
const GROUP: usize = 256;
/// Another process (the one that adds keys) may hold the database this long.
const BUSY_TIME: Duration = Duration::from_secs(10);

/// Why the database did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// No such job.
    #[error("no such job")]
    NotFound,
    /// There was such a job, and its time is over.
    #[error("the job has expired")]
    Expired,
    /// The job's state does not allow it.
    #[error("a job that is {} cannot do that", .0.as_str())]
    IllegalMove(JobState),
    /// The attempt that asks is not the job's latest.
    #[error("the attempt is out of date")]
    StaleAttempt,
    /// As many jobs wait as may.
    #[error("{0} jobs wait already")]
    QueueFull(u32),
    /// As many jobs of this key are unfinished as may be.
    #[error("{0} jobs of this key are unfinished already")]
    TooManyJobs(u32),
    /// There is no room on the disk.
    #[error("the disk is full")]
    StorageFull,
    /// The database was written by a newer service.
    #[error("the database belongs to a newer nephroid-api")]
    Newer,
    /// The idempotency key was used for another request.
    #[error("the idempotency key belongs to another request")]
    KeyReused,
    /// The change was not committed, or the store has been closed.
    #[error("the change was not committed")]
    NotCommitted,
    /// Whatever SQLite says.
    #[error("database: {0}")]
    Sqlite(#[source] rusqlite::Error),
}

/// Tells whoever asked, once the group is committed or the disk turned out to be full.
type Reply = Box<dyn FnOnce(Result<(), StoreError>) + Send>;
/// One change.
type Command = Box<dyn FnOnce(&Connection) -> Reply + Send>;

/// The job database.
#[derive(Clone, Debug)]
pub(super) struct Store {
    commands: mpsc::Sender<Command>,
    reader: Arc<Mutex<Connection>>,
    commits: Arc<AtomicU64>,
}

impl Store {
    /// Opens the database, makes its tables if it has none, and starts its writer thread.
    pub(super) fn open(path: &Path) -> Result<Self, StoreError> {
        let writer = open_for_writing(path)?;
        let reader = Connection::open_with_flags(path, OpenFlags::SQLITE_OPEN_READ_ONLY)?;
        reader.busy_timeout(BUSY_TIME)?;
        let (commands, inbox) = mpsc::channel();
        let commits = Arc::<AtomicU64>::default();
        let counter = Arc::clone(&commits);
        std::thread::Builder::new()
            .name("store".into())
            .spawn(move || write_groups(&writer, &inbox, &counter))
            .map_err(|_| StoreError::NotCommitted)?;
        Ok(Self { commands, reader: Arc::new(Mutex::new(reader)), commits })
    }

    /// Grows with every commit, before anyone is told of it: what was read at a number is true while it stands.
    pub(super) fn commits(&self) -> u64 {
        self.commits.load(Ordering::SeqCst)
    }

    /// Makes a change and waits until it is on disk.
    pub(super) async fn write<T, F>(&self, change: F) -> Result<T, StoreError>
    where
        T: Send + 'static,
        F: FnOnce(&Connection) -> Result<T, StoreError> + Send + 'static,
    {
        self.send(change)?.await.map_err(|_| StoreError::NotCommitted)?
    }

    /// The same from a thread that may wait.
    pub(super) fn write_blocking<T, F>(&self, change: F) -> Result<T, StoreError>
    where
        T: Send + 'static,
        F: FnOnce(&Connection) -> Result<T, StoreError> + Send + 'static,
    {
        self.send(change)?.blocking_recv().map_err(|_| StoreError::NotCommitted)?
    }

    /// Makes a change some time, in order, and waits for nothing.
    pub(super) fn write_soon<F>(&self, change: F) -> Result<(), StoreError>
    where
        F: FnOnce(&Connection) -> Result<(), StoreError> + Send + 'static,
    {
        self.send(change).map(drop)
    }

    /// Makes a change, and returns as soon as it is made: a crash may still take it back. For what a later write
    /// holds against the database anyway.
    pub(super) fn write_early<T, F>(&self, change: F) -> Result<T, StoreError>
    where
        T: Send + 'static,
        F: FnOnce(&Connection) -> Result<T, StoreError> + Send + 'static,
    {
        let (sender, receiver) = oneshot::channel();
        let command: Command = Box::new(move |connection| {
            drop(sender.send(within_savepoint(connection, change)));
            Box::new(|_| ())
        });
        self.commands.send(command).map_err(|_| StoreError::NotCommitted)?;
        receiver.blocking_recv().map_err(|_| StoreError::NotCommitted)?
    }

    /// Reads what has been committed.
    pub(super) async fn read<T, F>(&self, query: F) -> Result<T, StoreError>
    where
        T: Send + 'static,
        F: FnOnce(&Connection) -> Result<T, StoreError> + Send + 'static,
    {
        let store = self.clone();
        let task = move || store.read_blocking(query);
        tokio::task::spawn_blocking(task).await.map_err(|_| StoreError::NotCommitted)?
    }

    /// The same from a thread that may wait.
    pub(super) fn read_blocking<T>(
        &self,
        query: impl FnOnce(&Connection) -> Result<T, StoreError>,
    ) -> Result<T, StoreError> {
        query(&self.reader.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn send<T, F>(&self, change: F) -> Result<oneshot::Receiver<Result<T, StoreError>>, StoreError>
    where
        T: Send + 'static,
        F: FnOnce(&Connection) -> Result<T, StoreError> + Send + 'static,
    {
        let (sender, receiver) = oneshot::channel();
        let command: Command = Box::new(move |connection| {
            let outcome = within_savepoint(connection, change);
            // Whoever asked may have gone; the change stands all the same.
            Box::new(move |committed| drop(sender.send(committed.and(outcome))))
        });
        self.commands.send(command).map_err(|_| StoreError::NotCommitted)?;
        Ok(receiver)
    }
}

/// Opens the database, and makes its tables if it has none.
pub(super) fn open_for_writing(path: &Path) -> Result<Connection, StoreError> {
    let writer = Connection::open(path)?;
    writer.busy_timeout(BUSY_TIME)?;
    writer.set_prepared_statement_cache_capacity(64);
    writer.pragma_update(None, "journal_mode", "WAL")?;
    // A job is acknowledged only once it would survive a power cut.
    writer.pragma_update(None, "synchronous", "FULL")?;
    writer.pragma_update(None, "foreign_keys", "ON")?;
    writer.pragma_update(None, "journal_size_limit", 16 << 20)?;
    super::schema::create_tables(&writer)?;
    Ok(writer)
}

fn write_groups(connection: &Connection, inbox: &mpsc::Receiver<Command>, commits: &AtomicU64) {
    while let Ok(first) = inbox.recv() {
        let group: Vec<_> = std::iter::once(first).chain(inbox.try_iter().take(GROUP - 1)).collect();
        let mut replies = Vec::with_capacity(group.len());
        let outcome = commit(connection, group, &mut replies);
        commits.fetch_add(1, Ordering::SeqCst);
        if let Err(error) = &outcome {
            tracing::error!(%error, "a group of changes was not committed");
        }
        let full = outcome.as_ref().is_err_and(is_full);
        for reply in replies {
            reply(match &outcome {
                Ok(()) => Ok(()),
                Err(_) if full => Err(StoreError::StorageFull),
                Err(_) => Err(StoreError::NotCommitted),
            });
        }
    }
}

fn commit(
    connection: &Connection,
    group: Vec<Command>,
    replies: &mut Vec<Reply>,
) -> Result<(), rusqlite::Error> {
    let transaction = connection.unchecked_transaction()?;
    for command in group {
        replies.push(command(&transaction));
        // Where SQLite had to take the whole transaction back (a full disk), what would follow must not stand alone.
        if transaction.is_autocommit() {
            return Err(rusqlite::Error::SqliteFailure(
                rusqlite::ffi::Error::new(rusqlite::ffi::SQLITE_FULL),
                None,
            ));
        }
    }
    transaction.commit()
}

fn is_full(error: &rusqlite::Error) -> bool {
    error.sqlite_error_code() == Some(rusqlite::ErrorCode::DiskFull)
}

impl From<rusqlite::Error> for StoreError {
    fn from(error: rusqlite::Error) -> Self {
        if is_full(&error) { Self::StorageFull } else { Self::Sqlite(error) }
    }
}

/// Runs one change so that its failure takes back nothing but itself.
fn within_savepoint<T>(
    connection: &Connection,
    change: impl FnOnce(&Connection) -> Result<T, StoreError>,
) -> Result<T, StoreError> {
    connection.execute_batch("SAVEPOINT one")?;
    let outcome = change(connection);
    let undo = if outcome.is_err() { "ROLLBACK TO one; RELEASE one" } else { "RELEASE one" };
    connection.execute_batch(undo)?;
    outcome
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jobs::sql::{self, NewJob, QueueLimits};

    #[test]
    fn the_journal_stays_small_however_much_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("jobs.sqlite");
        let store = Store::open(&path).unwrap();
        let bytes = |path: &Path| std::fs::metadata(path).unwrap().len();
        let limits = QueueLimits { queued: u32::MAX, unfinished: u32::MAX };
        for _ in 0..400 {
            let job = NewJob { scene: Some(" ".repeat(60_000)), ..NewJob::sample() };
            store.write_blocking(move |db| sql::insert(db, &job, limits).map(drop)).unwrap();
            store.read_blocking(super::super::query::counts).unwrap();
        }
        assert!(bytes(&path) > 20_000_000, "it was written");
        // SQLite carries it over every 4 MB.
        assert!(bytes(&path.with_extension("sqlite-wal")) < 8_000_000);
    }
}
