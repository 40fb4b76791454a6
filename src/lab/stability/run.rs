//! Renders one case by every method that can.

use super::judge::{Cell, Mean, Outcome, judge, judge_refusal};
use super::{Case, Input, Truth};
use crate::image_io::LinearImage;
use crate::lab::Method;
use crate::lab::methods::{classic_maps, structures};
use crate::light_path::PathClass;
use crate::plan::Plan;
use crate::render::{Control, Render};
use crate::scene::{Caustics, NoAssets, Scene};
use cpu_time::ProcessTime;
use serde_json::{Value, json};
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// A render of a few pixels that takes longer than this hangs.
const PATIENCE: Duration = Duration::from_secs(120);

/// Seed of the first render.
const FIRST_SEED: u64 = 1;

/// How much is rendered of each.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Renders, of which the mean is judged; at least 2. One is enough where nothing is known to judge it by.
    pub seeds: u64,
    /// Rounds of each.
    pub rounds: u32,
}

/// A case, and what became of it by each method.
#[derive(Clone, Debug)]
pub struct Row {
    /// The case.
    pub case: Case,
    /// One per method that can run it.
    pub cells: Vec<Cell>,
}

/// Renders a case by each method that can, and judges.
#[must_use]
pub fn run_case(case: &Case, effort: Effort) -> Row {
    let cells = match (&case.input, &case.truth) {
        (_, Truth::Probe(probe)) => vec![probed(case, *probe)],
        (Input::Scene(scene), _) => rendered(case, scene, effort),
        (Input::Text(text), _) => vec![read(case, text)],
        (Input::None, _) => Vec::new(),
    };
    Row { case: case.clone(), cells }
}

fn cell(method: &str) -> Cell {
    Cell {
        method: method.to_owned(),
        outcome: Outcome::Finite,
        error: None,
        noise: None,
        own: None,
        cpu: 0.0,
        warnings: Vec::new(),
        picture: None,
    }
}

fn probed(case: &Case, probe: fn() -> f64) -> Cell {
    let start = ProcessTime::now();
    let error = probe();
    let mut cell = cell("default");
    cell.cpu = start.elapsed().as_secs_f64();
    cell.error = Some(error);
    cell.outcome = if error.abs() <= case.tolerance { Outcome::Right } else { Outcome::Wrong };
    cell
}

/// A text that is no scene, or one that is.
fn read(case: &Case, text: &str) -> Cell {
    let start = ProcessTime::now();
    let issues = match Scene::from_json(text, &NoAssets) {
        Ok(_) => Vec::new(),
        Err(errors) => errors.issues.into_iter().map(|i| (i.pointer, i.code.as_str())).collect(),
    };
    let mut cell = cell("default");
    cell.cpu = start.elapsed().as_secs_f64();
    cell.outcome = judge_refusal(case, &issues);
    cell
}

fn rendered(case: &Case, scene: &Value, effort: Effort) -> Vec<Cell> {
    if matches!(case.truth, Truth::Refused(..)) {
        return vec![read(case, &scene.to_string())];
    }
    let compiled = match Scene::from_json(&scene.to_string(), &NoAssets) {
        Ok(compiled) => compiled,
        Err(_) => return vec![read(case, &scene.to_string())],
    };
    let truth = match &case.truth {
        Truth::Mean { value, .. } => Some(Mean { value: *value, standard_error: 0.0 }),
        Truth::SameAs(other) => {
            // Independent of the renders that it judges.
            let mut seeds = 1000..1000 + effort.seeds;
            let all: Result<Vec<Shot>, String> =
                seeds.try_fold(Vec::new(), |mut all, seed| -> Result<_, String> {
                    all.push(shoot(other, &json!({}), seed, effort.rounds)?);
                    Ok(all)
                });
            match all {
                Ok(shots) => Some(Mean::of(&shots.iter().map(|s| mean(&s.picture)).collect::<Vec<_>>())),
                Err(error) => {
                    let mut cell = cell("the scene it is compared with");
                    cell.outcome = Outcome::Failed(error);
                    return vec![cell];
                }
            }
        }
        Truth::Refused(..) | Truth::Finite | Truth::Probe(_) => None,
    };
    let mut methods = methods(&compiled);
    methods.extend(case.extra.iter().cloned());
    let mut cells: Vec<Cell> =
        methods.iter().map(|method| by_method(case, scene, method, (truth, effort))).collect();
    if let Some(default) = cells.first().cloned() {
        let same = structures(&compiled).into_iter();
        cells.extend(same.map(|structure| by_structure(scene, structure, &default, effort)));
    }
    cells
}

/// Every method that does anything else than the default here.
fn methods(scene: &Scene) -> Vec<Method> {
    let plan = Plan::new(scene);
    let mut all = vec![Method::new("default", json!({}))];
    if plan.caustics == Some(Caustics::Photons) {
        all.extend(classic_maps(scene));
        all.push(Method::new("aimed everywhere", json!({ "aiming": "everywhere" })));
        all.push(Method::new("backward", json!({ "caustics": "backward" })));
        all.push(Method::new("forward", json!({ "caustics": "forward" })));
    }
    if scene.lights.iter().any(|light| matches!(light.kind(), "quad" | "disk")) {
        for (name, sampling, grid) in
            [("grid 8×8", "grid", 8), ("jittered 8×8", "jittered", 8), ("adaptive 4×4", "adaptive", 4)]
        {
            all.push(Method::new(name, json!({ "light_sampling": sampling, "light_grid": grid })));
        }
    }
    all
}

fn by_method(case: &Case, scene: &Value, method: &Method, (truth, effort): (Option<Mean>, Effort)) -> Cell {
    let mut cell = cell(&method.name);
    let class = match case.truth {
        Truth::Mean { class, .. } => class,
        Truth::SameAs(_) | Truth::Refused(..) | Truth::Finite | Truth::Probe(_) => None,
    };
    let (mut means, mut own) = (Vec::new(), Vec::new());
    let seeds = if truth.is_some() { effort.seeds } else { 1 };
    for seed in (FIRST_SEED..).take(seeds as usize) {
        let shot = match shoot(scene, &method.settings, seed, effort.rounds) {
            Ok(shot) => shot,
            Err(error) => {
                cell.outcome = Outcome::Failed(error);
                return cell;
            }
        };
        cell.cpu += shot.cpu / seeds as f64;
        means.push(class.map_or_else(|| mean(&shot.picture), |class| mean(shot.layer(class))));
        own.extend(shot.own);
        cell.warnings = shot.warnings;
        cell.picture.get_or_insert(shot.picture);
    }
    cell.own = (!own.is_empty()).then(|| own.iter().sum::<f64>() / own.len() as f64);
    judge(&mut cell, case, Mean::of(&means), truth);
    cell
}

/// Whatever structure finds what rays meet, the picture is the same to the last bit: only the time differs.
fn by_structure(scene: &Value, structure: &str, default: &Cell, effort: Effort) -> Cell {
    let mut cell = Cell { method: structure.to_owned(), ..default.clone() };
    match shoot(scene, &json!({ "structure": structure }), FIRST_SEED, effort.rounds) {
        Ok(shot) => {
            cell.cpu = shot.cpu;
            let same = default.picture.is_none() || default.picture.as_ref() == Some(&shot.picture);
            if !same {
                cell.outcome = Outcome::Failed("another picture than the default's".to_owned());
            }
            cell.picture = Some(shot.picture);
        }
        Err(error) => cell.outcome = Outcome::Failed(error),
    }
    cell
}

/// What is left of a render.
struct Shot {
    picture: LinearImage,
    layers: Vec<LinearImage>,
    own: Option<f64>,
    cpu: f64,
    warnings: Vec<&'static str>,
}

impl Shot {
    fn layer(&self, class: PathClass) -> &LinearImage {
        PathClass::ALL.iter().position(|c| *c == class).map_or(&self.picture, |at| &self.layers[at])
    }
}

/// Renders some rounds; cancelled if it takes too long.
fn shoot(scene: &Value, settings: &Value, seed: u64, rounds: u32) -> Result<Shot, String> {
    let mut file = scene.clone();
    let mut render = file["render"].as_object().cloned().unwrap_or_default();
    render.insert("seed".to_owned(), json!(seed));
    render.extend(settings.as_object().cloned().unwrap_or_default());
    file["render"] = Value::Object(render);
    let scene = Scene::from_json(&file.to_string(), &NoAssets).map_err(|errors| errors.to_string())?;
    let control = Control::new();
    let (done, wait) = channel::<()>();
    let shot = std::thread::scope(|threads| {
        let watched = &control;
        threads.spawn(move || {
            // The sender is dropped when the render ends.
            if wait.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Timeout) {
                watched.cancel();
            }
        });
        let shot = render_rounds(scene, rounds, &control);
        drop(done);
        shot
    })?;
    let finite = |image: &LinearImage| image.pixels.iter().flatten().all(|x| x.is_finite());
    if finite(&shot.picture) && shot.layers.iter().all(finite) {
        Ok(shot)
    } else {
        Err("a pixel is not finite".to_owned())
    }
}

fn render_rounds(scene: Scene, rounds: u32, control: &Control) -> Result<Shot, String> {
    let scene = Arc::new(scene);
    let start = ProcessTime::now();
    let plan = Plan::new(&scene);
    let warnings = plan.warnings.iter().map(|w| w.code).collect();
    let mut render = Render::new(scene, plan);
    for _ in 0..rounds {
        render.run_round(control).map_err(|error| error.to_string())?;
    }
    let cpu = start.elapsed().as_secs_f64();
    Ok(Shot {
        picture: render.image(),
        layers: PathClass::ALL.map(|class| render.layer(class)).into(),
        own: render.error_estimate().map(f64::from),
        cpu,
        warnings,
    })
}

fn mean(image: &LinearImage) -> f64 {
    image.pixels.iter().map(|p| f64::from(p[1])).sum::<f64>() / image.pixels.len() as f64
}
