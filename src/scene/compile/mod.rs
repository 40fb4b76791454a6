//! From the scene file to the compiled scene: names to ids, numbers to axes, and every check that
//! needs more than one field.

mod camera;
mod checks;
mod emission;
mod environment;
mod layers;
mod light;
mod material;
mod mesh;
mod motion;
mod polygon;
mod shape;
mod texture;
mod touching;

pub(crate) use layers::UNGROUPED;

use super::assets::AssetSource;
use super::file::{ImageFile, ObjectFile, RenderFile, SceneFile, StopFile, read_scene_file};
use super::issue::{IssueCode, Issues, SceneErrors};
use super::json::{ParseError, ParseErrorKind, parse};
use super::material_file::MaterialFile;
use super::shape_file::ShapeFile;
use super::{
    ImageSettings, Light, LightGroups, Material, MaterialId, Object, ObjectId, RenderSettings, Scene, Stop,
    Tone, Warning,
};
use crate::geometry::GeometryBuilder;
use crate::media::MOST_MATERIALS;
use glam::{DAffine3, DVec3, Vec3};
use mesh::MeshLoader;
use shape::Originals;
use std::collections::{HashMap, HashSet};
use std::mem::take;
use texture::TextureLoader;

impl Scene {
    /// Reads and compiles a scene file; `assets` gives the files that it names.
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
        assets,
        meshes: MeshLoader::new(assets),
        textures: TextureLoader::new(assets),
        originals: Originals::new(file.objects.as_deref().unwrap_or_default()),
        material_ids: HashMap::new(),
        mixes: HashSet::new(),
        materials: Vec::new(),
        objects: Vec::new(),
        geometry: GeometryBuilder::default(),
        lights: Vec::new(),
        shutter: [0.0; 2],
        warnings: Vec::new(),
        light_places: Vec::new(),
        light_groups: LightGroups::default(),
    };
    let image = image_settings(file.image.as_ref().and_then(Option::as_ref));
    let camera = file.camera.as_ref().and_then(|camera| {
        compiler.shutter(camera);
        compiler.camera(camera, image)
    });
    compiler.materials(file.materials.as_deref().unwrap_or_default());
    compiler.objects(file.objects.as_deref().unwrap_or_default());
    compiler.lights(file.lights.as_deref().unwrap_or_default());
    let render = file.render.as_ref().and_then(|render| compiler.render(render));
    let surroundings = file.environment.as_ref().and_then(Option::as_ref);
    let environment = compiler.environment(surroundings);
    let group = surroundings.and_then(|file| file.group());
    compiler.light_groups.of_environment = compiler.light_group(group, "/environment");
    if compiler.issues.count() > 0 {
        return None;
    }
    let environment = environment?;
    let mut scene = Scene {
        name: file.name.clone()?.unwrap_or_default(),
        image,
        camera: camera?,
        materials: take(&mut compiler.materials),
        objects: take(&mut compiler.objects),
        geometry: take(&mut compiler.geometry).build_as(render.as_ref()?.structure),
        lights: take(&mut compiler.lights),
        image_bytes: compiler.textures.memory_bytes() + environment.memory_bytes(),
        environment,
        light_groups: take(&mut compiler.light_groups),
        render: render?,
        touching: Vec::new(),
        warnings: Vec::new(),
    };
    scene.touching = compiler.touching(file.objects.as_deref().unwrap_or_default(), &scene);
    scene.warnings = compiler.checks(file.objects.as_deref().unwrap_or_default(), &scene);
    compiler.check_layers(&scene)?;
    Some(scene)
}

/// Why an asset is refused.
type Refusal = (IssueCode, String);

/// The scene while it grows.
struct Compiler<'f> {
    issues: &'f mut Issues,
    assets: &'f dyn AssetSource,
    meshes: MeshLoader<'f>,
    textures: TextureLoader<'f>,
    originals: Originals<'f>,
    material_ids: HashMap<&'f str, MaterialId>,
    mixes: HashSet<&'f str>,
    materials: Vec<Material>,
    objects: Vec<Object>,
    geometry: GeometryBuilder,
    lights: Vec<Light>,
    /// When the shutter opens and closes, s.
    shutter: [f64; 2],
    warnings: Vec<Warning>,
    /// Where in the file each light is, as a JSON pointer.
    light_places: Vec<String>,
    light_groups: LightGroups,
}

impl<'f> Compiler<'f> {
    fn materials(&mut self, materials: &'f [(String, Option<MaterialFile>)]) {
        if materials.len() > MOST_MATERIALS {
            let message =
                format!("there are {} materials; at most {MOST_MATERIALS} are told apart", materials.len());
            self.issues.add("/materials", IssueCode::TooLarge, message);
            return;
        }
        let given = || materials.iter().filter_map(|(name, material)| Some((name, material.as_ref()?)));
        for (name, material) in given() {
            if let Some(material) = self.material(name, material) {
                self.name_material(name, material);
            }
        }
        // Mixes name others, which may stand behind them.
        let is_mix = |material: &MaterialFile| matches!(material, MaterialFile::Mix(_));
        self.mixes = given().filter(|(_, m)| is_mix(m)).map(|(name, _)| name.as_str()).collect();
        for (name, material) in given() {
            if let MaterialFile::Mix(mix) = material
                && let Some(material) = self.mix(name, mix)
            {
                self.name_material(name, material);
            }
        }
    }

    fn name_material(&mut self, name: &'f str, material: Material) {
        let id = self.add_material(material);
        self.material_ids.insert(name, id);
    }

    fn warn(&mut self, code: &'static str, pointer: &str, message: impl Into<String>) {
        self.warnings.push(Warning { code, pointer: Some(pointer.to_owned()), message: message.into() });
    }

    fn add_material(&mut self, material: Material) -> MaterialId {
        let id = MaterialId(self.materials.len() as u32);
        self.materials.push(material);
        id
    }

    fn objects(&mut self, objects: &[Option<ObjectFile>]) {
        for (index, object) in objects.iter().enumerate() {
            let Some(object) = object else { continue };
            // The reader has refused names that no material has; those whose material is wrong remain.
            let material = self.material_ids.get(object.material.as_str()).copied().unwrap_or(MaterialId(0));
            let name = object.name.clone().unwrap_or_else(|| format!("objects/{index}"));
            let id = self.add_object(Object { name, material, emitter: None });
            let motion = self.place_object(id, object, index);
            self.emission(id, object, motion, index);
        }
    }

    fn add_object(&mut self, object: Object) -> ObjectId {
        let id = ObjectId(self.objects.len() as u32);
        self.objects.push(object);
        id
    }

    fn shape(&mut self, object: ObjectId, shape: &ShapeFile, index: usize) {
        let pointer = &format!("/objects/{index}");
        match shape {
            ShapeFile::Sphere(sphere) => {
                self.geometry.sphere(object, vec3(sphere.center), sphere.radius as f32)
            }
            ShapeFile::Polygon(polygon) => {
                polygon::add(polygon, object, &mut self.geometry, pointer, self.issues);
            }
            ShapeFile::Mesh(_) | ShapeFile::Heightfield(_) => self.add_mesh(shape, index, object),
            ShapeFile::Disk(disk) => {
                let normal = DVec3::from(disk.normal).normalize().as_vec3();
                self.geometry.disk(object, vec3(disk.center), normal, disk.radius as f32);
            }
            ShapeFile::Cylinder(file) => {
                let (from, to) = (vec3(file.from), vec3(file.to));
                if from == to {
                    let message = "the ends of the cylinder are the same point";
                    self.issues.add(format!("{pointer}/to"), IssueCode::Degenerate, message);
                    return;
                }
                self.geometry.cylinder(object, from, to, file.radius as f32);
            }
            ShapeFile::Box(file) => self.box_sides(file, object, DAffine3::IDENTITY, pointer),
            ShapeFile::Instance(instance) => self.instance(instance, object, pointer),
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
        let RenderFile { caustics, radius, aiming, structure, light_sampling, light_grid, seed, .. } =
            *render;
        let (paths, layers) = (render.paths.clone(), self.layers(&render.layers)?);
        Some(RenderSettings {
            paths,
            layers,
            caustics,
            stop,
            radius,
            aiming,
            structure,
            light_sampling,
            light_grid,
            seed,
        })
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
