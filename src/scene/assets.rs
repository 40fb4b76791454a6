//! Where the files come from that a scene names.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

/// Largest asset, in bytes.
const MAX_ASSET_BYTES: u64 = 1 << 30;

/// Gives the bytes of an asset by its name.
pub trait AssetSource: Send + Sync {
    /// Reads an asset.
    ///
    /// # Errors
    /// If there is none of that name, or it may not or cannot be read.
    fn read(&self, name: &str) -> Result<Cow<'_, [u8]>, AssetError>;
}

/// Why an asset cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum AssetError {
    /// There is no asset of that name.
    #[error("there is no asset `{0}`")]
    NotFound(String),
    /// The name leads out of the place where assets are.
    #[error("`{0}` is not a path below the scene's folder: no `..`, no leading `/`")]
    Forbidden(String),
    /// The asset is too large.
    #[error("`{0}` is larger than 1 GiB")]
    TooLarge(String),
    /// The source has no assets at all.
    #[error("no files can be used here")]
    NoAssets,
    /// The asset is there and cannot be read.
    #[error("`{name}` cannot be read: {reason}")]
    Unreadable {
        /// The asset's name.
        name: String,
        /// What went wrong, for the user.
        reason: String,
    },
}

/// Refuses every asset.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoAssets;

impl AssetSource for NoAssets {
    fn read(&self, _name: &str) -> Result<Cow<'_, [u8]>, AssetError> {
        Err(AssetError::NoAssets)
    }
}

/// Files that are held in memory, by name.
#[derive(Clone, Debug, Default)]
pub struct MemoryAssets {
    /// The bytes of each.
    pub files: BTreeMap<String, Vec<u8>>,
}

impl AssetSource for MemoryAssets {
    fn read(&self, name: &str) -> Result<Cow<'_, [u8]>, AssetError> {
        let file = self.files.get(name).ok_or_else(|| AssetError::NotFound(name.to_owned()))?;
        Ok(Cow::Borrowed(file))
    }
}

/// The files below a folder; a name is a relative path.
#[derive(Clone, Debug)]
pub struct DirectoryAssets {
    root: PathBuf,
}

impl DirectoryAssets {
    /// The files below `root`.
    pub fn new(root: impl Into<PathBuf>) -> Self {
        let root = root.into();
        // The folder of the bare file name `scene.json` is the current one.
        let root = if root.as_os_str().is_empty() { PathBuf::from(".") } else { root };
        Self { root }
    }
}

impl AssetSource for DirectoryAssets {
    fn read(&self, name: &str) -> Result<Cow<'_, [u8]>, AssetError> {
        let inside =
            |path: &Path| path.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
        if name.is_empty() || name.contains(['\\', '\0']) || !inside(Path::new(name)) {
            return Err(AssetError::Forbidden(name.to_owned()));
        }
        let unreadable = |error: std::io::Error| match error.kind() {
            std::io::ErrorKind::NotFound => AssetError::NotFound(name.to_owned()),
            _ => AssetError::Unreadable { name: name.to_owned(), reason: error.to_string() },
        };
        // A symbolic link may lead out, too.
        let root = self.root.canonicalize().map_err(unreadable)?;
        let path = root.join(name).canonicalize().map_err(unreadable)?;
        if !path.starts_with(&root) {
            return Err(AssetError::Forbidden(name.to_owned()));
        }
        let metadata = path.metadata().map_err(unreadable)?;
        if !metadata.is_file() {
            // Opening a pipe would wait for its writer.
            return Err(AssetError::Unreadable {
                name: name.to_owned(),
                reason: "not a regular file".to_owned(),
            });
        }
        let mut bytes = Vec::new();
        let file = File::open(&path).map_err(unreadable)?;
        file.take(MAX_ASSET_BYTES + 1).read_to_end(&mut bytes).map_err(unreadable)?;
        if bytes.len() as u64 > MAX_ASSET_BYTES {
            return Err(AssetError::TooLarge(name.to_owned()));
        }
        Ok(Cow::Owned(bytes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_cannot_lead_out_of_the_folder() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().join("scene");
        std::fs::create_dir_all(root.join("meshes")).unwrap();
        std::fs::write(folder.path().join("secret"), "secret").unwrap();
        std::fs::write(root.join("meshes/a.ply"), "ply").unwrap();
        let assets = DirectoryAssets::new(&root);
        assert_eq!(assets.read("meshes/a.ply").unwrap().as_ref(), b"ply");
        assert_eq!(assets.read("./meshes/a.ply").unwrap().as_ref(), b"ply");
        for name in ["../secret", "meshes/../../secret", "/etc/hostname", "..", "", "meshes/..\\secret"] {
            assert!(matches!(assets.read(name), Err(AssetError::Forbidden(_))), "{name}");
        }
        assert!(matches!(assets.read("meshes/b.ply"), Err(AssetError::NotFound(_))));
        assert!(matches!(assets.read("meshes"), Err(AssetError::Unreadable { .. })));
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(folder.path().join("secret"), root.join("link")).unwrap();
            assert!(matches!(assets.read("link"), Err(AssetError::Forbidden(_))));
        }
    }
}
