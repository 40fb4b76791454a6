//! Pass 1, `S+D`: one photon's way through mirrors and glass until it rests, is taken up or leaves.

use super::emit::EmittedPhoton;
use super::energy::Tally;
use crate::geometry::{Hit, Ray, offset_origin};
use crate::optics::{self, Interaction, Outcome};
use crate::photon_map::Photon;
use crate::sampling::SamplePoint;
use crate::scene::{ObjectId, Scene};
use glam::Vec3;

/// Sobol dimensions 0 to 3 draw the window and the light; each event takes two more.
const FIRST_EVENT_DIMENSION: u32 = 4;

/// Dimensions 14 and 15 are what a photon is all along its way, such as its time: events leave them out.
const WHOLE_WAY: std::ops::Range<u32> = 14..16;

/// The first of the two dimensions of an event.
fn event_dimension(bounce: u32) -> u32 {
    let dimension = FIRST_EVENT_DIMENSION + 2 * bounce;
    if dimension < WHOLE_WAY.start { dimension } else { dimension + 2 }
}

/// A photon that has met this many S is cut: between two mirrors of reflectance 0.99 it has then lost 92 %.
const MAX_BOUNCES: u32 = 256;

/// Below this fraction of its first power a photon plays roulette for its life.
const ROULETTE_BELOW: f32 = 0.05;

/// What became of a photon.
pub(super) enum Fate {
    /// It rests on a D.
    Stored(Photon),
    /// It was taken up, left, or was another estimator's.
    Gone,
}

/// Traces one photon. Its first surface must be the window's caster; `meets` is told each S on the way.
pub(super) fn walk(
    scene: &Scene,
    caster: ObjectId,
    photon: EmittedPhoton,
    sample: SamplePoint,
    tally: &mut Tally,
    mut meets: impl FnMut(ObjectId),
) -> Fate {
    let EmittedPhoton { mut ray, mut power } = photon;
    let first_power = power.max_element();
    // Of what the photon flies through.
    let mut absorption = Vec3::ZERO;
    for bounce in 0..MAX_BOUNCES {
        tally.rays += 1;
        let Some(hit) = scene.geometry.closest_hit(&ray) else {
            if bounce == 0 {
                tally.energy.missed += power.as_dvec3();
            } else {
                tally.escaped += 1;
                tally.energy.escaped += power.as_dvec3();
            }
            return Fate::Gone;
        };
        if bounce == 0 {
            if hit.object != caster {
                tally.energy.missed += power.as_dvec3();
                return Fate::Gone;
            }
            tally.hit_caster += 1;
        }
        let material = scene.material_of(hit.object);
        let came_through = optics::absorption_before(material, ray.direction, &hit.surface, absorption);
        let left = power * optics::transmittance(came_through, hit.t);
        tally.energy.absorbed += power.as_dvec3() - left.as_dvec3();
        power = left;
        if power == Vec3::ZERO {
            return Fate::Gone;
        }
        let Some(interaction) = optics::interact(material, ray.direction, &hit.surface) else {
            tally.stored += 1;
            tally.energy.stored += power.as_dvec3();
            return Fate::Stored(at_rest(&ray, &hit, power));
        };
        meets(hit.object);
        let u = sample.get(event_dimension(bounce));
        let Some((outcome, weight)) = choose(&interaction, u) else {
            tally.energy.absorbed += power.as_dvec3();
            return Fate::Gone;
        };
        let kept = power * weight;
        tally.energy.absorbed += power.as_dvec3() - kept.as_dvec3();
        power = kept;
        let u = sample.get(event_dimension(bounce) + 1);
        if !survive(&mut power, first_power, u, tally) {
            return Fate::Gone;
        }
        let origin =
            offset_origin(hit.surface.point, hit.surface.error, hit.surface.normal, outcome.direction);
        absorption = optics::absorption_after(material, &outcome, &hit.surface, came_through);
        ray = ray.continue_from(origin, outcome.direction);
    }
    tally.cut += 1;
    tally.energy.cut += power.as_dvec3();
    Fate::Gone
}

/// Picks reflection or refraction in proportion to their shares; also the factor on the photon's power.
fn choose(interaction: &Interaction, u: f32) -> Option<(Outcome, Vec3)> {
    let (outcome, probability) = match (interaction.reflected, interaction.refracted) {
        (Some(a), Some(b)) => {
            let share = a.fraction.max_element() / (a.fraction + b.fraction).max_element();
            if u < share { (a, share) } else { (b, 1.0 - share) }
        }
        (Some(only), None) | (None, Some(only)) => (only, 1.0),
        (None, None) => return None,
    };
    Some((outcome, outcome.fraction * (outcome.flux_scale / probability)))
}

/// Roulette for weak photons; false if this one ends.
fn survive(power: &mut Vec3, first_power: f32, u: f32, tally: &mut Tally) -> bool {
    let strength = power.max_element() / first_power;
    if strength >= ROULETTE_BELOW {
        return true;
    }
    let probability = strength / ROULETTE_BELOW;
    if u >= probability {
        tally.cut += 1;
        tally.energy.cut += power.as_dvec3();
        return false;
    }
    let grown = *power / probability;
    tally.energy.cut += power.as_dvec3() - grown.as_dvec3();
    *power = grown;
    true
}

fn at_rest(ray: &Ray, hit: &Hit, power: Vec3) -> Photon {
    Photon {
        position: hit.surface.point,
        direction: ray.direction,
        normal: hit.surface.normal,
        sheet: hit.sheet,
        power,
    }
}
