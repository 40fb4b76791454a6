//! Warnings of what a scene hardly means, each in a scene that has it and in one that has not.

use crate::support::{camera_above, compile, floor, scene};
use nephroid::plan::Plan;
use nephroid::report::plan_json;
use serde_json::{Value, json};

fn lamp() -> Value {
    json!([{ "type": "point", "position": [0.1, 3, 0], "intensity": [1, 1, 1] }])
}

fn value(objects: Value, lights: Value) -> Value {
    let mut all = vec![floor(4.0, 0.0)];
    all.extend(objects.as_array().unwrap().iter().cloned());
    scene(camera_above([0.0; 3], 2.5, 1.0), json!(all), lights)
}

/// Code and pointer of every warning of the floor (`/objects/0`) and some more objects.
fn warnings(objects: Value, lights: Value) -> Vec<(&'static str, String)> {
    let plan = Plan::new(&compile(&value(objects, lights)));
    plan.warnings.iter().map(|w| (w.code, w.pointer.clone().unwrap_or_default())).collect()
}

fn none() -> Vec<(&'static str, String)> {
    Vec::new()
}

fn one(code: &'static str, pointer: &str) -> Vec<(&'static str, String)> {
    vec![(code, pointer.to_owned())]
}

/// A cube of side 1 around (0, 1, 0) as a mesh; its last face is left out if it is open.
fn cube(open: bool, inwards: bool) -> Value {
    let corner =
        |i: i32| json!([f64::from(i & 1) - 0.5, f64::from(i >> 1 & 1) + 0.5, f64::from(i >> 2 & 1) - 0.5]);
    let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let mut triangles: Vec<[i32; 3]> =
        sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    if open {
        triangles.truncate(10);
    }
    if inwards {
        triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    json!({ "type": "mesh", "material": "glass", "positions": (0..8).map(corner).collect::<Vec<_>>(), "triangles": triangles })
}

/// F22: glass whose border is free.
#[test]
fn f22_glass_that_is_not_closed_is_warned_of() {
    let pane = json!({ "type": "polygon", "material": "glass", "vertices": [[-1, 1, 1], [1, 1, 1], [1, 1, -1], [-1, 1, -1]] });
    let disk = json!({ "type": "disk", "material": "glass", "center": [0, 1, 0], "radius": 0.5 });
    let tube = json!({ "type": "cylinder", "material": "glass", "from": [0, 0.5, 0], "to": [0, 1, 0], "radius": 0.5 });
    let field = json!({ "type": "heightfield", "material": "glass", "center": [0, 1, 0], "size": [1, 1], "heights": [[0, 0.1], [0, 0.2]] });
    for open in [pane.clone(), disk, tube.clone(), field.clone(), cube(true, false)] {
        assert_eq!(warnings(json!([open]), lamp()), one("open_dielectric", "/objects/1"), "{open}");
    }
    let ball = json!({ "type": "sphere", "material": "glass", "center": [0, 1, 0], "radius": 0.5 });
    let block = json!({ "type": "box", "material": "glass", "center": [0, 1, 0], "size": [1, 1, 1] });
    for closed in [ball, block, cube(false, false)] {
        assert_eq!(warnings(json!([closed]), lamp()), none(), "{closed}");
    }
    // Of another material it may be as open as it likes.
    for mut open in [pane, tube, field] {
        open["material"] = json!("mirror");
        let found = warnings(json!([open]), lamp());
        assert!(found.iter().all(|(code, _)| *code != "open_dielectric"), "{open}");
    }
}

/// Pieces that meet along all their borders, and water that reaches the walls of its basin, are closed.
#[test]
fn f22_glass_that_other_surfaces_close_is_not_warned_of() {
    let tube = json!({ "type": "cylinder", "material": "glass", "from": [0, 0.5, 0], "to": [0, 1, 0], "radius": 0.5 });
    let disk = |y: f64, up: f64| json!({ "type": "disk", "material": "glass", "center": [0, y, 0], "normal": [0, up, 0], "radius": 0.5 });
    assert_eq!(warnings(json!([tube, disk(0.5, -1.0), disk(1.0, 1.0)]), lamp()), none());
    assert_eq!(warnings(json!([tube, disk(0.5, -1.0)]), lamp()), one("open_dielectric", "/objects/1"));
    // A basin of side 2 with water up to 0.5 within walls of height 1.
    let walls = [([-1, -1], [-1, 1]), ([1, 1], [1, -1]), ([1, -1], [-1, -1]), ([-1, 1], [1, 1])];
    let wall = |([x, z], [u, v]): ([i32; 2], [i32; 2])| json!({ "type": "polygon", "material": "floor", "vertices": [[x, 0, z], [u, 0, v], [u, 1, v], [x, 1, z]] });
    let water = |half: f64| json!({ "type": "polygon", "material": "glass", "vertices": [[-half, 0.5, half], [half, 0.5, half], [half, 0.5, -half], [-half, 0.5, -half]] });
    let mut basin: Vec<Value> = walls.into_iter().map(wall).collect();
    basin.push(water(1.0));
    assert_eq!(warnings(json!(basin), lamp()), none());
    basin[4] = water(0.9);
    assert_eq!(warnings(json!(basin), lamp()), one("open_dielectric", "/objects/5"));
}

#[test]
fn a_closed_mesh_that_is_inside_out_is_warned_of() {
    assert_eq!(warnings(json!([cube(false, true)]), lamp()), one("inward_normals", "/objects/1"));
    assert_eq!(warnings(json!([cube(false, false)]), lamp()), none());
    // Its instances are as wrong as it is.
    let mut original = cube(false, true);
    original["name"] = json!("cube");
    let copy = json!({ "type": "instance", "of": "cube", "material": "glass", "translate": [2, 0, 0] });
    let found = warnings(json!([original, copy]), lamp());
    assert_eq!(found, [one("inward_normals", "/objects/1"), one("inward_normals", "/objects/2")].concat());
    // Both sides of what is opaque are alike, unless it emits.
    let mut opaque = cube(false, true);
    opaque["material"] = json!("floor");
    assert_eq!(warnings(json!([opaque.clone()]), lamp()), none());
    opaque["emission"] = json!([1, 1, 1]);
    assert_eq!(warnings(json!([opaque]), lamp()), one("inward_normals", "/objects/1"));
}

/// F10: an outline that crosses itself, or a hole that leaves it.
#[test]
fn f10_a_polygon_that_crosses_itself_is_warned_of() {
    let polygon = |vertices: Value, holes: Value| json!({ "type": "polygon", "material": "floor", "vertices": vertices, "holes": holes });
    let square = json!([[-1, 1, 1], [1, 1, 1], [1, 1, -1], [-1, 1, -1]]);
    let bow = json!([[-1, 1, 1], [1, 1, 1], [-0.5, 1, -1], [1, 1, -1]]);
    let hole = json!([[[-0.5, 1, 0.5], [0.5, 1, 0.5], [0, 1, 0]]]);
    let leaving = json!([[[-0.5, 1, 0.5], [1.5, 1, 0.5], [0, 1, 0]]]);
    assert_eq!(
        warnings(json!([polygon(bow, json!([]))]), lamp()),
        one("self_crossing_polygon", "/objects/1")
    );
    assert_eq!(
        warnings(json!([polygon(square.clone(), leaving)]), lamp()),
        one("self_crossing_polygon", "/objects/1")
    );
    assert_eq!(warnings(json!([polygon(square.clone(), hole)]), lamp()), none());
    assert_eq!(warnings(json!([polygon(square, json!([]))]), lamp()), none());
}

#[test]
fn f27_a_light_inside_something_opaque_is_warned_of() {
    let ball = |material: &str| json!([{ "type": "sphere", "material": material, "center": [0, 1, 0], "radius": 0.5 }]);
    let point = |y: f64| json!([{ "type": "point", "position": [0.1, y, 0.05], "intensity": [1, 1, 1] }]);
    let spot = |y: f64| json!([{ "type": "spot", "position": [0.1, y, 0.05], "direction": [0, -1, 0], "outer": 60, "intensity": [1, 1, 1] }]);
    for light in [point, spot] {
        assert_eq!(warnings(ball("floor"), light(1.1)), one("light_inside_wall", "/lights/0"));
        assert_eq!(warnings(ball("floor"), light(1.7)), none());
        assert_eq!(warnings(ball("floor"), light(0.3)), none());
        // On the floor.
        assert_eq!(warnings(json!([]), light(0.0)), one("light_inside_wall", "/lights/0"));
        assert_eq!(warnings(json!([]), light(1e-3)), none());
    }
    // Light gets out of glass, and of a lampshade.
    assert_eq!(warnings(ball("glass"), point(1.1)), none());
    let shade = json!([{ "type": "cylinder", "material": "floor", "from": [0, 0.5, 0], "to": [0, 1.5, 0], "radius": 0.5 }]);
    assert_eq!(warnings(shade, point(1.1)), none());
    // A room that the camera is in as well.
    let room = json!([{ "type": "box", "material": "floor", "center": [0, 2, 0], "size": [7, 3.9, 7] }]);
    assert_eq!(warnings(room, lamp()), none());
}

#[test]
fn f30_a_light_without_power_is_warned_of_at_its_place() {
    let mut lights = json!([{ "type": "point", "position": [0.1, 3, 0], "intensity": [1, 1, 1] },
                            { "type": "quad", "center": [1, 3, 0], "towards": [0, 0, 0], "size": [1, 1], "radiance": [0, 0, 0] }]);
    assert_eq!(warnings(json!([]), lights.clone()), one("zero_power_light", "/lights/1"));
    lights[1]["radiance"] = json!([0, 0.1, 0]);
    assert_eq!(warnings(json!([]), lights), none());
    let mut panel = json!({ "type": "polygon", "material": "floor", "vertices": [[2, 1, 1], [3, 1, 1], [3, 1, -1]], "emission": [0, 0, 0] });
    assert_eq!(warnings(json!([panel.clone()]), lamp()), one("zero_power_light", "/objects/1/emission"));
    panel["emission"] = json!([1, 0, 0]);
    assert_eq!(warnings(json!([panel]), lamp()), none());
}

#[test]
fn f54_one_specular_object_of_several_that_no_light_reaches_is_warned_of() {
    let ball =
        |x: f64, y: f64| json!({ "type": "sphere", "material": "glass", "center": [x, y, 0], "radius": 0.3 });
    assert_eq!(warnings(json!([ball(-1.0, 1.0), ball(1.0, 1.0)]), lamp()), none());
    // One is under the floor.
    assert_eq!(
        warnings(json!([ball(-1.0, 1.0), ball(1.0, -1.0)]), lamp()),
        one("unreachable_specular", "/objects/2")
    );
    // One within another has its light from there, though it is never met first.
    let outer = json!({ "type": "sphere", "material": "glass", "center": [0, 1, 0], "radius": 0.6 });
    assert_eq!(warnings(json!([outer, ball(0.0, 1.0)]), lamp()), none());
}

/// The plan as JSON, which the command line and the service give, says where each warning is about.
#[test]
fn plans_give_code_place_and_words_of_each_warning() {
    let pane = json!({ "name": "pane", "type": "polygon", "material": "glass", "vertices": [[-1, 1, 1], [1, 1, 1], [1, 1, -1], [-1, 1, -1]] });
    let scene = compile(&value(json!([pane]), lamp()));
    let plan = Plan::new(&scene);
    let json = plan_json(&scene, &plan);
    assert_eq!(json["warnings"][0]["code"], "open_dielectric");
    assert_eq!(json["warnings"][0]["pointer"], "/objects/1");
    assert!(json["warnings"][0]["message"].as_str().unwrap().contains("not closed"));
    let line = plan.warnings[0].to_string();
    assert!(line.starts_with("/objects/1: ") && line.ends_with(" [open_dielectric]"), "{line}");
}
