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
    render_shared(&Arc::new(scene), rounds, Some(log2_photons))
}

/// The same of a scene whose seed is set, or with the plan's own number of photons.
pub(crate) fn render_shared(scene: &Arc<Scene>, rounds: u32, log2_photons: Option<u32>) -> Render {
    let mut plan = Plan::new(scene);
    for budget in &mut plan.photons {
        budget.log2_block = log2_photons.unwrap_or(budget.log2_block);
    }
    let mut render = Render::new(Arc::clone(scene), plan);
    let control = Control::new();
    for _ in 0..rounds {
        render.run_round(&control).unwrap();
    }
    render
}

/// Does something with a scene under each of `count` seeds: a large one is read once.
pub(crate) fn with_seeds(mut scene: Scene, count: u64, mut each: impl FnMut(&Arc<Scene>)) {
    for seed in 1..=count {
        scene.render.seed = seed;
        let shared = Arc::new(scene);
        each(&shared);
        scene = Arc::into_inner(shared).expect("the render is done");
    }
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
    Estimate::of(&(0..SEEDS).map(|seed| value(seed + 1)).collect::<Vec<_>>())
}

/// Means over squares of `side` pixels, row by row, each channel by itself.
pub(crate) fn block_means(image: &LinearImage, side: usize) -> Vec<f64> {
    let (width, height) = (image.width as usize, image.height as usize);
    let across = width / side;
    assert!(width.is_multiple_of(side) && height.is_multiple_of(side));
    let mut sums = vec![0.0; 3 * across * (height / side)];
    for (i, pixel) in image.pixels.iter().enumerate() {
        let block = i / width / side * across + i % width / side;
        (0..3).for_each(|c| sums[3 * block + c] += f64::from(pixel[c]));
    }
    sums.iter().map(|sum| sum / (side * side) as f64).collect()
}

/// For each of some values its mean over repetitions, of which each gives all values.
pub(crate) fn estimates(repetitions: &[Vec<f64>]) -> Vec<Estimate> {
    let of = |i: usize| Estimate::of(&repetitions.iter().map(|values| values[i]).collect::<Vec<_>>());
    (0..repetitions[0].len()).map(of).collect()
}

impl Estimate {
    /// Of independent values.
    pub(crate) fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
        Self { mean, standard_error: (variance / n).sqrt() }
    }

    /// The same with no less variance than this.
    pub(crate) fn at_least(self, variance: f64) -> Self {
        Self { standard_error: self.standard_error.max(variance.sqrt()), ..self }
    }

    /// How many standard errors of both it differs from another. What is below `least` is not told apart.
    pub(crate) fn distance(self, other: Self, least: f64) -> f64 {
        (self.mean - other.mean) / self.standard_error.hypot(other.standard_error).hypot(least)
    }

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
