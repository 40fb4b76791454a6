//! Surfaces and how a ray finds the nearest of them.

mod mesh;
mod polygon;
mod ray;
mod sphere;

pub use mesh::MeshData;
pub use ray::Ray;

use crate::scene::ObjectId;
use glam::Vec3;

/// All primitives of a scene and the structure over them.
#[derive(Debug, Default)]
pub struct Geometry {}

/// Collects primitives; [`GeometryBuilder::build`] makes the structure over them.
#[derive(Debug, Default)]
pub struct GeometryBuilder {}

impl GeometryBuilder {
    /// Adds a sphere. The radius is positive.
    pub fn sphere(&mut self, object: ObjectId, center: Vec3, radius: f32) {
        let _ = (object, center, radius);
    }

    /// Adds a planar polygon: an outline and the outlines of its holes, even-odd rule. The caller has
    /// checked it with [`polygon_problem`].
    pub fn polygon(&mut self, object: ObjectId, outlines: &[Vec<Vec3>]) {
        let _ = (object, outlines);
    }

    /// Adds a triangle mesh. Indices are in range.
    pub fn mesh(&mut self, object: ObjectId, mesh: &MeshData) {
        let _ = (object, mesh);
    }

    /// Builds the structure over all primitives.
    #[must_use]
    pub fn build(self) -> Geometry {
        Geometry {}
    }
}
