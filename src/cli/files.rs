//! Scenes and pictures on disk.

use super::Failure;
use nephroid::image_io::{self, ImageFormat, LinearImage};
use nephroid::import::{Imported, import_glb};
use nephroid::scene::{DirectoryAssets, ImageSettings, Scene, Warning};
use std::io::Write;
use std::path::Path;

/// A scene, and what the user should know of how it was read.
pub(super) struct Loaded {
    pub(super) scene: Scene,
    pub(super) warnings: Vec<Warning>,
}

/// Reads and compiles a scene, or a model in binary glTF; assets are found relative to it.
pub(super) fn load_scene(path: &Path) -> Result<Loaded, Failure> {
    let wrong = |errors| Failure::Scene { path: path.to_owned(), errors };
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("glb")) {
        let Imported { scene, assets, warnings } = import(path, "model")?;
        return Ok(Loaded { scene: Scene::from_json(&scene, &assets).map_err(wrong)?, warnings });
    }
    let bytes = std::fs::read(path).map_err(|e| cannot("read", path, &e))?;
    let text = String::from_utf8(bytes)
        .map_err(|e| Failure::Usage(format!("{}: not UTF-8 text: {e}", path.display())))?;
    let assets = DirectoryAssets::new(path.parent().unwrap_or(Path::new("")));
    Ok(Loaded { scene: Scene::from_json(&text, &assets).map_err(wrong)?, warnings: Vec::new() })
}

/// Reads a model; its files are named as in `folder`.
pub(super) fn import(path: &Path, folder: &str) -> Result<Imported, Failure> {
    let bytes = std::fs::read(path).map_err(|e| cannot("read", path, &e))?;
    import_glb(&bytes, folder).map_err(|error| Failure::Model { path: path.to_owned(), error })
}

/// The picture format that a file name asks for.
pub(super) fn format_of(path: &Path) -> Result<ImageFormat, Failure> {
    let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    match extension.as_deref() {
        Some("png") => Ok(ImageFormat::Png),
        Some("exr") => Ok(ImageFormat::Exr),
        Some("npy") => Ok(ImageFormat::Npy),
        _ => Err(Failure::Usage(format!("{}: the name must end in .png, .exr or .npy", path.display()))),
    }
}

/// Writes a picture in the format its name asks for.
pub(super) fn save_image(path: &Path, image: &LinearImage, settings: &ImageSettings) -> Result<(), Failure> {
    let encoded = match format_of(path)? {
        ImageFormat::Png => image_io::encode_png(image, settings),
        ImageFormat::Exr => image_io::encode_exr(image),
        ImageFormat::Npy => Ok(image_io::encode_npy(image)),
    };
    let bytes = encoded.map_err(|e| Failure::Usage(format!("{}: {e}", path.display())))?;
    save(path, &bytes)
}

/// Reads a picture.
pub(super) fn load_image(path: &Path) -> Result<LinearImage, Failure> {
    let bytes = std::fs::read(path).map_err(|e| cannot("read", path, &e))?;
    image_io::decode(&bytes, format_of(path)?).map_err(|e| Failure::Usage(format!("{}: {e}", path.display())))
}

/// Writes a file.
pub(super) fn save(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    std::fs::write(path, bytes).map_err(|e| cannot("write", path, &e))
}

/// An I/O failure in words.
pub(super) fn cannot(what: &str, path: &Path, error: &std::io::Error) -> Failure {
    Failure::Usage(format!("cannot {what} {}: {error}", path.display()))
}

/// One line of output. Whoever reads it may have seen enough: a closed pipe is no failure.
pub(super) fn say(line: impl std::fmt::Display) {
    let _ = writeln!(std::io::stdout(), "{line}");
}
