//! The pinhole camera: from a point of the image to a ray.

use crate::geometry::Ray;
use glam::{Vec2, Vec3};

/// A pinhole camera looking along `forward`.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Position of the pinhole.
    pub eye: Vec3,
    /// Unit viewing direction.
    pub forward: Vec3,
    /// Unit vector to the right of the image.
    pub right: Vec3,
    /// Unit vector to the top of the image.
    pub up: Vec3,
    /// Tangent of half the vertical field of view.
    pub tan_half_fov: f32,
    /// Pixels across and down.
    pub resolution: Vec2,
}

impl Camera {
    /// A camera at `eye` that looks at `target`; `None` where those and `up` span no basis.
    #[must_use]
    pub fn look_at(
        eye: Vec3,
        target: Vec3,
        up: Vec3,
        vertical_fov_deg: f32,
        resolution: Vec2,
    ) -> Option<Self> {
        let forward = (target - eye).try_normalize()?;
        let up = up.try_normalize()?;
        let right = forward.cross(up);
        // A sine below 1e-6 leaves fewer than three good digits in f32.
        if right.length() < 1e-6 {
            return None;
        }
        let right = right.normalize();
        let tan_half_fov = libm::tanf(vertical_fov_deg.to_radians() * 0.5);
        Some(Self { eye, forward, right, up: right.cross(forward), tan_half_fov, resolution })
    }

    /// The ray through a raster position in pixels, x to the right and y down from the top left corner.
    #[must_use]
    pub fn ray(&self, raster: Vec2) -> Ray {
        let ndc = raster / self.resolution * 2.0 - 1.0;
        let aspect = self.resolution.x / self.resolution.y;
        let x = ndc.x * self.tan_half_fov * aspect;
        let y = -ndc.y * self.tan_half_fov;
        Ray::new(self.eye, (self.forward + self.right * x + self.up * y).normalize())
    }

    /// Width of a pixel at distance 1 in front of the eye.
    #[must_use]
    pub fn pixel_spread(&self) -> f32 {
        2.0 * self.tan_half_fov / self.resolution.y
    }
}
