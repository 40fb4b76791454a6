//! One binary for all tests of the renderer.

#![expect(clippy::unwrap_used, reason = "a failed helper fails its test")]

mod bad_assets;
mod camera;
mod casters;
mod caustics;
mod checks;
mod degenerate;
mod determinism;
mod direct_light;
mod dispersion;
mod environment;
mod geometry;
mod geometry_shapes;
mod geometry_structures;
mod glb;
mod import;
mod indirect;
mod invariance;
mod lab;
mod large_lamps;
mod light_images;
mod light_sampling;
mod lights;
mod many_lights;
mod materials;
mod motion;
mod moving_lamps;
mod optics;
mod paths;
mod photon_map;
mod picture;
mod pixelwise;
mod plan;
mod reach;
mod rivals;
mod sample_scenes;
mod scales;
mod scattering;
mod scene_file;
mod schema;
mod shadows_and_mirrors;
mod stability;
mod support;
mod textures;
