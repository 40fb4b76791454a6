//! Triangle meshes.

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
