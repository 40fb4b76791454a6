//! `nephroid convert`: a model to a scene file with its meshes and pictures beside it.

use super::Failure;
use super::files::{cannot, import, save, say};
use clap::Args;
use std::path::{Path, PathBuf};

#[derive(Args, Debug)]
pub(super) struct ConvertArguments {
    /// The model, a binary glTF file (.glb).
    model: PathBuf,
    /// Where the scene file goes; its meshes and pictures go into a folder of the same name beside it.
    #[arg(short, long, value_name = "JSON", default_value = "scene.json")]
    output: PathBuf,
}

pub(super) fn run(arguments: &ConvertArguments) -> Result<(), Failure> {
    let stem = arguments.output.file_stem().and_then(|stem| stem.to_str());
    let folder = stem.ok_or_else(|| Failure::Usage("the output must have a name".to_owned()))?;
    let imported = import(&arguments.model, folder)?;
    let beside = arguments.output.parent().unwrap_or(Path::new(""));
    for (name, bytes) in &imported.assets.files {
        let path = beside.join(name);
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent).map_err(|e| cannot("make", parent, &e))?;
        }
        save(&path, bytes)?;
    }
    save(&arguments.output, imported.scene.as_bytes())?;
    for warning in &imported.warnings {
        say(format!("warning: {} [{}]", warning.message, warning.code));
    }
    say(format!("{}: written, with {} files", arguments.output.display(), imported.assets.files.len()));
    Ok(())
}
