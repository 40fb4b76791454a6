//! Writes a large mesh and a scene with it, to see how loading, building and rendering fare:
//! `cargo run --release --example big_mesh -- 1000000 /tmp/big`, then
//! `nephroid render /tmp/big/big.json -o /tmp/big/big.png`.
//!
//! A ball with bumps on its bumps: triangles of like size that face all ways.

use glam::{DVec3, dvec3};
use std::f64::consts::{PI, TAU};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Amplitude and frequency of each layer of bumps.
const BUMPS: [[f64; 2]; 3] = [[0.05, 9.0], [0.012, 37.0], [0.004, 113.0]];

fn main() -> io::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let triangles: u32 = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(1_000_000);
    let folder = arguments.next().map_or_else(|| PathBuf::from("."), PathBuf::from);
    let material = arguments.next().unwrap_or_else(|| "stone".to_owned());
    std::fs::create_dir_all(&folder)?;
    write_mesh(&folder.join("big.ply"), triangles)?;
    std::fs::write(folder.join("big.json"), scene(&material))
}

/// The material is `stone` or `glass`.
fn scene(material: &str) -> String {
    format!(
        r#"{{ "nephroid": 1, "name": "a large mesh", "image": {{ "width": 640, "height": 480 }},
  "camera": {{ "type": "perspective", "eye": [0, 2.2, 4.4], "target": [0, 0.8, 0], "fov": 36 }},
  "materials": {{ "floor": {{ "type": "diffuse", "albedo": [0.6, 0.6, 0.6] }},
                 "stone": {{ "type": "diffuse", "albedo": [0.7, 0.6, 0.5] }},
                 "glass": {{ "type": "glass", "ior": 1.5 }} }},
  "objects": [
    {{ "type": "polygon", "vertices": [[-5,0,5], [5,0,5], [5,0,-5], [-5,0,-5]], "material": "floor" }},
    {{ "type": "mesh", "asset": "big.ply", "material": "{material}" }} ],
  "lights": [ {{ "type": "quad", "center": [2, 4, 2], "size": [1, 1], "towards": [0, 1, 0], "radiance": [20, 20, 20] }} ],
  "render": {{ "stop": {{ "rounds": 16 }} }} }}
"#
    )
}

/// Rings of latitude around the poles; about twice as many squares along a ring as there are rings.
fn write_mesh(path: &Path, triangles: u32) -> io::Result<()> {
    let rings = (f64::from(triangles) / 4.0).sqrt().round().max(3.0) as u32;
    let along = 2 * rings;
    let vertices = (rings - 1) * along + 2;
    let faces = 2 * along * (rings - 1);
    let mut out = BufWriter::new(std::fs::File::create(path)?);
    write!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\n")?;
    write!(out, "property float x\nproperty float y\nproperty float z\n")?;
    write!(out, "element face {faces}\nproperty list uchar uint vertex_indices\nend_header\n")?;
    let mut point = |direction: DVec3| {
        let p = dvec3(0.0, 1.05, 0.0) + direction * radius(direction);
        p.to_array().iter().try_for_each(|x| out.write_all(&(*x as f32).to_le_bytes()))
    };
    for ring in 1..rings {
        let (sin, cos) = libm::sincos(PI * f64::from(ring) / f64::from(rings));
        for k in 0..along {
            let (z, x) = libm::sincos(TAU * f64::from(k) / f64::from(along));
            point(dvec3(sin * x, cos, sin * z))?;
        }
    }
    point(DVec3::Y)?;
    point(DVec3::NEG_Y)?;
    let mut face = |corners: [u32; 3]| {
        out.write_all(&[3])?;
        corners.iter().try_for_each(|v| out.write_all(&v.to_le_bytes()))
    };
    let (north, south) = (vertices - 2, vertices - 1);
    for k in 0..along {
        let next = (k + 1) % along;
        face([north, next, k])?;
        for ring in 0..rings - 2 {
            let (a, b) = (ring * along + k, ring * along + next);
            face([a, b, a + along])?;
            face([b, b + along, a + along])?;
        }
        let last = (rings - 2) * along;
        face([last + k, last + next, south])?;
    }
    out.flush()
}

fn radius(d: DVec3) -> f64 {
    let bump = |[height, frequency]: [f64; 2]| {
        let wave = |x: f64| libm::sin(frequency * x);
        height * wave(d.x + 0.3 * d.y) * wave(d.y + 0.2 * d.z) * wave(d.z - 0.4 * d.x)
    };
    1.0 + BUMPS.into_iter().map(bump).sum::<f64>()
}
