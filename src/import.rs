//! Models in binary glTF (`.glb`), as scene files of our own.
//!
//! A model becomes a scene file with its meshes (PLY) and pictures beside it, not a compiled scene, so that people can
//! go on from there by hand. What a scene file has no place for is left out and noted.
//!
//! Units: glTF's candela, lux and nits become W·sr⁻¹, W·m⁻² and W·sr⁻¹·m⁻² one to one; pictures have no unit, and the
//! exposure is set by the light that arrives at the middle of the model.

mod camera;
mod container;
mod light;
mod material;
mod mesh;
mod nodes;
mod picture;
mod ply;

use crate::scene::MemoryAssets;
use crate::scene::Warning;
use container::Model;
use glam::{DVec3, Vec3};
use material::Surface;
use nodes::Placed;
use serde_json::{Map, Value, json};
use std::collections::{BTreeSet, HashMap};

/// A model as a scene file.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The text of the scene file.
    pub scene: String,
    /// The files that it names.
    pub assets: MemoryAssets,
    /// What of the model is not in it, and what was added.
    pub warnings: Vec<Warning>,
}

/// Why a file is not a model that can be read.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// The container is damaged: its lengths do not fit together.
    #[error("not a readable glTF binary: {0}")]
    Container(String),
    /// The description of the model is wrong.
    #[error("{place}: {reason}")]
    Content {
        /// Where, in the terms of the file.
        place: String,
        /// What is wrong.
        reason: String,
    },
    /// There is more of something than is read.
    #[error("the model has more than {limit} {what}")]
    TooLarge {
        /// What there is too much of.
        what: &'static str,
        /// The limit.
        limit: usize,
    },
}

/// Reads a binary glTF file. Names of assets begin with `folder`, a relative path, and a slash.
///
/// # Errors
/// If the file is damaged, refers to other files for its geometry, or is too large.
pub fn import_glb(bytes: &[u8], folder: &str) -> Result<Imported, ImportError> {
    let model = Model::read(bytes)?;
    let placed = nodes::collect(&model)?;
    let mut import = Import::new(folder);
    import.note_what_is_ignored(&model, &placed);
    import.objects(&model, &placed)?;
    import.lights(&placed);
    import.camera(&placed);
    import.light_if_dark();
    import.expose();
    Ok(import.finish())
}

/// The scene file while it grows.
struct Import {
    folder: String,
    assets: MemoryAssets,
    warnings: Vec<Warning>,
    names: BTreeSet<String>,
    image: Map<String, Value>,
    camera: Value,
    /// Surfaces by the index of their material, pictures by their index and factor.
    surfaces: HashMap<Option<usize>, Surface>,
    pictures: HashMap<(usize, [u32; 3]), Value>,
    materials: Map<String, Value>,
    objects: Vec<Value>,
    lights: Vec<Value>,
    environment: Option<Value>,
    /// Corners of the box around all objects.
    bounds: Option<[Vec3; 2]>,
    /// Irradiance of the lights at the middle of the box, if nothing is in the way.
    irradiance: f64,
    emits: bool,
}

impl Import {
    fn new(folder: &str) -> Self {
        Self {
            folder: folder.to_owned(),
            assets: MemoryAssets::default(),
            warnings: Vec::new(),
            names: BTreeSet::new(),
            image: Map::new(),
            camera: Value::Null,
            surfaces: HashMap::new(),
            pictures: HashMap::new(),
            materials: Map::new(),
            objects: Vec::new(),
            lights: Vec::new(),
            environment: None,
            bounds: None,
            irradiance: 0.0,
            emits: false,
        }
    }

    fn warn(&mut self, code: &'static str, message: impl Into<String>) {
        let message = message.into();
        if !self.warnings.iter().any(|known| known.code == code && known.message == message) {
            self.warnings.push(Warning { code, pointer: None, message });
        }
    }

    /// A name that nothing else has, after a user's own.
    fn unique(&mut self, wanted: &str) -> String {
        // Room for a number within the format's longest name.
        let wanted: String = wanted.chars().take(150).collect();
        let candidates = std::iter::once(wanted.clone()).chain((2_u32..).map(|i| format!("{wanted} {i}")));
        let name = candidates.into_iter().find(|name| !self.names.contains(name)).unwrap_or_default();
        self.names.insert(name.clone());
        name
    }

    /// Keeps a file, and gives the name by which the scene finds it.
    fn keep(&mut self, stem: &str, extension: &str, bytes: Vec<u8>) -> String {
        let plain =
            |c: char| if c.is_ascii_alphanumeric() || c == '-' { c.to_ascii_lowercase() } else { '-' };
        let stem: String = stem.chars().map(plain).take(80).collect();
        let names = std::iter::once(stem.clone()).chain((2_u32..).map(|i| format!("{stem}-{i}")));
        let names = names.map(|stem| format!("{}/{stem}.{extension}", self.folder));
        let name = names.into_iter().find(|name| !self.assets.files.contains_key(name)).unwrap_or_default();
        self.assets.files.insert(name.clone(), bytes);
        name
    }

    fn note_what_is_ignored(&mut self, model: &Model, placed: &Placed<'_>) {
        let json = model.document.as_json();
        for extension in &json.extensions_used {
            if !container::EXTENSIONS.contains(&extension.as_str()) {
                self.warn("extension_ignored", format!("the extension {extension} is not read"));
            }
        }
        for (count, code, what) in [
            (json.animations.len(), "animation_ignored", "animations"),
            (json.skins.len(), "skin_ignored", "skins"),
            (placed.cameras.len().saturating_sub(1), "camera_ignored", "cameras beside the first"),
        ] {
            if count > 0 {
                self.warn(code, format!("{count} {what} are left out"));
            }
        }
    }

    /// Middle and radius of the sphere around the box of all objects.
    fn sphere(&self) -> (DVec3, f64) {
        let [min, max] = self.bounds.unwrap_or([Vec3::NEG_ONE, Vec3::ONE]).map(|p| p.as_dvec3());
        ((min + max) * 0.5, ((max - min).length() * 0.5).max(1e-6))
    }

    /// Sets the exposure so that a white surface in the middle of the model is a little below white.
    fn expose(&mut self) {
        if self.irradiance > 0.0 {
            let stops = (std::f64::consts::PI / self.irradiance).log2();
            self.image.insert("exposure".into(), json!((stops.clamp(-60.0, 60.0) * 10.0).round() / 10.0));
        }
    }

    fn finish(self) -> Imported {
        let list =
            |entries: Vec<Value>| entries.iter().map(|e| format!("    {e}")).collect::<Vec<_>>().join(",\n");
        let materials =
            self.materials.iter().map(|(name, m)| format!("    {}: {m}", json!(name))).collect::<Vec<_>>();
        let mut fields = vec![
            "\"nephroid\": 1".to_owned(),
            format!("\"image\": {}", Value::Object(self.image)),
            format!("\"camera\": {}", self.camera),
            format!("\"materials\": {{\n{} }}", materials.join(",\n")),
            format!("\"objects\": [\n{} ]", list(self.objects)),
            format!("\"lights\": [\n{} ]", list(self.lights)),
        ];
        fields.extend(self.environment.map(|environment| format!("\"environment\": {environment}")));
        let scene = format!("{{ {} }}\n", fields.join(",\n  "));
        Imported { scene, assets: self.assets, warnings: self.warnings }
    }
}

/// A float as short as it can be written.
fn short(x: f32) -> Value {
    let x: f64 = x.to_string().parse().ok().filter(|x: &f64| x.is_finite()).unwrap_or(0.0);
    if x.fract() == 0.0 && x.abs() < 1e9 { json!(x as i64) } else { json!(x) }
}

fn short3(v: [f32; 3]) -> Value {
    v.map(short).to_vec().into()
}
