//! Models in binary glTF: what becomes of each part, and that the bad ones are refused.

use crate::glb::Glb;
use crate::textures::png;
use glam::Vec3;
use nephroid::geometry::Ray;
use nephroid::import::{ImportError, Imported, import_glb};
use nephroid::scene::{Dielectric, Ior, Light, Material, Projection, Scene, Texture};
use serde_json::{Value, json};

fn import(model: &Glb) -> Imported {
    import_glb(&model.bytes(), "parts").unwrap_or_else(|error| panic!("{error}"))
}

fn compile(imported: &Imported) -> Scene {
    Scene::from_json(&imported.scene, &imported.assets)
        .unwrap_or_else(|errors| panic!("{errors}\n{}", imported.scene))
}

fn document(imported: &Imported) -> Value {
    serde_json::from_str(&imported.scene).unwrap()
}

fn codes(imported: &Imported) -> Vec<&str> {
    imported.warnings.iter().map(|warning| warning.code).collect()
}

fn grey() -> Value {
    json!({ "name": "grey", "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.25, 0.125, 1], "metallicFactor": 0 } })
}

/// One square of a material at the origin.
fn of_material(material: Value) -> Glb {
    let mut model = Glb::new();
    let material = model.material(material);
    let mesh = model.square(material);
    model.node(json!({ "mesh": mesh }));
    model
}

/// The distance at which a ray meets something, and the normal there.
fn meets(scene: &Scene, from: Vec3, direction: Vec3) -> Option<(f32, Vec3)> {
    let hit = scene.geometry.closest_hit(&Ray::new(from, direction.normalize()))?;
    Some((hit.t, hit.surface.shading_normal))
}

#[test]
fn a_mesh_stands_where_its_nodes_say() {
    let mut model = Glb::new();
    let material = model.material(grey());
    let mesh = model.square(material);
    let child = model.push("nodes", json!({ "mesh": mesh, "translation": [0, 0, 1] }));
    // A quarter turn about y brings +z to +x.
    let s = 0.5_f64.sqrt();
    model.node(json!({ "children": [child], "rotation": [0, s, 0, s], "scale": [2, 2, 2], "translation": [5, 0, 0] }));
    let scene = compile(&import(&model));
    // (0, 0, 1) scaled by 2 and turned is (2, 0, 0).
    let (distance, normal) = meets(&scene, Vec3::new(10.0, 1.9, -1.9), Vec3::NEG_X).unwrap();
    assert!((distance - 3.0).abs() < 1e-5 && normal.distance(Vec3::X) < 1e-5, "{distance} {normal}");
    assert!(meets(&scene, Vec3::new(10.0, 2.1, 0.0), Vec3::NEG_X).is_none(), "it is 4 wide");
}

#[test]
fn a_mirrored_mesh_still_faces_outwards() {
    let mut model = Glb::new();
    let material = model.material(grey());
    let mesh = model.square(material);
    model.node(json!({ "mesh": mesh, "scale": [-1, 1, 1] }));
    let scene = compile(&import(&model));
    let hit = scene.geometry.closest_hit(&Ray::new(Vec3::Z, Vec3::NEG_Z)).unwrap();
    assert!(
        hit.surface.normal.distance(Vec3::Z) < 1e-6 && hit.surface.shading_normal.distance(Vec3::Z) < 1e-6
    );
}

#[test]
fn a_mesh_that_is_used_often_is_kept_once() {
    let mut model = Glb::new();
    let material = model.material(grey());
    let mesh = model.square(material);
    let s = 0.5_f64.sqrt();
    model.node(json!({ "mesh": mesh, "translation": [0, 0, -5] }));
    model.node(json!({ "mesh": mesh, "translation": [10, 0, 0], "rotation": [0, s, 0, s] }));
    model.node(json!({ "mesh": mesh, "translation": [0, 10, 0], "scale": [2, 3, 1] }));
    // Sheared: no instance of ours can be.
    model.node(json!({ "mesh": mesh, "matrix": [1, 0.5, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -10, 0, 1] }));
    let imported = import(&model);
    let document = document(&imported);
    let kinds: Vec<&str> =
        document["objects"].as_array().unwrap().iter().map(|o| o["type"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["mesh", "instance", "instance", "mesh"]);
    assert_eq!(imported.assets.files.len(), 2);
    let scene = compile(&imported);
    for (from, direction, distance) in [
        (Vec3::new(0.9, 0.9, 5.0), Vec3::NEG_Z, 10.0),
        (Vec3::new(15.0, 0.9, 0.9), Vec3::NEG_X, 5.0),
        (Vec3::new(1.9, 12.9, 5.0), Vec3::NEG_Z, 5.0),
        // The upper right corner (1, 1) is sheared to (1, 1.5).
        (Vec3::new(0.99, -10.0 + 1.4, 5.0), Vec3::NEG_Z, 5.0),
    ] {
        let (found, _) = meets(&scene, from, direction).unwrap_or_else(|| panic!("{from}"));
        assert!((found - distance).abs() < 1e-4, "{from}: {found}");
    }
}

#[test]
fn strips_fans_and_bare_corners_are_triangles() {
    let corners = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
    let around = [corners[0], corners[1], corners[3], corners[2]];
    let list = [corners[0], corners[1], corners[3], corners[0], corners[3], corners[2]];
    for (mode, positions) in [(5, &corners[..]), (6, &around[..]), (4, &list[..])] {
        let mut model = Glb::new();
        let positions = model.floats(positions);
        let primitive = json!({ "attributes": { "POSITION": positions }, "mode": mode });
        let mesh = model.push("meshes", json!({ "primitives": [primitive] }));
        model.node(json!({ "mesh": mesh }));
        let scene = compile(&import(&model));
        for (x, y) in [(-0.9, -0.9), (0.9, -0.8), (-0.9, 0.8), (0.9, 0.9)] {
            let hit = scene.geometry.closest_hit(&Ray::new(Vec3::new(x, y, 3.0), Vec3::NEG_Z));
            let hit = hit.unwrap_or_else(|| panic!("mode {mode}: {x} {y}"));
            assert_eq!(hit.surface.normal, Vec3::Z, "mode {mode}: all triangles face one side");
        }
    }
}

fn first_material(material: Value) -> (Material, Imported) {
    let imported = import(&of_material(material));
    (compile(&imported).materials[0].clone(), imported)
}

#[test]
fn a_base_colour_is_an_albedo() {
    let (material, imported) = first_material(grey());
    let albedo = Texture::Constant(Vec3::new(0.5, 0.25, 0.125));
    assert!(matches!(material, Material::Diffuse { albedo: found } if found == albedo));
    assert_eq!(document(&imported)["materials"]["grey"]["type"], "diffuse");
}

#[test]
fn a_base_colour_picture_is_taken_over_and_lies_as_it_did() {
    for factor in [1.0, 0.5] {
        let mut model = Glb::new();
        // Upper left white, upper right black, below grey.
        let texture = model.picture(&png(2, 2, &[255, 255, 255, 0, 0, 0, 188, 188, 188, 188, 188, 188]));
        let material = model.material(json!({ "pbrMetallicRoughness": { "metallicFactor": 0,
            "baseColorFactor": [factor, factor, factor, 1], "baseColorTexture": { "index": texture } } }));
        let mesh = model.square(material);
        model.node(json!({ "mesh": mesh }));
        let scene = compile(&import(&model));
        let Material::Diffuse { albedo } = &scene.materials[0] else { panic!("{:?}", scene.materials[0]) };
        for (x, y, expected) in [(-0.5, 0.5, 1.0), (0.5, 0.5, 0.0), (-0.5, -0.5, 0.503)] {
            let hit = scene.geometry.closest_hit(&Ray::new(Vec3::new(x, y, 3.0), Vec3::NEG_Z)).unwrap();
            let found = albedo.eval(hit.surface.texture).y;
            // Eight bits of sRGB.
            assert!((found - factor * expected).abs() < 0.004, "{factor} {x} {y}: {found}");
        }
    }
}

#[test]
fn transmission_is_glass_with_the_absorption_of_its_volume() {
    let half = 0.5_f32;
    let (material, imported) = first_material(json!({ "name": "glass",
        "pbrMetallicRoughness": { "roughnessFactor": 0 },
        "extensions": { "KHR_materials_transmission": { "transmissionFactor": 1 }, "KHR_materials_ior": { "ior": 1.33 },
            "KHR_materials_volume": { "thicknessFactor": 1, "attenuationDistance": 2, "attenuationColor": [half, 1, half] } } }));
    let Material::Glass { dielectric: Dielectric { ior, absorption, .. }, alpha: None } = material else {
        panic!("{material:?}")
    };
    let expected = Vec3::new(2.0_f32.ln() / 2.0, 0.0, 2.0_f32.ln() / 2.0);
    assert!(ior == Ior::Constant(1.33) && absorption.distance(expected) < 1e-6, "{absorption}");
    assert!(!codes(&imported).contains(&"thin_glass"));
}

/// glTF's dispersion is 20 over the Abbe number, of rough glass too.
#[test]
fn dispersion_and_roughness_of_glass_are_taken_over() {
    let glass = |roughness: f64| {
        first_material(json!({ "pbrMetallicRoughness": { "roughnessFactor": roughness },
            "extensions": { "KHR_materials_transmission": { "transmissionFactor": 1 },
                            "KHR_materials_dispersion": { "dispersion": 0.5 } } }))
    };
    let (smooth, _) = glass(0.0);
    let Material::Glass { dielectric, alpha: None } = smooth else { panic!("{smooth:?}") };
    assert_eq!(dielectric.ior, Ior::of_abbe(1.5, 40.0));
    let (rough, _) = glass(0.5);
    let Material::Glass { dielectric, alpha: Some(alpha) } = rough else { panic!("{rough:?}") };
    assert!(dielectric.ior == Ior::of_abbe(1.5, 40.0) && alpha.get() == 0.25);
}

#[test]
fn what_is_more_metal_than_not_is_metal() {
    let (material, _) = first_material(
        json!({ "pbrMetallicRoughness": { "baseColorFactor": [1, 0.75, 0.25, 1], "roughnessFactor": 0 } }),
    );
    assert!(matches!(material, Material::Metal { .. }), "{material:?}");
}

#[test]
fn emission_is_its_colour_times_its_strength() {
    let mut material = grey();
    material["emissiveFactor"] = json!([1, 0.5, 0]);
    material["extensions"] = json!({ "KHR_materials_emissive_strength": { "emissiveStrength": 8 } });
    let imported = import(&of_material(material));
    assert_eq!(document(&imported)["objects"][0]["emission"], json!([8, 4, 0]));
    assert_eq!(compile(&imported).lights.len(), 1);
    assert!(!codes(&imported).contains(&"light_added"));
}

#[test]
fn lights_keep_their_place_direction_and_strength() {
    let mut model = of_material(grey());
    model.light(
        json!({ "type": "point", "intensity": 10, "color": [1, 0.5, 0] }),
        json!({ "translation": [1, 2, 3] }),
    );
    // A quarter turn about x brings -z to +y... and its inverse to -y.
    let s = 0.5_f64.sqrt();
    model.light(json!({ "type": "directional", "intensity": 3 }), json!({ "rotation": [-s, 0, 0, s] }));
    let spot = json!({ "innerConeAngle": 0.2, "outerConeAngle": 0.4 });
    model.light(
        json!({ "type": "spot", "intensity": 5, "spot": spot, "range": 7 }),
        json!({ "translation": [0, 0, 4] }),
    );
    let imported = import(&model);
    assert!(codes(&imported).contains(&"range_ignored") && !codes(&imported).contains(&"light_added"));
    let scene = compile(&imported);
    let [
        Light::Point { position, intensity },
        Light::Directional { direction, irradiance },
        Light::Spot(spot),
    ] = &scene.lights[..]
    else {
        panic!("{:?}", scene.lights)
    };
    assert_eq!((*position, *intensity), (Vec3::new(1.0, 2.0, 3.0), Vec3::new(10.0, 5.0, 0.0)));
    assert!(direction.distance(Vec3::NEG_Y) < 1e-6 && *irradiance == Vec3::splat(3.0), "{direction}");
    assert!(
        spot.axis.distance(Vec3::NEG_Z) < 1e-6 && (spot.cos_outer - 0.4_f32.cos()).abs() < 1e-6,
        "{spot:?}"
    );
    assert!((spot.cos_inner - 0.2_f32.cos()).abs() < 1e-6 && spot.intensity == Vec3::splat(5.0));
}

#[test]
fn the_camera_of_the_model_is_used() {
    let mut model = of_material(grey());
    let camera = model.push(
        "cameras",
        json!({ "type": "perspective", "perspective": { "yfov": 0.5, "aspectRatio": 2, "znear": 0.1 } }),
    );
    model.node(json!({ "camera": camera, "translation": [0, 0, 7] }));
    let imported = import(&model);
    let scene = compile(&imported);
    assert_eq!((scene.camera.eye, scene.camera.forward), (Vec3::new(0.0, 0.0, 7.0), Vec3::NEG_Z));
    let Projection::Perspective { tan_half_fov, .. } = scene.camera.projection else { panic!("perspective") };
    assert!((tan_half_fov - 0.25_f32.tan()).abs() < 1e-6);
    assert_eq!((scene.image.width, scene.image.height), (960, 480));
    assert!(!codes(&imported).contains(&"camera_added"));
}

#[test]
fn a_model_without_light_and_camera_is_given_both_and_says_so() {
    let imported = import(&of_material(grey()));
    let codes = codes(&imported);
    assert!(codes.contains(&"camera_added") && codes.contains(&"light_added"), "{codes:?}");
    let scene = compile(&imported);
    // The camera sees all four corners of the square.
    for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
        let to = (Vec3::new(x, y, 0.0) - scene.camera.eye).normalize();
        let place =
            Vec3::new(to.dot(scene.camera.right), to.dot(scene.camera.up), to.dot(scene.camera.forward));
        let Projection::Perspective { tan_half_fov, .. } = scene.camera.projection else {
            panic!("perspective")
        };
        assert!(place.z > 0.0 && (place.truncate() / place.z).abs().max_element() < tan_half_fov, "{x} {y}");
    }
    assert!(!scene.environment.is_black() && scene.lights.len() == 1);
}

#[test]
fn what_a_scene_has_no_place_for_is_noted() {
    let mut model =
        of_material(json!({ "alphaMode": "BLEND", "pbrMetallicRoughness": { "metallicFactor": 0 } }));
    let colors = model.floats(&[[1.0_f32; 4]; 4]);
    model.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = colors.into();
    model.json["extensionsUsed"] = json!(["KHR_materials_clearcoat"]);
    let found = import(&model);
    let codes = codes(&found);
    for code in ["alpha_ignored", "vertex_colors_ignored", "extension_ignored"] {
        assert!(codes.contains(&code), "{code}: {codes:?}");
    }
}

/// What is changed in a good model, and what the refusal must say.
#[rustfmt::skip]
const BAD_MODELS: &[(&str, &str, &str)] = &[
    ("/accessors/0/count", "1000000000000", "accessors[0]"),
    ("/accessors/0/count", "18446744073709551615", "accessors[0]"),
    ("/accessors/0/count", "0", "accessors[0]"),
    ("/accessors/0/count", "5", "accessors[0]"),
    ("/accessors/0/byteOffset", "4", "accessors[0]"),
    ("/accessors/0/byteOffset", "18446744073709551615", "accessors[0]"),
    ("/accessors/0/type", "\"VEC2\"", "accessors[0]"),
    ("/accessors/0/componentType", "5123", "accessors[0]"),
    ("/accessors/0/sparse", r#"{ "count": 1, "indices": { "bufferView": 0, "componentType": 5123 }, "values": { "bufferView": 0 } }"#, "sparse"),
    ("/accessors/1/count", "3", "not one item per position"),
    ("/accessors/3/componentType", "5126", "accessors[3]"),
    ("/accessors/3/count", "1000", "accessors[3]"),
    ("/bufferViews/0/byteLength", "1000000000", "bufferViews[0]"),
    ("/bufferViews/0/byteOffset", "18446744073709551615", "bufferViews[0]"),
    ("/bufferViews/0/byteStride", "4", "accessors[0]"),
    ("/bufferViews/0/byteStride", "1", "byteStride"),
    ("/bufferViews/0/buffer", "7", "bufferViews[0]"),
    ("/meshes/0/primitives/0/attributes/POSITION", "99", "meshes[0]"),
    ("/meshes/0/primitives/0/indices", "99", "indices"),
    ("/nodes/0/children", "[0]", "child of two nodes"),
    ("/nodes/0/mesh", "5", "mesh"),
    ("/nodes/0/scale", "[1e38, 1, 1]", "finite"),
    ("/scenes/0/nodes", "[0, 0]", "child of two nodes"),
    ("/scenes/0/nodes", "[]", "nothing to see"),
    ("/cameras", r#"[{ "type": "orthographic", "perspective": { "yfov": 1, "znear": 1 } }]"#, "cameras[0]"),
    ("/images", r#"[{ "bufferView": 0 }]"#, "images[0]"),
    ("/extensionsRequired", r#"["KHR_draco_mesh_compression"]"#, "KHR_draco_mesh_compression"),
];

#[test]
fn a_model_whose_parts_do_not_fit_is_refused_with_the_place() {
    for (pointer, value, expected) in BAD_MODELS.iter().copied() {
        let mut model = of_material(grey());
        let (parent, field) = pointer.rsplit_once('/').unwrap();
        model.json.pointer_mut(parent).unwrap_or_else(|| panic!("{pointer}"))[field] =
            serde_json::from_str(value).unwrap();
        match import_glb(&model.bytes(), "parts") {
            Ok(_) => panic!("{pointer} {value}: read"),
            Err(error) => assert!(error.to_string().contains(expected), "{pointer} {value}: {error}"),
        }
    }
}

#[test]
fn an_index_beyond_the_vertices_is_refused() {
    let mut model = of_material(grey());
    let indices = model.indices(&[0, 1, 4]);
    model.json["meshes"][0]["primitives"][0]["indices"] = indices.into();
    let error = import_glb(&model.bytes(), "parts").unwrap_err().to_string();
    assert!(error.contains("accessors[4]: item 2 points at a vertex"), "{error}");
}

#[test]
fn a_position_that_is_no_number_is_refused() {
    let mut model = of_material(grey());
    model.data[4..8].copy_from_slice(&f32::NAN.to_le_bytes());
    let error = import_glb(&model.bytes(), "parts").unwrap_err().to_string();
    assert!(error.contains("vertex 0 is not a finite number"), "{error}");
}

/// A tree of nodes of which each has the next twice as a child would be 2^64 nodes.
#[test]
fn nodes_that_multiply_are_refused() {
    let mut model = of_material(grey());
    for level in 1..=64 {
        model.push("nodes", json!({ "children": [level + 1, level + 1] }));
    }
    model.push("nodes", json!({ "mesh": 0 }));
    model.json["scenes"][0]["nodes"] = json!([1]);
    assert!(matches!(import_glb(&model.bytes(), "parts"), Err(ImportError::Content { .. })));
}

/// What `nephroid` says with these arguments in a folder.
fn command(folder: &std::path::Path, arguments: &[&str]) -> (Option<i32>, String) {
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_nephroid"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap();
    let text = [output.stdout, output.stderr].concat();
    (output.status.code(), String::from_utf8_lossy(&text).into_owned())
}

#[test]
fn a_converted_model_renders_to_the_bytes_of_the_model_itself() {
    let folder = tempfile::tempdir().unwrap();
    let mut model = Glb::new();
    let texture = model.picture(&png(2, 2, &[255, 0, 0, 0, 255, 0, 0, 0, 255, 9, 9, 9]));
    let material = model.material(
        json!({ "name": "Käse/Brot", "pbrMetallicRoughness": { "metallicFactor": 0, "baseColorTexture": { "index": texture } } }),
    );
    let mesh = model.square(material);
    model.node(json!({ "mesh": mesh, "name": "../square" }));
    std::fs::write(folder.path().join("model.glb"), model.bytes()).unwrap();
    let (code, said) = command(folder.path(), &["convert", "model.glb", "-o", "scene.json"]);
    assert!(code == Some(0) && said.contains("[light_added]") && said.contains("with 2 files"), "{said}");
    for (scene, picture) in [("model.glb", "a.npy"), ("scene.json", "b.npy")] {
        let render = ["render", scene, "-o", picture, "--size", "32x24", "--rounds", "1", "--quiet"];
        assert_eq!(command(folder.path(), &render), (Some(0), String::new()));
    }
    let [a, b] = ["a.npy", "b.npy"].map(|name| std::fs::read(folder.path().join(name)).unwrap());
    assert!(a == b && a.len() == 128 + 32 * 24 * 12, "{}", a.len());
    let written: Vec<_> = std::fs::read_dir(folder.path().join("scene")).unwrap().collect();
    assert_eq!(written.len(), 2, "both files lie in the scene's own folder: {written:?}");
}

#[test]
fn every_truncation_of_a_model_is_an_error_and_no_panic() {
    let bytes = of_material(grey()).bytes();
    for end in 0..bytes.len() {
        assert!(import_glb(&bytes[..end], "parts").is_err(), "cut at {end}");
    }
}

#[test]
fn lengths_that_lie_are_refused() {
    let good = of_material(grey()).bytes();
    for at in [8, 12] {
        for length in [0_u32, 1, 11, 0x7fff_ffff, u32::MAX] {
            let mut bytes = good.clone();
            bytes[at..at + 4].copy_from_slice(&length.to_le_bytes());
            assert!(import_glb(&bytes, "parts").is_err(), "{length} at {at}");
        }
    }
}
