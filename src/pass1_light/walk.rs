//! Pass 1, `S+D`: one photon's way through mirrors and glass until it rests, is taken up or leaves.

use super::emit::EmittedPhoton;
use super::energy::Tally;
use super::window::Window;
use crate::geometry::{Hit, Ray};
use crate::light_path::{Kind, Kinds};
use crate::media::Media;
use crate::optics::{Arrival, Event, Interaction, Outcome, resting_scale, transmittance};
use crate::photon_map::Photon;
use crate::sampling::{SamplePoint, WAVELENGTH_DIMENSION, event_dimension};
use crate::scene::{ObjectId, Scene};
use crate::spectrum;
use glam::Vec3;

/// Sobol dimensions 0 to 3 draw the window and the light; each event takes two more.
const FIRST_EVENT_DIMENSION: u32 = 4;

/// A photon that has met this many S is cut: between two mirrors of reflectance 0.99 it has then lost 92 %.
const MAX_BOUNCES: u32 = 256;

/// Below this fraction of its first power a photon plays roulette for its life.
const ROULETTE_BELOW: f32 = 0.05;

/// What happens to a photon on its way.
pub(super) enum Step {
    /// It goes on from an S, one way or the other.
    Meets(ObjectId, Event),
    /// It comes to rest on a D.
    Rests(Photon),
}

/// Sends photons on their way through a scene.
pub(super) struct PhotonWalk<'a> {
    scene: &'a Scene,
    /// The object that a photon must meet first; any that is specular if `None`.
    caster: Option<ObjectId>,
    /// What the light is inside of.
    media: Media,
    /// What photons are told apart by, and which of them are asked for.
    kinds: Option<&'a Kinds>,
}

impl<'a> PhotonWalk<'a> {
    /// For the photons of a window.
    pub(super) fn new(scene: &'a Scene, window: &'a Window) -> Self {
        Self { scene, caster: window.caster, media: window.media, kinds: window.kinds.as_ref() }
    }

    /// The kind of a photon that has met this many S; `None` if it is not asked for.
    #[inline]
    fn kind(&self, specular: u32) -> Option<Kind> {
        self.kinds.map_or(Some(0), |kinds| kinds.after(specular))
    }

    /// Whether a photon that has met this many S may still be asked for.
    #[inline]
    fn has_aims(&self, specular: u32) -> bool {
        self.kinds.is_none_or(|kinds| kinds.any_from(specular))
    }

    /// True for an object that a photon may meet first.
    fn counts(&self, object: ObjectId) -> bool {
        match self.caster {
            Some(caster) => object == caster,
            None => self.scene.material_of(object).has_specular(),
        }
    }

    /// Traces one photon and tells what happens to it. On what is D and S, light rests and goes on.
    pub(super) fn trace(
        &self,
        photon: EmittedPhoton,
        sample: SamplePoint,
        tally: &mut Tally,
        mut tell: impl FnMut(Step),
    ) {
        let EmittedPhoton { mut ray, mut power } = photon;
        let first_power = power.max_element();
        let (mut media, mut wavelength) = (self.media, None);
        for bounce in 0..MAX_BOUNCES {
            tally.rays += 1;
            let Some(hit) = self.scene.geometry.closest_hit(&ray) else {
                if bounce == 0 {
                    tally.energy.missed += power.as_dvec3();
                } else {
                    tally.escaped += 1;
                    tally.energy.escaped += power.as_dvec3();
                }
                return;
            };
            if bounce == 0 {
                if !self.counts(hit.object) {
                    tally.energy.missed += power.as_dvec3();
                    return;
                }
                tally.hit_caster += 1;
            }
            let arrival = Arrival::new(self.scene, &ray, &hit, media, wavelength);
            let left = power * transmittance(arrival.media.absorption(self.scene), hit.t);
            tally.energy.absorbed += power.as_dvec3() - left.as_dvec3();
            power = left;
            if power == Vec3::ZERO {
                return;
            }
            let interaction = arrival.interact(|| spectrum::pick(sample.get(WAVELENGTH_DIMENSION)));
            // What rests on the first surface is direct light: not the photons' part.
            if bounce > 0
                && arrival.material.has_diffuse()
                && let Some(kind) = self.kind(bounce)
            {
                let resting = power * (Vec3::ONE - interaction.share());
                tally.stored += 1;
                tally.energy.stored += resting.as_dvec3();
                tell(Step::Rests(at_rest(&ray, &hit, power, kind)));
                power -= resting;
            }
            let dimension = event_dimension(FIRST_EVENT_DIMENSION, bounce);
            let Some((outcome, weight)) = choose(&interaction, || sample.get(dimension)) else {
                tally.energy.absorbed += power.as_dvec3();
                return;
            };
            tell(Step::Meets(hit.object, outcome.event));
            // What nobody asks for any more ends here, as if it were taken up.
            let kept = if self.has_aims(bounce + 1) { left * weight } else { Vec3::ZERO };
            tally.energy.absorbed += power.as_dvec3() - kept.as_dvec3();
            power = kept;
            if !survive(&mut power, first_power, || sample.get(dimension + 1), tally) {
                return;
            }
            let origin = arrival.origin_toward(outcome.direction);
            (media, wavelength) = (outcome.media, outcome.wavelength);
            ray = ray.continue_from(origin, outcome.direction);
        }
        tally.cut += 1;
        tally.energy.cut += power.as_dvec3();
    }
}

/// Picks reflection or refraction in proportion to their shares; also the factor on the photon's power.
fn choose(interaction: &Interaction, u: impl Fn() -> f32) -> Option<(Outcome, Vec3)> {
    let (outcome, probability) = match (interaction.reflected, interaction.refracted) {
        (Some(a), Some(b)) => {
            let share = a.fraction.max_element() / (a.fraction + b.fraction).max_element();
            if u() < share { (a, share) } else { (b, 1.0 - share) }
        }
        (Some(only), None) | (None, Some(only)) => (only, 1.0),
        (None, None) => return None,
    };
    Some((outcome, outcome.fraction * (outcome.flux_scale / probability)))
}

/// Roulette for weak photons; false if this one ends.
fn survive(power: &mut Vec3, first_power: f32, u: impl Fn() -> f32, tally: &mut Tally) -> bool {
    let strength = power.max_element() / first_power;
    if strength >= ROULETTE_BELOW {
        return true;
    }
    let probability = strength / ROULETTE_BELOW;
    if u() >= probability {
        tally.cut += 1;
        tally.energy.cut += power.as_dvec3();
        return false;
    }
    let grown = *power / probability;
    tally.energy.cut += power.as_dvec3() - grown.as_dvec3();
    *power = grown;
    true
}

fn at_rest(ray: &Ray, hit: &Hit, power: Vec3, kind: Kind) -> Photon {
    Photon {
        position: hit.surface.point,
        direction: ray.direction,
        normal: hit.surface.normal,
        sheet: hit.sheet,
        kind,
        power: power * resting_scale(ray.direction, &hit.surface),
    }
}
