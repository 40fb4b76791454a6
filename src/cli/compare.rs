//! `nephroid compare`: how one picture differs from another.

use super::Failure;
use super::files::{cannot, load_image, save_image, say};
use clap::Args;
use nephroid::compare::flip::{hdr_flip, ldr_flip};
use nephroid::compare::{CompareError, Comparison, compare};
use nephroid::image_io::{self, LinearImage};
use nephroid::scene::{ImageSettings, Tone};
use serde_json::json;
use std::path::PathBuf;

#[derive(Args, Debug)]
pub(super) struct CompareArguments {
    /// The picture to judge (png, exr or npy).
    test: PathBuf,
    /// The picture it should be.
    reference: PathBuf,
    /// Judge only where this mask (npy, bool or uint8, height × width) is not zero.
    #[arg(long)]
    mask: Option<PathBuf>,
    /// Write a picture of the differences: red where the test is brighter, blue where it is darker.
    #[arg(long, value_name = "PNG")]
    difference: Option<PathBuf>,
    /// Print the numbers as JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &CompareArguments) -> Result<(), Failure> {
    let test = load_image(&arguments.test)?;
    let reference = load_image(&arguments.reference)?;
    let mask = match &arguments.mask {
        None => None,
        Some(path) => {
            let bytes = std::fs::read(path).map_err(|e| cannot("read", path, &e))?;
            let mask = image_io::decode_mask(&bytes)
                .map_err(|e| Failure::Usage(format!("{}: {e}", path.display())))?;
            if (mask.width, mask.height) != (reference.width, reference.height) {
                return Err(Failure::Usage(format!("{}: the mask's size does not fit", path.display())));
            }
            Some(mask.values)
        }
    };
    let comparison =
        compare(&test, &reference, mask.as_deref()).map_err(|e| Failure::Usage(e.to_string()))?;
    if let Some(path) = &arguments.difference {
        save_image(path, &comparison.difference, &plain(&comparison.difference))?;
    }
    let flip = if mask.is_none() { Some(Flips::of(&test, &reference)?) } else { None };
    if arguments.json {
        say(to_json(&comparison, flip.as_ref()));
    } else {
        print(&comparison);
        if let Some(flip) = flip {
            say(format!("LDR-FLIP         {:.6}   as a display shows them, clipped at 1", flip.ldr));
            say(format!("HDR-FLIP         {:.6}   the largest over all useful exposures", flip.hdr));
        }
    }
    Ok(())
}

/// Perceived differences, 0 to 1; none with a mask, since what is seen of a pixel depends on those around it.
struct Flips {
    ldr: f64,
    hdr: f64,
}

impl Flips {
    fn of(test: &LinearImage, reference: &LinearImage) -> Result<Self, Failure> {
        let wrong = |e: CompareError| Failure::Usage(e.to_string());
        let ldr = ldr_flip(test, reference, &plain(reference)).map_err(wrong)?.mean;
        Ok(Self { ldr, hdr: hdr_flip(test, reference).map_err(wrong)?.mean })
    }
}

/// Neither exposed nor tone-mapped.
fn plain(image: &LinearImage) -> ImageSettings {
    ImageSettings { width: image.width, height: image.height, exposure: 0.0, tone: Tone::Linear }
}

fn to_json(c: &Comparison, flip: Option<&Flips>) -> serde_json::Value {
    let tiles: Vec<_> = c
        .worst_tiles
        .iter()
        .map(|t| json!({ "x": t.x, "y": t.y, "width": t.width, "height": t.height, "rel_rmse": t.rel_rmse }))
        .collect();
    json!({
        "pixels": c.pixels, "rmse": c.rmse, "rel_rmse": c.rel_rmse, "relmse": c.relmse,
        "mean_ratio": c.mean_ratio, "channel_mean_ratio": c.channel_mean_ratio, "worst_tiles": tiles,
        "ldr_flip": flip.map(|f| f.ldr), "hdr_flip": flip.map(|f| f.hdr),
    })
}

fn print(c: &Comparison) {
    say(format!("pixels compared  {}", c.pixels));
    say(format!("rmse             {:.6}", c.rmse));
    say(format!("rel_rmse         {:.6}   rmse / mean of the reference", c.rel_rmse));
    say(format!("relmse           {:.6}   mean of (x - r)² / (r² + (0.1 mean)²)", c.relmse));
    let [r, g, b] = c.channel_mean_ratio;
    let ratio = |r: Option<f64>| r.map_or_else(|| "-".to_owned(), |r| format!("{r:.6}"));
    let (r, g, b) = (ratio(r), ratio(g), ratio(b));
    say(format!("mean ratio       {:.6}   red {r}, green {g}, blue {b}", c.mean_ratio));
    for tile in &c.worst_tiles {
        say(format!("worst tile       x {}, y {}: rel_rmse {:.6}", tile.x, tile.y, tile.rel_rmse));
    }
}
