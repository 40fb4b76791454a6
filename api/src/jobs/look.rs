//! Looking at jobs: how far they are, their pictures, their scenes.

use super::service::{Jobs, PreviewState, Status, heard_of};
use super::{Answer, Artifact, Job, JobId, JobState, Milestone, Owner, Page, StoreError, query};
use std::sync::Arc;
use std::time::Duration;
use tokio::time::Instant;

impl Jobs {
    /// A job and how far it is.
    pub async fn status(&self, owner: &Owner, id: JobId) -> Result<Status, StoreError> {
        // Looked up first: if the job ends in between, the database has the news.
        let live = self.registry.get(id);
        let whose = owner.clone();
        let find = move |db: &rusqlite::Connection| {
            let job = query::get(db, &whose, id)?;
            let waits = job.state == JobState::Queued;
            let position = waits.then(|| query::queue_position(db, job.seq)).transpose()?;
            Ok((job, position))
        };
        let (mut job, queue_position) = self.store.read(find).await?;
        let live = live.filter(|_| job.state == JobState::Running);
        if let Some(live) = &live {
            job.history = live.history();
        }
        let progress = live.map(|live| live.progress());
        let seconds_per_job = self.seconds_per_job();
        Ok(Status { expires_ms: self.expiry(&job), job, progress, queue_position, seconds_per_job })
    }

    fn expiry(&self, job: &Job) -> Option<i64> {
        job.finished_ms.map(|finished| finished.saturating_add(self.keep_age_ms))
    }

    /// The answer about a job, made anew only if something may have changed.
    pub async fn answer(
        &self,
        owner: &Owner,
        id: JobId,
        write: impl FnOnce(Status) -> Answer,
    ) -> Result<Arc<Answer>, StoreError> {
        let commits = self.store.commits();
        if let Some(answer) = self.answers.get(commits, owner, id) {
            return Ok(answer);
        }
        let status = self.status(owner, id).await?;
        let changes_by_itself = status.job.state == JobState::Running;
        let answer = Arc::new(write(status));
        if !changes_by_itself {
            self.answers.put(commits, owner, id, &answer);
        }
        Ok(answer)
    }

    /// The same, once the job is done or the time is over.
    pub async fn status_within(
        &self,
        owner: &Owner,
        id: JobId,
        wait: Duration,
    ) -> Result<Status, StoreError> {
        let deadline = Instant::now() + wait;
        let mut changes = self.registry.listen();
        loop {
            let status = self.status(owner, id).await?;
            if status.job.state.is_done() || self.registry.is_draining() {
                return Ok(status);
            }
            if tokio::time::timeout_at(deadline, heard_of(&mut changes, id)).await.is_err() {
                return Ok(status);
            }
        }
    }

    /// Jobs, newest first.
    pub async fn list(&self, page: Page) -> Result<Vec<Status>, StoreError> {
        let jobs = self.store.read(move |db| query::list(db, &page)).await?;
        let status = |job: Job| {
            let live = self.registry.get(job.id).filter(|_| job.state == JobState::Running);
            let progress = live.map(|live| live.progress());
            let seconds_per_job = self.seconds_per_job();
            Status { expires_ms: self.expiry(&job), job, progress, queue_position: None, seconds_per_job }
        };
        Ok(jobs.into_iter().map(status).collect())
    }

    /// A picture; `Err` holds the state of a job that has no such picture.
    pub async fn artifact(
        &self,
        owner: &Owner,
        id: JobId,
        name: &str,
    ) -> Result<Result<Artifact, JobState>, StoreError> {
        let job = self.status(owner, id).await?.job;
        let found = job.artifacts.into_iter().find(|artifact| artifact.name == name);
        Ok(found.ok_or(job.state))
    }

    /// The bytes of a picture.
    pub async fn artifact_bytes(&self, id: JobId, artifact: Artifact) -> Result<Vec<u8>, StoreError> {
        let name = artifact.name.clone();
        if let Some(data) = self.store.read(move |db| query::artifact_data(db, id, &name)).await? {
            return Ok(data);
        }
        let path = self.files.artifact_path(id, &artifact);
        let read = tokio::task::spawn_blocking(move || std::fs::read(path)).await;
        // A job without its files has just been deleted.
        read.ok().and_then(Result::ok).ok_or(StoreError::NotFound)
    }

    /// The scene of a job, as it came.
    pub async fn scene(&self, owner: &Owner, id: JobId) -> Result<String, StoreError> {
        self.status(owner, id).await?;
        if let Some(text) = self.store.read(move |db| query::scene(db, id)).await? {
            return Ok(text);
        }
        let files = self.files.clone();
        let read = tokio::task::spawn_blocking(move || files.scene(id)).await;
        read.ok().and_then(Result::ok).ok_or(StoreError::NotFound)
    }

    /// The picture so far.
    pub async fn preview(&self, owner: &Owner, id: JobId) -> Result<PreviewState, StoreError> {
        let found = self.artifact(owner, id, "image.png").await?;
        if let Some(preview) = self.registry.get(id).and_then(|live| live.preview()) {
            let encoded = tokio::task::spawn_blocking(move || preview.png()).await;
            return encoded.ok().flatten().map(PreviewState::Ready).ok_or(StoreError::NotCommitted);
        }
        Ok(match found {
            Ok(artifact) => PreviewState::Final(self.artifact_bytes(id, artifact).await?),
            Err(state) => PreviewState::Nothing(state),
        })
    }

    /// The estimated error of a job against time, so far.
    pub async fn history(&self, owner: &Owner, id: JobId) -> Result<(String, Vec<Milestone>), StoreError> {
        let job = self.status(owner, id).await?.job;
        Ok((job.name, job.history))
    }
}
