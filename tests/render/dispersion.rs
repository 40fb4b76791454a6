//! Prisms, rainbows, and drinks in glasses.

use crate::support::{camera_above, compile, floor, scene};
use glam::{DVec3, Vec3};
use nephroid::geometry::Ray;
use nephroid::media::Media;
use nephroid::optics::{Arrival, Event};
use nephroid::pass1_light::{Block, trace_block, windows};
use nephroid::render::Control;
use nephroid::scene::{FRAUNHOFER, Ior, NoAssets, Scene};
use nephroid::spectrum::Line;
use serde_json::{Value, json};

/// A prism of 60° whose edges run along z, apex up, as two sides (its base is not met).
fn prism_sides() -> [Value; 2] {
    let height = 3.0_f64.sqrt();
    let side = |x: f64| {
        let (front, back) = if x > 0.0 { (5.0, -5.0) } else { (-5.0, 5.0) };
        json!({ "type": "polygon", "material": "prism",
                "vertices": [[x, 0, front], [x, 0, back], [0, height, back], [0, height, front]] })
    };
    [side(-1.0), side(1.0)]
}

fn prism(glass: Value) -> Scene {
    let [left, right] = prism_sides();
    let mut value = scene(camera_above([0.0; 3], 9.0, 1.0), json!([left, right]), json!([]));
    value["materials"]["prism"] = glass;
    compile(&value)
}

/// Follows a ray of one wavelength through everything, by the events given.
fn follow(scene: &Scene, mut ray: Ray, wavelength: f32, events: &[Event]) -> Vec3 {
    let mut media = Media::default();
    for event in events {
        let hit = scene.geometry.closest_hit(&ray).expect("a surface");
        let arrival = Arrival::new(scene, &ray, &hit, media, Some(wavelength));
        let interaction = arrival.interact(|| Line { wavelength: 0.0, weight: Vec3::ZERO });
        let outcome = match event {
            Event::Reflection => interaction.reflected,
            Event::Refraction => interaction.refracted,
        };
        let outcome = outcome.expect("the event happens");
        media = outcome.media;
        ray = Ray::new(arrival.origin_toward(outcome.direction), outcome.direction);
    }
    assert!(scene.geometry.closest_hit(&ray).is_none());
    ray.direction
}

/// Deviation of a ray that goes symmetrically through the prism for an index `n`, degrees.
fn deviation(scene: &Scene, n: f64, wavelength: f32) -> f64 {
    // The ray inside runs along x, 30° off the left side's normal; outside it rises toward it at asin(n / 2) from that.
    let rises = (n * 0.5).asin() - 30.0_f64.to_radians();
    let toward = DVec3::new(rises.cos(), rises.sin(), 0.0);
    let middle = DVec3::new(-0.5, 0.5 * 3.0_f64.sqrt(), 0.0);
    let ray = Ray::new((middle - toward * 3.0).as_vec3(), toward.as_vec3().normalize());
    let out = follow(scene, ray, wavelength, &[Event::Refraction, Event::Refraction]).as_dvec3();
    out.dot(toward.normalize()).clamp(-1.0, 1.0).acos().to_degrees()
}

/// T33: minimum deviation of a 60° prism, n = 1.5: 2 asin(n sin 30°) - 60°; and of BK7 glass (n_d = 1.5168, Abbe
/// number 64.17) at the lines F, d and C.
#[test]
fn t33_a_prism_deviates_each_colour_by_the_known_angle() {
    let plain = prism(json!({ "type": "glass", "ior": 1.5 }));
    let found = deviation(&plain, 1.5, FRAUNHOFER[1]);
    assert!((found - 37.180_756).abs() < 1e-3, "{found}");
    let bk7 = prism(json!({ "type": "glass", "ior": 1.5168, "abbe": 64.17 }));
    let ior = Ior::of_abbe(1.5168, 64.17);
    let [c, d, f] = FRAUNHOFER;
    // Cauchy's two terms meet the d line and F - C; F and C alone are off the measured indices by some 1e-5.
    for (line, known) in [(f, 39.138), (d, 38.647), (c, 38.429)] {
        let n = f64::from(ior.at(Some(line)));
        let found = deviation(&bk7, n, line);
        assert!((found - known).abs() < 5e-3, "{line}: {found} {known}");
    }
}

/// T33: the primary bow of a water drop of n = 1.333: light that enters, is reflected once and leaves comes back at most
/// 42.078° off the way it came.
#[test]
fn t33_a_water_drop_throws_its_bow_at_42_degrees() {
    let drop = json!([{ "type": "sphere", "material": "water", "center": [0, 0, 0], "radius": 1 }]);
    let mut value = scene(camera_above([0.0; 3], 9.0, 1.0), drop, json!([]));
    value["materials"]["water"] = json!({ "type": "glass", "ior": 1.333 });
    let scene = compile(&value);
    let events = [Event::Refraction, Event::Reflection, Event::Refraction];
    let bow = (1..1000)
        .map(|i| {
            let height = i as f32 / 1000.0;
            let ray = Ray::new(Vec3::new(-3.0, height, 0.0), Vec3::X);
            let out = follow(&scene, ray, FRAUNHOFER[1], &events);
            f64::from(-out.x).clamp(-1.0, 1.0).acos().to_degrees()
        })
        .fold(0.0, f64::max);
    // Near its maximum the angle is flat: a step of 1/1000 in height costs less than 1e-4 degrees.
    assert!((bow - 42.078).abs() < 2e-3, "{bow}");
}

/// F74: a prism throws a continuous spectrum, not some pictures: behind it a thin beam is spread without gaps, and each
/// channel keeps its light.
#[test]
fn f74_a_prism_throws_a_continuous_spectrum() {
    let [left, right] = prism_sides();
    let screen = json!({ "name": "screen", "type": "polygon", "material": "floor",
        "vertices": [[20, -40, 9], [20, -40, -9], [20, 40, -9], [20, 40, 9]] });
    let beam = json!([{ "type": "spot", "position": [-3, -0.2, 0], "direction": [2.5, 1.0, 0],
                        "intensity": [1, 1, 1], "outer": 0.1, "inner": 0.1 }]);
    let mut value = scene(camera_above([0.0; 3], 9.0, 1.0), json!([left, right, screen]), beam);
    value["materials"]["prism"] = json!({ "type": "glass", "ior": 1.6, "abbe": 30 });
    let scene = compile(&value);
    let block = Block { first: 0, count: 1 << 14, seed: 3 };
    let all = windows(&scene);
    let window =
        all.iter().find(|w| scene.objects[w.caster.unwrap().index()].name == "objects/0").expect("a window");
    let (photons, tally) = trace_block(&scene, window, block, &Control::new()).unwrap();
    let mut heights: Vec<f32> =
        photons.iter().filter(|p| (p.position.x - 20.0).abs() < 1e-2).map(|p| p.position.y).collect();
    heights.sort_by(f32::total_cmp);
    assert!(heights.len() > 4000, "{}", heights.len());
    // The middle nine tenths: at the ends of the spectrum there is little light.
    let middle = &heights[heights.len() / 20..heights.len() - heights.len() / 20];
    let width = middle[middle.len() - 1] - middle[0];
    let gap = middle.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f32::max);
    assert!(width > 0.2, "the spectrum is as wide as the prism spreads it: {width}");
    assert!(gap < width / 100.0, "gap {gap} of {width}");
    let stored = tally.energy.stored;
    // Stratified wavelengths: a thousandth between channels.
    assert!((stored.x / stored.y - 1.0).abs() < 1e-2 && (stored.z / stored.y - 1.0).abs() < 1e-2, "{stored}");
    assert!(tally.energy.imbalance().abs().max_element() < 1e-9 * tally.energy.emitted.max_element());
}

/// A glass wall between x = 0 and 1 and a drink behind it from `start` to x = 3.9, in the order given.
fn wall_and_drink(drink_first: bool, start: f64) -> Scene {
    let wall = json!({ "type": "box", "material": "wall", "center": [0.5, 0, 0], "size": [1, 20, 20] });
    let drink = json!({ "type": "box", "material": "drink", "center": [0.5 * (start + 3.9), 0, 0],
                        "size": [3.9 - start, 18, 18] });
    let objects = if drink_first { json!([drink, wall]) } else { json!([wall, drink]) };
    let mut value = scene(camera_above([0.0; 3], 9.0, 1.0), objects, json!([]));
    value["materials"]["wall"] = json!({ "type": "glass", "ior": 1.5, "priority": 1 });
    value["materials"]["drink"] = json!({ "type": "glass", "ior": 1.33 });
    compile(&value)
}

/// Where a slanting ray through both is refracted, and the sine of its angle behind.
fn refractions(scene: &Scene) -> Vec<(f32, f32)> {
    let mut ray = Ray::new(Vec3::new(-1.0, 0.0, 0.0), Vec3::new(0.8, SLANT, 0.0));
    let mut media = Media::default();
    let mut found = Vec::new();
    while let Some(hit) = scene.geometry.closest_hit(&ray) {
        let arrival = Arrival::new(scene, &ray, &hit, media, None);
        let interaction = arrival.interact(|| Line { wavelength: 0.0, weight: Vec3::ZERO });
        let outcome = interaction.refracted.expect("no total reflection between these");
        found.push((hit.surface.point.x, outcome.direction.y));
        media = outcome.media;
        ray = Ray::new(arrival.origin_toward(outcome.direction), outcome.direction);
    }
    found
}

const SLANT: f32 = 0.6;

fn assert_refracts(scene: &Scene, expected: &[(f32, f32)]) {
    let found = refractions(scene);
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (found, known) in found.iter().zip(expected) {
        // Directions are floats; the third is refracted three times.
        assert!((found.0 - known.0).abs() < 1e-4 && (found.1 - known.1).abs() < 1e-5, "{found:?} {known:?}");
    }
}

/// F23: where a drink reaches into the wall of its glass, the glass is what is there: light is bent from 1 to 1.5 to
/// 1.33 and out again, at the wall's own faces; the drink's face at 0.9 is passed. The order of objects does not matter.
#[test]
fn f23_a_drink_that_reaches_into_its_glass_meets_it_without_a_gap() {
    for drink_first in [false, true] {
        let scene = wall_and_drink(drink_first, 0.9);
        let bends = [(0.0, SLANT / 1.5), (0.9, SLANT / 1.5), (1.0, SLANT / 1.33), (3.9, SLANT)];
        assert_refracts(&scene, &bends);
    }
}

/// F23, F24: where the drink begins just where the wall ends, or a gap of 1e-9 behind it, which is less than a float
/// can tell, both faces are one surface, whichever of the objects comes first.
#[test]
fn f23_f24_faces_that_fall_together_are_one_surface() {
    for (drink_first, start) in [(false, 1.0), (true, 1.0), (false, 1.0 + 1e-9), (true, 1.0 + 1e-9)] {
        let scene = wall_and_drink(drink_first, start);
        assert_refracts(&scene, &[(0.0, SLANT / 1.5), (1.0, SLANT / 1.33), (3.9, SLANT)]);
    }
}

/// A ball of air in a ball of glass: without priorities the one entered last is what is there.
#[test]
fn a_bubble_in_glass_is_air() {
    let ball = json!({ "type": "sphere", "material": "glass", "center": [0, 0, 0], "radius": 1 });
    let bubble = json!({ "type": "sphere", "material": "air", "center": [0, 0, 0], "radius": 0.5 });
    let scene = compile(&scene(camera_above([0.0; 3], 9.0, 1.0), json!([ball, bubble]), json!([])));
    let media = Media::around(&scene, Vec3::ZERO);
    let filler = media.filler(&scene).expect("inside");
    assert_eq!(scene.materials[filler.index()].dielectric().expect("glass").ior, Ior::Constant(1.0));
    assert_eq!(Media::around(&scene, Vec3::new(0.7, 0.0, 0.0)).absorption(&scene), Vec3::ZERO);
    assert!(Media::around(&scene, Vec3::new(2.0, 0.0, 0.0)).filler(&scene).is_none());
}

/// What contradicts itself is refused with a pointer.
#[test]
fn materials_that_contradict_themselves_are_refused() {
    for (material, pointer) in [
        (json!({ "type": "glass", "ior": 1.5, "abbe": 50, "cauchy": [0.004, 0] }), "/materials/m/cauchy"),
        (json!({ "type": "mix", "first": "glass", "second": "air", "amount": 0.5 }), "/materials/m/second"),
        (json!({ "type": "mix", "first": "m", "second": "floor", "amount": 0.5 }), "/materials/m/first"),
        (json!({ "type": "mix", "first": "floor", "second": "floo", "amount": 0.5 }), "/materials/m/second"),
        (json!({ "type": "phong", "k_d": [0.5, 0.5, 2] }), "/materials/m/k_d/2"),
    ] {
        let mut value = scene(camera_above([0.0; 3], 2.0, 1.0), json!([floor(2.0, 0.0)]), json!([]));
        value["materials"]["m"] = material;
        let errors = Scene::from_json(&value.to_string(), &NoAssets).expect_err(pointer);
        assert_eq!(errors.issues[0].pointer, pointer, "{errors}");
    }
}
