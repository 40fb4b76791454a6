//! The picture: layers, footprints, smoothing, and the estimate of its error.

use crate::support::{Estimate, SEEDS, T_LIMIT, camera_above, compile, floor, mean, render, scene};
use glam::{DVec3, Vec3};
use nephroid::compare::compare;
use nephroid::geometry::Ray;
use nephroid::image_io::LinearImage;
use nephroid::light_path::PathClass;
use nephroid::media::Media;
use nephroid::pass2_eye::Footprints;
use nephroid::photon_map::{Photon, PhotonMap};
use nephroid::plan::Plan;
use nephroid::render::{Control, Render};
use nephroid::sampling::SamplePoint;
use serde_json::{Value, json};
use std::sync::Arc;

/// The floor lit by the image of a point light in a mirror at x = 1, seen from above: 40 cm around x = 0.5.
fn mirrored_light(width: f64, pixels: u32) -> Value {
    let mirror = json!({ "type": "polygon", "material": "mirror",
                         "vertices": [[1, 0, -1], [1, 0, 1], [1, 1, 1], [1, 1, -1]] });
    let lights = json!([{ "type": "point", "position": [0, 1, 0], "intensity": [1, 1, 1] }]);
    let mut value =
        scene(camera_above([0.5, 0.0, 0.0], 3.0, width), json!([floor(2.0, 0.0), mirror]), lights);
    value["image"] = json!({ "width": pixels, "height": pixels });
    value
}

/// What [`mirrored_light`]'s caustic layer is at a floor point: radiance of a floor of albedo 1/2.
fn mirrored_radiance(x: f64, z: f64) -> f64 {
    let to = DVec3::new(2.0 - x, 1.0, -z);
    0.9 * to.y / to.length().powi(3) * 0.5 / std::f64::consts::PI
}

/// Largest relative difference of two pictures' pixels where the second is not dark.
fn relative_errors(image: &LinearImage, truth: impl Fn(usize) -> f64) -> f64 {
    let squares = image.pixels.iter().enumerate().map(|(i, p)| (f64::from(p[1]) / truth(i) - 1.0).powi(2));
    (squares.sum::<f64>() / image.pixels.len() as f64).sqrt()
}

/// The true caustic radiance at a pixel's middle.
fn truth(width: f64, pixels: usize) -> impl Fn(usize) -> f64 {
    let at = move |k: usize| ((k as f64 + 0.5) / pixels as f64 - 0.5) * width;
    move |i| mirrored_radiance(0.5 + at(i % pixels), at(i / pixels))
}

#[test]
fn the_layers_add_up_to_the_image() {
    let objects = json!([
        floor(2.0, 0.0),
        { "type": "sphere", "material": "glass", "center": [0, 0.6, 0], "radius": 0.5 },
    ]);
    let lights = json!([{ "type": "quad", "center": [0, 3, 1], "size": [0.4, 0.3], "towards": [0, 0, 0],
                          "radiance": [20, 18, 15] }]);
    let mut value = scene(camera_above([0.3, 0.0, 0.0], 3.0, 3.0), objects, lights);
    value["environment"] = json!({ "radiance": [0.1, 0.2, 0.3] });
    let render = render(&value, 1, 3, 10);
    let layers = PathClass::ALL.map(|class| render.layer(class));
    for (i, pixel) in render.image().pixels.iter().enumerate() {
        let sum = layers.iter().map(|layer| Vec3::from_array(layer.pixels[i])).sum::<Vec3>();
        // Rounding of three additions.
        assert!((sum - Vec3::from_array(*pixel)).abs().max_element() <= 1e-6 * sum.max_element(), "{i}");
    }
}

/// Every photon on the floor falls on exactly one pixel's footprint.
#[test]
fn footprints_count_every_photon_once() {
    let width = 0.4;
    let scene = compile(&mirrored_light(width, 24));
    let footprints = Footprints::trace(&scene, &Media::default());
    let sheet = scene.geometry.closest_hit(&Ray::new(Vec3::new(0.5, 1.0, 0.0), Vec3::NEG_Y)).unwrap().sheet;
    let half = 0.5 * width as f32 * 0.999;
    let photons: Vec<Photon> = (0..20_000)
        .map(|i| {
            let u = SamplePoint::new(6, i).get_2d(0) * 2.0 - 1.0;
            let position = Vec3::new(0.5 + half * u.x, 0.0, half * u.y);
            let direction = Vec3::new(-0.6, -0.8, 0.0);
            Photon { position, direction, normal: Vec3::Y, sheet, kind: 0, power: Vec3::ONE }
        })
        .collect();
    let map = PhotonMap::build(&photons);
    let (count, _) = footprints.size();
    let total: f32 = (0..count).map(|i| map.flux_within(footprints.get(i).unwrap()).y).sum();
    // On a shared edge the two sides' rounding may disagree; 24² edges of 20,000 photons meet next to none.
    assert!((total - photons.len() as f32).abs() <= 3.0, "{total}");
    let area: f32 = (0..count).map(|i| footprints.get(i).unwrap().area).sum();
    assert!((area / (width * width) as f32 - 1.0).abs() < 1e-4, "{area}");
}

/// Where a caustic is smooth the two halves advise to smooth it: noise falls to less than a third.
#[test]
fn smooth_light_is_smoothed() {
    let (width, pixels) = (0.4, 64);
    let render = render(&mirrored_light(width, pixels), 1, 1, 16);
    let picture = render.layer(PathClass::Caustic);
    let unsmoothed = render.raw_layer(PathClass::Caustic);
    let truth = truth(width, pixels as usize);
    let (after, before) = (relative_errors(&picture, &truth), relative_errors(&unsmoothed, &truth));
    assert!(after < before / 3.0, "{after} {before}");
}

/// Through a lens no pixel has a footprint: there it is radiance that is smoothed, among pixels whose middles show the same.
#[test]
fn smooth_light_is_smoothed_through_a_lens() {
    let (width, pixels) = (0.4, 64);
    let mut value = mirrored_light(width, pixels);
    value["camera"]["aperture"] = json!(0.01);
    value["camera"]["focus_distance"] = json!(3.0);
    let render = render(&value, 1, 2, 16);
    let (picture, unsmoothed) = (render.layer(PathClass::Caustic), render.raw_layer(PathClass::Caustic));
    let truth = truth(width, pixels as usize);
    let (after, before) = (relative_errors(&picture, &truth), relative_errors(&unsmoothed, &truth));
    assert!(after < before / 3.0, "{after} {before}");
}

/// The classic progressive estimate, to compare with: right in the mean, and not smoothed.
#[test]
fn the_progressive_radius_is_right_in_the_mean_and_not_smoothed() {
    let (width, pixels) = (0.2, 24);
    let mut value = mirrored_light(width, pixels);
    value["render"]["radius"] = json!("progressive");
    let truth = truth(width, pixels as usize);
    let count = (pixels * pixels) as usize;
    let expected = (0..count).map(&truth).sum::<f64>() / count as f64;
    let estimate = crate::support::over_seeds(|seed| {
        let render = render(&value, seed, 1, 17);
        assert_eq!(render.layer(PathClass::Caustic), render.raw_layer(PathClass::Caustic));
        crate::support::mean(&render.layer(PathClass::Caustic))
    });
    // The kernel of four pixels sees the light's curvature over 3 cm.
    estimate.assert_is(expected, 2e-3);
}

/// The mirror's outline projects to a sharp edge, z = 2 - x: three pixels from it the light is whole on one side
/// and nothing on the other.
#[test]
fn sharp_light_stays_sharp() {
    let (width, pixels) = (0.4, 64_usize);
    let mut value = mirrored_light(width, pixels as u32);
    value["camera"] = camera_above([0.5, 0.0, 1.5], 3.0, width);
    let picture = render(&value, 1, 1, 19).layer(PathClass::Caustic);
    let at = |k: usize| ((k as f64 + 0.5) / pixels as f64 - 0.5) * width;
    let pixel = width / pixels as f64;
    let (mut inside, mut outside) = (Vec::new(), Vec::new());
    for (i, value) in picture.pixels.iter().enumerate() {
        let (x, z) = (0.5 + at(i % pixels), 1.5 + at(i / pixels));
        // Distance from the edge, whose slope is one.
        let within = (2.0 - x - z) / 2.0_f64.sqrt();
        let relative = f64::from(value[1]) / mirrored_radiance(x, z);
        if (3.0 * pixel..6.0 * pixel).contains(&within) {
            inside.push(relative);
        } else if (3.0 * pixel..6.0 * pixel).contains(&-within) {
            outside.push(relative);
        }
    }
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    assert!((mean(&inside) - 1.0).abs() < 0.03, "{}", mean(&inside));
    assert!(mean(&outside) < 0.03, "{}", mean(&outside));
}

/// The estimate of the error, which knows no truth, against the error itself, in the mean over seeds: optimistic
/// by at most 1.5, since the least of noisy estimates is chosen, and pessimistic by at most 3, since the blur of a
/// width counts as no less than the noisy estimate for any narrower one. Here, where all is smooth, it is 2.3.
#[test]
fn the_estimated_error_is_hardly_less_than_the_true_one() {
    let (width, pixels) = (0.4, 128);
    let mut value = mirrored_light(width, pixels);
    // Only the mirror's light: the lamp itself is hidden from the floor that is seen.
    let lid = json!({ "name": "lid", "type": "polygon", "material": "floor",
                      "vertices": [[0.1, 0.4, 0.5], [0.45, 0.4, 0.5], [0.45, 0.4, -0.5], [0.1, 0.4, -0.5]] });
    value["objects"].as_array_mut().unwrap().push(lid);
    let width = 0.1;
    value["camera"] = camera_above([0.6, 0.0, 0.0], 0.3, width);
    let (mut estimated, mut actual) = (0.0, 0.0);
    for seed in 1..=SEEDS {
        let render = render(&value, seed, 1, 17);
        assert_eq!(crate::support::mean(&render.layer(PathClass::Direct)), 0.0, "the lid hides the lamp");
        let at = |k: usize| ((k as f64 + 0.5) / f64::from(pixels) - 0.5) * width;
        let truth = |i: usize| mirrored_radiance(0.6 + at(i % pixels as usize), at(i / pixels as usize));
        actual += relative_errors(&render.image(), truth).powi(2);
        // The estimate is relative to L² + (L/10)².
        estimated += f64::from(render.error_estimate().unwrap()).powi(2) * 1.01;
    }
    let ratio = (estimated / actual).sqrt();
    assert!((1.0 / 1.5..3.0).contains(&ratio), "estimated over true: {ratio}");
}

/// A lamp three hundred times as bright as the mean of the wall behind it.
fn lamp_before_a_wall() -> Value {
    let wall = json!({ "type": "polygon", "material": "floor", "vertices": [[-2, -2, -1], [2, -2, -1], [2, 2, -1], [-2, 2, -1]] });
    let lamp = json!({ "type": "sphere", "center": [0, 0, 0], "radius": 0.1, "radiance": [100, 100, 100] });
    let camera =
        json!({ "type": "perspective", "eye": [0.03, 0.02, 3], "target": [0.03, 0.02, 0], "fov": 40 });
    let mut value = scene(camera, json!([wall]), json!([lamp]));
    value["image"] = json!({ "width": 48, "height": 48 });
    value
}

/// Each pixel as often as every other, or as a pilot with another seed wants it.
fn unbiased(value: &Value, (seed, rounds): (u64, u32), pilot: Option<&Render>) -> LinearImage {
    let mut scene = compile(value);
    scene.render.seed = seed;
    let scene = Arc::new(scene);
    let render = Render::new(Arc::clone(&scene), Plan::new(&scene));
    let mut render = if let Some(pilot) = pilot { render.sampled_as(pilot) } else { render.evenly() };
    for _ in 0..rounds {
        render.run_round(&Control::new()).unwrap();
    }
    render.image()
}

/// At its outline the two first samples of a pixel meet the lamp or the wall, three hundred times darker: the error of a first round is
/// that of few pixels, and the estimate in the mean over seeds within the factors of the test above.
#[test]
fn the_outline_of_a_lamp_does_not_hold_the_estimate_up() {
    let value = lamp_before_a_wall();
    let truth = unbiased(&value, (99, 256), None);
    let (mut estimated, mut actual) = (0.0, 0.0);
    for seed in 1..=SEEDS {
        let render = render(&value, seed, 1, 10);
        actual += compare(&render.image(), &truth, None).unwrap().relmse;
        estimated += f64::from(render.error_estimate().unwrap()).powi(2);
    }
    let ratio = (estimated / actual).sqrt();
    assert!((1.0 / 1.5..3.0).contains(&ratio), "estimated over true: {ratio}");
}

/// A pilot that found where the lamp is leaves the mean as it is, and its noise less than half as large.
#[test]
fn a_pilot_makes_no_bias() {
    let value = lamp_before_a_wall();
    let pilot = render(&value, 99, 8, 10);
    let over_seeds = |pilot: Option<&Render>| {
        Estimate::of(&(1..=SEEDS).map(|seed| mean(&unbiased(&value, (seed, 4), pilot))).collect::<Vec<_>>())
    };
    let (with, without) = (over_seeds(Some(&pilot)), over_seeds(None));
    assert!(with.distance(without, 0.0).abs() < T_LIMIT, "{with:?} {without:?}");
    assert!(2.0 * with.standard_error < without.standard_error, "{with:?} {without:?}");
}
