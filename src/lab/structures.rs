//! The structures that find the nearest hit: the picture is the same, only the time differs.

use super::methods::structures;
use super::run::Timed;
use super::{LabError, Subject};
use serde_json::json;

/// The quickest of so many renders counts: the others were disturbed.
const REPEATS: usize = 3;

/// How long a structure takes.
#[derive(Clone, Debug, PartialEq)]
pub struct Timing {
    /// The structure's name in scene files.
    pub structure: &'static str,
    /// CPU seconds of plan and first round.
    pub cpu: f64,
}

/// The time of the first round with each structure, planning included.
///
/// # Errors
/// If the scene cannot be rendered.
pub fn time_structures(subject: &Subject<'_>) -> Result<Vec<Timing>, LabError> {
    let mut timings = Vec::new();
    for structure in structures(&subject.scene(&json!({}), 1)?) {
        let mut cpu = f64::INFINITY;
        for _ in 0..REPEATS {
            let mut timed = Timed::new(subject.scene(&json!({ "structure": structure }), 1)?);
            timed.run_to_milestone()?;
            cpu = cpu.min(timed.cpu);
        }
        timings.push(Timing { structure, cpu });
    }
    Ok(timings)
}
