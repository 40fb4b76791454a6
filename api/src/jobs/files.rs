//! Files of jobs: the scene, the checkpoint, the pictures. Each appears whole or not at all.

use super::{Artifact, JobId};
use sha2::{Digest, Sha256};
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

    pub(super) fn scene(&self, id: JobId) -> io::Result<String> {
        fs::read_to_string(self.folder(id).join("scene.json"))
    }

    pub(super) fn save_checkpoint(&self, id: JobId, checkpoint: &[u8]) -> io::Result<()> {
        write_whole(&self.folder(id).join("checkpoint"), checkpoint)
    }

    pub(super) fn checkpoint(&self, id: JobId) -> io::Result<Option<Vec<u8>>> {
        match fs::read(self.folder(id).join("checkpoint")) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            read => read.map(Some),
        }
    }

    /// Removes what only an unfinished job needs.
    pub(super) fn discard_checkpoint(&self, id: JobId) {
        ignore_missing(fs::remove_file(self.folder(id).join("checkpoint")));
    }

    /// Each attempt writes into its own folder, so that one out of date cannot touch a newer one's files.
    pub(super) fn save_artifact(
        &self,
        (id, attempt): (JobId, u32),
        name: &str,
        bytes: &[u8],
    ) -> io::Result<Artifact> {
        let artifact = Artifact { name: name.into(), attempt, sha256: hex(&Sha256::digest(bytes)) };
        let path = self.artifact_path(id, &artifact);
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        write_whole(&path, bytes)?;
        Ok(artifact)
    }

    pub(super) fn artifact_path(&self, id: JobId, artifact: &Artifact) -> PathBuf {
        self.folder(id).join(format!("attempt-{}", artifact.attempt)).join(&artifact.name)
    }

    pub(super) fn remove(&self, id: JobId) {
        ignore_missing(fs::remove_dir_all(self.folder(id)));
    }

    /// Removes folders without a job: of submissions that were never acknowledged.
    pub(super) fn sweep(&self, known: &[String]) -> io::Result<()> {
        for entry in fs::read_dir(&self.root)? {
            let entry = entry?;
            if !entry.file_name().to_str().is_some_and(|name| known.iter().any(|id| id == name)) {
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

fn sync_folder(folder: &Path) -> io::Result<()> {
    File::open(folder)?.sync_all()
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
        files.sweep(&[kept.to_string()]).unwrap();
        assert_eq!(files.scene(kept).unwrap(), "{}");
        assert!(files.scene(lost).is_err());
    }
}
