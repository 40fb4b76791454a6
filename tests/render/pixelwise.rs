//! `LS+DS*E` alone, pixel by pixel: photons against path tracing that is run long, under lights that are large enough for
//! paths to meet them.

use crate::casters::{balls, basin, block_and_gold, in_a_mirror, prism_and_ring};
use crate::support::{Estimate, SEEDS, T_LIMIT, block_means, compile, estimates, render_shared, with_seeds};
use nephroid::light_path::PathClass;
use nephroid::scene::{DirectoryAssets, Scene};
use serde_json::{Value, json};
use std::path::Path;

/// Squares of the picture whose light is compared, across and down: 576 values with their channels, so that all tests
/// here together compare 4608. Fewer than one in a hundred of such sets hold a |t| beyond [`T_LIMIT`] by chance.
const BLOCKS: [u32; 2] = [16, 12];

/// Pixels across each for the photons. At the rim of what hides a brighter place their kernel blurs over a pixel.
const PHOTONS: u32 = 2;

/// And for the paths: theirs is one round only, since later ones send more where the first has met light, so that what it
/// met counts for less and the mean of few rounds is too low.
const PATHS: u32 = 32;

/// What is below this share of the picture's mean is not told apart.
const LEAST: f64 = 0.01;

/// [`SEEDS`] independent pictures, by their blocks: the two halves of half as many renders share no random number.
struct Pictures {
    raw: Vec<Vec<f64>>,
    /// Means of the same halves after smoothing.
    smoothed: Vec<Vec<f64>>,
}

impl Pictures {
    fn render(
        read: &dyn Fn(&Value) -> Scene,
        value: &Value,
        (estimator, pixels): (&str, u32),
        cost: [u32; 2],
    ) -> Self {
        let [rounds, log2_photons] = cost;
        let mut value = value.clone();
        value["image"] = json!({ "width": pixels * BLOCKS[0], "height": pixels * BLOCKS[1] });
        value["render"] = json!({ "paths": "LS+DS*E", "caustics": estimator, "stop": { "rounds": rounds } });
        let mut pictures = Self { raw: Vec::new(), smoothed: Vec::new() };
        with_seeds(read(&value), SEEDS / 2, |scene| {
            let render = render_shared(scene, rounds, Some(log2_photons));
            pictures.raw.extend(render.raw_halves().iter().map(|half| block_means(half, pixels as usize)));
            pictures.smoothed.push(block_means(&render.layer(PathClass::Caustic), pixels as usize));
        });
        pictures
    }

    /// Mean of all blocks.
    fn mean(&self) -> Estimate {
        let mean = |values: &Vec<f64>| values.iter().sum::<f64>() / values.len() as f64;
        Estimate::of(&self.raw.iter().map(mean).collect::<Vec<_>>())
    }
}

/// Photons and paths, block by block.
struct Compared {
    /// Difference in standard errors.
    t: Vec<f64>,
    /// Mean of the squares of these, and the most that chance makes of it.
    square: [f64; 2],
    /// Mean light by photons and by paths.
    means: [Estimate; 2],
    /// Root mean square of what single pictures by photons are off from the paths' mean, over the mean: as gathered, and smoothed.
    errors: [f64; 2],
}

impl Compared {
    fn new(photons: &Pictures, paths: &Pictures) -> Self {
        let (a, b) = (estimates(&photons.raw), estimates(&paths.raw));
        let mean = paths.mean().mean;
        let [photons_per_light, paths_per_light] = [&a, &b].map(|estimates| variance_per_light(estimates));
        let t: Vec<f64> = a
            .iter()
            .zip(&b)
            .map(|(a, b)| {
                let light = a.mean.max(b.mean);
                a.at_least(photons_per_light * light)
                    .distance(b.at_least(paths_per_light * light), LEAST * mean)
            })
            .collect();
        // Student's t squared, at 15 degrees of freedom: mean 15/13, variance 3.4. Channels are not independent.
        let most = 15.0 / 13.0 + 5.0 * (3.4 / f64::from(BLOCKS[0] * BLOCKS[1])).sqrt();
        let square = t.iter().map(|t| t * t).sum::<f64>() / t.len() as f64;
        let errors = [halves(&photons.raw), photons.smoothed.clone()].map(|pictures| {
            let off = pictures.iter().flat_map(|p| p.iter().zip(&b).map(|(a, b)| (a - b.mean).powi(2)));
            (off.sum::<f64>() / (pictures.len() * b.len()) as f64).sqrt() / mean
        });
        Self { t, square: [square, most], means: [photons.mean(), paths.mean()], errors }
    }

    fn worst(&self) -> f64 {
        self.t.iter().fold(0.0, |worst, t| worst.max(t.abs()))
    }

    fn agree(&self) -> bool {
        let [a, b] = self.means;
        self.worst() < T_LIMIT && self.square[0] < self.square[1] && a.distance(b, 0.0).abs() < T_LIMIT
    }
}

/// Photons and paths that bring light are rare and much alike: their number is Poisson's, and the variance in proportion to
/// the light that there is. A block to which few came tells too little of its own.
fn variance_per_light(estimates: &[Estimate]) -> f64 {
    let [variance, light] = [|e: &Estimate| e.standard_error.powi(2), |e: &Estimate| e.mean]
        .map(|of| estimates.iter().map(of).sum::<f64>());
    variance / light
}

/// Means of the two halves of each render.
fn halves(pictures: &[Vec<f64>]) -> Vec<Vec<f64>> {
    pictures
        .chunks_exact(2)
        .map(|pair| pair[0].iter().zip(&pair[1]).map(|(a, b)| 0.5 * (a + b)).collect())
        .collect()
}

/// With 2^`log2_photons` photons per window and half in each of two rounds.
fn agree(read: &dyn Fn(&Value) -> Scene, value: &Value, log2_photons: u32) {
    let photons = Pictures::render(read, value, ("photons", PHOTONS), [2, log2_photons]);
    let paths = Pictures::render(read, value, ("backward", PATHS), [1, 8]);
    let found = Compared::new(&photons, &paths);
    let [a, b] = found.means;
    let error = a.standard_error.hypot(b.standard_error);
    assert!(T_LIMIT * error < 0.125 * b.mean, "too noisy to tell: {a:?} {b:?}");
    assert!(found.agree(), "t up to {}, mean square {:?}, {a:?} {b:?}", found.worst(), found.square);
    // Smoothing takes away more noise than it blurs, or as much.
    let [raw, smoothed] = found.errors;
    assert!(smoothed < 1.1 * raw, "{raw} {smoothed}");
}

/// A sample scene, its light as large as `light`.
fn sample(name: &str, light: f64) -> Value {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    let mut value: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    value["lights"][0]["size"] = json!([light, light]);
    value
}

fn with_meshes(value: &Value) -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    Scene::from_json(&value.to_string(), &DirectoryAssets::new(folder)).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn photons_and_paths_agree_pixel_by_pixel_beside_the_glass_ball() {
    agree(&with_meshes, &sample("glass-ball.json", 2.4), 11);
}

#[test]
fn photons_and_paths_agree_pixel_by_pixel_in_the_ring() {
    agree(&with_meshes, &sample("ring.json", 2.0), 11);
}

#[test]
fn photons_and_paths_agree_pixel_by_pixel_in_the_pool() {
    agree(&with_meshes, &sample("pool.json", 3.0), 11);
}

#[test]
fn photons_and_paths_agree_pixel_by_pixel_between_balls() {
    agree(&|v| compile(v), &balls(), 10);
}

#[test]
fn photons_and_paths_agree_pixel_by_pixel_between_a_prism_and_a_ring() {
    agree(&|v| compile(v), &prism_and_ring(), 11);
}

#[test]
fn photons_and_paths_agree_pixel_by_pixel_under_waves() {
    agree(&|v| compile(v), &basin(), 12);
}

#[test]
fn photons_and_paths_agree_pixel_by_pixel_beside_coloured_glass_and_gold() {
    agree(&|v| compile(v), &block_and_gold(), 11);
}

#[test]
fn photons_and_paths_agree_pixel_by_pixel_in_a_mirror() {
    agree(&|v| compile(v), &in_a_mirror(), 10);
}

/// The comparison would find a ball of another index of refraction, one that lies a little beside, and a lamp that is a little
/// brighter.
#[test]
fn what_is_a_little_different_is_told_apart() {
    let read = |value: &Value| compile(value);
    let paths = Pictures::render(&read, &balls(), ("backward", PATHS), [1, 8]);
    for (pointer, wrong) in [
        ("/materials/glass/ior", json!(1.3)),
        ("/objects/1/center", json!([-0.6, 0.6, 0.0])),
        ("/lights/0/radiance", json!([11, 8, 6])),
    ] {
        let mut value = balls();
        *value.pointer_mut(pointer).unwrap() = wrong;
        let photons = Pictures::render(&read, &value, ("photons", PHOTONS), [1, 9]);
        let found = Compared::new(&photons, &paths);
        assert!(!found.agree(), "{pointer}");
    }
}
