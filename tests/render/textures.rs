//! Pictures on surfaces: where they lie on each shape, and that the bad ones are refused.

use crate::support::{camera_above, floor, scene};
use glam::{Vec2, Vec3};
use image::{ExtendedColorType, ImageEncoder};
use nephroid::geometry::Ray;
use nephroid::scene::{IssueCode, Material, MemoryAssets, Scene};
use serde_json::{Value, json};

pub(crate) fn png(width: u32, height: u32, texels: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let encoder = image::codecs::png::PngEncoder::new(&mut bytes);
    encoder.write_image(texels, width, height, ExtendedColorType::Rgb8).unwrap();
    bytes
}

/// Lower left red, lower right green, upper left blue, upper right white.
fn assets() -> MemoryAssets {
    let four = png(2, 2, &[0, 0, 255, 255, 255, 255, 255, 0, 0, 0, 255, 0]);
    MemoryAssets { files: [("four.png".to_owned(), four)].into() }
}

fn textured(objects: Value) -> Value {
    let mut value = scene(camera_above([0.0, 0.0, 0.0], 2.0, 1.0), objects, json!([]));
    value["materials"]["picture"] = json!({ "type": "diffuse", "albedo": { "image": "four.png" } });
    value
}

/// The colour that a ray from `from` towards `to` meets.
fn color(scene: &Scene, from: Vec3, to: Vec3) -> Vec3 {
    let hit = scene.geometry.closest_hit(&Ray::new(from, (to - from).normalize())).expect("a hit");
    match scene.material_of(hit.object) {
        Material::Diffuse { albedo } => albedo.eval(hit.surface.texture),
        other => panic!("diffuse: {other:?}"),
    }
}

fn compile(value: &Value) -> Scene {
    Scene::from_json(&value.to_string(), &assets()).unwrap_or_else(|e| panic!("{e}"))
}

/// Looked at from `eye`, with `right` to the right and `up` up, the quarters of a picture centred on `middle`.
fn assert_upright(scene: &Scene, eye: Vec3, middle: Vec3, [right, up]: [Vec3; 2], name: &str) {
    for (x, y, expected) in
        [(-1.0, -1.0, Vec3::X), (1.0, -1.0, Vec3::Y), (-1.0, 1.0, Vec3::Z), (1.0, 1.0, Vec3::ONE)]
    {
        let found = color(scene, eye, middle + right * x + up * y);
        // The ray's point is a texel's centre but for its rounding.
        assert!((found - expected).abs().max_element() < 1e-4, "{name} {x} {y}: {found}, not {expected}");
    }
}

#[test]
fn a_picture_stands_upright_on_a_wall_whose_outline_begins_at_the_lower_left() {
    let wall = json!({ "type": "polygon", "material": "picture", "vertices": [[2, 1, 0], [3, 1, 0], [3, 2, 0], [2, 2, 0]] });
    let scene = compile(&textured(json!([wall])));
    let middle = Vec3::new(2.5, 1.5, 0.0);
    assert_upright(&scene, middle + Vec3::Z, middle, [Vec3::X * 0.25, Vec3::Y * 0.25], "wall");
}

#[test]
fn a_picture_stands_upright_on_each_side_of_a_box() {
    let cube = json!({ "type": "box", "material": "picture", "center": [1, 2, 3], "size": [1, 1, 1] });
    let scene = compile(&textured(json!([cube])));
    let center = Vec3::new(1.0, 2.0, 3.0);
    for (out, up) in [
        (Vec3::X, Vec3::Y),
        (Vec3::NEG_X, Vec3::Y),
        (Vec3::Z, Vec3::Y),
        (Vec3::NEG_Z, Vec3::Y),
        (Vec3::Y, Vec3::NEG_Z),
        (Vec3::NEG_Y, Vec3::Z),
    ] {
        let right = up.cross(out) * 0.25;
        assert_upright(&scene, center + out * 2.0, center + out * 0.5, [right, up * 0.25], &out.to_string());
    }
}

/// Seen from the side that the middle of the picture faces, its halves lie left and right.
#[test]
fn a_picture_goes_once_around_a_sphere_and_a_cylinder() {
    let ball = json!({ "type": "sphere", "material": "picture", "center": [0, 5, 0], "radius": 1 });
    let tube =
        json!({ "type": "cylinder", "material": "picture", "from": [0, 0, 0], "to": [0, 2, 0], "radius": 1 });
    let scene = compile(&textured(json!([ball, tube])));
    // Longitudes of 90° left and right of the middle, latitudes of 45° below and above the equator.
    let s = 0.5_f32.sqrt();
    let center = Vec3::new(0.0, 5.0, 0.0);
    for (x, y, expected) in [(-s, -s, Vec3::X), (s, -s, Vec3::Y), (-s, s, Vec3::Z), (s, s, Vec3::ONE)] {
        let found = color(&scene, center + Vec3::new(x, y, 0.0) * 3.0, center);
        assert!((found - expected).abs().max_element() < 1e-4, "ball {x} {y}: {found}");
    }
    let turns: Vec<Vec3> = (0..4)
        .map(|quarter| {
            let angle = (f32::from(quarter as u8) + 0.5) * std::f32::consts::FRAC_PI_2;
            // Half up the lower half; to the right seen from outside is anticlockwise seen from above.
            let axis = Vec3::new(0.0, 0.5, 0.0);
            color(&scene, axis + Vec3::new(angle.cos(), 0.0, -angle.sin()) * 3.0, axis)
        })
        .collect();
    let mut around = turns.clone();
    around.rotate_left(2);
    let swapped = |c: &Vec3| Vec3::new(c.y, c.x, c.z);
    // The lower row is red and green: half a turn on, the two have changed places.
    for (here, there) in turns.iter().zip(&around) {
        assert!((*here - swapped(there)).abs().max_element() < 1e-4, "{turns:?}");
    }
}

#[test]
fn a_picture_on_a_mesh_lies_by_the_meshs_own_coordinates() {
    let mesh = json!({ "type": "mesh", "material": "picture", "positions": [[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]],
        "triangles": [[0, 1, 2], [0, 2, 3]], "uvs": [[0, 0], [1, 0], [1, 1], [0, 1]] });
    let scene = compile(&textured(json!([mesh])));
    let middle = Vec3::new(2.0, 2.0, 0.0);
    assert_upright(&scene, middle + Vec3::Z, middle, [Vec3::X, Vec3::Y], "mesh");
}

#[test]
fn materials_share_a_picture_that_is_loaded_once() {
    let mut value = textured(json!([floor(1.0, 0.0)]));
    value["materials"]["again"] =
        json!({ "type": "diffuse", "albedo": { "image": "four.png", "scale": [2, 1] } });
    let scene = compile(&value);
    let images: Vec<_> = scene
        .materials
        .iter()
        .filter_map(|material| match material {
            Material::Diffuse { albedo: nephroid::scene::Texture::Image { image, scale } } => {
                Some((image, *scale))
            }
            _ => None,
        })
        .collect();
    let [(a, scale), (b, plain)] = images[..] else { panic!("two: {images:?}") };
    assert!(std::sync::Arc::ptr_eq(a, b));
    assert_eq!((scale, plain), (Vec2::new(2.0, 1.0), Vec2::ONE));
    assert_eq!(scene.image_bytes, 12);
}

#[test]
fn a_bad_picture_is_an_error_at_the_field_that_names_it() {
    let mut bomb = png(1, 1, &[0; 3]);
    for side in [16..20, 20..24] {
        bomb[side].copy_from_slice(&60_000_u32.to_be_bytes());
    }
    let mut crc = flate2::Crc::new();
    crc.update(&bomb[12..29]);
    bomb[29..33].copy_from_slice(&crc.sum().to_be_bytes());
    let good = assets().files.remove("four.png").unwrap();
    for (bytes, code) in [
        (bomb, IssueCode::TooLarge),
        (good[..good.len() - 20].to_vec(), IssueCode::AssetInvalid),
        (b"not a picture".to_vec(), IssueCode::AssetInvalid),
    ] {
        let value = textured(json!([floor(1.0, 0.0)]));
        let assets = MemoryAssets { files: [("four.png".to_owned(), bytes)].into() };
        let errors = Scene::from_json(&value.to_string(), &assets).unwrap_err();
        assert_eq!(errors.issues.len(), 1, "{errors}");
        let issue = &errors.issues[0];
        assert_eq!(
            (issue.pointer.as_str(), issue.code),
            ("/materials/picture/albedo/image", code),
            "{errors}"
        );
    }
}

#[test]
fn an_albedo_that_is_neither_a_colour_nor_a_pattern_is_told_what_there_is() {
    let mut value = textured(json!([floor(1.0, 0.0)]));
    value["materials"]["picture"]["albedo"] = json!({ "imge": "four.png" });
    let errors = Scene::from_json(&value.to_string(), &assets()).unwrap_err();
    assert!(errors.issues[0].message.contains("`checker` or `image`"), "{errors}");
}
