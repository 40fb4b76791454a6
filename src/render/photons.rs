//! Pass 1 of one round: photons as maps to gather from, or connected to the eye.

use super::{Control, Render, RenderError};
use crate::light_path::PathClass;
use crate::pass1_light::{self, Blocks, RoundPhotons, Tally};
use crate::pass2_eye::{self, Connected};
use crate::scene::Caustics;

/// What pass 1 gives to pass 2.
#[derive(Default)]
pub(super) struct Sent {
    /// Maps, if photons are looked up.
    pub(super) photons: Option<RoundPhotons>,
    /// Caustics, if photons are connected to the eye.
    pub(super) connected: Option<Connected>,
    /// What became of the light of each window.
    pub(super) tallies: Vec<Tally>,
}

impl Render {
    /// Sends the photons of the next round, as the plan wants them.
    pub(super) fn send_photons(&self, blocks: Blocks, control: &Control) -> Result<Sent, RenderError> {
        if self.plan.photons.is_empty() {
            return Ok(Sent::default());
        }
        let lists = pass1_light::emit_lists(&self.scene, &self.plan.photons, blocks, control)?;
        let tallies = lists.tallies.clone();
        let (connected, looked_up) = match self.plan.caustics {
            Some(Caustics::Forward) => {
                let connected = pass2_eye::connect(&self.scene, &self.plan, &lists, self.rounds(), control)?;
                // Light that goes on from the first D is gathered all the same.
                (Some(connected), self.plan.classes.contains(PathClass::Indirect))
            }
            Some(Caustics::Photons | Caustics::Backward) | None => (None, true),
        };
        let photons = looked_up.then(|| lists.into_maps());
        Ok(Sent { photons, connected, tallies })
    }
}
