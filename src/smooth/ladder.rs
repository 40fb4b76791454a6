//! The ladder of widths over one segment, and the choice between them.

use super::boxes::{Plane, box_sums};
use super::segment::Segment;
use super::sums::Sums;
use super::{Gathered, Sample, mean_channel};
use glam::Vec3;
use rayon::prelude::*;

/// A width of the ladder: box filters applied one after the other, each way.
#[derive(Clone, Copy, Debug)]
struct Level {
    /// Half widths of the boxes, in pixels.
    boxes: &'static [usize],
}

/// From nothing to a standard deviation of 17.6 pixels. Two boxes make a tent, which is smooth enough.
const LEVELS: [Level; 9] = [
    Level { boxes: &[] },
    Level { boxes: &[1] },
    Level { boxes: &[1, 1] },
    Level { boxes: &[2, 2] },
    Level { boxes: &[3, 3] },
    Level { boxes: &[5, 5] },
    Level { boxes: &[8, 8] },
    Level { boxes: &[13, 13] },
    Level { boxes: &[21, 21] },
];

/// How far the widest filter for photons looks, in pixels.
pub(super) const MOST_REACH: usize = 16;

/// The widths to choose from. Caustics are seldom smooth enough for the widest.
fn widths(gathered: Gathered) -> &'static [Level] {
    match gathered {
        Gathered::Photons => &LEVELS[..7],
        Gathered::Indirect => &LEVELS,
    }
}

impl Level {
    /// Variance of the filter in each direction, pixels²: (w² - 1)/12 per box of w pixels.
    fn variance(self) -> f32 {
        self.boxes.iter().map(|&b| (((2 * b + 1).pow(2) - 1) as f32) / 12.0).sum()
    }

    /// How many pixels share their noise: those that a Gaussian of this variance weighs as if alike, 4πσ².
    fn alike(self) -> f32 {
        (4.0 * std::f32::consts::PI * self.variance()).max(1.0)
    }

    fn reach(self) -> usize {
        self.boxes.iter().sum()
    }
}

/// How many pixels share the noise of one that was smoothed at this width.
pub(super) fn alike(level: u8) -> f32 {
    LEVELS[usize::from(level)].alike()
}

/// Half widths of the windows over which noise and blur are averaged, from large to small.
const WINDOWS: [usize; 5] = [48, 24, 12, 6, 4];

/// The windows to look at. Most paths find nothing: where few have found anything a small window would see no noise.
fn windows(gathered: Gathered) -> &'static [usize] {
    match gathered {
        Gathered::Photons => &WINDOWS,
        Gathered::Indirect => &WINDOWS[..3],
    }
}

/// Half width of the window over which the error of what was chosen is averaged.
const ESTIMATE: usize = 6;

/// A smaller window overrules a larger one only if it promises less than this share of its error.
const OVERRULE: f32 = 0.6;

/// The filtered segment.
pub(super) struct Ladder {
    choices: Vec<Choice>,
}

/// What was chosen for a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Choice {
    /// Smoothed irradiance.
    pub(super) irradiance: Vec3,
    /// Estimated squared error of it, mean over channels.
    pub(super) squared_error: f32,
    /// The width, as a number of the ladder.
    pub(super) level: u8,
}

/// One width: both halves filtered.
struct Filtered {
    halves: [Vec<Vec3>; 2],
    /// The filtered mask of known pixels: 0 where none is within reach.
    share: Plane<1>,
}

impl Filtered {
    fn mean(&self, i: usize) -> Vec3 {
        0.5 * (self.halves[0][i] + self.halves[1][i])
    }
}

/// What a width is estimated to cost, as sums over windows.
struct Cost {
    bias: Sums,
    noise: Sums,
}

/// What each width costs each pixel.
struct Costs<'a> {
    levels: &'a [Filtered],
    weights: &'a [f32],
    /// 1 where irradiance is known, else 0.
    mask: &'a [[f32; 1]],
}

impl Ladder {
    /// Filters the segment at every width and chooses. `floor` is the radiance below which errors count
    /// as absolute.
    pub(super) fn climb(segment: &Segment, samples: &[Sample], (gathered, floor): (Gathered, f32)) -> Self {
        let area = segment.size.0 * segment.size.1;
        let mut mask = vec![[0.0_f32]; area];
        let mut raw: [Plane<3>; 2] = [vec![[0.0; 3]; area], vec![[0.0; 3]; area]];
        for &pixel in &segment.pixels {
            let local = segment.local(pixel);
            mask[local] = known(&samples[pixel as usize]);
            for (plane, irradiance) in raw.iter_mut().zip(samples[pixel as usize].irradiance) {
                plane[local] = irradiance.to_array();
            }
        }
        let levels: Vec<Filtered> = widths(gathered)
            .par_iter()
            .with_max_len(1)
            .map(|level| filter(*level, &raw, &mask, segment.size.0))
            .collect();
        let counts = Sums::new(segment.size, mask.iter().map(|&[known]| f64::from(known)));
        let even = weights(segment, samples, before_choice(&levels, &counts), floor);
        let costs = Costs { levels: &levels, weights: &even, mask: &mask };
        let sums: Vec<Cost> = (0..levels.len())
            .into_par_iter()
            .with_max_len(1)
            .map(|level| costs.sums(level, segment.size))
            .collect();
        let mut choices = choose(&levels, (&sums, &counts, windows(gathered)), &even);
        // Errors are relative to what was chosen: beside something bright a middling width holds its light, of which a part is
        // many times the darkness there. Where nothing is smoothed a bright sample would hide its own error: it counts for no
        // more than with its neighbours.
        let chosen = |i: usize| {
            let level = usize::from(choices[i].level);
            levels[level].mean(i).min(levels[level.max(1)].mean(i))
        };
        let weights = weights(segment, samples, chosen, floor);
        estimate(&mut choices, &Costs { weights: &weights, ..costs }, &counts);
        Self { choices }
    }

    pub(super) fn choice(&self, local: usize) -> Choice {
        self.choices[local]
    }
}

/// A pixel of the mask: 1 where irradiance is known, else 0.
fn known(sample: &Sample) -> [f32; 1] {
    [f32::from(u8::from(sample.known))]
}

/// A part of the irradiance over a segment, at widths that were chosen before: filters are linear, so that parts add up to
/// the whole. `value` and `level` are by pixel of the picture; tells the result of each.
pub(super) fn filter_part(
    segment: &Segment,
    (value, samples): (&[Vec3], &[Sample]),
    level: &[u8],
    mut tell: impl FnMut(usize, Vec3),
) {
    let area = segment.size.0 * segment.size.1;
    let (mut mask, mut raw) = (vec![[0.0_f32]; area], vec![[0.0; 3]; area]);
    for &pixel in &segment.pixels {
        let local = segment.local(pixel);
        mask[local] = known(&samples[pixel as usize]);
        raw[local] = value[pixel as usize].to_array();
    }
    for (number, width) in LEVELS.iter().enumerate() {
        let chosen = || segment.pixels.iter().filter(|&&pixel| usize::from(level[pixel as usize]) == number);
        if chosen().next().is_none() {
            continue;
        }
        let share = box_sums(&mask, width.boxes, segment.size.0);
        let filtered = filter_plane(*width, &raw, &share, segment.size.0);
        chosen().for_each(|&pixel| tell(pixel as usize, filtered[segment.local(pixel)]));
    }
}

/// What irradiance errors are relative to before a width is chosen: that of a middling width; or, beside something bright, whose
/// light that width holds too, that of a narrow one, as far as it is darker by more than its noise.
fn before_choice<'a>(levels: &'a [Filtered], counts: &Sums) -> impl Fn(usize) -> Vec3 + use<'a> {
    const MIDDLING: usize = 3;
    const NARROW: usize = 1;
    /// Standard deviations of the noise that do not count.
    const CLEARLY: f32 = 3.0;
    let size = counts.size();
    let [a, b] = &levels[NARROW].halves;
    let squares = a.iter().zip(b).map(|(&a, &b)| f64::from(0.25 * mean_channel((a - b) * (a - b))));
    let squares = Sums::new(size, squares);
    let noise = |i: usize| {
        let at = (i % size.0, i / size.0);
        (squares.around(at, ESTIMATE) / counts.around(at, ESTIMATE).max(1.0)) as f32
    };
    let noise: Vec<f32> = (0..a.len()).map(noise).collect();
    move |i| {
        let (middling, narrow) = (levels[MIDDLING].mean(i), levels[NARROW].mean(i));
        let darker = mean_channel(middling - narrow).max(0.0);
        let share = 1.0 - CLEARLY * CLEARLY * noise[i] / (darker * darker).max(f32::MIN_POSITIVE);
        middling.lerp(narrow, share.max(0.0))
    }
}

/// One over the squared radiance that an error of irradiance is relative to, from smoothed irradiance; 0
/// outside the segment.
fn weights(
    segment: &Segment,
    samples: &[Sample],
    irradiance: impl Fn(usize) -> Vec3,
    floor: f32,
) -> Vec<f32> {
    let mut weights = vec![0.0; segment.size.0 * segment.size.1];
    for &pixel in &segment.pixels {
        let local = segment.local(pixel);
        let sample = &samples[pixel as usize];
        let radiance = mean_channel(sample.rest + sample.gain * irradiance(local)) + floor;
        let gain = mean_channel(sample.gain);
        weights[local] = if radiance > 0.0 { (gain / radiance).powi(2) } else { 0.0 };
    }
    weights
}

impl Costs<'_> {
    /// Unbiased estimates for a pixel, relative: of what a width blurs away beyond one two steps finer, and of the noise it
    /// leaves.
    fn at(&self, level: usize, i: usize) -> (f32, f32) {
        let weight = self.weights[i] * self.mask[i][0];
        if weight <= 0.0 {
            return (0.0, 0.0);
        }
        let finer = level.saturating_sub(2);
        let (a, b) = (self.levels[level].halves[0][i], self.levels[level].halves[1][i]);
        let (fa, fb) = (self.levels[finer].halves[0][i], self.levels[finer].halves[1][i]);
        // Blur grows with the variance of the kernel: what one step shows tells of the whole.
        let ratio = if level == 0 { 0.0 } else { LEVELS[finer].variance() / LEVELS[level].variance() };
        let whole = (1.0 - ratio).powi(-2);
        let d = a - b;
        (mean_channel((a - fa) * (b - fb)) * whole * weight, 0.25 * mean_channel(d * d) * weight)
    }

    /// Sums of the estimates of a width over windows.
    fn sums(&self, level: usize, size: (usize, usize)) -> Cost {
        let at: Vec<(f32, f32)> = (0..self.weights.len()).map(|i| self.at(level, i)).collect();
        let plane = |one: fn(&(f32, f32)) -> f32| Sums::new(size, at.iter().map(|c| f64::from(one(c))));
        Cost { bias: plane(|c| c.0), noise: plane(|c| c.1) }
    }
}

/// From large windows to small, the width with the least estimated error; one choice for every 2 × 2 pixels.
fn choose(
    levels: &[Filtered],
    (costs, counts, windows): (&[Cost], &Sums, &[usize]),
    weights: &[f32],
) -> Vec<Choice> {
    let (width, height) = counts.size();
    let widest = &levels[levels.len() - 1].halves;
    let lit = |i: usize| weights[i] > 0.0 && (widest[0][i] != Vec3::ZERO || widest[1][i] != Vec3::ZERO);
    let row_pairs: Vec<Vec<Choice>> = (0..height.div_ceil(2))
        .into_par_iter()
        .map(|pair| {
            let rows = 2 * pair..(2 * pair + 2).min(height);
            let mut choices = vec![Choice::default(); rows.len() * width];
            for x in (0..width).step_by(2) {
                let columns = x..(x + 2).min(width);
                let block = rows.clone().flat_map(|y| columns.clone().map(move |x| y * width + x));
                if !block.clone().any(lit) {
                    continue;
                }
                let level = choose_level((costs, counts, windows), (x, rows.start));
                for i in block.filter(|&i| weights[i] > 0.0) {
                    // Where nothing is known, the next width that reaches something.
                    let reaches = |&level: &usize| levels[level].share[i][0] > 0.0;
                    let level = (level..levels.len()).find(reaches).unwrap_or(level);
                    let irradiance = levels[level].mean(i);
                    choices[i - rows.start * width] =
                        Choice { irradiance, squared_error: 0.0, level: level as u8 };
                }
            }
            choices
        })
        .collect();
    row_pairs.concat()
}

/// The errors of what was chosen, averaged around each pixel: what decided on the width looked at the dearest of many
/// estimates, and would promise too large an error.
fn estimate(choices: &mut [Choice], costs: &Costs<'_>, counts: &Sums) {
    let size = counts.size();
    let at: Vec<(f32, f32)> =
        choices.iter().enumerate().map(|(i, c)| costs.at(usize::from(c.level), i)).collect();
    let bias = Sums::new(size, at.iter().map(|c| f64::from(c.0)));
    let noise = Sums::new(size, at.iter().map(|c| f64::from(c.1)));
    for (i, choice) in choices.iter_mut().enumerate().filter(|(i, _)| costs.weights[*i] > 0.0) {
        let at = (i % size.0, i / size.0);
        let around = |sums: &Sums| (sums.around(at, ESTIMATE) / counts.around(at, ESTIMATE).max(1.0)) as f32;
        choice.squared_error = (around(&bias).max(0.0) + around(&noise)) / costs.weights[i];
    }
}

/// The chosen width at a pixel.
fn choose_level((costs, counts, windows): (&[Cost], &Sums, &[usize]), at: (usize, usize)) -> usize {
    let mut chosen = 0;
    for (step, &window) in windows.iter().enumerate() {
        let mut estimates = [0.0_f32; LEVELS.len()];
        let mut bias = 0.0_f32;
        for (l, cost) in costs.iter().enumerate() {
            let near = window.max(LEVELS[l].reach());
            // Wide filters leave noise that is alike over their reach: look at several of it.
            let far = window.max(3 * LEVELS[l].reach());
            bias = bias.max((cost.bias.around(at, near) / counts.around(at, near).max(1.0)) as f32);
            estimates[l] = bias + (cost.noise.around(at, far) / counts.around(at, far).max(1.0)) as f32;
        }
        let best = (0..costs.len()).min_by(|&a, &b| estimates[a].total_cmp(&estimates[b])).unwrap_or(0);
        if step == 0 || estimates[best] < OVERRULE * estimates[chosen] {
            chosen = best;
        }
    }
    chosen
}

/// Filters both halves within the mask, and to where it reaches: sums of masked values over sums of the mask, so that nothing is lost
/// at the segment's border.
fn filter(level: Level, raw: &[Plane<3>; 2], mask: &[[f32; 1]], width: usize) -> Filtered {
    let share = box_sums(mask, level.boxes, width);
    Filtered { halves: raw.each_ref().map(|plane| filter_plane(level, plane, &share, width)), share }
}

fn filter_plane(level: Level, plane: &[[f32; 3]], share: &[[f32; 1]], width: usize) -> Vec<Vec3> {
    let sums = box_sums(plane, level.boxes, width);
    let mean = |(sum, &[share]): (&[f32; 3], &[f32; 1])| {
        if share > 0.0 { Vec3::from_array(*sum) / share } else { Vec3::ZERO }
    };
    sums.iter().zip(share).map(mean).collect()
}
