//! `/v1/renders/{id}/events`: a job as it changes, as server-sent events.
//!
//! Each event is the whole job as it is then: a listener that missed some has missed nothing. Its id says which
//! state that is, so that one who comes back with `Last-Event-ID` is told only what is new to it.

use super::renders::parse_id;
use crate::AppState;
use crate::access::Caller;
use crate::jobs::service::{Status, heard_of};
use crate::jobs::{Change, JobId, Owner, StoreError};
use crate::problem::Problem;
use crate::wire::JobView;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, StatusCode};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use std::convert::Infallible;
use std::time::Duration;
use tokio::sync::broadcast;

/// People cannot see more, and small rounds are many.
const LEAST_INTERVAL: Duration = Duration::from_millis(100);
/// How often is looked whether the service stops.
const LOOK: Duration = Duration::from_secs(1);
/// Proxies cut connections on which nothing comes for long.
const KEEP_ALIVE: Duration = Duration::from_secs(15);

/// A job as it changes: server-sent events named `render`, each the whole job as in a list
///
/// Asking for the job now and then is always enough; this saves waiting. The stream ends with the job. Who comes
/// back after that with `Last-Event-ID` gets 204, by which browsers know not to try again.
#[utoipa::path(
    get, path = "/v1/renders/{id}/events", tag = "renders", security(("key" = [])),
    params(("id" = String, Path, format = Uuid), ("Last-Event-ID" = Option<String>, Header)),
    responses(
        (status = OK, body = String, content_type = "text/event-stream"),
        (status = NO_CONTENT, description = "The job was done at that event"), (status = 404), (status = 410)
    )
)]
pub(super) async fn get_events(
    State(app): State<AppState>,
    caller: Caller,
    Path(id): Path<String>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let id = parse_id(&id)?;
    let changes = app.jobs.listen();
    let status = app.jobs.status(&caller.0, id).await?;
    let seen = headers.get("last-event-id").and_then(|value| value.to_str().ok()).unwrap_or_default();
    if status.job.state.is_done() && seen == event_id(&status) {
        return Ok(StatusCode::NO_CONTENT.into_response());
    }
    let listener = Listener { app, owner: caller.0, id, changes, seen: seen.to_owned(), over: false };
    let stream = futures_util::stream::unfold(listener, |mut listener| async move {
        let event = listener.next().await?;
        Some((Ok::<_, Infallible>(event), listener))
    });
    Ok(Sse::new(stream).keep_alive(KeepAlive::new().interval(KEEP_ALIVE)).into_response())
}

/// Someone who wants to know.
struct Listener {
    app: AppState,
    owner: Owner,
    id: JobId,
    changes: broadcast::Receiver<Change>,
    seen: String,
    over: bool,
}

impl Listener {
    /// The next state that was not seen; `None` once there will be none.
    async fn next(&mut self) -> Option<Event> {
        while !self.over {
            let status = match self.app.jobs.status(&self.owner, self.id).await {
                Ok(status) => status,
                Err(StoreError::NotFound | StoreError::Expired) => {
                    self.over = true;
                    return Some(Event::default().event("gone").data("{}"));
                }
                Err(error) => {
                    tracing::warn!(%error, "a stream of events ends early");
                    return None;
                }
            };
            self.over = status.job.state.is_done();
            let id = event_id(&status);
            if id != self.seen {
                self.seen.clone_from(&id);
                let data = serde_json::to_string(&JobView::brief(status)).ok()?;
                return Some(Event::default().event("render").id(id).data(data));
            }
            self.wait().await?;
        }
        None
    }

    /// Returns when it is worth looking again; `None` when the service stops.
    async fn wait(&mut self) -> Option<()> {
        tokio::time::sleep(LEAST_INTERVAL).await;
        while tokio::time::timeout(LOOK, heard_of(&mut self.changes, self.id)).await.is_err() {
            if self.app.jobs.is_draining() {
                return None;
            }
        }
        Some(())
    }
}

/// Which state of the job this is, in the same words after any restart.
fn event_id(status: &Status) -> String {
    let job = &status.job;
    let rounds = status.progress.map_or(job.rounds, |progress| progress.rounds);
    let position = status.queue_position.map_or(String::new(), |position| format!("-{position}"));
    format!("{}-{}-{rounds}{position}", job.attempt, job.state.as_str())
}
