//! Light from a picture of all directions: seen directly, on surfaces, through glass.

use crate::support::{
    Estimate, T_LIMIT, camera_above, floor, mean_irradiance, over_seeds, render_scene, scene,
};
use glam::{DVec3, Vec3};
use nephroid::image_io::{LinearImage, encode_exr};
use nephroid::light_path::PathClass;
use nephroid::pass1_light::{Block, trace_block, windows};
use nephroid::render::Control;
use nephroid::scene::{Environment, IssueCode, MemoryAssets, Scene, SceneErrors};
use serde_json::{Value, json};
use std::f64::consts::PI;

/// A picture of grey radiances.
fn sky(width: u32, height: u32, radiance: impl Fn(u32, u32) -> f32) -> MemoryAssets {
    let pixel = |i: u32| [radiance(i % width, i / width); 3];
    let image = LinearImage { width, height, pixels: (0..width * height).map(pixel).collect() };
    MemoryAssets { files: [("sky".to_owned(), encode_exr(&image).unwrap())].into() }
}

fn under_sky(camera: Value, objects: Value, environment: Value) -> Value {
    let mut value = scene(camera, objects, json!([]));
    value["environment"] = environment;
    value
}

fn compile(value: &Value, assets: &MemoryAssets) -> Scene {
    Scene::from_json(&value.to_string(), assets).unwrap_or_else(|e| panic!("{e}"))
}

fn direct(value: &Value, assets: &MemoryAssets) -> Estimate {
    over_seeds(|seed| mean_irradiance(&render_scene(compile(value, assets), seed, 2, 8), PathClass::Direct))
}

fn open_floor(environment: Value) -> Value {
    under_sky(camera_above([0.0; 3], 1.0, 0.5), json!([floor(4.0, 0.0)]), environment)
}

#[test]
fn a_picture_of_one_radiance_gives_pi_times_it() {
    let value = open_floor(json!({ "image": "sky", "scale": 3 }));
    direct(&value, &sky(8, 4, |_, _| 2.0)).assert_is(6.0 * PI, 0.0);
}

/// E = 2π ∫ L(θ) cos θ sin θ dθ over the upper half, with L linear between the centres of the rows.
#[test]
fn a_gradient_gives_what_quadrature_gives() {
    let rows = 16;
    let value = |row: f64| 1.0 + (15.0 - row) * (15.0 - row);
    let radiance = |polar: f64| {
        let place = polar / PI * f64::from(rows) - 0.5;
        let low = place.floor().clamp(0.0, 14.0);
        let weight = (place - low).clamp(0.0, 1.0);
        value(low) * (1.0 - weight) + value(low + 1.0) * weight
    };
    let steps = 100_000;
    let step = 0.5 * PI / f64::from(steps);
    let integrand = |i: i32| {
        let polar = (f64::from(i) + 0.5) * step;
        radiance(polar) * polar.cos() * polar.sin() * step
    };
    let expected = 2.0 * PI * (0..steps).map(integrand).sum::<f64>();
    let assets = sky(32, rows, |_, y| value(f64::from(y)) as f32);
    direct(&open_floor(json!({ "image": "sky" })), &assets).assert_is(expected, 0.0);
}

/// The right half of the picture, on the side of +x, gives light. A wall that faces +x sees all of it, none of it
/// after half a turn, and half of it after a quarter.
#[test]
fn a_turned_sky_lights_what_faces_it() {
    let wall = json!({ "name": "floor", "type": "polygon", "material": "floor",
        "vertices": [[0, -1, 1], [0, -1, -1], [0, 1, -1], [0, 1, 1]] });
    let camera = json!({ "type": "perspective", "eye": [2, 0, 0], "target": [0, 0, 0], "fov": 20 });
    let assets = sky(64, 32, |x, _| if x < 32 { 0.0 } else { 1.0 });
    for (degrees, share) in [(0, 1.0), (90, 0.5), (-90, 0.5), (180, 0.0)] {
        let value = under_sky(camera.clone(), json!([wall]), json!({ "image": "sky", "rotate": degrees }));
        let estimate = direct(&value, &assets);
        if share > 0.0 {
            // The border's width of a pixel, 1/32 of π, dims what is seen at grazing angles by less than 0.2 %.
            estimate.assert_is(share * PI, 2e-3);
        } else {
            assert!(estimate.mean < 0.005, "{estimate:?}");
        }
    }
}

#[test]
fn behind_everything_the_picture_is_seen() {
    let camera = json!({ "type": "perspective", "eye": [0, 0, 0], "target": [1, 0, 0], "fov": 5 });
    let far = json!({ "type": "sphere", "center": [0, -50, 0], "radius": 1, "material": "floor" });
    let value = under_sky(camera, json!([far]), json!({ "image": "sky", "scale": 0.5 }));
    // +x is three quarters across; the view of 5° lies within 8 of 128 columns.
    let assets = sky(128, 64, |x, _| if (92..100).contains(&x) { 3.0 } else { 0.0 });
    let render = render_scene(compile(&value, &assets), 1, 1, 8);
    for pixel in render.image().pixels {
        assert!((pixel[1] - 1.5).abs() < 1e-5, "{pixel:?}");
    }
}

/// Flux that photons bring to the floor within 0.6 m of a point, and where its middle is.
fn landed(scene: &Scene, near: Vec3, seed: u64) -> [f64; 3] {
    let window = windows(scene).swap_remove(0);
    let block = Block { first: 0, count: 1 << 15, seed };
    let (photons, _) = trace_block(scene, &window, block, &Control::new()).unwrap();
    let mut sums = DVec3::ZERO;
    for photon in photons.iter().filter(|photon| photon.position.distance(near) < 0.6) {
        let power = f64::from(photon.power.y);
        sums += DVec3::new(power, power * f64::from(photon.position.x), power * f64::from(photon.position.z));
    }
    [sums.x, sums.y / sums.x, sums.z / sums.x]
}

/// A sun of one pixel, of radiance such that it gives an irradiance of 1, throws the same light through a glass ball as
/// a directional light from the pixel's middle.
#[test]
fn a_sun_of_one_pixel_throws_the_caustic_of_a_directional_light() {
    let (width, height, column, row) = (256, 128, 200, 20);
    let polar = PI * (f64::from(row) + 0.5) / f64::from(height);
    let azimuth = 2.0 * PI * ((f64::from(column) + 0.5) / f64::from(width) - 0.5);
    // Interpolation spreads the pixel's light over its neighbours and keeps its sum.
    let solid_angle = 2.0 * PI / f64::from(width) * PI / f64::from(height) * polar.sin();
    let assets =
        sky(width, height, |x, y| if (x, y) == (column, row) { (1.0 / solid_angle) as f32 } else { 0.0 });
    let ball = json!({ "type": "sphere", "material": "glass", "center": [0, 0.5, 0], "radius": 0.3 });
    for degrees in [0.0, 120.0] {
        let azimuth = azimuth - f64::to_radians(degrees);
        let to_sun = [polar.sin() * azimuth.sin(), polar.cos(), -polar.sin() * azimuth.cos()];
        let near = Vec3::from(to_sun.map(|x| (-0.5 * x / to_sun[1]) as f32)) + Vec3::Y * 0.5;
        let camera = || camera_above([0.0; 3], 1.5, 1.0);
        let objects = || json!([floor(4.0, 0.0), ball]);
        let through = under_sky(camera(), objects(), json!({ "image": "sky", "rotate": degrees }));
        let light =
            json!([{ "type": "directional", "direction": to_sun.map(|x| -x), "irradiance": [1, 1, 1] }]);
        let (sky, sun) = (compile(&through, &assets), compile(&scene(camera(), objects(), light), &assets));
        for quantity in 0..3 {
            let of_sky = over_seeds(|seed| landed(&sky, near, seed)[quantity]);
            let of_sun = over_seeds(|seed| landed(&sun, near, seed)[quantity]);
            let error = of_sky.standard_error.hypot(of_sun.standard_error);
            // 1.4 % of the flux, 1 % of the ball.
            assert!(T_LIMIT * error < 0.003, "{of_sky:?} {of_sun:?}");
            // The pixel is 0.025 wide: by the curvature of the ball's focus it may change its middle by some 1e-3.
            let allowed = T_LIMIT * error + if quantity == 0 { 0.0 } else { 1e-3 };
            assert!((of_sky.mean - of_sun.mean).abs() < allowed, "{quantity}: {of_sky:?} {of_sun:?}");
        }
    }
}

fn refused(bytes: Vec<u8>) -> SceneErrors {
    let assets = MemoryAssets { files: [("sky".to_owned(), bytes)].into() };
    Scene::from_json(&open_floor(json!({ "image": "sky" })).to_string(), &assets).expect_err("a bad sky")
}

fn hdr(width: usize, height: usize, value: f32) -> Vec<u8> {
    let mut bytes = Vec::new();
    let pixels = vec![image::Rgb([value; 3]); width * height];
    image::codecs::hdr::HdrEncoder::new(&mut bytes).encode(&pixels, width, height).unwrap();
    bytes
}

#[test]
fn a_radiance_file_is_read_with_its_exposure() {
    for (from, to, expected) in [
        ("#?RADIANCE", "#?RADIANCE", 0.5),
        ("#?RADIANCE", "#?RGBE", 0.5),
        ("FORMAT=", "EXPOSURE=4\nFORMAT=", 0.125),
    ] {
        let file = hdr(16, 8, 0.5);
        let end = file.windows(2).position(|w| w == b"\n\n").unwrap();
        let header = String::from_utf8(file[..end].to_vec()).unwrap();
        assert!(header.contains(from), "{header}");
        let bytes = [header.replace(from, to).as_bytes(), &file[end..]].concat();
        let assets = MemoryAssets { files: [("sky".to_owned(), bytes)].into() };
        let scene = compile(&open_floor(json!({ "image": "sky" })), &assets);
        let radiance = scene.environment.radiance(glam::Vec3::Y);
        // Eight bits of mantissa.
        assert!((radiance.y - expected).abs() < 0.01 * expected, "{to}: {radiance}");
        assert!(matches!(scene.environment, Environment::Image(_)) && scene.image_bytes > 16 * 8 * 12);
    }
}

#[test]
fn a_bad_sky_is_an_error_at_the_field_that_names_it() {
    let image = |value: f32| {
        let image = LinearImage { width: 4, height: 2, pixels: vec![[value; 3]; 8] };
        encode_exr(&image).unwrap()
    };
    let huge = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 60000\n".to_vec();
    let whole = hdr(16, 8, 0.5);
    for (bytes, code) in [
        (huge, IssueCode::TooLarge),
        (whole[..whole.len() / 2].to_vec(), IssueCode::AssetInvalid),
        (image(1.0)[..100].to_vec(), IssueCode::AssetInvalid),
        (image(1e13), IssueCode::AssetInvalid),
        (huge_exr(), IssueCode::TooLarge),
        (b"\x89PNG\r\n\x1a\n".to_vec(), IssueCode::AssetInvalid),
    ] {
        let errors = refused(bytes);
        let issue = &errors.issues[0];
        assert_eq!((issue.pointer.as_str(), issue.code), ("/environment/image", code), "{errors}");
    }
}

/// A file of 4 × 2 pixels whose header says 16 384 × 16 384.
fn huge_exr() -> Vec<u8> {
    let mut bytes = encode_exr(&LinearImage { width: 4, height: 2, pixels: vec![[1.0; 3]; 8] }).unwrap();
    for window in [&b"dataWindow\0box2i\0"[..], b"displayWindow\0box2i\0"] {
        let at = bytes.windows(window.len()).position(|w| w == window).unwrap() + window.len();
        // After the size of the value, 16, come the first and the last column and row.
        for last in [at + 12..at + 16, at + 16..at + 20] {
            bytes[last].copy_from_slice(&16_383_i32.to_le_bytes());
        }
    }
    bytes
}
