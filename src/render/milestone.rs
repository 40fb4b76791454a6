//! Where a round looks at what it found: the error, and the effort that follows from it.

use super::Render;
use super::RenderError;
use super::control::Control;
use crate::effort::{Effort, Measured};
use crate::film::RoundFilm;
use crate::pass1_light::RoundPhotons;
use crate::pass2_eye::{self, EyeContext, EyeCounts};
use crate::picture::{Picture, PixelError};
use crate::sampling::hash;
use crate::smooth::Smoothing;

/// True for 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, …: at these numbers of rounds the error is estimated and the
/// render may stop by it. Between them the picture gains too little to be worth the estimate.
pub(crate) fn is_milestone(rounds: u32) -> bool {
    rounds.is_power_of_two() || (rounds.is_multiple_of(3) && (rounds / 3).is_power_of_two())
}

impl Render {
    /// More eye samples for the first round where its own find that they are missing: at borders and in half shadows. A
    /// whole round more, photons and all, would cost more.
    pub(super) fn look_again(
        &self,
        photons: Option<&RoundPhotons>,
        eye: &mut EyeCounts,
        control: &Control,
    ) -> Result<RoundFilm, RenderError> {
        let smoothing = Smoothing::expected(&self.smoothable);
        let errors = Picture::with_smoothing(&self.film, &self.footprints, &smoothing).errors();
        let measured = self.measured(&errors, eye);
        let effort = Effort::second_look(&measured, hash(self.scene.render.seed, u64::MAX));
        let context = EyeContext {
            scene: &self.scene,
            plan: &self.plan,
            photons,
            gathers: false,
            round: 0,
            footprints: &self.footprints,
            film: &self.film,
            effort: &effort,
        };
        let (more, counts) = pass2_eye::trace_image(&context, control)?;
        eye.add(&counts);
        Ok(more)
    }

    /// What decides on the effort.
    fn measured<'a>(&self, errors: &'a [PixelError], eye: &EyeCounts) -> Measured<'a> {
        let film = &self.film;
        let samples: Vec<u32> = film.pixels().iter().map(|p| p.samples).collect();
        let paths: Vec<u32> = film.pixels().iter().map(|p| p.paths).collect();
        let sampled: u64 = samples.iter().map(|&n| 2 * u64::from(n)).sum();
        let plain_rays = eye.eye_rays + eye.shadow_rays - eye.path_rays;
        let photon_rays: u64 = self.windows.iter().map(|t| t.rays).sum();
        let weight = film.photon_weight();
        Measured {
            errors,
            width: film.size().0,
            samples,
            paths,
            photon_weight: weight,
            rays_per_block: if weight > 0.0 { photon_rays as f32 / weight } else { 0.0 },
            rays_per_sample: plain_rays as f32 / sampled.max(1) as f32,
            rays_per_path: eye.path_rays as f32 / eye.paths.max(1) as f32,
        }
    }

    /// Estimates the error where the number of rounds is a milestone, and decides what the next rounds do.
    pub(super) fn at_milestone(&mut self) {
        if !is_milestone(self.rounds()) {
            return;
        }
        let picture = if self.even {
            Picture::unsmoothed(&self.film, &self.footprints)
        } else {
            Picture::new(&self.film, &self.footprints)
        };
        let image = picture.image();
        let errors = picture.errors_of(&image);
        let measured = self.measured(&errors, &self.eye);
        let key = hash(self.scene.render.seed, u64::from(self.rounds()));
        // A round at most doubles what was done before: no single one overruns a limit of time by far.
        let most_shift = self.plan.most_photon_shift().min(self.blocks.max(1).ilog2() + 1);
        let effort = Effort::decide(&measured, most_shift, key);
        self.effort = if self.even { effort.evened(&self.shares) } else { effort };
        self.error = Some(PixelError::bound(&errors));
        self.preview = image;
        self.smoothing = Some((self.film.rounds(), picture.into_smoothing()));
    }
}
