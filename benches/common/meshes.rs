//! Meshes and the rays that are sent at them.

use glam::Vec3;
use nephroid::geometry::{Geometry, MeshData, Ray, offset_origin};
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

/// A square of hills with `2 * cells²` triangles.
pub(crate) fn terrain(cells: u16) -> MeshData {
    grid(cells, cells, |u, v| {
        let (x, z) = (4.0 * u - 2.0, 4.0 * v - 2.0);
        let wave = |k: f32, a: f32| a * (k * x + 0.7 * k * z).sin() * (0.9 * k * z - 0.3 * k * x).cos();
        Vec3::new(x, wave(2.1, 0.3) + wave(7.3, 0.08) + wave(31.0, 0.02) + wave(113.0, 0.006), z)
    })
}

/// A dented ball with `2 * cells²` triangles.
pub(crate) fn ball(cells: u16) -> MeshData {
    grid(cells, cells, |u, v| {
        let (phi, theta) = (u * std::f32::consts::TAU, v * std::f32::consts::PI);
        let radius = 1.0 + 0.02 * (20.0 * phi).sin() * (17.0 * theta).sin();
        Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()) * radius
    })
}

fn grid(across: u16, down: u16, point: impl Fn(f32, f32) -> Vec3) -> MeshData {
    let mut mesh = MeshData::default();
    for i in 0..=down {
        for j in 0..=across {
            mesh.positions.push(point(f32::from(j) / f32::from(across), f32::from(i) / f32::from(down)));
        }
    }
    let at = |i: u16, j: u16| u32::from(i) * (u32::from(across) + 1) + u32::from(j);
    for i in 0..down {
        for j in 0..across {
            mesh.triangles.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
            mesh.triangles.push([at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)]);
        }
    }
    mesh
}
