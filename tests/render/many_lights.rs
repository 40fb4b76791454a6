//! More lights than can each be asked.

use crate::support::{SEEDS, T_LIMIT, camera_above, compile, floor, over_seeds, render, scene};
use nephroid::light_path::PathClass;
use nephroid::plan::Plan;
use nephroid::render::{Control, Render};
use serde_json::{Value, json};
use std::sync::Arc;

/// So many small lights of three kinds, strewn over the floor by the golden angle; every seventh faces away.
fn lamps(count: u32) -> Vec<Value> {
    let lamp = |i: u32| {
        let (turn, out) = (2.399_963_2 * f64::from(i), 3.0 * (f64::from(i) / f64::from(count)).sqrt());
        let at = [out * turn.cos(), 0.5 + 0.1 * f64::from(i % 5), out * turn.sin()];
        // However many there are, together they are as large.
        let size = (60.0 / f64::from(count)).sqrt();
        let toward = [at[0] + 0.3, if i.is_multiple_of(7) { 9.0 } else { 0.0 }, at[2]];
        match i % 3 {
            0 => {
                json!({ "type": "quad", "center": at, "size": [0.1 * size, 0.1 * size], "towards": toward, "radiance": [60, 60, 60] })
            }
            1 => json!({ "type": "point", "position": at, "intensity": ([0.1 * size * size; 3]) }),
            _ => {
                json!({ "type": "sphere", "center": at, "radius": 0.03 * size, "radiance": [30, 30, 30] })
            }
        }
    };
    (0..count).map(lamp).collect()
}

fn hall(count: u32, floor_material: Value) -> Value {
    let objects = json!([
        floor(4.0, 0.0),
        { "type": "sphere", "material": "glass", "center": [0.5, 0.2, 0.3], "radius": 0.2 },
        { "type": "box", "material": "floor", "center": [-0.5, 0.1, 0], "size": [0.2, 0.2, 0.4] }]);
    let mut value = scene(camera_above([0.0; 3], 3.0, 2.0), objects, json!(lamps(count)));
    value["materials"]["floor"] = floor_material;
    value
}

/// Picked lights, in place of all, give the same light on every block of the picture; also where lights are met by
/// scattered rays, which must know how often a light is asked.
#[test]
fn a_few_picked_lights_give_the_light_of_all() {
    let shiny = json!({ "type": "phong", "k_d": [0.3, 0.3, 0.3], "k_s": [0.4, 0.4, 0.4], "n": 20, "highlight": "conserving" });
    for material in [json!({ "type": "diffuse", "albedo": [0.5, 0.5, 0.5] }), shiny] {
        let mut value = hall(60, material);
        value["render"]["paths"] = json!("LDS*E");
        let plan = Plan::new(&compile(&value));
        assert!(plan.light_tree.is_some());
        let blocks = |all: bool| {
            let mut plan = plan.clone();
            plan.light_tree = plan.light_tree.filter(|_| !all);
            let images: Vec<_> = (0..SEEDS)
                .map(|seed| {
                    let mut scene = compile(&value);
                    scene.render.seed = seed + if all { SEEDS } else { 0 };
                    let mut render = Render::new(Arc::new(scene), plan.clone());
                    (0..8).for_each(|_| _ = render.run_round(&Control::new()).unwrap());
                    render.image()
                })
                .collect();
            move |block: usize| {
                let inside = move |i: &usize| i / 64 == block / 4 && i % 16 / 4 == block % 4;
                over_seeds(|seed| {
                    let image = &images[seed as usize - 1];
                    (0..256).filter(inside).map(|i| f64::from(image.pixels[i][1])).sum()
                })
            }
        };
        let (some, all) = (blocks(false), blocks(true));
        for block in 0..16 {
            let (a, b) = (some(block), all(block));
            let error = a.standard_error.hypot(b.standard_error);
            assert!(T_LIMIT * error < 0.15 * b.mean, "too noisy to tell: {a:?} {b:?}");
            assert!((a.mean - b.mean).abs() <= T_LIMIT * error, "block {block}: {a:?} {b:?}");
        }
    }
}

/// Each of dozens of lamps split into fifty at the same place: thousands of lights that give the same light, and cost no more
/// shadow rays and hardly more photons.
#[test]
fn thousands_of_lights_cost_what_dozens_do() {
    let lamp = |i: u32, parts: u32| {
        let (turn, out) = (2.4 * f64::from(i), 0.2 * f64::from(i).sqrt());
        json!({ "type": "point", "position": [out * turn.cos(), 0.6 + 0.1 * f64::from(i % 5), out * turn.sin()],
                "intensity": ([1.0 / f64::from(parts); 3]) })
    };
    let [dozens, thousands] = [1, 50].map(|parts| {
        let mut value = hall(1, json!({ "type": "diffuse", "albedo": [0.5, 0.5, 0.5] }));
        value["lights"] = (0..60 * parts).map(|i| lamp(i % 60, parts)).collect();
        let plan = Plan::new(&compile(&value));
        (0..SEEDS)
            .map(|seed| {
                let mut scene = compile(&value);
                scene.render.seed = seed;
                let mut render = Render::new(Arc::new(scene), plan.clone());
                (0..4).for_each(|_| _ = render.run_round(&Control::new()).unwrap());
                render
            })
            .collect::<Vec<_>>()
    });
    let photons = |r: &Render| r.plan().photons.iter().map(|b| 1_u64 << b.log2_block).sum::<u64>();
    // Each window sends at least four photons.
    assert!(photons(&thousands[0]) <= photons(&dozens[0]).max(4 * 3000), "{}", photons(&thousands[0]));
    let per_ray = |r: &Render| r.stats().eye.shadow_rays as f64 / r.stats().eye.eye_rays as f64;
    assert!(per_ray(&thousands[0]) < 1.05 * per_ray(&dozens[0]), "{}", per_ray(&thousands[0]));
    for class in [PathClass::Direct, PathClass::Caustic] {
        let sum = |renders: &[Render]| {
            over_seeds(|seed| {
                renders[seed as usize - 1].layer(class).pixels.iter().map(|p| f64::from(p[1])).sum()
            })
        };
        let (a, b) = (sum(&dozens), sum(&thousands));
        let error = a.standard_error.hypot(b.standard_error);
        assert!(T_LIMIT * error < 0.1 * b.mean, "too noisy to tell: {class:?} {a:?} {b:?}");
        assert!((a.mean - b.mean).abs() <= T_LIMIT * error, "{class:?}: {a:?} {b:?}");
    }
}

/// One light is asked as ever, and so are a few.
#[test]
fn a_few_lights_are_each_asked() {
    let material = json!({ "type": "diffuse", "albedo": [0.5, 0.5, 0.5] });
    for (count, tree) in [(1, false), (16, false), (17, true)] {
        assert_eq!(Plan::new(&compile(&hall(count, material.clone()))).light_tree.is_some(), tree);
    }
}

/// T44: from a face of the unit cube to the opposite one and to a neighbour, .199825 and .200044 of what it sends out. The
/// floor is lit evenly by parallel light that does not reach the other face; that face shows it by `LDDE` alone. It is seen
/// whole by a camera in the middle of the cube, so that all of its parts count alike.
#[test]
fn t44_a_face_of_the_cube_lights_the_others_by_its_form_factors() {
    let face = |vertices: Value| json!({ "type": "polygon", "material": "floor", "vertices": vertices });
    let base = face(json!([[0, 0, 1], [1, 0, 1], [1, 0, 0], [0, 0, 0]]));
    let cases = [
        // Slanting light passes below the upper face, whose shadow falls beside the base.
        (
            json!([[0, 1, 0], [1, 1, 0], [1, 1, 1], [0, 1, 1]]),
            [0.5, 1.0, 0.5],
            [3_f64.sqrt(), -1.0, 0.0],
            0.5,
            0.199_825,
        ),
        // A wall is not lit by light along it.
        (
            json!([[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]]),
            [0.0, 0.5, 0.5],
            [0.0, -1.0, 0.0],
            1.0,
            0.200_044,
        ),
    ];
    for (vertices, target, direction, cosine, form_factor) in cases {
        let up = if target[1] == 1.0 { [0, 0, 1] } else { [0, 1, 0] };
        let camera =
            json!({ "type": "perspective", "eye": [0.5, 0.5, 0.5], "target": target, "up": up, "fov": 90 });
        let sun = json!([{ "type": "directional", "direction": direction, "irradiance": [1, 1, 1] }]);
        let mut value = scene(camera, json!([base, face(vertices)]), sun);
        value["render"]["paths"] = json!("LDDE");
        let expected = 0.5 * cosine * form_factor * 0.5 / std::f64::consts::PI;
        let mean = |seed| {
            let image = render(&value, seed, 16, 8).image();
            image.pixels.iter().map(|p| f64::from(p[1])).sum::<f64>() / image.pixels.len() as f64
        };
        // The renderer works in f32.
        over_seeds(mean).assert_is(expected, 1e-4);
    }
}
