//! The environment of the scene file: a constant, or a Radiance or OpenEXR picture of all directions.

use super::super::environment_file::{EnvironmentFile, ImageEnvironmentFile};
use super::super::issue::IssueCode;
use super::super::read::quoted;
use super::super::{Environment, EnvironmentImage};
use super::{Compiler, Refusal, vec3};
use crate::image_io::{self, ImageError, LinearImage};
use glam::Vec3;

/// Most pixels of a picture: 8192 × 4096, 384 MiB in memory.
const MAX_PIXELS: u64 = 1 << 25;

/// Largest radiance, as of every amount of light.
const MAX_RADIANCE: f32 = 1e12;

impl Compiler<'_> {
    /// The environment; `None` if it is wrong, which has then been noted.
    pub(super) fn environment(&mut self, file: Option<&EnvironmentFile>) -> Option<Environment> {
        match file {
            None => Some(Environment::Constant(Vec3::ZERO)),
            Some(EnvironmentFile::Constant(file)) => Some(Environment::Constant(vec3(file.radiance))),
            Some(EnvironmentFile::Image(file)) => match self.environment_image(file) {
                Ok(image) => Some(Environment::Image(image)),
                Err((code, why)) => {
                    self.issues.add("/environment/image", code, why);
                    None
                }
            },
        }
    }

    fn environment_image(&self, file: &ImageEnvironmentFile) -> Result<EnvironmentImage, Refusal> {
        let bytes =
            self.assets.read(&file.image).map_err(|e| (IssueCode::AssetUnavailable, e.to_string()))?;
        let name = quoted(&file.image);
        let LinearImage { width, height, mut pixels } =
            image_io::decode_hdr(&bytes, MAX_PIXELS).map_err(|error| {
                let code = match &error {
                    ImageError::Size(_) => IssueCode::TooLarge,
                    ImageError::NotFinite { .. } | ImageError::Malformed { .. } | ImageError::Encode(_) => {
                        IssueCode::AssetInvalid
                    }
                };
                (code, format!("`{name}`: {error}"))
            })?;
        for (index, pixel) in pixels.iter_mut().enumerate() {
            // Filters that made the picture smaller may have left values a little below zero.
            *pixel = pixel.map(|x| (x * file.scale as f32).max(0.0));
            if !pixel.iter().all(|x| *x <= MAX_RADIANCE) {
                let (x, y) = (index % width as usize, index / width as usize);
                let why = format!("`{name}`: the pixel at ({x}, {y}) is above {MAX_RADIANCE:e}");
                return Err((IssueCode::AssetInvalid, why));
            }
        }
        Ok(EnvironmentImage::new([width as usize, height as usize], pixels, file.rotate))
    }
}
