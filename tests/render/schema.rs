//! The scene file's JSON Schema: valid itself, and of one mind with the reader.

use crate::support::{camera_above, floor, scene};
use jsonschema::Validator;
use nephroid::scene::{NoAssets, Scene, schema, schema_markdown};
use serde_json::{Value, json};

fn validator() -> Validator {
    jsonschema::draft202012::new(&schema()).expect("a schema")
}

#[test]
fn the_schema_is_itself_valid() {
    if let Err(error) = jsonschema::draft202012::meta::validate(&schema()) {
        panic!("{error}");
    }
}

#[test]
fn every_sample_scene_is_valid_by_the_schema() {
    let validator = validator();
    let mut seen = 0;
    for entry in std::fs::read_dir("scenes").unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "json") {
            continue;
        }
        let scene: Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
        let errors: Vec<String> = validator.iter_errors(&scene).map(|e| e.to_string()).collect();
        assert!(errors.is_empty(), "{}: {errors:#?}", path.display());
        seen += 1;
    }
    assert!(seen >= 5, "the samples were found");
}

/// One of each kind of field.
fn good() -> Value {
    let mut scene = scene(
        camera_above([0.0, 0.0, 0.0], 2.0, 1.0),
        json!([
            floor(1.0, 0.0),
            { "type": "sphere", "center": [0, 1, 0], "radius": 0.5, "material": "glass" },
            { "type": "mesh", "material": "mirror", "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "triangles": [[0, 1, 2]] },
        ]),
        json!([
            { "type": "point", "position": [0, 3, 0], "intensity": "#ffcc88" },
            { "type": "directional", "direction": [0, -1, 0], "irradiance": [1, 1, 1] },
        ]),
    );
    scene["materials"]["squares"] = json!({ "type": "diffuse", "albedo": { "checker": { "colors": [[0, 0, 0], "#ffffff"], "size": 1 } } });
    scene["render"]["seed"] = u64::MAX.into();
    scene
}

/// A place of the good scene and a value that is wrong there; null takes the place away.
fn breaks() -> Vec<(&'static str, Value)> {
    vec![
        ("/nephroid", json!(2)),
        ("/nephroid", json!("1")),
        ("/nephroid", Value::Null),
        ("/camera", Value::Null),
        ("/camera/fov", json!(0)),
        ("/camera/fov", json!(180)),
        ("/camera/fov", json!("36")),
        ("/camera/fow", json!(36)),
        ("/camera/type", json!("pinhole")),
        ("/camera/type", Value::Null),
        ("/camera/eye", json!([0, 1])),
        ("/camera/eye", json!([0, 1, 2, 3])),
        ("/camera/eye", json!([0, 1, 2e9])),
        ("/camera/up", json!([0, 0, 0])),
        ("/image/width", json!(0)),
        ("/image/width", json!(16_385)),
        ("/image/width", json!(1.5)),
        ("/image/tone", json!("none")),
        ("/materials/glass/ior", json!(0)),
        ("/materials/glass/ior", Value::Null),
        ("/materials/glass/roghness", json!(0.1)),
        ("/materials/glass/type", json!("ice")),
        ("/materials/mirror/reflectance", json!([0.9, 0.9, 1.1])),
        ("/materials/mirror/reflectance", json!("#fff")),
        ("/materials/mirror/reflectance", json!("red")),
        ("/materials/squares/albedo", json!({ "checker": { "colors": [[0, 0, 0]], "size": 1 } })),
        ("/materials/squares/albedo", json!({ "checkers": {} })),
        ("/objects", Value::Null),
        ("/objects/0/vertices", json!([[0, 0, 0], [1, 0, 0]])),
        ("/objects/1/radius", json!(0)),
        ("/objects/1/radius", Value::Null),
        ("/objects/1/size", json!([1, 1, 1])),
        ("/objects/1/material", json!(3)),
        ("/objects/1/name", json!("")),
        ("/objects/1/name", json!("n".repeat(201))),
        ("/objects/1/emission", json!([-1, 0, 0])),
        ("/objects/2/triangles", json!([])),
        ("/objects/2/triangles", json!([[0, 1, -2]])),
        ("/lights/0/intensity", json!([1e13, 0, 0])),
        ("/lights/1/direction", json!([0, 1e-10, 0])),
        ("/render/stop/error", json!(0)),
        ("/render/stop/error", json!(1.5)),
        ("/render/stop/rounds", json!(0)),
        ("/render/paths", json!("all")),
        ("/render/seed", json!(-1)),
        ("/render/light_grid", json!(65)),
        ("/rendr", json!({})),
    ]
}

fn put(scene: &mut Value, pointer: &str, value: Value) {
    let (parent, name) = pointer.rsplit_once('/').unwrap();
    let parent = scene.pointer_mut(parent).unwrap();
    if value.is_null() {
        parent.as_object_mut().unwrap().remove(name).unwrap();
    } else {
        parent[name] = value;
    }
}

#[test]
fn what_the_reader_refuses_field_by_field_the_schema_refuses_too() {
    let validator = validator();
    let errors: Vec<String> = validator.iter_errors(&good()).map(|e| e.to_string()).collect();
    assert!(errors.is_empty(), "{errors:#?}");
    Scene::from_json(&good().to_string(), &NoAssets).unwrap();
    for (pointer, value) in breaks() {
        let mut broken = good();
        put(&mut broken, pointer, value.clone());
        assert!(Scene::from_json(&broken.to_string(), &NoAssets).is_err(), "reader: {pointer} {value}");
        assert!(!validator.is_valid(&broken), "schema: {pointer} {value}");
    }
}

/// Every object of the schema that lists fields.
fn records<'v>(value: &'v Value, found: &mut Vec<&'v Value>) {
    if value["properties"].is_object() && value["additionalProperties"] == false {
        found.push(value);
    }
    match value {
        Value::Object(members) => members.values().for_each(|v| records(v, found)),
        Value::Array(items) => items.iter().for_each(|v| records(v, found)),
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => {}
    }
}

#[test]
fn every_field_has_a_description() {
    let schema = schema();
    let mut found = Vec::new();
    records(&schema, &mut found);
    assert!(found.len() > 25, "{}", found.len());
    for record in found {
        for (name, field) in record["properties"].as_object().unwrap() {
            let described = field["description"].as_str().is_some_and(|text| text.len() > 4);
            assert!(described || name == "type" || field["const"].is_string(), "{name}: {field}");
        }
    }
}

#[test]
fn units_and_defaults_are_part_of_it() {
    let schema = schema();
    let camera = schema["$defs"]["camera"]["oneOf"].as_array().unwrap();
    let lens = camera.iter().find(|variant| variant["properties"]["type"]["const"] == "perspective").unwrap();
    assert_eq!(lens["properties"]["fov"]["x-unit"], "°");
    assert_eq!(lens["properties"]["aperture"]["default"], 0);
    assert_eq!(lens["properties"]["up"]["default"], json!([0, 1, 0]));
    assert_eq!(schema["$defs"]["render"]["properties"]["paths"]["default"], "caustics");
}

/// What a record says of defaults is what its reader does.
#[test]
fn a_scene_with_every_default_written_out_is_the_scene_without_them() {
    let bare = json!({ "nephroid": 1, "objects": [], "camera": camera_above([0.0, 0.0, 0.0], 2.0, 1.0) });
    let schema = schema();
    let mut full = bare.clone();
    for (place, defaults) in
        [("", &schema), ("/image", &schema["$defs"]["image"]), ("/render", &schema["$defs"]["render"])]
    {
        if full.pointer(place).is_none() {
            put(&mut full, place, json!({}));
        }
        for (name, field) in defaults["properties"].as_object().unwrap() {
            if let Some(default) = field.get("default") {
                full.pointer_mut(place).unwrap()[name] = default.clone();
            }
        }
    }
    let [bare, full] = [bare, full].map(|v| Scene::from_json(&v.to_string(), &NoAssets).unwrap());
    assert_eq!((bare.image, bare.render), (full.image, full.render));
}

#[test]
fn the_reference_in_docs_is_up_to_date() {
    let written = std::fs::read_to_string("docs/scene-format.md").unwrap_or_default();
    assert!(
        written == schema_markdown(),
        "run `cargo run -- schema --markdown > docs/scene-format.md` and commit the result"
    );
}
