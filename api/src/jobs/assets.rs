//! Files that scenes refer to, uploaded by their SHA-256: kept once, visible only to those who sent them.

use super::files::{hex, remove_file, sync_folder};
use super::service::now_ms;
use super::store::Store;
use super::{Owner, StoreError};
use crate::engine::SceneFiles;
use rusqlite::{Connection, OptionalExtension, params};
use sha2::{Digest, Sha256};
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// The folder of all assets.
#[derive(Clone, Debug)]
pub(super) struct Assets {
    store: Store,
    root: PathBuf,
}

/// Why an upload was not kept.
#[derive(Debug, thiserror::Error)]
pub enum UploadError {
    /// The content is another than its name says.
    #[error("the content's SHA-256 is {0}")]
    Mismatch(String),
    /// The disk does not take it.
    #[error(transparent)]
    Disk(#[from] io::Error),
    /// The database does not take it.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// An asset that is coming in.
#[derive(Debug)]
pub struct Upload {
    assets: Assets,
    owner: Owner,
    file: File,
    path: PathBuf,
    hasher: Sha256,
    bytes: u64,
    kept: bool,
}

impl Assets {
    pub(super) fn new(store: Store, root: PathBuf) -> io::Result<Self> {
        fs::create_dir_all(&root)?;
        let assets = Self { store, root };
        assets.sweep()?;
        Ok(assets)
    }

    pub(super) fn begin_upload(&self, owner: Owner) -> io::Result<Upload> {
        let path = self.root.join(format!("{}.tmp", super::JobId::fresh()));
        let file = File::create(&path)?;
        Ok(Upload { assets: self.clone(), owner, file, path, hasher: Sha256::new(), bytes: 0, kept: false })
    }

    /// The file of an asset and its size, if this owner has it.
    pub(super) fn find(&self, owner: &Owner, sha256: &str) -> Result<Option<(PathBuf, u64)>, StoreError> {
        let bytes = self.store.read_blocking(|db| size_of(db, owner, sha256))?;
        Ok(bytes.map(|bytes| (self.root.join(sha256), bytes)))
    }

    /// What this owner's scenes may refer to.
    pub(super) fn of(&self, owner: Owner) -> OwnAssets {
        OwnAssets { assets: self.clone(), owner }
    }

    /// Removes the files of assets that nobody has any more.
    pub(super) fn remove(&self, sha256: &[String]) {
        sha256.iter().for_each(|name| remove_file(&self.root.join(name)));
    }

    /// Removes what uploads left that never ended.
    fn sweep(&self) -> io::Result<()> {
        for entry in fs::read_dir(&self.root)? {
            let path = entry?.path();
            if path.extension().is_some_and(|extension| extension == "tmp") {
                remove_file(&path);
            }
        }
        Ok(())
    }
}

impl Upload {
    /// Takes the next piece.
    pub(crate) fn write(&mut self, piece: &[u8]) -> io::Result<()> {
        self.hasher.update(piece);
        self.bytes += piece.len() as u64;
        self.file.write_all(piece)
    }

    /// Keeps the asset, if its content is what its name says. True if it is new to its owner.
    pub(crate) fn finish(mut self, sha256: &str) -> Result<bool, UploadError> {
        let actual = hex(&std::mem::take(&mut self.hasher).finalize());
        if actual != sha256 {
            return Err(UploadError::Mismatch(actual));
        }
        self.file.sync_all()?;
        fs::rename(&self.path, self.assets.root.join(sha256))?;
        self.kept = true;
        sync_folder(&self.assets.root)?;
        let (owner, bytes) = (self.owner.clone(), self.bytes);
        Ok(self.assets.store.write_blocking(move |db| {
            let known = size_of(db, &owner, &actual)?.is_some();
            db.execute(
                "INSERT INTO assets (owner, sha256, bytes, used_ms) VALUES (?1, ?2, ?3, ?4)
                 ON CONFLICT DO UPDATE SET used_ms = excluded.used_ms",
                params![owner.as_str(), actual, bytes, now_ms()],
            )?;
            Ok(!known)
        })?)
    }
}

impl Drop for Upload {
    fn drop(&mut self) {
        if !self.kept {
            remove_file(&self.path);
        }
    }
}

/// The assets of one owner, as scenes see them.
#[derive(Debug)]
pub(crate) struct OwnAssets {
    assets: Assets,
    owner: Owner,
}

impl SceneFiles for OwnAssets {
    fn read(&self, name: &str) -> Result<Option<Vec<u8>>, String> {
        if !is_sha256(name) {
            return Ok(None);
        }
        let found = self.assets.find(&self.owner, name).map_err(|error| unreadable(&error))?;
        found.map(|(path, _)| read(&path)).transpose()
    }
}

fn read(path: &Path) -> Result<Vec<u8>, String> {
    fs::read(path).map_err(|error| unreadable(&error))
}

fn unreadable(error: &dyn std::error::Error) -> String {
    tracing::error!(%error, "an asset could not be read");
    "the service could not read it".into()
}

/// True for 64 lower-case hexadecimal digits.
pub(crate) fn is_sha256(name: &str) -> bool {
    name.len() == 64 && name.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
}

fn size_of(db: &Connection, owner: &Owner, sha256: &str) -> Result<Option<u64>, StoreError> {
    let mut find = db.prepare_cached("SELECT bytes FROM assets WHERE owner = ?1 AND sha256 = ?2")?;
    Ok(find.query_row([owner.as_str(), sha256], |row| row.get(0)).optional()?)
}
