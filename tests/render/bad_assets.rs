//! Damaged and hostile files of every format: an error with its reason, never a panic, in bounded memory.

use crate::glb::Glb;
use crate::textures::png;
use flate2::{Compression, write::GzEncoder};
use nephroid::image_io::{LinearImage, decode_hdr, encode_exr};
use nephroid::import::import_glb;
use nephroid::sampling::hash;
use nephroid::scene::{MemoryAssets, NoAssets, Scene};
use serde_json::{Value, json};
use std::io::Write;
use std::path::Path;
use std::process::Command;

fn scene(material: Value, environment: Value) -> Value {
    json!({ "nephroid": 1, "objects": [{ "type": "mesh", "asset": "file", "material": "m" }],
        "camera": { "type": "perspective", "eye": [0, 0, 5], "target": [0, 0, 0], "fov": 36 },
        "materials": { "m": material }, "environment": environment })
}

/// A scene whose one object is the mesh `file`.
fn with_mesh() -> Value {
    scene(json!({ "type": "glass", "ior": 1.5 }), json!({ "radiance": [1, 1, 1] }))
}

/// A scene with the picture `file` on its one object.
fn with_texture() -> Value {
    let mut value =
        scene(json!({ "type": "diffuse", "albedo": { "image": "file" } }), json!({ "radiance": [1, 1, 1] }));
    value["objects"] = json!([{ "type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "m" }]);
    value
}

/// A scene with the sky `file`.
fn with_sky() -> Value {
    let mut value = with_texture();
    value["materials"] = json!({ "m": { "type": "glass", "ior": 1.5 } });
    value["environment"] = json!({ "image": "file" });
    value
}

/// Runs `read` on truncations of a good file and on copies with a few bytes changed. What is read of them, or why not,
/// does not matter here.
fn damage(file: &[u8], seed: u64, read: impl Fn(&[u8])) {
    const CASES: u64 = 500;
    read(file);
    for case in 0..CASES {
        let draw = |i: u64| hash(hash(seed, case), i);
        let mut bytes = file.to_vec();
        let place = |i: u64| (draw(i) % file.len() as u64) as usize;
        match case % 4 {
            0 => bytes.truncate(place(0)),
            1 => (0..4).for_each(|i| bytes[place(i)] ^= 1 << (draw(i + 10) % 8)),
            2 => bytes[place(0)] = draw(1) as u8,
            // A length or a count that is far too large.
            _ => {
                let at = place(0);
                bytes.iter_mut().skip(at).take(4).for_each(|byte| *byte = 0xff);
            }
        }
        read(&bytes);
    }
}

fn damage_in(scene: &Value, file: &[u8], seed: u64) {
    let text = scene.to_string();
    damage(file, seed, |bytes| {
        let assets = MemoryAssets { files: [("file".to_owned(), bytes.to_vec())].into() };
        if let Err(errors) = Scene::from_json(&text, &assets) {
            assert!(!errors.issues.is_empty());
        }
    });
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\n";
const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
    element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

fn binary_ply() -> Vec<u8> {
    let mut bytes = PLY.replace("ascii", "binary_little_endian").into_bytes();
    bytes.truncate(
        PLY.len() - "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n".len() + "binary_little_endian".len() - "ascii".len(),
    );
    bytes.extend([0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].into_iter().flat_map(f32::to_le_bytes));
    bytes.push(3);
    bytes.extend([0_i32, 1, 2].into_iter().flat_map(i32::to_le_bytes));
    bytes
}

fn picture() -> Vec<u8> {
    png(16, 16, &(0..768).map(|i| (i * 7) as u8).collect::<Vec<_>>())
}

fn jpeg() -> Vec<u8> {
    use image::ImageEncoder;
    let mut bytes = Vec::new();
    image::codecs::jpeg::JpegEncoder::new(&mut bytes)
        .write_image(
            &(0..768).map(|i| (i * 7) as u8).collect::<Vec<_>>(),
            16,
            16,
            image::ExtendedColorType::Rgb8,
        )
        .unwrap();
    bytes
}

fn exr() -> Vec<u8> {
    let pixels = (0..128).map(|i| [i as f32, 1.0, 0.5]).collect();
    encode_exr(&LinearImage { width: 16, height: 8, pixels }).unwrap()
}

fn hdr() -> Vec<u8> {
    let pixels: Vec<_> = (0..128).map(|i| image::Rgb([i as f32, 1.0, 0.5])).collect();
    let mut bytes = Vec::new();
    image::codecs::hdr::HdrEncoder::new(&mut bytes).encode(&pixels, 16, 8).unwrap();
    bytes
}

fn model() -> Vec<u8> {
    let mut model = Glb::new();
    let texture = model.picture(&picture());
    let material = model.material(json!({ "name": "m", "pbrMetallicRoughness": { "metallicFactor": 0,
        "baseColorTexture": { "index": texture } }, "extensions": { "KHR_materials_ior": { "ior": 1.4 } } }));
    let mesh = model.square(material);
    model.node(json!({ "mesh": mesh, "scale": [1, 2, 3] }));
    model.node(json!({ "mesh": mesh, "translation": [1, 2, 3] }));
    model.light(json!({ "type": "point", "intensity": 10 }), json!({ "translation": [1, 2, 3] }));
    let camera =
        model.push("cameras", json!({ "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1 } }));
    model.node(json!({ "camera": camera, "translation": [0, 0, 7] }));
    model.bytes()
}

#[test]
fn damaged_meshes_cause_no_panic() {
    for (seed, file) in
        [OBJ.into(), PLY.into(), binary_ply(), gzip(&binary_ply()), gzip(OBJ.as_bytes())].iter().enumerate()
    {
        damage_in(&with_mesh(), file, seed as u64);
    }
}

#[test]
fn damaged_textures_cause_no_panic() {
    damage_in(&with_texture(), &picture(), 10);
    damage_in(&with_texture(), &jpeg(), 11);
}

#[test]
fn damaged_skies_cause_no_panic() {
    damage_in(&with_sky(), &exr(), 20);
    damage_in(&with_sky(), &hdr(), 21);
}

/// Marks of runs of length zero, each of which multiplies the next by 256: more of them than a length has bytes.
#[test]
fn runs_of_no_length_in_a_sky_cause_no_panic() {
    let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 16\n\x09\x09\x09\x80".to_vec();
    for _ in 0..12 {
        bytes.extend([1, 1, 1, 0]);
    }
    let _ = decode_hdr(&bytes, 1 << 20);
}

#[test]
fn damaged_models_cause_no_panic_and_what_is_read_of_them_can_be_compiled_or_is_refused() {
    damage(&model(), 30, |bytes| {
        if let Ok(imported) = import_glb(bytes, "parts") {
            let _ = Scene::from_json(&imported.scene, &imported.assets);
        }
    });
}

#[test]
fn damaged_pictures_to_compare_cause_no_panic() {
    damage(&exr(), 40, |bytes| {
        let _ = decode_hdr(bytes, 1 << 20);
    });
}

/// Every description with one number replaced by an extreme one.
#[test]
fn extreme_numbers_in_a_model_cause_no_panic() {
    let file = model();
    let length = u32::from_le_bytes(*file[12..].first_chunk().unwrap()) as usize;
    let text = std::str::from_utf8(&file[20..20 + length]).unwrap();
    let is_number = |c: char| c.is_ascii_digit() || c == '.';
    let starts = text.char_indices().filter(|(at, c)| is_number(*c) && !text[..*at].ends_with(is_number));
    for (at, _) in starts {
        let rest = text[at..].trim_start_matches(is_number);
        for number in ["0", "-1", "7", "1e30", "4294967295", "18446744073709551615", "null"] {
            let mut changed = format!("{}{number}{rest}", &text[..at]).into_bytes();
            changed.resize(changed.len().next_multiple_of(4), b' ');
            let chunks =
                [&(changed.len() as u32).to_le_bytes()[..], b"JSON", &changed, &file[20 + length..]].concat();
            let total = (12 + chunks.len()) as u32;
            let bytes = [&b"glTF"[..], &2_u32.to_le_bytes(), &total.to_le_bytes(), &chunks].concat();
            if let Ok(imported) = import_glb(&bytes, "parts") {
                let _ = Scene::from_json(&imported.scene, &imported.assets);
            }
        }
    }
}

#[test]
fn an_asset_is_only_asked_for_where_there_are_any() {
    for value in [with_mesh(), with_texture(), with_sky()] {
        let errors = Scene::from_json(&value.to_string(), &NoAssets).unwrap_err();
        assert_eq!(errors.issues.len(), 1, "{errors}");
        assert_eq!(errors.issues[0].code, nephroid::scene::IssueCode::AssetUnavailable);
    }
}

/// A PNG whose header claims another size.
fn claiming(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = picture();
    bytes[16..20].copy_from_slice(&width.to_be_bytes());
    bytes[20..24].copy_from_slice(&height.to_be_bytes());
    let mut crc = flate2::Crc::new();
    crc.update(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&crc.sum().to_be_bytes());
    bytes
}

/// What `nephroid check` says of a file within 1 GiB of address space, which the command itself takes little of. A bomb
/// that went off would take ten times that and end the process.
#[cfg(unix)]
fn check_within_a_gibibyte(path: &Path) -> (Option<i32>, String) {
    let limited = "ulimit -v 1048576 && exec \"$0\" check \"$1\"";
    let output =
        Command::new("sh").args(["-c", limited, env!("CARGO_BIN_EXE_nephroid")]).arg(path).output().unwrap();
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[cfg(unix)]
#[test]
fn bombs_are_refused_in_bounded_memory() {
    let folder = tempfile::tempdir().unwrap();
    let huge_ply = PLY.replace("element vertex 3", "element vertex 4000000000");
    let huge_face = PLY.replace("3 0 1 2", "4000000000 0 1 2");
    let huge_hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 60000\n".to_vec();
    let wide_hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4096 +X 8192\n".to_vec();
    for (name, value, file, reason) in [
        ("a picture of 60 000 pixels", with_texture(), claiming(60_000, 60_000), "60000 × 60000"),
        ("a picture as large as allowed, without its data", with_texture(), claiming(8192, 8192), "decoded"),
        ("a sky of 60 000 pixels", with_sky(), huge_hdr, "60000 × 60000"),
        ("a sky as large as allowed, without its data", with_sky(), wide_hdr, "HDR"),
        ("a mesh of 4e9 vertices", with_mesh(), huge_ply.into_bytes(), "4000000000"),
        ("a face of 4e9 corners", with_mesh(), huge_face.into_bytes(), "face 0"),
        ("a quarter of a gibibyte of nothing", with_mesh(), gzip(&vec![0; 1 << 28]), "inflates"),
    ] {
        std::fs::write(folder.path().join("file"), file).unwrap();
        let path = folder.path().join("scene.json");
        std::fs::write(&path, value.to_string()).unwrap();
        let (code, said) = check_within_a_gibibyte(&path);
        assert!(code == Some(1) && said.contains(reason), "{name}: {code:?} {said}");
    }
    let mut model = Glb::new();
    let material = model.material(json!({ "name": "m" }));
    let mesh = model.square(material);
    model.node(json!({ "mesh": mesh }));
    model.json["accessors"][0]["count"] = 1_000_000_000_000_u64.into();
    let path = folder.path().join("model.glb");
    std::fs::write(&path, model.bytes()).unwrap();
    let (code, said) = check_within_a_gibibyte(&path);
    assert!(code == Some(1) && said.contains("accessors[0]"), "{code:?} {said}");
    // The limit itself is not what refuses: a good scene passes it.
    let (code, said) = check_within_a_gibibyte(Path::new("scenes/glass-ball.json"));
    assert_eq!(code, Some(0), "{said}");
}
