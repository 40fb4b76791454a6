//! Scenes that must be refused, each at its place: F3, F6, F10, F11, F30, F32, F36, F66, F67, F70, F71, F76.

use super::build::{above, ball, floor, lamp, scene, with};
use super::{Case, Input};
use crate::scene::IssueCode as C;
use serde_json::{Value, json};

/// A value that is put into a scene, and what must be said of it.
struct Bad {
    rows: &'static str,
    title: &'static str,
    breaks: &'static str,
    /// Where it is put, as a JSON pointer.
    at: &'static str,
    /// What is put there, as JSON.
    value: &'static str,
    /// Where it is refused, and as what.
    refused: (&'static str, C),
}

pub(super) fn cases() -> Vec<Case> {
    let values = BAD_VALUES.iter().map(|bad| {
        // What is no JSON would be no scene either, and refused in other words.
        let value = serde_json::from_str(bad.value).unwrap_or(Value::Null);
        Case::new(bad.rows, bad.title, bad.breaks, with(plain(), bad.at, value))
            .refused(bad.refused.1, bad.refused.0)
    });
    let texts = bad_texts().into_iter().map(|(title, breaks, text, (pointer, code))| {
        let case = Case::new("F76", title, breaks, Value::Null).refused(code, pointer);
        Case { input: Input::Text(text), ..case }
    });
    values.chain(texts).collect()
}

fn plain() -> Value {
    let objects = json!([floor(1.0), ball("glass", [0.0, 1.0, 0.0], 0.5)]);
    with(scene(above([0.0; 3], 2.0, 1.0), objects, lamp([0.0, 3.0, 0.0])), "/render", json!({}))
}

const BAD_VALUES: [Bad; 14] = [
    Bad {
        rows: "F3",
        title: "a sphere of radius 1e160",
        breaks: "r² is infinite",
        at: "/objects/1/radius",
        value: "1e160",
        refused: ("/objects/1/radius", C::OutOfRange),
    },
    Bad {
        rows: "F6",
        title: "a sphere of radius 0",
        breaks: "a normal divided by it",
        at: "/objects/1/radius",
        value: "0",
        refused: ("/objects/1/radius", C::OutOfRange),
    },
    Bad {
        rows: "F6",
        title: "a sphere of radius −1",
        breaks: "a normal that points inwards",
        at: "/objects/1/radius",
        value: "-1",
        refused: ("/objects/1/radius", C::OutOfRange),
    },
    Bad {
        rows: "F10",
        title: "a polygon without area",
        breaks: "no normal",
        at: "/objects/0/vertices",
        value: "[[0, 0, 0], [1, 0, 0], [2, 0, 0]]",
        refused: ("/objects/0/vertices", C::Degenerate),
    },
    Bad {
        rows: "F11",
        title: "a square with one corner lifted by 1 mm",
        breaks: "its plane and its edges disagree",
        at: "/objects/0/vertices",
        value: "[[-1, 0.001, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]]",
        refused: ("/objects/0/vertices", C::NotPlanar),
    },
    Bad {
        rows: "F30",
        title: "a lamp of negative power",
        breaks: "photons of negative power",
        at: "/lights/0/intensity",
        value: "[1, -1, 1]",
        refused: ("/lights/0/intensity/1", C::OutOfRange),
    },
    Bad {
        rows: "F32",
        title: "a spot of 0°",
        breaks: "a solid angle of 0",
        at: "/lights/0",
        value: r#"{ "type": "spot", "position": [0, 3, 0], "direction": [0, -1, 0], "outer": 0, "intensity": [1, 1, 1] }"#,
        refused: ("/lights/0/outer", C::OutOfRange),
    },
    Bad {
        rows: "F36",
        title: "a vertex at 1e300",
        breaks: "an infinite box",
        at: "/objects/1",
        value: r#"{ "type": "mesh", "material": "floor", "positions": [[0, 0, 0], [1, 0, 1e300], [0, 1, 0]], "triangles": [[0, 1, 2]] }"#,
        refused: ("/objects/1/positions/1/2", C::OutOfRange),
    },
    Bad {
        rows: "F66",
        title: "Metropolis light transport",
        breaks: "an isolated caustic that is found late, or never",
        at: "/render/caustics",
        value: r#""mlt""#,
        refused: ("/render/caustics", C::UnknownValue),
    },
    Bad {
        rows: "F67",
        title: "manifold next-event estimation",
        breaks: "many solutions of which one is found",
        at: "/render/caustics",
        value: r#""mnee""#,
        refused: ("/render/caustics", C::UnknownValue),
    },
    Bad {
        rows: "F70",
        title: "a lens focused at 0",
        breaks: "a division by it",
        at: "/camera/focus_distance",
        value: "0",
        refused: ("/camera/focus_distance", C::OutOfRange),
    },
    Bad {
        rows: "F71",
        title: "a field of view of 180°",
        breaks: "an infinite tangent",
        at: "/camera/fov",
        value: "180",
        refused: ("/camera/fov", C::OutOfRange),
    },
    Bad {
        rows: "F71",
        title: "a camera that looks along its up",
        breaks: "axes that are not finite",
        at: "/camera/up",
        value: "[0, 1, 0]",
        refused: ("/camera/up", C::Degenerate),
    },
    Bad {
        rows: "F71",
        title: "a camera that looks at itself",
        breaks: "axes that are not finite",
        at: "/camera/target",
        value: "[0, 2, 0]",
        refused: ("/camera/target", C::Degenerate),
    },
];

/// Titles, what breaks, the text, and where it is refused and as what.
fn bad_texts() -> Vec<(&'static str, &'static str, String, (&'static str, C))> {
    let text = plain().to_string();
    let with = |value: &str| text.replace("\"radius\":0.5", value);
    let at = "/objects/1/radius";
    let deep = format!("{}1{}", "[".repeat(10_000), "]".repeat(10_000));
    vec![
        ("a number beyond all floats", "an infinite radius", with("\"radius\":1e400"), (at, C::NotFinite)),
        ("NaN in the text", "a radius that is no number", with("\"radius\":NaN"), (at, C::Syntax)),
        (
            "a key given twice",
            "which of them counts?",
            with("\"radius\":1,\"radius\":2"),
            (at, C::DuplicateKey),
        ),
        ("10 000 nested lists", "the parser's stack", deep, ("", C::TooDeep)),
    ]
}
