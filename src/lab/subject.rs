//! A scene that is rendered in many ways.

use super::LabError;
use crate::scene::{AssetSource, Scene};
use serde_json::{Value, json};
use std::hash::{DefaultHasher, Hash, Hasher};

/// A scene, and how it is changed from method to method.
pub struct Subject<'a> {
    /// The scene's name, good for file names.
    pub name: String,
    file: Value,
    assets: &'a dyn AssetSource,
    size: Option<(u32, u32)>,
}

impl<'a> Subject<'a> {
    /// A scene file's text, rendered at its own size or at most so wide.
    ///
    /// # Errors
    /// If the scene is wrong.
    pub fn new(
        name: &str,
        text: &str,
        assets: &'a dyn AssetSource,
        most_width: Option<u32>,
    ) -> Result<Self, LabError> {
        let scene = Scene::from_json(text, assets)?;
        let file: Value = serde_json::from_str(text).map_err(|_| LabError::NotAnObject)?;
        let (width, height) = (scene.image.width, scene.image.height);
        let size = most_width
            .filter(|most| *most < width)
            .map(|most| (most, (u64::from(height) * u64::from(most) / u64::from(width)).max(1) as u32));
        Ok(Self { name: name.to_owned(), file, assets, size })
    }

    /// The scene with some of its `render` settings replaced. Its own limits are left out: who renders it decides when
    /// to stop.
    ///
    /// # Errors
    /// If the settings do not fit the scene.
    pub fn scene(&self, settings: &Value, seed: u64) -> Result<Scene, LabError> {
        let mut file = self.file.clone();
        let root = file.as_object_mut().ok_or(LabError::NotAnObject)?;
        let render = root.entry("render").or_insert_with(|| json!({}));
        let render = render.as_object_mut().ok_or(LabError::NotAnObject)?;
        render.remove("stop");
        render.insert("seed".to_owned(), json!(seed));
        for (key, value) in settings.as_object().into_iter().flatten() {
            render.insert(key.clone(), value.clone());
        }
        let mut scene = Scene::from_json(&file.to_string(), self.assets)?;
        if let Some((width, height)) = self.size {
            scene.set_size(width, height);
        }
        Ok(scene)
    }

    /// A number that changes with the scene's text and size, to recognise what was made for it.
    #[must_use]
    pub fn hash(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        (self.file.to_string(), self.size).hash(&mut hasher);
        hasher.finish()
    }
}
