//! From the scene file to the compiled scene: names to ids, numbers to axes, and every check that
//! needs more than one field.

mod emission;
mod light;
mod mesh;
mod polygon;

use super::assets::AssetSource;
use super::file::{
    AlbedoFile, CameraFile, ImageFile, MaterialFile, ObjectFile, PerspectiveFile, RenderFile, SceneFile,
    ShapeFile, StopFile, read_scene_file,
};
use super::issue::{IssueCode, Issues, SceneErrors};
use super::json::{ParseError, ParseErrorKind, parse};
use super::{
    Camera, ImageSettings, Light, Material, MaterialId, Object, ObjectId, RenderSettings, Scene, Stop,
    Texture, Tone,
};
use crate::geometry::GeometryBuilder;
use glam::{DVec3, Vec2, Vec3};
use mesh::MeshLoader;
use std::collections::HashMap;

/// Least sine of the angle between `up` and the view: below it the picture's horizon is rounding error.
const MIN_UP_SINE: f64 = 1e-5;
/// Bounds of the tangent of half the field of view within which a float still tells pixels apart.
const TAN_HALF_FOV: std::ops::RangeInclusive<f32> = 1e-6..=1e6;

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
    fn camera(&mut self, camera: &CameraFile, image: ImageSettings) -> Option<Camera> {
        let CameraFile::Perspective(PerspectiveFile { eye, target, up, fov }) = camera;
        let (from, to) = (DVec3::from(*eye), DVec3::from(*target));
        let view = to - from;
        // What is left of the view after rounding the positions to floats.
        let blur = f64::from(f32::EPSILON) * from.abs().max(to.abs()).max_element();
        if view.length() <= 4.0 * blur {
            let message = "the target must differ from the eye: there is no direction to look in";
            self.issues.add("/camera/target", IssueCode::Degenerate, message);
            return None;
        }
        if view.normalize().cross(DVec3::from(*up).normalize()).length() < MIN_UP_SINE {
            let message = "`up` must not be parallel to the direction from eye to target";
            self.issues.add("/camera/up", IssueCode::Degenerate, message);
            return None;
        }
        let resolution = Vec2::new(image.width as f32, image.height as f32);
        let camera = Camera::look_at(vec3(*eye), vec3(*target), vec3(*up), *fov as f32, resolution);
        match camera {
            Some(camera) if TAN_HALF_FOV.contains(&camera.tan_half_fov) => Some(camera),
            Some(_) => {
                let message = format!("a field of view of {fov} degrees is too close to 0 or 180");
                self.issues.add("/camera/fov", IssueCode::OutOfRange, message);
                None
            }
            None => {
                self.issues.add("/camera", IssueCode::Degenerate, "eye, target and up span no picture");
                None
            }
        }
    }

    fn materials(&mut self, materials: &'f [(String, Option<MaterialFile>)]) {
        for (name, material) in materials {
            if let Some(material) = material {
                let id = self.add_material(compile_material(material));
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

fn compile_material(material: &MaterialFile) -> Material {
    match material {
        MaterialFile::Diffuse(diffuse) => Material::Diffuse {
            albedo: match &diffuse.albedo {
                AlbedoFile::Color(color) => Texture::Constant(vec3(*color)),
                AlbedoFile::Checker(checker) => {
                    Texture::Checker { colors: checker.colors.map(vec3), size: checker.size as f32 }
                }
            },
        },
        MaterialFile::Mirror(mirror) => Material::Mirror { reflectance: vec3(mirror.reflectance) },
        MaterialFile::Glass(glass) => Material::Glass { ior: glass.ior as f32 },
    }
}

fn vec3(v: [f64; 3]) -> Vec3 {
    DVec3::from(v).as_vec3()
}
