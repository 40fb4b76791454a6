//! `LDE`: point, directional and quad lights over a floor.

use crate::support::{
    SEEDS, camera_above, compile, floor, mean_irradiance, mean_over_square, over_seeds, render, scene,
};
use nephroid::light_path::PathClass;
use serde_json::json;

/// T8: E = I cosθ / d², here I y / (y² + x²)^{3/2}. A small square around x = 0.5; the renderer works in f32,
/// and the pixels' jittered positions leave a second-order error over the square of 1e-4.
#[test]
fn t8_a_point_light_falls_off_with_cosine_and_squared_distance() {
    let lights = json!([{ "type": "point", "position": [0, 1, 0], "intensity": [1, 1, 1] }]);
    let width = 0.01;
    let camera = camera_above([0.5, 0.0, 0.0], 3.0, width);
    let scene = scene(camera, json!([floor(2.0, 0.0)]), lights);
    let irradiance = mean_irradiance(&render(&scene, 1, 4, 8), PathClass::Direct);
    assert!((irradiance - 0.715_541_752_8).abs() < 1e-4, "{irradiance}");
}

/// Lambert's formula for the irradiance of a polygon of radiance 1.
fn lambert(corners: &[[f64; 3]; 4], point: [f64; 3]) -> f64 {
    let rays: Vec<glam::DVec3> =
        corners.iter().map(|c| (glam::DVec3::from(*c) - glam::DVec3::from(point)).normalize()).collect();
    let edge = |i: usize| {
        let (a, b) = (rays[i], rays[(i + 1) % 4]);
        a.dot(b).clamp(-1.0, 1.0).acos() * a.cross(b).normalize().y
    };
    0.5 * (0..4).map(edge).sum::<f64>().abs()
}

const SQUARE_ABOVE: [[f64; 3]; 4] = [[-1.0, 1.0, -1.0], [1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [-1.0, 1.0, 1.0]];

#[test]
fn t16_lamberts_formula_gives_the_known_values() {
    assert!((lambert(&SQUARE_ABOVE, [0.0, 0.0, 0.0]) - 1.740_839_503).abs() < 1e-9);
    assert!((lambert(&SQUARE_ABOVE, [2.0, 0.0, 0.0]) - 0.219_373_131).abs() < 1e-9);
}

/// T16: a 2 × 2 light at height 1, sampled by solid angle, at its centre and beside it. The camera looks from
/// below the light.
#[test]
fn t16_a_quad_light_gives_lamberts_irradiance() {
    let lights = json!([{ "type": "quad", "center": [0, 1, 0], "size": [2, 2], "towards": [0, 0, 0],
                          "radiance": [1, 1, 1] }]);
    for x in [0.0, 2.0] {
        let width = 0.1;
        let scene = scene(camera_above([x, 0.0, 0.0], 0.5, width), json!([floor(4.0, 0.0)]), lights.clone());
        let estimate = over_seeds(|seed| mean_irradiance(&render(&scene, seed, 16, 8), PathClass::Direct));
        let expected = mean_over_square(x, 0.0, width, |x, z| lambert(&SQUARE_ABOVE, [x, 0.0, z]));
        estimate.assert_is(expected, 0.0);
    }
}

/// A light whose plane holds the receiver, and one that faces away, give nothing and nothing that is not
/// finite (F29).
#[test]
fn f29_a_light_seen_edge_on_or_from_behind_gives_nothing() {
    for (center, towards) in [([0, 0, 0], [1, 0, 0]), ([0, 1, 0], [0, 2, 0])] {
        let lights = json!([{ "type": "quad", "center": center, "size": [0.5, 0.5], "towards": towards,
                              "radiance": [1, 1, 1] }]);
        let scene = scene(camera_above([-1.0, 0.0, 0.0], 3.0, 0.1), json!([floor(4.0, 0.0)]), lights);
        let irradiance = mean_irradiance(&render(&scene, 1, 2, 8), PathClass::Direct);
        assert_eq!(irradiance, 0.0);
    }
}

/// A directional light of irradiance E at 60° gives E cos 60°, on either side of the floor.
#[test]
fn a_directional_light_falls_off_with_the_cosine_on_both_sides() {
    for (y, eye_height) in [(-0.5, 2.0), (0.5, -2.0)] {
        let direction = [0.75_f64.sqrt(), y, 0.0];
        let lights = json!([{ "type": "directional", "direction": direction, "irradiance": [3, 3, 3] }]);
        let scene = scene(camera_above([0.0; 3], eye_height, 0.1), json!([floor(4.0, 0.0)]), lights);
        let irradiance = mean_irradiance(&render(&scene, 1, 1, 8), PathClass::Direct);
        assert!((irradiance - 1.5).abs() < 1e-5, "{irradiance}");
    }
}

/// A constant environment of radiance L gives an open floor π L.
#[test]
fn a_constant_environment_gives_pi_times_its_radiance() {
    let mut value = scene(camera_above([0.0; 3], 1.0, 0.5), json!([floor(4.0, 0.0)]), json!([]));
    value["environment"] = json!({ "radiance": [2, 2, 2] });
    let irradiance = mean_irradiance(&render(&value, 1, 1, 8), PathClass::Direct);
    assert!((irradiance - 2.0 * std::f64::consts::PI).abs() < 1e-5, "{irradiance}");
    assert_eq!(compile(&value).lights.len(), 0, "and no light is needed; seeds: {SEEDS}");
}

/// A lamp a millimetre above the floor, a hundred metres from the origin, where a float is good to some micrometres: it
/// covers nearly the whole sky of the point below it, whose irradiance is π times its radiance. One part in a thousand
/// for the light past its rim, (h / r)² = 1e-4, and the rounding of its height.
#[test]
fn f14_a_lamp_close_to_a_surface_far_from_the_origin_keeps_its_light() {
    let lights = json!([{ "type": "quad", "center": [100, 1e-3, 100], "size": [0.2, 0.2], "towards": [100, 0, 100],
                          "radiance": [1, 1, 1] }]);
    let mut value = scene(camera_above([100.0, 0.0, 100.0], 5e-4, 1e-4), json!([floor(200.0, 0.0)]), lights);
    value["camera"]["fov"] = json!(10);
    let estimate = over_seeds(|seed| mean_irradiance(&render(&value, seed, 16, 8), PathClass::Direct));
    estimate.assert_is(std::f64::consts::PI, 2e-3);
}
