//! `nephroid chart`: the error of every method against its CPU time.

use super::Failure;
use super::files::{cannot, import, save, say};
use super::peers::Peers;
use super::png::save_drawing;
use clap::Args;
use nephroid::image_io::{self, ImageFormat};
use nephroid::lab::methods::methods;
use nephroid::lab::table::{self, SceneResults, reference_json};
use nephroid::lab::{
    Budget, Chart, Honesty, LabError, Reference, Scaling, Subject, Task, honesty, measure_reference, page,
    peer_curve, run_method, scaling, svg, time_structures, without_lamps,
};
use nephroid::plan::Plan;
use nephroid::scene::{AssetSource, DirectoryAssets, ImageSettings};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Width of pictures, time of a method and of a reference with `--quick`.
const QUICK: (u32, f64, f64) = (120, 1.0, 4.0);
/// How large the largest work is whose time is measured by `--scaling`, as a part of the whole, with `--quick`.
const QUICK_SCALING: f64 = 0.03;
/// Width of the pictures that are rendered with many seeds.
const HONESTY_WIDTH: u32 = 120;
/// CPU seconds after which one of them is given up, and those of their reference.
const HONESTY: Budget = Budget { seconds: 4.0, reference: 40.0 };
/// The reference takes this many times as long as a method.
const REFERENCE_TIMES: f64 = 6.0;

#[derive(Args, Debug)]
pub(super) struct ChartArguments {
    /// Scene files, or models in binary glTF.
    #[arg(required_unless_present = "scaling")]
    scenes: Vec<PathBuf>,
    /// Folder for charts, tables, the page and the references, which are used again.
    #[arg(short, long, value_name = "DIR", default_value = "chart")]
    output: PathBuf,
    /// Pictures of 120 pixels across and a second for each method: a look, not a measurement.
    #[arg(long)]
    quick: bool,
    /// Most pixels across; small pictures cost less for the same error. As the scene has it, if left out.
    #[arg(long, value_parser = clap::value_parser!(u32).range(8..=16_384))]
    width: Option<u32>,
    /// CPU time of each method, s; a reference takes six times that.
    #[arg(long, default_value_t = 20.0)]
    seconds: f64,
    /// Also ask this many renders for errors of 10, 5 and 2 %, and count those that keep their word.
    #[arg(long, value_name = "SEEDS", default_value_t = 0)]
    honesty: u32,
    /// Draw other renderers beside this one, on all paths of light: a folder that bench/peers/run.py has filled.
    #[arg(long, value_name = "DIR")]
    peers: Option<PathBuf>,
    /// Also chart time over the number of primitives, photons, lights, pixels and threads.
    #[arg(long)]
    scaling: bool,
}

pub(super) fn run(arguments: &ChartArguments) -> Result<(), Failure> {
    if !(arguments.seconds.is_finite() && arguments.seconds > 0.0) {
        return Err(Failure::Usage("--seconds must be a number greater than 0".to_owned()));
    }
    let folder = &arguments.output;
    std::fs::create_dir_all(folder).map_err(|e| cannot("make", folder, &e))?;
    let peers = arguments.peers.as_deref().map(Peers::read).transpose()?.unwrap_or_default();
    let scalings = if arguments.scaling { arguments.scale()? } else { Vec::new() };
    let mut results = Vec::new();
    // Without scenes there are times alone.
    arguments.write(&results, &scalings)?;
    for path in &arguments.scenes {
        results.push(arguments.scene(path, &peers)?);
        // Written after each scene: a long run that is interrupted has shown something.
        arguments.write(&results, &scalings)?;
    }
    say(format!("wrote {}", folder.join("index.html").display()));
    Ok(())
}

impl ChartArguments {
    fn budget(&self) -> Budget {
        if self.quick {
            Budget { seconds: QUICK.1, reference: QUICK.2 }
        } else {
            Budget { seconds: self.seconds, reference: REFERENCE_TIMES * self.seconds }
        }
    }

    /// Everything that was found so far.
    fn write(&self, results: &[(SceneResults, ImageSettings)], scalings: &[Scaling]) -> Result<(), Failure> {
        let scenes: Vec<&SceneResults> = results.iter().map(|(scene, _)| scene).collect();
        let json = table::json(&scenes, scalings);
        save(&self.output.join("chart.csv"), table::csv(&scenes).as_bytes())?;
        save(&self.output.join("chart.md"), table::markdown(&scenes).as_bytes())?;
        save(&self.output.join("chart.json"), format!("{json:#}\n").as_bytes())?;
        let html = page::page(results, scalings).map_err(Failure::Lab)?;
        save(&self.output.join("index.html"), html.as_bytes())
    }

    /// Times over the size of the work.
    fn scale(&self) -> Result<Vec<Scaling>, Failure> {
        say("times over the size of the work");
        let most = if self.quick { QUICK_SCALING } else { 1.0 };
        let scalings = scaling::measure_scaling(most).map_err(Failure::Lab)?;
        for measured in &scalings {
            save_drawing(&self.output, &format!("scaling-{}", measured.over), &scaling::draw(measured))?;
        }
        save(&self.output.join("scaling.csv"), scaling::csv(&scalings).as_bytes())?;
        Ok(scalings)
    }

    /// Charts one scene and writes its pictures.
    fn scene(&self, path: &Path, peers: &Peers) -> Result<(SceneResults, ImageSettings), Failure> {
        let (text, assets) = read(path)?;
        let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        let width = self.width.or(self.quick.then_some(QUICK.0));
        let wrong = |error| match error {
            LabError::Scene(errors) => Failure::Scene { path: path.to_owned(), errors },
            other => Failure::Lab(other),
        };
        let subject = Subject::new(&name, &text, &*assets, width).map_err(wrong)?;
        let scene = subject.scene(&json!({}), 0).map_err(wrong)?;
        let plan = Plan::new(&scene);
        let mut charts = Vec::new();
        for task in [Task::Picture, Task::DirectLight, Task::Complete] {
            let methods = methods(&scene, &plan, task);
            if methods.is_empty() || (task == Task::Complete && !peers.know(&name)) {
                continue;
            }
            let reference = self.reference(&subject, task, self.budget())?;
            let mut chart = Chart { scene: name.clone(), task, reference, curves: Vec::new() };
            for method in &methods {
                say(format!("{name}, {}: {}", task.name(), method.name));
                let curve = run_method(&subject, method, &chart.reference, self.budget());
                chart.curves.push(curve.map_err(wrong)?);
            }
            if task == Task::Complete {
                for run in peers.runs(&name)? {
                    let curve = peer_curve(run, &chart.reference, self.budget().equal_time());
                    chart.curves.push(curve.map_err(wrong)?);
                }
                chart.curves.extend(peers.lines(&name)?);
            }
            save_drawing(&self.output, &format!("{name}-{}", task.name()), &svg::draw(&chart))?;
            charts.push(chart);
        }
        let timings = time_structures(&subject).map_err(wrong)?;
        let honesty = if self.honesty > 0 { Some(self.keep_words(&name, &text, &*assets)?) } else { None };
        Ok((SceneResults { scene: name, charts, timings, honesty }, scene.image))
    }

    /// Many seeds of a small picture, and its reference's own error.
    fn keep_words(
        &self,
        name: &str,
        text: &str,
        assets: &dyn AssetSource,
    ) -> Result<(Vec<Honesty>, f64), Failure> {
        let small = Subject::new(&format!("{name}-small"), text, assets, Some(HONESTY_WIDTH))
            .map_err(Failure::Lab)?;
        let reference = self.reference(&small, Task::Picture, HONESTY)?;
        say(format!("{name}: {} renders that stop by their own estimate", self.honesty));
        let rows = honesty(&small, &reference, self.honesty, HONESTY.seconds).map_err(Failure::Lab)?;
        Ok((rows, reference.relative_error))
    }

    /// The reference of an earlier run of the same scene and budget, or a new one.
    fn reference(&self, subject: &Subject<'_>, task: Task, budget: Budget) -> Result<Reference, Failure> {
        let file = |end: &str| self.output.join(format!("{}-{}-reference{end}", subject.name, task.name()));
        let key = json!({ "scene": format!("{:016x}", subject.hash()), "budget": budget.reference,
                          "version": env!("CARGO_PKG_VERSION") });
        let halves = ["-a.npy", "-b.npy"].map(file);
        if let Some(mut stored) = stored(&halves, &file(".json"), &key) {
            if task == Task::Complete {
                stored.mask = without_lamps(subject).map_err(Failure::Lab)?;
            }
            return Ok(stored);
        }
        say(format!("{}, {}: reference", subject.name, task.name()));
        let reference = measure_reference(subject, task, budget).map_err(Failure::Lab)?;
        for (half, path) in reference.halves.iter().zip(&halves) {
            save(path, &image_io::encode_npy(half))?;
        }
        let mut about = reference_json(&reference);
        about["made_for"] = key;
        save(&file(".json"), format!("{about:#}\n").as_bytes())?;
        Ok(reference)
    }
}

fn stored(halves: &[PathBuf; 2], about: &Path, key: &Value) -> Option<Reference> {
    let about: Value = serde_json::from_slice(&std::fs::read(about).ok()?).ok()?;
    if about["made_for"] != *key {
        return None;
    }
    let read = |npy: &PathBuf| image_io::decode(&std::fs::read(npy).ok()?, ImageFormat::Npy).ok();
    table::reference_from(&about, [read(&halves[0])?, read(&halves[1])?])
}

/// A scene's text and what it refers to.
fn read(path: &Path) -> Result<(String, Box<dyn AssetSource>), Failure> {
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("glb")) {
        let imported = import(path, "model")?;
        return Ok((imported.scene, Box::new(imported.assets)));
    }
    let text = std::fs::read_to_string(path).map_err(|e| cannot("read", path, &e))?;
    Ok((text, Box::new(DirectoryAssets::new(path.parent().unwrap_or(Path::new(""))))))
}
