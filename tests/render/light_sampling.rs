//! The rules by which area lights are sampled: regular grids, jittered and adaptive strata.

use crate::support::{camera_above, floor, mean, mean_irradiance, render, scene};
use nephroid::light_path::PathClass;
use serde_json::{Value, json};
use std::f64::consts::PI;

fn sampled(mut value: Value, rule: &str, across: u32) -> Value {
    value["render"]["light_sampling"] = json!(rule);
    value["render"]["light_grid"] = json!(across);
    value
}

/// T17: n × n points on a 2 × 2 light at height 1: 4, 1.7778, … for the true 1.74084.
#[test]
fn t17_a_grid_of_points_converges_to_the_rectangle() {
    let lights = json!([{ "type": "quad", "center": [0, 1, 0], "size": [2, 2], "towards": [0, 0, 0], "radiance": [1, 1, 1] }]);
    let value = scene(camera_above([0.0; 3], 0.5, 1e-3), json!([floor(4.0, 0.0)]), lights);
    for (n, known) in [(1, 4.0), (2, 1.777_778), (4, 1.768_97), (8, 1.747_98), (16, 1.742_63)] {
        for rule in ["grid", "adaptive"] {
            let irradiance =
                mean_irradiance(&render(&sampled(value.clone(), rule, n), 1, 1, 8), PathClass::Direct);
            assert!((irradiance - known).abs() < 1e-4, "{rule} {n}: {irradiance}");
        }
    }
}

/// A distant unit light 200 above the floor; a half plane 100 above it hides all of the light on one side of a
/// line at `angle` (degrees) to the light's side, which runs `offset` from the light's centre.
fn half_plane(angle: f64, offset: f64) -> Value {
    let (sin, cos) = angle.to_radians().sin_cos();
    // Seen from the floor's centre lengths at height 100 are half of those on the light.
    let at = |along: f64, across: f64| {
        let across = across + 0.5 * offset;
        json!([across * cos - along * sin, 100, across * sin + along * cos])
    };
    let blocker = json!({ "type": "polygon", "material": "floor",
                          "vertices": [at(-2.0, 0.0), at(2.0, 0.0), at(2.0, -4.0), at(-2.0, -4.0)] });
    let lights = json!([{ "type": "quad", "center": [0, 200, 0], "size": [1, 1], "edge": [1, 0, 0], "towards": [0, 0, 0],
                          "radiance": [40_000, 40_000, 40_000] }]);
    scene(camera_above([0.0; 3], 0.5, 1e-4), json!([floor(4.0, 0.0), blocker]), lights)
}

/// Share of the unit square beyond the line.
fn visible_share(angle: f64, offset: f64) -> f64 {
    let (sin, cos) = angle.to_radians().sin_cos();
    let n = 1000;
    let at = |i: i32| (f64::from(i) + 0.5) / f64::from(n) - 0.5;
    let seen = (0..n * n).filter(|k| at(k % n) * cos + at(k / n) * sin > offset).count();
    seen as f64 / f64::from(n * n)
}

/// Visible shares that the pixels of one picture find, each from one look at the light.
fn found_shares(value: &Value, seed: u64) -> Vec<f64> {
    let picture = render(value, seed, 1, 8).layer(PathClass::Direct);
    picture.pixels.iter().map(|p| f64::from(p[1]) * PI / 0.5).collect()
}

/// T36: a regular grid and an edge parallel to it: errors spread evenly over ±1/2n, so that their root mean
/// square is 1/(n √12).
#[test]
fn t36_f33_a_grid_shows_bands_along_a_parallel_edge() {
    for n in [4_u32, 16] {
        let positions = 64;
        let squares = (0..positions).map(|i| {
            let offset = (f64::from(i) + 0.5) / f64::from(positions) - 0.5;
            let shares = found_shares(&sampled(half_plane(0.0, offset), "grid", n), 1);
            assert!(shares.iter().all(|s| (s - shares[0]).abs() < 1e-4), "bands: all pixels agree");
            (shares[0] - (0.5 - offset)).powi(2)
        });
        let rms = (squares.sum::<f64>() / f64::from(positions)).sqrt();
        let known = 1.0 / (f64::from(n) * 12.0_f64.sqrt());
        assert!((rms / known - 1.0).abs() < 0.1, "{n}: {rms}, expected {known}");
    }
}

/// T35: jittered strata and edges at any angle: root mean square 0.41 n^(-3/2). A pixel is the mean of two
/// independent halves.
#[test]
fn t35_jittered_strata_have_the_known_noise() {
    for (n, known) in [(4, 0.051), (8, 0.0181)] {
        let (mut sum, mut count) = (0.0, 0.0);
        for angle in [3.0, 14.0, 27.0, 39.0, 52.0, 61.0, 74.0, 88.0] {
            for offset in [-0.23, -0.08, 0.04, 0.19] {
                let truth = visible_share(angle, offset);
                let shares = found_shares(&sampled(half_plane(angle, offset), "jittered", n), 1);
                sum += shares.iter().map(|s| 2.0 * (s - truth).powi(2)).sum::<f64>();
                count += shares.len() as f64;
            }
        }
        let rms = f64::sqrt(sum / count);
        assert!((rms / known - 1.0).abs() < 0.1, "{n}: {rms}, expected {known}");
    }
}

/// F34: a disc of 0.45 of the light's width hides none of its corners: undivided, the adaptive rule misses it (1
/// for the true 0.364). With the default 4 × 4 squares to begin with it does not.
#[test]
fn f34_the_adaptive_rule_needs_squares_to_begin_with() {
    let corner = |k: u32| {
        let (sin, cos) = (f64::from(k) / 64.0 * 2.0 * PI).sin_cos();
        json!([0.225 * cos, 100, 0.225 * sin])
    };
    let disc = json!({ "type": "polygon", "material": "floor", "vertices": (0..64).map(corner).collect::<Vec<_>>() });
    let mut value = half_plane(0.0, 0.0);
    value["objects"] = json!([floor(4.0, 0.0), disc]);
    let found =
        |rule: &str, n: u32| mean(&render(&sampled(value.clone(), rule, n), 1, 4, 8).image()) * PI / 0.5;
    assert!((found("adaptive", 1) - 1.0).abs() < 1e-3, "{}", found("adaptive", 1));
    let truth = 1.0 - PI * 0.45 * 0.45;
    for (rule, tolerance) in [("adaptive", 0.02), ("jittered", 0.01), ("sobol", 0.01)] {
        let share = found(rule, 4);
        assert!((share - truth).abs() < tolerance, "{rule}: {share}, expected {truth}");
    }
}
