//! One binary for all tests of the renderer.

mod scene_file;
