//! Pass 2 at a D: what it emits, the lights it sees, the photons that rest on it; and, where more is asked for than the
//! light that comes from the lights or through mirrors and glass, `L(D|S)*DS*DS*E`, a ray that goes on from it.

use super::direct::{Receiver, asked_times, density_toward, direct_light, power_heuristic};
use super::footprint::view_code;
use super::specular::{Branch, EyeWalk, Lookups, Scattered};
use super::walls::Walls;
use crate::bsdf::Bsdf;
use crate::film::PixelSums;
use crate::light_path::{Bounce, Kind, PICTURE, PathClass};
use crate::optics::Arrival;
use crate::pass1_light::{RoundPhotons, Source};
use crate::photon_map::{Incoming, Lookup, Nearest};
use crate::plan::Asking;
use crate::radius::{PIXEL, Reach};
use crate::sampling::{WAVELENGTH_DIMENSION, hash};
use crate::scene::LightPoint;
use crate::spectrum;
use glam::Vec3;
use std::cell::Cell;
use std::f32::consts::PI;

/// Sobol dimensions, of a stream of its own, that draw the direction in which a path goes on, its lobe, and whether.
const DIRECTION_DIMENSION: u32 = 8;
const LOBE_DIMENSION: u32 = 10;
const ROULETTE_DIMENSION: u32 = 11;

/// Tells that stream from the others of an eye sample.
const LEAVING_DIFFUSE: u64 = 0x5eed_0d1e;

/// Tells the streams of what comes after the D: the choices at S surfaces there must not hang on the direction.
const AFTER_DIFFUSE: u64 = 0x5eed_0d1f;

/// Photons are looked up over this many times the pixel's width at a D that is seen by another: what is blurred there
/// is blurred once more by the first.
const INDIRECT_WIDTH: f32 = 8.0;

/// In a crease of which hardly anything is seen a density would be noise alone.
const LEAST_MASS: f32 = 0.25;

/// Paths of fewer D do not play roulette.
const ROULETTE_AFTER: u32 = 2;

/// More D than this end a path: of albedo 0.9, a hundredth of it is left.
const MOST_DIFFUSE: u32 = 48;

impl EyeWalk<'_> {
    /// Adds up what a surface shows; true if it has a D part.
    pub(super) fn arrive(&mut self, branch: &Branch, arrival: &Arrival<'_>, sums: &mut PixelSums) -> bool {
        self.see_emitter(branch, arrival, sums);
        let wavelengths = Cell::new(0);
        let line = || {
            wavelengths.set(1);
            spectrum::pick(self.sample.branch(branch.key).get(WAVELENGTH_DIMENSION))
        };
        let bsdf = Bsdf::new(arrival, line);
        self.counts.wavelengths += wavelengths.get();
        let Some(bsdf) = bsdf else { return false };
        let seen = branch.scattered.map_or(0, |s| s.count) + 1;
        if seen > 1 && !self.wants_more(branch) {
            // The paths asked for end at the last D.
            return true;
        }
        // A branch is large: it is copied only where its trail goes on.
        let extended = self
            .context
            .plan
            .language
            .as_ref()
            .map(|language| Branch { trail: language.step(branch.trail, Bounce::Diffuse), ..*branch });
        let branch = extended.as_ref().unwrap_or(branch);
        self.see_lights(branch, arrival, &bsdf, sums);
        if seen > 1 {
            self.see_looked_up(branch, arrival, (&bsdf, INDIRECT_WIDTH), PathClass::Indirect, sums);
        } else {
            self.see_photons(branch, arrival, &bsdf, sums);
        }
        self.leave(branch, arrival, (&bsdf, seen), sums);
        true
    }

    /// The lights that the point sees.
    fn see_lights(&mut self, branch: &Branch, arrival: &Arrival<'_>, bsdf: &Bsdf, sums: &mut PixelSums) {
        let class = PathClass::with_light_after(branch.scattered.map_or(0, |s| s.count) + 1);
        if !self.direct || !self.wants_lights(branch, class) {
            return;
        }
        let (scene, sample) = (self.context.scene, self.sample.branch(branch.key));
        let tree = self.context.plan.light_tree.as_ref();
        let receiver = Receiver { scene, surface: &arrival.hit.surface, bsdf, time: branch.ray.time, tree };
        let mut shadow_rays = 0;
        if self.context.plan.language.is_none() {
            let mut direct = Vec3::ZERO;
            direct_light(&receiver, sample, &mut shadow_rays, |_, radiance| direct += radiance);
            self.add(branch, class, (PICTURE, direct), sums);
        } else {
            direct_light(&receiver, sample, &mut shadow_rays, |source, radiance| {
                let pictures = match source {
                    Source::Light(light) => self.pictures_of_light(branch, class, light),
                    Source::Environment => self.pictures_of_environment(branch, class),
                };
                self.add(branch, class, (pictures, radiance), sums);
            });
        }
        self.count_rays(branch, shadow_rays);
        self.counts.shadow_rays += shadow_rays;
    }

    /// What the surface itself gives, if this estimator is the one that counts it.
    fn see_emitter(&mut self, branch: &Branch, arrival: &Arrival<'_>, sums: &mut PixelSums) {
        let scene = self.context.scene;
        let surface = &arrival.hit.surface;
        if branch.scattered.is_none() && arrival.material.glows() {
            let radiance = arrival.material.glow(surface.texture);
            self.add(branch, PathClass::Emitted, (self.pictures_of_glow(branch), radiance), sums);
        }
        let Some(id) = scene.objects[arrival.hit.object.index()].emitter else { return };
        let light = &scene.lights[id.index()];
        let Some(radiance) = light.surface_radiance() else { return };
        if arrival.direction.dot(surface.normal) > 0.0 {
            return;
        }
        let (class, weight) = match branch.scattered {
            None => (PathClass::Emitted, 1.0),
            Some(Scattered { straight: true, pdf: Some(pdf), count, point, .. }) => {
                let at = LightPoint { point: surface.point, normal: surface.normal, error: surface.error };
                let tree = self.context.plan.light_tree.as_ref();
                let times = asked_times(tree, &Asking { point, normal: None }, id);
                let other = density_toward(light, (point, branch.ray.time), &at).unwrap_or(0.0) * times;
                (PathClass::with_light_after(count), power_heuristic(pdf, other))
            }
            // Light over mirrors or glass: the photons' part, unless rays are to find it.
            Some(Scattered { straight: false, count, .. }) if self.goes_backward() => {
                (PathClass::with_caustic_after(count), 1.0)
            }
            Some(_) => return,
        };
        let pictures = self.pictures_of_light(branch, class, id);
        self.add(branch, class, (pictures, radiance * weight), sums);
    }

    /// The photons at the first D: counted on the pixel's footprint, if this is it, else looked up.
    fn see_photons(&mut self, branch: &Branch, arrival: &Arrival<'_>, bsdf: &Bsdf, sums: &mut PixelSums) {
        let footprint = self.on_footprint(branch, arrival);
        if footprint && let Some(albedo) = bsdf.albedo() {
            // Radiance leaving a Lambertian surface is albedo / π times its irradiance.
            sums.gain += branch.throughput * albedo / PI;
        }
        match self.lookups {
            Lookups::Nowhere => {}
            Lookups::OffFootprint if footprint => {}
            Lookups::OffFootprint | Lookups::Everywhere => {
                self.see_looked_up(branch, arrival, (bsdf, 1.0), PathClass::Caustic, sums);
            }
        }
    }

    /// Whether a first D is the pixel's footprint.
    fn on_footprint(&self, branch: &Branch, arrival: &Arrival<'_>) -> bool {
        branch.main && self.view == Some(view_code(arrival.hit.sheet, branch.key))
    }

    /// The photons around the point, with a kernel of about a pixel times a factor; apart where they are in different
    /// pictures.
    fn see_looked_up(
        &mut self,
        branch: &Branch,
        arrival: &Arrival<'_>,
        (bsdf, wider): (&Bsdf, f32),
        class: PathClass,
        sums: &mut PixelSums,
    ) {
        let Some(photons) = self.context.photons else { return };
        let Some(language) = &self.context.plan.language else {
            let radiance = self.look_up(photons, branch, arrival, (bsdf, wider), |_| true);
            self.add(branch, class, (PICTURE, radiance), sums);
            return;
        };
        for &pictures in language.parts(branch.trail) {
            let pick = |kind: Kind| language.pictures(branch.trail, kind) == pictures;
            let radiance = self.look_up(photons, branch, arrival, (bsdf, wider), pick);
            self.add(branch, class, (pictures, radiance), sums);
        }
    }

    /// Radiance by density estimation around the point, of the photons that are picked.
    fn look_up(
        &mut self,
        photons: &RoundPhotons,
        branch: &Branch,
        arrival: &Arrival<'_>,
        (bsdf, wider): (&Bsdf, f32),
        pick: impl Fn(Kind) -> bool,
    ) -> Vec3 {
        let hit = arrival.hit;
        let pixel = self.context.scene.camera.pixel_width(branch.travelled + hit.t);
        let point = hit.surface.point;
        let within = |radius: f32| Lookup {
            point,
            normal: bsdf.geometric,
            sheet: hit.sheet,
            radius,
            both_sides: bsdf.transmits(),
        };
        let per_irradiance = |incoming: Incoming| {
            if pick(incoming.kind) { bsdf.per_irradiance(incoming.direction) } else { Vec3::ZERO }
        };
        let geometry = &self.context.scene.geometry;
        let maps = if wider > 1.0 { photons.thinned.as_ref() } else { None };
        let map = &maps.unwrap_or(&photons.maps)[self.half];
        self.counts.lookups += 1;
        match self.reach {
            Reach::Pixels(pixels) => {
                let radius = pixel * pixels * wider;
                let radiance = map.radiance(&within(radius), per_irradiance);
                if radiance == Vec3::ZERO {
                    return radiance;
                }
                let time = branch.ray.time;
                let mass = geometry.kernel_mass(hit.sheet, point, radius, time);
                let at = (&hit.surface, bsdf.geometric);
                let walls = || Walls::around(geometry, at, radius, time);
                let Some(walls) = self.border.then(walls).flatten() else { return radiance / mass };
                let seen = |incoming: Incoming| {
                    if walls.reach(incoming.offset) { per_irradiance(incoming) } else { Vec3::ZERO }
                };
                // Where a surface ends at a wall both say so.
                map.radiance(&within(radius), seen) / mass.min(walls.mass(radius)).max(LEAST_MASS)
            }
            Reach::Disc(radius) => map.disc_radiance(&within(radius), per_irradiance),
            Reach::Nearest { count, most } => {
                let nearest = Nearest { count, least: (pixel * PIXEL as f32).min(most) };
                let found = map.nearest_radiance(&within(most), nearest, per_irradiance);
                self.counts.short_lookups += u64::from(found.short);
                found.radiance
            }
        }
    }

    /// Goes on from a D: if all paths are asked for, or if rays are what finds the lights in its highlights. What is found
    /// from the pixel's footprint is its irradiance, which smoothing knows how to average, unless rays are what
    /// finds the caustics too.
    fn leave(
        &mut self,
        branch: &Branch,
        arrival: &Arrival<'_>,
        (bsdf, seen): (&Bsdf, u32),
        sums: &mut PixelSums,
    ) {
        // A sample that is followed once more for its photons has had its path.
        let complete = self.wants_more(branch) && self.direct;
        let highlights = bsdf.albedo().is_none() && self.context.plan.lights_can_be_met;
        let first_of_all = seen == 1 && (highlights || self.goes_backward());
        if !(complete || first_of_all) || seen >= MOST_DIFFUSE {
            return;
        }
        let albedo = bsdf.albedo().filter(|albedo| albedo.max_element() > 0.0);
        let to_footprint = match (branch.scattered, albedo) {
            (Some(scattered), _) => scattered.to_footprint,
            (None, Some(_)) => complete && !self.goes_backward() && self.on_footprint(branch, arrival),
            (None, None) => false,
        };
        if seen == 1 && to_footprint {
            sums.halves[self.half].departures += 1;
        }
        let stream = self.sample.branch(hash(branch.key, LEAVING_DIFFUSE));
        let Some(scattered) = bsdf.sample(stream.get_2d(DIRECTION_DIMENSION), stream.get(LOBE_DIMENSION))
        else {
            return;
        };
        let mut throughput = branch.throughput * scattered.weight;
        if let Some(albedo) = albedo.filter(|_| seen == 1 && to_footprint) {
            throughput = Vec3::splat(PI * scattered.weight.max_element() / albedo.max_element());
        }
        if seen > ROULETTE_AFTER {
            let survival = scattered.weight.max_element().clamp(0.05, 0.95);
            if stream.get(ROULETTE_DIMENSION) >= survival {
                return;
            }
            throughput /= survival;
        }
        let surface = &arrival.hit.surface;
        let direction = scattered.direction;
        let origin = arrival.origin_toward(direction);
        let pdf = bsdf.albedo().is_none().then_some(scattered.pdf);
        self.go_on(Branch {
            ray: branch.ray.continue_from(origin, direction),
            throughput,
            media: *bsdf.media_toward(direction),
            wavelength: branch.wavelength.or(scattered.wavelength),
            bounces: branch.bounces + 1,
            travelled: branch.travelled + arrival.hit.t,
            key: hash(branch.key, AFTER_DIFFUSE),
            main: false,
            scattered: Some(Scattered {
                count: seen,
                point: surface.point,
                pdf,
                straight: true,
                to_footprint,
            }),
            ..*branch
        });
    }
}
