//! Pass 1 of one round: photons as maps to gather from, or connected to the eye.

use super::{Control, Render, RenderError};
use crate::light_path::PathClass;
use crate::pass1_light::{self, Blocks, RoundPhotons, Tally};
use crate::pass2_eye::{self, Connected};
use crate::radius::RadiusRule;
use crate::sampling::hash;
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
        let photons = looked_up.then(|| lists.into_maps(self.thin_to()));
        Ok(Sent { photons, connected, tallies })
    }

    /// How many photons second D look up: over a kernel of 8 pixels each way about 25, if they were spread over the picture.
    /// The path that leads to such a D is noisier than that. The classic radii look up all photons there are.
    fn thin_to(&self) -> Option<(usize, u64)> {
        const PIXELS_PER_PHOTON: usize = 8;
        let wanted = self.plan.classes.contains(PathClass::Indirect) && self.plan.radius == RadiusRule::Pixel;
        let (width, height) = self.film.size();
        let key = hash(self.scene.render.seed, u64::from(self.rounds()));
        wanted.then_some((width * height / PIXELS_PER_PHOTON, key))
    }
}
