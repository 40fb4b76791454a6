//! The camera: from a point of the image, and of the lens, to a ray.

use crate::geometry::Ray;
use crate::sampling::concentric_disc;
use glam::{Vec2, Vec3};

/// A camera looking along `forward`.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Position of the pinhole, or of the middle of the plane that the rays start from.
    pub eye: Vec3,
    /// Unit viewing direction.
    pub forward: Vec3,
    /// Unit vector to the right of the image.
    pub right: Vec3,
    /// Unit vector to the top of the image.
    pub up: Vec3,
    /// How the picture grows with the distance.
    pub projection: Projection,
    /// Pixels across and down.
    pub resolution: Vec2,
}

/// How the picture grows with the distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// All rays come through one point or, with a lens, through a disc around it.
    Perspective {
        /// Tangent of half the vertical field of view.
        tan_half_fov: f32,
        /// The lens; `None` is a pinhole.
        lens: Option<Lens>,
    },
    /// All rays are parallel.
    Orthographic {
        /// Height of what is seen.
        height: f32,
    },
}

/// How the eye sees a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The ray from the eye to the point.
    pub ray: Ray,
    /// Length of the way, m.
    pub distance: f32,
    /// Where in the picture, in pixels from the top left corner.
    pub raster: Vec2,
    /// Pixels that an area at the point covers if it faces the ray, m⁻².
    pub pixels_per_area: f32,
}

/// A thin lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Radius of the disc.
    pub radius: f32,
    /// Distance along the viewing direction of the plane that is sharp.
    pub focus_distance: f32,
}

impl Camera {
    /// A camera at `eye` that looks at `target`; `None` where those and `up` span no basis.
    #[must_use]
    pub fn look_at(
        eye: Vec3,
        target: Vec3,
        up: Vec3,
        projection: Projection,
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
        Some(Self { eye, forward, right, up: right.cross(forward), projection, resolution })
    }

    /// The lens, if the camera is not a pinhole.
    #[must_use]
    pub fn lens(&self) -> Option<&Lens> {
        match &self.projection {
            Projection::Perspective { lens, .. } => lens.as_ref(),
            Projection::Orthographic { .. } => None,
        }
    }

    /// The ray through a raster position in pixels, x to the right and y down from the top left corner, and
    /// through the middle of the lens.
    #[must_use]
    pub fn ray(&self, raster: Vec2) -> Ray {
        match self.projection {
            Projection::Perspective { tan_half_fov, .. } => {
                Ray::new(self.eye, self.towards(raster, tan_half_fov).normalize())
            }
            Projection::Orthographic { height } => {
                let p = self.on_screen(raster, 0.5 * height);
                Ray::new(self.eye + self.right * p.x + self.up * p.y, self.forward)
            }
        }
    }

    /// The ray through a raster position and a point of the lens, drawn with `u` uniform in the unit square.
    #[must_use]
    pub fn ray_through(&self, lens: &Lens, raster: Vec2, u: Vec2) -> Ray {
        let Projection::Perspective { tan_half_fov, .. } = self.projection else { return self.ray(raster) };
        let p = concentric_disc(u) * lens.radius;
        let aside = self.right * p.x + self.up * p.y;
        // Both ends relative to the eye, so that no digits are lost far from the origin.
        let to_focus = self.towards(raster, tan_half_fov) * lens.focus_distance - aside;
        Ray::new(self.eye + aside, to_focus.normalize())
    }

    /// Where the eye sees a point, through the point of its lens, if it has one, drawn with `u` uniform in the unit
    /// square; `None` if the point is behind it or beside the picture.
    #[must_use]
    pub fn project(&self, point: Vec3, u: Vec2) -> Option<View> {
        let (ray, distance, on_screen, half_height, pixels_per_area) = match self.projection {
            Projection::Perspective { tan_half_fov, lens } => {
                let lens = lens.unwrap_or(Lens { radius: 0.0, focus_distance: 1.0 });
                let p = concentric_disc(u) * lens.radius;
                let to = point - self.eye - self.right * p.x - self.up * p.y;
                let (depth, distance) = (to.dot(self.forward), to.length());
                // Where the ray crosses the plane at distance 1 from the middle of the lens.
                let q = p / lens.focus_distance + self.across(to) / depth;
                let ray = Ray::new(point - to, to / distance);
                // A pixel's solid angle is its area at distance 1 times the cubed cosine from the axis.
                let cosine = depth / distance;
                let solid_angle = self.pixel_width(1.0).powi(2) * cosine.powi(3);
                (ray, distance, q, tan_half_fov, 1.0 / (distance * distance * solid_angle))
            }
            Projection::Orthographic { height } => {
                let to = point - self.eye;
                let depth = to.dot(self.forward);
                let ray = Ray::new(point - self.forward * depth, self.forward);
                (ray, depth, self.across(to), 0.5 * height, self.pixel_width(1.0).powi(-2))
            }
        };
        let half_width = half_height * (self.resolution.x / self.resolution.y);
        let ndc = Vec2::new(on_screen.x / half_width, -on_screen.y / half_height);
        let raster = (ndc + 1.0) * 0.5 * self.resolution;
        let inside = raster.cmpge(Vec2::ZERO).all() && raster.cmplt(self.resolution).all();
        let ahead = (point - ray.origin).dot(self.forward) > 0.0;
        (inside && ahead && pixels_per_area.is_finite()).then_some(View {
            ray,
            distance,
            raster,
            pixels_per_area,
        })
    }

    /// A vector's parts to the right and up.
    fn across(&self, to: Vec3) -> Vec2 {
        Vec2::new(to.dot(self.right), to.dot(self.up))
    }

    /// From the eye to the plane at distance 1.
    fn towards(&self, raster: Vec2, tan_half_fov: f32) -> Vec3 {
        let p = self.on_screen(raster, tan_half_fov);
        self.forward + self.right * p.x + self.up * p.y
    }

    /// Where a raster position lies on a screen of this half height.
    fn on_screen(&self, raster: Vec2, half_height: f32) -> Vec2 {
        let ndc = raster / self.resolution * 2.0 - 1.0;
        let aspect = self.resolution.x / self.resolution.y;
        Vec2::new(ndc.x * half_height * aspect, -ndc.y * half_height)
    }

    /// The raster position that shows a point: the inverse of [`Camera::ray`]. `None` for what is not in front of
    /// the camera.
    #[inline]
    #[must_use]
    pub fn raster(&self, point: Vec3) -> Option<Vec2> {
        let to = point - self.eye;
        let depth = to.dot(self.forward);
        if depth <= 0.0 {
            return None;
        }
        let scale = match self.projection {
            Projection::Perspective { tan_half_fov, .. } => 1.0 / (depth * tan_half_fov),
            Projection::Orthographic { height } => 2.0 / height,
        };
        let aspect = self.resolution.x / self.resolution.y;
        let ndc = Vec2::new(to.dot(self.right) * scale / aspect, -to.dot(self.up) * scale);
        Some((ndc + 1.0) * 0.5 * self.resolution)
    }

    /// From a point toward where it is seen from, through the middle of the lens; of any length.
    #[inline]
    #[must_use]
    pub fn to_eye(&self, point: Vec3) -> Vec3 {
        match self.projection {
            Projection::Perspective { .. } => self.eye - point,
            Projection::Orthographic { .. } => -self.forward,
        }
    }

    /// Width of a pixel at a distance from the eye.
    #[must_use]
    pub fn pixel_width(&self, distance: f32) -> f32 {
        match self.projection {
            Projection::Perspective { tan_half_fov, .. } => {
                distance * (2.0 * tan_half_fov / self.resolution.y)
            }
            Projection::Orthographic { height } => height / self.resolution.y,
        }
    }
}
