//! Pass 1, `LS+D`: photons from every light toward what is specular, through any chain of mirrors and glass,
//! to the first D.

mod emit;
mod energy;
mod guide;
mod light_image;
mod walk;
mod window;

pub use emit::Emission;
pub use energy::{Energy, Tally};
pub use guide::Guide;
pub use light_image::{LightImage, Spread};
pub use window::{Region, Source, Window, windows};

use crate::photon_map::{self, Photon, PhotonMap};
use crate::render::{Control, RenderError};
use crate::sampling::{SamplePoint, TIME_DIMENSION, hash};
use crate::scene::{ObjectId, Scene};
use guide::Lesson;
use light_image::{ImageTracer, Shot};
use rayon::prelude::*;
use std::collections::BTreeSet;
use walk::{PhotonWalk, Step};

/// Photons traced between two looks at the cancel flag; also the unit of parallel work.
const BATCH: u32 = 4096;

/// Light images traced between two looks at the cancel flag: each takes about ten times a photon's rays.
const IMAGE_BATCH: u32 = BATCH / 8;

/// A window and how many photons each round sends through it.
#[derive(Clone, Debug, PartialEq)]
pub struct Budget {
    /// Where the photons go.
    pub window: Window,
    /// Each half of a round takes a block of 2^`log2_block` points of the window's sequence.
    pub log2_block: u32,
    /// What the points of the sequence bring to pixels that see the receiver directly.
    pub carries: Carries,
}

impl Carries {
    /// The choice's name on the wire.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Points => "points",
            Self::LightImages => "light_images",
        }
    }
}

/// Light images that a point of a window gives, at most on average; their cost in memory follows.
const IMAGES_PER_POINT: u64 = 8;

impl Budget {
    /// Bytes in both halves of a round of one block: photons as traced, as entries of a tree and in the tree's arrays,
    /// which double as they grow, and light images, here and on the screen.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        (2 << self.log2_block) * Self::bytes_per_point(self.carries)
    }

    fn bytes_per_point(carries: Carries) -> u64 {
        let photon = 2 * size_of::<Photon>() as u64 + 3 * photon_map::BYTES_PER_PHOTON;
        let images = match carries {
            Carries::Points => 0,
            Carries::LightImages => 2 * IMAGES_PER_POINT * size_of::<LightImage>() as u64,
        };
        photon + images
    }

    /// The same for each photon of a round, where one with light images counts as the photons that it stands for.
    pub(crate) fn most_bytes_per_photon(photons_per_image: u64) -> u64 {
        let [points, images] = [Carries::Points, Carries::LightImages].map(Self::bytes_per_point);
        points.max(images / photons_per_image)
    }
}

/// How the light through a point of a window is spread over what pixels see directly; what they see through mirrors and
/// glass is lit by plain photons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Carries {
    /// Plain photons: one point of the light lights one point of the receiver.
    Points,
    /// The image of the whole light.
    LightImages,
}

/// The photons of one round in two independent halves, and what became of all light that was sent.
pub struct RoundPhotons {
    /// One map per half.
    pub maps: [PhotonMap; 2],
    /// The same light in few photons, where second D look it up over a wide kernel.
    pub thinned: Option<[PhotonMap; 2]>,
    /// The same light for pixels that see it directly, per half.
    pub spreads: [Spread; 2],
    /// When the photons of each half have flown.
    pub times: [f32; 2],
    /// Energy per window, summed over both halves (each half carries the window's whole flux).
    pub tallies: Vec<Tally>,
}

/// The same, before the trees are built.
pub struct RoundLists {
    /// The photons of each half.
    pub halves: [Vec<Photon>; 2],
    /// The same light for pixels that see it directly, per half.
    pub spreads: [Spread; 2],
    /// When they have flown.
    pub times: [f32; 2],
    /// As in [`RoundPhotons`].
    pub tallies: Vec<Tally>,
}

/// Which points of the windows' sequences a round takes, in blocks of the plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blocks {
    /// Blocks to leave out: earlier rounds had them. A multiple of the count.
    pub first: u32,
    /// Number of blocks, a power of two.
    pub count: u32,
    /// When the photons of each half fly: where they rest on something that moves is where it is then. Halves have
    /// times of their own, so that their difference shows also the noise of these.
    pub times: [f32; 2],
}

/// Traces a round's blocks of each window's two scrambled sequences.
///
/// # Errors
/// [`RenderError::Cancelled`] if the control says so.
pub fn emit_photons(
    scene: &Scene,
    budgets: &[Budget],
    blocks: Blocks,
    control: &Control,
) -> Result<RoundPhotons, RenderError> {
    Ok(emit_lists(scene, budgets, blocks, control)?.into_maps(None))
}

/// The same, as lists in the order of the windows and their points.
///
/// # Errors
/// [`RenderError::Cancelled`] if the control says so.
pub fn emit_lists(
    scene: &Scene,
    budgets: &[Budget],
    blocks: Blocks,
    control: &Control,
) -> Result<RoundLists, RenderError> {
    let a = emit_half(scene, budgets, blocks, 0, control)?;
    let b = emit_half(scene, budgets, blocks, 1, control)?;
    let mut tallies = a.tallies;
    for (total, tally) in tallies.iter_mut().zip(&b.tallies) {
        total.add(tally);
    }
    let (halves, spreads) = ([a.photons, b.photons], [a.spread, b.spread]);
    Ok(RoundLists { halves, spreads, times: blocks.times, tallies })
}

impl RoundLists {
    /// Builds the trees; if second D are to look photons up, those of about so few photons too, which a key picks.
    #[must_use]
    pub fn into_maps(self, thin_to: Option<(usize, u64)>) -> RoundPhotons {
        let build = |[a, b]: [Vec<Photon>; 2]| {
            <[PhotonMap; 2]>::from(rayon::join(|| PhotonMap::build(a), || PhotonMap::build(b)))
        };
        let thinned = thin_to.map(|(count, key)| {
            build([0, 1].map(|half| thin(&self.halves[half], count, hash(key, half as u64))))
        });
        let maps = build(self.halves);
        RoundPhotons { maps, thinned, spreads: self.spreads, times: self.times, tallies: self.tallies }
    }
}

/// Every n-th photon in the place of n, so that about `count` are left: in the order of their points, which keeps them
/// evenly spread; the key picks the first.
fn thin(photons: &[Photon], count: usize, key: u64) -> Vec<Photon> {
    let stride = photons.len().div_ceil(count.max(1)).max(1);
    let first = (key % stride as u64) as usize;
    let weigh = |photon: &Photon| Photon { power: photon.power * stride as f32, ..*photon };
    photons.iter().skip(first).step_by(stride).map(weigh).collect()
}

/// What one half of a round finds.
struct HalfPhotons {
    photons: Vec<Photon>,
    spread: Spread,
    tallies: Vec<Tally>,
}

fn emit_half(
    scene: &Scene,
    budgets: &[Budget],
    blocks: Blocks,
    half: u32,
    control: &Control,
) -> Result<HalfPhotons, RenderError> {
    let mut all = HalfPhotons {
        photons: Vec::new(),
        spread: Spread::default(),
        tallies: Vec::with_capacity(budgets.len()),
    };
    for (index, budget) in budgets.iter().enumerate() {
        let size = 1_u32 << budget.log2_block;
        let seed = window_seed(scene.render.seed, index, half);
        let block = Block { first: blocks.first.wrapping_mul(size), count: blocks.count * size, seed };
        let time = blocks.times[half as usize];
        let (mut found, mut tally) = trace_block_at(scene, &budget.window, (block, time), control)?;
        match budget.carries {
            Carries::Points => all.spread.points.extend_from_slice(&found),
            Carries::LightImages => {
                let (mut spread, rays) = trace_images_at(scene, &budget.window, (block, time), control)?;
                all.spread.append(&mut spread);
                tally.rays += rays;
            }
        }
        all.photons.append(&mut found);
        all.tallies.push(tally);
    }
    Ok(all)
}

/// Seed of a window's sequence for one half.
fn window_seed(seed: u64, window: usize, half: u32) -> u64 {
    const PASS_1: u64 = 1;
    hash(hash(hash(seed, PASS_1), window as u64), u64::from(half))
}

/// A run of consecutive points of one scrambled sequence.
#[derive(Clone, Copy, Debug)]
pub struct Block {
    /// Index of the first point.
    pub first: u32,
    /// Number of points, at least 1; the block as a whole carries the window's flux.
    pub count: u32,
    /// Seed that scrambles the sequence.
    pub seed: u64,
}

/// Traces a block of photons through one window when the shutter opens; the result is in the order of the points,
/// whatever the number of threads.
///
/// # Errors
/// [`RenderError::Cancelled`] if the control says so.
pub fn trace_block(
    scene: &Scene,
    window: &Window,
    block: Block,
    control: &Control,
) -> Result<(Vec<Photon>, Tally), RenderError> {
    trace_block_at(scene, window, (block, 0.0), control)
}

/// [`trace_block`] at another time.
fn trace_block_at(
    scene: &Scene,
    window: &Window,
    (block, time): (Block, f32),
    control: &Control,
) -> Result<(Vec<Photon>, Tally), RenderError> {
    let emission = Emission::new(scene, window);
    let batches = (0..block.count.div_ceil(BATCH))
        .into_par_iter()
        .with_max_len(1)
        .map(|batch| {
            control.check()?;
            let end = ((batch + 1) * BATCH).min(block.count);
            Ok(trace_batch(scene, &emission, (block, time), batch * BATCH..end))
        })
        .collect::<Result<Vec<_>, RenderError>>()?;
    let mut photons = Vec::with_capacity(batches.iter().map(|(p, _)| p.len()).sum());
    let mut tally = Tally::default();
    for (mut found, part) in batches {
        photons.append(&mut found);
        tally.add(&part);
    }
    Ok((photons, tally))
}

fn trace_batch(
    scene: &Scene,
    emission: &Emission,
    (block, time): (Block, f32),
    points: std::ops::Range<u32>,
) -> (Vec<Photon>, Tally) {
    let walk = PhotonWalk::new(scene, emission.window());
    let mut photons = Vec::with_capacity(points.len());
    let mut tally = Tally::default();
    let share = 1.0 / block.count as f32;
    for i in points {
        let sample = SamplePoint::new(block.seed, block.first.wrapping_add(i));
        tally.sent += 1;
        let Some(mut photon) = emission.sample(sample, time) else { continue };
        photon.power *= share;
        tally.energy.emitted += photon.power.as_dvec3();
        walk.trace(photon, sample, &mut tally, |step| match step {
            Step::Rests(photon) => photons.push(photon),
            Step::Meets(..) => {}
        });
    }
    (photons, tally)
}

/// Traces the images of a window's light through a block of points when the shutter opens, in the order of the points:
/// as much light as the photons of [`trace_block`] bring. Also the number of rays.
///
/// # Errors
/// [`RenderError::Cancelled`] if the control says so.
pub fn trace_images(
    scene: &Scene,
    window: &Window,
    block: Block,
    control: &Control,
) -> Result<(Spread, u64), RenderError> {
    trace_images_at(scene, window, (block, 0.0), control)
}

/// [`trace_images`] at another time.
fn trace_images_at(
    scene: &Scene,
    window: &Window,
    (block, time): (Block, f32),
    control: &Control,
) -> Result<(Spread, u64), RenderError> {
    let emission = Emission::new(scene, window);
    let walk = PhotonWalk::new(scene, window);
    let tracer = ImageTracer { emission: &emission, walk: &walk, camera: &scene.camera };
    let share = 1.0 / block.count as f32;
    let batches = (0..block.count.div_ceil(IMAGE_BATCH))
        .into_par_iter()
        .with_max_len(1)
        .map(|batch| {
            control.check()?;
            let mut spread = Spread::default();
            let mut rays = 0;
            for i in batch * IMAGE_BATCH..((batch + 1) * IMAGE_BATCH).min(block.count) {
                let sample = SamplePoint::new(block.seed, block.first.wrapping_add(i));
                let shot = Shot { sample, aim: emission.aim(sample), share, time };
                rays += tracer.trace(shot, &mut spread);
            }
            Ok((spread, rays))
        })
        .collect::<Result<Vec<_>, RenderError>>()?;
    let mut all = (Spread::default(), 0);
    for (mut spread, rays) in batches {
        all.0.append(&mut spread);
        all.1 += rays;
    }
    Ok(all)
}

/// Sends a block of pilot photons through a window, and learns where those come from that arrive, and which S they
/// meet.
#[must_use]
pub fn pilot(scene: &Scene, window: &Window, block: Block) -> (Tally, Option<Guide>, BTreeSet<ObjectId>) {
    let emission = Emission::new(scene, window);
    let walk = PhotonWalk::new(scene, window);
    let mut lesson = Lesson::new();
    let mut met = BTreeSet::new();
    let mut tally = Tally::default();
    for i in 0..block.count {
        let sample = SamplePoint::new(block.seed, block.first.wrapping_add(i));
        tally.sent += 1;
        // A table serves all rounds: it is learned over the whole time that the shutter is open.
        let time = sample.get(TIME_DIMENSION);
        let Some(mut photon) = emission.sample(sample, time) else { continue };
        photon.power /= block.count as f32;
        tally.energy.emitted += photon.power.as_dvec3();
        let mut power = 0.0;
        walk.trace(photon, sample, &mut tally, |step| match step {
            Step::Rests(photon) => power += photon.power.element_sum(),
            Step::Meets(object, _) => _ = met.insert(object),
        });
        if power > 0.0 {
            lesson.delivered(sample.get_2d(0), power);
        }
    }
    (tally, lesson.learn(), met)
}
