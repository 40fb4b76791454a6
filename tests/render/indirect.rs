//! Indirect light, `L(D|S)*DS*DS*E`: smoothed on the pixels' footprints, and right in the mean.

use crate::support::{SEEDS, T_LIMIT, camera_above, floor, over_seeds, render, scene};
use nephroid::image_io::LinearImage;
use nephroid::light_path::PathClass;
use serde_json::{Value, json};

const PIXELS: usize = 48;

/// A floor at the foot of a wall that a lamp lights: from there it lights the floor once more.
fn before_a_wall() -> Value {
    let wall = json!({ "type": "polygon", "material": "floor",
                       "vertices": [[-1, 0, 2], [-1, 0, -2], [-1, 2, -2], [-1, 2, 2]] });
    let lamp = json!([{ "type": "point", "position": [0.5, 1, 0], "intensity": [1, 1, 1] }]);
    let mut value = scene(camera_above([0.0; 3], 3.0, 1.2), json!([floor(2.0, 0.0), wall]), lamp);
    value["image"] = json!({ "width": PIXELS, "height": PIXELS });
    value["render"]["paths"] = json!("complete");
    value
}

/// Root mean square difference, relative to the mean of the second.
fn relative_rmse(image: &LinearImage, truth: &[f64]) -> f64 {
    let squares = image.pixels.iter().zip(truth).map(|(p, t)| (f64::from(p[1]) - t).powi(2));
    let mean = truth.iter().sum::<f64>() / truth.len() as f64;
    (squares.sum::<f64>() / truth.len() as f64).sqrt() / mean
}

/// Path tracing that smooths nothing.
fn path_traced(value: &Value, rounds: u32) -> Vec<f64> {
    let mut value = value.clone();
    value["render"]["caustics"] = json!("backward");
    let render = render(&value, 99, rounds, 10);
    let layer = render.layer(PathClass::Indirect);
    assert!(layer == render.raw_layer(PathClass::Indirect), "nothing is smoothed");
    layer.pixels.iter().map(|p| f64::from(p[1])).collect()
}

/// The mean over a quarter of the picture.
fn quarter(pixels: impl Fn(usize) -> f64, number: usize) -> f64 {
    let half = PIXELS / 2;
    let (left, top) = (number % 2 * half, number / 2 * half);
    let inside = (top..top + half).flat_map(|y| (left..left + half).map(move |x| y * PIXELS + x));
    inside.map(pixels).sum::<f64>() / (half * half) as f64
}

/// One path for every fourth pixel and half is enough for a picture without holes, whose noise is less than a quarter of theirs.
#[test]
fn a_first_round_of_few_paths_is_smoothed() {
    let value = before_a_wall();
    let truth = path_traced(&value, 64);
    let render = render(&value, 1, 1, 10);
    let stats = render.stats();
    let pixels = (PIXELS * PIXELS) as u64;
    assert!(stats.eye.paths < pixels, "{} paths in both halves of {pixels} pixels", stats.eye.paths);
    let layer = render.layer(PathClass::Indirect);
    let darkest = layer.pixels.iter().map(|p| p[1]).fold(f32::INFINITY, f32::min);
    assert!(darkest > 0.0, "no pixel is left without");
    let (after, before) =
        (relative_rmse(&layer, &truth), relative_rmse(&render.raw_layer(PathClass::Indirect), &truth));
    assert!(after < before / 4.0, "{after} {before}");
}

/// Smoothed and path traced light agree over each quarter of the picture: what is smoothed stays where it is.
#[test]
fn smoothed_and_path_traced_light_agree() {
    let value = before_a_wall();
    let pictures: Vec<LinearImage> =
        (1..=SEEDS).map(|seed| render(&value, seed, 12, 10).layer(PathClass::Indirect)).collect();
    let truth = path_traced(&value, 256);
    for number in 0..4 {
        let found = over_seeds(|seed| {
            let picture = &pictures[seed as usize - 1];
            quarter(|i| f64::from(picture.pixels[i][1]), number)
        });
        let expected = quarter(|i| truth[i], number);
        let error = T_LIMIT * found.standard_error;
        assert!(error < 0.05 * expected, "{number}: too noisy: {found:?}");
        // Single paths are as noisy as bright; of about 512 in each of 576 pixels the mean has a noise of 3e-3.
        assert!((found.mean - expected).abs() <= error + 3e-3 * expected, "{number}: {found:?} {expected}");
    }
}

/// The estimate of the error, which knows no truth, is no less than two thirds of it and no more than three times, in the
/// mean over seeds.
#[test]
fn the_error_of_indirect_light_is_estimated() {
    let value = before_a_wall();
    let mut quiet = value.clone();
    quiet["render"]["caustics"] = json!("backward");
    let reference = render(&quiet, 99, 256, 10).image();
    let mean = reference.pixels.iter().map(|p| f64::from(p[1])).sum::<f64>() / reference.pixels.len() as f64;
    let (mut estimated, mut actual) = (0.0, 0.0);
    for seed in 1..=SEEDS {
        let render = render(&value, seed, 2, 10);
        let squares = render.image().pixels.iter().zip(&reference.pixels).fold(0.0, |sum, (p, t)| {
            let (p, t) = (f64::from(p[1]), f64::from(t[1]));
            sum + (p - t).powi(2) / (t.powi(2) + 0.01 * mean.powi(2))
        });
        actual += squares / reference.pixels.len() as f64;
        estimated += f64::from(render.error_estimate().unwrap()).powi(2);
    }
    let ratio = (estimated / actual).sqrt();
    assert!((1.0 / 1.5..3.0).contains(&ratio), "estimated over true: {ratio}");
}
