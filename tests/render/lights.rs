//! Spots, disks, spheres and emissive objects: what they give a floor, what the eye sees of them, and what they
//! send through glass.

use crate::support::{
    T_LIMIT, camera_above, compile, floor, mean, mean_irradiance, over_seeds, render, scene,
};
use glam::Vec3;
use nephroid::light_path::PathClass;
use nephroid::pass1_light::{Block, Emission, trace_block, windows};
use nephroid::render::Control;
use nephroid::sampling::{SamplePoint, hash};
use nephroid::scene::{NoAssets, Scene};
use serde_json::{Value, json};
use std::f64::consts::PI;

/// Irradiance of the floor in a square of side `width` around (x, 0, 0), seen from `height`.
fn floor_irradiance(lights: &Value, x: f64, width: f64, height: f64, seed: u64) -> f64 {
    let value = scene(camera_above([x, 0.0, 0.0], height, width), json!([floor(4.0, 0.0)]), lights.clone());
    mean_irradiance(&render(&value, seed, 16, 8), PathClass::Direct)
}

/// T18: a disk of radius 1 and radiance 1, at height h above the point below its centre: π R² / (R² + h²).
#[test]
fn t18_a_disk_light_gives_the_known_irradiance() {
    for h in [0.5, 1.0, 2.0_f64] {
        let known = PI / (1.0 + h * h);
        let lights = json!([{ "type": "disk", "center": [0, h, 0], "radius": 1, "towards": [0, 0, 0], "radiance": [1, 1, 1] }]);
        let estimate = over_seeds(|seed| floor_irradiance(&lights, 0.0, 0.01, 0.4, seed));
        estimate.assert_is(known, 1e-4);
    }
}

/// T18: a sphere of radius 1 and radiance 1 at distance d: π (R/d)² cosθ, below it and beside it.
#[test]
fn t18_a_sphere_light_gives_the_known_irradiance() {
    let lights = json!([{ "type": "sphere", "center": [0, 2, 0], "radius": 1, "radiance": [1, 1, 1] }]);
    for (x, known) in [(0.0, PI / 4.0), (2.0, PI / 8.0 * 0.5_f64.sqrt())] {
        let estimate = over_seeds(|seed| floor_irradiance(&lights, x, 0.01, 0.9, seed));
        estimate.assert_is(known, 1e-4);
    }
}

/// F29: lights seen edge-on, from behind and from within give nothing, and nothing that is not finite; so does
/// one whose surface is the floor's.
#[test]
fn f29_new_lights_seen_edge_on_or_from_within_give_nothing() {
    for light in [
        json!({ "type": "disk", "center": [0, 0, 0], "radius": 0.5, "towards": [1, 0, 0], "radiance": [1, 1, 1] }),
        json!({ "type": "disk", "center": [0, 1, 0], "radius": 0.5, "towards": [0, 2, 0], "radiance": [1, 1, 1] }),
        json!({ "type": "sphere", "center": [-1, 0, 0], "radius": 2, "radiance": [1, 1, 1] }),
        json!({ "type": "spot", "position": [-1, 0, 0], "towards": [0, 0, 0], "outer": 90, "intensity": [1, 1, 1] }),
    ] {
        let irradiance = floor_irradiance(&json!([light]), -1.0, 0.1, 1.5, 1);
        assert_eq!(irradiance, 0.0, "{light}");
    }
    let mut shining = floor(4.0, 0.0);
    shining["emission"] = json!([2, 2, 2]);
    let value = scene(camera_above([0.0; 3], 1.0, 0.5), json!([shining]), json!([]));
    let render = render(&value, 1, 2, 8);
    assert_eq!(mean_irradiance(&render, PathClass::Direct), 0.0);
    assert!((mean(&render.layer(PathClass::Emitted)) - 2.0).abs() < 1e-6);
}

/// A small light that nearly touches the floor: the irradiance below it is that of a half space, π L.
#[test]
fn a_light_just_above_the_floor_is_finite_and_right() {
    for light in [
        json!({ "type": "disk", "center": [0, 0.001, 0], "radius": 1, "towards": [0, 0, 0], "radiance": [1, 1, 1] }),
        json!({ "type": "quad", "center": [0, 0.001, 0], "size": [2, 2], "towards": [0, 0, 0], "radiance": [1, 1, 1] }),
    ] {
        let lights = json!([light]);
        let estimate = over_seeds(|seed| floor_irradiance(&lights, 0.0, 1e-4, 0.0008, seed));
        estimate.assert_is(PI, 1e-4);
    }
}

/// Emission on objects gives what the light of that shape gives, on the front only.
#[test]
fn emissive_objects_light_like_lights_of_their_shape() {
    let corners = [[-1, 1, 1], [-1, 1, -1], [1, 1, -1], [1, 1, 1]];
    let polygon =
        json!({ "type": "polygon", "material": "floor", "emission": [1, 1, 1], "vertices": corners });
    let mesh = json!({ "type": "mesh", "material": "floor", "emission": [1, 1, 1], "positions": corners,
                       "triangles": [[0, 1, 2], [0, 2, 3]] });
    let sphere = json!({ "type": "sphere", "material": "floor", "emission": [1, 1, 1], "center": [0, 2, 0], "radius": 1 });
    let disk = json!({ "type": "disk", "material": "floor", "emission": [1, 1, 1], "center": [0, 1, 0], "normal": [0, -1, 0], "radius": 1 });
    let block = json!({ "type": "box", "material": "floor", "emission": [1, 1, 1], "center": [0, 1.5, 0], "size": [2, 1, 2] });
    let square = 1.740_839_503;
    for (object, known) in
        [(polygon, square), (mesh, square), (block, square), (sphere, PI / 4.0), (disk, PI / 2.0)]
    {
        let value =
            |object: &Value, camera: Value| scene(camera, json!([floor(4.0, 0.0), object]), json!([]));
        let below = value(&object, camera_above([0.0; 3], 0.5, 0.01));
        over_seeds(|seed| mean_irradiance(&render(&below, seed, 64, 8), PathClass::Direct))
            .assert_is(known, 1e-4);
        let above = value(&object, camera_above([0.0, 1.0, 0.0], 4.0, 0.1));
        let seen = mean(&render(&above, 1, 1, 8).layer(PathClass::Emitted));
        let outside = object["type"] == "sphere" || object["type"] == "box";
        assert!((seen - f64::from(u8::from(outside))).abs() < 1e-6, "{}: {seen}", object["type"]);
    }
}

/// What lets light through, clear or rough, is refused as a light: its light would begin on both sides.
#[test]
fn glass_that_emits_is_refused() {
    for roughness in [0.0, 0.3] {
        let ball = json!({ "type": "sphere", "material": "frosted", "center": [0, 2, 0], "radius": 1, "emission": [1, 1, 1] });
        let mut value = scene(camera_above([0.0; 3], 0.5, 0.01), json!([ball]), json!([]));
        value["materials"]["frosted"] = json!({ "type": "glass", "ior": 1.5, "roughness": roughness });
        let errors = Scene::from_json(&value.to_string(), &NoAssets).expect_err("refused");
        assert_eq!(errors.issues.len(), 1, "{errors}");
        assert_eq!(errors.issues[0].pointer, "/objects/0/emission");
    }
}

/// Glowing metal: the eye sees its own light and what it mirrors of the sky, 2 + 0.9 · 3; the floor has its light as from
/// any sphere, π (R/d)² L, and by photons what it mirrors of another lamp, like a mirror that does not glow.
#[test]
fn a_mirror_can_glow() {
    let mut ball = json!({ "type": "sphere", "material": "mirror", "center": [0, 2, 0], "radius": 1, "emission": [2, 2, 2] });
    let objects = |ball: &Value| json!([floor(4.0, 0.0), ball]);
    let mut alone = scene(camera_above([0.0, 3.0, 0.0], 4.0, 1e-3), json!([ball]), json!([]));
    alone["environment"] = json!({ "radiance": [3, 3, 3] });
    let seen = mean(&render(&alone, 1, 2, 8).layer(PathClass::Emitted));
    assert!((seen - 4.7).abs() < 1e-5, "{seen}");
    let lit = scene(camera_above([0.0; 3], 0.9, 0.01), objects(&ball), json!([]));
    over_seeds(|seed| mean_irradiance(&render(&lit, seed, 16, 8), PathClass::Direct))
        .assert_is(2.0 * PI / 4.0, 1e-4);
    // A point at (3, 2, 0) is mirrored by the ball onto the floor under it.
    let lamp = json!([{ "type": "point", "position": [3, 1.5, 0], "intensity": [1, 1, 1] }]);
    let camera = camera_above([2.0, 0.0, 0.0], 0.5, 0.2);
    let glowing = scene(camera.clone(), objects(&ball), lamp.clone());
    let caustic =
        |value: &Value| over_seeds(|seed| mean_irradiance(&render(value, seed, 2, 14), PathClass::Caustic));
    let with = caustic(&glowing);
    ball.as_object_mut().unwrap().remove("emission");
    let dark = caustic(&scene(camera, objects(&ball), lamp));
    assert!(dark.mean > 1e-3, "{dark:?}");
    with.assert_is(dark.mean, T_LIMIT * dark.standard_error / dark.mean);
}

/// `LE`: the eye sees a light's radiance on its front and black behind.
#[test]
fn lights_with_a_surface_are_seen_from_the_front() {
    for (towards, expected) in [(3, 5.0), (-3, 0.0)] {
        let lights = json!([{ "type": "disk", "center": [0, 1, 0], "radius": 0.5, "towards": [0, towards, 0], "radiance": [5, 5, 5] }]);
        let value = scene(camera_above([0.0, 1.0, 0.0], 1.0, 0.2), json!([]), lights);
        let seen = mean(&render(&value, 1, 1, 8).layer(PathClass::Emitted));
        assert!((seen - expected).abs() < 1e-5, "{seen}");
    }
    let lights = json!([{ "type": "sphere", "center": [0, 1, 0], "radius": 0.5, "radiance": [5, 5, 5] }]);
    let value = scene(camera_above([0.0, 1.0, 0.0], 2.0, 0.2), json!([]), lights);
    let seen = mean(&render(&value, 1, 1, 8).layer(PathClass::Emitted));
    assert!((seen - 5.0).abs() < 1e-5, "{seen}");
}

/// F32: the spot's smooth edge on the floor: intensity on the axis, at half of the way of the cosine (1/2), and
/// beyond the cone.
#[test]
fn f32_a_spot_falls_from_the_inner_to_the_outer_cone() {
    let lights = json!([{ "type": "spot", "position": [0, 1, 0], "direction": [0, -3, 0], "inner": 40, "outer": 80,
                          "intensity": [2, 2, 2] }]);
    let cosine = |angle: f64| angle.to_radians().cos();
    let half = 0.5 * (cosine(20.0) + cosine(40.0));
    let tangent = (1.0 / (half * half) - 1.0).sqrt();
    for (x, intensity) in [(0.0, 2.0), (20.0_f64.to_radians().tan() - 0.01, 2.0), (tangent, 1.0), (0.85, 0.0)]
    {
        let width = 0.002;
        let irradiance = floor_irradiance(&lights, x, width, 0.5, 1);
        let expected = intensity * (1.0 + x * x).powf(-1.5);
        assert!((irradiance - expected).abs() < 1e-3, "{x}: {irradiance}, expected {expected}");
    }
}

/// F32: a cone of 180° is a hemisphere; one of 0°, and an inner one wider than the outer, are refused.
#[test]
fn f32_spot_cones_of_0_and_180_degrees() {
    let spot = |outer: f64, inner: f64| {
        let lights = json!([{ "type": "spot", "position": [0, 1, 0], "towards": [0, 0, 0], "outer": outer, "inner": inner,
                              "intensity": [1, 1, 1] }]);
        scene(camera_above([0.5, 0.0, 0.0], 0.5, 0.01), json!([floor(2.0, 0.0)]), lights)
    };
    let hemisphere = mean_irradiance(&render(&spot(180.0, 180.0), 1, 4, 8), PathClass::Direct);
    assert!((hemisphere - 0.715_541_752_8).abs() < 1e-4, "{hemisphere}");
    for (outer, inner) in [(0.0, 0.0), (181.0, 10.0), (40.0, 50.0), (1e-5, 0.0)] {
        let errors = Scene::from_json(&spot(outer, inner).to_string(), &NoAssets).expect_err("refused");
        assert_eq!(errors.issues.len(), 1, "{errors}");
    }
}

/// Every kind of light, near enough to the ball below for its size to matter.
fn every_light() -> Vec<(&'static str, Value, Value)> {
    let lit = |light: Value| (json!([]), json!([light]));
    let shining = |mut object: Value| {
        object["emission"] = json!([9, 9, 9]);
        object["material"] = json!("floor");
        (json!([object]), json!([]))
    };
    let quad = [[0.1, 2.0, -0.2], [0.5, 2.0, -0.2], [0.5, 2.0, 0.2], [0.1, 2.0, 0.2]];
    [
        ("spot", lit(json!({ "type": "spot", "position": [0.3, 2, 0], "towards": [0.1, 0.6, 0], "outer": 30, "inner": 12, "intensity": [2, 2, 2] }))),
        ("wide spot", lit(json!({ "type": "spot", "position": [0.3, 2, 0], "towards": [0, 0, 0], "outer": 120, "intensity": [2, 2, 2] }))),
        ("disk", lit(json!({ "type": "disk", "center": [0.3, 2, 0], "radius": 0.25, "towards": [0, 0, 0], "radiance": [9, 9, 9] }))),
        ("sphere", lit(json!({ "type": "sphere", "center": [0.3, 2, 0], "radius": 0.25, "radiance": [9, 9, 9] }))),
        ("near sphere", lit(json!({ "type": "sphere", "center": [0.2, 1.5, 0], "radius": 0.5, "radiance": [3, 3, 3] }))),
        ("emissive polygon", shining(json!({ "type": "polygon", "vertices": quad }))),
        ("emissive mesh", shining(json!({ "type": "mesh", "positions": quad, "triangles": [[0, 1, 2], [0, 2, 3]] }))),
        ("emissive sphere", shining(json!({ "type": "sphere", "center": [0.3, 2, 0], "radius": 0.25 }))),
        ("moving sphere", shining(json!({ "type": "sphere", "center": [0.1, 2, 0], "radius": 0.25, "velocity": [0.4, 0, 0] }))),
        ("turning polygon", shining(json!({ "type": "polygon", "vertices": quad, "motion": { "rotate": { "axis": [1, 0, 0], "angle": 30 } } }))),
    ]
    .map(|(name, (objects, lights))| (name, objects, lights))
    .to_vec()
}

/// The floor, the light's object and, if wanted, a ball of index 1 between them.
fn beneath(objects: &Value, lights: &Value, ball: Option<&str>) -> Value {
    // Below all lights; much of what it sees lies in the ball's shadow.
    let camera = json!({ "type": "perspective", "eye": [1.8, 1.1, 0.4], "target": [-0.1, 0, 0], "up": [0, 1, 0], "fov": 20,
                         "shutter": [0, 1] });
    let mut all = vec![floor(2.0, 0.0)];
    all.extend(
        ball.map(|m| json!({ "type": "sphere", "material": m, "center": [0, 0.6, 0], "radius": 0.3 })),
    );
    all.extend(objects.as_array().unwrap().iter().cloned());
    scene(camera, json!(all), lights.clone())
}

/// T25: whatever the light, a ball of index 1 is not there: photons bring exactly what it blocks for shadow rays.
#[test]
fn t25_glass_of_index_one_is_not_there_for_any_light() {
    for (name, objects, lights) in every_light() {
        let with = beneath(&objects, &lights, Some("air"));
        let without = beneath(&objects, &lights, None);
        let expected = over_seeds(|seed| mean(&render(&without, seed, 16, 8).image()));
        // As it was gathered: smoothing so small a picture blurs it by half a percent.
        let found = over_seeds(|seed| {
            let [a, b] = render(&with, seed, 4, 13).raw_halves();
            0.5 * (mean(&a) + mean(&b))
        });
        let error = T_LIMIT * found.standard_error.hypot(expected.standard_error);
        assert!(error < 0.05 * expected.mean, "{name}: too noisy: {found:?} {expected:?}");
        // The kernel's blur carries light over the shadow's edge in both directions alike.
        let difference = (found.mean - expected.mean).abs();
        assert!(difference <= error + 1e-3 * expected.mean, "{name}: {found:?}, expected {expected:?}");
        let caustic = mean(&render(&with, 1, 4, 13).layer(PathClass::Caustic));
        assert!(
            caustic > 0.1 * expected.mean,
            "{name}: the shadow is in the picture: {caustic} of {expected:?}"
        );
    }
}

/// T42: every watt is accounted for, whatever the light.
#[test]
fn t42_energy_of_every_light_is_accounted_for() {
    for (name, objects, lights) in every_light() {
        let scene = compile(&beneath(&objects, &lights, Some("glass")));
        for window in windows(&scene) {
            let block = Block { first: 0, count: 1 << 13, seed: 3 };
            let (_, tally) = trace_block(&scene, &window, block, &Control::new()).unwrap();
            let relative = tally.energy.imbalance().abs() / tally.energy.emitted;
            assert!(relative.max_element() < 1e-12, "{name}: {relative}");
            assert!(tally.energy.stored.min_element() > 0.0, "{name}");
        }
    }
}

/// Flux into `bins` of equal expected flux along one coordinate of the photons' directions, from independent
/// points; 16 384 photons of a light inside a glass ball, so that all directions are drawn.
fn chi_square(light: &Value, coordinate: impl Fn(&Scene, Vec3) -> f64) -> f64 {
    const BINS: usize = 32;
    const PHOTONS: u32 = 16_384;
    let around = json!({ "type": "sphere", "material": "glass", "center": [0, 0, 0], "radius": 9 });
    let scene = compile(&scene(camera_above([0.0, 20.0, 0.0], 1.0, 1.0), json!([around]), json!([light])));
    let window = windows(&scene).swap_remove(0);
    let emission = Emission::new(&scene, &window);
    let mut counts = [0.0_f64; BINS];
    let mut power = None;
    for i in 0..PHOTONS {
        let Some(photon) = emission.sample(SamplePoint::new(hash(7, u64::from(i)), 0), 0.0) else { continue };
        // Photons of one power: their number is their flux.
        let first = *power.get_or_insert(photon.power);
        assert!((photon.power / first - 1.0).abs().max_element() < 1e-5);
        let u = coordinate(&scene, photon.ray.direction);
        assert!((-1e-6..=1.0 + 1e-6).contains(&u), "{u}");
        counts[((u * BINS as f64) as usize).min(BINS - 1)] += 1.0;
    }
    let expected = f64::from(PHOTONS) / BINS as f64;
    counts.iter().map(|n| (n - expected).powi(2) / expected).sum()
}

/// T20: photons leave a point uniformly, a spot uniformly in its cone, a surface by the cosine. The 99 % quantile
/// of chi-square with 31 degrees of freedom is 52.2; over 7 tests the level of 0.01 each needs 58.6.
#[test]
fn t20_photons_leave_each_light_in_the_right_directions() {
    let point = json!({ "type": "point", "position": [0, 0, 0], "intensity": [1, 1, 1] });
    let spot = json!({ "type": "spot", "position": [0, 0, 0], "direction": [0, -1, 0], "outer": 50, "inner": 50, "intensity": [1, 1, 1] });
    let quad = json!({ "type": "quad", "center": [0, 0, 0], "size": [1, 2], "towards": [0, -1, 0], "radiance": [1, 1, 1] });
    let disk = json!({ "type": "disk", "center": [0, 0, 0], "radius": 1, "towards": [0, -1, 0], "radiance": [1, 1, 1] });
    let sphere = json!({ "type": "sphere", "center": [0, 0, 0], "radius": 1, "radiance": [1, 1, 1] });
    let azimuth = |_: &Scene, d: Vec3| f64::from(d.z).atan2(f64::from(d.x)) / (2.0 * PI) + 0.5;
    let height = |_: &Scene, d: Vec3| 0.5 - 0.5 * f64::from(d.y);
    let in_cone = |_: &Scene, d: Vec3| (1.0 + f64::from(d.y)) / (1.0 - 25.0_f64.to_radians().cos());
    let by_cosine = |_: &Scene, d: Vec3| 1.0 - f64::from(d.y * d.y);
    let found = [
        chi_square(&point, height),
        chi_square(&point, azimuth),
        chi_square(&spot, in_cone),
        chi_square(&spot, azimuth),
        chi_square(&quad, by_cosine),
        chi_square(&disk, by_cosine),
        chi_square(&sphere, height),
    ];
    assert!(found.iter().all(|x| *x < 58.6), "{found:?}");
}

/// The whole flux of a sphere light, 4 π² R² L, and of a disk, π² R² L, leaves for the caster around it.
#[test]
fn t20_the_flux_of_each_light_is_the_known_one() {
    let around = json!({ "type": "sphere", "material": "glass", "center": [0, 0, 0], "radius": 9 });
    for (light, flux) in [
        (
            json!({ "type": "sphere", "center": [0, 0, 0], "radius": 0.5, "radiance": [3, 3, 3] }),
            3.0 * PI * PI,
        ),
        (
            json!({ "type": "disk", "center": [0, 0, 0], "radius": 0.5, "towards": [1, 1, 1], "radiance": [4, 4, 4] }),
            PI * PI,
        ),
        (
            json!({ "type": "spot", "position": [0, 0, 0], "towards": [1, 1, 1], "outer": 120, "inner": 120, "intensity": [1, 1, 1] }),
            PI,
        ),
    ] {
        let scene =
            compile(&scene(camera_above([0.0, 20.0, 0.0], 1.0, 1.0), json!([around]), json!([light])));
        let block = Block { first: 0, count: 1 << 10, seed: 1 };
        let (_, tally) = trace_block(&scene, &windows(&scene)[0], block, &Control::new()).unwrap();
        assert!((tally.energy.emitted.y / flux - 1.0).abs() < 1e-5, "{light}: {}", tally.energy.emitted.y);
    }
}

/// A long lamp: a cylinder of radius R at distance d from a surface that faces it gives L R / d (φ + sin φ cos φ) 2, where
/// tan φ is its half length over d (π L R / d if it is endless). Its own width matters at its ends only: R² / a².
#[test]
fn t18_a_shining_cylinder_gives_the_known_irradiance() {
    let lamp = json!({ "type": "cylinder", "material": "black", "emission": [1, 1, 1],
                       "from": [-3, 1, 0], "to": [3, 1, 0], "radius": 0.05 });
    let mut value = scene(camera_above([0.0; 3], 0.5, 0.01), json!([floor(4.0, 0.0), lamp]), json!([]));
    value["materials"]["black"] = json!({ "type": "diffuse", "albedo": [0, 0, 0] });
    let phi = 3.0_f64.atan();
    let known = 0.05 * 2.0 * (phi + phi.sin() * phi.cos());
    over_seeds(|seed| mean_irradiance(&render(&value, seed, 64, 8), PathClass::Direct))
        .assert_is(known, 3e-3);
}

/// An instance that shines is the light that its original would be in its place, in both passes.
#[test]
fn an_instance_can_shine_like_its_original_in_its_place() {
    for shape in [
        json!({ "type": "sphere", "center": [0, 0, 0], "radius": 0.2 }),
        json!({ "type": "box", "center": [0, 0, 0], "size": [0.3, 0.2, 0.4] }),
        json!({ "type": "cylinder", "from": [0, -0.1, 0], "to": [0, 0.2, 0], "radius": 0.1 }),
    ] {
        let total = |instanced: bool, seed: u64| {
            let mut lamp = shape.clone();
            lamp["material"] = json!("floor");
            let ball = json!({ "type": "sphere", "material": "glass", "center": [0, 0.5, 0], "radius": 0.3 });
            let objects = if instanced {
                // The original lies in the dark under the floor.
                lamp["name"] = json!("lamp");
                let placed = json!({ "type": "instance", "of": "lamp", "translate": [0, 5, 0], "material": "floor",
                                     "emission": [3, 3, 3] });
                for key in ["center", "from", "to"] {
                    if lamp[key].is_array() {
                        lamp[key][1] = json!(lamp[key][1].as_f64().unwrap_or(0.0) - 3.0);
                    }
                }
                json!([floor(4.0, 0.0), ball, lamp, placed])
            } else {
                lamp["emission"] = json!([3, 3, 3]);
                for key in ["center", "from", "to"] {
                    if lamp[key].is_array() {
                        lamp[key][1] = json!(lamp[key][1].as_f64().unwrap_or(0.0) + 2.0);
                    }
                }
                json!([floor(4.0, 0.0), ball, lamp])
            };
            let camera = json!({ "type": "perspective", "eye": [0, 1, 3], "target": [0, 0, 0], "fov": 30 });
            render(&scene(camera, objects, json!([])), seed, 2, 10).image()
        };
        for (a, b) in total(true, 1).pixels.iter().zip(&total(false, 1).pixels) {
            // The same numbers but for the rounding of the moved coordinates, and of what that decides at an edge.
            assert!((a[1] - b[1]).abs() < 0.02 * (1.0 + b[1]), "{shape}: {a:?} {b:?}");
        }
    }
}
