//! Pass 2, `S*E`: from the eye through mirrors and glass to every D or emitter; there the three classes
//! are added up.
//!
//! At glass both ways are followed while both are strong; a weak branch is picked by chance instead, and a
//! very weak one plays roulette, so that a scene of many glass balls costs rays in proportion to what they
//! still add.

use super::EyeContext;
use super::direct::{Receiver, direct_light};
use super::footprint::view_code;
use crate::film::PixelSums;
use crate::geometry::{Hit, Ray, offset_origin};
use crate::light_path::PathClass;
use crate::optics::{self, Event, Interaction, Outcome};
use crate::photon_map::Lookup;
use crate::sampling::SamplePoint;
use crate::scene::{Material, Texture};
use glam::{Vec2, Vec3};

/// Both ways are followed while each still carries this share of the pixel.
const SPLIT_ABOVE: f32 = 0.02;

/// A branch that carries less plays roulette.
const ROULETTE_BELOW: f32 = 0.01;

/// More S than this end the walk: between two mirrors of reflectance 0.95 it then carries 3 %.
const MAX_BOUNCES: u32 = 64;

/// Sobol dimensions 0 and 1 place the sample in the pixel, 2 to 5 light the D; then two per S.
const FIRST_EVENT_DIMENSION: u32 = 6;

/// The lens is drawn from these two dimensions of the sample itself; D and S draw from its branches.
const LENS_DIMENSION: u32 = 14;

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
    /// Branches ended by the bounce limit.
    pub cut: u64,
}

impl EyeCounts {
    /// Adds another's counts.
    pub fn add(&mut self, other: &Self) {
        self.eye_rays += other.eye_rays;
        self.shadow_rays += other.shadow_rays;
        self.lookups += other.lookups;
        self.cut += other.cut;
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
    context: &'a EyeContext<'a>,
    /// Radius of the density estimate in pixels.
    kernel_pixels: f32,
    stack: Vec<Branch>,
    /// The eye sample that is being followed.
    half: usize,
    sample: SamplePoint,
    lookups: Lookups,
    view: Option<u32>,
    /// When it is followed, and whether it adds light straight from the lights.
    time: f32,
    direct: bool,
    pub(super) counts: EyeCounts,
}

/// A ray on its way from the eye.
#[derive(Clone, Copy)]
struct Branch {
    ray: Ray,
    throughput: Vec3,
    /// Absorption coefficient of what the ray goes through.
    absorption: Vec3,
    bounces: u32,
    /// Length of the way from the eye.
    travelled: f32,
    /// Which ways were taken: one bit per S, after a leading 1.
    key: u64,
    /// The eye's main way: refracted where it can be, and never by chance.
    main: bool,
}

impl<'a> EyeWalk<'a> {
    pub(super) fn new(context: &'a EyeContext<'a>) -> Self {
        let kernel_pixels = context.plan.radius.pixels(context.round) as f32;
        let sample = SamplePoint::new(0, 0);
        Self {
            context,
            kernel_pixels,
            stack: Vec::new(),
            half: 0,
            sample,
            lookups: Lookups::Nowhere,
            view: None,
            time: 0.0,
            direct: true,
            counts: EyeCounts::default(),
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
        self.time = self.sample.get(TIME_DIMENSION);
        self.trace(raster, sums);
        let Some(time) = photon_time else { return };
        let mut then = PixelSums::default();
        (self.lookups, self.time, self.direct) = (lookups, time, false);
        self.trace(raster, &mut then);
        self.direct = true;
        let caustic = then.halves[self.half].classes.get(PathClass::Caustic);
        sums.halves[self.half].classes.add(PathClass::Caustic, caustic);
    }

    /// Adds what arrives along one eye ray to the classes' sums.
    pub(super) fn trace(&mut self, raster: Vec2, sums: &mut PixelSums) {
        let camera = &self.context.scene.camera;
        let ray = match camera.lens() {
            Some(lens) => camera.ray_through(lens, raster, self.sample.get_2d(LENS_DIMENSION)),
            None => camera.ray(raster),
        };
        self.stack.clear();
        self.stack.push(Branch {
            ray: ray.at_time(self.time),
            throughput: Vec3::ONE,
            absorption: Vec3::ZERO,
            bounces: 0,
            travelled: 0.0,
            key: 1,
            main: true,
        });
        while let Some(branch) = self.stack.pop() {
            self.follow(branch, sums);
        }
    }

    fn follow(&mut self, mut branch: Branch, sums: &mut PixelSums) {
        let scene = self.context.scene;
        self.counts.eye_rays += 1;
        let Some(hit) = scene.geometry.closest_hit(&branch.ray) else {
            let throughput = branch.throughput * optics::transmittance(branch.absorption, f32::INFINITY);
            sums.halves[self.half].classes.add(PathClass::Emitted, throughput * scene.environment);
            return;
        };
        let material = scene.material_of(hit.object);
        let direction = branch.ray.direction;
        branch.absorption = optics::absorption_before(material, direction, &hit.surface, branch.absorption);
        branch.throughput *= optics::transmittance(branch.absorption, hit.t);
        match material {
            Material::Diffuse { albedo } => self.arrive(&branch, &hit, albedo, sums),
            Material::Mirror { .. } | Material::Metal(_) | Material::Glass { .. } => {
                if let Some(interaction) = optics::interact(material, direction, &hit.surface) {
                    self.scatter(&branch, &hit, &interaction);
                }
            }
        }
    }

    /// Puts the ways that leave an S onto the stack.
    fn scatter(&mut self, branch: &Branch, hit: &Hit, interaction: &Interaction) {
        if branch.bounces >= MAX_BOUNCES {
            self.counts.cut += 1;
            return;
        }
        let dimension = FIRST_EVENT_DIMENSION + 2 * branch.bounces;
        match (interaction.reflected, interaction.refracted) {
            (Some(a), Some(b)) => {
                let weight = |o: &Outcome| (branch.throughput * o.fraction).max_element();
                if weight(&a).min(weight(&b)) >= SPLIT_ABOVE {
                    self.push(branch, hit, &b, 1.0, branch.main);
                    self.push(branch, hit, &a, 1.0, false);
                    return;
                }
                let share = weight(&a) / (weight(&a) + weight(&b));
                let u = self.sample.branch(branch.key).get(dimension);
                let (outcome, probability) = if u < share { (a, share) } else { (b, 1.0 - share) };
                let main = branch.main && outcome.event == Event::Refraction;
                self.push(branch, hit, &outcome, probability, main);
            }
            (Some(only), None) | (None, Some(only)) => self.push(branch, hit, &only, 1.0, branch.main),
            (None, None) => {}
        }
    }

    fn push(&mut self, branch: &Branch, hit: &Hit, outcome: &Outcome, probability: f32, main: bool) {
        let mut throughput = branch.throughput * outcome.fraction * (outcome.radiance_scale / probability);
        let strength = throughput.max_element();
        if strength < ROULETTE_BELOW {
            let survival = strength / ROULETTE_BELOW;
            let u = self.sample.branch(branch.key).get(FIRST_EVENT_DIMENSION + 2 * branch.bounces + 1);
            if u >= survival {
                return;
            }
            throughput /= survival;
        }
        let surface = &hit.surface;
        let origin = offset_origin(surface.point, surface.error, surface.normal, outcome.direction);
        let material = self.context.scene.material_of(hit.object);
        self.stack.push(Branch {
            ray: branch.ray.continue_from(origin, outcome.direction),
            throughput,
            absorption: optics::absorption_after(material, outcome, surface, branch.absorption),
            bounces: branch.bounces + 1,
            travelled: branch.travelled + hit.t,
            key: outcome.extend_key(branch.key),
            main,
        });
    }

    /// At a D: what it emits, the direct light and the photons.
    fn arrive(&mut self, branch: &Branch, hit: &Hit, albedo: &Texture, sums: &mut PixelSums) {
        let scene = self.context.scene;
        let backside = branch.ray.direction.dot(hit.surface.normal) > 0.0;
        if let Some(light) = scene.objects[hit.object.index()].emitter
            && !backside
            && let Some(radiance) = scene.lights[light.index()].surface_radiance()
        {
            sums.halves[self.half].classes.add(PathClass::Emitted, branch.throughput * radiance);
        }
        let albedo = albedo.eval(hit.surface.uv);
        if albedo == Vec3::ZERO {
            return;
        }
        // Radiance leaving a Lambertian surface is albedo / π times its irradiance.
        let weight = branch.throughput * albedo / std::f32::consts::PI;
        let normal = if backside { -hit.surface.normal } else { hit.surface.normal };
        let receiver =
            Receiver { surface: &hit.surface, normal, absorption: branch.absorption, time: branch.ray.time };
        let sample = self.sample.branch(branch.key);
        if self.direct {
            let direct = direct_light(scene, &receiver, sample, &mut self.counts.shadow_rays);
            sums.halves[self.half].classes.add(PathClass::Direct, weight * direct);
        }
        let footprint = branch.main && self.view == Some(view_code(hit.sheet, branch.key));
        if footprint {
            sums.gain += weight;
        }
        match self.lookups {
            Lookups::Nowhere => {}
            Lookups::OffFootprint if footprint => {}
            Lookups::OffFootprint | Lookups::Everywhere => {
                let caustic = self.look_up(branch, hit, normal);
                sums.halves[self.half].classes.add(PathClass::Caustic, weight * caustic);
            }
        }
    }

    /// Irradiance by density estimation around the point, with a kernel of about a pixel.
    fn look_up(&mut self, branch: &Branch, hit: &Hit, normal: Vec3) -> Vec3 {
        let Some(photons) = self.context.photons else { return Vec3::ZERO };
        let radius = self.context.scene.camera.pixel_width(branch.travelled + hit.t) * self.kernel_pixels;
        let point = hit.surface.point;
        let lookup = Lookup { point, normal, sheet: hit.sheet, radius };
        self.counts.lookups += 1;
        let irradiance = photons.maps[self.half].irradiance(&lookup).value;
        if irradiance == Vec3::ZERO {
            return irradiance;
        }
        irradiance / self.context.scene.geometry.kernel_mass(hit.sheet, point, radius, branch.ray.time)
    }
}
