//! The camera of the scene file, and whether it spans a picture.

use super::super::file::{CameraFile, PerspectiveFile};
use super::super::issue::IssueCode;
use super::super::{Camera, ImageSettings, Lens, Projection};
use super::{Compiler, vec3};
use glam::{DVec3, Vec2};

/// Least sine of the angle between `up` and the view: below it the picture's horizon is rounding error.
const MIN_UP_SINE: f64 = 1e-5;
/// Bounds of the tangent of half the field of view within which a float still tells pixels apart.
const TAN_HALF_FOV: std::ops::RangeInclusive<f32> = 1e-6..=1e6;

impl Compiler<'_> {
    pub(super) fn camera(&mut self, camera: &CameraFile, image: ImageSettings) -> Option<Camera> {
        let (eye, target, up) = match camera {
            CameraFile::Perspective(c) => (c.eye, c.target, c.up),
            CameraFile::Orthographic(c) => (c.eye, c.target, c.up),
        };
        let (from, to) = (DVec3::from(eye), DVec3::from(target));
        let view = to - from;
        // What is left of the view after rounding the positions to floats.
        let blur = f64::from(f32::EPSILON) * from.abs().max(to.abs()).max_element();
        if view.length() <= 4.0 * blur {
            let message = "the target must differ from the eye: there is no direction to look in";
            self.issues.add("/camera/target", IssueCode::Degenerate, message);
            return None;
        }
        if view.normalize().cross(DVec3::from(up).normalize()).length() < MIN_UP_SINE {
            let message = "`up` must not be parallel to the direction from eye to target";
            self.issues.add("/camera/up", IssueCode::Degenerate, message);
            return None;
        }
        let projection = match camera {
            CameraFile::Perspective(camera) => self.perspective(camera, view.length())?,
            CameraFile::Orthographic(camera) => Projection::Orthographic { height: camera.height as f32 },
        };
        let resolution = Vec2::new(image.width as f32, image.height as f32);
        let camera = Camera::look_at(vec3(eye), vec3(target), vec3(up), projection, resolution);
        if camera.is_none() {
            self.issues.add("/camera", IssueCode::Degenerate, "eye, target and up span no picture");
        }
        camera
    }

    fn perspective(&mut self, camera: &PerspectiveFile, to_target: f64) -> Option<Projection> {
        let tan_half_fov = libm::tanf((camera.fov as f32).to_radians() * 0.5);
        if !TAN_HALF_FOV.contains(&tan_half_fov) {
            let message = format!("a field of view of {} degrees is too close to 0 or 180", camera.fov);
            self.issues.add("/camera/fov", IssueCode::OutOfRange, message);
            return None;
        }
        let focus_distance = camera.focus_distance.unwrap_or(to_target) as f32;
        let lens = (camera.aperture > 0.0)
            .then_some(Lens { radius: (0.5 * camera.aperture) as f32, focus_distance });
        Some(Projection::Perspective { tan_half_fov, lens })
    }
}
