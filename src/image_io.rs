//! Pictures in memory and in files.

/// A picture of linear radiance.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearImage {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Radiance per channel, top row first.
    pub pixels: Vec<[f32; 3]>,
}
