//! No more than a scene needs: what the plan leaves out, and what it warns of.

use crate::support::{camera_above, compile, floor, render, scene};
use nephroid::light_path::PathClass;
use nephroid::plan::{Decision, Plan};
use nephroid::scene::Paths;
use serde_json::{Value, json};

fn lamp() -> Value {
    json!([{ "type": "point", "position": [0, 3, 0], "intensity": [1, 1, 1] }])
}

fn ball(material: &str) -> Value {
    json!({ "type": "sphere", "material": material, "center": [0, 1, 0], "radius": 0.5 })
}

fn plan(objects: Value, lights: Value) -> Plan {
    Plan::new(&compile(&scene(camera_above([0.0; 3], 2.0, 1.0), objects, lights)))
}

fn decision<'a>(plan: &'a Plan, topic: &str) -> &'a Decision {
    plan.decisions.iter().find(|d| d.topic == topic).unwrap()
}

fn codes(plan: &Plan) -> Vec<&'static str> {
    plan.warnings.iter().map(|w| w.code).collect()
}

/// F53: without a specular object there is no pass 1, and no photon is traced.
#[test]
fn f53_without_a_specular_object_pass_1_is_left_out() {
    let plan = plan(json!([floor(2.0, 0.0), ball("floor")]), lamp());
    assert!(plan.photons.is_empty() && !decision(&plan, "pass 1").runs);
    assert_eq!(codes(&plan), Vec::<&str>::new());
    let value = scene(camera_above([0.0; 3], 2.0, 1.0), json!([floor(2.0, 0.0)]), lamp());
    let stats = render(&value, 1, 1, 8).stats();
    assert_eq!((stats.windows.len(), stats.eye.lookups), (0, 0));
}

#[test]
fn whitted_paths_leave_pass_1_out() {
    let mut scene =
        compile(&scene(camera_above([0.0; 3], 2.0, 1.0), json!([floor(2.0, 0.0), ball("glass")]), lamp()));
    assert!(decision(&Plan::new(&scene), "pass 1").runs);
    scene.render.paths = Paths::Whitted;
    assert!(Plan::new(&scene).photons.is_empty());
}

/// F54: a specular object that no light reaches; the attempts are bounded and the plan says so.
#[test]
fn f54_a_specular_object_that_no_light_reaches_is_given_up() {
    let lid = json!({ "name": "lid", "type": "polygon", "material": "floor",
                      "vertices": [[-9, 2, 9], [9, 2, 9], [9, 2, -9], [-9, 2, -9]] });
    let plan = plan(json!([floor(2.0, 0.0), ball("glass"), lid]), lamp());
    assert!(plan.photons.is_empty() && !decision(&plan, "pass 1").runs);
    assert_eq!(codes(&plan), ["no_photon_hit_specular"]);
}

/// A mirror that shines, and nothing that lights it: there is nothing to warn of.
#[test]
fn a_mirror_that_shines_need_not_be_lit() {
    let mut lamp = ball("mirror");
    lamp["emission"] = json!([1, 1, 1]);
    let plan = plan(json!([floor(2.0, 0.0), lamp]), json!([]));
    assert!(plan.photons.is_empty() && !decision(&plan, "pass 1").runs);
    assert_eq!(codes(&plan), Vec::<&str>::new());
}

/// F55: photons that leave the scene, and receivers that are all black.
#[test]
fn f55_photons_that_land_nowhere_are_given_up_with_a_warning() {
    let far = json!({ "name": "floor", "type": "polygon", "material": "floor",
                      "vertices": [[50, 0, 1], [51, 0, 1], [51, 0, 0], [50, 0, 0]] });
    let up = json!({ "type": "polygon", "material": "mirror", "vertices": [[-1, 1, 1], [1, 1, 1], [1, 1, -1], [-1, 1, -1]] });
    let escaping = plan(json!([far, up]), lamp());
    assert!(escaping.photons.is_empty());
    assert_eq!(codes(&escaping), ["no_photon_stored"]);
    let mut value = scene(camera_above([0.0; 3], 2.0, 1.0), json!([floor(2.0, 0.0), ball("glass")]), lamp());
    value["materials"]["floor"]["albedo"] = json!([0, 0, 0]);
    let black = Plan::new(&compile(&value));
    assert!(black.photons.is_empty());
    assert_eq!(codes(&black), ["no_receiver"]);
}

/// F30: a light of no power is a warning and costs nothing; none at all makes a black picture.
#[test]
fn f30_lights_without_power_are_warned_of() {
    let dark = json!([{ "type": "point", "position": [0, 3, 0], "intensity": [0, 0, 0] }]);
    let plan = plan(json!([floor(2.0, 0.0), ball("glass")]), dark.clone());
    assert_eq!(codes(&plan), ["zero_power_light", "no_light"]);
    let value = scene(camera_above([0.0; 3], 2.0, 1.0), json!([floor(2.0, 0.0), ball("glass")]), dark);
    let render = render(&value, 1, 1, 8);
    assert!(render.image().pixels.iter().all(|p| *p == [0.0; 3]));
}

/// The pilot's budgets follow the light: of two lights the stronger gets more photons, and both get some (F31).
#[test]
fn f31_a_weak_light_beside_a_strong_one_keeps_its_photons() {
    let lights = json!([{ "type": "point", "position": [0, 3, 0], "intensity": [1e6, 1e6, 1e6] },
                        { "type": "point", "position": [0.5, 3, 0], "intensity": [1, 1, 1] }]);
    let plan = plan(json!([floor(2.0, 0.0), ball("glass")]), lights);
    let [strong, weak] = &plan.photons[..] else { panic!("{:?}", plan.photons) };
    assert!(strong.log2_block >= weak.log2_block && weak.log2_block >= 8);
}

/// F32, F57: a light inside the glass, and one so near that no rectangle bounds the ball, still find it.
#[test]
fn f57_a_light_inside_or_near_its_caster_reaches_it() {
    for y in [1.0, 1.2, 1.5001, 1.6] {
        let lights = json!([{ "type": "point", "position": [0, y, 0], "intensity": [1, 1, 1] }]);
        let value = scene(camera_above([0.0; 3], 2.0, 1.0), json!([floor(2.0, 0.0), ball("glass")]), lights);
        let render = render(&value, 1, 1, 12);
        let caustic = render.layer(PathClass::Caustic);
        assert!(caustic.pixels.iter().any(|p| p[1] > 0.0), "light at y = {y}");
    }
}

/// Dimensions of the sampler that a scene does not need are not drawn: none of a lens, of time, of colour, of paths.
#[test]
fn what_a_scene_does_not_need_is_not_drawn() {
    let drawn = |change: &dyn Fn(&mut Value)| {
        let mut value =
            scene(camera_above([0.0; 3], 3.0, 2.0), json!([floor(2.0, 0.0), ball("glass")]), lamp());
        change(&mut value);
        let eye = render(&value, 1, 2, 8).stats().eye;
        [eye.lens_points, eye.moments, eye.wavelengths, eye.paths].map(|count| count > 0)
    };
    assert_eq!(drawn(&|_| {}), [false; 4]);
    let lens = drawn(&|v| {
        v["camera"]["aperture"] = json!(0.1);
        v["camera"]["focus_distance"] = json!(3);
    });
    assert_eq!(lens, [true, false, false, false]);
    let closed = drawn(&|v| {
        v["camera"]["aperture"] = json!(0);
        v["camera"]["shutter"] = json!([0, 0]);
        v["objects"][1]["velocity"] = json!([1, 0, 0]);
    });
    assert_eq!(closed, [false; 4]);
    let open = drawn(&|v| {
        v["camera"]["shutter"] = json!([0, 0.1]);
        v["objects"][1]["velocity"] = json!([1, 0, 0]);
    });
    assert_eq!(open, [false, true, false, false]);
    let prism = drawn(&|v| v["materials"]["glass"]["abbe"] = json!(30));
    assert_eq!(prism, [false, false, true, false]);
    let complete = drawn(&|v| v["render"]["paths"] = json!("complete"));
    assert_eq!(complete, [false, false, false, true]);
}
