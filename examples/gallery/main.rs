//! Renders every sample scene and writes docs/gallery: `make gallery`, or `cargo run --release --example gallery` at the
//! repository's root. Names of scenes as arguments render only those; their pictures are then replaced, the page is not.

mod shadows;

use nephroid::develop::develop;
use nephroid::plan::Plan;
use nephroid::render::{Control, Render};
use nephroid::scene::{DirectoryAssets, Scene};
use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

const SCENES: &str = "scenes";
const FOLDER: &str = "docs/gallery";

/// No scene takes more CPU time than this, s: half a minute on two cores, and no less of a picture on a machine that does
/// other things besides.
const MOST_CPU_SECONDS: f64 = 60.0;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = Path::new(FOLDER);
    std::fs::create_dir_all(folder)?;
    let asked: Vec<String> = std::env::args().skip(1).collect();
    let mut entries = Vec::new();
    for path in scenes()? {
        let name =
            path.file_stem().and_then(|stem| stem.to_str()).ok_or("a scene without a name")?.to_owned();
        if asked.is_empty() || asked.contains(&name) {
            eprintln!("{name}");
            entries.push(Entry::render(&path, &name, folder)?);
        }
    }
    if asked.is_empty() {
        let chart = shadows::Chart::measure()?;
        std::fs::write(folder.join("shadows.svg"), chart.svg())?;
        std::fs::write(folder.join("README.md"), page(&entries, &chart))?;
    }
    Ok(())
}

/// The sample scenes in the order of their names.
fn scenes() -> std::io::Result<Vec<PathBuf>> {
    let mut paths: Vec<PathBuf> = std::fs::read_dir(SCENES)?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|extension| extension == "json"))
        .collect();
    paths.sort();
    Ok(paths)
}

/// One picture of the gallery.
struct Entry {
    name: String,
    title: String,
    size: [u32; 2],
    /// Estimated relative error.
    error: f32,
    rounds: u32,
    /// What runs in this scene, in words.
    runs: Vec<String>,
}

impl Entry {
    fn render(path: &Path, name: &str, folder: &Path) -> Result<Self, Box<dyn Error>> {
        let text = std::fs::read_to_string(path)?;
        let mut scene = Scene::from_json(&text, &DirectoryAssets::new(SCENES))?;
        scene.render.stop.seconds = None;
        let scene = Arc::new(scene);
        let mut render = Render::new(Arc::clone(&scene), Plan::new(&scene));
        let control = Control::new();
        let cpu_seconds = |render: &Render| render.stats().pass1.cpu + render.stats().pass2.cpu;
        while render.stop_reason().is_none() && cpu_seconds(&render) < MOST_CPU_SECONDS {
            render.run_round(&control)?;
        }
        let size = [scene.image.width, scene.image.height];
        let pixels = develop(&render.image(), &scene.image);
        image::save_buffer(
            folder.join(format!("{name}.png")),
            &pixels,
            size[0],
            size[1],
            image::ExtendedColorType::Rgb8,
        )?;
        let decisions = &render.plan().decisions;
        Ok(Self {
            name: name.to_owned(),
            title: scene.name.clone(),
            size,
            error: render.error_estimate().unwrap_or(f32::NAN),
            rounds: render.rounds(),
            runs: decisions.iter().filter(|d| d.runs).map(|d| format!("{}: {}", d.topic, d.choice)).collect(),
        })
    }
}

/// The page: what each scene shows stands in scenes/README.md.
fn page(entries: &[Entry], chart: &shadows::Chart) -> String {
    let mut page = String::from(
        "# Gallery\n\n<!-- Written by `make gallery`. -->\n\nEvery sample scene of [scenes/](../../scenes/README.md), rendered to the \
         error that its file asks for, or for a minute of CPU time.\n\n",
    );
    for entry in entries {
        let Entry { name, title, size: [width, height], error, rounds, runs } = entry;
        // Writing to a string cannot fail.
        let _ = write!(
            page,
            "## {title}\n\n![{title}]({name}.png)\n\n[scenes/{name}.json](../../scenes/{name}.json), {width} × {height}, \
             {rounds} rounds, estimated error {:.1} %. {}.\n\n",
            100.0 * error,
            runs.join("; ")
        );
    }
    page.push_str(&chart.section());
    page
}
