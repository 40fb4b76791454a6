//! The camera of a model, or one that has all of it in the picture.

use super::nodes::Placed;
use super::{Import, short, short3};
use glam::{DAffine3, DVec3};
use gltf::Camera;
use gltf::camera::Projection;
use serde_json::{Value, json};

/// Pixels down; the camera's shape gives the pixels across.
const HEIGHT: f32 = 480.0;

/// Vertical field of view of the camera that is added, degrees.
const FOV: f64 = 40.0;

/// From the middle of the model to the camera that is added: before it, a little to the right and above.
const OUTLOOK: DVec3 = DVec3::new(0.35, 0.45, 1.0);

impl Import {
    pub(super) fn camera(&mut self, placed: &Placed<'_>) {
        let given = placed.cameras.first().and_then(|(camera, to_world)| self.given(camera, *to_world));
        self.camera = match given {
            Some(camera) => camera,
            None => {
                self.warn("camera_added", "the model has no camera: one is added that sees all of it");
                self.framing()
            }
        };
    }

    /// The model's own camera; `None` if it looks nowhere.
    fn given(&mut self, camera: &Camera<'_>, to_world: DAffine3) -> Option<Value> {
        // Cameras look along their -z axis.
        let forward = to_world.transform_vector3(DVec3::NEG_Z).try_normalize()?;
        let up = to_world.transform_vector3(DVec3::Y).try_normalize()?;
        let eye = to_world.translation;
        let (middle, radius) = self.sphere();
        // As far as the middle of the model, so that a lens added by hand is focused on it.
        let target = eye + forward * (middle - eye).dot(forward).max(radius * 0.1);
        let [eye, target, up] = [eye, target, up].map(|v| short3(v.as_vec3().to_array()));
        let mut view = json!({ "eye": eye, "target": target, "up": up });
        let aspect = match camera.projection() {
            Projection::Perspective(lens) => {
                view["type"] = "perspective".into();
                view["fov"] = short(lens.yfov().to_degrees().clamp(0.01, 179.0));
                lens.aspect_ratio()
            }
            Projection::Orthographic(lens) => {
                view["type"] = "orthographic".into();
                view["height"] = short((2.0 * lens.ymag().abs()).clamp(1e-6, 1e9));
                Some(lens.xmag() / lens.ymag())
            }
        };
        if let Some(aspect) = aspect.filter(|aspect| (0.1..10.0).contains(aspect)) {
            self.image.insert("width".into(), json!((HEIGHT * aspect).round() as u32));
            self.image.insert("height".into(), json!(HEIGHT as u32));
        }
        Some(view)
    }

    fn framing(&self) -> Value {
        let (middle, radius) = self.sphere();
        let distance = 1.05 * radius / (0.5 * FOV.to_radians()).sin();
        let eye = middle + OUTLOOK.normalize() * distance;
        let [eye, target] = [eye, middle].map(|v| short3(v.as_vec3().to_array()));
        json!({ "type": "perspective", "eye": eye, "target": target, "fov": FOV })
    }
}
