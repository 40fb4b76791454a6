//! Pass 2: which pictures, the whole one and its named layers, what a ray finds is in.

use super::specular::{Branch, EyeWalk};
use crate::film::{LayerSums, PixelSums};
use crate::light_path::{Bounce, PICTURE, PathClass, Pictures};
use crate::scene::{Caustics, LightId};
use glam::Vec3;

/// What a pixel gathers for its named layers; empty if there are none.
pub(super) struct PixelLayers {
    sums: Vec<LayerSums>,
    /// Only caustics count: the sample has been followed before.
    pub(super) caustics_only: bool,
}

impl PixelLayers {
    pub(super) fn new(count: usize) -> Self {
        Self { sums: vec![LayerSums::default(); count], caustics_only: false }
    }

    pub(super) fn sums(&self) -> &[LayerSums] {
        &self.sums
    }

    /// Begins another pixel.
    pub(super) fn clear(&mut self) {
        self.sums.fill(LayerSums::default());
    }

    /// Scales what was looked up point by point, to the mean over the look-ups of a round.
    pub(super) fn average_lookups(&mut self, factor: f32) {
        self.sums.iter_mut().for_each(|layer| layer.looked_up *= factor);
    }

    /// Adds to each of the layers among `pictures`.
    #[inline]
    pub(super) fn add(&mut self, pictures: Pictures, mut to: impl FnMut(&mut LayerSums)) {
        let mut left = pictures & !PICTURE;
        while left != 0 {
            to(&mut self.sums[left.trailing_zeros() as usize - 1]);
            left &= left - 1;
        }
    }
}

impl EyeWalk<'_> {
    /// Adds radiance of a class, where a branch has come to, to the pictures that hold it.
    #[inline]
    pub(super) fn add(
        &mut self,
        branch: &Branch,
        class: PathClass,
        (pictures, radiance): (Pictures, Vec3),
        sums: &mut PixelSums,
    ) {
        let value = branch.throughput * radiance;
        let half = self.half;
        let to_footprint = branch.scattered.is_some_and(|scattered| scattered.to_footprint);
        if pictures & PICTURE != 0 {
            let sums = &mut sums.halves[half];
            if to_footprint { sums.indirect += value } else { sums.classes.add(class, value) }
        }
        if pictures & !PICTURE == 0 || (self.layers.caustics_only && class != PathClass::Caustic) {
            return;
        }
        let looked_up = class == PathClass::Caustic && self.context.plan.caustics != Some(Caustics::Backward);
        self.layers.add(pictures, |layer| {
            let sum = match class {
                _ if to_footprint => &mut layer.indirect[half],
                PathClass::Indirect => &mut layer.bounced,
                PathClass::Caustic if looked_up => &mut layer.looked_up,
                PathClass::Emitted | PathClass::Direct | PathClass::Caustic => &mut layer.sampled,
            };
            *sum += value;
        });
    }

    /// The pictures that hold light that comes straight from a light to where a ray is.
    #[inline]
    pub(super) fn pictures_of_light(&self, branch: &Branch, class: PathClass, light: LightId) -> Pictures {
        match &self.context.plan.language {
            None => self.whole(class),
            Some(language) => language.pictures(branch.trail, language.straight_from(light.index())),
        }
    }

    /// The same of the environment's.
    #[inline]
    pub(super) fn pictures_of_environment(&self, branch: &Branch, class: PathClass) -> Pictures {
        match &self.context.plan.language {
            None => self.whole(class),
            Some(language) => language.pictures(branch.trail, language.straight_from_environment()),
        }
    }

    /// The same of what glows by itself.
    #[inline]
    pub(super) fn pictures_of_glow(&self, branch: &Branch) -> Pictures {
        match &self.context.plan.language {
            None => self.whole(PathClass::Emitted),
            Some(language) => language.pictures(branch.trail, language.glow()),
        }
    }

    /// Whether light that comes straight from a light to where a ray is can be asked for.
    #[inline]
    pub(super) fn wants_lights(&self, branch: &Branch, class: PathClass) -> bool {
        match &self.context.plan.language {
            None => self.whole(class) != 0,
            Some(language) => language.any_straight(branch.trail),
        }
    }

    /// Whether paths with another D than those a ray has met can be asked for.
    #[inline]
    pub(super) fn wants_more(&self, branch: &Branch) -> bool {
        let plan = self.context.plan;
        self.goes_on
            && plan.classes.contains(PathClass::Indirect)
            && plan.language.as_ref().is_none_or(|language| language.goes_on(branch.trail))
    }

    /// Marks that a ray has met another surface.
    #[inline]
    pub(super) fn extend(&self, branch: &mut Branch, bounce: Bounce) {
        if let Some(language) = &self.context.plan.language {
            branch.trail = language.step(branch.trail, bounce);
        }
    }

    /// Where no layers are asked for and all classes are asked for as a whole or not at all.
    #[inline]
    fn whole(&self, class: PathClass) -> Pictures {
        if self.context.plan.classes.contains(class) { PICTURE } else { 0 }
    }
}
