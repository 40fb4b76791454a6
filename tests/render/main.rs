//! One binary for all tests of the renderer.

#![expect(clippy::unwrap_used, reason = "a failed helper fails its test")]

mod bad_assets;
mod camera;
mod caustics;
mod determinism;
mod direct_light;
mod environment;
mod geometry;
mod geometry_shapes;
mod geometry_structures;
mod glb;
mod import;
mod light_sampling;
mod lights;
mod materials;
mod optics;
mod photon_map;
mod picture;
mod plan;
mod scene_file;
mod schema;
mod support;
mod textures;
