//! Writes the pictures of the sample scenes: `cargo run --release --example make_pictures` at the repository's root.
//!
//! A parquet floor and a beach ball as PNG, an evening sky as Radiance. The files are the same bytes on every machine.

use glam::{DVec2, DVec3, dvec2, dvec3};
use image::codecs::{hdr::HdrEncoder, png::PngEncoder};
use image::{ExtendedColorType, ImageEncoder, ImageResult, Rgb};
use nephroid::develop::develop;
use nephroid::image_io::LinearImage;
use nephroid::sampling::hash;
use nephroid::scene::{ImageSettings, Tone};
use std::f64::consts::{PI, TAU};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

fn main() -> ImageResult<()> {
    let folder = Path::new("scenes/pictures");
    std::fs::create_dir_all(folder)?;
    write_png(&folder.join("parquet.png"), 256, 256, parquet)?;
    write_png(&folder.join("beach-ball.png"), 192, 96, beach_ball)?;
    write_sky(&folder.join("evening.hdr"))
}

fn write_png(path: &Path, width: u32, height: u32, color: impl Fn(f64, f64) -> DVec3) -> ImageResult<()> {
    let pixel = |i: u32| color(f64::from(i % width) + 0.5, f64::from(i / width) + 0.5).as_vec3().to_array();
    let image = LinearImage { width, height, pixels: (0..width * height).map(pixel).collect() };
    let settings = ImageSettings { width, height, exposure: 0.0, tone: Tone::Linear };
    let file = BufWriter::new(File::create(path)?);
    PngEncoder::new(file).write_image(&develop(&image, &settings), width, height, ExtendedColorType::Rgb8)
}

/// Smooth noise in 0..1 that repeats every `period` cells.
fn noise(at: DVec2, period: [i64; 2], seed: u64) -> f64 {
    let corner = at.floor();
    let f = at - corner;
    let value = |dx: i64, dy: i64| {
        let x = (corner.x as i64 + dx).rem_euclid(period[0]) as u64;
        let y = (corner.y as i64 + dy).rem_euclid(period[1]) as u64;
        (hash(hash(seed, x), y) >> 40) as f64 / f64::from(1 << 24)
    };
    let s = f * f * (3.0 - 2.0 * f);
    let row = |dy| value(0, dy) * (1.0 - s.x) + value(1, dy) * s.x;
    row(0) * (1.0 - s.y) + row(1) * s.y
}

/// Planks of 128 × 32 pixels, each with its own shade and grain; repeats after 256 pixels.
fn parquet(x: f64, y: f64) -> DVec3 {
    let row = (y / 32.0).floor();
    // Each row is shifted by another part of a plank.
    let along = (x + 128.0 * (row * 0.375).fract()).rem_euclid(256.0);
    let plank = hash((along / 128.0) as u64, row as u64);
    let shade = 0.75 + 0.5 * (plank >> 40) as f64 / f64::from(1 << 24);
    let streaks = noise(dvec2(along / 32.0, y / 2.0), [8, 128], plank);
    let fine = noise(dvec2(along / 8.0, y), [32, 256], plank ^ 1);
    let grain = 0.7 + 0.45 * streaks + 0.2 * (fine - 0.5);
    let gap = along % 128.0 < 1.0 || y % 32.0 < 1.0;
    let color = dvec3(0.42, 0.22, 0.1) * (shade * grain);
    if gap { color * 0.25 } else { color }
}

/// Six coloured segments and white caps.
fn beach_ball(x: f64, y: f64) -> DVec3 {
    const COLORS: [DVec3; 6] = [
        dvec3(0.8, 0.05, 0.04),
        dvec3(0.85, 0.85, 0.8),
        dvec3(0.05, 0.2, 0.7),
        dvec3(0.85, 0.85, 0.8),
        dvec3(0.9, 0.55, 0.03),
        dvec3(0.85, 0.85, 0.8),
    ];
    if !(8.0..88.0).contains(&y) { COLORS[1] } else { COLORS[(x / 32.0) as usize % 6] }
}

/// 256 × 128: a low sun, the glow around it, thin clouds, and dark ground below the horizon.
fn write_sky(path: &Path) -> ImageResult<()> {
    const SIZE: [usize; 2] = [256, 128];
    let pixel = |i: usize| {
        let (x, y) = ((i % SIZE[0]) as f64 + 0.5, (i / SIZE[0]) as f64 + 0.5);
        Rgb(sky(TAU * (x / 256.0 - 0.5), PI * (0.5 - y / 128.0)).as_vec3().to_array())
    };
    let pixels: Vec<Rgb<f32>> = (0..SIZE[0] * SIZE[1]).map(pixel).collect();
    HdrEncoder::new(BufWriter::new(File::create(path)?)).encode(&pixels, SIZE[0], SIZE[1])
}

/// Radiance by azimuth, to the right of the picture's middle, and elevation.
fn sky(azimuth: f64, elevation: f64) -> DVec3 {
    let direction = |azimuth: f64, elevation: f64| {
        let (sin_a, cos_a) = libm::sincos(azimuth);
        let (sin_e, cos_e) = libm::sincos(elevation);
        dvec3(cos_e * sin_a, sin_e, -cos_e * cos_a)
    };
    if elevation < 0.0 {
        // Land as bright as a surface of albedo 0.5 under this sky.
        return dvec3(0.95, 0.76, 0.55);
    }
    let toward = direction(azimuth, elevation);
    let sun = direction(-0.9, 0.55);
    let angle = libm::acos(toward.dot(sun).clamp(-1.0, 1.0));
    let height = libm::sin(elevation);
    let clear = dvec3(1.0, 0.72, 0.5).lerp(dvec3(0.16, 0.3, 0.62), libm::pow(height, 0.45));
    let glow = dvec3(1.4, 0.9, 0.5) * libm::exp(-angle / 0.25);
    // Clouds lie in a plane, so that they crowd toward the horizon.
    let place = dvec2(toward.x, toward.z) / (height + 0.15) * 2.0;
    let cloud =
        (1..=4).map(|o| noise(place * f64::from(1 << o), [1 << 20; 2], o) / f64::from(1 << o)).sum::<f64>();
    let cover = ((cloud - 0.5) * 3.0).clamp(0.0, 0.7);
    let light = clear.lerp(dvec3(1.0, 0.85, 0.75), cover) + glow;
    // A disc of 1.2°, wide for a sun but two pixels across.
    if angle < 0.021 { dvec3(5200.0, 3900.0, 2500.0) } else { light }
}
