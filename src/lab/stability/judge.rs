//! What became of one method in one scene.

use super::{Case, Truth};
use crate::image_io::LinearImage;

/// Standard errors that the mean of a few renders may be off.
const SIGMAS: f64 = 5.0;

/// With more noise than this in the mean nothing can be told of its error.
const TOO_NOISY: f64 = 0.25;

/// Noise that a render knows of, at least, where its mean is too noisy to tell.
const OWNED_UP: f64 = 0.05;

/// What became of it.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// Finite, and right within its tolerance and noise.
    Right,
    /// Finite; nothing else is known.
    Finite,
    /// Finite, and so noisy that nothing can be told; its own estimate of the error says so.
    Noisy,
    /// Wrong, and a warning says so before it is rendered.
    Warned,
    /// Wrong in a way that the documentation of the method states.
    Known(&'static str),
    /// Refused, with the code and at the place that it should be.
    Refused,
    /// Wrong, without a word.
    Wrong,
    /// A warning that should be given was not.
    Unwarned(String),
    /// Not refused, or with other words; the first of them.
    NotRefused(String),
    /// The render failed, or did not end in time.
    Failed(String),
}

/// One method in one scene.
#[derive(Clone, Debug)]
pub struct Cell {
    /// The method.
    pub method: String,
    /// What became of it.
    pub outcome: Outcome,
    /// Relative error of the mean; where the truth is zero, the mean itself.
    pub error: Option<f64>,
    /// Standard error of that.
    pub noise: Option<f64>,
    /// The renderer's own estimate of a pixel's relative error.
    pub own: Option<f64>,
    /// CPU seconds of one render, with its plan.
    pub cpu: f64,
    /// The codes of the warnings.
    pub warnings: Vec<&'static str>,
    /// The picture.
    pub picture: Option<LinearImage>,
}

/// A mean over renders of several seeds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mean {
    pub(super) value: f64,
    pub(super) standard_error: f64,
}

impl Mean {
    pub(super) fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let value = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|v| (v - value).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
        Self { value, standard_error: (variance / n).sqrt() }
    }
}

impl Outcome {
    /// True if this must not happen.
    #[must_use]
    pub fn is_fault(&self) -> bool {
        match self {
            Self::Right | Self::Finite | Self::Noisy | Self::Warned | Self::Known(_) | Self::Refused => false,
            Self::Wrong | Self::Unwarned(_) | Self::NotRefused(_) | Self::Failed(_) => true,
        }
    }

    /// In one word.
    #[must_use]
    pub fn word(&self) -> &'static str {
        match self {
            Self::Right => "right",
            Self::Finite => "finite",
            Self::Noisy => "noisy",
            Self::Warned => "warned",
            Self::Known(_) => "known limit",
            Self::Refused => "refused",
            Self::Wrong => "WRONG",
            Self::Unwarned(_) => "NOT WARNED",
            Self::NotRefused(_) => "NOT REFUSED",
            Self::Failed(_) => "FAILED",
        }
    }

    /// What more there is to say.
    #[must_use]
    pub fn detail(&self) -> Option<&str> {
        match self {
            Self::Known(reason) => Some(reason),
            Self::Unwarned(text) | Self::NotRefused(text) | Self::Failed(text) => Some(text),
            Self::Right | Self::Finite | Self::Noisy | Self::Warned | Self::Refused | Self::Wrong => None,
        }
    }
}

/// Judges a mean against what is known.
pub(super) fn judge(cell: &mut Cell, case: &Case, found: Mean, truth: Option<Mean>) {
    cell.outcome = Outcome::Finite;
    if let Some(truth) = truth {
        let scale = if truth.value == 0.0 { 1.0 } else { truth.value.abs() };
        let error = (found.value - truth.value) / scale;
        let noise = found.standard_error.hypot(truth.standard_error) / scale;
        (cell.error, cell.noise) = (Some(error), Some(noise));
        let right = error.abs() <= case.tolerance + SIGMAS * noise;
        let known = case.limits.iter().find(|(method, _)| cell.method.starts_with(method));
        let noisy = SIGMAS * noise > TOO_NOISY && cell.own.is_none_or(|own| own > OWNED_UP);
        cell.outcome = match (right, known) {
            (true, _) if SIGMAS * noise <= TOO_NOISY => Outcome::Right,
            _ if noisy => Outcome::Noisy,
            (_, Some((_, reason))) => Outcome::Known(reason),
            (_, None) if cell.warnings.is_empty() => Outcome::Wrong,
            (_, None) => Outcome::Warned,
        };
    }
    if let Some(missing) = case.warns.iter().find(|code| !cell.warnings.contains(code)) {
        cell.outcome = Outcome::Unwarned(format!("{missing} is missing"));
    }
}

/// Judges a scene that was refused, or was not.
pub(super) fn judge_refusal(case: &Case, issues: &[(String, &'static str)]) -> Outcome {
    let Truth::Refused(code, pointer) = case.truth else {
        return Outcome::Failed(issues.first().map_or_else(String::new, |i| format!("{} {}", i.0, i.1)));
    };
    if issues.iter().any(|(at, found)| at.starts_with(pointer) && *found == code.as_str()) {
        return Outcome::Refused;
    }
    let found = issues.first().map_or_else(|| "accepted".to_owned(), |i| format!("{} {}", i.0, i.1));
    Outcome::NotRefused(format!("{found}, not {pointer} {code}"))
}
