//! The joint to the renderer: the only file that names the `nephroid` crate.

use crate::{error_map, samples};
use nephroid::film::Film;
use nephroid::image_io::{encode_exr, encode_png};
use nephroid::plan::{Bounds, Plan};
use nephroid::render::{Render, RenderError};
use nephroid::report;
use nephroid::scene::assets::{AssetError, AssetSource};
use nephroid::scene::{ImageSettings, Scene, SceneIssue, Tone};
use rayon::prelude::*;
use serde_json::Value;
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};

pub use nephroid::image_io::LinearImage;
pub use nephroid::render::Control;

/// One thing that is wrong with a scene, and where.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Issue {
    /// JSON pointer (RFC 6901) to the place.
    pub pointer: String,
    /// Stable name of what is wrong.
    pub code: String,
    /// One sentence.
    pub detail: String,
    /// Line and column in the text, from 1; `None` where unknown.
    pub place: Option<[usize; 2]>,
}

/// A scene that can be rendered.
#[derive(Clone, Debug)]
pub struct LoadedScene {
    scene: Arc<Scene>,
    /// The longest rendering time that the scene itself asks for.
    pub asked_seconds: Option<f64>,
    /// What it refers to, of the files that it was given.
    pub assets: Vec<String>,
}

impl LoadedScene {
    /// Reads and checks a scene that may refer to these files; on failure everything that is wrong with it.
    /// However it asks to end, it ends after `max_seconds` of rendering.
    pub fn read(text: &str, files: &dyn SceneFiles, max_seconds: f64) -> Result<Self, Vec<Issue>> {
        let assets = Assets { files, used: Mutex::default() };
        let read = Scene::from_json(text, &assets);
        let mut scene = read.map_err(|errors| errors.issues.into_iter().map(issue_of).collect::<Vec<_>>())?;
        let stop = &mut scene.render.stop;
        let asked_seconds = stop.seconds;
        stop.seconds = Some(asked_seconds.map_or(max_seconds, |asked| asked.min(max_seconds)));
        let assets = assets.used.into_inner().unwrap_or_else(PoisonError::into_inner);
        Ok(Self { scene: Arc::new(scene), asked_seconds, assets: assets.into_iter().collect() })
    }

    /// Surfaces that rays are held against, triangles of meshes each by itself.
    #[must_use]
    pub fn primitives(&self) -> usize {
        self.scene.geometry.primitive_count()
    }

    /// Lamps, shining objects among them.
    #[must_use]
    pub fn lights(&self) -> usize {
        self.scene.lights.len()
    }

    /// Memory that its render needs at the least: known without a plan.
    #[must_use]
    pub fn least_memory_bytes(&self) -> u64 {
        let [width, height] = self.size();
        let scene = self.scene.geometry.memory_bytes() + self.scene.image_bytes;
        Film::bytes(width, height).saturating_add(scene)
    }

    /// True if a plan of it may ask for more than this.
    #[must_use]
    pub fn may_exceed(&self, memory_bytes: u64, photons: u64) -> bool {
        let bounds = Bounds::of(&self.scene);
        bounds.memory_bytes > memory_bytes || bounds.photons > photons
    }

    /// The scene's own name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.scene.name
    }

    /// Pixels across and down.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        [self.scene.image.width, self.scene.image.height]
    }

    /// What will be run for it. Takes up to a second.
    #[must_use]
    pub fn plan(&self) -> PlannedScene {
        PlannedScene { plan: Plan::new(&self.scene), scene: Arc::clone(&self.scene) }
    }
}

/// The JSON Schema of scenes.
#[must_use]
pub fn scene_schema() -> Value {
    nephroid::scene::schema()
}

/// Files that a scene may refer to, beside those of the samples.
pub trait SceneFiles: Send + Sync {
    /// Reads a file; `None` if there is none of this name.
    ///
    /// # Errors
    /// If it is there and cannot be read: why, in words for the client.
    fn read(&self, name: &str) -> Result<Option<Vec<u8>>, String>;
}

/// No files but those of the samples.
#[derive(Clone, Copy, Debug)]
pub struct SampleFiles;

impl SceneFiles for SampleFiles {
    fn read(&self, _name: &str) -> Result<Option<Vec<u8>>, String> {
        Ok(None)
    }
}

/// The files of the samples and those given, and which of the latter were read.
struct Assets<'a> {
    files: &'a dyn SceneFiles,
    used: Mutex<BTreeSet<String>>,
}

impl AssetSource for Assets<'_> {
    fn read(&self, name: &str) -> Result<Cow<'_, [u8]>, AssetError> {
        if let Some(sample) = samples::asset(name) {
            return Ok(Cow::Borrowed(sample));
        }
        let unreadable = |reason| AssetError::Unreadable { name: name.to_owned(), reason };
        let bytes = self.files.read(name).map_err(unreadable)?;
        let bytes = bytes.ok_or_else(|| AssetError::NotFound(name.to_owned()))?;
        self.used.lock().unwrap_or_else(PoisonError::into_inner).insert(name.to_owned());
        Ok(Cow::Owned(bytes))
    }
}

fn issue_of(issue: SceneIssue) -> Issue {
    let place = (issue.line > 0).then_some([issue.line, issue.column]);
    Issue { pointer: issue.pointer, code: issue.code.as_str().into(), detail: issue.message, place }
}

/// A scene, and what will be run for it.
#[derive(Debug)]
pub struct PlannedScene {
    scene: Arc<Scene>,
    plan: Plan,
}

impl PlannedScene {
    /// Every decision with its reason, as JSON.
    #[must_use]
    pub fn report(&self) -> Value {
        report::plan_json(&self.scene, &self.plan)
    }

    /// Memory that the render will need.
    #[must_use]
    pub fn memory_bytes(&self) -> u64 {
        self.plan.memory_bytes
    }

    /// Photons that its largest round may send.
    #[must_use]
    pub fn photons_per_round(&self) -> u64 {
        self.plan.most_photons()
    }

    /// Begins the render, from a checkpoint if there is one that fits.
    #[must_use]
    pub fn begin(self, checkpoint: Option<&[u8]>) -> RunningRender {
        let Self { scene, plan } = self;
        let settings = scene.image;
        let resumed = checkpoint.and_then(|checkpoint| {
            Render::resume(Arc::clone(&scene), plan.clone(), checkpoint)
                .inspect_err(
                    |error| tracing::warn!(%error, "a checkpoint does not fit; the render starts anew"),
                )
                .ok()
        });
        let render = resumed.unwrap_or_else(|| Render::new(scene, plan));
        RunningRender { render, settings }
    }
}

/// Why a round did not finish.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RoundError {
    /// It was told to stop.
    Cancelled,
    /// The renderer found its own result wrong.
    Failed {
        /// Stable name of the reason.
        code: &'static str,
        /// One sentence.
        detail: String,
    },
}

/// What a render has cost so far.
#[derive(Clone, Copy, Debug, Default)]
pub struct Work {
    /// Photons sent.
    pub photons: u64,
    /// Rays traced, of photons and of the eye.
    pub rays: u64,
    /// Seconds by the clock in pass 1 and pass 2.
    pub pass_seconds: [f64; 2],
}

/// A picture that a finished render leaves.
#[derive(Debug)]
pub struct Output {
    /// Its path below the job.
    pub name: String,
    /// The file.
    pub bytes: Vec<u8>,
}

/// A render between two rounds.
pub struct RunningRender {
    render: Render,
    settings: ImageSettings,
}

impl RunningRender {
    /// Runs one round on the thread pool that this is called in.
    pub fn run_round(&mut self, control: &Control) -> Result<(), RoundError> {
        match self.render.run_round(control) {
            Ok(_) => Ok(()),
            Err(RenderError::Cancelled) => Err(RoundError::Cancelled),
            Err(error @ RenderError::NotFinite { .. }) => {
                Err(RoundError::Failed { code: "not_finite", detail: error.to_string() })
            }
        }
    }

    /// Which limit ended the render, once one has.
    #[must_use]
    pub fn stop_reason(&self) -> Option<&'static str> {
        self.render.stop_reason().map(|reason| reason.as_str())
    }

    /// Rounds that are finished.
    #[must_use]
    pub fn rounds(&self) -> u32 {
        self.render.rounds()
    }

    /// Estimated error after those.
    #[must_use]
    pub fn error_estimate(&self) -> Option<f32> {
        self.render.error_estimate().filter(|error| error.is_finite())
    }

    /// Time spent in rounds.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.render.seconds()
    }

    /// From 0 to 1, a guess from the rule that will end the render.
    #[must_use]
    pub fn progress(&self) -> f32 {
        self.render.progress()
    }

    /// All it takes to go on from here in another process, to the same bytes.
    #[must_use]
    pub fn checkpoint(&self) -> Vec<u8> {
        self.render.checkpoint()
    }

    /// The picture after the finished rounds.
    #[must_use]
    pub fn picture(&self) -> Picture {
        Picture { image: self.render.preview(), settings: self.settings }
    }

    /// What the render counted, as JSON.
    #[must_use]
    pub fn stats(&self) -> Value {
        report::stats_json(&self.render)
    }

    /// What it has cost so far.
    #[must_use]
    pub fn work(&self) -> Work {
        let stats = self.render.stats();
        let photon_rays: u64 = stats.windows.iter().map(|tally| tally.rays).sum();
        Work {
            photons: stats.windows.iter().map(|tally| tally.sent).sum(),
            rays: photon_rays + stats.eye.eye_rays + stats.eye.shadow_rays,
            pass_seconds: [stats.pass1.wall, stats.pass2.wall],
        }
    }

    /// The pictures of a finished render: the whole and its layers, each as it is shown and as light.
    pub fn outputs(&self) -> Result<Vec<Output>, String> {
        let picture = self.render.picture();
        let [png, exr] = self.both("image", &picture.image())?;
        let mut outputs = vec![png, exr];
        let layers = self.render.layers();
        let parts = layers
            .par_iter()
            .map(|layer| self.both(&format!("layers/{}", layer.name()), &picture.part(layer)));
        outputs.extend(parts.collect::<Result<Vec<_>, _>>()?.into_iter().flatten());
        outputs.push(Output { name: "error.png".into(), bytes: self.error_map(&picture)? });
        Ok(outputs)
    }

    /// A picture for displays, and for who adds its light to other light.
    fn both(&self, name: &str, image: &LinearImage) -> Result<[Output; 2], String> {
        let exr = encode_exr(image).map_err(|error| error.to_string())?;
        Ok([
            Output { name: format!("{name}.png"), bytes: self.png(image)? },
            Output { name: format!("{name}.exr"), bytes: exr },
        ])
    }

    /// The estimated error of each pixel, as colours.
    fn error_map(&self, picture: &nephroid::picture::Picture<'_>) -> Result<Vec<u8>, String> {
        let errors = picture.errors();
        let pixels = errors.iter().map(|error| error_map::color(error.total().sqrt())).collect();
        let ImageSettings { width, height, .. } = self.settings;
        let settings = ImageSettings { width, height, exposure: 0.0, tone: Tone::Linear };
        encode_png(&LinearImage { width, height, pixels }, &settings).map_err(|error| error.to_string())
    }

    fn png(&self, image: &LinearImage) -> Result<Vec<u8>, String> {
        encode_png(image, &self.settings).map_err(|error| error.to_string())
    }
}

/// A picture that is not encoded yet.
#[derive(Debug)]
pub struct Picture {
    image: LinearImage,
    settings: ImageSettings,
}

impl Picture {
    /// The picture as PNG, exposed and toned as the scene says.
    pub fn to_png(&self) -> Result<Vec<u8>, String> {
        encode_png(&self.image, &self.settings).map_err(|error| error.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn begin(checkpoint: Option<&[u8]>) -> RunningRender {
        let sample = samples::find("glass-ball").expect("it is embedded");
        let mut scene: Value = serde_json::from_str(sample.text).expect("it is JSON");
        scene["image"]["width"] = 32.into();
        scene["image"]["height"] = 24.into();
        let scene = LoadedScene::read(&scene.to_string(), &SampleFiles, 60.0).expect("it is a scene");
        scene.plan().begin(checkpoint)
    }

    #[test]
    fn a_checkpoint_goes_on_to_the_same_bytes() {
        let control = Control::default();
        let mut straight = begin(None);
        (0..3).for_each(|_| straight.run_round(&control).expect("nothing stops it"));
        let mut first = begin(None);
        (0..2).for_each(|_| first.run_round(&control).expect("nothing stops it"));
        let mut resumed = begin(Some(&first.checkpoint()));
        assert_eq!(resumed.rounds(), 2, "finished rounds are not made again");
        resumed.run_round(&control).expect("nothing stops it");
        assert!(resumed.picture().to_png() == straight.picture().to_png());
    }

    #[test]
    fn no_plan_asks_for_more_than_its_bounds() {
        for sample in samples::all() {
            let scene = LoadedScene::read(sample.text, &SampleFiles, 60.0).expect("it is a scene");
            let planned = scene.plan();
            assert!(scene.may_exceed(planned.memory_bytes() - 1, u64::MAX), "{}", sample.name);
            assert!(
                scene.may_exceed(u64::MAX, planned.photons_per_round().saturating_sub(1)),
                "{}",
                sample.name
            );
            assert!(!scene.may_exceed(6 << 30, 1 << 26), "{} need not be planned to be taken", sample.name);
        }
    }

    #[test]
    fn a_checkpoint_that_does_not_fit_is_not_used() {
        assert_eq!(begin(Some(b"something else")).rounds(), 0);
    }

    #[test]
    fn a_round_that_is_stopped_leaves_the_finished_ones() {
        let mut render = begin(None);
        render.run_round(&Control::default()).expect("nothing stops it");
        let stop = Control::default();
        stop.cancel();
        assert_eq!(render.run_round(&stop), Err(RoundError::Cancelled));
        assert_eq!(render.rounds(), 1);
    }
}
