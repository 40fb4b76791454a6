//! Nephroid: caustics by two-pass photon mapping.

pub mod geometry;
pub mod light_path;
pub mod scene;
