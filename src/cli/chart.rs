//! `nephroid chart`: the error of every method against its CPU time.

use super::Failure;
use super::files::{cannot, import, save, say};
use clap::Args;
use nephroid::image_io::{self, ImageFormat};
use nephroid::lab::methods::methods;
use nephroid::lab::table::{self, SceneResults, reference_json};
use nephroid::lab::{
    Budget, Chart, LabError, Reference, Subject, Task, honesty, measure_reference, page, run_method, svg,
    time_structures,
};
use nephroid::plan::Plan;
use nephroid::scene::{AssetSource, DirectoryAssets, ImageSettings};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Width of pictures, time of a method and of a reference with `--quick`.
const QUICK: (u32, f64, f64) = (120, 1.0, 4.0);
/// The reference takes this many times as long as a method.
const REFERENCE_TIMES: f64 = 6.0;

#[derive(Args, Debug)]
pub(super) struct ChartArguments {
    /// Scene files, or models in binary glTF.
    #[arg(required = true)]
    scenes: Vec<PathBuf>,
    /// Folder for charts, tables, the page and the references, which are used again.
    #[arg(short, long, value_name = "DIR", default_value = "chart")]
    output: PathBuf,
    /// Small pictures and a second for each method: a look, not a measurement.
    #[arg(long)]
    quick: bool,
    /// CPU time of each method, s; a reference takes six times that.
    #[arg(long, default_value_t = 20.0)]
    seconds: f64,
    /// Also ask this many renders for errors of 10, 5 and 2 %, and count those that keep their word.
    #[arg(long, value_name = "SEEDS", default_value_t = 0)]
    honesty: u32,
}

pub(super) fn run(arguments: &ChartArguments) -> Result<(), Failure> {
    if !(arguments.seconds.is_finite() && arguments.seconds > 0.0) {
        return Err(Failure::Usage("--seconds must be a number greater than 0".to_owned()));
    }
    let folder = &arguments.output;
    std::fs::create_dir_all(folder).map_err(|e| cannot("make", folder, &e))?;
    let mut results = Vec::new();
    for path in &arguments.scenes {
        results.push(arguments.scene(path)?);
        // Written after each scene: a long run that is interrupted has shown something.
        let scenes: Vec<&SceneResults> = results.iter().map(|(scene, _)| scene).collect();
        save(&folder.join("chart.csv"), table::csv(&scenes).as_bytes())?;
        save(&folder.join("chart.json"), format!("{:#}\n", table::json(&scenes)).as_bytes())?;
        let html = page::page(&results).map_err(Failure::Lab)?;
        save(&folder.join("index.html"), html.as_bytes())?;
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

    /// Charts one scene and writes its pictures.
    fn scene(&self, path: &Path) -> Result<(SceneResults, ImageSettings), Failure> {
        let (text, assets) = read(path)?;
        let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        let width = self.quick.then_some(QUICK.0);
        let wrong = |error| match error {
            LabError::Scene(errors) => Failure::Scene { path: path.to_owned(), errors },
            other => Failure::Lab(other),
        };
        let subject = Subject::new(&name, &text, &*assets, width).map_err(wrong)?;
        let scene = subject.scene(&json!({}), 0).map_err(wrong)?;
        let plan = Plan::new(&scene);
        let mut charts = Vec::new();
        for task in [Task::Picture, Task::DirectLight] {
            let methods = methods(&scene, &plan, task);
            if methods.is_empty() {
                continue;
            }
            let reference = self.reference(&subject, task)?;
            let mut chart = Chart { scene: name.clone(), task, reference, curves: Vec::new() };
            for method in &methods {
                say(format!("{name}, {}: {}", task.name(), method.name));
                let curve = run_method(&subject, method, &chart.reference, self.budget());
                chart.curves.push(curve.map_err(wrong)?);
            }
            save(&self.output.join(format!("{name}-{}.svg", task.name())), svg::draw(&chart).as_bytes())?;
            charts.push(chart);
        }
        let timings = time_structures(&subject).map_err(wrong)?;
        let picture = charts.iter().find(|chart| chart.task == Task::Picture);
        let honesty = match picture.filter(|_| self.honesty > 0) {
            Some(chart) => {
                say(format!("{name}: {} renders that stop by their own estimate", self.honesty));
                honesty(&subject, &chart.reference, self.honesty, self.budget().seconds).map_err(wrong)?
            }
            None => Vec::new(),
        };
        Ok((SceneResults { scene: name, charts, timings, honesty }, scene.image))
    }

    /// The reference of an earlier run of the same scene and budget, or a new one.
    fn reference(&self, subject: &Subject<'_>, task: Task) -> Result<Reference, Failure> {
        let file = |end: &str| self.output.join(format!("{}-{}-reference.{end}", subject.name, task.name()));
        let budget = self.budget();
        let key = json!({ "scene": format!("{:016x}", subject.hash()), "budget": budget.reference,
                          "version": env!("CARGO_PKG_VERSION") });
        if let Some(stored) = stored(&file("npy"), &file("json"), &key) {
            return Ok(stored);
        }
        say(format!("{}, {}: reference", subject.name, task.name()));
        let reference = measure_reference(subject, task, budget).map_err(Failure::Lab)?;
        save(&file("npy"), &image_io::encode_npy(&reference.image))?;
        let mut about = reference_json(&reference);
        about["made_for"] = key;
        save(&file("json"), format!("{about:#}\n").as_bytes())?;
        Ok(reference)
    }
}

fn stored(npy: &Path, about: &Path, key: &Value) -> Option<Reference> {
    let about: Value = serde_json::from_slice(&std::fs::read(about).ok()?).ok()?;
    if about["made_for"] != *key {
        return None;
    }
    let image = image_io::decode(&std::fs::read(npy).ok()?, ImageFormat::Npy).ok()?;
    table::reference_from(&about, image)
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
