//! F15 to F26, F61, F73, F74: mirrors, glass, and what a ray is inside of.
//!
//! In a sky of radiance 1 everything that loses no light is as bright as the sky: it is not seen.

use super::Case;
use super::build::{
    LIT, above, ball, block, floor, furnace, lamp, look, mean_over, scene, square, sun, with,
};
use crate::light_path::PathClass;
use serde_json::{Value, json};

pub(super) fn cases() -> Vec<Case> {
    vec![
        mirror_image(),
        prism(),
        critical(),
        equal_indices(),
        grazing(),
        camera_in_glass(),
        light_in_glass(),
        open_glass(),
        touching("F23", "glass and water that touch, in another order", 0.0),
        touching("F24", "glass and water with a gap of 1 nm", 1e-9),
        facing_mirrors(),
        light_trap(),
        many_balls(),
        counted_once(),
        orders(),
        spectrum(),
    ]
}

/// An upright mirror at x = 1.
fn wall(reflects: &str) -> Value {
    json!({ "type": "polygon", "material": reflects, "vertices": [[1, 0, -1], [1, 0, 1], [1, 1, 1], [1, 1, -1]] })
}

fn mirror_image() -> Case {
    let value =
        scene(above([0.5, 0.0, 0.0], 3.0, 0.2), json!([floor(2.0), wall("mirror")]), lamp([0.0, 1.0, 0.0]));
    let image_source = |x: f64, z: f64| 0.9 / ((2.0 - x).powi(2) + 1.0 + z * z).powf(1.5);
    Case::new("F15", "a lamp before a mirror", "R = I + 2(N·I)N, the lecture's sign, is of length 3", value)
        .mean_of(PathClass::Caustic, LIT * mean_over(0.5, 0.0, 0.2, image_source), 0.01)
}

/// A right-angled prism whose long side reflects totally.
fn prism() -> Case {
    let [a, b, c] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
    let end = |[x, y]: [f64; 2], z: f64| json!([x, y, z]);
    let side = |p: [f64; 2], q: [f64; 2]| json!([end(p, 1.0), end(q, 1.0), end(q, -1.0), end(p, -1.0)]);
    let polygon = |vertices: Value| json!({ "type": "polygon", "material": "glass", "vertices": vertices });
    let objects = json!([
        polygon(json!([end(a, 1.0), end(b, 1.0), end(c, 1.0)])),
        polygon(json!([end(c, -1.0), end(b, -1.0), end(a, -1.0)])),
        polygon(side(b, a)),
        polygon(side(c, b)),
        polygon(side(a, c)),
    ]);
    let camera = json!({ "type": "orthographic", "eye": [0.5, -2, 0], "target": [0.5, 0, 0], "up": [0, 0, 1], "height": 0.8 });
    Case::new(
        "F16",
        "a prism that reflects totally",
        "the root of a negative number",
        furnace(camera, objects),
    )
    .mean(1.0, 0.01)
}

fn critical() -> Case {
    // From 1/n of the radius, across it, light leaves just at the critical angle.
    let camera = look([0.0, 0.0, 0.6666], [0.0, 1.0, 0.6666], 4.0);
    let value = with(furnace(camera, json!([ball("glass", [0.0; 3], 1.0)])), "/camera/up", json!([0, 0, 1]));
    Case::new("F17", "glass at the critical angle", "a division by nearly nothing, flicker", value)
}

fn equal_indices() -> Case {
    let camera = look([-3.0, 0.55, 0.0], [0.0, 0.0, 0.0], 8.0);
    let build = |objects: Value| scene(camera.clone(), objects, lamp([0.3, 2.0, 0.0]));
    Case::new(
        "F18, F60",
        "a block of index 1 at a grazing angle",
        "Fresnel's equations by rounding: a mirror that is not there",
        build(json!([floor(2.0), block("air", [0.0, 0.2, 0.0], [2.0, 0.2, 2.0])])),
    )
    .same_as(build(json!([floor(2.0)])), 0.02)
    .limit("nearest", "a caustic's shadow border is blurred")
    .limit("fixed", "a caustic's shadow border is blurred")
}

fn grazing() -> Case {
    let camera = json!({ "type": "orthographic", "eye": [0, 3, 0.9995], "target": [0, 0, 0.9995], "up": [0, 0, -1], "height": 1e-3 });
    Case::new(
        "F19",
        "a glass ball at its rim",
        "rays that leave along the surface tunnel into it",
        furnace(camera, json!([ball("glass", [0.0; 3], 1.0)])),
    )
    .mean(1.0, 0.01)
}

fn camera_in_glass() -> Case {
    let camera = look([0.3, -0.2, 0.1], [1.0, 0.3, 0.2], 70.0);
    // Radiance grows by n² on its way into the glass.
    Case::new(
        "F20",
        "the camera inside a glass ball",
        "the first surface taken for one from outside",
        furnace(camera, json!([ball("glass", [0.0; 3], 1.0)])),
    )
    .mean(2.25, 0.01)
}

fn light_in_glass() -> Case {
    let camera = look([2.0, 0.4, 0.0], [0.5, 0.0, 0.0], 4.0);
    let build = |objects: Value| scene(camera.clone(), objects, lamp([0.0, 1.0, 0.0]));
    Case::new(
        "F21, F57",
        "a lamp in a glass ball",
        "its shadow rays are all blocked, and no cone holds the ball",
        build(json!([floor(2.0), ball("glass", [0.0, 1.0, 0.0], 0.25)])),
    )
    .same_as(build(json!([floor(2.0)])), 0.02)
}

fn open_glass() -> Case {
    let value = scene(
        above([0.0; 3], 2.5, 1.0),
        json!([floor(2.0), square("glass", 1.0, 1.0)]),
        lamp([0.1, 3.0, 0.0]),
    );
    Case::new("F22", "a pane of glass without a back", "a ray that never leaves it", value)
        .warns(&["open_dielectric"])
}

fn touching(row: &'static str, title: &'static str, gap: f64) -> Case {
    let layer = |material: &str, from: f64, to: f64| {
        block(material, [0.0, f64::midpoint(from, to), 0.0], [2.0, to - from, 2.0])
    };
    let build = |objects: Value| {
        let mut value = scene(above([0.0; 3], 0.5, 0.4), objects, sun());
        value["materials"]["glass"]["priority"] = json!(1);
        value["materials"]["water"] = json!({ "type": "glass", "ior": 1.33 });
        value
    };
    let one = build(json!([floor(1.0), layer("glass", 1.0, 1.2), layer("water", 1.2 + gap, 1.4)]));
    let other = build(json!([layer("water", 1.2, 1.4), floor(1.0), layer("glass", 1.0, 1.2)]));
    Case::new(row, title, "both faces refract, or neither, as the order of objects has it", one)
        .same_as(other, 0.01)
}

fn facing_mirrors() -> Case {
    let wall = |x: f64, a: f64| json!({ "type": "polygon", "material": "perfect", "vertices": [[x, 0, a], [x, 0, -a], [x, 4, -a], [x, 4, a]] });
    let value = scene(
        look([0.0, 1.0, 0.0], [1.0, 1.01, 0.02], 60.0),
        json!([wall(-1.0, 2.0), wall(1.0, -2.0), floor(1.0)]),
        lamp([0.2, 1.0, 0.1]),
    );
    Case::new("F25", "a lamp between two mirrors that lose nothing", "rays that never end", value)
}

fn light_trap() -> Case {
    let value = scene(
        above([0.0; 3], 0.4, 0.5),
        json!([floor(1.0), block("glass", [0.0, 1.0, 0.0], [0.5, 0.5, 0.5])]),
        lamp([0.05, 1.1, 0.1]),
    );
    Case::new(
        "F25",
        "a lamp in a glass cube",
        "what is totally reflected at every side stays in for ever",
        value,
    )
}

fn many_balls() -> Case {
    let balls: Vec<Value> = (0..20).map(|i| ball("glass", [0.0, 1.0, -f64::from(i)], 0.4)).collect();
    Case::new(
        "F26",
        "20 glass balls in a row",
        "2⁴⁰ ways through them",
        furnace(look([0.0, 1.0, 3.0], [0.0, 1.0, 0.0], 12.0), json!(balls)),
    )
    .mean(1.0, 0.01)
}

fn counted_once() -> Case {
    let value = scene(
        look([0.0, 2.0, 3.0], [0.0, 0.0, 0.0], 10.0),
        json!([floor(2.0), ball("air", [0.0, 1.0, 0.0], 0.5)]),
        sun(),
    );
    Case::new(
        "F61",
        "the floor under a ball of index 1",
        "lit twice, by shadow rays through glass and by photons",
        value,
    )
    .mean(LIT, 0.02)
    .limit("nearest", "at a caustic's border the nearest photons lie on one side")
}

/// A slab wide enough that nothing comes round its rim.
fn slab() -> Value {
    scene(
        above([0.0; 3], 0.5, 0.4),
        json!([floor(1.0), block("glass", [0.0, 1.1, 0.0], [2.0, 0.2, 2.0])]),
        sun(),
    )
}

fn orders() -> Case {
    // (1 - R) / (1 + R) of R = 0.04.
    Case::new("F73", "a glass slab in the sun", "orders of internal reflection lost, or one too many", slab())
        .mean_of(PathClass::Caustic, LIT * 0.923_077, 0.01)
}

fn spectrum() -> Case {
    let value = with(slab(), "/materials/glass/abbe", json!(30));
    Case::new(
        "F74",
        "a slab of dispersive glass",
        "light lost between the wavelengths, coloured noise",
        value,
    )
    .mean_of(PathClass::Caustic, LIT * 0.923_077, 0.02)
}
