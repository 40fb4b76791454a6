//! What must not change a picture: its scale, its place, the names of the axes; and closed rooms whose light is known.

use crate::support::{SEEDS, compile, floor, mean, mean_over_square, over_seeds, render, scene};
use glam::{DQuat, DVec3};
use nephroid::develop::develop;
use nephroid::light_path::PathClass;
use nephroid::plan::Plan;
use nephroid::render::{Control, Render};
use serde_json::{Value, json};
use std::sync::Arc;

/// A glass ball over a floor under a square light, with every length multiplied by `scale` and every point moved.
fn ball(scale: f64, place: impl Fn(DVec3) -> DVec3) -> Value {
    let at = |x: f64, y: f64, z: f64| place(DVec3::new(x, y, z) * scale).to_array();
    let up = (place(DVec3::Y * scale) - place(DVec3::ZERO)).to_array();
    json!({ "nephroid": 1, "image": { "width": 32, "height": 24, "exposure": 1 },
        "camera": { "type": "perspective", "eye": at(0.0, 2.4, 4.2), "target": at(-0.3, 0.2, 0.0), "up": up, "fov": 36 },
        "materials": { "floor": { "type": "diffuse", "albedo": [0.7, 0.6, 0.5] },
                       "glass": { "type": "glass", "ior": 1.5 } },
        "objects": [
            { "type": "polygon", "material": "floor",
              "vertices": [at(-3.0, 0.0, 3.0), at(3.0, 0.0, 3.0), at(3.0, 0.0, -3.0), at(-3.0, 0.0, -3.0)] },
            { "type": "sphere", "material": "glass", "center": at(0.0, 0.55, 0.0), "radius": 0.5 * scale } ],
        // Radiance does not change with the scale.
        "lights": [{ "type": "quad", "center": at(1.2, 3.0, 0.6), "size": [0.5 * scale, 0.5 * scale],
                     "edge": (place(DVec3::X * scale) - place(DVec3::ZERO)).to_array(),
                     "towards": at(0.0, 0.55, 0.0), "radiance": [20, 20, 20] }],
        "render": { "stop": { "rounds": 4 } } })
}

/// T45: all lengths times 1/1024 and 1024 give the same PNG: powers of two, so that the rounding is the same too; and
/// times 1e-3 and 1e3, where at most one pixel in a hundred (an edge, a photon at a border) may differ by more than a
/// code.
#[test]
fn t45_the_same_scene_at_another_scale_is_the_same_picture() {
    let shown = |scale: f64| {
        let value = ball(scale, |p| p);
        let render = render(&value, 3, 4, 10);
        develop(&render.image(), &render.scene().image)
    };
    let here = shown(1.0);
    for scale in [1.0 / 1024.0, 1024.0, 1e-3, 1e3] {
        let there = shown(scale);
        let apart = here.iter().zip(&there).filter(|(a, b)| a.abs_diff(**b) > 1).count();
        assert!(apart * 100 <= here.len(), "{scale}: {apart} of {} codes", here.len());
    }
}

/// T46: turned and moved, or with its axes renamed, a scene is the same picture within its noise: the mean of each class
/// over seeds agrees.
#[test]
fn t46_a_scene_that_is_turned_and_moved_is_the_same_picture() {
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -1.0).normalize(), 1.1);
    let places: [&dyn Fn(DVec3) -> DVec3; 3] =
        [&|p| p, &|p| turn * p + DVec3::new(5.0, -3.0, 2.0), &|p| DVec3::new(p.y, p.z, p.x)];
    let found = places.map(|place| {
        let value = ball(1.0, place);
        [PathClass::Direct, PathClass::Caustic]
            .map(|class| over_seeds(|seed| mean(&render(&value, seed, 8, 12).layer(class))))
    });
    for other in &found[1..] {
        for (a, b) in found[0].iter().zip(other) {
            let error = a.standard_error.hypot(b.standard_error);
            // 5 standard errors of four comparisons, whose own errors are known from 16 values; and rounding.
            assert!((a.mean - b.mean).abs() < 6.0 * error + 1e-5 * a.mean, "{a:?} {b:?}");
            assert!(error < 0.08 * a.mean, "too noisy to tell: {a:?} {b:?}");
        }
    }
}

/// T47: the Cornell box's light (130 × 105 at y = 548.8) over its empty floor: Lambert's formula in each of 16 × 16 pixels
/// that show all of it.
#[test]
fn t47_the_cornell_boxs_light_gives_its_floor_lamberts_irradiance() {
    let (x, y, z) = (278.0, 548.8, 279.5);
    let (hx, hz) = (65.0, 52.5);
    let corners = [[x - hx, y, z - hz], [x + hx, y, z - hz], [x + hx, y, z + hz], [x - hx, y, z + hz]];
    let light = json!([{ "type": "quad", "center": [x, y, z], "size": [130, 105], "edge": [1, 0, 0],
                         "towards": [x, 0, z], "radiance": [1, 1, 1] }]);
    let ground = json!({ "type": "polygon", "material": "floor",
                         "vertices": [[0, 0, 559.2], [549.6, 0, 559.2], [549.6, 0, 0], [0, 0, 0]] });
    let side = 549.6;
    let camera = json!({ "type": "orthographic", "eye": [0.5 * side, 500, 0.5 * side], "target": [0.5 * side, 0, 0.5 * side],
                         "up": [0, 0, -1], "height": side });
    let value = scene(camera, json!([ground]), light);
    let pictures: Vec<Vec<f64>> = (1..=SEEDS)
        .map(|seed| {
            let picture = render(&value, seed, 4, 8).layer(PathClass::Direct);
            picture.pixels.iter().map(|p| f64::from(p[1]) / 0.5).collect()
        })
        .collect();
    let lambert = |px: f64, pz: f64| {
        let rays: Vec<DVec3> =
            corners.iter().map(|c| (DVec3::from(*c) - DVec3::new(px, 0.0, pz)).normalize()).collect();
        let edge = |i: usize| {
            let (a, b) = (rays[i], rays[(i + 1) % 4]);
            a.dot(b).acos() * a.cross(b).normalize().y
        };
        0.5 * (0..4).map(edge).sum::<f64>().abs() / std::f64::consts::PI
    };
    let pixel = side / 16.0;
    for i in 0..256 {
        let mut values = pictures.iter().map(|picture| picture[i]);
        let found = over_seeds(|_| values.next().unwrap());
        let (column, row) = ((i % 16) as f64, (i / 16) as f64);
        // The picture's up is -z: its first row is the floor's far end.
        let known = mean_over_square((column + 0.5) * pixel, (row + 0.5) * pixel, pixel, lambert);
        found.assert_is(known, 1e-4);
    }
}

/// A ball of diffuse albedo `albedo` around a point light and the eye, all paths.
fn hollow_ball(albedo: f64) -> Value {
    let mut value = scene(
        json!({ "type": "perspective", "eye": [0.3, 0.1, 0.2], "target": [1, 0, 0], "fov": 60 }),
        json!([{ "type": "sphere", "material": "wall", "center": [0, 0, 0], "radius": 1 }]),
        json!([{ "type": "point", "position": [0, 0, 0], "intensity": [std::f64::consts::PI, 1, 1] }]),
    );
    value["materials"]["wall"] = json!({ "type": "diffuse", "albedo": [albedo, albedo, albedo] });
    value["render"]["paths"] = json!("complete");
    value
}

/// T34: inside a diffuse ball of albedo ρ with a light of intensity π in the middle, each bounce sends the same light
/// everywhere again: direct light ρ, all light ρ / (1 - ρ).
#[test]
fn t34_a_closed_room_has_the_light_of_all_bounces() {
    for albedo in [0.5, 0.8] {
        let value = hollow_ball(albedo);
        let red = |class: Option<PathClass>, seed: u64| {
            let render = render(&value, seed, 16, 8);
            let image = class.map_or_else(|| render.image(), |class| render.layer(class));
            image.pixels.iter().map(|p| f64::from(p[0])).sum::<f64>() / image.pixels.len() as f64
        };
        over_seeds(|seed| red(Some(PathClass::Direct), seed)).assert_is(albedo, 1e-4);
        over_seeds(|seed| red(Some(PathClass::Indirect), seed))
            .assert_is(albedo * albedo / (1.0 - albedo), 1e-4);
        over_seeds(|seed| red(None, seed)).assert_is(albedo / (1.0 - albedo), 1e-4);
    }
}

/// What of its surroundings' light each kind of surface shows in a furnace: a ball in light that is the same from
/// everywhere. White surfaces vanish in it, up to what facets throw on each other.
#[test]
fn a_white_ball_vanishes_in_a_furnace() {
    for (material, least) in [
        (json!({ "type": "diffuse", "albedo": [1, 1, 1] }), 0.995),
        (json!({ "type": "mirror", "reflectance": [1, 1, 1] }), 0.999),
        (json!({ "type": "glass", "ior": 1.5 }), 0.99),
        (json!({ "type": "glass", "ior": 1.5, "abbe": 30 }), 0.99),
        (json!({ "type": "glass", "ior": 1.5, "roughness": 0.2 }), 0.93),
        (json!({ "type": "glass", "ior": 1.5, "roughness": 0.2, "abbe": 30 }), 0.93),
        (json!({ "type": "metal", "f0": [1, 1, 1], "roughness": 0.2 }), 0.98),
        (json!({ "type": "mix", "first": "white", "second": "shiny", "amount": 0.4 }), 0.99),
    ] {
        let ball = json!([{ "type": "sphere", "material": "ball", "center": [0, 0, 0], "radius": 1 }]);
        let camera = json!({ "type": "perspective", "eye": [0, 0, 4], "target": [0, 0, 0], "fov": 20 });
        let mut value = scene(camera, ball, json!([]));
        value["materials"]["white"] = json!({ "type": "diffuse", "albedo": [1, 1, 1] });
        value["materials"]["shiny"] = json!({ "type": "metal", "f0": [1, 1, 1] });
        value["materials"]["ball"] = material.clone();
        value["environment"] = json!({ "radiance": [1, 1, 1] });
        value["render"]["paths"] = json!("complete");
        let shown = over_seeds(|seed| mean(&render(&value, seed, 16, 8).image()));
        assert!(shown.standard_error < 0.01, "{material}: {shown:?}");
        let slack = 5.0 * shown.standard_error;
        assert!(shown.mean < 1.0 + slack + 1e-3 && shown.mean > least - slack, "{material}: {shown:?}");
    }
}

/// A render with the plan's own number of photons.
fn planned(value: &Value, rounds: u32) -> Render {
    let scene = Arc::new(compile(value));
    let plan = Plan::new(&scene);
    let mut render = Render::new(scene, plan);
    for _ in 0..rounds {
        render.run_round(&Control::new()).expect("a round");
    }
    render
}

/// F61: glass blocks shadow rays, and photons bring what it lets through: with an index of 1 the floor under a ball is
/// lit as if it were not there, once, not twice.
#[test]
fn f61_what_glass_lets_through_is_counted_once() {
    let sun = json!([{ "type": "directional", "direction": [0, -1, 0], "irradiance": [1, 1, 1] }]);
    let ball = json!({ "type": "sphere", "material": "air", "center": [0, 1, 0], "radius": 0.5 });
    let camera = json!({ "type": "perspective", "eye": [0, 2, 3], "target": [0, 0, 0], "fov": 10 });
    let value = scene(camera, json!([floor(2.0, 0.0), ball]), sun);
    let shown = mean(&planned(&value, 4).image()) * std::f64::consts::PI / 0.5;
    // Photons lie on pixels' areas as evenly as low discrepancy has them.
    assert!((shown - 1.0).abs() < 0.01, "{shown}");
}
