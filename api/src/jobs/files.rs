//! Files of jobs: the scene, the checkpoint, the pictures. Each appears whole or not at all.

use super::{Artifact, JobId, Milestone};
use sha2::{Digest, Sha256};
use std::collections::HashSet;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// The folder of all jobs, one folder each.
#[derive(Clone, Debug)]
pub(super) struct Files {
    root: PathBuf,
}

impl Files {
    pub(super) fn new(root: PathBuf) -> io::Result<Self> {
        fs::create_dir_all(&root)?;
        Ok(Self { root })
    }

    pub(super) fn save_scene(&self, id: JobId, scene: &str) -> io::Result<()> {
        let folder = self.folder(id);
        fs::create_dir_all(&folder)?;
        sync_folder(&self.root)?;
        write_whole(&folder.join("scene.json"), scene.as_bytes())
    }

    /// Bytes that are free on the disk of the jobs; `None` where that cannot be told.
    pub(super) fn free_bytes(&self) -> Option<u64> {
        let disk = rustix::fs::statvfs(&self.root).ok()?;
        Some(disk.f_bavail.saturating_mul(disk.f_frsize))
    }

    pub(super) fn scene(&self, id: JobId) -> io::Result<String> {
        fs::read_to_string(self.folder(id).join("scene.json"))
    }

    /// Keeps a render with its history, in one file, so that they always fit.
    pub(super) fn save_checkpoint(&self, id: JobId, history: &[Milestone], render: &[u8]) -> io::Result<()> {
        fs::create_dir_all(self.folder(id))?;
        let mut content = serde_json::to_vec(history)?;
        content.push(b'\n');
        content.extend_from_slice(render);
        write_whole(&self.folder(id).join("checkpoint"), &content)
    }

    pub(super) fn checkpoint(&self, id: JobId) -> io::Result<Option<(Vec<Milestone>, Vec<u8>)>> {
        let content = match fs::read(self.folder(id).join("checkpoint")) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            read => read?,
        };
        let head = content.iter().position(|&byte| byte == b'\n').unwrap_or(0);
        match serde_json::from_slice(&content[..head]) {
            Ok(history) => Ok(Some((history, content[head + 1..].to_vec()))),
            // Of an older service: the render alone.
            Err(_) => Ok(Some((Vec::new(), content))),
        }
    }

    /// Removes what only an unfinished job needs.
    pub(super) fn discard_checkpoint(&self, id: JobId) {
        remove_file(&self.folder(id).join("checkpoint"));
    }

    /// Each attempt writes into its own folder, so that one out of date cannot touch a newer one's files.
    pub(super) fn save_artifact(&self, id: JobId, artifact: &Artifact, bytes: &[u8]) -> io::Result<()> {
        let path = self.artifact_path(id, artifact);
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        write_whole(&path, bytes)
    }

    pub(super) fn artifact_path(&self, id: JobId, artifact: &Artifact) -> PathBuf {
        self.folder(id).join(format!("attempt-{}", artifact.attempt)).join(&artifact.name)
    }

    pub(super) fn remove(&self, id: JobId) {
        ignore_missing(fs::remove_dir_all(self.folder(id)));
    }

    /// Removes folders without a job: of submissions that were never acknowledged.
    pub(super) fn sweep(&self, known: &HashSet<String>) -> io::Result<()> {
        for entry in fs::read_dir(&self.root)? {
            let entry = entry?;
            if !entry.file_name().to_str().is_some_and(|name| known.contains(name)) {
                ignore_missing(fs::remove_dir_all(entry.path()));
            }
        }
        Ok(())
    }

    fn folder(&self, id: JobId) -> PathBuf {
        self.root.join(id.to_string())
    }
}

/// Lower-case hexadecimal.
pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Writes under another name, waits for the disk, then renames.
fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let unfinished = path.with_added_extension("tmp");
    let mut file = File::create(&unfinished)?;
    file.write_all(bytes)?;
    file.sync_all()?;
    fs::rename(&unfinished, path)?;
    path.parent().map_or(Ok(()), sync_folder)
}

pub(super) fn sync_folder(folder: &Path) -> io::Result<()> {
    File::open(folder)?.sync_all()
}

/// Removes a file, if it is there.
pub(super) fn remove_file(path: &Path) {
    ignore_missing(fs::remove_file(path));
}

/// What a picture is called and known by.
pub(super) fn artifact_of(name: &str, attempt: u32, bytes: &[u8]) -> Artifact {
    Artifact { name: name.into(), attempt, sha256: hex(&Sha256::digest(bytes)) }
}

fn ignore_missing(outcome: io::Result<()>) {
    if let Err(error) = outcome
        && error.kind() != io::ErrorKind::NotFound
    {
        tracing::warn!(%error, "a file that is no longer needed could not be removed");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_as_a_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("checkpoint");
        write_whole(&path, b"the longer first").unwrap();
        write_whole(&path, b"second").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"second");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn sweeping_keeps_the_folders_of_known_jobs() {
        let folder = tempfile::tempdir().unwrap();
        let files = Files::new(folder.path().join("jobs")).unwrap();
        let (kept, lost) = (JobId::fresh(), JobId::fresh());
        files.save_scene(kept, "{}").unwrap();
        files.save_scene(lost, "{}").unwrap();
        files.sweep(&HashSet::from([kept.to_string()])).unwrap();
        assert_eq!(files.scene(kept).unwrap(), "{}");
        assert!(files.scene(lost).is_err());
    }
}
