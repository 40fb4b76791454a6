//! Metal and absorbing glass.

use crate::support::{camera_above, compile, floor, mean, mean_irradiance, over_seeds, render, scene};
use glam::{DVec3, Vec3};
use nephroid::light_path::PathClass;
use nephroid::optics::{fresnel_conductor, metal_reflectance, refract};
use nephroid::pass1_light::{Block, trace_block, windows};
use nephroid::render::Control;
use nephroid::scene::{Conductor, NoAssets, Scene};
use serde_json::{Value, json};

/// T11: n = 0.2, k = 3.9 at normal incidence: ((n-1)² + k²) / ((n+1)² + k²). At an angle against Fresnel's
/// equations in complex numbers.
#[test]
fn t11_a_conductor_reflects_as_fresnel_says() {
    assert!((fresnel_conductor(1.0, 0.2, 3.9) - 0.951_952).abs() < 1e-6);
    // Square of the modulus of (a - b) / (a + b) for complex a and b.
    let reflected = |a: (f64, f64), b: (f64, f64)| {
        ((a.0 - b.0).powi(2) + (a.1 - b.1).powi(2)) / ((a.0 + b.0).powi(2) + (a.1 + b.1).powi(2))
    };
    let multiply = |a: (f64, f64), b: (f64, f64)| (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0);
    for (n, k) in [(0.2, 3.9), (1.4, 1.6), (2.5, 0.0)] {
        for degrees in [10.0_f64, 45.0, 70.0, 85.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let index = (n, k);
            let square = multiply(index, index);
            // The square root of (n + ik)² - sin².
            let (re, im) = (square.0 - sin * sin, square.1);
            let length = re.hypot(im);
            let root = ((0.5 * (length + re)).sqrt(), (0.5 * (length - re)).max(0.0).sqrt());
            let s = reflected((cos, 0.0), root);
            let p = reflected((square.0 * cos, square.1 * cos), root);
            let found = f64::from(fresnel_conductor(cos as f32, n as f32, k as f32));
            assert!(
                (found - 0.5 * (s + p)).abs() < 2e-6,
                "{n} {k} {degrees}: {found}, expected {}",
                0.5 * (s + p)
            );
        }
    }
    for conductor in [Conductor::Normal(Vec3::splat(0.8)), Conductor::Complex { n: Vec3::ONE, k: Vec3::ZERO }]
    {
        for cosine in [0.0, 1e-20, 1e-6, 0.5, 1.0] {
            let r = metal_reflectance(cosine, &conductor);
            assert!(r.min_element() >= 0.0 && r.max_element() <= 1.0, "{conductor:?} {cosine}: {r}");
        }
    }
}

/// A metal's caustic is the light's times the reflectance, per channel; what is missing is absorbed.
#[test]
fn t11_a_metal_mirror_gives_its_colour_to_the_caustic() {
    let mirror = json!({ "type": "polygon", "material": "gold", "vertices": [[-1, 1, 1], [-1, 1, -1], [1, 1, -1], [1, 1, 1]] });
    let sun = json!([{ "type": "directional", "direction": [0, 1, 0], "irradiance": [1, 1, 1] }]);
    // Light from below, thrown back onto the ceiling's upper side.
    let ceiling = json!({ "type": "polygon", "material": "floor", "name": "shelf", "vertices": [[2, 0, 1], [3, 0, 1], [3, 0, -1], [2, 0, -1]] });
    let mut value = scene(camera_above([0.0; 3], 2.0, 1.0), json!([mirror, ceiling]), sun);
    value["materials"]["gold"] = json!({ "type": "metal", "n": [0.2, 1.4, 2.5], "k": [3.9, 1.6, 0] });
    let scene = compile(&value);
    let block = Block { first: 0, count: 1 << 8, seed: 1 };
    let (_, tally) = trace_block(&scene, &windows(&scene)[0], block, &Control::new()).unwrap();
    let share = tally.energy.escaped / (tally.energy.emitted - tally.energy.missed);
    for (channel, (n, k)) in [(0.2_f64, 3.9_f64), (1.4, 1.6), (2.5, 0.0)].into_iter().enumerate() {
        let known = ((n - 1.0).powi(2) + k * k) / ((n + 1.0).powi(2) + k * k);
        assert!((share[channel] - known).abs() < 1e-6, "{channel}: {} {known}", share[channel]);
    }
    assert!(tally.energy.imbalance().abs().max_element() < 1e-9 * tally.energy.emitted.max_element());
}

/// A metal is given by `f0` or by `n` and `k`, not by both or by halves.
#[test]
fn metals_that_are_not_one_thing_are_refused() {
    for (metal, pointer) in [
        (json!({ "type": "metal" }), "/materials/m/f0"),
        (json!({ "type": "metal", "n": [1, 1, 1] }), "/materials/m/k"),
        (json!({ "type": "metal", "k": [1, 1, 1] }), "/materials/m/n"),
        (json!({ "type": "metal", "f0": [1, 1, 1], "k": [1, 1, 1] }), "/materials/m/f0"),
        (json!({ "type": "metal", "f0": [1, 1, 2] }), "/materials/m/f0/2"),
        (json!({ "type": "glass", "ior": 1.5, "absorption": [-1, 0, 0] }), "/materials/m/absorption/0"),
    ] {
        let mut value = scene(camera_above([0.0; 3], 2.0, 1.0), json!([]), json!([]));
        value["materials"]["m"] = metal;
        let errors = Scene::from_json(&value.to_string(), &NoAssets).expect_err(pointer);
        assert_eq!(errors.issues.len(), 1, "{errors}");
        assert_eq!(errors.issues[0].pointer, pointer);
    }
}

/// A slab of glass from `bottom` up to `bottom + thickness`, wide enough that nothing comes round its rim.
fn slab(bottom: f64, thickness: f64) -> [Value; 2] {
    let face = |y: f64, z: f64| {
        json!({ "type": "polygon", "material": "slab",
                "vertices": [[-6, y, z], [6, y, z], [6, y, -z], [-6, y, -z]] })
    };
    [face(bottom + thickness, 6.0), face(bottom, -6.0)]
}

/// Irradiance of the middle of the floor below a slab, relative to that without it, from the photons themselves.
fn transmitted(slab: [Value; 2], absorption: f64, degrees: f64, seed: u64) -> f64 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let sun = json!([{ "type": "directional", "direction": [sin, -cos, 0], "irradiance": [1, 1, 1] }]);
    let [top, bottom] = slab;
    let mut value = scene(camera_above([0.0; 3], 2.0, 1.0), json!([top, bottom, floor(2.0, 0.0)]), sun);
    value["materials"]["slab"] =
        json!({ "type": "glass", "ior": 1.5, "absorption": [absorption, absorption, absorption] });
    let scene = compile(&value);
    let block = Block { first: 0, count: 1 << 16, seed };
    let (photons, _) = trace_block(&scene, &windows(&scene)[0], block, &Control::new()).unwrap();
    let flux: f64 = photons
        .iter()
        .filter(|p| p.position.y.abs() < 1e-3 && p.position.x.abs().max(p.position.z.abs()) < 1.0)
        .map(|p| f64::from(p.power.y))
        .sum();
    flux / (4.0 * cos)
}

/// T13: unpolarised light through a slab at an angle: (1 - R) / (1 + R). (Keeping the two polarisations apart
/// gives 0.907344, 0.848128 and 0.618149: the renderer's light is unpolarised at each surface.)
#[test]
fn t13_a_slab_transmits_light_at_an_angle() {
    for (degrees, known) in [(45.0, 0.904_327), (60.0, 0.836_232), (75.0, 0.596_092)] {
        over_seeds(|seed| transmitted(slab(0.2, 0.1), 0.0, degrees, seed)).assert_is(known, 1e-4);
    }
}

/// T14: a slab of R = 0.04, absorption 0.1 /m and thickness 2: (1 - R)² A / (1 - R² A²), A = e^(-0.2).
const ABSORBING_SLAB: f64 = 0.755_352_387;

#[test]
fn t14_photons_are_absorbed_on_their_way_through_glass() {
    over_seeds(|seed| transmitted(slab(1.0, 2.0), 0.1, 0.0, seed)).assert_is(ABSORBING_SLAB, 1e-4);
}

/// T14: the eye looks down through the slab at a shining floor, which loses the same share.
#[test]
fn t14_what_the_eye_sees_through_glass_is_absorbed() {
    let mut shining = floor(6.0, 0.0);
    shining["emission"] = json!([1, 1, 1]);
    let [top, bottom] = slab(1.0, 2.0);
    let mut value = scene(camera_above([0.0; 3], 4.0, 1e-3), json!([shining, top, bottom]), json!([]));
    value["materials"]["slab"] = json!({ "type": "glass", "ior": 1.5, "absorption": [0.1, 0.1, 0.1] });
    over_seeds(|seed| mean(&render(&value, seed, 8, 8).layer(PathClass::Emitted)))
        .assert_is(ABSORBING_SLAB, 1e-4);
}

/// A floor under water of index 1 that absorbs: a single sheet of surface above it, and the floor itself the end.
/// The caustic falls by e^(-a d) on the way down, and by as much on the way up.
#[test]
fn t14_an_absorbing_pool_dims_both_ways() {
    let water = json!({ "type": "polygon", "material": "slab", "vertices": [[-2, 1, 2], [2, 1, 2], [2, 1, -2], [-2, 1, -2]] });
    let sun = json!([{ "type": "directional", "direction": [0, -1, 0], "irradiance": [1, 1, 1] }]);
    let mut value = scene(camera_above([0.0; 3], 50.0, 0.2), json!([floor(2.0, 0.0), water]), sun);
    value["materials"]["slab"] = json!({ "type": "glass", "ior": 1, "absorption": [0.5, 0.5, 0.5] });
    let estimate = over_seeds(|seed| mean_irradiance(&render(&value, seed, 2, 14), PathClass::Caustic));
    estimate.assert_is((-1.0_f64).exp(), 1e-3);
}

/// A lamp under that water, at height 1/2, lights the floor through half a metre of it; the eye loses a metre's.
#[test]
fn t14_a_lamp_under_water_is_dimmed_on_its_way_to_the_floor() {
    let water = json!({ "type": "polygon", "material": "slab", "vertices": [[-2, 1, 2], [2, 1, 2], [2, 1, -2], [-2, 1, -2]] });
    let lamp = json!([{ "type": "point", "position": [0, 0.5, 0], "intensity": [1, 1, 1] }]);
    let mut value = scene(camera_above([0.0; 3], 50.0, 0.01), json!([floor(2.0, 0.0), water]), lamp);
    value["materials"]["slab"] = json!({ "type": "glass", "ior": 1, "absorption": [0.8, 0.8, 0.8] });
    let irradiance = mean_irradiance(&render(&value, 1, 2, 8), PathClass::Direct);
    let expected = 4.0 * (-0.8_f64 * 1.5).exp();
    assert!((irradiance / expected - 1.0).abs() < 1e-3, "{irradiance}, expected {expected}");
}

/// T15: a ray through a slab of thickness 1 and n = 1.5 at 45° is shifted by sin θ (1 - cos θ / √(n² - sin² θ)).
/// The renderer's directions are floats: eight ulps.
#[test]
fn t15_a_slab_shifts_a_ray_by_the_known_amount() {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let direction = Vec3::new(half, -half, 0.0);
    let inside = refract(direction, Vec3::Y, 1.0 / 1.5).unwrap();
    let out = refract(inside, Vec3::Y, 1.5).unwrap();
    assert!((out - direction).length() < 4.0 * f32::EPSILON);
    let inside = DVec3::new(f64::from(inside.x), f64::from(inside.y), 0.0);
    let leaves_at = inside / -inside.y;
    let shift = leaves_at.cross(direction.as_dvec3()).length();
    assert!((shift - 0.329_142_308_2).abs() < 8.0 * f64::from(f32::EPSILON), "{shift}");
}
