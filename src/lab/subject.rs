//! A scene that is rendered in many ways.

use super::LabError;
use crate::scene::{AssetError, AssetSource, Scene};
use serde_json::{Value, json};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::{Mutex, PoisonError};

/// A scene, and how it is changed from method to method.
pub struct Subject<'a> {
    /// The scene's name, good for file names.
    pub name: String,
    file: Value,
    assets: &'a dyn AssetSource,
    size: Option<(u32, u32)>,
    /// What the scene's files hold, by name.
    read: BTreeMap<String, u64>,
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
        let recorder = Recorder { assets, read: Mutex::default() };
        let scene = Scene::from_json(text, &recorder)?;
        let file: Value = serde_json::from_str(text).map_err(|_| LabError::NotAnObject)?;
        let (width, height) = (scene.image.width, scene.image.height);
        let size = most_width
            .filter(|most| *most < width)
            .map(|most| (most, (u64::from(height) * u64::from(most) / u64::from(width)).max(1) as u32));
        let read = recorder.read.into_inner().unwrap_or_else(PoisonError::into_inner);
        Ok(Self { name: name.to_owned(), file, assets, size, read })
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

    /// A number that changes with the scene's text, its files and its size, to recognise what was made for it.
    #[must_use]
    pub fn hash(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        (self.file.to_string(), self.size, &self.read).hash(&mut hasher);
        hasher.finish()
    }
}

/// Notes what is read.
struct Recorder<'a> {
    assets: &'a dyn AssetSource,
    read: Mutex<BTreeMap<String, u64>>,
}

impl AssetSource for Recorder<'_> {
    fn read(&self, name: &str) -> Result<Cow<'_, [u8]>, AssetError> {
        let bytes = self.assets.read(name)?;
        let mut hasher = DefaultHasher::new();
        bytes.hash(&mut hasher);
        self.read.lock().unwrap_or_else(PoisonError::into_inner).insert(name.to_owned(), hasher.finish());
        Ok(bytes)
    }
}
