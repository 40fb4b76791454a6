//! Which mirrors and glass no light reaches: what they should throw is missing from the picture.

use super::Pilot;
use crate::scene::{ObjectId, Scene, Warning};

/// Whether light is meant to reach any mirror or glass: what shines by itself does without.
pub(super) fn is_meant(scene: &Scene) -> bool {
    meant(scene).next().is_some()
}

/// A warning for each specular object that no pilot photon has met, be it first or later on its way.
pub(super) fn unreachable_specular(scene: &Scene, pilots: &[Pilot]) -> Vec<Warning> {
    let met = |object: &ObjectId| pilots.iter().any(|pilot| pilot.met.contains(object));
    meant(scene)
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

/// Mirrors and glass that do not shine.
fn meant(scene: &Scene) -> impl Iterator<Item = ObjectId> {
    (0..scene.objects.len() as u32)
        .map(ObjectId)
        .filter(|&object| scene.material_of(object).has_specular())
        .filter(|&object| scene.objects[object.index()].emitter.is_none())
}
