//! One attempt at one job, round by round, on the render thread.

use super::assets::Assets;
use super::files::Files;
use super::live::{Live, Phase, Progress};
use super::sql::{Claim, NewArtifact, Outcome};
use super::{Failure, JobId, Owner, files};
use crate::engine::{LoadedScene, Output, PlannedScene, RoundError, RunningRender};
use crate::metrics::Metrics;
use serde_json::Value;
use std::io::{self, ErrorKind};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A crash costs at most this much work, or one round where rounds are longer.
const CHECKPOINT_INTERVAL: Duration = Duration::from_secs(2);
/// The picture that people watch is renewed at most so often.
const PREVIEW_INTERVAL: Duration = Duration::from_millis(250);
/// The pictures of a job together, up to this size, go into the database: one wait for the disk instead of one each.
const INLINE_BYTES: usize = 512 << 10;
/// Housekeeping (checkpoints, previews) takes at most one part in so many of the time.
const HOUSEKEEPING_SHARE: u32 = 20;
/// Previews that nobody has looked at since the last take less.
const UNSEEN_SHARE: u32 = 100;

/// What happened in a turn.
#[derive(Debug)]
pub(super) enum Turn {
    /// There is more to do.
    Continue,
    /// The round was told to stop.
    Stopped,
    /// The picture is made, and the disk has no room for it. The next turn tries again.
    NoRoom,
    /// The attempt is over.
    Over(Result<Outcome, Failure>),
}

/// One attempt at one job.
pub(super) struct Attempt {
    pub(super) id: JobId,
    pub(super) fence: u32,
    pub(super) owner: Owner,
    /// Seconds of rendering that it has had, counted from what its rivals had when it came.
    pub(super) share: f64,
    pub(super) live: Arc<Live>,
    began: Instant,
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

    /// Does it if it is due, and so that it takes at most one part in `share` of the time.
    fn run(&mut self, share: impl FnOnce() -> u32, work: impl FnOnce()) {
        let start = Instant::now();
        if start >= self.due {
            work();
            tracing::debug!(took = ?start.elapsed(), "housekeeping");
            self.due = Instant::now() + self.interval.max(start.elapsed() * share());
        }
    }
}

/// Reads a scene again and plans it.
pub(super) fn prepare(
    text: &str,
    (assets, owner): (&Assets, &Owner),
    limits: Limits,
) -> Result<(PlannedScene, Value), Failure> {
    let own = assets.of(owner.clone());
    let scene = LoadedScene::read(text, &own, limits.max_seconds).map_err(|issues| {
        let details: Vec<_> = issues.iter().map(|issue| issue.detail.as_str()).collect();
        Failure { code: "scene_invalid".into(), detail: details.join("; ") }
    })?;
    let planned = scene.plan();
    let (needed, most) = (planned.memory_bytes(), limits.max_memory);
    if needed > most {
        let detail = format!("The render would need {needed} bytes of memory; the limit is {most}.");
        return Err(Failure { code: "out_of_memory".into(), detail });
    }
    let (photons, most) = (planned.photons_per_round(), limits.max_photons);
    if photons > most {
        let detail = format!("A round would send {photons} photons; the limit is {most}.");
        return Err(Failure { code: "limit_exceeded".into(), detail });
    }
    let report = planned.report();
    Ok((planned, report))
}

/// What one job may use.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    pub(super) max_seconds: f64,
    pub(super) max_memory: u64,
    pub(super) max_photons: u64,
}

impl Attempt {
    pub(super) fn begin(
        claim: Claim,
        planned: PlannedScene,
        live: Arc<Live>,
        files: &Files,
    ) -> Result<Self, Failure> {
        let Claim { id, attempt: fence, owner, .. } = claim;
        let saved = files.checkpoint(id).map_err(|error| internal("checkpoint", &error))?;
        let render = planned.begin(saved.as_ref().map(|(_, render)| render.as_slice()));
        let now = Instant::now();
        let checkpoint = Chore::new(now + CHECKPOINT_INTERVAL, CHECKPOINT_INTERVAL);
        let preview = Chore::new(now, PREVIEW_INTERVAL);
        let attempt = Self { id, fence, owner, share: 0.0, live, began: now, render, checkpoint, preview };
        attempt.live.enter_phase(Phase::Rendering);
        if attempt.render.rounds() > 0 {
            attempt.live.resume(saved.map(|(history, _)| history).unwrap_or_default());
            attempt.live.round_finished(attempt.progress());
        }
        Ok(attempt)
    }

    /// Runs one round, and what is due after it.
    pub(super) fn take_turn(&mut self, files: &Files, metrics: &Metrics) -> Turn {
        let before = self.render.work();
        let turn = self.advance(files);
        metrics.worked(before, self.render.work());
        turn
    }

    fn advance(&mut self, files: &Files) -> Turn {
        // A checkpoint may be of a render that had just ended.
        if self.render.stop_reason().is_none() {
            match self.render.run_round(&self.live.control) {
                Ok(()) => {}
                Err(RoundError::Cancelled) if self.live.is_out_of_time() => return self.end_for_time(files),
                Err(RoundError::Cancelled) => return Turn::Stopped,
                Err(RoundError::Failed { code, detail }) => {
                    return Turn::Over(Err(Failure { code: code.into(), detail }));
                }
            }
        }
        let over = self.render.stop_reason().is_some();
        if !over {
            let share = || if self.live.was_looked_at() { HOUSEKEEPING_SHARE } else { UNSEEN_SHARE };
            self.preview.run(share, || self.live.show(self.render.picture()));
        }
        // After the preview: who reads of a finished round finds the picture of it.
        self.live.round_finished(self.progress());
        if over {
            return self.conclude(files);
        }
        let Self { checkpoint, render, live, id, .. } = self;
        checkpoint.run(|| HOUSEKEEPING_SHARE, || save_checkpoint(files, *id, live, render));
        Turn::Continue
    }

    /// Puts the attempt aside so that a later one goes on from here.
    pub(super) fn put_aside(&self, files: &Files) {
        if self.render.rounds() > 0 {
            save_checkpoint(files, self.id, &self.live, &self.render);
        }
    }

    /// Time since it began.
    pub(super) fn age(&self) -> Duration {
        self.began.elapsed()
    }

    pub(super) fn seconds(&self) -> f64 {
        self.render.seconds()
    }

    fn progress(&self) -> Progress {
        Progress {
            phase: Phase::Rendering,
            seconds: self.render.seconds(),
            fraction: self.render.progress(),
            rounds: self.render.rounds(),
            error_estimate: self.render.error_estimate(),
        }
    }

    /// The job has had its time within a round: its picture is that of the rounds before, if there are any.
    fn end_for_time(&self, files: &Files) -> Turn {
        if self.render.rounds() > 0 {
            return self.conclude(files);
        }
        let detail = "Not one round was finished in the time that the service gives a job.".into();
        Turn::Over(Err(Failure { code: "time_exceeded".into(), detail }))
    }

    fn conclude(&self, files: &Files) -> Turn {
        if self.live.control.is_cancelled() && !self.live.is_out_of_time() {
            return Turn::Stopped;
        }
        self.live.enter_phase(Phase::Encoding);
        let outputs = match self.render.outputs() {
            Ok(outputs) => outputs,
            Err(detail) => {
                tracing::error!(job = %self.id, detail, "a picture could not be encoded");
                return Turn::Over(Err(Failure::internal("The picture could not be encoded.")));
            }
        };
        match self.keep(files, outputs) {
            Ok(artifacts) => Turn::Over(Ok(self.outcome(artifacts))),
            Err(error) if error.kind() == ErrorKind::StorageFull => Turn::NoRoom,
            Err(error) => Turn::Over(Err(internal("picture", &error))),
        }
    }

    fn keep(&self, files: &Files, outputs: Vec<Output>) -> io::Result<Vec<NewArtifact>> {
        let small = outputs.iter().map(|output| output.bytes.len()).sum::<usize>() <= INLINE_BYTES;
        let keep = |output: Output| {
            let artifact = files::artifact_of(&output.name, self.fence, &output.bytes);
            if !small {
                files.save_artifact(self.id, &artifact, &output.bytes)?;
            }
            let bytes = output.bytes.len() as u64;
            Ok(NewArtifact { artifact, bytes, data: small.then_some(output.bytes) })
        };
        outputs.into_iter().map(keep).collect()
    }

    fn outcome(&self, artifacts: Vec<NewArtifact>) -> Outcome {
        Outcome {
            rounds: self.render.rounds(),
            error_estimate: self.render.error_estimate(),
            // Where none was reached the service cut the last round off.
            stop_reason: Some(self.render.stop_reason().unwrap_or("seconds").into()),
            stats: Some(self.render.stats()),
            history: self.live.history(),
            failure: None,
            artifacts,
        }
    }
}

fn save_checkpoint(files: &Files, id: JobId, live: &Live, render: &RunningRender) {
    if let Err(error) = files.save_checkpoint(id, &live.history(), &render.checkpoint()) {
        // The render goes on; only a crash would now cost more.
        tracing::error!(job = %id, %error, "a checkpoint could not be written");
    }
}

fn internal(what: &str, error: &std::io::Error) -> Failure {
    tracing::error!(what, %error, "a file of a job could not be used");
    Failure::internal(format!("The service could not use its {what} file."))
}
