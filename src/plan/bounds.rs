//! What no plan of a scene goes beyond: known at once, where planning sends photons first.

use super::{LEAST_LOG2, LESS_LOG2, MANY_WINDOWS, MOST_LOG2, Plan, frame_bytes, language};
use crate::pass1_light::Budget;
use crate::scene::Scene;

/// Upper bounds of what a render of a scene takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bounds {
    /// Photons that a round sends.
    pub photons: u64,
    /// Memory at the peak.
    pub memory_bytes: u64,
}

impl Bounds {
    /// The bounds of this scene.
    #[must_use]
    pub fn of(scene: &Scene) -> Self {
        let windows = ((scene.lights.len() + 1) * scene.objects.len()) as u64;
        // The photons of a half are shared among the windows, rounded up to powers of two, but each gets a least number.
        let least = windows.max((2 * MANY_WINDOWS as u64) << LEAST_LOG2);
        let photons = 2 * ((2 << MOST_LOG2) + least);
        let frame = frame_bytes(scene, language::layer_names(scene).len(), true);
        Self { photons, memory_bytes: frame + photons * Budget::most_bytes_per_photon(1 << LESS_LOG2) }
    }
}

impl Plan {
    /// Photons of the largest round: rounds grow while that pays.
    #[must_use]
    pub fn most_photons(&self) -> u64 {
        let first: u64 = self.photons.iter().map(|budget| 2_u64 << budget.log2_block).sum();
        first << self.most_photon_shift()
    }
}
