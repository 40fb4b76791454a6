//! Other renderers on the same chart: their pictures at growing times, compared with the same reference; or lines that
//! were measured before, marked as such.

use super::{Curve, End, Judgement, LabError, Method, Origin, Point, Reference};
use crate::image_io::LinearImage;
use serde_json::json;

/// A picture of another renderer.
#[derive(Clone, Debug)]
pub struct Shot {
    /// CPU seconds of all threads, as for this renderer: without reading the scene and compiling kernels.
    pub cpu: f64,
    /// Linear radiance, of the chart's size.
    pub image: LinearImage,
}

/// A render of one scene by another renderer.
#[derive(Clone, Debug)]
pub struct PeerRun {
    /// Renderer and method, for the legend.
    pub name: String,
    /// In order of time.
    pub shots: Vec<Shot>,
}

/// The line of another renderer, whose pictures were made in the same run.
///
/// # Errors
/// If a picture cannot be compared with the reference: another size, or not finite.
pub fn peer_curve(run: PeerRun, reference: &Reference, equal_time: f64) -> Result<Curve, LabError> {
    let (mut points, mut picture, mut end) = (Vec::new(), None, End::Measured);
    for (index, Shot { cpu, image }) in run.shots.into_iter().enumerate() {
        let Judgement { error, told, .. } = reference.judge(&image)?;
        if !told {
            end = End::Reference;
            break;
        }
        let point = Point { rounds: index as u32 + 1, cpu, error };
        points.push(point);
        if picture.is_none() || cpu <= equal_time {
            picture = Some((point, image));
        }
    }
    let method = Method { name: run.name, settings: json!({}) };
    Ok(Curve { method, points, end, picture, warnings: Vec::new(), peer: Some(Origin::SameRun) })
}

/// A line that was measured before.
#[must_use]
pub fn stored_curve(name: String, points: Vec<Point>, words: String) -> Curve {
    let method = Method { name, settings: json!({}) };
    let warnings = vec![words.clone()];
    Curve { method, points, end: End::Measured, picture: None, warnings, peer: Some(Origin::Stored(words)) }
}
