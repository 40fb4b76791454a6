//! What the methods should come to: a long render by an unbiased estimator, with its own standard error.

use super::methods::all_can_be_met;
use super::run::Timed;
use super::{Budget, LabError, Subject, Task};
use crate::compare::{Comparison, compare};
use crate::image_io::LinearImage;
use crate::light_path::PathClass;
use crate::plan::Plan;
use crate::scene::Caustics;
use serde_json::{Value, json};

/// Seed of the reference.
const SEED: u64 = 0x5ee_dbee;

/// Rounds in which a lamp that is seen anywhere is found.
const LAMP_ROUNDS: u32 = 32;

/// Each estimator is tried for this part of the budget; the better one goes on.
const TRIAL: f64 = 0.125;

/// A pilot has this part of the budget to find where samples are wanted.
const PILOT: f64 = 0.06;

/// Its seed.
const PILOT_SEED: u64 = 0x5ee_d917;

/// A picture to measure errors against.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// Two estimates that share no random number, nothing smoothed.
    pub halves: [LinearImage; 2],
    /// Their mean.
    pub image: LinearImage,
    /// Its standard error: root mean square of half the halves' difference, over the mean.
    pub error: f64,
    /// The same where each pixel counts relative to itself, as the renderer's own estimate does: root of the mean of
    /// (A - B)²/4 / (r² + (0.1 mean)²).
    pub relative_error: f64,
    /// What made it.
    pub estimator: String,
    /// Rounds it took.
    pub rounds: u32,
    /// CPU seconds it took.
    pub cpu: f64,
    /// The estimator that was tried beside it.
    pub rival: Option<Rival>,
    /// The pixels that are compared, if not all: see [`without_lamps`].
    pub mask: Option<Vec<bool>>,
}

/// An independent estimate of the same picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Rival {
    /// What made it.
    pub estimator: String,
    /// Its standard error.
    pub error: f64,
    /// Its difference from the reference, as root mean square over the mean: not more than both errors together, if both
    /// are right.
    pub difference: f64,
    /// Its mean over that of the reference.
    pub mean_ratio: f64,
}

/// The pixels of a complete picture that are compared with other renderers: those that show no lamp, neither straight nor
/// in mirrors or through glass, nor lie beside one that does. A lamp is hundreds of times as bright as what it lights, so that
/// the error of all others would be that of its outline alone. `None`, for all, if that leaves less than a tenth.
///
/// # Errors
/// If the scene cannot be rendered.
pub fn without_lamps(subject: &Subject<'_>) -> Result<Option<Vec<bool>>, LabError> {
    let mut timed = Timed::new(subject.scene(&json!({ "paths": "LS*E" }), SEED)?);
    while timed.render.rounds() < LAMP_ROUNDS {
        timed.run_to_milestone()?;
    }
    let LinearImage { width, height, pixels } = timed.render.layer(PathClass::Emitted);
    let (width, height) = (width as usize, height as usize);
    let dark = |x: usize, y: usize| pixels[y * width + x] == [0.0; 3];
    let mask: Vec<bool> = (0..width * height)
        .map(|i| {
            let (x, y) = (i % width, i / width);
            let (columns, rows) =
                (x.saturating_sub(1)..=(x + 1).min(width - 1), y.saturating_sub(1)..=(y + 1).min(height - 1));
            rows.into_iter().all(|y| columns.clone().all(|x| dark(x, y)))
        })
        .collect();
    let kept = mask.iter().filter(|kept| **kept).count();
    Ok((10 * kept >= mask.len()).then_some(mask))
}

/// Renders a reference within the budget.
///
/// # Errors
/// If the scene cannot be rendered, or is black.
pub fn measure_reference(subject: &Subject<'_>, task: Task, budget: Budget) -> Result<Reference, LabError> {
    let mask = if task == Task::Complete { without_lamps(subject)? } else { None };
    let mut trials = Vec::new();
    for (name, settings) in estimators(subject, task)? {
        let scenes = (subject.scene(&settings, SEED)?, subject.scene(&settings, PILOT_SEED)?);
        let mut timed = Timed::evenly(scenes.0, scenes.1, PILOT * budget.reference)?;
        timed.run(TRIAL * budget.reference)?;
        trials.push((name, summary(&timed, mask.as_deref())?, timed));
    }
    trials.sort_by(|a, b| a.1.error.total_cmp(&b.1.error));
    let mut trials = trials.into_iter();
    let Some((name, _, mut timed)) = trials.next() else { return Err(LabError::NotAnObject) };
    timed.run(budget.reference)?;
    let mut reference = Reference { estimator: name, ..summary(&timed, mask.as_deref())? };
    if let Some((name, other, _)) = trials.next() {
        let against = compare(&other.image, &reference.image, mask.as_deref())?;
        reference.rival = Some(Rival {
            estimator: name,
            error: other.error,
            difference: against.rel_rmse,
            mean_ratio: against.mean_ratio,
        });
    }
    Ok(reference)
}

/// Estimators without bias, and what asks for them.
fn estimators(subject: &Subject<'_>, task: Task) -> Result<Vec<(String, Value)>, LabError> {
    let with = |mut settings: Value| {
        if task == Task::Complete {
            settings["paths"] = json!("complete");
        }
        settings
    };
    if task == Task::DirectLight {
        return Ok(vec![("eye samples".to_owned(), json!({ "paths": "whitted" }))]);
    }
    let mut found = vec![("photons on pixels, not smoothed".to_owned(), with(json!({})))];
    let scene = subject.scene(&json!({}), SEED)?;
    if all_can_be_met(&scene) && Plan::new(&scene).caustics == Some(Caustics::Photons) {
        found.push(("backward paths".to_owned(), with(json!({ "caustics": "backward" }))));
    }
    Ok(found)
}

fn summary(timed: &Timed, mask: Option<&[bool]>) -> Result<Reference, LabError> {
    let halves = timed.render.raw_halves();
    let image = mean_of(&halves);
    // The mean differs from a half by half the halves' difference.
    let Comparison { rel_rmse, relmse, .. } = compare(&halves[0], &image, mask)?;
    Ok(Reference {
        halves,
        image,
        error: rel_rmse,
        relative_error: relmse.sqrt(),
        estimator: String::new(),
        rounds: timed.render.rounds(),
        cpu: timed.cpu,
        rival: None,
        mask: mask.map(<[bool]>::to_vec),
    })
}

/// The mean of two pictures of one size.
pub(super) fn mean_of([a, b]: &[LinearImage; 2]) -> LinearImage {
    let mean = |(a, b): (&[f32; 3], &[f32; 3])| std::array::from_fn(|c| 0.5 * (a[c] + b[c]));
    let pixels = a.pixels.iter().zip(&b.pixels).map(mean).collect();
    LinearImage { width: a.width, height: a.height, pixels }
}
