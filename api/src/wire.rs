//! What jobs, lists and samples look like in JSON. Inner types are never serialised themselves.

use crate::jobs::service::Status;
use crate::jobs::{Job, JobState, Milestone, Phase};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use utoipa::{IntoParams, ToSchema};

/// A render: a scene, what became of it, and where its pictures are.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Render)]
pub struct JobView {
    #[schema(format = Uuid)]
    id: String,
    state: JobState,
    /// True once nothing will change any more.
    done: bool,
    /// What is being done while it runs.
    phase: Option<Phase>,
    /// The scene's name.
    name: String,
    /// What its owner called it in `?label=`.
    label: Option<String>,
    width: u32,
    height: u32,
    /// From 0 to 1, a guess from the rule that will end the render.
    progress: f32,
    /// Rounds that are finished.
    rounds: u32,
    /// Estimated relative error of the picture.
    error_estimate: Option<f32>,
    /// Which limit ended the render: `error`, `seconds` or `rounds`.
    stop_reason: Option<String>,
    /// How many jobs wait before it, counted up to 1000.
    queue_position: Option<u32>,
    /// How often it was started.
    attempt: u32,
    #[schema(format = DateTime)]
    created_at: String,
    #[schema(format = DateTime)]
    started_at: Option<String>,
    #[schema(format = DateTime)]
    finished_at: Option<String>,
    /// When it is cancelled if it is not done by then, from `?cancel_after=`.
    #[schema(format = DateTime)]
    cancel_at: Option<String>,
    /// When it will be forgotten with its pictures.
    #[schema(format = DateTime)]
    expires_at: Option<String>,
    /// Estimated error against time, so far.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(required = false)]
    history: Option<Vec<Milestone>>,
    /// What runs, what is left out, and why.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(required = false, value_type = Option<Plan>)]
    plan: Option<Value>,
    /// Time per pass, photons per light, rays.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(required = false, value_type = Option<Object>)]
    stats: Option<Value>,
    error: Option<FailureView>,
    /// Addresses of what there is of it by now.
    links: BTreeMap<String, String>,
}

/// Why a render failed.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Failure)]
struct FailureView {
    code: String,
    detail: String,
}

impl JobView {
    /// The job in full.
    #[must_use]
    pub fn full(status: Status) -> Self {
        let Status { job, expires_ms, progress, queue_position, .. } = status;
        let links = links_of(&job);
        let known = progress.unwrap_or_default();
        let fraction = if job.state == JobState::Succeeded { 1.0 } else { known.fraction };
        Self {
            id: job.id.to_string(),
            state: job.state,
            done: job.state.is_done(),
            phase: progress.map(|progress| progress.phase),
            name: job.name,
            label: job.label,
            width: job.size[0],
            height: job.size[1],
            progress: fraction,
            rounds: known.rounds.max(job.rounds),
            error_estimate: known.error_estimate.or(job.error_estimate),
            stop_reason: job.stop_reason,
            queue_position,
            attempt: job.attempt,
            created_at: rfc3339(job.created_ms),
            started_at: job.started_ms.map(rfc3339),
            finished_at: job.finished_ms.map(rfc3339),
            cancel_at: job.cancel_ms.map(rfc3339),
            expires_at: expires_ms.map(rfc3339),
            history: Some(job.history),
            plan: job.plan,
            stats: job.stats,
            error: job.failure.map(|failure| FailureView { code: failure.code, detail: failure.detail }),
            links,
        }
    }

    /// The job as a line of a list or an event: without plan, stats and history.
    #[must_use]
    pub fn brief(mut status: Status) -> Self {
        status.job.plan = None;
        status.job.stats = None;
        Self { history: None, ..Self::full(status) }
    }
}

/// The address of a job.
#[must_use]
pub fn job_path(id: impl std::fmt::Display) -> String {
    format!("/v1/renders/{id}")
}

fn links_of(job: &Job) -> BTreeMap<String, String> {
    let base = job_path(job.id);
    let mut links = BTreeMap::from([("self".to_owned(), base.clone())]);
    let mut link = |name: &str, path: &str| links.insert(name.into(), format!("{base}/{path}"));
    link("scene", "scene.json");
    link("events", "events");
    link("chart", "chart.svg");
    if !job.state.is_done() {
        link("cancel", "cancel");
        link("preview", "preview.png");
    }
    if job.state == JobState::Succeeded {
        link("image", "image.png");
        link("exr", "image.exr");
    }
    for artifact in &job.artifacts {
        if artifact.name == "error.png" {
            link("error", &artifact.name);
            continue;
        }
        let Some(layer) = artifact.name.strip_prefix("layers/") else { continue };
        let Some((name, kind)) = layer.rsplit_once('.') else { continue };
        link(&format!("{}_{name}", if kind == "exr" { "exr" } else { "layer" }), &artifact.name);
    }
    links
}

/// A page of jobs.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = RenderList)]
pub struct JobList {
    /// Newest first; without plan, stats and history.
    pub renders: Vec<JobView>,
    /// What to send as `cursor` for the next page; none on the last.
    pub next_cursor: Option<String>,
}

/// The query of a list.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct ListQuery {
    /// Only jobs in this state.
    pub state: Option<JobState>,
    /// Only jobs with this label.
    pub label: Option<String>,
    /// Where the last page ended: its `next_cursor`.
    #[param(pattern = "^[0-9a-f]{1,15}$")]
    pub cursor: Option<String>,
    /// Jobs per page.
    #[param(minimum = 1, maximum = 100, default = 20)]
    pub limit: Option<u32>,
}

/// The query of a submission.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct CreateQuery {
    /// Only say whether the scene is valid, and what would be done.
    #[serde(default)]
    #[param(required = false)]
    pub validate_only: bool,
    /// The client's own name for the job; need not be unique.
    #[param(max_length = 200)]
    pub label: Option<String>,
    /// Seconds after which nobody waits for the picture any more: the job is cancelled if it is not done by then,
    /// counted from its submission.
    #[param(minimum = 1, maximum = 604_800)]
    pub cancel_after: Option<u32>,
}

/// What would run for a scene, what is left out, and why.
#[derive(Debug, ToSchema)]
pub struct Plan {
    /// One for every choice that the renderer makes.
    pub decisions: Vec<Decision>,
    /// What is allowed, but hardly meant.
    pub warnings: Vec<Warning>,
    /// Pairs of a light and an object that photons are sent for.
    pub windows: Vec<Value>,
    /// Memory that the render will need.
    pub memory_bytes: u64,
}

/// One choice of the renderer.
#[derive(Debug, ToSchema)]
pub struct Decision {
    /// What it is about.
    pub topic: String,
    /// False if it is left out.
    pub runs: bool,
    /// What was chosen.
    pub choice: String,
    /// Why.
    pub reason: String,
}

/// Something that is allowed, but hardly meant.
#[derive(Debug, ToSchema)]
pub struct Warning {
    /// Stable name of what it is.
    pub code: String,
    /// JSON pointer to the place, if there is one.
    pub pointer: Option<String>,
    /// One sentence.
    pub message: String,
}

/// The answer to a scene that was only to be validated.
#[derive(Debug, Serialize, ToSchema)]
pub struct Validated {
    /// Always true: what is not valid is a problem.
    pub valid: bool,
    /// What would be done.
    #[schema(value_type = Plan)]
    pub plan: Value,
}

/// A sample scene in the list.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Sample)]
pub struct SampleView {
    /// Its name in addresses.
    pub name: String,
    /// What the scene calls itself.
    pub title: String,
    /// Where its JSON is.
    pub href: String,
    /// Where a small picture of it is.
    pub picture: Option<String>,
}

/// All sample scenes.
#[derive(Debug, Serialize, ToSchema)]
pub struct SampleList {
    /// By name.
    pub scenes: Vec<SampleView>,
}

/// An asset that is there.
#[derive(Debug, Serialize, ToSchema)]
pub struct Asset {
    /// Its name in scenes and addresses.
    pub sha256: String,
    /// Its size.
    pub bytes: u64,
}

/// An API key, to be kept in a cookie of the web page.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SessionRequest {
    /// The token.
    pub key: String,
}

/// Whether this client may use the service.
#[derive(Debug, Serialize, ToSchema)]
pub struct Session {
    /// True if requests need a key.
    pub key_needed: bool,
    /// True if this client's requests are served.
    pub welcome: bool,
}

/// Health of the service.
#[derive(Debug, Serialize, ToSchema)]
pub struct Alive {
    /// Always true.
    pub alive: bool,
    /// Version of the service.
    pub version: String,
}

/// Readiness of the service.
#[derive(Debug, Serialize, ToSchema)]
pub struct Ready {
    /// Always true: otherwise the answer is a problem.
    pub ready: bool,
}

/// A problem in the sense of RFC 9457; some have more members.
#[derive(Debug, ToSchema)]
pub struct Problem {
    /// `urn:nephroid:problem:` and the code.
    #[schema(rename = "type")]
    pub r#type: String,
    /// The kind of problem in a few words.
    pub title: String,
    /// The status of the answer.
    pub status: u16,
    /// Stable name of the kind of problem.
    pub code: String,
    /// One sentence, for people.
    pub detail: String,
    /// Every place of a scene that is wrong.
    #[schema(required = false)]
    pub errors: Option<Vec<ProblemError>>,
    /// Seconds after which it is worth trying again.
    #[schema(required = false)]
    pub retry_after: Option<u32>,
}

/// One thing that is wrong with a scene.
#[derive(Debug, ToSchema)]
pub struct ProblemError {
    /// JSON pointer to the place.
    pub pointer: String,
    /// Stable name of what is wrong.
    pub code: String,
    /// One sentence.
    pub detail: String,
    /// Line in the text, from 1.
    #[schema(required = false)]
    pub line: Option<u64>,
    /// Column in the line, from 1.
    #[schema(required = false)]
    pub column: Option<u64>,
}

/// Milliseconds since 1970 as `2026-11-23T08:30:00.000Z`.
fn rfc3339(ms: i64) -> String {
    let (days, ms_of_day) = (ms.div_euclid(86_400_000), ms.rem_euclid(86_400_000));
    // Days to civil date (Hinnant): years begin in March, eras have 400 of them.
    let shifted = days + 719_468;
    let (era, day_of_era) = (shifted.div_euclid(146_097), shifted.rem_euclid(146_097));
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted_month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted_month + 2) / 5 + 1;
    let month = if shifted_month < 10 { shifted_month + 3 } else { shifted_month - 9 };
    let year = year_of_era + era * 400 + i64::from(month <= 2);
    let (seconds, millis) = (ms_of_day / 1000, ms_of_day % 1000);
    let (hour, minute, second) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}.{millis:03}Z")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_written_as_rfc_3339() {
        assert_eq!(rfc3339(0), "1970-01-01T00:00:00.000Z");
        // The leap day of 2000 lies between these two.
        assert_eq!(rfc3339(951_782_399_007), "2000-02-28T23:59:59.007Z");
        assert_eq!(rfc3339(951_868_800_000), "2000-03-01T00:00:00.000Z");
        assert_eq!(rfc3339(1_795_422_600_000), "2026-11-23T08:30:00.000Z");
    }
}
