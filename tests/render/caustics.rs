//! `LS+DE`: caustics whose light is known, from the photons alone.

use crate::support::{
    SEEDS, T_LIMIT, camera_above, compile, floor, mean, mean_irradiance, mean_over_square, over_seeds,
    render, scene,
};
use glam::DVec3;
use nephroid::light_path::PathClass;
use nephroid::pass1_light::{Block, Region, Tally, Window, trace_block, windows};
use nephroid::photon_map::Photon;
use nephroid::render::Control;
use serde_json::{Value, json};

fn trace(value: &Value, seed: u64, log2_count: u32) -> (Vec<Photon>, Tally, Window) {
    let scene = compile(value);
    let window = windows(&scene).swap_remove(0);
    let block = Block { first: 0, count: 1 << log2_count, seed };
    let (photons, tally) = trace_block(&scene, &window, block, &Control::new()).unwrap();
    (photons, tally, window)
}

/// A sun straight down with irradiance 1.
fn sun() -> Value {
    json!([{ "type": "directional", "direction": [0, -1, 0], "irradiance": [1, 1, 1] }])
}

/// T12: an infinite slab of n = 1.5 at normal incidence transmits 2n/(n² + 1), all internal reflections
/// included. The slab is wide enough that nothing comes round its rim.
#[test]
fn t12_a_slab_transmits_all_orders_of_internal_reflection() {
    let (bottom, top) = (1.0, 1.2);
    let face = |y: f64, z: f64| {
        json!({ "type": "polygon", "material": "glass", "name": format!("face at {y}"),
                "vertices": [[-1, y, z], [1, y, z], [1, y, -z], [-1, y, -z]] })
    };
    let objects = json!([floor(1.0, 0.0), face(top, 1.0), face(bottom, -1.0)]);
    let slab = scene(camera_above([0.0; 3], 0.5, 0.4), objects, sun());
    let estimate = over_seeds(|seed| mean_irradiance(&render(&slab, seed, 1, 16), PathClass::Caustic));
    estimate.assert_is(2.0 * 1.5 / (1.5 * 1.5 + 1.0), 0.0);
}

/// T12, F73: the same by the number of internal reflections, two at a time: with none (1 - R)² = 0.9216, and R² of that with
/// each pair more, so that the sum is 0.92307456 up to one pair and 0.923076919 up to two, by the paths asked for.
#[test]
fn t12_f73_each_pair_of_internal_reflections_adds_its_share() {
    let face = |y: f64, z: f64| json!({ "type": "polygon", "material": "glass", "vertices": [[-1, y, z], [1, y, z], [1, y, -z], [-1, y, -z]] });
    let objects = json!([floor(1.0, 0.0), face(1.2, 1.0), face(1.0, -1.0)]);
    let mut slab = scene(camera_above([0.0; 3], 0.5, 0.4), objects, sun());
    for (pairs, known) in [(0, 0.9216), (1, 0.001_474_56), (2, 2.359e-6)] {
        let specular = 2 + 2 * pairs;
        // The share of this pair alone: of 0.0016 in all a sum would not show it.
        slab["render"]["paths"] = json!(format!("LS{{{specular}}}DE"));
        let share = over_seeds(|seed| mean_irradiance(&render(&slab, seed, 1, 18), PathClass::Caustic));
        match pairs {
            0 => share.assert_is(known, 0.0),
            // One photon in 700: half of it or twice as much would show.
            1 => {
                let noise = T_LIMIT * share.standard_error;
                assert!(noise < 0.25 * known && (share.mean - known).abs() < noise, "{share:?}, not {known}");
            }
            // One in 400 000.
            _ => assert!(share.mean < 1e-5, "{share:?}"),
        }
    }
    // No photon has met one or three S only: there is no such way to the floor.
    for odd in [1, 3] {
        slab["render"]["paths"] = json!(format!("LS{{{odd}}}DE"));
        assert_eq!(mean_irradiance(&render(&slab, 1, 1, 14), PathClass::Caustic), 0.0, "{odd}");
    }
}

/// T24: a point light and a mirror of reflectance 0.9 in the plane x = 1: the floor sees the image of the
/// light at (2, 1, 0).
#[test]
fn t24_a_plane_mirror_lights_the_floor_like_the_lights_image() {
    let mirror = json!({ "type": "polygon", "material": "mirror",
                         "vertices": [[1, 0, -1], [1, 0, 1], [1, 1, 1], [1, 1, -1]] });
    let lights = json!([{ "type": "point", "position": [0, 1, 0], "intensity": [1, 1, 1] }]);
    let width = 0.2;
    let image_source = |x: f64, z: f64| {
        let to = DVec3::new(2.0 - x, 1.0, -z);
        0.9 * to.y / to.length().powi(3)
    };
    assert!((image_source(0.5, 0.0) - 0.153_609_285_1).abs() < 1e-9);
    let lit =
        scene(camera_above([0.5, 0.0, 0.0], 3.0, width), json!([floor(2.0, 0.0), mirror]), lights.clone());
    let estimate = over_seeds(|seed| mean_irradiance(&render(&lit, seed, 1, 17), PathClass::Caustic));
    estimate.assert_is(mean_over_square(0.5, 0.0, width, image_source), 0.0);
    // The mirror's outline projects to |z| = 2 - x: beyond it there is nothing.
    let camera = camera_above([0.5, 0.0, 1.8], 3.0, width);
    let dark = scene(camera, json!([floor(2.0, 0.0), mirror]), lights);
    assert_eq!(mean_irradiance(&render(&dark, 1, 1, 17), PathClass::Caustic), 0.0);
}

/// T39, F49: a mirror without thickness, lit from behind, stands on a floor: none of the light that it throws there is seen
/// on this side of it, in no pixel along its foot.
#[test]
fn t39_f49_no_light_leaks_under_a_thin_wall() {
    let mirror = json!({ "type": "polygon", "material": "mirror", "vertices": [[0, 0, -1], [0, 0, 1], [0, 1, 1], [0, 1, -1]] });
    let lights = json!([{ "type": "point", "position": [0.5, 1, 0.1], "intensity": [1, 1, 1] }]);
    // It sees the foot of the wall from x < 0, at a slant to the pixels, and nothing beyond the wall's top.
    let camera = json!({ "type": "perspective", "eye": [-2, 1.5, 0.3], "target": [0, 0.05, 0], "fov": 8 });
    let value = scene(camera, json!([floor(2.0, 0.0), mirror]), lights);
    let render = render(&value, 1, 4, 14);
    assert!(render.layer(PathClass::Caustic).pixels.iter().all(|p| *p == [0.0; 3]));
    // There is light to leak: beyond the wall the floor is bright.
    let behind =
        scene(camera_above([0.1, 0.0, 0.0], 1.0, 0.1), value["objects"].clone(), value["lights"].clone());
    assert!(mean_irradiance(&crate::support::render(&behind, 1, 1, 14), PathClass::Caustic) > 0.1);
}

/// T25, F60: a ball of index 1 bends nothing, so that the floor is lit as if it were not there: photons bring
/// exactly what the ball blocks for shadow rays, and nothing that shadow rays bring too.
#[test]
fn t25_f60_glass_of_index_one_is_not_there() {
    let lights = json!([{ "type": "point", "position": [0.3, 2, 0], "intensity": [1, 1, 1] }]);
    let ball = json!({ "type": "sphere", "material": "air", "center": [0, 0.6, 0], "radius": 0.3 });
    // Half of what the camera sees lies in the ball's shadow.
    let camera = || {
        json!({ "type": "perspective", "eye": [1.2, 3, 0.4], "target": [-0.3, 0, 0],
                            "up": [0, 1, 0], "fov": 20 })
    };
    let with = scene(camera(), json!([floor(2.0, 0.0), ball]), lights.clone());
    let without = scene(camera(), json!([floor(2.0, 0.0)]), lights);
    let expected = mean(&render(&without, 1, 8, 8).image());
    let estimate = over_seeds(|seed| mean(&render(&with, seed, 1, 16).image()));
    // The kernel's blur carries light over the shadow's edge in both directions alike.
    estimate.assert_is(expected, 1e-3);
    let caustic = mean(&render(&with, 1, 1, 16).layer(PathClass::Caustic));
    assert!(caustic > 0.1 * expected, "the ball's shadow is in the picture: {caustic} of {expected}");
}

/// A ball lens of radius 1 and n = 1.5 in a sun of irradiance 1, over a floor at distance `depth` below its
/// centre.
fn ball_lens(depth: f64) -> Value {
    let ball = json!({ "type": "sphere", "material": "glass", "center": [0, 0, 0], "radius": 1 });
    scene(camera_above([3.0, 0.0, 0.0], 4.0, 1.0), json!([floor(8.0, -depth), ball]), sun())
}

/// Angles of incidence and refraction at impact parameter `h`, and the reflectance.
fn interface(h: f64) -> (f64, f64, f64) {
    let (ti, tt) = (h.asin(), (h / 1.5).asin());
    let rs = ((ti.cos() - 1.5 * tt.cos()) / (ti.cos() + 1.5 * tt.cos())).powi(2);
    let rp = ((1.5 * ti.cos() - tt.cos()) / (1.5 * ti.cos() + tt.cos())).powi(2);
    (ti, tt, 0.5 * (rs + rp))
}

/// Integral over the ball's cross-section of `f(h)`, divided by its area π.
fn over_cross_section(f: impl Fn(f64) -> f64) -> f64 {
    let n = 200_000;
    (0..n).map(|i| (f64::from(i) + 0.5) / f64::from(n)).map(|h| f(h) * 2.0 * h / f64::from(n)).sum()
}

/// Share of the light through the ball, without internal reflection, within `a` of the axis at `depth`.
fn encircled(depth: f64, a: f64) -> f64 {
    over_cross_section(|h| {
        let (ti, tt, r) = interface(h);
        let turned = 2.0 * (ti - tt);
        // The ray leaves at angle 2 tt - ti from the axis, going towards it at `turned`.
        let leave = 2.0 * tt - ti;
        let x = leave.sin() - turned.tan() * (depth - leave.cos());
        if x.abs() < a { (1.0 - r).powi(2) } else { 0.0 }
    })
}

#[test]
fn t27_the_encircled_flux_is_the_known_one() {
    for (depth, a, expected) in
        [(1.5, 0.05, 0.25548), (1.5, 0.3, 0.60741), (1.2, 0.1, 0.70202), (3.0, 0.5, 0.16954)]
    {
        let flux = encircled(depth, a);
        assert!((flux - expected).abs() < 1e-5, "{depth} {a}: {flux}");
    }
}

/// Number of internal reflections of a photon that fell on the ball along `axis` from a distance, told by its
/// last ray; `None` for the reflected light. Snell's law at a sphere keeps the ray's distance from the centre
/// and its plane, and each order turns it by another angle.
fn order_of(photon: &Photon, axis: DVec3, distance: f64) -> Option<u32> {
    use std::f64::consts::{PI, TAU};
    let direction = photon.direction.as_dvec3();
    let momentum = photon.position.as_dvec3().cross(direction);
    let h = momentum.length().min(1.0);
    let normal = momentum.normalize_or(DVec3::X);
    let spread = h / distance;
    let incoming = axis * (1.0 - spread * spread).sqrt() + axis.cross(normal) * spread;
    let turned = incoming.cross(direction).dot(normal).atan2(incoming.dot(direction));
    let (ti, tt, _) = interface(h);
    let order = |k: u32| (Some(k), 2.0 * (ti - tt) + f64::from(k) * (PI - 2.0 * tt));
    let off = |angle: f64| ((angle - turned + PI).rem_euclid(TAU) - PI).abs();
    let candidates = (0..20).map(order).chain([(None, 2.0 * ti - PI)]);
    candidates.min_by(|a, b| off(a.1).total_cmp(&off(b.1))).and_then(|(order, _)| order)
}

/// T27: the ball lens focuses by spherical aberration, not to a point: flux within five circles in three
/// planes.
#[test]
fn t27_a_ball_lens_focuses_the_known_flux() {
    for depth in [1.5, 1.2, 3.0] {
        for a in [0.05, 0.1, 0.2, 0.3, 0.5] {
            // Where the whole circle holds less than 1 % the noise tells nothing.
            let expected = encircled(depth, a);
            if expected < 0.03 {
                continue;
            }
            let estimate = over_seeds(|seed| {
                let (photons, ..) = trace(&ball_lens(depth), seed, 16);
                let within = |p: &&Photon| {
                    p.position.with_y(0.0).length() < a as f32
                        && order_of(p, DVec3::NEG_Y, f64::INFINITY) == Some(0)
                };
                let flux: f64 = photons.iter().filter(within).map(|p| f64::from(p.power.y)).sum();
                flux / std::f64::consts::PI
            });
            estimate.assert_is(expected, 0.0);
        }
    }
}

/// T28: what the ball reflects, transmits at once, and after one and two internal reflections; all orders
/// together are all light. A point light 200 away stands in for the sun (its light misses h uniform by 1e-5),
/// and a diffuse shell around both catches everything.
#[test]
fn t28_f73_the_orders_of_a_ball_carry_the_known_energy() {
    const DISTANCE: f64 = 200.0;
    let ball = json!({ "type": "sphere", "material": "glass", "center": [0, 0, 0], "radius": 1 });
    let shell = json!({ "type": "sphere", "material": "floor", "center": [0, 0, 0], "radius": 300 });
    let intensity = DISTANCE * DISTANCE;
    let lights = json!([{ "type": "point", "position": [0, DISTANCE, 0], "intensity": [intensity, intensity, intensity] }]);
    let value = scene(camera_above([0.0, -3.0, 0.0], 1.0, 1.0), json!([ball, shell]), lights);
    let caught: Vec<Vec<Photon>> = (1..=SEEDS).map(|seed| trace(&value, seed, 17).0).collect();
    let flux = |seed: u64, keep: &dyn Fn(&Photon) -> bool| {
        let photons = caught[seed as usize - 1].iter().filter(|p| keep(p));
        photons.map(|p| f64::from(p.power.y)).sum::<f64>() / std::f64::consts::PI
    };
    for (order, known) in
        [(None, 0.091_778), (Some(0), 0.835_544), (Some(1), 0.061_183), (Some(2), 0.007_993)]
    {
        let expected = over_cross_section(|h| {
            let (_, _, r) = interface(h);
            order.map_or(r, |k: u32| (1.0 - r).powi(2) * r.powi(k as i32))
        });
        assert!((expected - known).abs() < 1e-5, "{order:?}: {expected}");
        over_seeds(|seed| flux(seed, &|p| order_of(p, DVec3::NEG_Y, DISTANCE) == order))
            .assert_is(expected, 1e-4);
    }
    over_seeds(|seed| flux(seed, &|_| true)).assert_is(1.0, 1e-4);
}

/// T29: the nephroid of a half cylinder of radius 1 in a low sun. On the axis of symmetry one ray arrives at
/// x = 0.25 and three at x = 0.75, the last two 0.4 times as bright.
#[test]
fn t29_the_nephroid_has_the_known_brightness_on_its_axis() {
    let elevation = 0.02_f64;
    let cup = half_cylinder(512, 0.045);
    let lights = json!([{ "type": "directional", "irradiance": [1, 1, 1],
                          "direction": [elevation.cos(), -elevation.sin(), 0] }]);
    for (x, concentration) in [(0.25, 2.0), (0.75, 3.6)] {
        let camera = camera_above([x, 0.0, 0.0], 3.0, 0.04);
        let scene = scene(camera, json!([floor(1.5, 0.0), cup]), lights.clone());
        let estimate = over_seeds(|seed| mean_irradiance(&render(&scene, seed, 1, 18), PathClass::Caustic));
        // The formula's s tan a ≪ 1, its curvature over the square, and the kernel leave 1 %.
        estimate.assert_is(concentration * 0.9 * elevation.sin(), 0.01);
    }
}

/// The half of a vertical mirror cylinder of radius 1 with x > 0, with its true normals.
fn half_cylinder(segments: u32, height: f64) -> Value {
    let mut mesh = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..=segments {
        let angle = std::f64::consts::PI * (f64::from(i) / f64::from(segments) - 0.5);
        for y in [0.0, height] {
            mesh.0.push([angle.cos(), y, angle.sin()]);
            mesh.1.push([angle.cos(), 0.0, angle.sin()]);
        }
        if i < segments {
            let k = 2 * i;
            mesh.2.extend([[k, k + 1, k + 2], [k + 2, k + 1, k + 3]]);
        }
    }
    json!({ "type": "mesh", "material": "mirror", "positions": mesh.0, "normals": mesh.1, "triangles": mesh.2 })
}

/// T42: every watt that is sent is accounted for, to the rounding of f64 sums, with mirrors that absorb,
/// glass, roulette and light that leaves.
#[test]
fn t42_energy_is_accounted_for_to_rounding() {
    let ball = json!({ "type": "sphere", "material": "glass", "center": [0, 1, 0], "radius": 0.5 });
    let mirror = json!({ "type": "sphere", "material": "mirror", "center": [1.2, 1, 0], "radius": 0.5 });
    let lights = json!([{ "type": "quad", "center": [0.5, 3, 0], "size": [0.4, 0.4], "towards": [0.5, 0, 0],
                          "radiance": [5, 7, 11] }]);
    let value = scene(camera_above([0.0; 3], 2.0, 1.0), json!([floor(2.0, 0.0), ball, mirror]), lights);
    let scene = compile(&value);
    for window in windows(&scene) {
        let block = Block { first: 0, count: 1 << 14, seed: 3 };
        let (photons, tally) = trace_block(&scene, &window, block, &Control::new()).unwrap();
        let energy = tally.energy;
        let relative = energy.imbalance().abs() / energy.emitted;
        assert!(relative.max_element() < 1e-12, "{relative}");
        for part in [energy.stored, energy.absorbed, energy.escaped, energy.missed] {
            assert!(part.min_element() >= 0.0 && part.max_element() < energy.emitted.max_element());
        }
        assert!(energy.stored.min_element() > 0.0 && energy.escaped.min_element() > 0.0);
        let stored: f64 = photons.iter().map(|p| f64::from(p.power.y)).sum();
        assert!((stored / energy.stored.y - 1.0).abs() < 1e-12);
        assert_eq!(tally.stored, photons.len() as u64);
    }
}

/// F60: what rests on a D without having met an S is direct light: no photon of it is kept.
#[test]
fn f60_photons_that_met_no_specular_surface_are_not_stored() {
    let ball = json!({ "type": "sphere", "material": "glass", "center": [0, 0.6, 0], "radius": 0.5 });
    // A diffuse lid between light and ball.
    let lid = json!({ "name": "lid", "type": "polygon", "material": "floor",
                      "vertices": [[-1, 1.5, 1], [1, 1.5, 1], [1, 1.5, -1], [-1, 1.5, -1]] });
    let lights = json!([{ "type": "point", "position": [0, 3, 0], "intensity": [1, 1, 1] }]);
    let value = scene(camera_above([0.0; 3], 2.0, 1.0), json!([floor(2.0, 0.0), ball, lid]), lights);
    let (photons, tally, _) = trace(&value, 1, 14);
    assert_eq!((photons.len(), tally.hit_caster), (0, 0));
    assert!((tally.energy.missed - tally.energy.emitted).abs().max_element() < 1e-12);
}

/// T26: a sun at 45° through a wide slab of n = 1.5: E cosθ (1 - R)/(1 + R), flat.
#[test]
fn t26_a_slab_in_slanting_light_lights_the_floor_evenly() {
    let face = |y: f64, z: f64| {
        json!({ "type": "polygon", "material": "glass", "name": format!("face at {y}"),
                "vertices": [[-2, y, z], [2, y, z], [2, y, -z], [-2, y, -z]] })
    };
    let lights = json!([{ "type": "directional", "direction": [1, -1, 0], "irradiance": [1, 1, 1] }]);
    for x in [-0.3, 0.3] {
        let objects = json!([floor(1.0, 0.0), face(1.2, 1.0), face(1.0, -1.0)]);
        let slab = scene(camera_above([x, 0.0, 0.0], 0.5, 0.4), objects, lights.clone());
        let estimate = over_seeds(|seed| mean_irradiance(&render(&slab, seed, 1, 16), PathClass::Caustic));
        estimate.assert_is(0.904_327 / 2.0_f64.sqrt(), 0.0);
    }
}

/// A paraboloid of focal length 1 whose focus is the origin, opening down, out to radius 2, with its true normals.
fn paraboloid(rings: u32, segments: u32) -> Value {
    let mut mesh = (Vec::new(), Vec::new(), Vec::new());
    for ring in 0..=rings {
        let r = 2.0 * f64::from(ring) / f64::from(rings);
        for segment in 0..=segments {
            let angle = std::f64::consts::TAU * f64::from(segment) / f64::from(segments);
            let (x, z) = (r * angle.cos(), r * angle.sin());
            mesh.0.push([x, 1.0 - 0.25 * r * r, z]);
            mesh.1.push([0.5 * x, 1.0, 0.5 * z]);
            if ring < rings && segment < segments {
                let (a, b) = (ring * (segments + 1) + segment, (ring + 1) * (segments + 1) + segment);
                // The triangles at the vertex itself would have no area.
                if ring > 0 {
                    mesh.2.push([a, a + 1, b]);
                }
                mesh.2.push([a + 1, b + 1, b]);
            }
        }
    }
    json!({ "type": "mesh", "material": "mirror", "positions": mesh.0, "normals": mesh.1, "triangles": mesh.2 })
}

/// T30: a light in the focus of a paraboloid of reflectance 0.9 lights a floor by 0.9 I / (f² (1 + r²/4f²)²).
#[test]
fn t30_a_paraboloid_lights_the_floor_with_the_known_profile() {
    let profile = |x: f64, z: f64| (1.0 + 0.25 * (x * x + z * z)).powi(-2);
    for (r, known) in [(0.5, 0.885_813), (1.0, 0.64), (2.0, 0.25)] {
        assert!((profile(r, 0.0) - known).abs() < 1e-6);
    }
    let lights = json!([{ "type": "point", "position": [0, 0, 0], "intensity": [1, 1, 1] }]);
    for r in [0.0, 0.5, 1.0, 1.5] {
        let objects = json!([floor(3.0, -1.0), paraboloid(64, 128)]);
        let value = scene(camera_above([r, -1.0, 0.0], 0.5, 0.4), objects, lights.clone());
        let estimate = over_seeds(|seed| mean_irradiance(&render(&value, seed, 1, 17), PathClass::Caustic));
        // The mesh is flat between its vertices: its slope is off by up to 1/64.
        estimate.assert_is(0.9 * mean_over_square(r, 0.0, 0.4, profile), 5e-3);
    }
}

/// T31, `LSDSE`: T24's patch of floor, seen from below in a second mirror of reflectance 0.9 above it.
#[test]
fn t31_a_mirrors_light_seen_in_a_second_mirror() {
    let wall = json!({ "type": "polygon", "material": "mirror",
                       "vertices": [[1, 0, -1], [1, 0, 1], [1, 0.6, 1], [1, 0.6, -1]] });
    // So small, and the wall so low, that light by way of both does not reach the patch.
    let above = json!({ "type": "polygon", "material": "mirror", "name": "above",
                        "vertices": [[0.35, 2, -0.15], [0.65, 2, -0.15], [0.65, 2, 0.15], [0.35, 2, 0.15]] });
    let lights = json!([{ "type": "point", "position": [0, 1, 0], "intensity": [1, 1, 1] }]);
    let image_source = |x: f64, z: f64| {
        let to = DVec3::new(2.0 - x, 1.0, -z);
        0.9 * to.y / to.length().powi(3)
    };
    // The eye's image is 3 above the floor, and sees three times what it sees of the mirror.
    let camera = camera_above([0.5, 2.0, 0.0], -1.0, 0.2 / 3.0);
    let value = scene(camera, json!([floor(2.0, 0.0), wall, above]), lights);
    let estimate = over_seeds(|seed| mean_irradiance(&render(&value, seed, 1, 17), PathClass::Caustic));
    estimate.assert_is(0.9 * mean_over_square(0.5, 0.0, 0.2, image_source), 0.0);
}

/// F56: a mirror that reaches to the horizon has no window that bounds it usefully: light goes everywhere, and what
/// comes back is that of the light's image.
#[test]
fn f56_a_mirror_to_the_horizon_is_lit_from_all_directions() {
    let mut mirror = floor(1e5, 0.0);
    mirror["material"] = json!("mirror");
    let lights = json!([{ "type": "point", "position": [0, 1, 0], "intensity": [1, 1, 1] }]);
    let value = scene(camera_above([0.0, 2.0, 0.0], -0.5, 0.8), json!([mirror, floor(2.0, 2.0)]), lights);
    assert!(windows(&compile(&value)).iter().all(|w| w.region == Region::AllDirections));
    let estimate = over_seeds(|seed| mean_irradiance(&render(&value, seed, 1, 16), PathClass::Caustic));
    let image_source = |x: f64, z: f64| 0.9 * 3.0 / (x * x + z * z + 9.0).powf(1.5);
    estimate.assert_is(mean_over_square(0.0, 0.0, 0.8, image_source), 0.0);
}

/// A mirror lights a ball from the side, what the eye sees of it and what lies behind, the same sheet in the same place on the screen:
/// the irradiance is what the lamp's image in the mirror gives. A lamp of no size brings points of light, another images.
#[test]
fn light_on_the_far_side_of_a_ball_is_not_seen() {
    let slope = json!({ "type": "polygon", "material": "mirror", "vertices": [[2, 0, -1], [2, 0, 1], [4, 2, 1], [4, 2, -1]] });
    let ball = json!({ "type": "sphere", "material": "floor", "center": [0, 1, 0], "radius": 0.5 });
    let camera = json!({ "type": "orthographic", "eye": [0, 1, 3], "target": [0, 1, 0], "height": 0.6 });
    let point = json!({ "type": "point", "position": [3, 21, 0], "intensity": [529, 529, 529] });
    let quad = json!({ "type": "quad", "center": [3, 21, 0], "size": [1, 1], "towards": [3, 1, 0], "radiance": [529, 529, 529] });
    let expected = mean_over_square(0.0, 0.0, 0.6, |x, y| {
        let at = DVec3::new(x, y, (0.25 - x * x - y * y).sqrt());
        let to = DVec3::new(23.0, 0.0, 0.0) - at;
        0.9 * 529.0 * (to.normalize().dot(at) / 0.5).max(0.0) / to.length_squared()
    });
    for light in [point, quad] {
        let value = scene(camera.clone(), json!([ball, slope]), json!([light]));
        let estimate = over_seeds(|seed| mean_irradiance(&render(&value, seed, 1, 14), PathClass::Caustic));
        // The look-up's kernel reaches over one of 16 pixels.
        estimate.assert_is(expected, 0.01);
    }
}

/// F59: counts go on beyond 2^32, and a sum of many small powers does not stall as it would in f32, at 0.25.
#[test]
fn f59_counts_and_sums_hold_any_number_of_photons() {
    let mut part = Tally { sent: 1 << 31, stored: 1 << 31, ..Tally::default() };
    let mut sum = Tally::default();
    (0..4).for_each(|_| sum.add(&part));
    assert_eq!((sum.sent, sum.stored), (1 << 33, 1 << 33));
    part.energy.stored = DVec3::splat(1e-8);
    (0..60_000_000).for_each(|_| sum.add(&part));
    assert!((sum.energy.stored.y - 0.6).abs() < 1e-6, "{}", sum.energy.stored.y);
}
