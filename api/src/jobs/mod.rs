//! Jobs: what one is, and the one function that moves it from state to state.
//!
//! `store` keeps them in SQLite (`schema` has the tables, `sql` and `query` the statements), `files` keeps large scenes,
//! checkpoints and pictures beside it, `assets` what scenes refer to, `keys` who may come; `retention` forgets, `deadlines` cancels
//! what nobody waits for any more, `scheduler` renders them (`attempt` is one render of one job, `watchdog` ends those that take
//! too long), `live` is what is known of a running job between two writes, and [`service::Jobs`] is all of it for the handlers.

mod answers;
mod assets;
mod attempt;
mod deadlines;
mod files;
mod keys;
mod live;
mod look;
mod query;
mod retention;
mod scheduler;
mod schema;
pub mod service;
mod sql;
mod store;
mod watchdog;

pub use answers::Answer;
pub(crate) use assets::is_sha256;
pub use assets::{Upload, UploadError};
pub use keys::{Key, KeyAdmin};
pub use live::{Change, Phase, Progress};
pub use sql::{Artifact, Page};
pub use store::StoreError;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;
use utoipa::ToSchema;
use uuid::Uuid;

/// The name of a job, unique for ever.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct JobId(Uuid);

impl JobId {
    /// A new name; names made later sort later.
    #[must_use]
    pub fn fresh() -> Self {
        Self(Uuid::now_v7())
    }
}

impl fmt::Display for JobId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0.hyphenated())
    }
}

impl FromStr for JobId {
    type Err = uuid::Error;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Uuid::try_parse(text).map(Self)
    }
}

/// Whose a job or an asset is: the id of an API key, or nobody's in particular.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Owner(Arc<str>);

impl Owner {
    /// Whoever comes without a key.
    #[must_use]
    pub fn anonymous() -> Self {
        Self::of("")
    }

    /// The owner of this key id.
    pub fn of(id: impl Into<Arc<str>>) -> Self {
        Self(id.into())
    }

    /// The key's id; empty for nobody in particular.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// True for whoever comes without a key.
    #[must_use]
    pub fn is_anonymous(&self) -> bool {
        self.0.is_empty()
    }

    /// A name that two owners may give to different things.
    fn scoped(&self, name: &str) -> String {
        // Names that clients give are visible ASCII, so that none can hold the separator.
        if self.is_anonymous() { name.to_owned() } else { format!("{}\n{name}", self.0) }
    }
}

/// The estimated error at one moment of a render.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Milestone {
    /// Rounds finished by then.
    pub rounds: u32,
    /// Seconds of rendering by then.
    pub seconds: f64,
    /// Estimated relative error by then.
    pub error: f32,
}

/// Where a job is in its life.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum JobState {
    /// Waits for a turn.
    Queued,
    /// Is being rendered.
    Running,
    /// Has its picture.
    Succeeded,
    /// Has an error instead of a picture.
    Failed,
    /// Was stopped by its owner.
    Cancelled,
}

/// What can happen to a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// An attempt begins.
    Start,
    /// The attempt made the picture.
    Finish,
    /// The attempt cannot make the picture.
    Fail,
    /// Its owner does not want it any more.
    Cancel,
    /// The attempt ended without a result: the service stopped, or had been killed.
    Requeue,
}

impl JobState {
    /// All states.
    pub const ALL: [Self; 5] = [Self::Queued, Self::Running, Self::Succeeded, Self::Failed, Self::Cancelled];

    /// The state after `event`; `None` if that cannot happen in this state.
    #[must_use]
    pub fn after(self, event: Event) -> Option<Self> {
        match (self, event) {
            (Self::Queued, Event::Start) => Some(Self::Running),
            (Self::Running, Event::Finish) => Some(Self::Succeeded),
            (Self::Running, Event::Fail) => Some(Self::Failed),
            (Self::Running, Event::Requeue) => Some(Self::Queued),
            (Self::Queued | Self::Running, Event::Cancel) => Some(Self::Cancelled),
            _ => None,
        }
    }

    /// True once nothing can happen any more.
    #[must_use]
    pub fn is_done(self) -> bool {
        match self {
            Self::Queued | Self::Running => false,
            Self::Succeeded | Self::Failed | Self::Cancelled => true,
        }
    }

    /// The state's name, on the wire and in the database.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Queued => "queued",
            Self::Running => "running",
            Self::Succeeded => "succeeded",
            Self::Failed => "failed",
            Self::Cancelled => "cancelled",
        }
    }
}

/// Why a job failed, in words for its owner.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// Stable name of the reason.
    pub code: String,
    /// One sentence.
    pub detail: String,
}

impl Failure {
    fn internal(detail: impl Into<String>) -> Self {
        Self { code: "internal".into(), detail: detail.into() }
    }
}

/// A job as the database knows it.
#[derive(Clone, Debug)]
pub struct Job {
    /// Position in the order of submission.
    pub seq: i64,
    /// Its name.
    pub id: JobId,
    /// Whose it is.
    pub owner: Owner,
    /// What its owner calls it.
    pub label: Option<String>,
    /// Where it is in its life.
    pub state: JobState,
    /// How often it was started. Also the fencing token: what an older attempt writes is refused.
    pub attempt: u32,
    /// How many of its attempts died with the service.
    pub deaths: u32,
    /// The scene's name.
    pub name: String,
    /// Pixels across and down.
    pub size: [u32; 2],
    /// When it was accepted, in milliseconds since 1970.
    pub created_ms: i64,
    /// When its latest attempt began.
    pub started_ms: Option<i64>,
    /// When it was done.
    pub finished_ms: Option<i64>,
    /// When it is cancelled if it is not done.
    pub cancel_ms: Option<i64>,
    /// Rounds in the picture.
    pub rounds: u32,
    /// Estimated error of the picture.
    pub error_estimate: Option<f32>,
    /// Which limit ended the render.
    pub stop_reason: Option<String>,
    /// What ran, what was left out and why.
    pub plan: Option<Value>,
    /// What the render counted.
    pub stats: Option<Value>,
    /// The estimated error against time.
    pub history: Vec<Milestone>,
    /// Why it failed.
    pub failure: Option<Failure>,
    /// Size of its scene and pictures.
    pub bytes: u64,
    /// The pictures it left.
    pub artifacts: Vec<Artifact>,
}

#[cfg(test)]
mod tests {
    use super::*;

    const EVENTS: [Event; 5] = [Event::Start, Event::Finish, Event::Fail, Event::Cancel, Event::Requeue];

    #[test]
    fn nothing_happens_to_a_job_that_is_done() {
        for state in JobState::ALL.into_iter().filter(|state| state.is_done()) {
            assert!(EVENTS.iter().all(|&event| state.after(event).is_none()), "{}", state.as_str());
        }
    }

    #[test]
    fn a_job_that_waits_can_only_start_or_be_cancelled() {
        let moves: Vec<_> = EVENTS.iter().filter_map(|&event| JobState::Queued.after(event)).collect();
        assert_eq!(moves, [JobState::Running, JobState::Cancelled]);
    }

    #[test]
    fn names_of_states_read_back() {
        for state in JobState::ALL {
            let read: JobState = serde_json::from_value(state.as_str().into()).unwrap();
            assert_eq!(read, state);
        }
    }
}
