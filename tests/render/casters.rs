//! Scenes of several casters under several lights that are large enough for paths to meet them.

use crate::support::{floor, scene};
use serde_json::{Value, json};

/// Balls of glass and of mirror under a quad, a disk and a sphere.
pub(crate) fn balls() -> Value {
    let objects = json!([
        floor(3.0, 0.0),
        ball("glass", [-0.6, 0.5, 0.0], 0.4),
        ball("mirror", [0.6, 0.45, 0.1], 0.35)
    ]);
    let lights =
        json!([quad([1.5, 2.5, 0.5], 1.5), disk([-2.0, 2.0, 0.5], 0.9), lamp([0.0, 2.2, -1.6], 0.7)]);
    scene(look([0.0, 3.0, 2.5], [0.0, 0.0, 0.0], 40.0), objects, lights)
}

/// A prism of glass as a mesh, and a ring of mirror, under a shining mesh and a quad.
pub(crate) fn prism_and_ring() -> Value {
    let prism = json!({ "type": "mesh", "material": "glass",
        "positions": [[-1.1, 0.3, -0.6], [-0.4, 0.3, -0.6], [-0.75, 0.9, -0.6], [-1.1, 0.3, 0.6], [-0.4, 0.3, 0.6], [-0.75, 0.9, 0.6]],
        "triangles": [[0, 2, 1], [3, 4, 5], [0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [2, 0, 3], [2, 3, 5]] });
    let ring = json!({ "type": "cylinder", "material": "mirror", "from": [0.6, 0, 0], "to": [0.6, 0.35, 0], "radius": 0.5 });
    let roof = json!({ "type": "mesh", "material": "floor", "emission": [6, 6, 6],
        "positions": [[-2.2, 1.2, 1], [-2.2, 1.2, -1], [-1.2, 2.4, 1], [-1.2, 2.4, -1], [-0.2, 2.6, 0]],
        "triangles": [[0, 1, 2], [1, 3, 2], [2, 3, 4]] });
    scene(
        look([0.3, 2.6, 2.8], [0.0, 0.0, 0.1], 38.0),
        json!([floor(3.0, 0.0), prism, ring, roof]),
        json!([quad([2.2, 1.8, 0.0], 1.4)]),
    )
}

/// Waves over a basin with a mirror ball in it, under a disk and a sphere: light and eye go through the water.
pub(crate) fn basin() -> Value {
    let heights: Vec<Vec<f64>> = (0..13)
        .map(|j| {
            (0..13).map(|i| 0.05 * (0.9 * f64::from(i)).sin() * (0.7 * f64::from(j) + 0.4).cos()).collect()
        })
        .collect();
    let water = json!({ "type": "heightfield", "material": "glass", "center": [0, 0.7, 0], "size": [4, 4], "heights": heights });
    let wall = |a: [i32; 2], b: [i32; 2]| {
        json!({ "type": "polygon", "material": "floor",
        "vertices": [[a[0], 0, a[1]], [b[0], 0, b[1]], [b[0], 1, b[1]], [a[0], 1, a[1]]] })
    };
    let objects = json!([
        floor(2.0, 0.0),
        wall([-2, -2], [2, -2]),
        wall([2, 2], [-2, 2]),
        wall([-2, 2], [-2, -2]),
        wall([2, -2], [2, 2]),
        water,
        ball("mirror", [0.3, 0.3, 0.0], 0.25)
    ]);
    let mut value = scene(
        look([0.0, 3.4, 2.4], [0.0, 0.2, 0.0], 34.0),
        objects,
        json!([disk([2.0, 3.5, -1.0], 1.5), lamp([-2.0, 3.0, -0.5], 1.2)]),
    );
    value["materials"]["glass"]["ior"] = json!(1.33);
    value
}

/// A block of coloured glass and a ball of gold, under a quad and the sky.
pub(crate) fn block_and_gold() -> Value {
    let block =
        json!({ "type": "box", "material": "green", "center": [-0.6, 0.3, 0.0], "size": [0.5, 0.5, 0.7] });
    let objects = json!([floor(3.0, 0.0), block, ball("gold", [0.5, 0.4, 0.0], 0.35)]);
    let mut value =
        scene(look([0.0, 3.0, 2.5], [0.0, 0.0, 0.0], 36.0), objects, json!([quad([0.3, 2.6, -1.2], 1.6)]));
    value["materials"]["green"] = json!({ "type": "glass", "ior": 1.5, "absorption": [3, 0.4, 2] });
    value["materials"]["gold"] = json!({ "type": "metal", "f0": [1.0, 0.78, 0.34] });
    value["environment"] = json!({ "radiance": [0.5, 0.6, 0.9] });
    value
}

/// A rod of glass before a mirror, seen in the mirror, under a disk and a shining panel.
pub(crate) fn in_a_mirror() -> Value {
    let rod = json!({ "type": "cylinder", "material": "glass", "from": [-0.6, 0.4, 0.3], "to": [0.6, 0.4, 0.3], "radius": 0.25 });
    let end = |x: f64| json!({ "type": "disk", "material": "glass", "center": [x, 0.4, 0.3], "normal": [x, 0, 0], "radius": 0.25 });
    let mirror = json!({ "type": "polygon", "material": "mirror", "vertices": [[-1.6, 0, -0.8], [1.6, 0, -0.8], [1.6, 1.4, -0.8], [-1.6, 1.4, -0.8]] });
    let panel = json!({ "type": "polygon", "material": "floor", "emission": [6, 5, 4],
                        "vertices": [[-1.8, 2, 0.2], [-1.8, 2, 1.8], [-0.3, 2.6, 1.8], [-0.3, 2.6, 0.2]] });
    let objects = json!([floor(3.0, 0.0), rod, end(-0.6), end(0.6), mirror, panel]);
    scene(look([0.0, 1.6, 3.2], [0.0, 0.3, -0.6], 34.0), objects, json!([disk([1.6, 2.4, 1.2], 1.0)]))
}

fn quad(center: [f64; 3], side: f64) -> Value {
    json!({ "type": "quad", "center": center, "size": [side, side], "towards": [0, 0, 0], "radiance": [9, 7, 5] })
}

fn disk(center: [f64; 3], radius: f64) -> Value {
    json!({ "type": "disk", "center": center, "radius": radius, "towards": [0, 0, 0], "radiance": [4, 6, 9] })
}

fn lamp(center: [f64; 3], radius: f64) -> Value {
    json!({ "type": "sphere", "center": center, "radius": radius, "radiance": [3, 8, 4] })
}

fn ball(material: &str, center: [f64; 3], radius: f64) -> Value {
    json!({ "type": "sphere", "material": material, "center": center, "radius": radius })
}

fn look(eye: [f64; 3], target: [f64; 3], fov: f64) -> Value {
    json!({ "type": "perspective", "eye": eye, "target": target, "fov": fov })
}
