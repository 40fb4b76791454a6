//! Rays that are sent at meshes.

use glam::Vec3;
use nephroid::geometry::{Geometry, Ray, offset_origin};
use nephroid::sampling::{SamplePoint, uniform_sphere};

/// Pixels across and down.
const SIDE: u16 = 256;

/// Names of sizes, and cells across that make about so many triangles.
pub(crate) const SIZES: [(&str, u16); 3] = [("10k", 70), ("100k", 223), ("1M", 707)];

/// Rays of the three classes that a render sends.
pub(crate) struct RaySet {
    /// From an eye, in the order of the pixels.
    pub(crate) primary: Vec<Ray>,
    /// From where those hit, in all directions.
    pub(crate) bounce: Vec<Ray>,
    /// From there to a lamp, with the distance to it.
    pub(crate) shadow: Vec<(Ray, f32)>,
}

impl RaySet {
    pub(crate) fn new(geometry: &Geometry) -> Self {
        let eye = Vec3::new(0.4, 1.9, 2.6);
        let forward = (Vec3::new(0.0, -0.1, 0.0) - eye).normalize();
        let right = forward.cross(Vec3::Y).normalize();
        let up = right.cross(forward);
        let lamp = Vec3::new(-0.7, 4.0, 0.9);
        let mut set = Self { primary: Vec::new(), bounce: Vec::new(), shadow: Vec::new() };
        for index in 0..u32::from(SIDE) * u32::from(SIDE) {
            let at = |i: u32| (i as f32 + 0.5) / f32::from(SIDE) - 0.5;
            let (x, y) = (at(index % u32::from(SIDE)), at(index / u32::from(SIDE)));
            let ray = Ray::new(eye, (forward + right * x * 0.8 - up * y * 0.8).normalize());
            if let Some(hit) = geometry.closest_hit(&ray) {
                let s = hit.surface;
                let sample = SamplePoint::new(3, index);
                let facing = if s.normal.dot(ray.direction) > 0.0 { -s.normal } else { s.normal };
                let away = (facing + uniform_sphere(sample.get_2d(0)) * 0.999).normalize();
                set.bounce.push(Ray::new(offset_origin(s.point, s.error, s.normal, away), away));
                let to_lamp = lamp + uniform_sphere(sample.get_2d(2)) * 0.3 - s.point;
                let away = to_lamp.normalize();
                let start = offset_origin(s.point, s.error, s.normal, away);
                set.shadow.push((Ray::new(start, away), to_lamp.length()));
            }
            set.primary.push(ray);
        }
        set
    }
}
