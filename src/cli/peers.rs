//! What bench/peers has measured: pictures of other renderers, and lines that are stored.

use super::Failure;
use super::files::{cannot, load_image};
use nephroid::lab::peers::stored_curve;
use nephroid::lab::{Curve, PeerRun, Point, Shot};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// What is known of other renderers.
#[derive(Default)]
pub(super) struct Peers {
    folder: PathBuf,
    rendered: Value,
    stored: Value,
}

impl Peers {
    /// Reads `peers.json` of a folder that bench/peers/run.py has written; and `stored.json`, if one lies there.
    pub(super) fn read(folder: &Path) -> Result<Self, Failure> {
        let json = |path: &Path| -> Result<Value, Failure> {
            let bytes = std::fs::read(path).map_err(|e| cannot("read", path, &e))?;
            serde_json::from_slice(&bytes).map_err(|e| Failure::Usage(format!("{}: {e}", path.display())))
        };
        let stored = folder.join("stored.json");
        Ok(Self {
            folder: folder.to_owned(),
            rendered: json(&folder.join("peers.json"))?,
            stored: if stored.exists() { json(&stored)? } else { Value::Null },
        })
    }

    /// True if another renderer was run on this scene.
    pub(super) fn know(&self, scene: &str) -> bool {
        of_scene(&self.rendered, scene).next().is_some()
    }

    /// The renders of a scene, with their pictures.
    pub(super) fn runs(&self, scene: &str) -> Result<Vec<PeerRun>, Failure> {
        of_scene(&self.rendered, scene).map(|run| self.run(run)).collect()
    }

    fn run(&self, run: &Value) -> Result<PeerRun, Failure> {
        let shots = list(&run["shots"]).map(|shot| {
            let image = load_image(&self.folder.join(word(shot, "image")?))?;
            Ok(Shot { cpu: number(shot, "cpu_seconds")?, image })
        });
        Ok(PeerRun { name: word(run, "name")?.to_owned(), shots: shots.collect::<Result<_, Failure>>()? })
    }

    /// The lines of a scene that were measured before.
    pub(super) fn lines(&self, scene: &str) -> Result<Vec<Curve>, Failure> {
        of_scene(&self.stored, scene)
            .map(|run| {
                let points = list(&run["points"]).enumerate().map(|(i, point)| {
                    let (cpu, error) = (number(point, "cpu_seconds")?, number(point, "rel_rmse")?);
                    Ok(Point { rounds: i as u32 + 1, cpu, error })
                });
                let points = points.collect::<Result<_, Failure>>()?;
                let name = format!("{}, stored", word(run, "name")?);
                Ok(stored_curve(name, points, word(&self.stored, "words")?.to_owned()))
            })
            .collect()
    }
}

fn list(value: &Value) -> impl Iterator<Item = &Value> {
    value.as_array().into_iter().flatten()
}

fn of_scene<'a>(known: &'a Value, scene: &'a str) -> impl Iterator<Item = &'a Value> {
    list(&known["runs"]).filter(move |run| run["scene"] == scene)
}

fn word<'a>(value: &'a Value, key: &str) -> Result<&'a str, Failure> {
    value[key].as_str().ok_or_else(|| missing(key))
}

fn number(value: &Value, key: &str) -> Result<f64, Failure> {
    let found = value[key].as_f64().filter(|number| number.is_finite() && *number > 0.0);
    found.ok_or_else(|| missing(key))
}

fn missing(key: &str) -> Failure {
    Failure::Usage(format!("peers.json or stored.json: `{key}` is missing or wrong"))
}
