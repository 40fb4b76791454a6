//! Meshes of any size.

use glam::Vec3;
use nephroid::geometry::MeshData;

/// A square of hills, and a dented ball, each with `2 * cells²` triangles.
pub(crate) fn both(cells: u16) -> [(&'static str, MeshData); 2] {
    [("terrain", terrain(cells)), ("ball", ball(cells))]
}

fn terrain(cells: u16) -> MeshData {
    grid(cells, cells, |u, v| {
        let (x, z) = (4.0 * u - 2.0, 4.0 * v - 2.0);
        let wave = |k: f32, a: f32| a * (k * x + 0.7 * k * z).sin() * (0.9 * k * z - 0.3 * k * x).cos();
        Vec3::new(x, wave(2.1, 0.3) + wave(7.3, 0.08) + wave(31.0, 0.02) + wave(113.0, 0.006), z)
    })
}

fn ball(cells: u16) -> MeshData {
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
