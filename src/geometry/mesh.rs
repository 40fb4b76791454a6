//! Triangle meshes, and ray against triangle without gaps at shared edges.

use super::bounds::Bounds;
use super::{Ray, SurfacePoint};
use glam::{Vec2, Vec3};

/// A triangle mesh as it is read from a file: shared vertices and triangles between them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshData {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Three indices into `positions` per triangle, anticlockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Unit normal per vertex, interpolated over the triangles; empty for flat triangles.
    pub normals: Vec<Vec3>,
    /// Texture coordinates per vertex; empty if there are none.
    pub uvs: Vec<Vec2>,
}

/// The corners of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Triangle(pub(super) [Vec3; 3]);

/// What is interpolated over a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TriangleShading {
    pub(super) normals: Option<[Vec3; 3]>,
    pub(super) uvs: [Vec2; 3],
}

/// A ray prepared for the watertight test of Woop, Benthin and Wald (2013): the coordinate along which it
/// runs most becomes z, and the other two are sheared so that the ray is the z axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShearedRay {
    origin: Vec3,
    axes: [usize; 3],
    shear: Vec3,
}

impl ShearedRay {
    #[inline]
    pub(super) fn new(ray: &Ray) -> Self {
        let d = ray.direction;
        let a = d.abs();
        let z = if a.x >= a.y && a.x >= a.z {
            0
        } else if a.y >= a.z {
            1
        } else {
            2
        };
        // The winding does not matter: both sides are hit.
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        let shear = Vec3::new(d[x] / d[z], d[y] / d[z], 1.0 / d[z]);
        Self { origin: ray.origin, axes: [x, y, z], shear }
    }

    /// A corner in the sheared space; the same corner gives the same result for every triangle.
    #[inline]
    fn transform(&self, corner: Vec3) -> Vec3 {
        let p = corner - self.origin;
        let [x, y, z] = self.axes;
        Vec3::new(p[x] - self.shear.x * p[z], p[y] - self.shear.y * p[z], self.shear.z * p[z])
    }
}

impl Triangle {
    /// Distance along the ray in `(0, t_max)` and the barycentric weights of the three corners.
    #[inline]
    pub(super) fn intersect(&self, ray: &ShearedRay, t_max: f32) -> Option<(f32, Vec3)> {
        let [a, b, c] = self.0.map(|corner| ray.transform(corner));
        let mut u = c.x * b.y - c.y * b.x;
        let mut v = a.x * c.y - a.y * c.x;
        let mut w = b.x * a.y - b.y * a.x;
        if u == 0.0 || v == 0.0 || w == 0.0 {
            // On an edge in f32: decide in f64, where the products are exact.
            let exact =
                |p: Vec3, q: Vec3| (f64::from(p.x) * f64::from(q.y) - f64::from(p.y) * f64::from(q.x)) as f32;
            (u, v, w) = (exact(c, b), exact(a, c), exact(b, a));
        }
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let determinant = u + v + w;
        if determinant == 0.0 {
            return None;
        }
        let weights = Vec3::new(u, v, w) / determinant;
        let t = weights.dot(Vec3::new(a.z, b.z, c.z));
        (t > 0.0 && t < t_max).then_some((t, weights))
    }

    /// The surface at the point with these barycentric weights.
    pub(super) fn surface(&self, weights: Vec3, shading: &TriangleShading) -> SurfacePoint {
        let [a, b, c] = self.0;
        let point = a * weights.x + b * weights.y + c * weights.z;
        let size = (a * weights.x).abs() + (b * weights.y).abs() + (c * weights.z).abs();
        let normal = (b - a).cross(c - a).normalize_or(Vec3::Y);
        let shading_normal = match shading.normals {
            None => normal,
            Some([p, q, r]) => {
                let n = (p * weights.x + q * weights.y + r * weights.z).normalize_or(normal);
                // Vertex normals decide which side is outside only together with the winding.
                if n.dot(normal) < 0.0 { -n } else { n }
            }
        };
        let [p, q, r] = shading.uvs;
        SurfacePoint {
            point,
            // Seven rounded operations (gamma_7), half an ulp each.
            error: size.max_element() * (3.5 * f32::EPSILON),
            normal,
            shading_normal,
            uv: p * weights.x + q * weights.y + r * weights.z,
        }
    }

    pub(super) fn bounds(&self) -> Bounds {
        Bounds::of(self.0).padded()
    }
}
