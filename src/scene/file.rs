//! The scene file, version 1: exactly what the JSON says, nothing computed.
//!
//! Each type here is the one declaration of its JSON: field names, types, limits, defaults.

use super::environment_file::{EnvironmentFile, Surroundings};
use super::issue::{IssueCode, Issues};
use super::json::{Node, Value};
use super::light_file::LightFile;
use super::material_file::MaterialFile;
use super::paths_file::{LightPath, LightPaths};
use super::radius_file::Radius;
use super::read::name as group_name;
use super::read::{
    Context, Decode, Fields, MAX_LENGTH, choice, color, count, direction, name, named, note_duplicates,
    object, optional, or, pair, part, point, real, record, reference, required, seed, slots, tagged,
};
use super::schema::Definitions;
use super::shape_file::{MotionFile, ShapeFile};
use super::{Aiming, Caustics, LightSampling, Paths, Tone};
use crate::geometry::Structure;
use crate::light_path::Expression;
use crate::radius::RadiusRule;
use serde_json::json;
use std::collections::BTreeSet;

/// The version of the format that is read.
const VERSION: f64 = 1.0;
/// Most pixels across or down.
const MAX_IMAGE_SIDE: u32 = 16_384;
/// Squares along each side of a light, if not given.
const LIGHT_GRID: u32 = 4;

/// Reads a scene file as far as it is right. What is wrong is noted, and missing in the result.
pub(super) fn read_scene_file(root: &Node<'_>, issues: &mut Issues) -> Option<SceneFile> {
    let mut cx = Context::new(std::mem::take(issues), material_names(root));
    note_duplicates(root, &mut cx);
    let file = Fields::read(root, &mut cx);
    *issues = cx.issues;
    file
}

/// The names of all materials, also of those that are wrong: a reference to them is right.
fn material_names<'n>(root: &'n Node<'_>) -> BTreeSet<&'n str> {
    let field = |node: &'n Node<'_>, name: &str| match &node.value {
        Value::Object(members) => members.iter().find(|m| m.key == name).map(|m| &m.node),
        _ => None,
    };
    match field(root, "materials").map(|node| &node.value) {
        Some(Value::Object(members)) => members.iter().map(|m| m.key.as_ref()).collect(),
        _ => BTreeSet::new(),
    }
}

record! {
    // A part that was wrong is `None` (and has been noted), so that the others can be checked.
    /// A whole scene.
    SceneFile {
        /// Version of the format.
        nephroid: Option<()> = part(required(Version)),
        /// The scene's own name.
        name: Option<Option<String>> = part(optional(name())),
        /// Size and tone of the picture.
        image: Option<Option<ImageFile>> = part(optional(object::<ImageFile>())),
        /// Where the eye is.
        camera: Option<CameraFile> = part(required(object::<CameraFile>())),
        /// Materials by name.
        materials: Option<Vec<(String, Option<MaterialFile>)>> = part(or(named(object::<MaterialFile>()), Vec::new())),
        /// All objects.
        objects: Option<Vec<Option<ObjectFile>>> = part(required(slots(object::<ObjectFile>()))),
        /// All lights but the environment.
        lights: Option<Vec<Option<LightFile>>> = part(or(slots(object::<LightFile>()), Vec::new())),
        /// The light from infinitely far away, where no object is in its way; none if left out.
        environment: Option<Option<EnvironmentFile>> = part(optional(Surroundings)),
        /// What is asked of the renderer.
        render: Option<RenderFile> = part(or(object::<RenderFile>(), RenderFile::default())),
    }
}

record! {
    /// Size and tone of the picture.
    ImageFile {
        /// Pixels across.
        width: u32 = or(count("width in pixels", 1, MAX_IMAGE_SIDE), 640),
        /// Pixels down.
        height: u32 = or(count("height in pixels", 1, MAX_IMAGE_SIDE), 480),
        /// Exposure: the picture is multiplied by 2 to the power of it.
        exposure: f64 = or(real("exposure in stops").between(-64.0, 64.0).unit("stops"), 0.0),
        /// Curve between linear radiance and the display: clipped at 1, or with highlights rolled off.
        tone: Tone = or(choice(vec![("linear", Tone::Linear), ("filmic", Tone::Filmic)]), Tone::Linear),
    }
}

tagged! {
    /// A camera.
    CameraFile {
        "perspective" => Perspective(PerspectiveFile),
        "orthographic" => Orthographic(OrthographicFile),
    }
}

record! {
    /// A pinhole or thin-lens camera.
    PerspectiveFile {
        /// Position of the pinhole, or of the lens's centre.
        eye: [f64; 3] = required(point()),
        /// A point in the middle of the picture.
        target: [f64; 3] = required(point()),
        /// The direction that is up in the picture.
        up: [f64; 3] = or(direction(), [0.0, 1.0, 0.0]),
        /// When the shutter opens and closes, in seconds: what moves meanwhile is blurred.
        shutter: [f64; 2] = or(pair(real("time in seconds")), [0.0, 0.0]),
        /// Vertical field of view in degrees.
        fov: f64 = required(real("vertical field of view in degrees").above(0.0).below(180.0).unit("°")),
        /// Diameter of the lens in metres; 0 is a pinhole.
        aperture: f64 = or(real("diameter of the lens in metres").between(0.0, MAX_LENGTH).unit("m"), 0.0),
        /// Distance from the lens, along the view, of the plane that is sharp, in metres; that of the target if
        /// left out.
        focus_distance: Option<f64> = optional(real("distance in metres").positive_length()),
    }
}

record! {
    /// A camera whose rays are parallel: things keep their size at any distance.
    OrthographicFile {
        /// A point of the plane that the rays start from: what is behind it is not seen.
        eye: [f64; 3] = required(point()),
        /// A point in the middle of the picture.
        target: [f64; 3] = required(point()),
        /// The direction that is up in the picture.
        up: [f64; 3] = or(direction(), [0.0, 1.0, 0.0]),
        /// When the shutter opens and closes, in seconds: what moves meanwhile is blurred.
        shutter: [f64; 2] = or(pair(real("time in seconds")), [0.0, 0.0]),
        /// Height of what is seen, in metres.
        height: f64 = required(real("height in metres").positive_length()),
    }
}

record! {
    /// An object: a shape made of a material.
    ObjectFile {
        /// Name, for reports.
        name: Option<String> = optional(name()),
        /// Name of its material.
        material: String = required(reference()),
        /// Radiance of its front: the outside of a sphere, the side of a polygon or mesh from which
        /// its vertices run anticlockwise. Makes the object a light, also one that moves; it still reflects by its
        /// material, which may not let light through.
        emission: Option<[f64; 3]> = optional(color("emission").unit("W·sr⁻¹·m⁻²")),
        /// The light group of its emission, as of a light.
        group: Option<String> = optional(group_name()),
        /// Its velocity in m/s: it moves on a straight line while the camera's `shutter` is open.
        velocity: [f64; 3] = or(point(), [0.0; 3]),
        /// How it moves while the camera's `shutter` is open, besides by its `velocity`.
        motion: Option<MotionFile> = optional(object::<MotionFile>()),
        ..
        /// Its shape, where it is when the shutter opens if it has a `motion`, at time 0 if it has a `velocity`.
        shape: ShapeFile
    }
}

record! {
    /// What is asked of the renderer.
    RenderFile {
        /// Which light paths are computed: `whitted` is LS*E|LDS*E, `caustics` LS*E|LDS*E|LS+DS*E and `complete` L(D|S)*E; or
        /// any expression over L (the light), D (a diffuse or rough surface), S (a mirror or smooth glass) and E (the eye) with
        /// ( ) | * + ? {m,n}, where `.` is (D|S). What it does not hold is not computed.
        paths: Paths = or(LightPaths, Paths::Caustics),
        /// Layers besides those of the classes, by name: the light of those of the picture's paths that are in an expression, as
        /// in `{"glints": "LS+E"}`. They cost no rays, and add up to the picture if each of its paths is in just one.
        layers: Vec<(String, Option<Expression>)> = or(named(LightPath), Vec::new()),
        /// What computes the caustics LS+DS*E: photons, or for comparison `backward`, path tracing that meets the lights by
        /// chance, or `forward`, photons connected to the eye, which leaves out what mirrors and glass show.
        caustics: Caustics = or(choice(Caustics::NAMED.to_vec()), Caustics::Photons),
        /// When the render ends; at an error of 0.02 or after 60 seconds if left out.
        stop: Option<StopFile> = optional(object::<StopFile>()),
        /// Reach of the caustics' density estimate: a `pixel`, smoothed after; and for comparison a radius that shrinks from
        /// round to round (`progressive`), one that is `fixed`, or that of the `nearest` photons.
        radius: RadiusRule = or(Radius, RadiusRule::Pixel),
        /// Where photons are sent: through `windows` toward what is specular, or for comparison `everywhere`.
        aiming: Aiming = or(choice(Aiming::NAMED.to_vec()), Aiming::Windows),
        /// The structure that finds what a ray meets; all find the same.
        structure: Structure = or(choice(Structure::NAMED.to_vec()), Structure::Auto),
        /// How quad and disk lights are sampled: by one point per eye sample (`sobol`), or by the squares of a grid,
        /// at their centres (`grid`), at a random point of each (`jittered`), or at their corners, divided where those
        /// disagree (`adaptive`, which misses what is smaller than a square and hides none of its corners).
        light_sampling: LightSampling = or(choice(LightSampling::NAMED.to_vec()), LightSampling::Sobol),
        /// Squares along each side of such a light, unless it is sampled by `sobol`.
        light_grid: u32 = or(count("squares along each side of a light", 1, 64), LIGHT_GRID),
        /// Seed of every random stream.
        seed: u64 = or(seed(), 0),
    }
}

impl Default for RenderFile {
    fn default() -> Self {
        Self {
            paths: Paths::default(),
            layers: Vec::new(),
            caustics: Caustics::default(),
            stop: None,
            radius: RadiusRule::default(),
            aiming: Aiming::default(),
            structure: Structure::default(),
            light_sampling: LightSampling::default(),
            light_grid: LIGHT_GRID,
            seed: 0,
        }
    }
}

record! {
    /// When a render ends: the first limit that is reached.
    StopFile {
        /// Estimated relative error: 0.02 is 2 %.
        error: Option<f64> = optional(real("relative error (0.02 is 2 %)").above(0.0).at_most(1.0)),
        /// Seconds of rendering.
        seconds: Option<f64> = optional(real("seconds").above(0.0).at_most(1e9).unit("s")),
        /// Number of rounds.
        rounds: Option<u32> = optional(count("number of rounds", 1, u32::MAX)),
    }
}

struct Version;

impl Decode for Version {
    type Out = ();

    fn decode(&self, node: &Node<'_>, cx: &mut Context<'_>) -> Option<()> {
        match &node.value {
            Value::Number(written) if written.parse() == Ok(VERSION) => Some(()),
            Value::Number(written) => {
                let message =
                    format!("this program reads version {VERSION} of the format, not {written:.20}");
                cx.issue(IssueCode::UnsupportedVersion, message);
                None
            }
            _ => {
                cx.wrong_type(&format!("the version of the format, {VERSION}"), node);
                None
            }
        }
    }

    fn schema(&self, _definitions: &mut Definitions) -> serde_json::Value {
        json!({ "const": VERSION as u32 })
    }
}
