//! Pass 2, `S*E`: from the eye through mirrors and glass to every D or emitter; there the three classes
//! are added up.
//!
//! At glass both ways are followed while both are strong; a weak branch is picked by chance instead, and a
//! very weak one plays roulette, so that a scene of many glass balls costs rays in proportion to what they
//! still add.

use super::EyeContext;
use super::direct::{environment_density, power_heuristic};
use super::layers::PixelLayers;
use crate::film::PixelSums;
use crate::geometry::Ray;
use crate::light_path::{Bounce, PathClass, Trail};
use crate::media::Media;
use crate::optics::{Arrival, Event, Interaction, Outcome, transmittance};
use crate::radius::Reach;
use crate::sampling::{SamplePoint, WAVELENGTH_DIMENSION, event_dimension};
use crate::scene::Caustics;
use crate::spectrum;
use glam::{Vec2, Vec3};
use std::cell::Cell;

/// Both ways are followed while each still carries a share of the pixel; a branch that carries less than half of that plays
/// roulette. The first few S are followed further: a lamp that is seen after two reflections inside a ball would be drawn
/// by chance, and be a bright speck. Behind many balls ways double with each of them.
fn split_above(bounces: u32) -> f32 {
    const FEW: u32 = 6;
    if bounces < FEW { 0.002 } else { 0.02 }
}

/// More S than this end the walk: between two mirrors of reflectance 0.95 it then carries 3 %.
const MAX_BOUNCES: u32 = 64;

/// Sobol dimensions 0 and 1 place the sample in the pixel, 2 to 5 light the D; then two per S.
const FIRST_EVENT_DIMENSION: u32 = 6;

/// The lens is drawn from these two dimensions of the sample itself; D and S draw from its branches.
pub(super) const LENS_DIMENSION: u32 = 14;

/// The time is drawn from this dimension of the sample itself.
const TIME_DIMENSION: u32 = 12;

/// What the rays of pass 2 did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EyeCounts {
    /// Rays from the eye and from S surfaces.
    pub eye_rays: u64,
    /// Shadow rays.
    pub shadow_rays: u64,
    /// Look-ups in the photon map.
    pub lookups: u64,
    /// Look-ups of the nearest photons that found fewer than they asked for.
    pub short_lookups: u64,
    /// Branches ended by the bounce limit.
    pub cut: u64,
    /// Paths that went on from a first D.
    pub paths: u64,
    /// Rays among those above that they needed beyond that D.
    pub path_rays: u64,
    /// Points drawn on the lens: none of a pinhole.
    pub lens_points: u64,
    /// Moments drawn: none where nothing moves.
    pub moments: u64,
    /// Wavelengths drawn: none where nothing takes light apart.
    pub wavelengths: u64,
}

impl EyeCounts {
    /// Adds another's counts.
    pub fn add(&mut self, other: &Self) {
        let (mine, theirs) = (self.to_array(), other.to_array());
        *self = Self::from_array(std::array::from_fn(|i| mine[i] + theirs[i]));
    }

    /// The counts in a fixed order.
    pub(crate) fn to_array(self) -> [u64; 10] {
        [
            self.eye_rays,
            self.shadow_rays,
            self.lookups,
            self.short_lookups,
            self.cut,
            self.paths,
            self.path_rays,
            self.lens_points,
            self.moments,
            self.wavelengths,
        ]
    }

    /// The inverse of [`EyeCounts::to_array`].
    pub(crate) fn from_array(counts: [u64; 10]) -> Self {
        let [eye_rays, shadow_rays, lookups, short_lookups, cut, rest @ ..] = counts;
        let [paths, path_rays, lens_points, moments, wavelengths] = rest;
        Self {
            eye_rays,
            shadow_rays,
            lookups,
            short_lookups,
            cut,
            paths,
            path_rays,
            lens_points,
            moments,
            wavelengths,
        }
    }
}

/// Where an eye sample looks photons up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lookups {
    /// Nowhere.
    Nowhere,
    /// At every D that is not the pixel's footprint.
    OffFootprint,
    /// At every D.
    Everywhere,
}

/// Follows eye rays; owns the stack of branches yet to follow.
pub(super) struct EyeWalk<'a> {
    pub(super) context: &'a EyeContext<'a>,
    /// How far the density estimate reaches.
    pub(super) reach: Reach,
    stack: Vec<Branch>,
    /// The eye sample that is being followed.
    pub(super) half: usize,
    pub(super) sample: SamplePoint,
    pub(super) lookups: Lookups,
    pub(super) view: Option<u32>,
    /// When it is followed, and whether it adds light straight from the lights.
    pub(super) time: f32,
    pub(super) direct: bool,
    /// Whether it goes on from the first D as a path, if such are asked for.
    pub(super) goes_on: bool,
    /// What the pixel gathers for its named layers.
    pub(super) layers: PixelLayers,
    pub(super) counts: EyeCounts,
    /// Whether the pixel shows an edge of something: its look-ups may be at the foot of a wall.
    pub(super) border: bool,
}

/// A ray on its way from the eye.
#[derive(Clone, Copy)]
pub(super) struct Branch {
    pub(super) ray: Ray,
    pub(super) throughput: Vec3,
    /// What the ray is inside of.
    pub(super) media: Media,
    /// Its wavelength, μm; `None` is light of all wavelengths.
    pub(super) wavelength: Option<f32>,
    /// Surfaces it has left.
    pub(super) bounces: u32,
    /// Length of the way from the eye.
    pub(super) travelled: f32,
    /// Which ways were taken: one bit per S, after a leading 1; a hash after a D.
    pub(super) key: u64,
    /// The eye's main way: refracted where it can be, and never by chance.
    pub(super) main: bool,
    /// The last D on its way, if there was one.
    pub(super) scattered: Option<Scattered>,
    /// What it has met, where layers or expressions tell paths apart.
    pub(super) trail: Trail,
}

/// A D on the way of a ray from the eye.
#[derive(Clone, Copy)]
pub(super) struct Scattered {
    /// How many D there were.
    pub(super) count: u32,
    /// Where it is.
    pub(super) point: Vec3,
    /// Density per solid angle of the direction it was left in; `None` if lights are another estimator's alone.
    pub(super) pdf: Option<f32>,
    /// Nothing but the D lies between it and the ray: no S.
    pub(super) straight: bool,
    /// The first D was the pixel's footprint: throughput counts the irradiance there, not the radiance that is seen.
    pub(super) to_footprint: bool,
}

impl<'a> EyeWalk<'a> {
    pub(super) fn new(context: &'a EyeContext<'a>) -> Self {
        let reach = context.plan.radius.reach(context.round);
        let sample = SamplePoint::new(0, 0);
        Self {
            context,
            reach,
            stack: Vec::new(),
            half: 0,
            sample,
            lookups: Lookups::Nowhere,
            view: None,
            time: 0.0,
            direct: true,
            goes_on: false,
            layers: PixelLayers::new(context.plan.layer_names.len()),
            counts: EyeCounts::default(),
            border: false,
        }
    }

    /// Sets the sample that is followed next, where it looks photons up, and the view of the pixel's footprint.
    pub(super) fn start(&mut self, half: usize, sample: SamplePoint, lookups: Lookups, view: Option<u32>) {
        (self.half, self.sample) = (half, sample);
        (self.lookups, self.view) = (lookups, view);
        self.time = 0.0;
    }

    /// [`EyeWalk::trace`] where something moves: every sample sees the lights at a moment of its own, but photons
    /// lie where things are at theirs, `photon_time`, so that the sample is followed once more then for what they
    /// bring.
    pub(super) fn trace_moving(&mut self, raster: Vec2, photon_time: Option<f32>, sums: &mut PixelSums) {
        let lookups = std::mem::replace(&mut self.lookups, Lookups::Nowhere);
        self.counts.moments += 1;
        self.time = self.sample.get(TIME_DIMENSION);
        self.trace(raster, sums);
        let Some(time) = photon_time else { return };
        let mut then = PixelSums::default();
        (self.lookups, self.time, self.direct) = (lookups, time, false);
        self.layers.caustics_only = true;
        self.trace(raster, &mut then);
        (self.direct, self.layers.caustics_only) = (true, false);
        let caustic = then.halves[self.half].classes.get(PathClass::Caustic);
        sums.halves[self.half].classes.add(PathClass::Caustic, caustic);
    }

    /// Adds what arrives along one eye ray to the classes' sums.
    pub(super) fn trace(&mut self, raster: Vec2, sums: &mut PixelSums) {
        let camera = &self.context.scene.camera;
        let ray = match camera.lens() {
            Some(lens) => {
                self.counts.lens_points += 1;
                camera.ray_through(lens, raster, self.sample.get_2d(LENS_DIMENSION))
            }
            None => camera.ray(raster),
        };
        self.stack.clear();
        let first = Branch {
            ray: ray.at_time(self.time),
            throughput: Vec3::ONE,
            media: self.context.plan.eye_media,
            wavelength: None,
            bounces: 0,
            travelled: 0.0,
            key: 1,
            main: true,
            scattered: None,
            trail: Trail::default(),
        };
        self.follow(first, sums);
        while let Some(branch) = self.stack.pop() {
            self.follow(branch, sums);
        }
    }

    fn follow(&mut self, mut branch: Branch, sums: &mut PixelSums) {
        let scene = self.context.scene;
        self.counts.eye_rays += 1;
        self.count_rays(&branch, 1);
        let Some(hit) = scene.geometry.closest_hit(&branch.ray) else {
            branch.throughput *= transmittance(branch.media.absorption(scene), f32::INFINITY);
            self.escape(&branch, sums);
            return;
        };
        let arrival = Arrival::new(scene, &branch.ray, &hit, branch.media, branch.wavelength);
        branch.media = arrival.media;
        branch.throughput *= transmittance(branch.media.absorption(scene), hit.t);
        let rests = self.arrive(&branch, &arrival, sums);
        // The main way ends at the first D.
        branch.main &= !rests;
        if !arrival.material.has_specular() {
            return;
        }
        let pick = self.sample.branch(branch.key);
        let wavelengths = Cell::new(0);
        let interaction = arrival.interact(|| {
            wavelengths.set(1);
            spectrum::pick(pick.get(WAVELENGTH_DIMENSION))
        });
        self.counts.wavelengths += wavelengths.get();
        self.scatter(&branch, &arrival, &interaction);
    }

    /// Counts the rays that a path needs beyond its first D.
    pub(super) fn count_rays(&mut self, branch: &Branch, rays: u64) {
        if self.goes_on && branch.scattered.is_some() {
            self.counts.path_rays += rays;
        }
    }

    /// Puts the ways that leave an S onto the stack.
    fn scatter(&mut self, branch: &Branch, arrival: &Arrival<'_>, interaction: &Interaction) {
        let (a, b) = match (interaction.reflected, interaction.refracted) {
            (None, None) => return,
            _ if branch.bounces >= MAX_BOUNCES => {
                self.counts.cut += 1;
                return;
            }
            (Some(only), None) | (None, Some(only)) => {
                self.push(branch, arrival, &only, 1.0, branch.main);
                return;
            }
            (Some(a), Some(b)) => (a, b),
        };
        let weight = |o: &Outcome| (branch.throughput * o.fraction).max_element();
        if branch.scattered.is_none() && weight(&a).min(weight(&b)) >= split_above(branch.bounces) {
            self.push(branch, arrival, &b, 1.0, branch.main);
            self.push(branch, arrival, &a, 1.0, false);
            return;
        }
        let share = weight(&a) / (weight(&a) + weight(&b));
        let u = self.sample.branch(branch.key).get(event_dimension(FIRST_EVENT_DIMENSION, branch.bounces));
        let (outcome, probability) = if u < share { (a, share) } else { (b, 1.0 - share) };
        let main = branch.main && outcome.event == Event::Refraction;
        self.push(branch, arrival, &outcome, probability, main);
    }

    fn push(
        &mut self,
        branch: &Branch,
        arrival: &Arrival<'_>,
        outcome: &Outcome,
        probability: f32,
        main: bool,
    ) {
        let mut throughput = branch.throughput * outcome.fraction * (outcome.radiance_scale / probability);
        let strength = throughput.max_element();
        let roulette_below = 0.5 * split_above(branch.bounces);
        if strength < roulette_below {
            let survival = strength / roulette_below;
            let dimension = event_dimension(FIRST_EVENT_DIMENSION, branch.bounces) + 1;
            if self.sample.branch(branch.key).get(dimension) >= survival {
                return;
            }
            throughput /= survival;
        }
        let origin = arrival.origin_toward(outcome.direction);
        let mut next = Branch {
            ray: branch.ray.continue_from(origin, outcome.direction),
            throughput,
            media: outcome.media,
            wavelength: outcome.wavelength,
            bounces: branch.bounces + 1,
            travelled: branch.travelled + arrival.hit.t,
            key: outcome.extend_key(branch.key),
            main,
            scattered: branch.scattered.map(|s| Scattered { straight: false, ..s }),
            trail: branch.trail,
        };
        self.extend(&mut next, Bounce::Specular);
        self.stack.push(next);
    }

    /// Whether rays that meet a light by chance are what computes the caustics.
    #[inline]
    pub(super) fn goes_backward(&self) -> bool {
        self.context.plan.caustics == Some(Caustics::Backward)
    }

    /// Puts a ray that leaves a D onto the stack.
    pub(super) fn go_on(&mut self, branch: Branch) {
        self.stack.push(branch);
    }

    /// A ray that meets nothing sees the environment. After a D and an S that is the photons' part, if there are any; after a D alone
    /// it is the scattered rays' only where highlights are sharp.
    fn escape(&mut self, branch: &Branch, sums: &mut PixelSums) {
        let (environment, direction) = (&self.context.scene.environment, branch.ray.direction);
        let radiance = environment.radiance(direction);
        let (class, weight) = match branch.scattered {
            None => (PathClass::Emitted, 1.0),
            Some(Scattered { straight: true, pdf: Some(pdf), count, .. }) => {
                let weight = power_heuristic(pdf, environment_density(environment, direction));
                (PathClass::with_light_after(count), weight)
            }
            Some(Scattered { straight: false, count, .. }) if self.goes_backward() => {
                (PathClass::with_caustic_after(count), 1.0)
            }
            Some(_) => return,
        };
        self.add(branch, class, (self.pictures_of_environment(branch, class), radiance * weight), sums);
    }
}
