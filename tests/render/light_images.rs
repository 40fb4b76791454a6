//! `LS+DE`: images of area lights bring the light that plain photons bring.

use crate::support::{Estimate, T_LIMIT, mean};
use crate::support::{camera_above, compile, floor, mean_irradiance, mean_over_square, over_seeds, scene};
use glam::DVec3;
use nephroid::light_path::PathClass;
use nephroid::pass1_light::{Block, Carries, trace_block, trace_images, windows};
use nephroid::plan::Plan;
use nephroid::render::{Control, Render};
use serde_json::{Value, json};
use std::sync::Arc;

/// One round of 2^`log2_points` points of each window and half, all windows carrying the same.
fn render(value: &Value, carries: Carries, seed: u64, log2_points: u32) -> Render {
    let mut scene = compile(value);
    scene.render.seed = seed;
    let mut plan = Plan::new(&scene);
    assert!(!plan.photons.is_empty());
    plan.photons.iter_mut().for_each(|b| (b.log2_block, b.carries) = (log2_points, carries));
    let mut render = Render::new(Arc::new(scene), plan);
    render.run_round(&Control::new()).unwrap();
    render
}

fn quad(center: [f64; 3], size: f64, towards: [f64; 3]) -> Value {
    json!({ "type": "quad", "center": center, "size": [size, size], "towards": towards, "radiance": [30, 30, 30] })
}

/// Mean caustic irradiance over seeds.
fn caustic(value: &Value, carries: Carries, log2_points: u32) -> Estimate {
    over_seeds(|seed| mean_irradiance(&render(value, carries, seed, log2_points), PathClass::Caustic))
}

/// Images and plain photons give the same mean up to the noise of both: |z| of two means over 16 seeds each.
fn assert_same_light(value: &Value) {
    let plain = caustic(value, Carries::Points, 14);
    let images = caustic(value, Carries::LightImages, 10);
    let noise = plain.standard_error.hypot(images.standard_error);
    assert!(
        plain.mean > 0.0 && T_LIMIT * noise < 0.05 * plain.mean,
        "too noisy to tell: {plain:?} {images:?}"
    );
    let z = (plain.mean - images.mean) / noise;
    assert!(z.abs() < T_LIMIT, "{z}: {plain:?} {images:?}");
}

fn glass_ball() -> Value {
    let ball = json!({ "type": "sphere", "material": "glass", "center": [0, 1.2, 0], "radius": 0.5 });
    json!([floor(2.0, 0.0), ball])
}

/// It sees nothing but floor, where the light of [`glass_ball`] falls from (1.2, 3, 0.6).
fn camera_below_ball() -> Value {
    camera_above([-0.8, 0.0, -0.4], 0.6, 1.0)
}

/// A focus, a shadow's edge, reflections and internal reflections: every reason to quarter the light.
#[test]
fn a_glass_ball_throws_the_same_light_by_images_as_by_photons() {
    let lights = json!([quad([1.2, 3.0, 0.6], 0.4, [0.0, 1.2, 0.0])]);
    assert_same_light(&scene(camera_below_ball(), glass_ball(), lights));
}

/// The inside of a polished cylinder: a cusp.
#[test]
fn a_ring_throws_the_same_light_by_images_as_by_photons() {
    let ring = json!({ "type": "cylinder", "material": "mirror", "from": [0, 0.01, 0], "to": [0, 0.4, 0],
                       "radius": 0.8 });
    let lights = json!([quad([3.0, 1.6, 0.0], 0.3, [0.0, 0.2, 0.0])]);
    assert_same_light(&scene(camera_above([0.0; 3], 0.35, 0.7), json!([floor(2.0, 0.0), ring]), lights));
}

/// Two lights and two casters in each other's way.
#[test]
fn several_lights_and_casters_throw_the_same_light_by_images_as_by_photons() {
    let objects = json!([
        floor(2.0, 0.0),
        { "type": "sphere", "material": "glass", "center": [0, 1.2, 0], "radius": 0.4 },
        { "type": "sphere", "material": "mirror", "center": [0.6, 1.5, 0.2], "radius": 0.3 },
    ]);
    let lights =
        json!([quad([0.8, 3.0, 0.3], 0.5, [0.0, 1.0, 0.0]), quad([-2.0, 2.4, 1.0], 0.8, [0.0, 1.0, 0.0])]);
    assert_same_light(&scene(camera_above([-0.4, 0.0, -0.2], 0.6, 1.6), objects, lights));
}

/// T24 with a light that has a size: the floor sees the image of the light behind the mirror x = 1. The sum over a
/// 16 × 16 grid of the light's points is exact to 1e-4, since the light is seen at 0.2 rad.
#[test]
fn t24_a_plane_mirror_lights_the_floor_like_the_image_of_an_area_light() {
    let mirror = json!({ "type": "polygon", "material": "mirror",
                         "vertices": [[1, 0, -1], [1, 0, 1], [1, 1, 1], [1, 1, -1]] });
    let side = 0.3;
    let lights = json!([quad([0.0, 1.0, 0.0], side, [1.0, 0.5, 0.0])]);
    let width = 0.2;
    // The light faces along (1, -1/2, 0); its image faces along (-1, -1/2, 0) from (2, 1, 0).
    let normal = DVec3::new(-1.0, -0.5, 0.0).normalize();
    let (across, up) = (DVec3::Z, normal.cross(DVec3::Z));
    let image = |x: f64, z: f64| {
        let n = 16;
        let from = |i: i32| ((f64::from(i) + 0.5) / f64::from(n) - 0.5) * side;
        let irradiance = |k: i32| {
            let point = DVec3::new(2.0, 1.0, 0.0) + across * from(k % n) + up * from(k / n);
            let to = DVec3::new(x, 0.0, z) - point;
            30.0 * to.dot(normal).max(0.0) * -to.y / to.length().powi(4)
        };
        0.9 * side * side * (0..n * n).map(irradiance).sum::<f64>() / f64::from(n * n)
    };
    let value = scene(camera_above([0.5, 0.0, 0.0], 3.0, width), json!([floor(2.0, 0.0), mirror]), lights);
    let estimate = caustic(&value, Carries::LightImages, 12);
    estimate.assert_is(mean_over_square(0.5, 0.0, width, image), 2e-4);
}

/// T25 with a light that has a size: a ball of index 1 is not there. Through it the light's rays go straight on, and
/// shadow rays see what it does not hide.
#[test]
fn t25_glass_of_index_one_is_not_there_under_an_area_light() {
    let lights = json!([quad([0.3, 2.0, 0.0], 0.3, [0.0, 0.0, 0.0])]);
    let ball = json!({ "type": "sphere", "material": "air", "center": [0, 0.6, 0], "radius": 0.3 });
    let camera = || {
        json!({ "type": "perspective", "eye": [1.2, 3, 0.4], "target": [-0.3, 0, 0],
                            "up": [0, 1, 0], "fov": 20 })
    };
    let with = scene(camera(), json!([floor(2.0, 0.0), ball]), lights.clone());
    let without = scene(camera(), json!([floor(2.0, 0.0)]), lights);
    let expected = over_seeds(|seed| mean(&crate::support::render(&without, seed, 4, 8).image())).mean;
    let estimate = over_seeds(|seed| mean(&render(&with, Carries::LightImages, seed, 13).image()));
    // Each eye sample of a shadow's edge sees another point of the light: what is left of that after 16 seeds.
    estimate.assert_is(expected, 2e-3);
}

/// The flux of all images and points is that of the photons of the same block: to the spacing of low-discrepancy
/// points, a few tenths of a percent at 2^14 of them.
#[test]
fn images_carry_the_flux_that_photons_store() {
    let lights = json!([quad([1.2, 3.0, 0.6], 0.4, [0.0, 1.2, 0.0])]);
    let scene = compile(&scene(camera_below_ball(), glass_ball(), lights));
    let window = windows(&scene).swap_remove(0);
    let block = Block { first: 0, count: 1 << 14, seed: 5 };
    let (photons, tally) = trace_block(&scene, &window, block, &Control::new()).unwrap();
    let (spread, rays) = trace_images(&scene, &window, block, &Control::new()).unwrap();
    let images: f64 = spread.images.iter().map(|i| f64::from(i.power.y)).sum();
    let points: f64 = spread.points.iter().map(|p| f64::from(p.power.y)).sum();
    let stored: f64 = photons.iter().map(|p| f64::from(p.power.y)).sum();
    assert!(((images + points) / stored - 1.0).abs() < 5e-3, "{images} {points} {stored}");
    assert!(images > 0.8 * stored, "most light is in images: {images} of {stored}");
    assert!(rays > tally.rays);
}

#[test]
fn a_picture_of_light_images_does_not_depend_on_the_number_of_threads() {
    let lights = json!([quad([1.2, 3.0, 0.6], 0.4, [0.0, 1.2, 0.0])]);
    let mut value = scene(camera_below_ball(), glass_ball(), lights);
    value["image"] = json!({ "width": 50, "height": 37 });
    let picture = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let image = render(&value, Carries::LightImages, 3, 12).image();
            image.pixels.iter().map(|p| p.map(f32::to_bits)).collect::<Vec<_>>()
        })
    };
    let one = picture(1);
    assert!(one.iter().any(|p| *p != [0; 3]));
    assert!(one == picture(2) && one == picture(7));
}

/// What the plan chooses: plain photons where the light has no size.
#[test]
fn light_images_are_chosen_where_area_lights_throw_caustics_that_are_seen_directly() {
    let plan = |lights: Value| {
        let mut value = scene(camera_below_ball(), glass_ball(), lights);
        value["image"] = json!({ "width": 256, "height": 256 });
        let plan = Plan::new(&compile(&value));
        plan.photons.iter().map(|b| b.carries).collect::<Vec<_>>()
    };
    assert_eq!(plan(json!([quad([1.2, 3.0, 0.6], 0.3, [0.0, 1.2, 0.0])])), [Carries::LightImages]);
    let point = json!([{ "type": "point", "position": [1.2, 3, 0.6], "intensity": [1, 1, 1] }]);
    assert_eq!(plan(point), [Carries::Points]);
}
