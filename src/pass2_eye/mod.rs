//! Pass 2, `…E`: rays backward from the eye; each class of paths in its own layer.

mod arrive;
mod direct;
mod footprint;
mod forward;
mod layers;
mod outline;
mod specular;
mod spread;
mod walls;

pub use footprint::{Footprint, Footprints, Sight};
pub use forward::{Connected, connect};
pub use specular::EyeCounts;
pub use spread::Irradiance;

use crate::effort::Effort;
use crate::film::{Film, PixelSums, RoundFilm, Tile};
use crate::light_path::{Kind, PICTURE, PathClass, Pictures};
use crate::pass1_light::{RoundPhotons, Spread};
use crate::photon_map::PhotonMap;
use crate::plan::Plan;
use crate::render::{Control, RenderError};
use crate::sampling::{SamplePoint, hash};
use crate::scene::{Caustics, Scene};
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use specular::{EyeWalk, Lookups};

/// Side of the square of pixels that is one unit of parallel work; neighbouring look-ups share the cache.
const TILE: u32 = 16;

/// Everything pass 2 reads.
pub struct EyeContext<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// What is computed.
    pub plan: &'a Plan,
    /// This round's photons, if pass 1 ran.
    pub photons: Option<&'a RoundPhotons>,
    /// False where eye samples are added to a round whose photons were gathered before.
    pub gathers: bool,
    /// Number of the round.
    pub round: u32,
    /// The pixels' areas on what they show.
    pub footprints: &'a Footprints,
    /// The film so far: where each pixel's sequence goes on.
    pub film: &'a Film,
    /// Which pixels get more samples.
    pub effort: &'a Effort,
}

/// Traces this round's eye samples of every pixel, in two independent halves.
///
/// # Errors
/// [`RenderError::Cancelled`], or [`RenderError::NotFinite`] with the pixel that shows it.
pub fn trace_image(
    context: &EyeContext<'_>,
    control: &Control,
) -> Result<(RoundFilm, EyeCounts), RenderError> {
    let image = context.scene.image;
    let direct = context.photons.filter(|_| context.gathers).map(|photons| {
        let half = |i: usize| seen_directly(context, &photons.spreads[i]);
        <[Vec<Seen>; 2]>::from(rayon::join(|| half(0), || half(1)))
    });
    let (across, down) = (image.width.div_ceil(TILE), image.height.div_ceil(TILE));
    let tiles = (0..across * down)
        .into_par_iter()
        // Else a thread takes many at a time, and others have nothing to do while it is at the last of them.
        .with_max_len(1)
        .map(|tile| {
            control.check()?;
            let traced = trace_tile(context, direct.as_ref(), (tile % across * TILE, tile / across * TILE));
            control.tile_done(across * down);
            traced
        })
        .collect::<Result<Vec<_>, RenderError>>()?;
    let (tiles, of_tiles): (Vec<_>, Vec<_>) = tiles.into_iter().unzip();
    let mut counts = EyeCounts::default();
    of_tiles.iter().for_each(|of_tile| counts.add(of_tile));
    Ok((RoundFilm::new(image.width, TILE, tiles), counts))
}

/// What photons bring to the pixels that see them directly, and the pictures that hold it.
type Seen = (Pictures, Irradiance);

/// One for each set of pictures that photons give to there.
fn seen_directly(context: &EyeContext<'_>, spread: &Spread) -> Vec<Seen> {
    let gather = |pick: &(dyn Fn(Kind) -> bool + Sync)| {
        Irradiance::gather(&context.scene.camera, context.footprints, spread, pick)
    };
    let Some(language) = &context.plan.language else { return vec![(PICTURE, gather(&|_| true))] };
    let trail = language.first_diffuse(0);
    let part = |&pictures: &Pictures| (pictures, gather(&|kind| language.pictures(trail, kind) == pictures));
    language.parts(trail).iter().map(part).collect()
}

fn trace_tile(
    context: &EyeContext<'_>,
    direct: Option<&[Vec<Seen>; 2]>,
    (x, y): (u32, u32),
) -> Result<(Tile, EyeCounts), RenderError> {
    let image = context.scene.image;
    let (width, height) = (TILE.min(image.width - x), TILE.min(image.height - y));
    let mut walk = EyeWalk::new(context);
    let mut pixels = Vec::with_capacity((width * height) as usize);
    let mut layers = Vec::new();
    for py in y..y + height {
        for px in x..x + width {
            let index = py as usize * image.width as usize + px as usize;
            let sums = trace_pixel((context, direct), &mut walk, (px, py), index);
            if let Some(class) = sums.not_finite() {
                return Err(RenderError::NotFinite { x: px, y: py, round: context.round, class });
            }
            pixels.push(sums);
            layers.extend_from_slice(walk.layers.sums());
        }
    }
    Ok((Tile { pixels, layers }, walk.counts))
}

/// One pixel's samples of this round in both halves. Photons are counted on the pixel's footprint; the eye
/// samples look up what the footprint does not show, at the end of side branches or where there is no footprint.
fn trace_pixel(
    (context, direct): (&EyeContext<'_>, Option<&[Vec<Seen>; 2]>),
    walk: &mut EyeWalk<'_>,
    (x, y): (u32, u32),
    index: usize,
) -> PixelSums {
    let gathers = gathers(context);
    let footprint = context.footprints.get(index);
    let lookups = match footprint {
        _ if !gathers => Lookups::Nowhere,
        None => Lookups::Everywhere,
        Some(footprint) if footprint.only_way => Lookups::Nowhere,
        Some(_) => Lookups::OffFootprint,
    };
    walk.border = gathers && context.footprints.at_border(index);
    let gathering = lookups_of_round(context.effort, lookups, walk.border);
    let before = &context.film.pixels()[index];
    let goes_on = context.plan.classes.contains(PathClass::Indirect);
    let paths = if goes_on { context.effort.paths(index) } else { 0 };
    let count = context.effort.samples(index).max(gathering).max(paths);
    let mut sums = PixelSums { samples: count, paths, ..PixelSums::default() };
    walk.counts.paths += 2 * u64::from(paths);
    walk.layers.clear();
    for half in 0..2 {
        if let (Some(footprint), Some(photons)) = (footprint, context.photons.filter(|_| gathers)) {
            let bring = &mut |pictures: Pictures, irradiance: Vec3| {
                if pictures & PICTURE != 0 {
                    sums.halves[half as usize].irradiance += irradiance;
                }
                walk.layers.add(pictures, |layer| layer.irradiance += irradiance);
            };
            match direct.filter(|_| footprint.direct) {
                Some(direct) => {
                    let seen = &direct[half as usize];
                    seen.iter().for_each(|(pictures, part)| bring(*pictures, part.get(index)));
                }
                None => {
                    on_footprint(context.plan, &photons.maps[half as usize], footprint, bring);
                    walk.counts.lookups += 1;
                }
            }
        }
        let seed = pixel_seed(context.scene.render.seed, x, y, half);
        // Those that look photons up lie anywhere in the round: a fixed place would be a fixed part of the sequence, and
        // so of the pixel.
        let turn = if gathering > 0 { hash(seed, u64::from(before.samples)) % u64::from(count) } else { 0 };
        for i in 0..count {
            let sample = next_sample(seed, before, (i, paths));
            walk.goes_on = i < paths;
            let raster = Vec2::new(x as f32, y as f32) + sample.get_2d(0);
            let looks_up = gathering > 0 && (i + turn as u32) % count < gathering;
            let lookups = if looks_up { lookups } else { Lookups::Nowhere };
            let view = footprint.map(|f| f.view);
            walk.start(half as usize, sample, lookups, view);
            if context.plan.moves {
                let photons = context.photons.filter(|_| lookups != Lookups::Nowhere);
                walk.trace_moving(raster, photons.map(|p| p.times[half as usize]), &mut sums);
            } else {
                walk.trace(raster, &mut sums);
            }
        }
    }
    if gathering > 1 {
        let share = 1.0 / gathering as f32;
        sums.average_lookups(share);
        walk.layers.average_lookups(share);
    }
    sums
}

/// Whether caustics are gathered from photons.
fn gathers(context: &EyeContext<'_>) -> bool {
    context.gathers
        && context.photons.is_some()
        && context.plan.caustics == Some(Caustics::Photons)
        && context.plan.classes.contains(PathClass::Caustic)
}

/// Sample `i` of a round's, the first of which go on as `paths`, of a pixel that had some before. Paths have a sequence of
/// their own: one of every few points of another would not be evenly spread.
fn next_sample(seed: u64, before: &PixelSums, (i, paths): (u32, u32)) -> SamplePoint {
    match i.checked_sub(paths) {
        None => SamplePoint::new(hash(seed, PATHS), before.paths.wrapping_add(i)),
        Some(other) => SamplePoint::new(seed, (before.samples - before.paths).wrapping_add(other)),
    }
}

/// Tells the sequence of the samples that go on as paths.
const PATHS: u64 = 0x009a_7475;

/// Look-ups of a pixel at a border, per half, for each of the plan's blocks that a round traces.
const BORDER_LOOKUPS: u32 = 4;

/// Most look-ups of a pixel and half in one round.
const MOST_LOOKUPS: u32 = 32;

/// Samples of a pixel and half that look photons up in a round. Rounds count by their photons: at a border, where one
/// sample meets another surface than the next, a round of many photons with a single look-up would outweigh all others.
/// (Elsewhere a second look-up of the same photons tells next to nothing: tried on a lens, moving balls and rough metal.)
fn lookups_of_round(effort: &Effort, lookups: Lookups, border: bool) -> u32 {
    match lookups {
        Lookups::Nowhere => 0,
        Lookups::Everywhere if border => (BORDER_LOOKUPS << effort.photon_shift).min(MOST_LOOKUPS),
        Lookups::Everywhere | Lookups::OffFootprint => 1,
    }
}

/// The irradiance that photons bring to a footprint, for each set of pictures that they give to.
fn on_footprint(plan: &Plan, map: &PhotonMap, footprint: &Footprint, bring: &mut impl FnMut(Pictures, Vec3)) {
    let Some(language) = &plan.language else {
        bring(PICTURE, map.flux_within(footprint) / footprint.area);
        return;
    };
    let trail = language.first_diffuse(footprint.specular);
    for &pictures in language.parts(trail) {
        let flux = map.flux_of(footprint, |kind| language.pictures(trail, kind) == pictures);
        bring(pictures, flux / footprint.area);
    }
}

fn pixel_seed(seed: u64, x: u32, y: u32, half: u32) -> u64 {
    const PASS_2: u64 = 2;
    hash(hash(hash(seed, PASS_2), u64::from(x) << 32 | u64::from(y)), u64::from(half))
}
