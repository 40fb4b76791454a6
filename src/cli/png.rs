//! Charts as PNG beside SVG.

use super::Failure;
use super::files::{save, say};
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree};
use std::path::Path;
use std::sync::LazyLock;

/// Pixels of the picture per unit of the drawing.
const SCALE: f32 = 2.0;

/// Sans-serif fonts that systems have, the preferred first.
const FONTS: [&str; 5] = ["DejaVu Sans", "Liberation Sans", "Noto Sans", "Arial", "Helvetica"];

/// The system's fonts; `None` if there is none, so that a picture would have no words.
static OPTIONS: LazyLock<Option<Options<'static>>> = LazyLock::new(|| {
    let mut options = Options::default();
    let fonts = options.fontdb_mut();
    fonts.load_system_fonts();
    let families: Vec<String> =
        fonts.faces().flat_map(|face| face.families.iter().map(|family| family.0.clone())).collect();
    let preferred = FONTS.iter().find(|name| families.iter().any(|family| family == *name));
    let family = preferred.map(|name| (*name).to_owned()).or_else(|| families.first().cloned())?;
    fonts.set_sans_serif_family(family);
    Some(options)
});

/// Writes a drawing as NAME.svg and, if the system has fonts, NAME.png.
pub(super) fn save_drawing(folder: &Path, name: &str, drawing: &str) -> Result<(), Failure> {
    save(&folder.join(format!("{name}.svg")), drawing.as_bytes())?;
    let Some(options) = &*OPTIONS else {
        say(format!("{name}.png is left out: this system has no fonts"));
        return Ok(());
    };
    let wrong = |reason: String| Failure::Usage(format!("{name}.png: {reason}"));
    let tree = Tree::from_str(drawing, options).map_err(|e| wrong(e.to_string()))?;
    let size = tree.size().to_int_size().scale_by(SCALE).ok_or_else(|| wrong("too large".to_owned()))?;
    let mut pixels = Pixmap::new(size.width(), size.height()).ok_or_else(|| wrong("too large".to_owned()))?;
    resvg::render(&tree, Transform::from_scale(SCALE, SCALE), &mut pixels.as_mut());
    save(&folder.join(format!("{name}.png")), &pixels.encode_png().map_err(|e| wrong(e.to_string()))?)
}
