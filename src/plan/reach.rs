//! Which mirrors and glass no light reaches: what they should throw is missing from the picture.

use super::Pilot;
use crate::scene::{ObjectId, Scene, Warning};

/// A warning for each specular object that no pilot photon has met, be it first or later on its way; none if that is
/// true of all, which is a warning of its own.
pub(super) fn unreachable_specular(scene: &Scene, pilots: &[Pilot]) -> Vec<Warning> {
    let met = |object: &ObjectId| pilots.iter().any(|pilot| pilot.met.contains(object));
    let specular = (0..scene.objects.len() as u32)
        .map(ObjectId)
        .filter(|&object| scene.material_of(object).has_specular());
    specular
        .filter(|object| !met(object))
        .map(|object| Warning {
            code: "unreachable_specular",
            pointer: Some(format!("/objects/{}", object.0)),
            message: format!(
                "no light reaches `{}`: none of the pilot photons has met it",
                scene.objects[object.index()].name
            ),
        })
        .collect()
}
