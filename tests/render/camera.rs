//! Thin lens and orthographic camera.

use crate::support::{T_LIMIT, camera_above, compile, floor, mean, over_seeds, render, scene};
use nephroid::light_path::PathClass;
use nephroid::plan::Plan;
use nephroid::scene::{NoAssets, Scene};
use serde_json::{Value, json};

/// A camera at the origin that looks along -z, 600 pixels across 60°.
fn camera(aperture: f64, focus: f64) -> Value {
    let fov = 2.0 * (30.0_f64.to_radians().tan() / 600.0 * 16.0).atan().to_degrees();
    json!({ "type": "perspective", "eye": [0, 0, 0], "target": [0, 0, -1], "fov": fov, "aperture": aperture,
            "focus_distance": focus })
}

/// A small light, a pixel wide, at distance `d` in the middle of the picture.
fn dot(camera: Value, d: f64) -> Value {
    let lights =
        json!([{ "type": "sphere", "center": [0, 0, -d], "radius": 1e-3 * d, "radiance": [1e6, 1e6, 1e6] }]);
    let mut value = scene(camera, json!([]), lights);
    value["image"] = json!({ "width": 600, "height": 16 });
    value
}

/// T22: a point at distance 4 through a lens of diameter 0.1 focused at 2 is a disc of A |d - f| / d = 0.05 in the
/// focal plane: 12.99 pixels. Its second moment along x is (diameter / 4)².
#[test]
fn t22_the_blur_disc_has_the_known_diameter() {
    let diameter = |aperture: f64, focus: f64| {
        let image = render(&dot(camera(aperture, focus), 4.0), 1, 256, 8).layer(PathClass::Emitted);
        let (mut sum, mut first, mut second, mut widest) = (0.0, 0.0, 0.0, 0.0_f64);
        for (i, pixel) in image.pixels.iter().enumerate() {
            let x = (i % 600) as f64 + 0.5 - 300.0;
            let weight = f64::from(pixel[1]);
            (sum, first, second) = (sum + weight, first + weight * x, second + weight * x * x);
            widest = if weight > 0.0 { widest.max(x.abs()) } else { widest };
        }
        assert!(widest <= 8.0, "{widest}");
        let mean = first / sum;
        // A pixel's own width adds 1/12.
        4.0 * (second / sum - mean * mean - 1.0 / 12.0).max(0.0).sqrt()
    };
    let blurred = diameter(0.1, 2.0);
    // Half a pixel.
    assert!((blurred - 12.99).abs() < 0.5, "{blurred}");
    let sharp = diameter(0.1, 4.0);
    // The light stands on the corner of four pixels: nothing is spread further.
    assert!(sharp < 2.0, "{sharp}");
}

/// F70: aperture 0 is the pinhole, bit for bit and without lens samples; the plan says which.
#[test]
fn f70_an_aperture_of_zero_is_the_pinhole() {
    let pinhole = camera_above([0.0; 3], 3.0, 1.0);
    let with = |aperture: f64| {
        let mut camera = pinhole.clone();
        camera["aperture"] = json!(aperture);
        let ball = json!({ "type": "sphere", "material": "glass", "center": [0, 0.3, 0], "radius": 0.2 });
        let lights = json!([{ "type": "quad", "center": [0, 4, 2], "size": [1, 1], "towards": [0, 0, 0], "radiance": [1, 1, 1] }]);
        (camera.clone(), scene(camera, json!([floor(2.0, 0.0), ball]), lights))
    };
    let (_, zero) = with(0.0);
    let mut without = zero.clone();
    without["camera"] = pinhole.clone();
    assert_eq!(render(&zero, 1, 2, 10).image().pixels, render(&without, 1, 2, 10).image().pixels);
    let runs =
        |value: &Value| Plan::new(&compile(value)).decisions.iter().any(|d| d.topic == "lens" && d.runs);
    let (_, open) = with(0.05);
    assert!(!runs(&zero) && runs(&open));
    // What a lens sees of a caustic is as bright on average. The focus is smaller than a pixel: a single render is 5 % off.
    let caustic =
        |value: &Value| over_seeds(|seed| mean(&render(value, seed, 8, 13).layer(PathClass::Caustic)));
    let (sharp, soft) = (caustic(&zero), caustic(&open));
    let noise = T_LIMIT * sharp.standard_error.hypot(soft.standard_error);
    assert!(noise < 0.12 * sharp.mean, "too noisy to tell: {sharp:?} {soft:?}");
    assert!((soft.mean - sharp.mean).abs() < noise, "{sharp:?} {soft:?}");
}

/// F70, F71: no focus in the lens, no negative aperture, no view without direction.
#[test]
fn f70_f71_cameras_that_see_nothing_are_refused() {
    let ortho = |target: Value, up: Value, height: f64| json!({ "type": "orthographic", "eye": [0, 0, 0], "target": target, "up": up, "height": height });
    for (bad, pointer) in [
        (camera(0.1, 0.0), "/camera/focus_distance"),
        (camera(-0.1, 1.0), "/camera/aperture"),
        (ortho(json!([0, 0, 0]), json!([0, 1, 0]), 1.0), "/camera/target"),
        (ortho(json!([0, 2, 0]), json!([0, 1, 0]), 1.0), "/camera/up"),
        (ortho(json!([0, 0, 1]), json!([0, 1, 0]), 0.0), "/camera/height"),
    ] {
        let value = scene(bad, json!([]), json!([]));
        let errors = Scene::from_json(&value.to_string(), &NoAssets).expect_err(pointer);
        assert_eq!(errors.issues.len(), 1, "{errors}");
        assert_eq!(errors.issues[0].pointer, pointer);
    }
}

/// An orthographic picture of height 2 is half filled, at any distance, by a light of half its width.
#[test]
fn an_orthographic_camera_sees_things_in_their_size() {
    for distance in [0.5, 50.0] {
        let camera = json!({ "type": "orthographic", "eye": [0, 0, 0], "target": [0, 0, -1], "height": 2 });
        let lights = json!([{ "type": "quad", "center": [0.25, 0, -distance], "size": [1, 2.5], "edge": [1, 0, 0],
                              "towards": [0.25, 0, 0], "radiance": [1, 1, 1] }]);
        let value = scene(camera, json!([]), lights);
        let image = render(&value, 1, 1, 8).layer(PathClass::Emitted);
        for (i, pixel) in image.pixels.iter().enumerate() {
            // 16 pixels across 2 m: x from -0.25 to 0.75 are the pixels 6 to 13.
            let lit = (6..14).contains(&(i % 16));
            assert_eq!(pixel[1] > 0.5, lit, "{distance}: pixel {i}");
        }
    }
    // The caustic of a slab of air in a sun is the sun's light, whatever the width of the estimate.
    let camera = json!({ "type": "orthographic", "eye": [0, 0.2, 0], "target": [0, 0, 0], "up": [0, 0, -1], "height": 0.5 });
    let slab = json!({ "type": "polygon", "material": "air", "vertices": [[-1, 1, 1], [1, 1, 1], [1, 1, -1], [-1, 1, -1]] });
    let sun = json!([{ "type": "directional", "direction": [0, -1, 0], "irradiance": [1, 1, 1] }]);
    let value = scene(camera, json!([floor(1.0, 0.0), slab]), sun);
    let caustic = mean(&render(&value, 1, 4, 14).layer(PathClass::Caustic)) * std::f64::consts::PI / 0.5;
    assert!((caustic - 1.0).abs() < 0.01, "{caustic}");
}
