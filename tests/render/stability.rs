//! Scenes in which methods of this kind break: every picture is finite, ends, and is not silently wrong.

use crate::support::{camera_above, compile, floor, mean, mean_irradiance, over_seeds, render, scene};
use nephroid::lab::stability::{Effort, Outcome, Truth, cases, csv, json as table, page, run_case};
use nephroid::light_path::PathClass;
use nephroid::pass1_light::{Block, trace_block, windows};
use nephroid::plan::Plan;
use nephroid::render::Control;
use nephroid::scene::Paths;
use serde_json::{Value, json};

fn lamp(position: [f64; 3]) -> Value {
    json!([{ "type": "point", "position": position, "intensity": [1, 1, 1] }])
}

/// A square mirror of side 4 at x, that faces the other way.
fn wall(x: f64, material: &str) -> Value {
    let (a, b) = if x > 0.0 { (-2.0, 2.0) } else { (2.0, -2.0) };
    json!({ "type": "polygon", "material": material, "vertices": [[x, 0, a], [x, 0, b], [x, 4, b], [x, 4, a]] })
}

/// F21: a light in the middle of a glass ball: shadow rays are always blocked, and photons bring all of it. Every way
/// runs along a radius; what is reflected inside comes out after some turns, so that the floor is lit as by the light
/// alone, E = I / h² below it.
#[test]
fn f21_a_light_in_a_glass_ball_lights_by_photons_alone() {
    let ball = json!({ "type": "sphere", "material": "glass", "center": [0, 1, 0], "radius": 0.25 });
    let value =
        scene(camera_above([0.0; 3], -2.0, 0.1), json!([floor(2.0, 0.0), ball]), lamp([0.0, 1.0, 0.0]));
    // Seen from above beside the ball's shadow of itself: from far enough that the ball is not in the way.
    let mut value = value;
    value["camera"] = json!({ "type": "perspective", "eye": [2, 0.4, 0], "target": [0.5, 0, 0], "up": [0, 1, 0], "fov": 4 });
    over_seeds(|seed| mean(&render(&value, seed, 2, 16).layer(PathClass::Direct)) + 1.0).assert_is(1.0, 0.0);
    let at = |x: f64| 1.0 / (1.0 + x * x).powf(1.5);
    // The picture shows the floor between x = 0.36 and 0.68, nearly: the mean of E over the view's own plane.
    let bare = {
        let mut bare = scene(json!({}), json!([floor(2.0, 0.0)]), lamp([0.0, 1.0, 0.0]));
        bare["camera"] = value["camera"].clone();
        mean_irradiance(&render(&bare, 1, 16, 8), PathClass::Direct)
    };
    assert!(bare > at(0.75) && bare < at(0.3), "{bare}");
    over_seeds(|seed| mean_irradiance(&render(&value, seed, 2, 16), PathClass::Caustic))
        .assert_is(bare, 5e-3);
}

/// F25: between two facing mirrors that reflect everything, and in a glass cube that holds light by total reflection,
/// photons and eye rays end, and what is cut is counted.
#[test]
fn f25_light_between_perfect_mirrors_ends_and_is_counted() {
    let mut value = scene(
        json!({ "type": "perspective", "eye": [0, 1, 0], "target": [1, 1.01, 0.02], "fov": 60 }),
        json!([wall(-1.0, "perfect"), wall(1.0, "perfect"), floor(1.0, 0.0)]),
        lamp([0.2, 1.0, 0.1]),
    );
    value["materials"]["perfect"] = json!({ "type": "mirror", "reflectance": [1, 1, 1] });
    let render = render(&value, 1, 2, 10);
    let stats = render.stats();
    assert!(stats.eye.cut > 0, "the eye's rays between the mirrors end by their number");
    assert!(render.image().pixels.iter().flatten().all(|x| x.is_finite()));
    let energy = stats.windows.iter().fold(glam::DVec3::ZERO, |sum, tally| sum + tally.energy.imbalance());
    let emitted = stats.windows.iter().map(|tally| tally.energy.emitted.y).sum::<f64>();
    assert!(energy.abs().max_element() < 1e-9 * emitted, "{energy} of {emitted}");

    let cube = json!({ "type": "box", "material": "glass", "center": [0, 1, 0], "size": [1, 1, 1] });
    let trap =
        scene(camera_above([0.0; 3], 4.0, 1.0), json!([cube, floor(2.0, 0.0)]), lamp([0.1, 1.05, 0.2]));
    let scene = compile(&trap);
    let block = Block { first: 0, count: 1 << 12, seed: 1 };
    let (_, tally) = trace_block(&scene, &windows(&scene)[0], block, &Control::new()).unwrap();
    assert!(tally.cut > 0 && tally.energy.cut.y > 0.0);
    assert!(tally.energy.imbalance().abs().max_element() < 1e-9 * tally.energy.emitted.y);
    // A photon that can leave does so by one of four Fresnel events on average; only what cannot goes on to the end.
    assert!(tally.rays < 256 * u64::from(block.count));
}

/// F26: behind 20 glass balls in a row there are 2^40 ways; a sample follows those that still add something.
#[test]
fn f26_a_row_of_glass_balls_costs_rays_in_proportion_to_what_they_add() {
    let mut objects: Vec<Value> = (0..20)
        .map(|i| json!({ "type": "sphere", "material": "glass", "center": [0, 1, -f64::from(i)], "radius": 0.4 }))
        .collect();
    objects.push(floor(30.0, 0.0));
    let camera = json!({ "type": "perspective", "eye": [0, 1, 3], "target": [0, 1, 0], "fov": 12 });
    let stats = render(&scene(camera, json!(objects), lamp([3.0, 5.0, 0.0])), 1, 2, 8).stats();
    let samples = 2 * 2 * 16 * 16;
    assert!(stats.eye.eye_rays / samples < 200, "{} rays for {samples} samples", stats.eye.eye_rays);
}

/// F27, F28: a light in the plane of the floor, below it, and exactly at the point that is looked at: nothing that is not
/// finite, and no light from where none comes.
#[test]
fn f27_f28_lights_on_and_behind_a_surface_give_finite_light() {
    for position in [[0.3, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, -1.0, 0.0]] {
        let value = scene(camera_above([0.0; 3], 2.0, 1.0), json!([floor(2.0, 0.0)]), lamp(position));
        let image = render(&value, 1, 4, 8).image();
        assert!(image.pixels.iter().flatten().all(|x| *x == 0.0), "{position:?}");
    }
    let near = scene(camera_above([0.0; 3], 2.0, 1.0), json!([floor(2.0, 0.0)]), lamp([0.0, 1e-6, 0.0]));
    assert!(render(&near, 1, 4, 8).image().pixels.iter().flatten().all(|x| x.is_finite()));
}

/// F35: the noise of neighbouring pixels is not alike: over a floor under an area light the correlation of what
/// neighbours are off by is zero within its own noise, 1/sqrt(pairs), at 5 sigma.
#[test]
fn f35_neighbouring_pixels_have_noise_of_their_own() {
    let light = json!([{ "type": "quad", "center": [0, 1, 0], "size": [1, 1], "towards": [0, 0, 0],
                         "radiance": [1, 1, 1] }]);
    let edge = json!({ "type": "polygon", "material": "floor", "vertices": [[-9, 0.5, 9], [0, 0.5, 9], [0, 0.5, -9], [-9, 0.5, -9]] });
    let mut value = scene(camera_above([0.0; 3], 0.45, 0.1), json!([floor(2.0, 0.0), edge]), light);
    value["image"] = json!({ "width": 64, "height": 64 });
    let pictures: Vec<Vec<f64>> = (1..=8)
        .map(|seed| render(&value, seed, 1, 8).image().pixels.iter().map(|p| f64::from(p[1])).collect())
        .collect();
    let mean: Vec<f64> = (0..64 * 64).map(|i| pictures.iter().map(|p| p[i]).sum::<f64>() / 8.0).collect();
    for step in [1, 64, 65] {
        let (mut together, mut alone, mut pairs) = (0.0, 0.0, 0.0);
        for picture in &pictures {
            for i in (0..64 * 63).filter(|i| i % 64 < 63) {
                let (a, b) = (picture[i] - mean[i], picture[i + step] - mean[i + step]);
                together += a * b;
                alone += 0.5 * (a * a + b * b);
                pairs += 1.0;
            }
        }
        let correlation = together / alone;
        assert!(alone > 0.0 && correlation.abs() < 5.0 / f64::sqrt(pairs), "{step}: {correlation}");
    }
}

/// F58: in a closed box of albedo 1 no light is lost: paths end all the same.
#[test]
fn f58_a_closed_box_that_loses_no_light_ends() {
    let mut value = scene(
        json!({ "type": "perspective", "eye": [0, 1, 0.5], "target": [0, 1, -1], "fov": 60 }),
        json!([{ "type": "box", "material": "white", "center": [0, 1, 0], "size": [2, 2, 2] }]),
        lamp([0.0, 1.5, 0.0]),
    );
    value["materials"]["white"] = json!({ "type": "diffuse", "albedo": [1, 1, 1] });
    value["render"]["paths"] = json!("complete");
    let render = render(&value, 1, 2, 8);
    assert!(render.image().pixels.iter().flatten().all(|x| x.is_finite()));
    assert!(render.stats().eye.eye_rays < 2 * 2 * 256 * 64);
}

/// F62: a light seen in a mirror, `LSE`, is the eye's alone: photons never bring it.
#[test]
fn f62_a_light_in_a_mirror_is_seen_by_the_eye_alone() {
    let mirror = json!({ "type": "polygon", "material": "mirror", "vertices": [[-2, 0, 2], [2, 0, 2], [2, 0, -2], [-2, 0, -2]] });
    let light = json!([{ "type": "quad", "center": [0, 3, 0], "size": [4, 4], "towards": [0, 0, 0], "radiance": [1, 1, 1] }]);
    let render = render(&scene(camera_above([0.0; 3], 2.0, 0.1), json!([mirror]), light), 1, 2, 10);
    assert!((mean(&render.layer(PathClass::Emitted)) - 0.9).abs() < 1e-5);
    assert_eq!(mean(&render.layer(PathClass::Caustic)), 0.0);
}

/// F63: without pass 1 a glass ball casts a black shadow; the plan says so.
#[test]
fn f63_leaving_out_caustics_is_said() {
    let ball = json!({ "type": "sphere", "material": "glass", "center": [0, 1, 0], "radius": 0.5 });
    let mut scene = compile(&scene(
        camera_above([0.0; 3], 2.0, 1.0),
        json!([floor(2.0, 0.0), ball]),
        lamp([0.0, 3.0, 0.0]),
    ));
    let warned = |scene: &_| Plan::new(scene).warnings.iter().any(|w| w.code == "caustics_left_out");
    assert!(!warned(&scene));
    scene.render.paths = Paths::Whitted;
    assert!(warned(&scene));
}

/// Runs the cases of the stability table from one number to another: each is finite, ends, and is right, or is said or known
/// to be wrong.
fn no_case_is_at_fault(numbers: std::ops::RangeInclusive<u32>) {
    let rows: Vec<_> = cases()
        .iter()
        .filter(|case| numbers.contains(&case.number()))
        .map(|case| run_case(case, Effort { seeds: 3, rounds: 4 }))
        .collect();
    assert!(!rows.is_empty() && rows.iter().all(|row| !row.cells.is_empty()));
    let faults: Vec<String> = rows
        .iter()
        .flat_map(|row| row.cells.iter().map(move |cell| (row.case.rows, row.case.title, cell)))
        .filter(|(.., cell)| cell.outcome.is_fault())
        .map(|(number, title, cell)| {
            format!(
                "{number} {title}, {}: {:?}, {:?} ± {:?}",
                cell.method, cell.outcome, cell.error, cell.noise
            )
        })
        .collect();
    assert!(faults.is_empty(), "{faults:#?}");
    // What is known of a case, the default method meets.
    for row in &rows {
        let first = &row.cells[0].outcome;
        let known = matches!(row.case.truth, Truth::Mean { .. } | Truth::Probe(_));
        assert!(!known || *first == Outcome::Right, "{} {}: {first:?}", row.case.rows, row.case.title);
    }
    let cells: usize = rows.iter().map(|row| row.cells.len()).sum();
    assert_eq!(csv(&rows).lines().count(), 1 + cells);
    assert_eq!(table(&rows)["cases"].as_array().unwrap().len(), rows.len());
    let html = page(&rows).unwrap();
    assert!(html.matches("<strong>").count() == cells && !html.contains("src=\"http"));
}

#[test]
fn f1_to_f14_in_the_table_are_not_at_fault() {
    no_case_is_at_fault(1..=14);
}

#[test]
fn f15_to_f26_in_the_table_are_not_at_fault() {
    no_case_is_at_fault(15..=26);
}

#[test]
fn f27_to_f43_in_the_table_are_not_at_fault() {
    no_case_is_at_fault(27..=43);
}

#[test]
fn f44_to_f60_in_the_table_are_not_at_fault() {
    no_case_is_at_fault(44..=60);
}

#[test]
fn f61_to_f76_in_the_table_are_not_at_fault() {
    no_case_is_at_fault(61..=76);
}

/// F1 to F76, all that concerns the renderer, has its case.
#[test]
fn every_failure_has_a_case_in_the_table() {
    let all: Vec<String> = cases().iter().flat_map(|case| case.rows.split(", ")).map(str::to_owned).collect();
    for number in 1..=76 {
        assert!(all.contains(&format!("F{number}")), "F{number}");
    }
}

/// The table finds what is wrong: a truth that is not, a warning that is not given, a scene that is not refused.
#[test]
fn the_table_finds_faults() {
    let effort = Effort { seeds: 2, rounds: 2 };
    let lit = cases().into_iter().find(|case| case.rows == "F53").unwrap();
    let outcome = |case| run_case(&case, effort).cells[0].outcome.clone();
    assert_eq!(outcome(lit.clone()), Outcome::Right);
    let Truth::Mean { class, value } = lit.truth.clone() else { panic!("{:?}", lit.truth) };
    let mut wrong = lit.clone();
    wrong.truth = Truth::Mean { class, value: 1.1 * value };
    assert_eq!(outcome(wrong.clone()), Outcome::Wrong);
    wrong.limits.push(("default", "a reason"));
    assert_eq!(outcome(wrong), Outcome::Known("a reason"));
    let mut silent = lit.clone();
    silent.warns = &["no_light"];
    assert!(matches!(outcome(silent), Outcome::Unwarned(_)));
    let mut accepted = lit;
    accepted.truth = Truth::Refused(nephroid::scene::IssueCode::OutOfRange, "/camera");
    assert!(matches!(outcome(accepted), Outcome::NotRefused(_)));
}
