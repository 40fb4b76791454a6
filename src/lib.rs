//! Nephroid: caustics by two-pass photon mapping.

pub mod develop;
pub mod geometry;
pub mod image_io;
pub mod light_path;
pub mod scene;
