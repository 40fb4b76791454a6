//! Writes the meshes of the sample scenes: `cargo run --example make_meshes` at the repository's root.
//!
//! Binary PLY with f32 positions and normals, compressed with gzip. The files are the same bytes on
//! every machine.

use flate2::{Compression, write::GzEncoder};
use glam::{DVec2, DVec3, dvec3};
use std::f64::consts::TAU;
use std::io::{self, Write};
use std::path::Path;

/// Amplitude, wave numbers along x and z, and phase of each wave on the pool.
const WAVES: [[f64; 4]; 3] = [[0.03, 3.1, 1.7, 0.0], [0.02, -2.3, 4.3, 1.0], [0.012, 7.9, -2.1, 2.0]];

fn main() -> io::Result<()> {
    let folder = Path::new("scenes/meshes");
    std::fs::create_dir_all(folder)?;
    std::fs::write(folder.join("ring.ply.gz"), ring().compressed()?)?;
    std::fs::write(folder.join("water.ply.gz"), water().compressed()?)?;
    std::fs::write(folder.join("tumbler.ply.gz"), lathe(&TUMBLER).compressed()?)?;
    std::fs::write(folder.join("tea.ply.gz"), lathe(&TEA).compressed()?)
}

/// Outline of a tumbler, radius and height: up the outside, over the rim, down the inside.
const TUMBLER: [[f64; 2]; 10] = [
    [0.0, 0.002],
    [0.33, 0.002],
    [0.36, 0.02],
    [0.43, 0.95],
    [0.424, 0.966],
    [0.406, 0.966],
    [0.4, 0.95],
    [0.335, 0.09],
    [0.31, 0.07],
    [0.0, 0.07],
];

/// Outline of the tea in it. It reaches into the glass by about half the wall, so that there is no gap between them.
const TEA: [[f64; 2]; 4] = [[0.0, 0.05], [0.343, 0.05], [0.392, 0.62], [0.0, 0.62]];

struct Mesh {
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
}

/// An open cylinder of radius 1 from y = 0 to y = 0.4, with the normals of the round surface, outwards.
fn ring() -> Mesh {
    const SEGMENTS: u32 = 256;
    let radial = |i: u32| {
        let angle = TAU * f64::from(i) / f64::from(SEGMENTS);
        dvec3(libm::cos(angle), 0.0, libm::sin(angle))
    };
    let normals: Vec<DVec3> = (0..SEGMENTS).chain(0..SEGMENTS).map(radial).collect();
    let height = |i: usize| if i < SEGMENTS as usize { 0.0 } else { 0.4 };
    let positions = normals.iter().enumerate().map(|(i, n)| *n + DVec3::Y * height(i)).collect();
    let sides = (0..SEGMENTS).flat_map(|i| {
        let j = (i + 1) % SEGMENTS;
        [[i, i + SEGMENTS, j], [j, i + SEGMENTS, j + SEGMENTS]]
    });
    Mesh { positions, normals, triangles: sides.collect() }
}

/// The pool's surface, 200 × 200 squares over x, z in -2..2, with the waves' own normals.
fn water() -> Mesh {
    const SQUARES: u32 = 200;
    let coordinate = |i: u32| 4.0 * f64::from(i) / f64::from(SQUARES) - 2.0;
    let row = SQUARES + 1;
    let grid = || (0..row * row).map(|k| (coordinate(k % row), coordinate(k / row)));
    let squares = (0..SQUARES * SQUARES).flat_map(|k| {
        let a = k / SQUARES * row + k % SQUARES;
        // b is beyond a along x, d along z; both triangles face up.
        let (b, c, d) = (a + 1, a + row + 1, a + row);
        [[a, d, b], [b, d, c]]
    });
    Mesh {
        positions: grid().map(|(x, z)| dvec3(x, wave(x, z).0, z)).collect(),
        normals: grid().map(|(x, z)| wave(x, z).1).collect(),
        triangles: squares.collect(),
    }
}

/// A surface of revolution about y, whose outline runs so that its outside is on the right. Normals are smooth around
/// the axis and creased along the outline.
fn lathe(outline: &[[f64; 2]]) -> Mesh {
    const SEGMENTS: u32 = 256;
    let mut mesh = Mesh { positions: Vec::new(), normals: Vec::new(), triangles: Vec::new() };
    for pair in outline.windows(2) {
        let (low, high) = (DVec2::from(pair[0]), DVec2::from(pair[1]));
        let along = (high - low).normalize();
        let first = mesh.positions.len() as u32;
        for i in 0..SEGMENTS {
            let (sin, cos) = libm::sincos(TAU * f64::from(i) / f64::from(SEGMENTS));
            for point in [low, high] {
                mesh.positions.push(dvec3(point.x * cos, point.y, point.x * sin));
                mesh.normals.push(dvec3(along.y * cos, -along.x, along.y * sin));
            }
            let (a, b) = (first + 2 * i, first + 2 * ((i + 1) % SEGMENTS));
            if low.x > 0.0 {
                mesh.triangles.push([a, a + 1, b]);
            }
            if high.x > 0.0 {
                mesh.triangles.push([a + 1, b + 1, b]);
            }
        }
    }
    mesh
}

/// Height and normal of the water.
fn wave(x: f64, z: f64) -> (f64, DVec3) {
    let mut height = 0.0;
    let mut normal = DVec3::Y;
    for [amplitude, kx, kz, phase] in WAVES {
        let (sin, cos) = libm::sincos(kx * x + kz * z + phase);
        height += amplitude * sin;
        normal -= amplitude * cos * dvec3(kx, 0.0, kz);
    }
    (height, normal.normalize())
}

impl Mesh {
    fn compressed(&self) -> io::Result<Vec<u8>> {
        let mut out = GzEncoder::new(Vec::new(), Compression::best());
        write!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}\n", self.positions.len())?;
        for property in ["x", "y", "z", "nx", "ny", "nz"] {
            writeln!(out, "property float {property}")?;
        }
        writeln!(out, "element face {}", self.triangles.len())?;
        write!(out, "property list uchar uint vertex_indices\nend_header\n")?;
        for (position, normal) in self.positions.iter().zip(&self.normals) {
            for x in position.to_array().into_iter().chain(normal.to_array()) {
                out.write_all(&(x as f32).to_le_bytes())?;
            }
        }
        for triangle in &self.triangles {
            out.write_all(&[3])?;
            for index in triangle {
                out.write_all(&index.to_le_bytes())?;
            }
        }
        out.finish()
    }
}
