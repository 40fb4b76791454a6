//! The scene file: what is read, and that every error is found, named and placed.

use nephroid::scene::{
    AssetError, AssetSource, Dielectric, DirectoryAssets, Environment, Ior, IssueCode, Light, Material,
    NoAssets, Paths, Scene, SceneErrors, Stop, Texture, Tone,
};
use std::borrow::Cow;

use IssueCode as C;

const BASE: &str = r##"{ "nephroid": 1,
  "name": "base",
  "image": { "width": 40, "height": 30, "exposure": 0.5, "tone": "filmic" },
  "camera": { "type": "perspective", "eye": [0, 2.4, 4.2], "target": [0, 0.2, 0], "up": [0, 1, 0], "fov": 36 },
  "materials": {
    "floor": { "type": "diffuse", "albedo": { "checker": { "colors": [[1, 0, 0], "#ffff00"], "size": 0.5 } } },
    "silver": { "type": "mirror", "reflectance": [0.9, 0.9, 0.9] },
    "glass": { "type": "glass", "ior": 1.5 } },
  "objects": [
    { "name": "ground", "type": "polygon", "material": "floor",
      "vertices": [[-3, 0, 3], [3, 0, 3], [3, 0, -3], [-3, 0, -3]],
      "holes": [[[-1, 0, 1], [1, 0, 1], [0, 0, -1]]] },
    { "type": "sphere", "center": [0, 0.55, 0], "radius": 0.5, "material": "glass" },
    { "type": "mesh", "material": "silver", "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
      "triangles": [[0, 1, 2]], "normals": [[0, 0, 2], [0, 0, 1], [0, 0, 1]], "uvs": [[0, 0], [1, 0], [0, 1]] } ],
  "lights": [
    { "type": "quad", "center": [0, 3, 0], "size": [0.2, 0.4], "towards": [0, 0, 0], "radiance": [12, 12, 12],
      "edge": [0, 1, 1] },
    { "type": "point", "position": [0, 3, 1], "intensity": [1, 2, 3] },
    { "type": "directional", "direction": [0, -2, 0], "irradiance": [1, 1, 1] } ],
  "environment": { "radiance": [0.1, 0.2, 0.3] },
  "render": { "paths": "whitted", "stop": { "rounds": 8 }, "seed": 18446744073709551615 } }"##;

fn errors(text: &str) -> SceneErrors {
    Scene::from_json(text, &NoAssets).expect_err("the scene is wrong")
}

/// The base scene with one place changed.
fn changed(from: &str, to: &str) -> String {
    assert_eq!(BASE.matches(from).count(), 1, "`{from}` names one place");
    BASE.replace(from, to)
}

fn places(errors: &SceneErrors) -> Vec<(&str, IssueCode)> {
    errors.issues.iter().map(|issue| (issue.pointer.as_str(), issue.code)).collect()
}

#[test]
fn a_scene_is_compiled_as_it_is_written() {
    let scene = Scene::from_json(BASE, &NoAssets).unwrap();
    assert_eq!(scene.name, "base");
    assert_eq!((scene.image.width, scene.image.height), (40, 30));
    assert_eq!((scene.image.exposure, scene.image.tone), (0.5, Tone::Filmic));
    assert_eq!(scene.render.paths, Paths::Whitted);
    assert_eq!(scene.render.stop, Stop { error: None, seconds: None, rounds: Some(8) });
    assert_eq!(scene.render.seed, u64::MAX);
    assert_eq!(scene.environment, Environment::Constant(glam::Vec3::new(0.1, 0.2, 0.3)));
    let Material::Diffuse { albedo: Texture::Checker { colors, size } } = &scene.materials[0] else {
        panic!("a checkerboard: {:?}", scene.materials[0])
    };
    assert_eq!((colors[1].to_array(), *size), ([1.0, 1.0, 0.0], 0.5));
    let dielectric = Dielectric { ior: Ior::Constant(1.5), absorption: glam::Vec3::ZERO, priority: 0 };
    assert_eq!(scene.materials[2], Material::Glass { dielectric, alpha: None });
    assert_eq!(scene.objects[0].name, "ground");
    assert_eq!(scene.objects[1].material.index(), 2);
}

#[test]
fn what_is_left_out_has_its_default() {
    let text = r#"{ "nephroid": 1, "objects": [],
        "camera": { "type": "perspective", "eye": [0, 0, 1], "target": [0, 0, 0], "fov": 36 } }"#;
    let scene = Scene::from_json(text, &NoAssets).unwrap();
    assert_eq!((scene.image.width, scene.image.height, scene.image.tone), (640, 480, Tone::Linear));
    assert_eq!(scene.render.stop, Stop::default());
    assert_eq!((scene.render.paths, scene.render.seed), (Paths::Caustics, 0));
    assert!(scene.environment.is_black());
    assert_eq!(scene.camera.up.to_array(), [0.0, 1.0, 0.0]);
}

#[test]
fn a_quad_light_is_also_a_black_surface_that_emits() {
    let scene = Scene::from_json(BASE, &NoAssets).unwrap();
    let Light::Quad(quad) = &scene.lights[0] else { panic!("a quad: {:?}", scene.lights[0]) };
    assert_eq!(quad.normal.to_array(), [0.0, -1.0, 0.0]);
    // The edge (0, 1, 1) made perpendicular to the normal is z.
    assert_eq!(quad.half_u.to_array(), [0.0, 0.0, 0.1]);
    let [a, b, c, _] = quad.corners();
    assert!((b - a).cross(c - a).dot(quad.normal) > 0.0, "anticlockwise seen from the lit side");
    let surface = scene.objects.iter().find(|object| object.emitter.is_some()).unwrap();
    assert_eq!(surface.emitter.unwrap().index(), 0);
    let Material::Diffuse { albedo } = &scene.materials[surface.material.index()] else { panic!("diffuse") };
    assert!(albedo.is_black());
}

#[test]
fn a_light_that_looks_straight_down_has_its_width_along_x() {
    let scene = Scene::from_json(&changed(",\n      \"edge\": [0, 1, 1]", ""), &NoAssets).unwrap();
    let Light::Quad(quad) = &scene.lights[0] else { panic!("a quad") };
    assert_eq!(quad.half_u.to_array(), [0.1, 0.0, 0.0]);
}

/// What is changed in the base scene, into what, and the error that this must cause.
#[rustfmt::skip]
const BAD_SCENES: &[(&str, &str, &str, IssueCode)] = &[
    // Names and types.
    (r#""nephroid": 1"#, r#""nephroid": 2"#, "/nephroid", C::UnsupportedVersion),
    (r#""nephroid": 1"#, r#""nephroid": "1""#, "/nephroid", C::WrongType),
    (r#""nephroid": 1,"#, "", "/nephroid", C::MissingField),
    (r#""fov": 36"#, r#""fov": 36, "fow": 1"#, "/camera/fow", C::UnknownField),
    (r#""seed": 1844"#, r#""a/b~c": 1, "seed": 1844"#, "/render/a~1b~0c", C::UnknownField),
    (r#", "fov": 36"#, "", "/camera/fov", C::MissingField),
    (r#""fov": 36"#, r#""fov": "36""#, "/camera/fov", C::WrongType),
    (r#""name": "base""#, r#""name": """#, "/name", C::WrongLength),
    (r#""name": "base""#, r#""name": null"#, "/name", C::WrongType),
    (r#""name": "base""#, r#""name": "base", "name": "b""#, "/name", C::DuplicateKey),
    (r#""ior": 1.5"#, r#""ior": 1.5, "ior": 1.6"#, "/materials/glass/ior", C::DuplicateKey),
    (r#""type": "perspective""#, r#""type": "perspectiv""#, "/camera/type", C::UnknownValue),
    (r#""type": "perspective", "#, "", "/camera/type", C::MissingField),
    (r#""type": "glass""#, r#""type": 5"#, "/materials/glass/type", C::WrongType),
    (r#""material": "glass""#, r#""material": "glas""#, "/objects/1/material", C::UnknownReference),
    (r#""paths": "whitted""#, r#""paths": "everything""#, "/render/paths", C::UnknownValue),
    (r#""tone": "filmic""#, r#""tone": "film""#, "/image/tone", C::UnknownValue),
    // Numbers.
    (r#""radius": 0.5"#, r#""radius": 0"#, "/objects/1/radius", C::OutOfRange),
    (r#""radius": 0.5"#, r#""radius": -0.0"#, "/objects/1/radius", C::OutOfRange),
    (r#""radius": 0.5"#, r#""radius": -1"#, "/objects/1/radius", C::OutOfRange),
    (r#""radius": 0.5"#, r#""radius": 1e160"#, "/objects/1/radius", C::OutOfRange),
    (r#""radius": 0.5"#, r#""radius": 1e400"#, "/objects/1/radius", C::NotFinite),
    (r#""radius": 0.5"#, r#""radius": 1e-400"#, "/objects/1/radius", C::OutOfRange),
    ("[0, 0.55, 0]", "[0, -1e400, 0]", "/objects/1/center/1", C::NotFinite),
    ("[0, 0.55, 0]", "[0, 0.55]", "/objects/1/center", C::WrongLength),
    ("[0, 0.55, 0]", "[0, 0.55, null]", "/objects/1/center/2", C::WrongType),
    (r#""ior": 1.5"#, r#""ior": 0"#, "/materials/glass/ior", C::OutOfRange),
    ("[0.9, 0.9, 0.9]", "[0.9, 1.1, 0.9]", "/materials/silver/reflectance/1", C::OutOfRange),
    ("[0.9, 0.9, 0.9]", "0.9", "/materials/silver/reflectance", C::WrongType),
    ("#ffff00", "#fff", "/materials/floor/albedo/checker/colors/1", C::UnknownValue),
    (r##", "#ffff00""##, "", "/materials/floor/albedo/checker/colors", C::WrongLength),
    (r#""size": 0.5"#, r#""size": 0"#, "/materials/floor/albedo/checker/size", C::OutOfRange),
    (r#""width": 40"#, r#""width": 0"#, "/image/width", C::OutOfRange),
    (r#""width": 40"#, r#""width": 16385"#, "/image/width", C::OutOfRange),
    (r#""width": 40"#, r#""width": 40.5"#, "/image/width", C::OutOfRange),
    ("18446744073709551615", "18446744073709551616", "/render/seed", C::OutOfRange),
    (r#""rounds": 8"#, r#""rounds": 0"#, "/render/stop/rounds", C::OutOfRange),
    (r#""rounds": 8"#, r#""error": 2"#, "/render/stop/error", C::OutOfRange),
    (r#""rounds": 8"#, r#""seconds": 0"#, "/render/stop/seconds", C::OutOfRange),
    (r#""rounds": 8"#, "", "/render/stop", C::MissingField),
    // The camera.
    (r#""fov": 36"#, r#""fov": 0"#, "/camera/fov", C::OutOfRange),
    (r#""fov": 36"#, r#""fov": 180"#, "/camera/fov", C::OutOfRange),
    (r#""fov": 36"#, r#""fov": 179.999999999"#, "/camera/fov", C::OutOfRange),
    (r#""fov": 36"#, r#""fov": 1e-12"#, "/camera/fov", C::OutOfRange),
    ("[0, 2.4, 4.2]", "[0, 0.2, 0]", "/camera/target", C::Degenerate),
    ("[0, 2.4, 4.2]", "[0, 0.200000001, 0]", "/camera/target", C::Degenerate),
    (r#""up": [0, 1, 0]"#, r#""up": [0, 2.2, 4.2]"#, "/camera/up", C::Degenerate),
    (r#""up": [0, 1, 0]"#, r#""up": [0, 0, 0]"#, "/camera/up", C::Degenerate),
    // Shapes.
    ("[3, 0, -3], [-3, 0, -3]", "[3, 1e-2, -3], [-3, 0, -3]", "/objects/0/vertices/0", C::NotPlanar),
    ("[3, 0, 3], [3, 0, -3], [-3, 0, -3]", "[3, 0, 3]", "/objects/0/vertices", C::WrongLength),
    ("[3, 0, 3], [3, 0, -3], [-3, 0, -3]", "[3, 0, 3], [0, 0, 3]", "/objects/0/vertices", C::Degenerate),
    ("[3, 0, 3], [3, 0, -3], [-3, 0, -3]", "[3, 0, -3], [3, 0, 3], [-3, 0, -3]", "/objects/0/vertices", C::Degenerate),
    ("[0, 0, -1]", "[0, 0.5, -1]", "/objects/0/holes/0/2", C::NotPlanar),
    ("[0, 1, 2]", "[0, 1, 3]", "/objects/2/triangles/0/2", C::IndexOutOfRange),
    ("[0, 1, 2]", "[0, 1, -1]", "/objects/2/triangles/0/2", C::OutOfRange),
    ("[[0, 1, 2]]", "[]", "/objects/2/triangles", C::WrongLength),
    (r#""triangles": [[0, 1, 2]], "#, "", "/objects/2/triangles", C::MissingField),
    ("[0, 0, 2], ", "", "/objects/2/normals", C::WrongLength),
    ("[0, 0, 2], ", "[0, 0, 0], ", "/objects/2/normals/0", C::Degenerate),
    (r#""triangles": ["#, r#""asset": "a.ply", "triangles": ["#, "/objects/2/asset", C::AssetUnavailable),
    ("[0, 0, -1]", "[0, 0, 1]", "/objects/0/holes/0", C::Degenerate),
    // Lights.
    ("[0.2, 0.4]", "[0.2, 0]", "/lights/0/size/1", C::OutOfRange),
    (r#""towards": [0, 0, 0]"#, r#""towards": [0, 3, 0]"#, "/lights/0/towards", C::Degenerate),
    (r#""edge": [0, 1, 1]"#, r#""edge": [0, 1, 0]"#, "/lights/0/edge", C::Degenerate),
    ("[1, 2, 3]", "[1, -2, 3]", "/lights/1/intensity/1", C::OutOfRange),
    ("[0, -2, 0]", "[0, 0, 0]", "/lights/2/direction", C::Degenerate),
    // Text that is not JSON.
    ("[0, -2, 0]", "[0, NaN, 0]", "/lights/2/direction/1", C::Syntax),
    (r#""seed": 1844"#, r#""seed": 01844"#, "/render/seed", C::Syntax),
];

#[test]
fn f3_f6_f10_f11_f30_f71_f72_f76_each_error_is_found_at_its_place() {
    for (from, to, pointer, code) in BAD_SCENES.iter().copied() {
        let errors = errors(&changed(from, to));
        assert!(places(&errors).contains(&(pointer, code)), "{to}: expected {pointer} {code}, got\n{errors}");
        let expected = if to.contains("a.ply") { 5 } else { 1 };
        assert_eq!(errors.issues.len(), expected, "{to}: one error only, got\n{errors}");
    }
}

#[test]
fn all_errors_are_reported_at_once_in_the_order_of_the_text() {
    let text = changed("36 },", "200, \"zoom\": 2 },")
        .replace("\"ior\": 1.5", "\"iro\": 1.5")
        .replace("\"material\": \"silver\"", "\"material\": \"sliver\"")
        .replace("\"radius\": 0.5", "\"radius\": \"big\"")
        .replace("[3, 0, -3], [-3, 0, -3]", "[3, 1, -3], [-3, 0, -3]")
        .replace("\"edge\": [0, 1, 1]", "\"edge\": [0, 1, 0]");
    let errors = errors(&text);
    let expected = [
        ("/camera/fov", IssueCode::OutOfRange),
        ("/camera/zoom", IssueCode::UnknownField),
        ("/materials/glass/ior", IssueCode::MissingField),
        ("/materials/glass/iro", IssueCode::UnknownField),
        ("/objects/0/vertices/0", IssueCode::NotPlanar),
        ("/objects/1/radius", IssueCode::WrongType),
        ("/objects/2/material", IssueCode::UnknownReference),
        ("/lights/0/edge", IssueCode::Degenerate),
    ];
    assert_eq!(places(&errors), expected, "{errors}");
    let lines: Vec<usize> = errors.issues.iter().map(|issue| issue.line).collect();
    assert_eq!(lines, [4, 4, 8, 8, 11, 13, 14, 18]);
    // `"fov": 200`: the number, not the name, is at fault.
    assert_eq!(errors.issues[0].column, text.lines().nth(3).unwrap().find("200").unwrap() + 1);
}

#[test]
fn a_wrong_name_is_answered_with_the_nearest() {
    for (from, to, nearest) in [
        (r#""fov": 36"#, r#""fvo": 36"#, "`fov`"),
        (r#""radius": 0.5"#, r#""raduis": 0.5"#, "`radius`"),
        (r#""material": "silver""#, r#""material": "Sliver""#, "`silver`"),
        (r#""type": "sphere""#, r#""type": "shpere""#, "`sphere`"),
        (r#""paths": "whitted""#, r#""paths": "whited""#, "`whitted`"),
        (r#""environment""#, r#""enviroment""#, "`environment`"),
    ] {
        let errors = errors(&changed(from, to));
        let hint = format!("did you mean {nearest}?");
        assert!(errors.issues.iter().any(|issue| issue.message.contains(&hint)), "{to}: {errors}");
    }
}

#[test]
fn every_truncation_is_an_error_and_no_panic() {
    for end in (0..BASE.len()).filter(|end| BASE.is_char_boundary(*end)) {
        errors(&BASE[..end]);
    }
}

#[test]
fn a_wrong_byte_anywhere_causes_no_panic() {
    for (at, _) in BASE.char_indices() {
        for byte in ["", "[", "}", "\"", "-", "9", "e"] {
            let text = format!("{}{byte}{}", &BASE[..at], &BASE[at + 1..]);
            if let Err(errors) = Scene::from_json(&text, &NoAssets) {
                assert!(!errors.issues.is_empty(), "{text}");
            }
        }
    }
}

#[test]
fn f76_extreme_numbers_anywhere_cause_no_panic() {
    let is_number = |c: char| c.is_ascii_digit() || ['.', '-'].contains(&c);
    let starts: Vec<usize> = BASE
        .char_indices()
        .filter(|(at, c)| is_number(*c) && !BASE[..*at].ends_with(is_number))
        .map(|(at, _)| at)
        .collect();
    assert!(starts.len() > 100, "the numbers of the base scene are found");
    for at in starts {
        let rest = BASE[at..].trim_start_matches(is_number);
        for number in ["0", "-0.0", "1e-9", "1e9", "-1e9", "1e-300", "1e38", "1e308", "4294967295"] {
            let text = format!("{}{number}{rest}", &BASE[..at]);
            match Scene::from_json(&text, &NoAssets) {
                Ok(scene) => assert!(scene.camera.forward.is_finite(), "{text}"),
                Err(errors) => assert!(!errors.issues.is_empty(), "{text}"),
            }
        }
    }
}

#[test]
fn f76_whatever_is_not_a_scene_is_refused() {
    for text in ["", " ", "null", "1", "\"\"", "[]", "{}", "\u{feff}", "[[[[", "{\"a\":{\"a\":", "\0"] {
        errors(text);
    }
    let deep = format!("{}1{}", "[".repeat(10_000), "]".repeat(10_000));
    assert_eq!(places(&errors(&deep))[0].1, IssueCode::TooDeep);
    assert_eq!(
        places(&errors(&changed("\"seed\": ", &format!("\"seed\": {}", "{\"a\":".repeat(100)))))[0].1,
        IssueCode::TooDeep
    );
    let wide = format!("[{}1]", "1,".repeat(10_000_000));
    assert_eq!(places(&errors(&wide))[0].1, IssueCode::TooLarge);
}

#[test]
fn a_flood_of_errors_is_counted_and_not_listed() {
    let flood = format!("\"lights\": [{}{{ \"type\": \"quad\"", "{ \"type\": \"no\" },".repeat(5000));
    let errors = errors(&changed("\"lights\": [\n    { \"type\": \"quad\"", &flood));
    assert_eq!(errors.issues.len(), 1001);
    let last = errors.issues.last().unwrap();
    assert_eq!((last.code, last.message.as_str()), (IssueCode::TooManyIssues, "and 4000 more errors"));
}

#[test]
fn a_byte_order_mark_is_skipped() {
    Scene::from_json(&format!("\u{feff}{BASE}"), &NoAssets).unwrap();
}

/// One asset called `mesh`.
struct OneAsset(Vec<u8>);

impl AssetSource for OneAsset {
    fn read(&self, name: &str) -> Result<Cow<'_, [u8]>, AssetError> {
        if name == "mesh" { Ok(Cow::Borrowed(&self.0)) } else { Err(AssetError::NotFound(name.to_owned())) }
    }
}

const WITH_ASSET: &str = r#"{ "nephroid": 1, "materials": { "m": { "type": "glass", "ior": 1.3 } },
    "objects": [ { "type": "mesh", "asset": "mesh", "material": "m" }, { "type": "mesh", "asset": "mesh", "material": "m" } ],
    "camera": { "type": "perspective", "eye": [0, 0, 1], "target": [0, 0, 0], "fov": 36 } }"#;

#[test]
fn a_mesh_may_be_an_asset() {
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 5\nf 1//1 2//1 3//1\n";
    let scene = Scene::from_json(WITH_ASSET, &OneAsset(obj.into())).unwrap();
    assert_eq!(scene.objects.len(), 2);
}

#[test]
fn f36_bad_assets_are_errors_at_the_field_that_names_them() {
    for obj in [
        "v 0 0 0\nv 1 0 0\nv 0 1 0\n",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n",
        "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        "v 0 0 1e30\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 0\nf 1//1 2//1 3//1\n",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt inf 0\nf 1/1 2/1 3/1\n",
        "ply\n",
    ] {
        let errors = Scene::from_json(WITH_ASSET, &OneAsset(obj.into())).unwrap_err();
        let expected =
            [("/objects/0/asset", IssueCode::AssetInvalid), ("/objects/1/asset", IssueCode::AssetInvalid)];
        assert_eq!(places(&errors), expected, "{obj}: {errors}");
    }
    let errors = errors(WITH_ASSET);
    assert_eq!(places(&errors)[0], ("/objects/0/asset", IssueCode::AssetUnavailable));
}

fn sample_scenes() -> Vec<(String, String)> {
    let mut scenes: Vec<(String, String)> = std::fs::read_dir("scenes")
        .expect("the samples are in scenes/")
        .map(|entry| entry.expect("a readable folder").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "json"))
        .map(|path| (path.display().to_string(), std::fs::read_to_string(&path).expect("a text")))
        .collect();
    scenes.sort();
    scenes
}

#[test]
fn every_sample_scene_loads() {
    let scenes = sample_scenes();
    assert!(scenes.len() >= 5, "{scenes:?}");
    for (path, text) in scenes {
        let scene = Scene::from_json(&text, &DirectoryAssets::new("scenes"));
        let scene = scene.unwrap_or_else(|errors| panic!("{path}:\n{errors}"));
        assert!(!scene.name.is_empty() && scene.geometry.primitive_count() > 2, "{path}");
    }
}

#[test]
fn every_truncation_of_a_sample_scene_is_an_error_and_no_panic() {
    for (path, text) in sample_scenes() {
        let text = text.trim_end();
        for end in (0..text.len()).filter(|end| text.is_char_boundary(*end)) {
            assert!(Scene::from_json(&text[..end], &NoAssets).is_err(), "{path} cut at {end}");
        }
    }
}

#[test]
fn every_truncation_of_a_sample_mesh_is_an_error_and_no_panic() {
    let packed = std::fs::read("scenes/meshes/ring.ply.gz").unwrap();
    let mut plain = Vec::new();
    std::io::Read::read_to_end(&mut flate2::read::GzDecoder::new(&packed[..]), &mut plain).unwrap();
    // The whole file is read, so that the truncations fail for no other reason.
    Scene::from_json(WITH_ASSET, &OneAsset(plain.clone())).unwrap();
    for whole in [plain, packed] {
        for end in 0..whole.len() {
            let errors = Scene::from_json(WITH_ASSET, &OneAsset(whole[..end].to_vec())).unwrap_err();
            assert_eq!(places(&errors)[0], ("/objects/0/asset", IssueCode::AssetInvalid), "cut at {end}");
        }
    }
}
