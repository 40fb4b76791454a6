//! Which methods can render a scene, and the settings that ask for them.

use super::Task;
use super::axis::plain;
use crate::plan::Plan;
use crate::scene::{Caustics, Scene};
use serde_json::{Value, json};

/// The radius of the classic photon maps, as a part of the radius around all that is in the scene.
const FIXED_RADIUS: f32 = 0.01;
/// The same of a map that is made for fine caustics: bias is what a wide radius costs.
const FINE_RADIUS: f32 = 0.002;
/// No photon further away than this many such radii is among the nearest.
const NEAREST_MOST: f32 = 5.0;
/// How many are.
const NEAREST: u32 = 50;
/// A list of more primitives would take minutes.
const MOST_LISTED: usize = 3000;

/// One way to render a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Method {
    /// A name for the legend.
    pub name: String,
    /// What takes the place of the scene's `render` settings.
    pub settings: Value,
}

impl Method {
    pub(super) fn new(name: impl Into<String>, settings: Value) -> Self {
        Self { name: name.into(), settings }
    }

    /// The renderer as it is.
    #[must_use]
    pub fn default_of(task: Task) -> Self {
        match task {
            Task::Picture => Self::new("default", json!({})),
            Task::DirectLight => Self::new("sobol (default)", json!({ "paths": "whitted" })),
            Task::Complete => Self::new("Nephroid", json!({ "paths": "complete" })),
        }
    }
}

/// All methods for a task; none if the scene has nothing that they would do differently.
#[must_use]
pub fn methods(scene: &Scene, plan: &Plan, task: Task) -> Vec<Method> {
    match task {
        Task::Picture if plan.caustics == Some(Caustics::Photons) => caustics(scene),
        Task::DirectLight if scene.lights.iter().any(|l| matches!(l.kind(), "quad" | "disk")) => direct(),
        Task::Complete => vec![Method::default_of(task)],
        Task::Picture | Task::DirectLight => Vec::new(),
    }
}

fn caustics(scene: &Scene) -> Vec<Method> {
    let mut methods = vec![Method::default_of(Task::Picture)];
    methods.extend(classic_maps(scene));
    methods.push(fixed(FINE_RADIUS * scene.geometry.bounds().radius()));
    methods.push(Method::new("aimed everywhere", json!({ "aiming": "everywhere" })));
    if all_can_be_met(scene) {
        methods.push(Method::new("backward: paths", json!({ "caustics": "backward" })));
    }
    methods.push(Method::new("forward: photons to the eye", json!({ "caustics": "forward" })));
    methods
}

/// The photon map with the radii of the literature.
pub(super) fn classic_maps(scene: &Scene) -> [Method; 3] {
    let radius = FIXED_RADIUS * scene.geometry.bounds().radius();
    let most = NEAREST_MOST * radius;
    [
        Method::new("progressive radius", json!({ "radius": "progressive" })),
        fixed(radius),
        Method::new(
            format!("nearest {NEAREST}, at most {} m", plain(most.into())),
            json!({ "radius": { "nearest": NEAREST, "most": most } }),
        ),
    ]
}

fn fixed(radius: f32) -> Method {
    let name = format!("fixed radius {} m", plain(radius.into()));
    Method::new(name, json!({ "radius": { "fixed": radius } }))
}

/// Structures that can find what rays meet in a scene; with very many primitives a list would take minutes.
pub(super) fn structures(scene: &Scene) -> Vec<&'static str> {
    let listed = scene.geometry.primitive_count() <= MOST_LISTED;
    ["list", "grid", "bvh", "spheres"].into_iter().filter(|name| listed || *name != "list").collect()
}

/// True if a ray can meet each light by chance.
#[must_use]
pub fn all_can_be_met(scene: &Scene) -> bool {
    scene.lights.iter().all(|light| light.is_dark() || light.surface_radiance().is_some())
}

fn direct() -> Vec<Method> {
    let sampled = |name: &str, sampling: &str, grid: u32| {
        let settings = json!({ "paths": "whitted", "light_sampling": sampling, "light_grid": grid });
        Method::new(format!("{name} {grid}×{grid}"), settings)
    };
    vec![
        Method::default_of(Task::DirectLight),
        sampled("grid", "grid", 2),
        sampled("grid", "grid", 8),
        sampled("jittered", "jittered", 8),
        sampled("adaptive", "adaptive", 4),
    ]
}
