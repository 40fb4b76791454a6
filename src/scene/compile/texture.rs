//! Textures of the scene file; pictures are loaded once, however many materials use them.

use super::super::Texture;
use super::super::assets::AssetSource;
use super::super::issue::IssueCode;
use super::super::material_file::AlbedoFile;
use super::super::read::quoted;
use super::super::texture::{TextureError, TextureImage};
use super::{Compiler, Refusal, vec3};
use glam::DVec2;
use std::collections::HashMap;
use std::sync::Arc;

/// Most pixels of all pictures together: 192 MiB in memory.
const MAX_PIXELS: u64 = 1 << 26;

/// Loads pictures.
pub(super) struct TextureLoader<'a> {
    assets: &'a dyn AssetSource,
    loaded: HashMap<String, Result<Arc<TextureImage>, Refusal>>,
    pixels_left: u64,
}

impl<'a> TextureLoader<'a> {
    pub(super) fn new(assets: &'a dyn AssetSource) -> Self {
        Self { assets, loaded: HashMap::new(), pixels_left: MAX_PIXELS }
    }

    fn load(&mut self, name: &str) -> Result<Arc<TextureImage>, Refusal> {
        if let Some(known) = self.loaded.get(name) {
            return known.clone();
        }
        let image = self.read(name).map(Arc::new);
        if let Ok(image) = &image {
            self.pixels_left -= image.pixels();
        }
        self.loaded.insert(name.to_owned(), image.clone());
        image
    }

    fn read(&self, name: &str) -> Result<TextureImage, Refusal> {
        let bytes = self.assets.read(name).map_err(|e| (IssueCode::AssetUnavailable, e.to_string()))?;
        TextureImage::decode(&bytes, self.pixels_left).map_err(|error| {
            let code = match &error {
                TextureError::TooLarge { .. } => IssueCode::TooLarge,
                TextureError::UnknownFormat | TextureError::Damaged(_) => IssueCode::AssetInvalid,
            };
            (code, format!("`{}`: {error}", quoted(name)))
        })
    }

    /// Bytes that all pictures take in memory.
    pub(super) fn memory_bytes(&self) -> u64 {
        self.loaded.values().flatten().map(|image| image.memory_bytes()).sum()
    }
}

impl Compiler<'_> {
    /// The texture at a place of the scene file; `None` if it is wrong, which has then been noted.
    pub(super) fn texture(&mut self, file: &AlbedoFile, pointer: &str) -> Option<Texture> {
        Some(match file {
            AlbedoFile::Color(color) => Texture::Constant(vec3(*color)),
            AlbedoFile::Checker(checker) => {
                Texture::Checker { colors: checker.colors.map(vec3), size: checker.size as f32 }
            }
            AlbedoFile::Image(file) => match self.textures.load(&file.image) {
                Ok(image) => Texture::Image { image, scale: DVec2::from(file.scale).as_vec2() },
                Err((code, why)) => {
                    self.issues.add(format!("{pointer}/image"), code, why);
                    return None;
                }
            },
        })
    }
}
