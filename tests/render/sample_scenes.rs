//! Every sample scene: direct light and caustics by two estimators each, as means over the picture.

use crate::support::{Estimate, T_LIMIT, mean};
use nephroid::plan::Plan;
use nephroid::render::{Control, Render};
use nephroid::scene::{Caustics, DirectoryAssets, Scene};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Where the sample scenes and what they are made of lie.
pub(crate) fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes")
}

/// Every sample scene by its name, without layers.
pub(crate) fn sample_scenes() -> Vec<(String, Value)> {
    let mut files: Vec<_> = std::fs::read_dir(folder()).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|e| e == "json"));
    files.sort();
    let read = |path: &PathBuf| {
        let mut value: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
        value["render"].as_object_mut().map(|render| render.remove("layers"));
        (path.file_stem().unwrap().display().to_string(), value)
    };
    files.iter().map(read).collect()
}

/// Two ways to the light of some paths.
struct Pair {
    paths: &'static str,
    settings: [Value; 2],
    /// Whether both can find it in a scene.
    applies: fn(&Scene) -> bool,
}

fn has_photons(scene: &Scene) -> bool {
    Plan::new(scene).caustics == Some(Caustics::Photons)
}

/// Direct light by one point of a low-discrepancy net, or one in each square of a grid; caustics that are seen straight by the
/// pixels' footprints, or by photons that are each connected to the eye. What paths from the eye must meet by chance is compared
/// elsewhere, under larger lights: of the small ones here few seeds tell no error.
fn pairs() -> Vec<Pair> {
    let [photons, forward] = ["photons", "forward"].map(|name| json!({ "caustics": name }));
    let jittered = json!({ "light_sampling": "jittered", "light_grid": 3 });
    vec![
        Pair {
            paths: "LDS*E",
            settings: [json!({ "light_sampling": "sobol" }), jittered],
            applies: |scene| scene.lights.iter().any(|l| matches!(l.kind(), "quad" | "disk")),
        },
        Pair { paths: "LS+DE", settings: [photons, forward], applies: has_photons },
    ]
}

/// What the photons' kernel, a pixel wide, may lose or gain at the borders of what pixels show: 2.2 % of the caustics of `spot` in so
/// few pixels, 0.4 % in twice as many across.
pub(crate) const BORDERS: f64 = 0.03;

/// Pictures by which a mean and its error are known.
const SEEDS: u64 = 6;

/// Mean over the picture, of every pixel's equally many samples, nothing smoothed.
fn light(value: &Value, assets: &DirectoryAssets) -> Estimate {
    let mut of_seeds = Vec::new();
    for seed in 0..SEEDS {
        let mut value = value.clone();
        value["render"]["seed"] = json!(seed);
        let scene = Arc::new(Scene::from_json(&value.to_string(), assets).unwrap_or_else(|e| panic!("{e}")));
        let mut render = Render::new(Arc::clone(&scene), Plan::new(&scene)).evenly();
        for _ in 0..2 {
            render.run_round(&Control::new()).unwrap();
        }
        let halves = render.raw_halves();
        of_seeds.push(halves.iter().map(mean).sum::<f64>() / 2.0);
    }
    Estimate::of(&of_seeds)
}

/// Student's t of 5 degrees of freedom exceeds [`T_LIMIT`] in one of 1500 comparisons. At least three of four tell 10 %.
#[test]
fn direct_light_and_caustics_of_every_sample_scene_agree_between_two_estimators() {
    let assets = DirectoryAssets::new(folder());
    let (mut compared, mut told) = (0, 0);
    for (file, mut value) in sample_scenes() {
        value["image"] = json!({ "width": 96, "height": 72 });
        for pair in pairs() {
            value["render"]["paths"] = json!(pair.paths);
            let scene = Scene::from_json(&value.to_string(), &assets).unwrap_or_else(|e| panic!("{e}"));
            if !(pair.applies)(&scene) {
                continue;
            }
            let [a, b] = pair.settings.map(|settings| {
                let mut value = value.clone();
                for (name, setting) in settings.as_object().unwrap() {
                    value["render"][name] = setting.clone();
                }
                light(&value, &assets)
            });
            let name = format!("{file} {}", pair.paths);
            let error = a.standard_error.hypot(b.standard_error);
            if a.mean == 0.0 && b.mean == 0.0 {
                continue;
            }
            compared += 1;
            told += u32::from(T_LIMIT * error < 0.1 * a.mean.max(b.mean));
            assert!((a.mean - b.mean).abs() <= T_LIMIT * error + BORDERS * b.mean, "{name}: {a:?} {b:?}");
        }
    }
    assert!(compared >= 30 && 4 * told >= 3 * compared, "{told} of {compared} tell 10 %");
}
