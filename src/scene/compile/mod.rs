//! From the scene file to the compiled scene: names to ids, numbers to axes, and every check that
//! needs more than one field.

mod camera;
mod emission;
mod light;
mod material;
mod mesh;
mod polygon;

use super::assets::AssetSource;
use super::file::{
    ImageFile, MaterialFile, ObjectFile, RenderFile, SceneFile, ShapeFile, StopFile, read_scene_file,
};
use super::issue::{IssueCode, Issues, SceneErrors};
use super::json::{ParseError, ParseErrorKind, parse};
use super::{
    ImageSettings, Light, Material, MaterialId, Object, ObjectId, RenderSettings, Scene, Stop, Tone,
};
use crate::geometry::GeometryBuilder;
use glam::{DVec3, Vec3};
use mesh::MeshLoader;
use std::collections::HashMap;

impl Scene {
    /// Reads and compiles a scene file; `assets` gives the meshes that it names.
    ///
    /// # Errors
    /// Everything that is wrong with the scene, at once.
    pub fn from_json(text: &str, assets: &dyn AssetSource) -> Result<Self, SceneErrors> {
        let mut issues = Issues::default();
        let root = match parse(text) {
            Ok(root) => root,
            Err(error) => {
                note_parse_error(error, &mut issues);
                return Err(issues.into_errors(text, None));
            }
        };
        let scene = read_scene_file(&root, &mut issues).and_then(|file| compile(&file, assets, &mut issues));
        scene.ok_or_else(|| issues.into_errors(text, Some(&root)))
    }
}

fn note_parse_error(error: ParseError, issues: &mut Issues) {
    let code = match error.kind {
        ParseErrorKind::Syntax => IssueCode::Syntax,
        ParseErrorKind::TooDeep => IssueCode::TooDeep,
        ParseErrorKind::TooLarge => IssueCode::TooLarge,
    };
    issues.add_at(error.pointer(), code, error.message, Some(error.offset));
}

/// Compiles a scene file; `None` if there are issues, be they of the reader or new ones.
fn compile(file: &SceneFile, assets: &dyn AssetSource, issues: &mut Issues) -> Option<Scene> {
    let mut compiler = Compiler {
        issues,
        meshes: MeshLoader::new(assets),
        material_ids: HashMap::new(),
        materials: Vec::new(),
        objects: Vec::new(),
        geometry: GeometryBuilder::default(),
        lights: Vec::new(),
    };
    let image = image_settings(file.image.as_ref().and_then(Option::as_ref));
    let camera = file.camera.as_ref().and_then(|camera| compiler.camera(camera, image));
    compiler.materials(file.materials.as_deref().unwrap_or_default());
    compiler.objects(file.objects.as_deref().unwrap_or_default());
    compiler.lights(file.lights.as_deref().unwrap_or_default());
    let render = file.render.as_ref().and_then(|render| compiler.render(render));
    if compiler.issues.count() > 0 {
        return None;
    }
    Some(Scene {
        name: file.name.clone()?.unwrap_or_default(),
        image,
        camera: camera?,
        materials: compiler.materials,
        objects: compiler.objects,
        geometry: compiler.geometry.build_as(render.as_ref()?.structure),
        lights: compiler.lights,
        environment: file.environment.as_ref()?.as_ref().map_or(Vec3::ZERO, |e| vec3(e.radiance)),
        render: render?,
    })
}

/// The scene while it grows.
struct Compiler<'f> {
    issues: &'f mut Issues,
    meshes: MeshLoader<'f>,
    material_ids: HashMap<&'f str, MaterialId>,
    materials: Vec<Material>,
    objects: Vec<Object>,
    geometry: GeometryBuilder,
    lights: Vec<Light>,
}

impl<'f> Compiler<'f> {
    fn materials(&mut self, materials: &'f [(String, Option<MaterialFile>)]) {
        for (name, material) in materials {
            if let Some(material) = material.as_ref().and_then(|m| self.material(name, m)) {
                let id = self.add_material(material);
                self.material_ids.insert(name, id);
            }
        }
    }

    fn add_material(&mut self, material: Material) -> MaterialId {
        let id = MaterialId(self.materials.len() as u32);
        self.materials.push(material);
        id
    }

    fn objects(&mut self, objects: &[Option<ObjectFile>]) {
        for (index, object) in objects.iter().enumerate() {
            let Some(object) = object else { continue };
            let pointer = format!("/objects/{index}");
            // The reader has refused names that no material has; those whose material is wrong remain.
            let material = self.material_ids.get(object.material.as_str()).copied().unwrap_or(MaterialId(0));
            let name = object.name.clone().unwrap_or_else(|| format!("objects/{index}"));
            let id = self.add_object(Object { name, material, emitter: None });
            self.shape(id, &object.shape, &pointer);
            self.emission(id, object, index);
        }
    }

    fn add_object(&mut self, object: Object) -> ObjectId {
        let id = ObjectId(self.objects.len() as u32);
        self.objects.push(object);
        id
    }

    fn shape(&mut self, object: ObjectId, shape: &ShapeFile, pointer: &str) {
        match shape {
            ShapeFile::Sphere(sphere) => {
                self.geometry.sphere(object, vec3(sphere.center), sphere.radius as f32)
            }
            ShapeFile::Polygon(polygon) => {
                polygon::add(polygon, object, &mut self.geometry, pointer, self.issues);
            }
            ShapeFile::Mesh(mesh) => {
                if let Some(mesh) = self.meshes.load(mesh, pointer, self.issues) {
                    self.geometry.mesh(object, &mesh);
                }
            }
        }
    }

    fn render(&mut self, render: &RenderFile) -> Option<RenderSettings> {
        let stop = match &render.stop {
            None => Stop::default(),
            Some(StopFile { error: None, seconds: None, rounds: None }) => {
                let message = "a render must end: give at least one of `error`, `seconds`, `rounds`";
                self.issues.add("/render/stop", IssueCode::MissingField, message);
                return None;
            }
            Some(StopFile { error, seconds, rounds }) => {
                Stop { error: error.map(|e| e as f32), seconds: *seconds, rounds: *rounds }
            }
        };
        let RenderFile { paths, radius, structure, light_sampling, light_grid, seed, stop: _ } = *render;
        Some(RenderSettings { paths, stop, radius, structure, light_sampling, light_grid, seed })
    }
}

fn image_settings(image: Option<&ImageFile>) -> ImageSettings {
    match image {
        Some(ImageFile { width, height, exposure, tone }) => {
            ImageSettings { width: *width, height: *height, exposure: *exposure as f32, tone: *tone }
        }
        None => ImageSettings { width: 640, height: 480, exposure: 0.0, tone: Tone::Linear },
    }
}

fn vec3(v: [f64; 3]) -> Vec3 {
    DVec3::from(v).as_vec3()
}
