//! Meshes as binary PLY, which the scene reader reads.

use crate::geometry::MeshData;

/// A mesh as a PLY file.
pub(super) fn encode(mesh: &MeshData) -> Vec<u8> {
    let mut properties = vec!["x", "y", "z"];
    if !mesh.normals.is_empty() {
        properties.extend(["nx", "ny", "nz"]);
    }
    if !mesh.uvs.is_empty() {
        properties.extend(["s", "t"]);
    }
    let properties: String = properties.iter().map(|name| format!("property float {name}\n")).collect();
    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\n{properties}element face {}\n\
         property list uchar uint vertex_indices\nend_header\n",
        mesh.positions.len(),
        mesh.triangles.len()
    );
    let mut bytes = header.into_bytes();
    for (index, position) in mesh.positions.iter().enumerate() {
        let normal = mesh.normals.get(index).map(|n| n.to_array());
        let uv = mesh.uvs.get(index).map(|uv| uv.to_array());
        let values = position.to_array().into_iter().chain(normal.into_iter().flatten());
        bytes.extend(values.chain(uv.into_iter().flatten()).flat_map(f32::to_le_bytes));
    }
    for triangle in &mesh.triangles {
        bytes.push(3);
        bytes.extend(triangle.iter().flat_map(|index| index.to_le_bytes()));
    }
    bytes
}
