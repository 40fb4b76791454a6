//! The method on one screen: pass 1, the photon maps, pass 2, the film; round after round until a stop.

use crate::effort::Effort;
use crate::film::Film;
use crate::image_io::LinearImage;
use crate::light_path::PathClass;
use crate::pass1_light::{Blocks, Tally};
use crate::pass2_eye::{self, EyeContext, EyeCounts, Footprints};
use crate::picture::Picture;
use crate::plan::Plan;
use crate::radius::RadiusRule;
use crate::sampling::{SamplePoint, hash};
use crate::scene::{Caustics, ImageSettings, Scene};
use crate::smooth::{Smoothing, smoothable};
use cpu_time::ProcessTime;
use std::sync::Arc;
use std::time::Instant;

mod checkpoint;
mod control;
mod milestone;
mod photons;

pub use checkpoint::CheckpointError;
pub use control::Control;

pub(crate) use milestone::is_milestone;

/// Why a round did not finish.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RenderError {
    /// [`Control::cancel`] was called.
    #[error("the render was cancelled")]
    Cancelled,
    /// A sample gave a number that is not finite; the values replay it.
    #[error("pixel ({x}, {y}) of round {round} is not finite in the {} layer", class.name())]
    NotFinite {
        /// Pixel column.
        x: u32,
        /// Pixel row.
        y: u32,
        /// The round.
        round: u32,
        /// The class of paths.
        class: PathClass,
    },
}

/// What ended a render.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopReason {
    /// The estimated error is within the one asked for.
    Error,
    /// The time is used up.
    Seconds,
    /// All rounds asked for are done.
    Rounds,
}

impl StopReason {
    /// The reason's name on the wire.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Error => "error",
            Self::Seconds => "seconds",
            Self::Rounds => "rounds",
        }
    }
}

/// One finished round.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoundReport {
    /// Number of rounds finished.
    pub rounds: u32,
    /// Estimated relative error so far.
    pub error: Option<f32>,
    /// Seconds spent rendering so far.
    pub seconds: f64,
}

/// Time of one pass, summed over rounds, s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PassTime {
    /// By the clock.
    pub wall: f64,
    /// User and system time of the process meanwhile, over all its threads.
    pub cpu: f64,
}

impl PassTime {
    fn add(&mut self, since: &Stopwatch) {
        self.wall += since.wall.elapsed().as_secs_f64();
        self.cpu += since.cpu.elapsed().as_secs_f64();
    }
}

/// Both clocks at one moment.
struct Stopwatch {
    wall: Instant,
    cpu: ProcessTime,
}

impl Stopwatch {
    fn start() -> Self {
        Self { wall: Instant::now(), cpu: ProcessTime::now() }
    }
}

/// What a render did.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderStats {
    /// Rounds finished.
    pub rounds: u32,
    /// What ended it, if it has ended.
    pub stop_reason: Option<StopReason>,
    /// Estimated relative error.
    pub error: Option<f32>,
    /// Time of pass 1, photons and their tree.
    pub pass1: PassTime,
    /// Time of pass 2, eye rays and look-ups.
    pub pass2: PassTime,
    /// Photons and their energy (summed over rounds and halves), for each window of the plan.
    pub windows: Vec<Tally>,
    /// Rays of pass 2.
    pub eye: EyeCounts,
}

/// A render in progress. A round is a function of scene, plan, number and the effort decided at the last
/// milestone; rounds are the time slice in which renders share a machine.
pub struct Render {
    scene: Arc<Scene>,
    plan: Plan,
    film: Film,
    pass1: PassTime,
    pass2: PassTime,
    windows: Vec<Tally>,
    eye: EyeCounts,
    /// Traced before the first round, if there are photons to count on them.
    footprints: Footprints,
    /// Where indirect light is smoothed.
    smoothable: Vec<bool>,
    /// The picture at the last milestone.
    preview: LinearImage,
    /// The smoothing then, and its number of rounds.
    smoothing: Option<(u32, Smoothing)>,
    /// Blocks of photons used up.
    blocks: u32,
    /// Decided at the last round that [`is_milestone`].
    effort: Effort,
    /// Estimated then.
    error: Option<f32>,
    /// Whether numbers of samples do not follow what the samples find.
    even: bool,
    /// Then each pixel's, over those of the least; empty means the same for all.
    shares: Vec<u8>,
}

/// With no limit given at all, this many rounds end a render that never reaches its error.
const MOST_ROUNDS: u32 = 1 << 20;

/// Fewer rounds tell too little about the error to stop by it.
pub(crate) const LEAST_ROUNDS: u32 = 2;

fn blank_film(scene: &Scene, plan: &Plan) -> Film {
    let ImageSettings { width, height, .. } = scene.image;
    Film::new(width, height, scene.render.caustics, plan.layer_names.len())
}

impl Render {
    /// A render that has yet to start.
    #[must_use]
    pub fn new(scene: Arc<Scene>, plan: Plan) -> Self {
        let preview =
            LinearImage { width: scene.image.width, height: scene.image.height, pixels: Vec::new() };
        let film = blank_film(&scene, &plan);
        // Single paths that meet a light decide badly on how many follow them.
        let backward = scene.render.caustics == Caustics::Backward;
        let windows = vec![Tally::default(); plan.photons.len()];
        let time = PassTime::default();
        Self {
            scene,
            plan,
            film,
            pass1: time,
            pass2: time,
            windows,
            eye: EyeCounts::default(),
            error: None,
            blocks: 0,
            footprints: Footprints::default(),
            smoothable: Vec::new(),
            smoothing: None,
            preview,
            effort: Effort::default(),
            even: backward,
            shares: Vec::new(),
        }
    }

    /// Gives all pixels the same number of samples and smooths nothing, which costs time and buys a mean without bias after any
    /// number of rounds: samples that decide on how many follow them count for less where they were bright. For references;
    /// a checkpoint does not keep it. Path tracing, `"caustics": "backward"`, is always even.
    #[must_use]
    pub fn evenly(self) -> Self {
        Self { even: true, ..self }
    }

    /// [`Render::evenly`], but pixels get samples in proportion to those that a pilot gave them, a render of the same scene with
    /// another seed: as unbiased, since the choice hangs on none of its own samples, and far less noisy where single samples are
    /// bright.
    #[must_use]
    pub fn sampled_as(self, pilot: &Self) -> Self {
        /// Most of a pixel, over those of one that got the usual number.
        const MOST: f32 = 32.0;
        let counts = || pilot.film.pixels().iter().map(|pixel| pixel.samples.max(1) as f32);
        let mut sorted: Vec<f32> = counts().collect();
        let middle = sorted.len() / 2;
        let usual = *sorted.select_nth_unstable_by(middle, f32::total_cmp).1;
        let shares = counts().map(|count| (count / usual).clamp(1.0, MOST).round() as u8).collect();
        Self { shares, ..self.evenly() }
    }

    /// Renders the next round, in the rayon pool this is called in.
    ///
    /// # Errors
    /// See [`RenderError`]; the finished rounds stay as they are.
    pub fn run_round(&mut self, control: &Control) -> Result<RoundReport, RenderError> {
        control.start_round();
        let round = self.film.rounds();
        let start = Stopwatch::start();
        let blocks = self.next_blocks();
        self.trace_footprints();
        let sent = self.send_photons(blocks, control)?;
        let mut pass1 = self.pass1;
        pass1.add(&start);
        let start = Stopwatch::start();
        let context = EyeContext {
            scene: &self.scene,
            plan: &self.plan,
            photons: sent.photons.as_ref(),
            gathers: true,
            round,
            footprints: &self.footprints,
            film: &self.film,
            effort: &self.effort,
        };
        let (mut film, mut eye) = pass2_eye::trace_image(&context, control)?;
        if let Some(connected) = &sent.connected {
            connected.add_to(&mut film);
            eye.eye_rays += connected.rays;
        }
        if round == 0 && !self.plan.photons.is_empty() && !self.even {
            self.film.add_round(&film, blocks.count as f32);
            drop(film);
            match self.look_again(sent.photons.as_ref(), &mut eye, control) {
                Ok(more) => self.film.add_samples(&more),
                Err(error) => {
                    self.film = blank_film(&self.scene, &self.plan);
                    return Err(error);
                }
            }
        } else {
            self.film.add_round(&film, blocks.count as f32);
        }
        self.blocks = blocks.first + blocks.count;
        self.eye.add(&eye);
        for (sum, tally) in self.windows.iter_mut().zip(&sent.tallies) {
            sum.add(tally);
        }
        self.pass1 = pass1;
        self.at_milestone();
        self.pass2.add(&start);
        Ok(RoundReport { rounds: self.rounds(), error: self.error_estimate(), seconds: self.seconds() })
    }

    /// Traces the pixels' footprints once, if photons are counted on them or paths that leave them are smoothed. A
    /// progressive radius is the classic method instead: photons are looked up point by point, and nothing is smoothed.
    fn trace_footprints(&mut self) {
        let Plan { caustics, classes, .. } = &self.plan;
        let gathered = !self.plan.photons.is_empty() && *caustics == Some(Caustics::Photons);
        let counted = gathered && classes.contains(PathClass::Caustic);
        let smoothed =
            classes.contains(PathClass::Indirect) && self.scene.render.caustics != Caustics::Backward;
        let wanted = (counted || smoothed) && self.plan.radius == RadiusRule::Pixel;
        if wanted && self.footprints.size().0 == 0 {
            self.footprints = Footprints::trace(&self.scene, &self.plan.eye_media);
            if smoothed {
                self.smoothable = smoothable(&self.footprints);
            }
        }
        if self.rounds() == 0 && !self.even {
            self.effort = Effort::first(&self.smoothable, (self.film.size().0, self.scene.render.seed));
        }
    }

    /// The blocks of the next round: aligned, so that each is a net of its own.
    fn next_blocks(&self) -> Blocks {
        let count = 1 << self.effort.photon_shift;
        let times = [0, 1].map(|half| self.moment(half));
        Blocks { first: self.blocks.next_multiple_of(count), count, times }
    }

    /// When the photons of the next round fly: stratified over the rounds.
    fn moment(&self, half: u64) -> f32 {
        const MOMENTS: u64 = 3;
        if !self.plan.moves {
            return 0.0;
        }
        let seed = hash(hash(self.scene.render.seed, MOMENTS), half);
        SamplePoint::new(seed, self.rounds()).get(0)
    }

    /// Why the render is finished; `None` while it is not.
    #[must_use]
    pub fn stop_reason(&self) -> Option<StopReason> {
        let stop = self.scene.render.stop;
        if self.rounds() >= stop.rounds.unwrap_or(MOST_ROUNDS) {
            return Some(StopReason::Rounds);
        }
        if let (Some(target), Some(error)) = (stop.error, self.error_estimate())
            && self.rounds() >= LEAST_ROUNDS
            && is_milestone(self.rounds())
            && error <= target
        {
            return Some(StopReason::Error);
        }
        (self.rounds() > 0 && stop.seconds.is_some_and(|limit| self.seconds() >= limit))
            .then_some(StopReason::Seconds)
    }

    /// A guess from the stop rule of how much is done, 0..1.
    #[must_use]
    pub fn progress(&self) -> f32 {
        if self.stop_reason().is_some() {
            return 1.0;
        }
        let stop = self.scene.render.stop;
        let by_rounds = stop.rounds.map(|n| self.rounds() as f32 / n.max(1) as f32);
        let by_seconds = stop.seconds.map(|s| (self.seconds() / s) as f32);
        // Noise falls at least with the root of the effort.
        let by_error = match (stop.error, self.error_estimate()) {
            (Some(target), Some(error)) if error > 0.0 => Some((target / error).powi(2)),
            _ => None,
        };
        [by_rounds, by_seconds, by_error].into_iter().flatten().fold(0.0, f32::max).clamp(0.0, 0.99)
    }

    /// Number of finished rounds.
    #[must_use]
    pub fn rounds(&self) -> u32 {
        self.film.rounds()
    }

    /// Estimated relative error at the last milestone (see [`Picture::error_estimate`]).
    #[must_use]
    pub fn error_estimate(&self) -> Option<f32> {
        self.error
    }

    /// Seconds spent in [`Render::run_round`].
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.pass1.wall + self.pass2.wall
    }

    /// The picture so far.
    #[must_use]
    pub fn image(&self) -> LinearImage {
        if self.smoothed_now() { self.preview.clone() } else { self.picture().image() }
    }

    /// Whether the last round was a milestone, whose smoothing and picture are kept.
    fn smoothed_now(&self) -> bool {
        self.smoothing.as_ref().is_some_and(|(rounds, _)| *rounds == self.rounds())
    }

    /// The picture at the last of the rounds 1, 2, 3, 4, 6, 8, 12, 16, …: at no cost.
    #[must_use]
    pub fn preview(&self) -> LinearImage {
        if self.preview.pixels.is_empty() { self.image() } else { self.preview.clone() }
    }

    /// The smoothed picture so far, from which image and layers can be had without smoothing again.
    #[must_use]
    pub fn picture(&self) -> Picture<'_> {
        match &self.smoothing {
            Some((rounds, smoothing)) if *rounds == self.rounds() => {
                Picture::with_smoothing(&self.film, &self.footprints, smoothing)
            }
            _ => Picture::new(&self.film, &self.footprints),
        }
    }

    /// One class of paths so far; the layers add up to the picture.
    #[must_use]
    pub fn layer(&self, class: PathClass) -> LinearImage {
        self.picture().layer(class)
    }

    /// One class of paths as it was gathered: nothing is smoothed.
    #[must_use]
    pub fn raw_layer(&self, class: PathClass) -> LinearImage {
        self.film.raw_layer(class)
    }

    /// Everything as it was gathered by the two halves, which share no random number.
    #[must_use]
    pub fn raw_halves(&self) -> [LinearImage; 2] {
        [0, 1].map(|half| self.film.raw_half(half))
    }

    /// The scene that is rendered.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The plan that is followed.
    #[must_use]
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// What the render did so far.
    #[must_use]
    pub fn stats(&self) -> RenderStats {
        RenderStats {
            rounds: self.rounds(),
            stop_reason: self.stop_reason(),
            error: self.error_estimate(),
            pass1: self.pass1,
            pass2: self.pass2,
            windows: self.windows.clone(),
            eye: self.eye,
        }
    }
}
