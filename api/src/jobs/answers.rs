//! Answers that were given before and are true still: asking for a job many times costs one look at the database.

use super::{JobId, Owner};
use axum::body::Bytes;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// More than are asked for at once; some megabytes.
const MOST: usize = 2048;

/// The answer to a request for a job.
#[derive(Clone, Debug)]
pub struct Answer {
    /// The body.
    pub body: Bytes,
    /// Its strong tag, with quotes.
    pub etag: String,
    /// When to look again.
    pub retry_after_s: Option<u32>,
}

/// Answers that hold as long as nothing is committed.
#[derive(Debug, Default)]
pub(super) struct Answers(Mutex<Held>);

#[derive(Debug, Default)]
struct Held {
    /// The number of commits at which they were made.
    commits: u64,
    answers: HashMap<JobId, (Owner, Arc<Answer>)>,
}

impl Answers {
    pub(super) fn get(&self, commits: u64, owner: &Owner, id: JobId) -> Option<Arc<Answer>> {
        let held = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let (whose, answer) = held.answers.get(&id).filter(|_| held.commits == commits)?;
        (whose == owner).then(|| Arc::clone(answer))
    }

    /// Keeps an answer to what was read when there were `commits`.
    pub(super) fn put(&self, commits: u64, owner: &Owner, id: JobId, answer: &Arc<Answer>) {
        let mut held = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if held.commits < commits || held.answers.len() >= MOST {
            held.answers.clear();
            held.commits = held.commits.max(commits);
        }
        if held.commits == commits {
            held.answers.insert(id, (owner.clone(), Arc::clone(answer)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_holds_until_the_next_commit_and_for_its_owner_alone() {
        let (answers, id, owner) = (Answers::default(), JobId::fresh(), Owner::of("a"));
        let answer = Arc::new(Answer { body: Bytes::new(), etag: String::new(), retry_after_s: None });
        answers.put(3, &owner, id, &answer);
        assert!(answers.get(3, &owner, id).is_some());
        assert!(answers.get(3, &Owner::anonymous(), id).is_none());
        assert!(answers.get(4, &owner, id).is_none());
        answers.put(4, &owner, JobId::fresh(), &answer);
        answers.put(3, &owner, id, &answer);
        assert!(answers.get(4, &owner, id).is_none(), "what was read before the commit is not kept after it");
    }
}
