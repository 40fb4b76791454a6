//! `nephroid render`: a scene to a picture.

use super::Failure;
use super::files::{Loaded, cannot, format_of, load_scene, save, save_image};
use super::progress::Reporter;
use clap::Args;
use nephroid::light_path::PathsError;
use nephroid::plan::Plan;
use nephroid::render::{Control, Render, RenderError};
use nephroid::report;
use nephroid::scene::{Caustics, Paths, Scene, Stop};
use std::path::{Path, PathBuf};
use std::sync::Arc;

#[derive(Args, Debug)]
pub(super) struct RenderArguments {
    /// Scene file.
    scene: PathBuf,
    /// Where the picture goes; png is tone-mapped, exr and npy hold linear radiance. May be repeated.
    #[arg(short, long, value_name = "FILE", default_value = "out.png")]
    output: Vec<PathBuf>,
    /// Which light paths are computed: `whitted`, `caustics`, `complete`, or an expression over L, D, S and E, as
    /// `LS+DS*E`.
    #[arg(long, value_name = "EXPR", value_parser = parse_paths)]
    paths: Option<Paths>,
    /// Which estimator computes the caustics: `photons`, `backward` or `forward`.
    #[arg(long, value_name = "NAME", value_parser = parse_caustics)]
    caustics: Option<Caustics>,
    /// Stop at this estimated relative error (replaces the scene's own limits).
    #[arg(long, value_parser = parse_positive)]
    error: Option<f64>,
    /// Stop after this much time, s (replaces the scene's own limits).
    #[arg(long, value_parser = parse_positive)]
    seconds: Option<f64>,
    /// Stop after this many rounds (replaces the scene's own limits).
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    rounds: Option<u32>,
    /// Seed of all random numbers.
    #[arg(long)]
    seed: Option<u64>,
    /// Number of threads; the picture does not depend on it. All cores if not given.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Size of the picture in place of the scene's.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<(u32, u32)>,
    /// Also write each class of light paths, and each layer that the scene names, to its own exr file in this folder.
    #[arg(long, value_name = "DIR")]
    layers: Option<PathBuf>,
    /// Write what the render did as JSON.
    #[arg(long, value_name = "FILE")]
    stats: Option<PathBuf>,
    /// Report progress as one JSON object per line.
    #[arg(long)]
    json: bool,
    /// Report nothing.
    #[arg(long, conflicts_with = "json")]
    quiet: bool,
}

pub(super) fn run(arguments: &RenderArguments) -> Result<(), Failure> {
    for path in &arguments.output {
        format_of(path)?;
    }
    let Loaded { mut scene, warnings } = load_scene(&arguments.scene)?;
    arguments.apply(&mut scene);
    let threads = usize::from(arguments.threads.unwrap_or(0));
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|e| Failure::Usage(format!("cannot start {threads} threads: {e}")))?;
    let control = Arc::new(Control::new());
    let on_signal = Arc::clone(&control);
    ctrlc::set_handler(move || on_signal.cancel())
        .map_err(|e| Failure::Usage(format!("cannot watch for signals: {e}")))?;
    let reporter = Reporter::new(arguments.json, arguments.quiet);
    let scene = Arc::new(scene);
    let plan = pool.install(|| Plan::new(&scene));
    for warning in warnings.iter().chain(&plan.warnings) {
        reporter.warning(warning);
    }
    let mut render = Render::new(scene, plan);
    let ended = pool.install(|| run_rounds(&mut render, &control, &reporter));
    if render.rounds() > 0 {
        let outputs = pool.install(|| arguments.write(&render))?;
        reporter.done(&render, &outputs);
    }
    match ended {
        Err(RenderError::Cancelled) => Err(Failure::Cancelled { rounds: render.rounds() }),
        other => Ok(other?),
    }
}

fn run_rounds(render: &mut Render, control: &Control, reporter: &Reporter) -> Result<(), RenderError> {
    while render.stop_reason().is_none() {
        let report = render.run_round(control)?;
        reporter.round(render, &report);
    }
    Ok(())
}

impl RenderArguments {
    /// Puts what was typed in place of what the scene says.
    fn apply(&self, scene: &mut Scene) {
        if let Some(paths) = &self.paths {
            scene.render.paths = paths.clone();
        }
        if let Some(caustics) = self.caustics {
            scene.render.caustics = caustics;
        }
        if let Some(seed) = self.seed {
            scene.render.seed = seed;
        }
        if self.error.is_some() || self.seconds.is_some() || self.rounds.is_some() {
            let error = self.error.map(|e| e as f32);
            scene.render.stop = Stop { error, seconds: self.seconds, rounds: self.rounds };
        }
        if let Some((width, height)) = self.size {
            scene.set_size(width, height);
        }
    }

    /// Writes pictures, layers and statistics; returns the pictures' names.
    fn write(&self, render: &Render) -> Result<Vec<String>, Failure> {
        let settings = &render.scene().image;
        let image = render.image();
        for path in &self.output {
            save_image(path, &image, settings)?;
        }
        if let Some(folder) = &self.layers {
            std::fs::create_dir_all(folder).map_err(|e| cannot("make", folder, &e))?;
            let picture = render.picture();
            for layer in render.layers() {
                let path = folder.join(format!("{}.exr", layer.name()));
                save_image(&path, &picture.part(&layer), settings)?;
            }
        }
        if let Some(path) = &self.stats {
            let mut stats = report::stats_json(render);
            stats["threads"] = self.threads.map_or_else(rayon::current_num_threads, usize::from).into();
            stats["peak_memory_bytes"] = peak_memory_bytes().into();
            save(path, format!("{stats:#}\n").as_bytes())?;
        }
        Ok(self.output.iter().map(|p| p.display().to_string()).collect())
    }
}

/// The process's largest resident size so far; unknown where the system does not tell.
fn peak_memory_bytes() -> Option<u64> {
    let status = std::fs::read_to_string(Path::new("/proc/self/status")).ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    let kibibytes: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kibibytes * 1024)
}

fn parse_paths(text: &str) -> Result<Paths, String> {
    text.parse().map_err(|e: PathsError| e.to_string())
}

fn parse_caustics(text: &str) -> Result<Caustics, String> {
    text.parse().map_err(|e: nephroid::scene::UnknownCaustics| e.to_string())
}

fn parse_positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("must be a number greater than 0".to_owned()),
    }
}

fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let parts = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    match parts {
        Some((w, h)) if (1..=MOST_PIXELS).contains(&w) && (1..=MOST_PIXELS).contains(&h) => Ok((w, h)),
        _ => Err(format!("must be like 400x300, each from 1 to {MOST_PIXELS}")),
    }
}

/// Most pixels across or down.
const MOST_PIXELS: u32 = 16_384;
