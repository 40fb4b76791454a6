//! One method over growing budgets: one render, looked at between its rounds while the clock stands.

use super::fit::{slope, tail, time_to_reach};
use super::{Judgement, LabError, Method, Reference, Subject};
use crate::image_io::LinearImage;
use crate::plan::Plan;
use crate::render::{Control, Render, RenderError, is_milestone};
use crate::scene::Scene;
use cpu_time::ProcessTime;
use std::sync::Arc;

/// Seed of the methods' renders; that of the reference is another.
const SEED: u64 = 1;

/// How long is rendered, CPU seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Budget {
    /// For each method.
    pub seconds: f64,
    /// For the reference.
    pub reference: f64,
}

impl Budget {
    /// At which time the pictures are compared side by side.
    #[must_use]
    pub fn equal_time(&self) -> f64 {
        self.seconds / 4.0
    }
}

/// One measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Rounds so far.
    pub rounds: u32,
    /// CPU seconds so far: plan and rounds, over all threads.
    pub cpu: f64,
    /// Root mean square error over the mean of the reference.
    pub error: f64,
}

/// Why a curve ends.
#[derive(Clone, Debug, PartialEq)]
pub enum End {
    /// The budget is used up.
    Time,
    /// Its error was too small to be told by the reference.
    Reference,
    /// There are no more pictures of another renderer.
    Measured,
    /// The render failed.
    Failed(RenderError),
}

/// Where the line of another renderer comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// Rendered beside this one's, and compared with the same reference.
    SameRun,
    /// Measured before, as these words say: machine, date, and what differs.
    Stored(String),
}

/// A method's error over time.
#[derive(Clone, Debug)]
pub struct Curve {
    /// The method.
    pub method: Method,
    /// Measurements, in order of time.
    pub points: Vec<Point>,
    /// Why there are no more.
    pub end: End,
    /// The picture at equal time, or the first if there was none by then.
    pub picture: Option<(Point, LinearImage)>,
    /// What the plan warns of.
    pub warnings: Vec<String>,
    /// Where another renderer's line comes from; `None` for this one's.
    pub peer: Option<Origin>,
}

impl Curve {
    /// The exponent of the error over the later half; of fewer than three points it would say little.
    #[must_use]
    pub fn slope(&self) -> Option<f64> {
        (self.points.len() > 2).then(|| slope(tail(&self.points)))?
    }

    /// CPU seconds to an error.
    #[must_use]
    pub fn time_to_reach(&self, error: f64) -> Option<f64> {
        time_to_reach(&self.points, error)
    }
}

/// A render and its CPU time; looking at it costs none.
pub(super) struct Timed {
    pub(super) render: Render,
    pub(super) cpu: f64,
    control: Control,
}

impl Timed {
    /// Plans a render.
    pub(super) fn new(scene: Scene) -> Self {
        let scene = Arc::new(scene);
        let start = ProcessTime::now();
        let plan = Plan::new(&scene);
        let cpu = start.elapsed().as_secs_f64();
        Self { render: Render::new(scene, plan), cpu, control: Control::new() }
    }

    /// The same, without bias after any number of rounds: where samples are wanted another render says, for so many seconds.
    pub(super) fn evenly(scene: Scene, pilot: Scene, seconds: f64) -> Result<Self, RenderError> {
        let mut pilot = Self::new(pilot);
        pilot.run(seconds)?;
        let timed = Self::new(scene);
        Ok(Self { render: timed.render.sampled_as(&pilot.render), cpu: timed.cpu + pilot.cpu, ..timed })
    }

    /// Renders until so many seconds are used up, but at least two rounds.
    pub(super) fn run(&mut self, seconds: f64) -> Result<(), RenderError> {
        while self.cpu < seconds || self.render.rounds() < 2 {
            self.run_to_milestone()?;
        }
        Ok(())
    }

    /// Renders up to the next round at which the product itself would look.
    pub(super) fn run_to_milestone(&mut self) -> Result<(), RenderError> {
        let start = ProcessTime::now();
        loop {
            self.render.run_round(&self.control)?;
            if is_milestone(self.render.rounds()) {
                break;
            }
        }
        self.cpu += start.elapsed().as_secs_f64();
        Ok(())
    }
}

/// Renders by a method until its budget is used up or the reference cannot tell more.
///
/// # Errors
/// If the method's settings do not fit the scene, or no error can be measured. A render that fails ends its curve.
pub fn run_method(
    subject: &Subject<'_>,
    method: &Method,
    reference: &Reference,
    budget: Budget,
) -> Result<Curve, LabError> {
    let mut timed = Timed::new(subject.scene(&method.settings, SEED)?);
    let warnings = timed.render.plan().warnings.iter().map(ToString::to_string).collect();
    let (mut points, mut picture) = (Vec::new(), None);
    let end = loop {
        if let Err(error) = timed.run_to_milestone() {
            break End::Failed(error);
        }
        let image = timed.render.image();
        let Judgement { error, told, .. } = reference.judge(&image)?;
        if !told {
            break End::Reference;
        }
        let point = Point { rounds: timed.render.rounds(), cpu: timed.cpu, error };
        points.push(point);
        if picture.is_none() || point.cpu <= budget.equal_time() {
            picture = Some((point, image));
        }
        if timed.cpu >= budget.seconds {
            break End::Time;
        }
    };
    Ok(Curve { method: method.clone(), points, end, picture, warnings, peer: None })
}
