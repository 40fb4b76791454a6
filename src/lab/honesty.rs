//! Whether a render that stops by its own estimate of the error is as good as it says.

use super::run::Timed;
use super::{LabError, Reference, Subject};
use crate::render::LEAST_ROUNDS;
use serde_json::json;

/// The errors that are asked for.
pub const TARGETS: [f64; 3] = [0.1, 0.05, 0.02];

/// What became of many renders that were asked for one error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Honesty {
    /// The error asked for.
    pub target: f64,
    /// Renders that stopped by it.
    pub stopped: u32,
    /// Of those, whose true error was within it.
    pub within: u32,
    /// Renders whose time was up before.
    pub not_reached: u32,
    /// Largest true error of one that stopped.
    pub worst: f64,
    /// Mean over those that stopped within: CPU seconds over those at which the true error first was within.
    pub waste: f64,
}

/// The state of a render at a milestone.
struct Look {
    rounds: u32,
    cpu: f64,
    estimate: f64,
    truth: f64,
}

/// Renders with so many seeds. One render serves all targets: that with a coarser target is its beginning.
///
/// # Errors
/// If the scene cannot be rendered.
pub fn honesty(
    subject: &Subject<'_>,
    reference: &Reference,
    seeds: u32,
    seconds: f64,
) -> Result<Vec<Honesty>, LabError> {
    let mut table = TARGETS.map(|target| Honesty { target, ..Honesty::default() });
    for seed in 0..seeds {
        let looks = looks(subject, reference, u64::from(seed) + 1000, seconds)?;
        table.iter_mut().for_each(|row| row.add(&looks));
    }
    for row in &mut table {
        row.waste /= f64::from(row.within.max(1));
    }
    Ok(table.to_vec())
}

fn looks(
    subject: &Subject<'_>,
    reference: &Reference,
    seed: u64,
    seconds: f64,
) -> Result<Vec<Look>, LabError> {
    let finest = TARGETS.into_iter().fold(f64::INFINITY, f64::min);
    let mut timed = Timed::new(subject.scene(&json!({}), seed)?);
    let mut looks = Vec::new();
    loop {
        timed.run_to_milestone()?;
        let truth = reference.judge(&timed.render.image())?.relative;
        let estimate = timed.render.error_estimate().map_or(f64::INFINITY, f64::from);
        let rounds = timed.render.rounds();
        looks.push(Look { rounds, cpu: timed.cpu, estimate, truth });
        if (rounds >= LEAST_ROUNDS && estimate <= finest) || timed.cpu > seconds {
            return Ok(looks);
        }
    }
}

impl Honesty {
    /// The part of those that stopped which is within the target; `None` if none stopped.
    #[must_use]
    pub fn share(&self) -> Option<f64> {
        (self.stopped > 0).then(|| f64::from(self.within) / f64::from(self.stopped))
    }

    fn add(&mut self, looks: &[Look]) {
        let stop = looks.iter().find(|l| l.rounds >= LEAST_ROUNDS && l.estimate <= self.target);
        let Some(stop) = stop else {
            self.not_reached += 1;
            return;
        };
        self.stopped += 1;
        self.worst = self.worst.max(stop.truth);
        if stop.truth <= self.target {
            self.within += 1;
            let need = looks.iter().find(|l| l.truth <= self.target).map_or(stop.cpu, |l| l.cpu);
            self.waste += stop.cpu / need;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn look(rounds: u32, cpu: f64, estimate: f64, truth: f64) -> Look {
        Look { rounds, cpu, estimate, truth }
    }

    #[test]
    fn a_render_that_stops_too_early_is_not_within() {
        let mut row = Honesty { target: 0.1, ..Honesty::default() };
        row.add(&[look(1, 1.0, 0.05, 0.2), look(2, 2.0, 0.09, 0.12), look(3, 3.0, 0.08, 0.09)]);
        row.add(&[look(1, 1.0, 0.3, 0.08), look(2, 3.0, 0.09, 0.05)]);
        row.add(&[look(1, 1.0, 0.3, 0.3), look(2, 2.0, 0.2, 0.2)]);
        assert_eq!((row.stopped, row.within, row.not_reached), (2, 1, 1));
        assert_eq!((row.share(), Honesty::default().share()), (Some(0.5), None));
        assert_eq!((row.worst, row.waste), (0.12, 3.0));
    }
}
