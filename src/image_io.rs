//! Pictures as linear radiance.

/// Linear radiance per pixel, top row first.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearImage {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Red, green and blue of each pixel.
    pub pixels: Vec<[f32; 3]>,
}
