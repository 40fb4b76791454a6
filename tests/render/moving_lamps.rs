//! Lamps that move while the shutter is open: the mean over time of their light, drawn from the light and met by rays.

use crate::support::{camera_above, floor, mean, mean_irradiance, over_seeds, render, scene};
use nephroid::light_path::PathClass;
use serde_json::{Value, json};
use std::f64::consts::PI;

/// A lamp that moves while the shutter is open, above the origin of a floor.
fn lit_by_moving(lamp: &Value, material: &Value) -> Value {
    let mut lamp = lamp.clone();
    lamp["emission"] = json!([1, 1, 1]);
    lamp["material"] = json!("black");
    let mut camera = camera_above([0.0; 3], 0.5, 0.01);
    camera["shutter"] = json!([0, 1]);
    let mut value = scene(camera, json!([floor(2.0, 0.0), lamp]), json!([]));
    value["materials"]["black"] = json!({ "type": "diffuse", "albedo": [0, 0, 0] });
    value["materials"]["floor"] = material.clone();
    value
}

fn moving_lamps() -> [(Value, f64); 5] {
    let panel = json!([[-0.01, 1, -0.01], [0.01, 1, -0.01], [0.01, 1, 0.01], [-0.01, 1, 0.01]]);
    let sphere =
        |motion: Value| json!({ "type": "sphere", "center": [0, 20, 0], "radius": 0.2, "motion": motion });
    [
        // Of a sphere at height h, π R² h / (h² + x²)^(3/2), the mean over x from -a to a is π R² / (h sqrt(h² + a²)).
        (
            json!({ "type": "sphere", "center": [-1, 1, 0], "radius": 0.1, "velocity": [2, 0, 0] }),
            PI * 0.01 / 2.0_f64.sqrt(),
        ),
        // A small panel that is turned once shows its lit side half of the time, by the cosine: a mean of 1/π.
        (
            json!({ "type": "polygon", "vertices": panel, "motion": { "rotate": { "axis": [0, 0, 1], "angle": 360 } } }),
            4e-4 / PI,
        ),
        // A disk that grows to three times its width, and not along z: twice the area in the mean.
        (
            json!({ "type": "disk", "center": [0, 1, 0], "normal": [0, -1, 0], "radius": 0.01, "motion": { "scale": [3, 1, 1] } }),
            2.0 * PI * 1e-4,
        ),
        // A sphere that grows to twice its size, seen from afar: π R² / h² times the mean of s², and an ellipsoid.
        (sphere(json!({ "scale": 2 })), PI * 1e-4 * 7.0 / 3.0),
        (
            sphere(json!({ "scale": [2, 3, 1], "rotate": { "axis": [0, 1, 0], "angle": 70 } })),
            PI * 1e-4 * 1.5,
        ),
    ]
}

/// What moves can shine: a floor has the mean over time of its light.
#[test]
fn a_moving_lamp_gives_the_mean_of_its_light() {
    let dull = json!({ "type": "diffuse", "albedo": [0.5, 0.5, 0.5] });
    for (lamp, known) in moving_lamps() {
        let value = lit_by_moving(&lamp, &dull);
        // The lamps are small, and the one far away stands for parallel light: 1 % of R / h, squared.
        over_seeds(|seed| mean_irradiance(&render(&value, seed, 16, 8), PathClass::Direct))
            .assert_is(known, 1e-3);
    }
}

/// In a shining floor lamps are met by scattered rays too, which must know how likely the light's own samples were: the
/// mean over time is that of lamps at rest.
#[test]
fn a_moving_lamp_in_a_highlight_is_the_mean_of_lamps_at_rest() {
    const MOMENTS: u32 = 32;
    let shiny = json!({ "type": "phong", "k_s": [1, 1, 1], "n": 12, "highlight": "conserving" });
    let ball = |x: f64| json!({ "type": "sphere", "center": [x, 1, 0], "radius": 0.3 });
    // A square of side 0.8 that faces down, scaled along x and then turned about z.
    let panel = |scale: f64, degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let corner = |x: f64, z: f64| json!([scale * x * cos, 1.0 + scale * x * sin, z]);
        json!({ "type": "polygon", "vertices": [corner(-0.4, -0.4), corner(0.4, -0.4), corner(0.4, 0.4), corner(-0.4, 0.4)] })
    };
    let (mut rolls, mut turns) = (ball(-0.4), panel(1.0, 0.0));
    rolls["velocity"] = json!([0.8, 0, 0]);
    turns["motion"] = json!({ "scale": [2, 1, 1], "rotate": { "axis": [0, 0, 1], "angle": 100 } });
    let seen = |lamp: &Value, seed: u64, rounds: u32| {
        mean(&render(&lit_by_moving(lamp, &shiny), seed, rounds, 8).layer(PathClass::Direct))
    };
    let ball_at = |time: f64| ball(-0.4 + 0.8 * time);
    let panel_at = |time: f64| panel(1.0 + time, 100.0 * time);
    let lamps: [(Value, &dyn Fn(f64) -> Value); 2] = [(rolls, &ball_at), (turns, &panel_at)];
    for (moving, at) in lamps {
        let moments = (0..MOMENTS).map(|k| (f64::from(k) + 0.5) / f64::from(MOMENTS));
        let expected = moments.map(|time| seen(&at(time), 1, 16)).sum::<f64>() / f64::from(MOMENTS);
        // The midpoint rule, and the noise of the lamps at rest.
        over_seeds(|seed| seen(&moving, seed, 32)).assert_is(expected, 0.01);
    }
}
