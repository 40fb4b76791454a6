//! The lab: every method that can render a scene, its error against a reference over CPU seconds.
//!
//! A [`Subject`] is a scene that is rendered by many [`methods`]; its [`Reference`] is what they should come to. A
//! [`Chart`] holds one [`Curve`] per method; [`svg`] draws it, [`page`] and [`table`] write it down; [`peers`] puts other renderers on it. [`scaling`] is time over
//! the size of the work. [`honesty()`] asks
//! whether renders that stop by their own estimate are as good as they say; [`stability`] where methods break.

pub mod axis;
pub mod fit;
pub mod honesty;
pub mod judge;
pub mod methods;
pub mod page;
pub mod peers;
pub mod run;
pub mod scaling;
pub mod stability;
mod structures;
mod subject;
pub mod svg;
pub mod table;

mod reference;

pub use honesty::{Honesty, honesty};
pub use judge::Judgement;
pub use methods::Method;
pub use peers::{PeerRun, Shot, peer_curve};
pub use reference::{Reference, Rival, measure_reference, without_lamps};
pub use run::{Budget, Curve, End, Origin, Point, run_method};
pub use scaling::{Scaling, Series};
pub use structures::{Timing, time_structures};
pub use subject::Subject;

use crate::compare::CompareError;
use crate::image_io::ImageError;
use crate::render::RenderError;
use crate::scene::SceneErrors;

/// All methods for one task of one scene.
#[derive(Debug)]
pub struct Chart {
    /// The scene's name, good for file names.
    pub scene: String,
    /// What is computed.
    pub task: Task,
    /// What all of them should come to.
    pub reference: Reference,
    /// One per method.
    pub curves: Vec<Curve>,
}

/// What the methods of a chart compute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    /// What the scene asks for.
    Picture,
    /// Direct light alone, `whitted`.
    DirectLight,
    /// All paths of light, beside other renderers, which know no less.
    Complete,
}

impl Task {
    /// In file names.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Picture => "picture",
            Self::DirectLight => "direct",
            Self::Complete => "complete",
        }
    }

    /// In headings.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::Picture => "the whole picture, caustics by several methods",
            Self::DirectLight => "direct light, area lights sampled in several ways",
            Self::Complete => "all paths of light, beside other renderers",
        }
    }
}

/// Why a scene cannot be charted.
#[derive(Debug, thiserror::Error)]
pub enum LabError {
    /// The scene is wrong.
    #[error("{} errors in the scene, the first: {}", .0.issues.len(), .0.issues.first().map_or("", |i| i.message.as_str()))]
    Scene(#[from] SceneErrors),
    /// The scene's text is no JSON object.
    #[error("the scene is not a JSON object")]
    NotAnObject,
    /// A render failed.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The reference is black, or a picture is not finite.
    #[error("no error can be measured: {0}")]
    Compare(#[from] CompareError),
    /// A picture cannot be encoded.
    #[error(transparent)]
    Image(#[from] ImageError),
}
