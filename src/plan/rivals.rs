//! The plan for estimators of caustics other than the photon map.

use super::Plan;
use crate::scene::{Caustics, Scene};

impl Plan {
    /// Path tracing in place of photons, as far as there is a light that a ray can meet.
    pub(super) fn decide_backward(&mut self, scene: &Scene) {
        let unmet: Vec<&str> = scene
            .lights
            .iter()
            .filter(|light| light.surface_radiance().is_none() && !light.is_dark())
            .map(|light| light.kind())
            .collect();
        if !unmet.is_empty() {
            let message = format!(
                "`backward` finds a light by meeting it, and these have no size: {}; their caustics are left out",
                unmet.join(", ")
            );
            self.warn("backward_cannot_meet_light", message);
        }
        self.decide("pass 1", false, "no photons", "`backward` asks for caustics without them");
        if !self.lights_can_be_met {
            self.decide("caustics", false, "nothing", "no light can be met by a ray");
            return;
        }
        self.caustics = Some(Caustics::Backward);
        let choice = "paths go on from the first D until they meet a light";
        self.decide("caustics", true, choice, "`backward` asks for it: for comparison with photons");
    }

    /// What becomes of the photons that pass 1 sends.
    pub(super) fn decide_gathering(&mut self, scene: &Scene) {
        let caustics = scene.render.caustics;
        self.caustics = Some(caustics);
        match caustics {
            Caustics::Photons | Caustics::Backward => {}
            Caustics::Forward => {
                let choice = "each photon that rests is connected to the eye";
                self.decide("caustics", true, choice, "`forward` asks for it: for comparison with look-ups");
                self.warn(
                    "forward_sees_no_mirrors",
                    "`forward` computes LS+DE: caustics that are seen in mirrors or through glass are left out",
                );
            }
        }
    }
}
