//! The sample scenes, embedded in the binary, and the meshes and images they refer to.

use include_dir::{Dir, include_dir};

static SCENES: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/../scenes");
/// What the scenes look like, for the web page: the pictures of the gallery, made by `make gallery`.
static PICTURES: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/../docs/gallery");

/// A sample scene.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Its name in addresses.
    pub name: &'static str,
    /// Its JSON.
    pub text: &'static str,
}

impl Sample {
    /// What the scene calls itself.
    #[must_use]
    pub fn title(&self) -> String {
        let scene: Option<serde_json::Value> = serde_json::from_str(self.text).ok();
        let title = scene.as_ref().and_then(|scene| scene["name"].as_str());
        title.unwrap_or(self.name).to_owned()
    }

    /// What it looks like, as PNG, if a picture of it was embedded.
    #[must_use]
    pub fn picture(&self) -> Option<&'static [u8]> {
        PICTURES.get_file(format!("{}.png", self.name)).map(include_dir::File::contents)
    }
}

/// All sample scenes, by name.
pub fn all() -> impl Iterator<Item = Sample> {
    SCENES.files().filter_map(|file| {
        let name = file.path().to_str()?.strip_suffix(".json")?;
        Some(Sample { name, text: file.contents_utf8()? })
    })
}

/// The sample of this name.
#[must_use]
pub fn find(name: &str) -> Option<Sample> {
    all().find(|sample| sample.name == name)
}

/// A file that scenes may refer to over HTTP: one that comes with the samples, nothing of the disk.
#[must_use]
pub fn asset(name: &str) -> Option<&'static [u8]> {
    let file = SCENES.get_file(name).filter(|_| !name.ends_with(".json"));
    file.map(include_dir::File::contents)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::{LoadedScene, SampleFiles};

    #[test]
    fn every_sample_can_be_rendered_and_has_a_picture() {
        assert!(find("glass-ball").is_some());
        for sample in all() {
            let read = LoadedScene::read(sample.text, &SampleFiles, 60.0);
            assert!(read.is_ok(), "{}: {:?}", sample.name, read.err());
            assert!(sample.picture().is_some(), "{} has no picture in docs/gallery", sample.name);
        }
    }

    #[test]
    fn files_of_the_disk_are_no_assets() {
        for name in ["/etc/passwd", "../Cargo.toml", "glass-ball.json", ""] {
            assert!(asset(name).is_none(), "{name}");
        }
    }
}
