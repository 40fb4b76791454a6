//! Caustics by other estimators: path tracing that meets the light, and photons connected to the eye, agree with the
//! photon map where all can converge.

use crate::support::{
    Estimate, SEEDS, T_LIMIT, camera_above, compile, floor, mean, over_seeds, render, scene,
};
use nephroid::light_path::PathClass;
use nephroid::pass1_light::{Block, Window, trace_block, windows};
use nephroid::plan::Plan;
use nephroid::render::Control;
use nephroid::scene::{Caustics, NoAssets, Scene};
use serde_json::{Value, json};

/// What an estimate costs.
#[derive(Clone, Copy)]
struct Cost {
    rounds: u32,
    /// Photons per window, half and round.
    log2_photons: u32,
}

const PHOTONS: Cost = Cost { rounds: 1, log2_photons: 15 };

fn paths(rounds: u32) -> Cost {
    Cost { rounds, log2_photons: 8 }
}

/// Mean of a class over the picture, as it is gathered: smoothing weighs pixels at borders unevenly.
fn estimate(estimator: &str, scene: &Value, class: PathClass, cost: Cost) -> Estimate {
    let mut value = scene.clone();
    value["render"]["caustics"] = json!(estimator);
    over_seeds(|seed| mean(&render(&value, seed, cost.rounds, cost.log2_photons).raw_layer(class)))
}

/// An estimator differs from the photon map by no more than the noise of both, which would show 5 %.
fn agrees(scene: &Value, estimator: &str, costs: [Cost; 2]) {
    let [a, b] = [("photons", costs[0]), (estimator, costs[1])]
        .map(|(name, cost)| estimate(name, scene, PathClass::Caustic, cost));
    let error = a.standard_error.hypot(b.standard_error);
    assert!(T_LIMIT * error < 0.05 * a.mean && a.mean > 0.0, "too noisy to tell: {a:?}, {estimator}: {b:?}");
    let z = (a.mean - b.mean) / error;
    assert!(z.abs() <= T_LIMIT, "{a:?}, {estimator}: {b:?}, z = {z}");
}

/// A quad light large enough for paths to meet it.
fn large_light(center: [f64; 3], side: f64) -> Value {
    json!({ "type": "quad", "center": center, "size": [side, side], "towards": [0, 0, 0], "radiance": [9, 7, 5] })
}

fn ball(center: [f64; 3], radius: f64, material: &str) -> Value {
    json!({ "type": "sphere", "material": material, "center": center, "radius": radius })
}

/// The floor beside a glass ball in the light of a large quad.
fn beside_a_ball() -> Value {
    let objects = json!([floor(3.0, 0.0), ball([0.0, 0.55, 0.0], 0.5, "glass")]);
    scene(camera_above([-0.8, 0.0, -0.2], 0.4, 0.5), objects, json!([large_light([1.2, 3.0, 0.6], 2.0)]))
}

/// The floor within a ring of metal.
fn in_a_ring() -> Value {
    let ring = json!({ "type": "cylinder", "material": "mirror", "from": [0, 0, 0], "to": [0, 0.3, 0], "radius": 1 });
    let lights = json!([large_light([3.0, 1.6, 0.0], 1.5)]);
    scene(camera_above([0.0; 3], 2.0, 1.2), json!([floor(3.0, 0.0), ring]), lights)
}

/// A floor between two casters, glass and a mirror, each in the light of a quad and of a sphere, and of the sky.
fn two_casters_in_two_lights() -> Value {
    let objects =
        json!([floor(3.0, 0.0), ball([-0.7, 0.5, 0.0], 0.4, "glass"), ball([0.7, 0.5, 0.0], 0.4, "mirror")]);
    let sphere = json!({ "type": "sphere", "center": [-1.5, 2.5, 1], "radius": 0.6, "radiance": [4, 6, 9] });
    let mut value =
        scene(camera_above([0.0; 3], 2.0, 0.6), objects, json!([large_light([1.5, 2.5, 0.5], 1.5), sphere]));
    value["environment"] = json!({ "radiance": [0.2, 0.3, 0.4] });
    value
}

#[test]
fn path_tracing_and_photons_agree_on_a_glass_ball() {
    agrees(&beside_a_ball(), "backward", [PHOTONS, paths(128)]);
}

#[test]
fn forward_tracing_and_photons_agree_on_a_glass_ball() {
    agrees(&beside_a_ball(), "forward", [PHOTONS, PHOTONS]);
}

#[test]
fn path_tracing_and_photons_agree_in_a_ring() {
    agrees(&in_a_ring(), "backward", [PHOTONS, paths(128)]);
}

#[test]
fn forward_tracing_and_photons_agree_in_a_ring() {
    agrees(&in_a_ring(), "forward", [PHOTONS, PHOTONS]);
}

#[test]
fn path_tracing_and_photons_agree_between_two_casters_in_two_lights_and_the_sky() {
    agrees(&two_casters_in_two_lights(), "backward", [PHOTONS, paths(64)]);
}

#[test]
fn forward_tracing_and_photons_agree_between_two_casters_in_two_lights_and_the_sky() {
    agrees(&two_casters_in_two_lights(), "forward", [PHOTONS, PHOTONS]);
}

/// `LS+DS+E`: what is seen through glass is path tracing's too. The block throws light onto the floor as well.
#[test]
fn path_tracing_and_photons_agree_through_glass() {
    let mut value = beside_a_ball();
    let block =
        json!({ "type": "box", "material": "glass", "center": [-0.8, 0.3, -0.2], "size": [0.5, 0.1, 0.5] });
    value["objects"].as_array_mut().unwrap().push(block);
    value["camera"] = camera_above([-0.8, 0.0, -0.2], 0.8, 0.3);
    agrees(&value, "backward", [PHOTONS, paths(128)]);
}

/// A floor with a highlight: all estimators use the same values of it.
#[test]
fn the_estimators_agree_on_a_floor_with_a_highlight() {
    let mut value = beside_a_ball();
    value["materials"]["floor"] = json!({ "type": "phong", "k_d": [0.3, 0.3, 0.3], "k_s": [0.4, 0.4, 0.4], "n": 10,
                                          "highlight": "conserving" });
    // Photons are looked up once per pixel and round.
    let looked_up = Cost { rounds: 8, log2_photons: 13 };
    agrees(&value, "forward", [looked_up, PHOTONS]);
    agrees(&value, "backward", [looked_up, paths(128)]);
}

/// Pixels cover other areas in the corners of a wide picture, under parallel rays, on a slanting floor and through a lens.
/// The light is a sphere: its photons carry no light images, which may lie a tenth of a pixel off.
#[test]
fn forward_tracing_and_photons_agree_through_every_camera() {
    let mut value = beside_a_ball();
    value["lights"] =
        json!([{ "type": "sphere", "center": [1.2, 3, 0.6], "radius": 1, "radiance": [9, 7, 5] }]);
    let lens = json!({ "type": "perspective", "eye": [-2, 1, 0.3], "target": [-0.8, 0, -0.2], "fov": 20,
                       "aperture": 0.2, "focus_distance": 1.2 });
    let wide = json!({ "type": "perspective", "eye": [-1.2, 0.4, 0], "target": [-1.2, 0, 0], "up": [1, 0, 0], "fov": 120 });
    let parallel =
        json!({ "type": "orthographic", "eye": [-2, 1, 0.3], "target": [-0.8, 0, -0.2], "height": 0.5 });
    for camera in [lens, wide, parallel] {
        value["camera"] = camera;
        agrees(&value, "forward", [PHOTONS, PHOTONS]);
    }
}

/// `L(D|S)*DS*DS*E` after light over glass is found by the same rays: the indirect class agrees too.
#[test]
fn path_tracing_and_photons_agree_on_indirect_light() {
    let mut value = beside_a_ball();
    value["render"]["paths"] = json!("complete");
    let wall = json!({ "type": "polygon", "material": "floor",
                       "vertices": [[-1.3, 0, 3], [-1.3, 0, -3], [-1.3, 2, -3], [-1.3, 2, 3]] });
    value["objects"].as_array_mut().unwrap().push(wall);
    let [a, b] = ["photons", "backward"]
        .map(|name| estimate(name, &value, PathClass::Indirect, Cost { rounds: 64, log2_photons: 10 }));
    let error = a.standard_error.hypot(b.standard_error);
    assert!(T_LIMIT * error < 0.05 * a.mean, "{a:?} {b:?}");
    // Photons are looked up over eight pixels' widths there: the blur of a caustic's rim costs a little.
    assert!((a.mean - b.mean).abs() <= T_LIMIT * error + 2e-3 * a.mean, "{a:?} {b:?}");
}

/// Path tracing gives every pixel the same number of samples: if those that meet the light decided on how many follow them,
/// they would count for less, and three rounds lose 60 % of the light here.
#[test]
fn path_tracing_is_right_in_the_mean_after_few_rounds() {
    let mut value = beside_a_ball();
    value["lights"] = json!([large_light([1.2, 3.0, 0.6], 1.2)]);
    let truth = estimate("photons", &value, PathClass::Caustic, PHOTONS);
    value["render"]["caustics"] = json!("backward");
    let seen = |seed| mean(&render(&value, seed, 3, 8).raw_layer(PathClass::Caustic));
    let found = Estimate::of(&(0..6 * SEEDS).map(seen).collect::<Vec<_>>());
    let error = found.standard_error.hypot(truth.standard_error);
    assert!(T_LIMIT * error < 0.5 * truth.mean, "too noisy: {found:?} {truth:?}");
    assert!((found.mean - truth.mean).abs() <= T_LIMIT * error, "{found:?} {truth:?}");
}

/// Flux that lands on the floor within 1 m of the middle, over seeds.
fn flux_near_the_middle(value: &Value, log2_photons: u32) -> Estimate {
    let scene = compile(value);
    let landed = |(window, seed): (&Window, u64)| {
        let block = Block { first: 0, count: 1 << log2_photons, seed };
        let (photons, _) = trace_block(&scene, window, block, &Control::new()).unwrap();
        let near = photons.iter().filter(|photon| photon.position.length() < 1.0);
        near.map(|photon| f64::from(photon.power.y)).sum::<f64>()
    };
    let windows = windows(&scene);
    over_seeds(|seed| windows.iter().map(|window| landed((window, seed))).sum())
}

/// Photons sent everywhere bring the same light as those aimed at the ball, from a light with a size, from a lamp, from
/// afar and from the sky; most are lost.
#[test]
fn photons_sent_everywhere_bring_the_same_light() {
    let mut value = beside_a_ball();
    let sun = json!({ "type": "directional", "direction": [-0.4, -1, -0.2], "irradiance": [3, 3, 3] });
    let lights = [value["lights"].clone(), json!([lamp()]), json!([sun]), json!([])];
    for (lights, sky) in lights.into_iter().zip([0.0, 0.0, 0.0, 0.5]) {
        value["lights"] = lights;
        value["environment"] = json!({ "radiance": [sky, sky, sky] });
        let [aimed, all] = [("windows", 13), ("everywhere", 17)].map(|(aiming, log2_photons)| {
            value["render"]["aiming"] = json!(aiming);
            flux_near_the_middle(&value, log2_photons)
        });
        let error = aimed.standard_error.hypot(all.standard_error);
        assert!(T_LIMIT * error < 0.05 * aimed.mean, "too noisy to tell: {aimed:?} {all:?}");
        assert!((aimed.mean - all.mean).abs() <= T_LIMIT * error, "{aimed:?} {all:?}");
    }
}

fn plan(estimator: &str, lights: Value) -> Plan {
    let mut value = beside_a_ball();
    value["lights"] = lights;
    value["render"]["caustics"] = json!(estimator);
    Plan::new(&compile(&value))
}

fn lamp() -> Value {
    json!({ "type": "point", "position": [0.7, 3, 0.7], "intensity": [1, 1, 1] })
}

/// F63: a ray cannot meet a light of no size: path tracing would leave its caustics black, and the plan says so.
#[test]
fn f63_path_tracing_warns_of_lights_that_it_cannot_meet() {
    let codes = |plan: &Plan| plan.warnings.iter().map(|w| w.code).collect::<Vec<_>>();
    let both = plan("backward", json!([lamp(), large_light([0.0, 3.0, 0.0], 1.0)]));
    assert_eq!(codes(&both), ["backward_cannot_meet_light"]);
    let alone = plan("backward", json!([lamp()]));
    assert_eq!(codes(&alone), ["backward_cannot_meet_light"]);
    assert!((alone.caustics, alone.photons.len()) == (None, 0));
    assert_eq!(codes(&plan("backward", json!([large_light([0.0, 3.0, 0.0], 1.0)]))), Vec::<&str>::new());
    assert_eq!(codes(&plan("photons", json!([lamp()]))), Vec::<&str>::new());
}

#[test]
fn forward_tracing_says_that_it_leaves_out_what_mirrors_and_glass_show() {
    let codes = plan("forward", json!([lamp()])).warnings;
    assert!(codes.iter().map(|w| w.code).eq(["forward_sees_no_mirrors"]));
    let mut value = beside_a_ball();
    value["render"]["caustics"] = json!("forward");
    // Through the ball: black.
    value["camera"] =
        json!({ "type": "perspective", "eye": [1.5, 1.5, 0.4], "target": [0, 0.55, 0], "fov": 10 });
    assert_eq!(mean(&render(&value, 1, 1, 12).layer(PathClass::Caustic)), 0.0);
}

/// F68: what is seen in a mirror of a caustic of a small light, `LS+DSE`, path tracing finds rarely: its noise for the
/// same number of eye samples grows as the light shrinks (variance as one over its area), and photons do not care.
#[test]
fn f68_path_tracing_is_noisy_where_the_light_is_small_and_photons_are_not() {
    let noise = |estimator: &str, side: f64| {
        let mut value = beside_a_ball();
        value["lights"] = json!([large_light([1.2, 3.0, 0.6], side)]);
        let cost = if estimator == "photons" { PHOTONS } else { paths(16) };
        let estimate = estimate(estimator, &value, PathClass::Caustic, cost);
        estimate.standard_error / estimate.mean
    };
    let [large, small] = [1.6, 0.4].map(|side| noise("backward", side));
    // A sixteenth of the area: four times the noise; half of that is allowed for two standard errors of 16 values.
    assert!(small > 2.0 * large, "{large} {small}");
    assert!(noise("photons", 0.4) < 0.1 * small);
}

/// F69: a photon right before the eye covers many pixels; its weight is what its pixels' areas are, and no more. The
/// photon map counts the same photons on the pixels' footprints: pixel by pixel both are the same, but for the photons
/// at the footprints' rims, where both round.
#[test]
fn f69_forward_tracing_stays_right_with_the_eye_close_to_the_floor() {
    let mut value = beside_a_ball();
    value["camera"] =
        json!({ "type": "perspective", "eye": [-0.8, 2e-2, -0.2], "target": [-0.9, 0, -0.2], "fov": 10 });
    let [map, forward] = ["photons", "forward"].map(|estimator| {
        value["render"]["caustics"] = json!(estimator);
        let scene = std::sync::Arc::new(compile(&value));
        let mut plan = nephroid::plan::Plan::new(&scene);
        for budget in &mut plan.photons {
            (budget.log2_block, budget.carries) = (17, nephroid::pass1_light::Carries::Points);
        }
        let mut render = nephroid::render::Render::new(scene, plan);
        render.run_round(&nephroid::render::Control::new()).unwrap();
        render.raw_layer(PathClass::Caustic)
    });
    let off: f32 = map.pixels.iter().zip(&forward.pixels).map(|(a, b)| (a[1] - b[1]).abs()).sum();
    let all: f32 = map.pixels.iter().map(|p| p[1]).sum();
    // The floor is seen at 11° and a pixel is 0.6° high: its area per pixel, by the cube of that, changes by 16 % from
    // one edge to the other, on average by 4 % from that in the middle.
    assert!(all > 0.0 && off < 0.05 * all, "{off} of {all}");
}

/// F66, F67: Metropolis light transport and manifold walks are not offered: what is offered is said.
#[test]
fn f66_f67_another_estimator_is_an_error_that_names_the_three() {
    for name in ["mlt", "mnee"] {
        let mut value = beside_a_ball();
        value["render"]["caustics"] = json!(name);
        let errors = Scene::from_json(&value.to_string(), &NoAssets).unwrap_err();
        let message = &errors.issues[0].message;
        assert_eq!(errors.issues[0].pointer, "/render/caustics");
        assert!(["photons", "backward", "forward"].iter().all(|name| message.contains(name)), "{message}");
        assert!(name.parse::<Caustics>().unwrap_err().to_string().contains("`backward`"));
    }
}

fn with_radius(radius: Value) -> Value {
    let mut value = beside_a_ball();
    value["render"]["radius"] = radius;
    value
}

/// The classic look-ups have no bias where the light is even: the mean over a caustic that is wider than their radius
/// is that of the pixels' footprints, but for the caustic's own curvature over 2 cm.
#[test]
fn fixed_and_nearest_look_ups_agree_with_footprints() {
    let cost = Cost { rounds: 4, log2_photons: 15 };
    let mean_of = |radius| estimate("photons", &with_radius(radius), PathClass::Caustic, cost);
    let pixel = mean_of(json!("pixel"));
    for radius in [json!({ "fixed": 0.02 }), json!({ "nearest": 8, "most": 0.02 })] {
        let other = mean_of(radius.clone());
        let error = pixel.standard_error.hypot(other.standard_error);
        assert!(T_LIMIT * error < 0.1 * pixel.mean, "{pixel:?} {other:?}");
        let allowed = T_LIMIT * error + 0.01 * pixel.mean;
        assert!((other.mean - pixel.mean).abs() < allowed, "{radius}: {pixel:?} {other:?}");
    }
}

/// F47: look-ups that find fewer photons than they ask for are counted.
#[test]
fn f47_short_look_ups_are_counted() {
    let short = |radius| render(&with_radius(radius), 1, 1, 10).stats().eye;
    let all = short(json!({ "nearest": 1000, "most": 0.01 }));
    assert!(all.short_lookups == all.lookups && all.lookups > 0, "{all:?}");
    assert_eq!(short(json!({ "fixed": 0.01 })).short_lookups, 0);
}

#[test]
fn a_wrong_radius_is_an_error_with_its_place() {
    for (radius, pointer) in [
        (json!({ "fixed": 0 }), "/render/radius/fixed"),
        (json!({ "nearest": 1, "most": 1 }), "/render/radius/nearest"),
        (json!({ "nearest": 50 }), "/render/radius/most"),
        (json!("wide"), "/render/radius"),
    ] {
        let errors = Scene::from_json(&with_radius(radius.clone()).to_string(), &NoAssets).unwrap_err();
        assert_eq!(errors.issues[0].pointer, pointer, "{radius}");
    }
}

/// Paths that are asked for to end at the first D end there, also where scattered rays look for lights in highlights.
#[test]
fn caustics_pictures_hold_no_light_from_a_second_surface() {
    let mut value = beside_a_ball();
    value["materials"]["rough"] = json!({ "type": "metal", "f0": [0.9, 0.9, 0.9], "roughness": 0.4 });
    value["objects"][0]["material"] = json!("rough");
    let wall = json!({ "type": "polygon", "material": "floor",
                       "vertices": [[-1.3, 0, 3], [-1.3, 0, -3], [-1.3, 2, -3], [-1.3, 2, 3]] });
    value["objects"].as_array_mut().unwrap().push(wall);
    let render = render(&value, 1, 2, 10);
    assert_eq!(mean(&render.layer(PathClass::Indirect)), 0.0);
    assert!(mean(&render.layer(PathClass::Direct)) > 0.0);
}

/// Splats are added in the order of the photons: the bytes do not depend on threads.
#[test]
fn forward_and_backward_pictures_do_not_depend_on_the_number_of_threads() {
    for estimator in ["forward", "backward"] {
        let mut value = two_casters_in_two_lights();
        value["render"]["caustics"] = json!(estimator);
        let pictures = [1, 3].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let image = pool.install(|| render(&value, 1, 3, 12).image());
            image.pixels.iter().map(|p| p.map(f32::to_bits)).collect::<Vec<_>>()
        });
        assert!(pictures[0] == pictures[1], "{estimator}");
    }
}
