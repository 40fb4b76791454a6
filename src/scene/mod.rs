//! The compiled scene: flat arrays and typed ids, the only thing the two passes see.
//!
//! A scene file is first read into a `SceneFile` (`file.rs`: exactly what the JSON says), then
//! compiled into a [`Scene`] (`compile/`). Rendering never changes it.

pub mod assets;
mod camera;
mod check;
mod compile;
mod environment;
mod environment_file;
mod file;
mod issue;
mod json;
mod light;
mod light_file;
mod material;
mod material_file;
mod mesh_file;
mod paths_file;
mod radius_file;
mod read;
mod schema;
mod shape_file;
pub(crate) mod texture;

pub use assets::{AssetError, AssetSource, DirectoryAssets, MemoryAssets, NoAssets};
pub use camera::{Camera, Lens, Projection, View};
pub use check::Warning;
pub(crate) use compile::UNGROUPED;
pub use environment::{Environment, EnvironmentImage, EnvironmentSample};
pub use issue::{IssueCode, SceneErrors, SceneIssue};
pub use light::{DiskLight, Light, LightPoint, MeshLight, QuadLight, SphereLight, SpotLight};
pub use material::{Alpha, Conductor, Dielectric, FRAUNHOFER, Highlight, Ior, Material, Mix, Phong};
pub use schema::{schema, schema_markdown};
pub use texture::{Texture, TextureImage};

pub use crate::light_path::Paths;

use crate::geometry::{Geometry, Structure};
use crate::light_path::Expression;
use crate::radius::RadiusRule;
use glam::Vec2;

macro_rules! typed_id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub struct $name(pub u32);
        impl $name {
            /// The id as an index into its array.
            #[inline]
            #[must_use]
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }
    };
}

typed_id!(
    /// Index into [`Scene::objects`].
    ObjectId
);
typed_id!(
    /// Index into [`Scene::materials`].
    MaterialId
);
typed_id!(
    /// Index into [`Scene::lights`].
    LightId
);

/// Everything a render needs, in flat arrays.
#[derive(Debug)]
pub struct Scene {
    /// The scene's own name, for reports only.
    pub name: String,
    /// Size and tone of the picture.
    pub image: ImageSettings,
    /// Where the eye is.
    pub camera: Camera,
    /// All materials; [`Object::material`] points here.
    pub materials: Vec<Material>,
    /// All objects; each primitive of [`Scene::geometry`] belongs to one.
    pub objects: Vec<Object>,
    /// Primitives and the structure that finds the nearest.
    pub geometry: Geometry,
    /// All lights but the environment.
    pub lights: Vec<Light>,
    /// What surrounds it all.
    pub environment: Environment,
    /// Which lights are layers of their own.
    pub light_groups: LightGroups,
    /// Bytes of the pictures that textures and environment are made of.
    pub image_bytes: u64,
    /// What the file asks of the renderer.
    pub render: RenderSettings,
    /// Dielectrics that touch others, each by itself.
    pub touching: Vec<Touching>,
    /// What is allowed, but hardly meant.
    pub warnings: Vec<Warning>,
}

/// A dielectric object by itself: where it touches another, a ray's nearest hit tells of one of them only.
#[derive(Debug)]
pub struct Touching {
    /// The object.
    pub object: ObjectId,
    /// Its primitives alone.
    pub geometry: Geometry,
}

/// One named thing of the scene file (or the surface of a light).
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Name, for reports only.
    pub name: String,
    /// What it is made of.
    pub material: MaterialId,
    /// The light whose surface this is, if it emits.
    pub emitter: Option<LightId>,
}

/// Size and tone of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageSettings {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Exposure in stops: the picture is multiplied by 2^exposure before it is encoded.
    pub exposure: f32,
    /// Curve between linear radiance and the display.
    pub tone: Tone,
}

/// Curve between linear radiance and the display's 0..1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Tone {
    /// Clip at 1.
    #[default]
    Linear,
    /// The ACES-like filmic fit of Narkowicz (2015): rolls highlights off.
    Filmic,
}

/// Which estimator computes the caustics, `LS+DS*E`. They agree where all can converge; the others are for comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Caustics {
    /// Photons stored in pass 1 and gathered in pass 2.
    #[default]
    Photons,
    /// Path tracing: eye paths go on from the first D and count where they meet a light by chance.
    Backward,
    /// Light tracing: each photon that rests is connected to the eye; only what it sees directly, `LS+DE`.
    Forward,
}

impl Caustics {
    /// Every value and its name.
    pub const NAMED: [(&str, Self); 3] =
        [("photons", Self::Photons), ("backward", Self::Backward), ("forward", Self::Forward)];
}

/// A value of `caustics` that does not exist.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not one of `photons`, `backward` (path tracing) and `forward` (light tracing)")]
pub struct UnknownCaustics(String);

impl std::str::FromStr for Caustics {
    type Err = UnknownCaustics;

    fn from_str(text: &str) -> Result<Self, UnknownCaustics> {
        let known = Self::NAMED.iter().find(|(name, _)| *name == text);
        known.map(|(_, caustics)| *caustics).ok_or_else(|| UnknownCaustics(text.to_owned()))
    }
}

/// Where photons are sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Aiming {
    /// From each light toward each specular object, and there where a pilot run has found them to arrive.
    #[default]
    Windows,
    /// In all directions that a light sends to; those that do not meet a mirror or glass first are lost: the photon map
    /// of 1996, for comparison.
    Everywhere,
}

impl Aiming {
    /// Every value and its name.
    pub const NAMED: [(&str, Self); 2] = [("windows", Self::Windows), ("everywhere", Self::Everywhere)];
}

/// How a quad or disk light is sampled at a D.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum LightSampling {
    /// One point per eye sample, from the sample's Sobol sequence; quads by solid angle.
    #[default]
    Sobol,
    /// The centres of a regular grid: the same for every eye sample, so that shadows show bands.
    Grid,
    /// A random point in each square of the grid.
    Jittered,
    /// The corners of each square; where they disagree on whether they are seen, the square is divided. What is
    /// smaller than a square and hides none of its corners is missed, whatever the number of eye samples.
    Adaptive,
}

impl LightSampling {
    /// Every value and its name.
    pub const NAMED: [(&str, Self); 4] = [
        ("sobol", Self::Sobol),
        ("grid", Self::Grid),
        ("jittered", Self::Jittered),
        ("adaptive", Self::Adaptive),
    ];
}

/// A layer of the picture: the light of some of its paths.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamedLayer {
    /// Its name, in file names too.
    pub name: String,
    /// Its paths, as far as the picture has them.
    pub paths: Expression,
}

/// Lights whose light is a layer of its own.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LightGroups {
    /// Name of each group.
    pub names: Vec<String>,
    /// The group of each light.
    pub of_light: Vec<Option<usize>>,
    /// The group of the environment.
    pub of_environment: Option<usize>,
}

/// What the scene file asks of the renderer.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderSettings {
    /// Which light paths are computed.
    pub paths: Paths,
    /// Layers besides those of the classes.
    pub layers: Vec<NamedLayer>,
    /// Which estimator computes the caustics.
    pub caustics: Caustics,
    /// When the render ends; the first limit reached ends it.
    pub stop: Stop,
    /// Radius of the caustics' density estimate.
    pub radius: RadiusRule,
    /// Where photons are sent.
    pub aiming: Aiming,
    /// The structure over the primitives.
    pub structure: Structure,
    /// How quad and disk lights are sampled.
    pub light_sampling: LightSampling,
    /// Squares along each side of such a light, where it is not sampled by the default.
    pub light_grid: u32,
    /// Seed of every random stream.
    pub seed: u64,
}

/// When a render ends: the first limit that is reached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// Estimated relative error of the picture (see [`crate::picture::Picture`]).
    pub error: Option<f32>,
    /// Seconds of wall-clock time spent rendering.
    pub seconds: Option<f64>,
    /// Number of rounds.
    pub rounds: Option<u32>,
}

impl Default for Stop {
    fn default() -> Self {
        Self { error: Some(0.02), seconds: Some(60.0), rounds: None }
    }
}

impl Scene {
    /// Renders at another size, with the same vertical field of view.
    pub fn set_size(&mut self, width: u32, height: u32) {
        self.image.width = width;
        self.image.height = height;
        self.camera.resolution = Vec2::new(width as f32, height as f32);
    }

    /// The material of an object.
    #[inline]
    #[must_use]
    pub fn material_of(&self, object: ObjectId) -> &Material {
        &self.materials[self.objects[object.index()].material.index()]
    }
}
