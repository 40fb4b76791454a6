//! The density estimates of the classic photon map, for comparison: a fixed disc, and the nearest photons. Neither knows
//! of the surface's border.

use super::{Incoming, Lookup, PhotonMap, Stored};
use glam::Vec3;
use std::cmp::Ordering;
use std::f32::consts::PI;

/// Which photons a look-up of the nearest takes, besides that none is further away than its radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Their number, at least 2.
    pub count: usize,
    /// Where that many are nearer than this, m, all within it count: about a pixel.
    pub least: f32,
}

/// What a look-up of the nearest photons found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Radiance.
    pub radiance: Vec3,
    /// Whether there were fewer than asked for within the look-up's radius.
    pub short: bool,
}

impl PhotonMap {
    /// Density estimate with the constant kernel 1/(πr²); otherwise as [`PhotonMap::radiance`].
    #[must_use]
    pub fn disc_radiance(&self, lookup: &Lookup, per_irradiance: impl Fn(Incoming) -> Vec3) -> Vec3 {
        let mut sum = Vec3::ZERO;
        self.visit(lookup, lookup.radius, |_, _, photon| sum += photon.seen(&per_irradiance));
        per_disc(sum, lookup.radius * lookup.radius)
    }

    /// Density estimate from the k nearest photons: the light of the nearest k - 1 over the disc that reaches to the
    /// k-th, which is unbiased where the density is uniform (all k would be too many by k/(k - 1)). If fewer lie within
    /// the look-up's radius, theirs over the disc of that radius; if k lie within `least`, that of all within it. Photons
    /// of equal distance are ordered by what they carry, so that the order in which they were stored does not matter.
    #[must_use]
    pub fn nearest_radiance(
        &self,
        lookup: &Lookup,
        nearest: Nearest,
        per_irradiance: impl Fn(Incoming) -> Vec3,
    ) -> Found {
        let Nearest { count, least } = nearest;
        let mut photons: Vec<(f32, Stored)> = Vec::with_capacity(2 * count.min(4096));
        let mut within = least.min(lookup.radius);
        loop {
            photons.clear();
            self.visit(lookup, within, |distance2, _, photon| photons.push((distance2, photon)));
            // Written so that a radius that is not a number ends it too.
            if photons.len() >= count || !(within > 0.0 && within < lookup.radius) {
                break;
            }
            within = (2.0 * within).min(lookup.radius);
        }
        photons.sort_unstable_by(order);
        let reach2 = photons.get(count.saturating_sub(1)).map(|(distance2, _)| *distance2);
        let least2 = least * least;
        let (taken, radius2) = match reach2 {
            None => (photons.len(), lookup.radius * lookup.radius),
            Some(reach2) if reach2 <= least2 => (photons.partition_point(|(d2, _)| *d2 <= least2), least2),
            Some(reach2) => (count.saturating_sub(1), reach2),
        };
        let sum = photons.iter().take(taken).map(|(_, photon)| photon.seen(&per_irradiance)).sum();
        Found { radiance: per_disc(sum, radius2), short: reach2.is_none() }
    }
}

impl Stored {
    /// What the viewer sees of it, times area.
    fn seen(&self, per_irradiance: &impl Fn(Incoming) -> Vec3) -> Vec3 {
        Vec3::from_array(self.power) * per_irradiance(self.incoming(Vec3::ZERO))
    }
}

/// By distance, then by what the photons carry.
fn order(a: &(f32, Stored), b: &(f32, Stored)) -> Ordering {
    let rest = |p: &Stored| (p.power.map(f32::to_bits), p.place, p.direction, p.normal);
    a.0.total_cmp(&b.0).then_with(|| rest(&a.1).cmp(&rest(&b.1)))
}

fn per_disc(sum: Vec3, radius2: f32) -> Vec3 {
    if sum == Vec3::ZERO { sum } else { sum / (PI * radius2) }
}
