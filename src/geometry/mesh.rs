//! Triangle meshes: what is shared between the triangles.

use super::packet::{Triangle, TriangleShading};
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

/// A mesh of a scene. The corners of its triangles stand in the structure's leaves once that is built.
#[derive(Clone, Debug, Default)]
pub(super) struct Mesh(MeshData);

impl Mesh {
    pub(super) fn new(data: &MeshData) -> Self {
        Self(data.clone())
    }

    pub(super) fn triangle(&self, index: u32) -> Triangle {
        Triangle(self.0.triangles[index as usize].map(|v| self.0.positions[v as usize]))
    }

    /// What is interpolated over a triangle.
    #[inline]
    pub(super) fn shading(&self, index: u32) -> TriangleShading {
        let Some(corners) = self.0.triangles.get(index as usize) else { return TriangleShading::FLAT };
        let corners = corners.map(|v| v as usize);
        TriangleShading {
            normals: (!self.0.normals.is_empty()).then(|| corners.map(|v| self.0.normals[v])),
            uvs: if self.0.uvs.is_empty() {
                TriangleShading::FLAT.uvs
            } else {
                corners.map(|v| self.0.uvs[v])
            },
        }
    }

    /// Positions of the vertices that triangles use.
    pub(super) fn vertices(&self) -> &[Vec3] {
        &self.0.positions
    }

    /// Drops what is no longer needed once the triangles stand in the leaves: vertices that none uses, and of
    /// flat triangles which vertices they have.
    pub(super) fn settle(&mut self) {
        let mesh = &mut self.0;
        let mut used = vec![false; mesh.positions.len()];
        mesh.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
        let mut used = used.into_iter();
        mesh.positions.retain(|_| used.next().unwrap_or(false));
        mesh.positions.shrink_to_fit();
        if mesh.normals.is_empty() && mesh.uvs.is_empty() {
            mesh.triangles = Vec::new();
        }
    }

    pub(super) fn memory_bytes(&self) -> usize {
        let MeshData { positions, triangles, normals, uvs } = &self.0;
        size_of_val(&positions[..])
            + size_of_val(&triangles[..])
            + size_of_val(&normals[..])
            + size_of_val(&uvs[..])
    }
}
