//! What jobs, lists and samples look like in JSON. Inner types are never serialised themselves.

use crate::jobs::service::Status;
use crate::jobs::{Job, JobState};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;

/// A job as clients see it.
#[derive(Debug, Serialize)]
pub struct JobView {
    id: String,
    state: &'static str,
    /// True once nothing will change any more.
    done: bool,
    name: String,
    width: u32,
    height: u32,
    progress: f32,
    rounds: u32,
    error_estimate: Option<f32>,
    stop_reason: Option<String>,
    queue_position: Option<u32>,
    attempt: u32,
    created_at: String,
    started_at: Option<String>,
    finished_at: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    plan: Option<Value>,
    #[serde(skip_serializing_if = "Option::is_none")]
    stats: Option<Value>,
    error: Option<FailureView>,
    links: BTreeMap<String, String>,
}

#[derive(Debug, Serialize)]
struct FailureView {
    code: String,
    detail: String,
}

impl JobView {
    /// The job in full.
    #[must_use]
    pub fn full(status: Status) -> Self {
        let Status { job, progress, queue_position } = status;
        let links = links_of(&job);
        let known = progress.unwrap_or_default();
        let fraction = if job.state == JobState::Succeeded { 1.0 } else { known.fraction };
        Self {
            id: job.id.to_string(),
            state: job.state.as_str(),
            done: job.state.is_done(),
            name: job.name,
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
            plan: job.plan,
            stats: job.stats,
            error: job.failure.map(|failure| FailureView { code: failure.code, detail: failure.detail }),
            links,
        }
    }

    /// The job as a line of a list: without plan and stats.
    #[must_use]
    pub fn brief(mut status: Status) -> Self {
        status.job.plan = None;
        status.job.stats = None;
        Self::full(status)
    }
}

/// The address of a job.
#[must_use]
pub fn job_path(id: impl std::fmt::Display) -> String {
    format!("/v1/renders/{id}")
}

fn links_of(job: &Job) -> BTreeMap<String, String> {
    let base = job_path(job.id);
    let scene = format!("{base}/scene.json");
    let mut links = BTreeMap::from([("self".to_owned(), base.clone()), ("scene".to_owned(), scene)]);
    if !job.state.is_done() {
        links.insert("cancel".into(), format!("{base}/cancel"));
        links.insert("preview".into(), format!("{base}/preview.png"));
    }
    if job.state == JobState::Succeeded {
        links.insert("image".into(), format!("{base}/image.png"));
        links.insert("exr".into(), format!("{base}/image.exr"));
    }
    for artifact in &job.artifacts {
        if let Some(class) = artifact.name.strip_prefix("layers/") {
            let class = class.trim_end_matches(".png");
            links.insert(format!("layer_{class}"), format!("{base}/{}", artifact.name));
        }
    }
    links
}

/// A page of jobs.
#[derive(Debug, Serialize)]
pub struct JobList {
    /// Newest first.
    pub renders: Vec<JobView>,
    /// What to send as `cursor` for the next page; none on the last.
    pub next_cursor: Option<String>,
}

/// The query of a list.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ListQuery {
    /// Only jobs in this state.
    pub state: Option<JobState>,
    /// Where the last page ended.
    pub cursor: Option<String>,
    /// Jobs per page.
    pub limit: Option<u32>,
}

/// The query of a submission.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CreateQuery {
    /// Only say whether the scene is valid, and what would be done.
    #[serde(default)]
    pub validate_only: bool,
}

/// A sample scene in the list.
#[derive(Debug, Serialize)]
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
