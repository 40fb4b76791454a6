//! The job database: one writer thread that commits in groups, and one connection for readers.

use super::JobState;
use rusqlite::{Connection, OpenFlags};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use tokio::sync::oneshot;

/// Most changes in one commit: enough to share the cost of the disk, few enough to answer soon.
const GROUP: usize = 64;

/// Why the database did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// No such job.
    #[error("no such job")]
    NotFound,
    /// The job's state does not allow it.
    #[error("a job that is {} cannot do that", .0.as_str())]
    IllegalMove(JobState),
    /// The attempt that asks is not the job's latest.
    #[error("the attempt is out of date")]
    StaleAttempt,
    /// As many jobs wait as may.
    #[error("{0} jobs wait already")]
    QueueFull(u32),
    /// The idempotency key was used for another request.
    #[error("the idempotency key belongs to another request")]
    KeyReused,
    /// The change was not committed, or the store has been closed.
    #[error("the change was not committed")]
    NotCommitted,
    /// Whatever SQLite says.
    #[error("database: {0}")]
    Sqlite(#[from] rusqlite::Error),
}

/// Tells whoever asked, once the group is committed.
type Reply = Box<dyn FnOnce() + Send>;
/// One change; its reply is dropped unheard if the commit fails.
type Command = Box<dyn FnOnce(&Connection) -> Reply + Send>;

/// The job database.
#[derive(Clone, Debug)]
pub(super) struct Store {
    commands: mpsc::Sender<Command>,
    reader: Arc<Mutex<Connection>>,
}

impl Store {
    /// Opens the database, makes its tables if it has none, and starts its writer thread.
    pub(super) fn open(path: &Path) -> Result<Self, StoreError> {
        let writer = Connection::open(path)?;
        writer.pragma_update(None, "journal_mode", "WAL")?;
        // A job is acknowledged only once it would survive a power cut.
        writer.pragma_update(None, "synchronous", "FULL")?;
        writer.pragma_update(None, "foreign_keys", "ON")?;
        writer.pragma_update(None, "journal_size_limit", 16 << 20)?;
        super::sql::create_tables(&writer)?;
        let reader = Connection::open_with_flags(path, OpenFlags::SQLITE_OPEN_READ_ONLY)?;
        let (commands, inbox) = mpsc::channel();
        std::thread::Builder::new()
            .name("store".into())
            .spawn(move || write_groups(&writer, &inbox))
            .map_err(|_| StoreError::NotCommitted)?;
        Ok(Self { commands, reader: Arc::new(Mutex::new(reader)) })
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

    /// Reads what has been committed.
    pub(super) async fn read<T, F>(&self, query: F) -> Result<T, StoreError>
    where
        T: Send + 'static,
        F: FnOnce(&Connection) -> Result<T, StoreError> + Send + 'static,
    {
        let reader = Arc::clone(&self.reader);
        let task = move || query(&reader.lock().unwrap_or_else(PoisonError::into_inner));
        tokio::task::spawn_blocking(task).await.map_err(|_| StoreError::NotCommitted)?
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
            Box::new(move || drop(sender.send(outcome)))
        });
        self.commands.send(command).map_err(|_| StoreError::NotCommitted)?;
        Ok(receiver)
    }
}

fn write_groups(connection: &Connection, inbox: &mpsc::Receiver<Command>) {
    while let Ok(first) = inbox.recv() {
        let group: Vec<_> = std::iter::once(first).chain(inbox.try_iter().take(GROUP - 1)).collect();
        match commit(connection, group) {
            Ok(replies) => replies.into_iter().for_each(|reply| reply()),
            Err(error) => tracing::error!(%error, "a group of changes was not committed"),
        }
    }
}

fn commit(connection: &Connection, group: Vec<Command>) -> Result<Vec<Reply>, rusqlite::Error> {
    let transaction = connection.unchecked_transaction()?;
    let replies = group.into_iter().map(|command| command(&transaction)).collect();
    transaction.commit()?;
    Ok(replies)
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
