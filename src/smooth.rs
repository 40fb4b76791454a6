//! How wide caustics and indirect light are smoothed at the end: per pixel, as the two halves of the film advise.
//!
//! Photons are gathered over about a pixel, so that what is sharp stays sharp; where a caustic is smooth,
//! that leaves noise which its neighbours on the same surface could take away. So does each of the few paths that
//! find the light from other D. Each segment of the picture
//! that shows one smooth piece of surface has its irradiance filtered at a ladder of widths. Halves A and B
//! are independent, so that (A_l - A_k)(B_l - B_k) estimates what width l blurs away beyond width k and
//! (A_l - B_l)²/4 the noise it leaves, both without bias; the width with the least sum is taken, from large
//! windows to small, a smaller window overruling only where it promises clearly less error.
//!
//! The main way of the eye through mirrors and glass is smoothed only; its fainter branches stay as they are. Within a
//! pixel, irradiance and the surface's colour count as independent of each other. Pixels without footprint, through a lens,
//! on rough surfaces or where something moves, have their radiance filtered in the same way, among those whose middles show
//! the same surface.

mod boxes;
mod ladder;
mod segment;
mod sums;

use crate::film::{Film, PixelMeans};
use crate::light_path::PathClass;
use crate::pass2_eye::Footprints;
use crate::scene::Caustics;
use glam::Vec3;
use ladder::Ladder;
use rayon::prelude::*;
use segment::Segment;
use sums::Sums;

/// What smoothing does to a film.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Smoothing {
    /// To the caustics; `None` if the film holds no photons.
    pub photons: Option<Smoothed>,
    /// To the indirect light; `None` if no footprint has any.
    pub indirect: Option<Smoothed>,
}

/// What smoothing does to one kind of irradiance.
#[derive(Clone, Debug, PartialEq)]
pub struct Smoothed {
    /// Radiance to add to each pixel's layer.
    pub correction: Vec<Vec3>,
    /// Estimated squared error of the radiance that is left, mean over channels; `None` where the
    /// pixel stays as it was gathered.
    pub squared_error: Vec<Option<f32>>,
    /// The width chosen for each pixel; 0 where it stays as it was gathered.
    level: Vec<u8>,
}

impl Smoothed {
    /// For every pixel the sum of the errors that share its noise, those of the smoothed pixels within its filter's reach: as many
    /// as it holds, each the mean of those around. 0 where nothing is smoothed.
    #[must_use]
    pub fn sharing(&self, size: (usize, usize), error: impl Fn(usize) -> f32) -> Vec<f32> {
        /// Half width of the square around a pixel.
        const AROUND: usize = 6;
        let smoothed = |i: usize| self.squared_error[i].is_some();
        let plane = |value: &dyn Fn(usize) -> f64| {
            Sums::new(size, (0..self.level.len()).map(|i| if smoothed(i) { value(i) } else { 0.0 }))
        };
        let (errors, counts) = (plane(&|i| error(i).into()), plane(&|_| 1.0));
        let of = |i: usize| {
            let at = (i % size.0, i / size.0);
            let mean = errors.around(at, AROUND) / counts.around(at, AROUND);
            if smoothed(i) { ladder::alike(self.level[i]) * mean.max(0.0) as f32 } else { 0.0 }
        };
        (0..self.level.len()).into_par_iter().map(of).collect()
    }
}

/// A kind of light that is smoothed: irradiance of the pixels' footprints, or radiance of pixels without one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gathered {
    /// By photons.
    Photons,
    /// By paths that go on from the first D.
    Indirect,
}

/// Segments with fewer pixels tell too little about noise and blur.
const LEAST_PIXELS: usize = 64;

/// A pixel as smoothing sees it.
#[derive(Clone, Copy, Debug, Default)]
struct Sample {
    /// Irradiance in each half, or radiance of a pixel without footprint.
    irradiance: [Vec3; 2],
    /// Radiance per irradiance, or 1.
    gain: Vec3,
    /// Radiance of everything else.
    rest: Vec3,
    /// Radiance of everything, mean over channels.
    total: f32,
    /// Whether anything is known of the irradiance; where not, neighbours tell it.
    known: bool,
}

/// Decides the widths and filters.
#[must_use]
pub fn smooth(film: &Film, footprints: &Footprints) -> Smoothing {
    // Photons that were connected to the eye, and paths that find the caustics, are left as they are.
    let looked_up = film.caustics() == Caustics::Photons;
    let asked = film.pixels().iter().any(|pixel| pixel.paths > 0);
    if footprints.size().0 == 0 || !(looked_up || asked) {
        return Smoothing::default();
    }
    let segments = segment::segments(footprints);
    let one = |gathered| smooth_one((film, footprints), &segments, gathered);
    let (photons, indirect) = rayon::join(
        || looked_up.then(|| one(Gathered::Photons)).flatten(),
        || asked.then(|| one(Gathered::Indirect)).flatten(),
    );
    Smoothing { photons, indirect }
}

impl Smoothing {
    /// Before the first smoothing: nothing is changed, and of indirect light's noise nothing is expected to be left where it
    /// will be smoothed.
    #[must_use]
    pub fn expected(smoothable: &[bool]) -> Self {
        let indirect = smoothable.iter().any(|&s| s).then(|| Smoothed {
            correction: vec![Vec3::ZERO; smoothable.len()],
            squared_error: smoothable.iter().map(|&s| s.then_some(0.0)).collect(),
            level: vec![0; smoothable.len()],
        });
        Self { photons: None, indirect }
    }
}

/// Which pixels' footprints are on a piece of surface that is large enough to be smoothed.
#[must_use]
pub fn smoothable(footprints: &Footprints) -> Vec<bool> {
    let mut smoothable = vec![false; footprints.size().0];
    let segments = segment::segments(footprints).into_iter();
    let with_footprints = |s: &Segment| footprints.get(s.pixels[0] as usize).is_some();
    for segment in segments.filter(|s| s.pixels.len() >= LEAST_PIXELS && with_footprints(s)) {
        segment.pixels.iter().for_each(|&pixel| smoothable[pixel as usize] = true);
    }
    smoothable
}

/// `None` if there is no light of this kind.
fn smooth_one(
    (film, footprints): (&Film, &Footprints),
    segments: &[Segment],
    gathered: Gathered,
) -> Option<Smoothed> {
    let samples = samples((film, footprints), gathered);
    if samples.iter().all(|s| s.irradiance == [Vec3::ZERO; 2]) {
        return None;
    }
    // Summed in the order of the pixels, whatever the number of threads.
    let sum: f32 = samples.iter().map(|sample| sample.total).sum();
    let floor = 0.1 * sum / samples.len() as f32;
    let filtered: Vec<(Segment, Ladder)> = lit_segments(segments, &samples)
        .map(|segment| {
            let ladder = Ladder::climb(&segment, &samples, (gathered, floor));
            (segment, ladder)
        })
        .collect();
    let mut smoothed = Smoothed {
        correction: vec![Vec3::ZERO; samples.len()],
        squared_error: vec![None; samples.len()],
        level: vec![0; samples.len()],
    };
    for (segment, ladder) in &filtered {
        for &pixel in &segment.pixels {
            let sample = &samples[pixel as usize];
            let choice = ladder.choice(segment.local(pixel));
            let raw = 0.5 * (sample.irradiance[0] + sample.irradiance[1]);
            smoothed.correction[pixel as usize] = sample.gain * (choice.irradiance - raw);
            smoothed.squared_error[pixel as usize] =
                Some(choice.squared_error * mean_channel(sample.gain * sample.gain));
            smoothed.level[pixel as usize] = choice.level;
        }
    }
    Some(smoothed)
}

/// What the same widths add to a part of the irradiance, per pixel: radiance. What they add to all parts is the whole's
/// correction.
#[must_use]
pub fn smooth_part(
    (film, footprints): (&Film, &Footprints),
    (gathered, smoothed): (Gathered, &Smoothed),
    irradiance: &[Vec3],
) -> Vec<Vec3> {
    let samples = samples((film, footprints), gathered);
    let mut correction = vec![Vec3::ZERO; samples.len()];
    let segments: Vec<Segment> = lit_segments(&segment::segments(footprints), &samples).collect();
    for segment in &segments {
        ladder::filter_part(segment, (irradiance, &samples), &smoothed.level, |pixel, smooth| {
            correction[pixel] = samples[pixel].gain * (smooth - irradiance[pixel]);
        });
    }
    correction
}

/// The pieces of surface that are large enough and have light.
fn lit_segments<'a>(
    segments: &'a [Segment],
    samples: &'a [Sample],
) -> impl ParallelIterator<Item = Segment> + 'a {
    segments
        .par_iter()
        .filter(|segment| segment.pixels.len() >= LEAST_PIXELS)
        .filter_map(|segment| segment.near(ladder::MOST_REACH, |i| samples[i].irradiance != [Vec3::ZERO; 2]))
        .filter(|segment| segment.pixels.len() >= LEAST_PIXELS)
}

fn samples((film, footprints): (&Film, &Footprints), gathered: Gathered) -> Vec<Sample> {
    let sample = |(i, means)| Sample::of(&means, (gathered, footprints.get(i).is_some()));
    film.means().enumerate().map(sample).collect()
}

impl Sample {
    fn of(means: &PixelMeans, (gathered, footprint): (Gathered, bool)) -> Self {
        let radiance = |class| [0, 1].map(|half| means.halves[half].get(class));
        let (irradiance, gain, known) = match (gathered, footprint) {
            (Gathered::Photons, true) => (means.irradiance, means.gain, true),
            (Gathered::Photons, false) => (radiance(PathClass::Caustic), Vec3::ONE, true),
            (Gathered::Indirect, true) => {
                (means.indirect.unwrap_or_default(), means.gain, means.indirect.is_some())
            }
            (Gathered::Indirect, false) => (radiance(PathClass::Indirect), Vec3::ONE, true),
        };
        let total = means.total();
        let rest = total - gain * 0.5 * (irradiance[0] + irradiance[1]);
        Self { irradiance, gain, rest: rest.max(Vec3::ZERO), total: mean_channel(total), known }
    }
}

fn mean_channel(v: Vec3) -> f32 {
    v.element_sum() / 3.0
}
