//! The plan for what is seen, and how: colour, time, lens, the structure over the primitives, light beyond the first D.

use super::{LightTree, Plan};
use crate::light_path::PathClass;
use crate::scene::{LightSampling, Material, Paths, Scene};

/// Up to so many lights are each asked at every D.
const MOST_ASKED: usize = 16;

impl Plan {
    /// All lights, or a few of them by a tree.
    pub(super) fn decide_selection(&mut self, scene: &Scene, lit: usize) {
        let few = lit <= MOST_ASKED;
        if few || scene.render.light_sampling != LightSampling::Sobol {
            let reason = match (few, lit) {
                (_, 1) => "there is one light",
                (true, _) => "there are few lights: each is asked",
                (false, _) => "`light_sampling` asks for all of each light",
            };
            self.decide("light selection", false, "none", reason);
            return;
        }
        self.light_tree = Some(LightTree::new(scene));
        let reason =
            format!("there are {lit} lights: a few are picked at each D by what they can give there at most");
        self.decide("light selection", true, "a tree over the lights", reason);
    }

    pub(super) fn decide_lens(&mut self, scene: &Scene) {
        match scene.camera.lens() {
            Some(_) => self.decide(
                "lens",
                true,
                "one point of the lens per eye sample",
                "the camera has an aperture",
            ),
            None => self.decide("lens", false, "pinhole", "the camera has no aperture: no lens samples"),
        }
    }

    pub(super) fn decide_colour(&mut self, scene: &Scene) {
        let dispersive = |m: &Material| m.dielectric().is_some_and(|d| d.ior.is_dispersive());
        if scene.objects.iter().any(|o| dispersive(&scene.materials[o.material.index()])) {
            let reason = "only what comes through glass that disperses light gets a wavelength";
            self.decide("colour", true, "RGB, and one wavelength per chain through a prism", reason);
        } else {
            self.decide("colour", false, "RGB", "nothing disperses light: no wavelengths");
        }
    }

    pub(super) fn decide_indirect(&mut self, scene: &Scene) {
        if self.classes.contains(PathClass::Indirect) {
            let reason = match scene.render.paths {
                Paths::Complete => "`complete` asks for L(D|S)*DS*DS*E",
                _ => "there are paths with two D and more among those asked for",
            };
            self.decide(
                "indirect light",
                true,
                "paths go on from each D; what they find is smoothed over each surface",
                reason,
            );
            return;
        }
        self.decide("indirect light", false, "nothing", "the paths asked for end at the first D");
        let rough = |m: &Material| !m.is_lambertian() && !matches!(m, Material::Phong(_));
        if scene.objects.iter().any(|o| rough(&scene.materials[o.material.index()])) {
            self.warn(
                "rough_shows_lights_only",
                "rough metal and glass are a D: without `\"paths\": \"complete\"` they show lights and caustics, not other things",
            );
        }
    }

    pub(super) fn decide_time(&mut self) {
        if self.moves {
            let choice = "one moment per eye sample, one per round for its photons";
            self.decide("time", true, choice, "something moves while the shutter is open");
        } else {
            self.decide("time", false, "one instant", "nothing moves: no time samples");
        }
    }

    pub(super) fn decide_structure(&mut self, scene: &Scene) {
        let structure = scene.geometry.structure();
        let reason = scene.geometry.structure_reason();
        self.decide("structure", structure != "list", structure, reason);
    }
}
