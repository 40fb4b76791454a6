//! One attempt at one job, round by round, on the render thread.

use super::files::Files;
use super::live::{Live, Progress};
use super::sql::Outcome;
use super::{Failure, JobId};
use crate::engine::{LoadedScene, PlannedScene, RoundError, RunningRender};
use serde_json::Value;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A crash costs at most this much work, or one round where rounds are longer.
const CHECKPOINT_INTERVAL: Duration = Duration::from_secs(2);
/// The picture that people watch is renewed at most so often.
const PREVIEW_INTERVAL: Duration = Duration::from_millis(250);
/// Housekeeping (checkpoints, previews) takes at most one part in so many of the time.
const HOUSEKEEPING_SHARE: u32 = 20;

/// What happened in a turn.
#[derive(Debug)]
pub(super) enum Turn {
    /// There is more to do.
    Continue,
    /// The round was told to stop.
    Stopped,
    /// The attempt is over.
    Over(Result<Outcome, Failure>),
}

/// One attempt at one job.
pub(super) struct Attempt {
    pub(super) id: JobId,
    pub(super) fence: u32,
    /// Seconds of rendering that it has had, counted from what its rivals had when it came.
    pub(super) share: f64,
    pub(super) live: Arc<Live>,
    render: RunningRender,
    checkpoint: Chore,
    preview: Chore,
}

/// Something to be done now and then, more rarely if it takes long.
#[derive(Debug)]
struct Chore {
    due: Instant,
    interval: Duration,
}

impl Chore {
    fn new(due: Instant, interval: Duration) -> Self {
        Self { due, interval }
    }

    fn run(&mut self, work: impl FnOnce()) {
        let start = Instant::now();
        if start >= self.due {
            work();
            tracing::debug!(took = ?start.elapsed(), "housekeeping");
            self.due = Instant::now() + self.interval.max(start.elapsed() * HOUSEKEEPING_SHARE);
        }
    }
}

/// Reads the scene of a job again and plans it.
pub(super) fn prepare(files: &Files, id: JobId, limits: Limits) -> Result<(PlannedScene, Value), Failure> {
    let text = files.scene(id).map_err(|error| internal("scene", &error))?;
    let scene = LoadedScene::read(&text, limits.max_seconds).map_err(|issues| {
        let details: Vec<_> = issues.iter().map(|issue| issue.detail.as_str()).collect();
        Failure { code: "scene_invalid".into(), detail: details.join("; ") }
    })?;
    let planned = scene.plan();
    let (needed, most) = (planned.memory_bytes(), limits.max_memory);
    if needed > most {
        let detail = format!("The render would need {needed} bytes of memory; the limit is {most}.");
        return Err(Failure { code: "out_of_memory".into(), detail });
    }
    let report = planned.report();
    Ok((planned, report))
}

/// What one job may use.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    pub(super) max_seconds: f64,
    pub(super) max_memory: u64,
}

impl Attempt {
    pub(super) fn begin(
        (id, fence): (JobId, u32),
        planned: PlannedScene,
        live: Arc<Live>,
        files: &Files,
    ) -> Result<Self, Failure> {
        let saved = files.checkpoint(id).map_err(|error| internal("checkpoint", &error))?;
        let render = planned.begin(saved.as_deref());
        let now = Instant::now();
        let checkpoint = Chore::new(now + CHECKPOINT_INTERVAL, CHECKPOINT_INTERVAL);
        let preview = Chore::new(now, PREVIEW_INTERVAL);
        let attempt = Self { id, fence, share: 0.0, live, render, checkpoint, preview };
        if attempt.render.rounds() > 0 {
            attempt.live.round_finished(attempt.progress());
        }
        Ok(attempt)
    }

    /// Runs one round, and what is due after it.
    pub(super) fn take_turn(&mut self, files: &Files) -> Turn {
        // A checkpoint may be of a render that had just ended.
        if self.render.stop_reason().is_none() {
            match self.render.run_round(&self.live.control) {
                Ok(()) => {}
                Err(RoundError::Cancelled) => return Turn::Stopped,
                Err(RoundError::Failed { code, detail }) => {
                    return Turn::Over(Err(Failure { code: code.into(), detail }));
                }
            }
        }
        let over = self.render.stop_reason().is_some();
        if !over {
            self.preview.run(|| self.live.show(self.render.picture()));
        }
        // After the preview: who reads of a finished round finds the picture of it.
        self.live.round_finished(self.progress());
        if over {
            return Turn::Over(self.conclude(files));
        }
        self.checkpoint.run(|| save_checkpoint(files, self.id, &self.render));
        Turn::Continue
    }

    /// Puts the attempt aside so that a later one goes on from here.
    pub(super) fn put_aside(&self, files: &Files) {
        if self.render.rounds() > 0 {
            save_checkpoint(files, self.id, &self.render);
        }
    }

    pub(super) fn seconds(&self) -> f64 {
        self.render.seconds()
    }

    fn progress(&self) -> Progress {
        Progress {
            fraction: self.render.progress(),
            rounds: self.render.rounds(),
            error_estimate: self.render.error_estimate(),
        }
    }

    fn conclude(&self, files: &Files) -> Result<Outcome, Failure> {
        let encoding = |detail| {
            tracing::error!(job = %self.id, detail, "a picture could not be encoded");
            Failure::internal("The picture could not be encoded.")
        };
        let outputs = self.render.outputs().map_err(encoding)?;
        let save = |output: &crate::engine::Output| {
            files.save_artifact((self.id, self.fence), &output.name, &output.bytes)
        };
        let artifacts = outputs.iter().map(save).collect::<Result<_, _>>();
        Ok(Outcome {
            rounds: self.render.rounds(),
            error_estimate: self.render.error_estimate(),
            stop_reason: self.render.stop_reason().map(Into::into),
            stats: Some(self.render.stats()),
            failure: None,
            artifacts: artifacts.map_err(|error| internal("picture", &error))?,
        })
    }
}

fn save_checkpoint(files: &Files, id: JobId, render: &RunningRender) {
    if let Err(error) = files.save_checkpoint(id, &render.checkpoint()) {
        // The render goes on; only a crash would now cost more.
        tracing::error!(job = %id, %error, "a checkpoint could not be written");
    }
}

fn internal(what: &str, error: &std::io::Error) -> Failure {
    tracing::error!(what, %error, "a file of a job could not be used");
    Failure::internal(format!("The service could not use its {what} file."))
}
