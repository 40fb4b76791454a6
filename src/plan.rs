//! The plan: what this scene needs, what is left out, and why.

use crate::effort::MOST_SHIFT;
use crate::film::{Film, LayerSums};
use crate::light_path::{Bounce, Classes, Language};
use crate::media::Media;
use crate::pass1_light::{self, Block, Budget, Carries, Source, Tally, Window};
use crate::pass2_eye::{Footprints, Irradiance};
use crate::radius::RadiusRule;
use crate::sampling::hash;
use crate::scene::{Aiming, Caustics, Environment, Light, LightSampling, ObjectId, Paths, Scene, Warning};
use rayon::prelude::*;
use std::collections::BTreeSet;

pub use asked::Layer;
pub use bounds::Bounds;
pub use light_tree::{Asking, LightTree};

mod asked;
mod bounds;
mod carry;
mod details;
pub(crate) mod language;
mod light_tree;
mod reach;
mod rivals;

/// What a render will do. A pure function of the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Photon windows and their budgets; empty if pass 1 does not run.
    pub photons: Vec<Budget>,
    /// The classes of paths that are asked for and can occur.
    pub classes: Classes,
    /// What tells the paths that are asked for, and those of named layers, where the class alone does not.
    pub language: Option<Language>,
    /// The layers besides those of the classes.
    pub layer_names: Vec<String>,
    /// The estimator that computes the caustics, if there can be any.
    pub caustics: Option<Caustics>,
    /// Radius of the density estimate.
    pub radius: RadiusRule,
    /// What the eye is inside of.
    pub eye_media: Media,
    /// Which lights a D asks, if there are too many to ask each.
    pub light_tree: Option<LightTree>,
    /// Whether a ray can meet a light or the environment: highlights are then lit by scattered rays too.
    pub lights_can_be_met: bool,
    /// True if something moves while the shutter is open.
    pub moves: bool,
    /// Each choice with its reason.
    pub decisions: Vec<Decision>,
    /// What the user should know.
    pub warnings: Vec<Warning>,
    /// Estimated memory at the peak.
    pub memory_bytes: u64,
}

/// One choice.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Decision {
    /// What is decided on.
    pub topic: &'static str,
    /// True if it costs anything in this render.
    pub runs: bool,
    /// What was chosen.
    pub choice: String,
    /// Why.
    pub reason: String,
}

/// Photons of the first pilot per window; tried again with sixteen times as many where none arrived.
const PILOT_LOG2: u32 = 13;

/// Least photons per window, half and round.
const LEAST_LOG2: u32 = 8;

/// From so many windows on, each gets fewer pilot photons, and may get fewer than that of a round: in all about as many as
/// these would.
const MANY_WINDOWS: usize = 32;

/// By how many powers of two.
fn fewer_log2(windows: usize) -> u32 {
    (windows / MANY_WINDOWS).max(1).ilog2()
}

/// Least photons of a pilot: fewer of many windows would be taken for dark.
const LEAST_PILOT_LOG2: u32 = 6;

/// Each light image takes several rays, and is worth many photons: as many powers of two fewer are sent.
const LESS_LOG2: u32 = 3;

/// Most photons per half and round in all: bounds the memory of a round.
const MOST_LOG2: u32 = 21;

/// Bytes per pixel while caustics that fill the picture are smoothed: seven widths of both halves and the sums of
/// their costs.
const SMOOTHING_BYTES: u64 = 360;

/// A window and what its pilot found.
struct Pilot {
    window: Window,
    tally: Tally,
    /// Photons sent.
    sent: u32,
    /// Specular objects that they have met.
    met: BTreeSet<ObjectId>,
    /// What its photons should carry.
    carries: Carries,
}

impl Plan {
    /// Decides what this scene needs; sends a few pilot photons to find out.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let mut plan = Self {
            photons: Vec::new(),
            classes: asked::classes(scene),
            language: None,
            layer_names: Vec::new(),
            caustics: None,
            radius: scene.render.radius,
            light_tree: None,
            eye_media: Media::around(scene, scene.camera.eye),
            lights_can_be_met: !scene.environment.is_black()
                || scene.lights.iter().any(|l| l.surface_radiance().is_some()),
            moves: scene.geometry.moves(),
            decisions: Vec::new(),
            warnings: scene.warnings.clone(),
            memory_bytes: 0,
        };
        plan.decide_layers(scene);
        plan.decide_pass_1(scene);
        plan.decide_emitted(scene);
        plan.decide_direct(scene);
        plan.decide_structure(scene);
        plan.decide_lens(scene);
        plan.decide_time();
        plan.decide_colour(scene);
        plan.decide_indirect(scene);
        plan.memory_bytes = plan.estimate_memory(scene);
        plan
    }

    fn decide(
        &mut self,
        topic: &'static str,
        runs: bool,
        choice: impl Into<String>,
        reason: impl Into<String>,
    ) {
        self.decisions.push(Decision { topic, runs, choice: choice.into(), reason: reason.into() });
    }

    fn warn(&mut self, code: &'static str, message: impl Into<String>) {
        self.warnings.push(Warning { code, pointer: None, message: message.into() });
    }

    fn decide_pass_1(&mut self, scene: &Scene) {
        let paths = &scene.render.paths;
        if !asked::any(scene, asked::THROUGH_SPECULAR, &Bounce::ALL) {
            let reason = format!("the paths asked for, {paths}, hold no caustic");
            self.decide("pass 1", false, "no photons", reason);
            if *paths == Paths::Whitted
                && scene.objects.iter().any(|o| scene.materials[o.material.index()].has_specular())
            {
                let message =
                    "mirrors and glass cast plain shadows: the paths asked for leave out what they throw";
                self.warn("caustics_left_out", message);
            }
            return;
        }
        let specular = scene.objects.iter().any(|o| scene.materials[o.material.index()].has_specular());
        if !specular {
            self.decide("pass 1", false, "no photons", "no object is a mirror or glass: LS+DS*E is empty");
            return;
        }
        if !scene.objects.iter().any(|o| scene.materials[o.material.index()].has_diffuse()) {
            self.decide(
                "pass 1",
                false,
                "no photons",
                "no surface can show a caustic: all are specular or black",
            );
            self.warn(
                "no_receiver",
                "there is no diffuse surface that is not black, so no caustic can be seen",
            );
            return;
        }
        if scene.render.caustics == Caustics::Backward {
            self.decide_backward(scene);
            return;
        }
        let mut windows = pass1_light::windows(scene);
        windows.iter_mut().for_each(|window| window.kinds = self.photon_kinds(window.source));
        if windows.is_empty() {
            self.decide("pass 1", false, "no photons", "no light gives light");
            return;
        }
        if scene.render.aiming == Aiming::Everywhere {
            self.warn(
                "aimed_everywhere",
                "photons go in all directions: where few meet mirrors or glass, caustics are noisy or missing, and the \
                 estimated error cannot know it",
            );
        }
        let fewer = fewer_log2(windows.len());
        let pilots: Vec<Pilot> =
            windows.into_par_iter().enumerate().map(|(i, w)| pilot(scene, w, (i as u64, fewer))).collect();
        self.budget(scene, pilots);
    }

    /// Shares the photons of a round among the windows in proportion to the light they deliver.
    fn budget(&mut self, scene: &Scene, pilots: Vec<Pilot>) {
        let delivered = |p: &Pilot| p.tally.energy.stored.max_element();
        let total: f64 = pilots.iter().map(delivered).sum();
        let all = pilots.len();
        if pilots.iter().all(|p| p.tally.hit_caster == 0) {
            self.decide("pass 1", false, "no photons", "no light reaches a mirror or glass");
            if reach::is_meant(scene) {
                let message = format!("of {} pilot photons none reached a specular object", sent(&pilots));
                self.warn("no_photon_hit_specular", message);
            }
            return;
        }
        self.warnings.extend(reach::unreachable_specular(scene, &pilots));
        if total <= 0.0 {
            let energy = |f: fn(&Tally) -> f64| pilots.iter().map(|p| f(&p.tally)).sum::<f64>();
            let escaped = energy(|t| t.energy.escaped.max_element());
            let absorbed = energy(|t| t.energy.absorbed.max_element());
            self.decide(
                "pass 1",
                false,
                "no photons",
                "no light that mirrors or glass throw lands on a surface",
            );
            self.warn(
                "no_photon_stored",
                format!("pilot photons met specular objects, but none landed: {escaped:.3e} W escaped, {absorbed:.3e} W were absorbed"),
            );
            return;
        }
        let pixels = u64::from(scene.image.width) * u64::from(scene.image.height);
        // The first round is small: what it finds decides how large the others are.
        let first_round = (pixels / 4).max(1).next_power_of_two();
        let least = LEAST_LOG2.saturating_sub(fewer_log2(all));
        let per_round = first_round.ilog2().clamp(LEAST_LOG2, MOST_LOG2);
        for pilot in pilots {
            let share = delivered(&pilot) / total;
            if share == 0.0 {
                continue;
            }
            // A power of two at least as large as the share: blocks of the sequence stay aligned.
            let log2_block = (f64::from(per_round) + share.log2()).ceil().max(f64::from(least)) as u32;
            let carries = pilot.carries;
            let log2_block = match carries {
                Carries::Points => log2_block,
                Carries::LightImages => log2_block.saturating_sub(LESS_LOG2).max(least),
            };
            self.photons.push(Budget { window: pilot.window, log2_block, carries });
        }
        self.decide_gathering(scene);
        self.decide_photons(all);
    }

    /// Says in words what was found of so many pairs of light and specular object.
    fn decide_photons(&mut self, all: usize) {
        let sent: u64 = self.photons.iter().map(|b| 2_u64 << b.log2_block).sum();
        let kept = self.photons.len();
        let images = self.photons.iter().filter(|b| b.carries == Carries::LightImages).count();
        let guided = self.photons.iter().filter(|b| b.window.guide.is_some()).count();
        self.decide(
            "pass 1",
            true,
            match (kept, images) {
                (1, 0) => format!("{sent} photons a round through one window"),
                (1, _) => format!("{sent} photons a round through one window, with images of the light"),
                (_, 0) => format!("{sent} photons a round through {kept} windows"),
                _ => format!("{sent} photons a round through {kept} windows, {images} of them with images of the light"),
            },
            match (all, guided) {
                (1, 0) => "the light reaches the specular object, which throws it onto a surface".to_owned(),
                (1, _) => "the light reaches the specular object, which throws it onto a surface; photons are sent by a table of where they arrive from".to_owned(),
                (_, 0) => format!("{kept} of {all} pairs of light and specular object throw light onto a surface; each gets photons by the light it delivers"),
                _ => format!("{kept} of {all} pairs of light and specular object throw light onto a surface; each gets photons by the light it delivers, {guided} of them through a table of where they arrive from"),
            },
        );
    }

    fn decide_direct(&mut self, scene: &Scene) {
        if !asked::any(scene, asked::STRAIGHT, &Bounce::ALL) {
            let reason = format!("the paths asked for, {}, have an S after each L", scene.render.paths);
            self.decide("direct light", false, "nothing", reason);
            return;
        }
        let delta = |l: &Light| l.surface_radiance().is_none();
        let lit = scene.lights.iter().filter(|l| !l.is_dark()).count();
        if lit == 0 && scene.environment.is_black() {
            self.decide("direct light", false, "nothing", "no light gives light");
            self.warn("no_light", "no light gives light: the picture is black");
            return;
        }
        let (choice, reason) = if scene.lights.iter().all(delta) {
            ("one shadow ray per light", "the lights have no size: nothing to sample")
        } else if scene.render.light_sampling != LightSampling::Sobol {
            (
                "a grid of shadow rays per quad or disk light",
                "`light_sampling` asks for it; the default, one Sobol point, is quicker for the same error",
            )
        } else {
            (
                "one shadow ray per light to a sampled point",
                "quads are sampled by the light they give, spheres by solid angle, other lights by area; Owen-scrambled Sobol",
            )
        };
        self.decide("direct light", true, choice, reason);
        self.decide_selection(scene, lit);
        match &scene.environment {
            environment if environment.is_black() => {
                self.decide("environment", false, "no rays", "the environment is black");
            }
            Environment::Constant(_) => {
                self.decide(
                    "environment",
                    true,
                    "one ray by the cosine",
                    "it gives the same light from everywhere",
                );
            }
            Environment::Image(_) => {
                self.decide("environment", true, "one ray by its brightness", "the environment is a picture");
            }
        }
    }

    /// How many doublings of the photons per round memory allows and make sense.
    #[must_use]
    pub fn most_photon_shift(&self) -> u32 {
        // The photons of a round share one moment: where something moves, many small rounds are worth more.
        if self.moves {
            return 0;
        }
        let in_photons = |b: &Budget| match b.carries {
            Carries::Points => 1_u64 << b.log2_block,
            Carries::LightImages => 1_u64 << (b.log2_block + LESS_LOG2),
        };
        let photons: u64 = self.photons.iter().map(in_photons).sum();
        MOST_LOG2.saturating_sub(photons.max(1).next_power_of_two().ilog2()).min(MOST_SHIFT)
    }

    fn estimate_memory(&self, scene: &Scene) -> u64 {
        let a_round: u64 = self.photons.iter().map(Budget::bytes).sum();
        let photons = a_round << self.most_photon_shift();
        frame_bytes(scene, self.layer_names.len(), !self.photons.is_empty()) + photons
    }
}

/// Memory of all but photons.
fn frame_bytes(scene: &Scene, named_layers: usize, sends_photons: bool) -> u64 {
    let (width, height) = (scene.image.width, scene.image.height);
    let pixels = u64::from(width) * u64::from(height);
    let film = Film::bytes(width, height) + pixels * named_layers as u64 * LayerSums::BYTES;
    // A round and its tiles, while it is made, or the ladder of widths, while it is smoothed.
    let passing = if sends_photons { (2 * film).max(pixels * SMOOTHING_BYTES) } else { 2 * film };
    let per_pixel = Footprints::BYTES_PER_PIXEL + Irradiance::BYTES_PER_PIXEL;
    let footprints = if sends_photons { pixels * per_pixel } else { 0 };
    scene.geometry.memory_bytes() + scene.image_bytes + film + footprints + passing
}

fn sent(pilots: &[Pilot]) -> u64 {
    pilots.iter().map(|p| u64::from(p.sent)).sum()
}

/// Sends a few photons through a window. The count is bounded: a window that delivers nothing is given up.
fn pilot(scene: &Scene, mut window: Window, (index, fewer): (u64, u32)) -> Pilot {
    const PILOT: u64 = 0;
    let seed = hash(hash(scene.render.seed, PILOT), index);
    let run = |window: &Window, log2: u32| {
        pass1_light::pilot(scene, window, Block { first: 0, count: 1 << log2, seed })
    };
    let mut log2 = PILOT_LOG2.saturating_sub(fewer).max(LEAST_PILOT_LOG2);
    let (mut tally, mut guide, mut met) = run(&window, log2);
    if tally.stored == 0 {
        log2 += 4;
        (tally, guide, met) = run(&window, log2);
    }
    let aimed = scene.render.aiming == Aiming::Windows;
    window.guide = guide.filter(|_| aimed);
    // Trying images costs as much as a pilot of a few windows.
    let carries = match fewer {
        0..=2 if aimed => carry::decide(scene, &window, hash(seed, index)),
        _ => Carries::Points,
    };
    Pilot { window, tally, sent: 1 << log2, met, carries }
}

/// A window's source in words.
#[must_use]
pub fn source_name(scene: &Scene, source: Source) -> String {
    match source {
        Source::Environment => "environment".to_owned(),
        Source::Light(id) => {
            format!("{} light {}", scene.lights[id.index()].kind(), id.0)
        }
    }
}
