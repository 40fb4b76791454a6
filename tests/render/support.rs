//! Scenes written in place, and means with their standard errors.

use nephroid::image_io::LinearImage;
use nephroid::light_path::PathClass;
use nephroid::plan::Plan;
use nephroid::render::{Control, Render};
use nephroid::scene::{NoAssets, Scene};
use serde_json::{Value, json};
use std::sync::Arc;

/// The seeds over which a statistical test takes its mean and standard error.
pub(crate) const SEEDS: u64 = 16;

/// |z| accepted for a single value: one in a million (4.9 sigma), widened for a standard error that is itself
/// estimated from [`SEEDS`] values (Student's t with 15 degrees of freedom reaches the same level at 7.5).
pub(crate) const T_LIMIT: f64 = 7.5;

/// A camera at `height` straight above a floor point (below it, if negative) that sees a square of side `width` around it.
pub(crate) fn camera_above(point: [f64; 3], height: f64, width: f64) -> Value {
    let fov = 2.0 * (0.5 * width / height.abs()).atan().to_degrees();
    json!({ "type": "perspective", "eye": [point[0], point[1] + height, point[2]], "target": point,
            "up": [0, 0, -1], "fov": fov })
}

/// A horizontal square of side `2 * half` at height `y`, its normal up.
pub(crate) fn floor(half: f64, y: f64) -> Value {
    json!({ "name": "floor", "type": "polygon", "material": "floor",
            "vertices": [[-half, y, half], [half, y, half], [half, y, -half], [-half, y, -half]] })
}

/// A scene over a floor of albedo 1/2.
pub(crate) fn scene(camera: Value, objects: Value, lights: Value) -> Value {
    json!({ "nephroid": 1, "image": { "width": 16, "height": 16 }, "camera": camera,
        "materials": { "floor": { "type": "diffuse", "albedo": [0.5, 0.5, 0.5] },
                       "mirror": { "type": "mirror", "reflectance": [0.9, 0.9, 0.9] },
                       "glass": { "type": "glass", "ior": 1.5 },
                       "air": { "type": "glass", "ior": 1.0 } },
        "objects": objects, "lights": lights, "render": { "stop": { "rounds": 1 } } })
}

pub(crate) fn compile(value: &Value) -> Scene {
    Scene::from_json(&value.to_string(), &NoAssets).unwrap_or_else(|e| panic!("{e}"))
}

/// Renders `rounds` rounds with 2^`log2_photons` photons per window and half in each.
pub(crate) fn render(value: &Value, seed: u64, rounds: u32, log2_photons: u32) -> Render {
    render_scene(compile(value), seed, rounds, log2_photons)
}

/// The same of a compiled scene.
pub(crate) fn render_scene(mut scene: Scene, seed: u64, rounds: u32, log2_photons: u32) -> Render {
    scene.render.seed = seed;
    let mut plan = Plan::new(&scene);
    plan.photons.iter_mut().for_each(|budget| budget.log2_block = log2_photons);
    let mut render = Render::new(Arc::new(scene), plan);
    let control = Control::new();
    for _ in 0..rounds {
        render.run_round(&control).unwrap();
    }
    render
}

/// Mean irradiance of a floor of albedo 1/2 over the picture's green channel, from one class of paths.
pub(crate) fn mean_irradiance(render: &Render, class: PathClass) -> f64 {
    mean(&render.layer(class)) * std::f64::consts::PI / 0.5
}

/// Mean of the green channel.
pub(crate) fn mean(image: &LinearImage) -> f64 {
    image.pixels.iter().map(|p| f64::from(p[1])).sum::<f64>() / image.pixels.len() as f64
}

/// A mean over seeds and its standard error.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Estimate {
    pub(crate) mean: f64,
    pub(crate) standard_error: f64,
}

pub(crate) fn over_seeds(mut value: impl FnMut(u64) -> f64) -> Estimate {
    let values: Vec<f64> = (0..SEEDS).map(|seed| value(seed + 1)).collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    Estimate { mean, standard_error: (variance / n).sqrt() }
}

impl Estimate {
    /// Fails unless the mean is `expected` up to noise and a relative `bias` that the caller accounts for.
    /// Also fails where the noise is so large that a relative error of 5 % would pass.
    pub(crate) fn assert_is(self, expected: f64, bias: f64) {
        let Self { mean, standard_error } = self;
        assert!(
            T_LIMIT * standard_error < 0.05 * expected.abs(),
            "too noisy to tell: {mean} ± {standard_error}, expected {expected}"
        );
        let allowed = T_LIMIT * standard_error + bias * expected.abs();
        assert!((mean - expected).abs() <= allowed, "{mean} ± {standard_error}, expected {expected}");
    }
}

/// Mean of `f` over a square of side `width` around (x, z), by the midpoint rule.
pub(crate) fn mean_over_square(x: f64, z: f64, width: f64, f: impl Fn(f64, f64) -> f64) -> f64 {
    let n = 64;
    let at = |i: i32| ((f64::from(i) + 0.5) / f64::from(n) - 0.5) * width;
    let sum: f64 = (0..n * n).map(|k| f(x + at(k % n), z + at(k / n))).sum();
    sum / f64::from(n * n)
}
