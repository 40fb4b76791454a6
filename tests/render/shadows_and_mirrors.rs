//! Penumbrae, and images in mirrors: where they lie and how bright they are.

use crate::support::{floor, mean, render, scene};
use glam::{DVec2, DVec3};
use nephroid::light_path::PathClass;
use serde_json::json;
use std::f64::consts::PI;

/// T19: a strip light of width s = 1 at H = 4 and an edge at h = 1: the penumbra is s h / (H - h) = 1/3 wide. An
/// infinite strip from x = a to b gives pi L / 2 (sin b' - sin a') of the angles at which its borders are seen, and
/// the edge hides what lies below x' = -3 x.
#[test]
fn t19_the_penumbra_of_a_strip_has_the_known_width() {
    let lights = json!([{ "type": "quad", "center": [0, 4, 0], "size": [1, 4000], "edge": [1, 0, 0],
                          "towards": [0, 0, 0], "radiance": [1, 1, 1] }]);
    let screen = json!({ "type": "polygon", "material": "floor", "vertices": [[-9000, 1, 9000], [0, 1, 9000], [0, 1, -9000], [-9000, 1, -9000]] });
    let camera = json!({ "type": "orthographic", "eye": [0, 0.5, 0], "target": [0, 0, 0], "up": [0, 0, -1], "height": 0.2 });
    let mut value = scene(camera, json!([floor(10.0, 0.0), screen]), lights);
    // A pixel is a centimetre.
    value["image"] = json!({ "width": 60, "height": 20 });
    let image = render(&value, 1, 256, 8).layer(PathClass::Direct);
    let sine = |x: f64, at: f64| (at - x) / ((at - x).powi(2) + 16.0).sqrt();
    for i in 0..60 {
        let x = (f64::from(i) + 0.5 - 30.0) / 100.0;
        let found = (0..20).map(|row| f64::from(image.pixels[row * 60 + i as usize][1])).sum::<f64>() / 20.0;
        let seen = |x: f64| 0.5 * PI * (sine(x, 0.5) - sine(x, (-3.0 * x).clamp(-0.5, 0.5)));
        let share = found * PI / 0.5 / (0.5 * PI * (sine(x, 0.5) - sine(x, -0.5)));
        let expected = seen(x) / (0.5 * PI * (sine(x, 0.5) - sine(x, -0.5)));
        // The penumbra is 33.3 pixels wide: half a pixel is 1.5 %.
        assert!((share - expected).abs() < 0.015, "{x}: {share}, not {expected}");
        // Outside of it, all or nothing.
        if x < -1.0 / 6.0 - 0.005 {
            assert_eq!(found, 0.0, "{x}");
        }
    }
}

/// T32: an upright wall of mirror from the axis outwards, at an angle in the horizontal plane.
fn wall(angle: f64) -> serde_json::Value {
    let (x, z) = (6.0 * angle.cos(), -6.0 * angle.sin());
    json!({ "type": "polygon", "material": "mirror", "vertices": [[0, -3, 0], [x, -3, z], [x, 3, z], [0, 3, 0]] })
}

/// T32: between two mirrors at 60° a lamp is seen once itself and five times mirrored, each image where its point is
/// mirrored to, and by 0.9 fainter for every mirror on the way.
#[test]
fn t32_two_mirrors_at_60_degrees_show_five_images() {
    let (at, lamp) = (35.0_f64.to_radians(), 20.0_f64.to_radians());
    let place = |angle: f64, radius: f64| DVec2::new(radius * angle.cos(), -radius * angle.sin());
    let (eye, radius) = (place(at, 2.5), 0.02);
    let light = place(lamp, 1.0);
    let lights = json!([{ "type": "sphere", "center": [light.x, 0, light.y], "radius": radius, "radiance": [1, 1, 1] }]);
    let (across, fov) = (960_usize, 60.0_f64);
    let tangent = (0.5 * fov).to_radians().tan();
    let vertical = 2.0 * (tangent / across as f64 * 32.0).atan().to_degrees();
    let camera =
        json!({ "type": "perspective", "eye": [eye.x, 0, eye.y], "target": [0, 0, 0], "fov": vertical });
    let mut value = scene(camera, json!([wall(0.0), wall(PI / 3.0)]), lights);
    value["image"] = json!({ "width": across, "height": 32 });
    let image = render(&value, 1, 16, 8).layer(PathClass::Emitted);
    // Where each image should be, and through how many mirrors: of the two that meet in the axis, k turns by 120°.
    let images = [
        (lamp, 0),
        (-lamp, 1),
        (PI * 2.0 / 3.0 - lamp, 1),
        (lamp + PI * 2.0 / 3.0, 2),
        (lamp - PI * 2.0 / 3.0, 2),
    ];
    let deepest = (PI * 4.0 / 3.0 - lamp, 3);
    let (forward, mut found) = (-eye.normalize(), 0.0);
    for (angle, mirrors) in images.into_iter().chain([deepest]) {
        let to = place(angle, 1.0) - eye;
        let column = (to.perp_dot(-forward) / to.dot(forward) / tangent + 1.0) * 0.5 * across as f64;
        let to = DVec3::new(to.x, 0.0, to.y);
        let reach = (radius / to.length() / tangent * 0.5 * across as f64).ceil() as usize + 2;
        let near = (column as usize).saturating_sub(reach)..=(column as usize + reach).min(across - 1);
        let (mut sum, mut moment) = (0.0, 0.0);
        for x in near {
            let light = (0..32).map(|y| f64::from(image.pixels[y * across + x][1])).sum::<f64>();
            (sum, moment) = (sum + light, moment + light * (x as f64 + 0.5));
        }
        assert!(sum > 0.0, "no image at column {column}");
        assert!((moment / sum - column).abs() < 0.5, "image at {}, not at {column}", moment / sum);
        let brightest = (0..32).map(|y| image.pixels[y * across + column as usize][1]).fold(0.0, f32::max);
        let expected = 0.9_f64.powi(mirrors);
        assert!((f64::from(brightest) - expected).abs() < 1e-3, "{mirrors}: {brightest}");
        found += sum;
    }
    let all: f64 = image.pixels.iter().map(|p| f64::from(p[1])).sum();
    assert!((found / all - 1.0).abs() < 1e-6, "there is light beside the six: {found} of {all}");
}

/// T32: between parallel mirrors the k-th image has rho^k of the light.
#[test]
fn t32_parallel_mirrors_dim_the_kth_image_by_rho_to_the_k() {
    let mirror = |z: f64| json!({ "type": "polygon", "material": "mirror", "vertices": [[-50, -50, z], [50, -50, z], [50, 50, z], [-50, 50, z]] });
    let lights = json!([{ "type": "sphere", "center": [0.7, 0, 2], "radius": 0.05, "radiance": [1, 1, 1] }]);
    // Mirrors at z = 0 and 4; the eye at z = 3 looks towards -z. The image of z in them is -z and 8 - z.
    let (mut place, mut other) = (2.0, 2.0);
    for k in 1..=6 {
        (place, other) = (-other, 8.0 - place);
        // The last mirror on the way from the light is the near one, at z = 0.
        let (distance, aside) = (3.0 - place, 0.7);
        let camera = json!({ "type": "perspective", "eye": [0, 0, 3], "target": [aside, 0, 3.0 - distance],
                             "fov": (0.05_f64 / distance).to_degrees() });
        let mut value = scene(camera, json!([mirror(0.0), mirror(4.0)]), lights.clone());
        value["image"] = json!({ "width": 4, "height": 4 });
        let found = mean(&render(&value, 1, 2, 8).layer(PathClass::Emitted));
        assert!((found - 0.9_f64.powi(k)).abs() < 1e-4, "{k}: {found}");
    }
}
