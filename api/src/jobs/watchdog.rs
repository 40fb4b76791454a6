//! Ends a round that would go beyond the time of its job: rounds of large pictures take minutes, and jobs have a limit.

use super::live::Live;
use std::io;
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

/// A round that runs, and when it is cut off.
type Watched = (Instant, Arc<Live>);

/// A thread that watches one round at a time.
#[derive(Debug)]
pub(super) struct Watchdog(mpsc::Sender<Option<Watched>>);

impl Watchdog {
    pub(super) fn start() -> io::Result<Self> {
        let (sender, inbox) = mpsc::channel();
        std::thread::Builder::new().name("watchdog".into()).spawn(move || watch(&inbox))?;
        Ok(Self(sender))
    }

    /// Does something for a job that has so many seconds left.
    pub(super) fn during<T>(&self, live: &Arc<Live>, seconds_left: f64, work: impl FnOnce() -> T) -> T {
        let left = Duration::try_from_secs_f64(seconds_left.max(0.0)).unwrap_or(Duration::MAX);
        let deadline = Instant::now().checked_add(left);
        // The thread lives as long as this sender.
        let _ = self.0.send(deadline.map(|deadline| (deadline, Arc::clone(live))));
        let done = work();
        let _ = self.0.send(None);
        done
    }
}

fn watch(inbox: &mpsc::Receiver<Option<Watched>>) {
    let mut watched: Option<Watched> = None;
    loop {
        let next = match &watched {
            None => inbox.recv().map_err(|_| mpsc::RecvTimeoutError::Disconnected),
            Some((deadline, _)) => inbox.recv_timeout(deadline.saturating_duration_since(Instant::now())),
        };
        match next {
            Ok(new) => watched = new,
            Err(mpsc::RecvTimeoutError::Timeout) => {
                if let Some((_, live)) = watched.take() {
                    live.end_its_time();
                }
            }
            Err(mpsc::RecvTimeoutError::Disconnected) => return,
        }
    }
}
