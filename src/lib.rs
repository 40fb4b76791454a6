//! Nephroid: caustics by two-pass photon mapping.

pub mod compare;
pub mod develop;
pub mod film;
pub mod geometry;
pub mod image_io;
pub mod light_path;
pub mod optics;
pub mod pass1_light;
pub mod pass2_eye;
pub mod photon_map;
pub mod plan;
pub mod radius;
pub mod render;
pub mod report;
pub mod sampling;
pub mod scene;
