//! F1 to F14, F37 to F43: rays, shapes and the structures that find them.
//!
//! A dull thing of albedo 1/2 in a sky of radiance 1 is half as bright as the sky: the picture's mean tells the share of
//! it that is covered.

use super::Case;
use super::build::{above, ball, block, down, floor, furnace, look, quad, scene, square, sun, with};
use serde_json::{Value, json};
use std::f64::consts::PI;

pub(super) fn cases() -> Vec<Case> {
    vec![
        distant_sphere(),
        huge_sphere(),
        tangent(),
        not_normalised(),
        in_its_plane(),
        nearly_in_its_plane(),
        through_vertices(),
        self_crossing(),
        concave(),
        on_edge(),
        lamp_close_above(),
        far_from_the_origin(),
        identical(),
        nested(),
        along_the_axes(),
        stadium(),
        lattice(),
        flat(),
        watertight(),
    ]
}

/// Mean radiance with this share of the picture covered.
fn covered(share: f64) -> f64 {
    1.0 - 0.5 * share
}

fn distant_sphere() -> Case {
    let camera = json!({ "type": "orthographic", "eye": [-1e6, 0, 0], "target": [0, 0, 0], "height": 0.2 });
    let value = furnace(camera, json!([ball("floor", [0.0; 3], 0.1)]));
    Case::new(
        "F1",
        "a small sphere seen from 1000 km",
        "b² − c cancels: a root off by a third of the radius",
        value,
    )
    .mean(covered(PI / 4.0), 0.02)
}

fn huge_sphere() -> Case {
    let value = scene(above([0.0; 3], 1.0, 0.5), json!([ball("floor", [0.0, -1e8, 0.0], 1e8)]), sun());
    Case::new("F2", "a floor that is a sphere of radius 1e8 m", "rings of acne, leaks", value)
        .mean(super::build::LIT, 0.01)
}

fn tangent() -> Case {
    let value = furnace(down(3.0, 2.0), json!([ball("floor", [0.0; 3], 1.0)]));
    Case::new(
        "F4",
        "a sphere whose silhouette touches the picture's border",
        "a negative root's NaN, a flickering rim",
        value,
    )
    .mean(covered(PI / 4.0), 0.01)
}

fn not_normalised() -> Case {
    let mut original = block("floor", [100.0, 0.0, 0.0], [0.2, 0.2, 0.2]);
    original["name"] = json!("block");
    let copy = json!({ "type": "instance", "of": "block", "material": "floor", "scale": [3, 1, 2], "translate": [-300, 0, 0] });
    let value = furnace(down(3.0, 0.8), json!([original, copy]));
    Case::new("F5", "a box in a stretched frame", "rays that are not of length 1 there", value)
        .mean(covered(0.6 * 0.4 / 0.64), 0.01)
}

/// A camera beside a floor, level with the point that it looks from.
fn level(y: f64, dy: f64) -> Value {
    let camera =
        json!({ "type": "orthographic", "eye": [-10, y, 0], "target": [-9, y + dy, 0], "height": 1e-6 });
    furnace(camera, json!([floor(2.0)]))
}

fn in_its_plane() -> Case {
    let mut value = level(0.0, 0.0);
    // One row of pixels, whose rays run just in the plane.
    value["camera"]["height"] = json!(1e-6);
    value["image"] = json!({ "width": 64, "height": 1 });
    value["camera"]["up"] = json!([0, 0, 1]);
    Case::new("F7", "rays in the plane of a floor", "0/0", value).mean(1.0, 1e-6)
}

fn nearly_in_its_plane() -> Case {
    let value = level(1.0, -1e-17);
    Case::new(
        "F8",
        "rays that approach a floor by 1e-17 a metre",
        "a hit far outside of it, by rounding",
        value,
    )
    .mean(1.0, 1e-6)
}

fn through_vertices() -> Case {
    let diamond = json!({ "type": "polygon", "material": "floor", "vertices": [[1, 0, 0], [0, 0, -1], [-1, 0, 0], [0, 0, 1]] });
    let value = furnace(down(3.0, 2.0), json!([diamond]));
    Case::new(
        "F9",
        "a diamond whose corners are level with pixels",
        "crossings counted once or three times: streaks",
        value,
    )
    .mean(covered(0.5), 0.01)
}

fn self_crossing() -> Case {
    let bow = json!({ "type": "polygon", "material": "floor", "vertices": [[-1, 0, 1], [1, 0, 1], [-0.5, 0, -1], [1, 0, -1]] });
    let value = furnace(down(3.0, 2.0), json!([bow]));
    // Triangles of base 2 and height 8/7 and of base 3/2 and height 6/7.
    Case::new("F10", "an outline that crosses itself", "no normal, or the wrong inside", value)
        .mean(covered((8.0 / 7.0 + 9.0 / 14.0) / 4.0), 0.01)
        .warns(&["self_crossing_polygon"])
}

fn concave() -> Case {
    let mut shape = json!({ "type": "polygon", "material": "floor", "vertices": [
        [-1, 0, 1], [1, 0, 1], [1, 0, -1], [0.5, 0, -1], [0.5, 0, 0], [-0.5, 0, 0], [-0.5, 0, -1], [-1, 0, -1]] });
    shape["holes"] = json!([[[-0.5, 0, 0.8], [0.5, 0, 0.8], [0, 0, 0]]]);
    let value = furnace(down(3.0, 2.0), json!([shape]));
    // The notch is 1, and the hole, which touches the outline in a point, 0.4.
    Case::new("F12", "a U with a hole that touches its outline", "the wrong inside", value)
        .mean(covered((4.0 - 1.0 - 0.4) / 4.0), 0.01)
}

fn on_edge() -> Case {
    let wall = json!({ "type": "polygon", "material": "floor",
                       "vertices": [[0, 0, 0], [-1e-6, 1, 0], [-1e-6, 1, 1], [0, 0, 1]] });
    let camera =
        json!({ "type": "orthographic", "eye": [3, 0.5, 0.5], "target": [0, 0.5, 0.5], "height": 2 });
    Case::new(
        "F13",
        "a wall 1e-6 from upright",
        "projected along the wrong axis it has no area",
        furnace(camera, json!([wall])),
    )
    .mean(covered(0.25), 0.01)
}

fn lamp_close_above() -> Case {
    let camera = json!({ "type": "orthographic", "eye": [0, 5e-4, 0], "target": [0, 0, 0], "up": [0, 0, -1], "height": 0.8 });
    let value = scene(camera, json!([square("floor", 0.5, 0.0)]), quad([0.0, 1e-3, 0.0], 1.0, [0.0; 3]));
    // All of the sky that a point sees is lamp, less 0.3 % at its border.
    Case::new("F14", "a lamp a millimetre above a floor", "floor and lamp shadow themselves", value)
        .mean(0.5, 0.01)
        .limit("grid", "the points of a grid, far apart against their distance, are no area")
        .limit("jittered", "cells that are large against their distance are too noisy")
        .limit("adaptive", "the points of a grid, far apart against their distance, are no area")
}

fn far_from_the_origin() -> Case {
    let at = 1000.0;
    let camera = json!({ "type": "orthographic", "eye": [at, 3, at], "target": [at, 0, at], "up": [0, 0, -1], "height": 0.5 });
    let value = scene(camera, json!([floor(2000.0)]), sun());
    Case::new(
        "F14",
        "a floor a kilometre from the origin",
        "acne: the offset is smaller than a float's step",
        value,
    )
    .mean(super::build::LIT, 1e-3)
}

fn identical() -> Case {
    let corners = json!([[-1, 0, 1], [1, 0, 1], [0, 0, -1], [1, 1, 1]]);
    let mut triangles = vec![[0, 1, 2]; 600];
    triangles.extend(vec![[3, 3, 3]; 300]);
    let mesh = json!({ "type": "mesh", "material": "floor", "positions": corners, "triangles": triangles });
    Case::new(
        "F36, F37",
        "600 equal triangles, and 300 of no size",
        "a tree that never divides them",
        furnace(down(3.0, 2.0), json!([mesh])),
    )
    .mean(covered(0.5), 0.01)
}

fn nested() -> Case {
    let balls: Vec<Value> =
        (0..60).map(|i| 2_f64.powi(-i / 2)).map(|r| ball("floor", [r - 1.0, 0.0, 0.0], r)).collect();
    Case::new(
        "F38",
        "60 nested spheres of sizes 1, 1/2, 1/4 …",
        "a tree as deep as there are things",
        furnace(down(3.0, 2.0), json!(balls)),
    )
    .mean(covered(PI / 4.0), 0.01)
}

fn along_the_axes() -> Case {
    let camera = json!({ "type": "orthographic", "eye": [-0.5, 3, 0.5], "target": [-0.5, 0, 0.5], "up": [0, 0, -1], "height": 1 });
    let blocks: Vec<Value> =
        (0..4).map(|i| block("floor", [0.0, -f64::from(i), 0.0], [1.0, 1.0, 1.0])).collect();
    // A quarter of the picture, with the blocks' edges in the middle of it.
    Case::new(
        "F39",
        "rays along the axes, that begin in the planes of boxes",
        "0 · ∞ in the slab test",
        furnace(camera, json!(blocks)),
    )
    .mean(covered(0.25), 0.01)
}

fn stadium() -> Case {
    let heights: Vec<Vec<f64>> = (0..30)
        .map(|i| (0..30).map(|j| 0.01 * (f64::from(i) * 0.7).sin() * (f64::from(j) * 0.9).cos()).collect())
        .collect();
    let hills = json!({ "type": "heightfield", "material": "floor", "center": [0, 0.1, 0], "size": [0.2, 0.2], "heights": heights });
    let build = |structure: &str| {
        let value = scene(above([0.0; 3], 0.5, 0.3), json!([floor(200.0), hills.clone()]), sun());
        with(value, "/render", json!({ "structure": structure }))
    };
    Case::new("F40", "1700 small hills on a floor of 400 m", "a grid has them all in one cell", build("auto"))
        .same_as(build("list"), 1e-3)
}

fn lattice() -> Case {
    let balls: Vec<Value> = (0..343)
        .map(|i| {
            ball("floor", [f64::from(i % 7) - 3.0, f64::from(i / 7 % 7) - 3.0, f64::from(i / 49) - 3.0], 0.25)
        })
        .collect();
    let build = |structure: &str| {
        with(
            furnace(down(9.0, 8.0), json!(balls)),
            "/render",
            json!({ "structure": structure, "paths": "LS*E|LDS*E" }),
        )
    };
    Case::new(
        "F41",
        "a lattice of balls, looked at along its rows",
        "rays through the corners of cells skip some",
        build("auto"),
    )
    .same_as(build("list"), 2e-3)
}

fn flat() -> Case {
    let field = json!({ "type": "heightfield", "material": "floor", "center": [0.5, 0, 0], "size": [1, 1], "heights": [[0, 0], [0, 0]] });
    let tile = json!({ "type": "polygon", "material": "floor", "vertices": [[-1, 0, 0.5], [0, 0, 0.5], [0, 0, -0.5], [-1, 0, -0.5]] });
    Case::new(
        "F42",
        "surfaces without any thickness along an axis",
        "their boxes are missed",
        furnace(down(3.0, 2.0), json!([field, tile])),
    )
    .mean(covered(0.5), 0.01)
}

fn watertight() -> Case {
    let segments = 40;
    let angle = |k: i32| PI * f64::from(k) / f64::from(segments);
    let around = 2 * segments;
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for i in 0..=segments {
        for j in 0..around {
            let (theta, phi) = (angle(i), angle(j));
            positions.push([theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()]);
            if i < segments {
                let at = |i: i32, j: i32| i * around + j % around;
                triangles.push([at(i, j), at(i, j + 1), at(i + 1, j)]);
                triangles.push([at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)]);
            }
        }
    }
    let mesh = json!({ "type": "mesh", "material": "floor", "positions": positions, "triangles": triangles });
    Case::new(
        "F43",
        "inside a closed mesh with slivers at its poles",
        "light leaks in along edges",
        furnace(look([0.0; 3], [0.1, 1.0, 0.2], 100.0), json!([mesh])),
    )
    .mean(0.0, 0.0)
}
