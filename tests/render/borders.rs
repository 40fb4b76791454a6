//! Pixels that show a border borrow what photons bring from the surfaces beside it.

use crate::support::{compile, floor, render, scene};
use nephroid::light_path::PathClass;
use nephroid::pass2_eye::Footprints;
use nephroid::plan::Plan;
use serde_json::{Value, json};

/// A floor and a wall under a pane, lit by a lamp at its side: both shine evenly, the wall less.
fn corner() -> Value {
    let wall = json!({ "type": "polygon", "material": "floor",
                       "vertices": [[-3, 0, -0.31], [3, 0, -0.31], [3, 0.8, -0.31], [-3, 0.8, -0.31]] });
    let pane = json!({ "type": "box", "material": "glass", "center": [0, 0.95, 0], "size": [2.4, 0.1, 2.4] });
    let lamp = json!({ "type": "point", "position": [0.2, 4, 2], "intensity": [9, 9, 9] });
    let camera =
        json!({ "type": "perspective", "eye": [0.1, 0.7, 1.5], "target": [0, 0.1, -0.3], "fov": 30 });
    let mut value = scene(camera, json!([floor(3.0, 0.0), wall, pane]), json!([lamp]));
    value["image"] = json!({ "width": 32, "height": 32 });
    value
}

/// A border pixel is a mean of what is above it and what is below it, as smooth as these: none of its own photons are
/// looked up. A look-up of a handful of photons would be wrong by a third.
#[test]
fn pixels_at_a_border_lie_between_their_neighbours() {
    let value = corner();
    let compiled = compile(&value);
    let footprints = Footprints::trace(&compiled, &Plan::new(&compiled).eye_media);
    let layer = render(&value, 1, 1, 15).layer(PathClass::Caustic);
    let (width, mut borders) = (32, 0);
    for i in 2 * width..layer.pixels.len() - 2 * width {
        let [above, below] = [i - 2 * width, i + 2 * width];
        if footprints.get(i).is_some() || [above, below].iter().any(|&j| footprints.get(j).is_none()) {
            continue;
        }
        borders += 1;
        let [value, above, below] = [i, above, below].map(|j| layer.pixels[j][1]);
        let (low, high) = (above.min(below), above.max(below));
        // Neighbours one pixel nearer differ by the slope of the light, less than 5 % over two pixels here.
        assert!(low > 0.0 && value > 0.9 * low && value < 1.1 * high, "{i}: {above} {value} {below}");
    }
    assert!(borders > width / 2, "{borders} pixels show the border");
}
