//! Segments: connected pixels whose eye rays reach one smooth piece of the same surface.

use crate::pass2_eye::{Footprints, Sight};
use rayon::prelude::*;

/// Connected pixels of one smooth surface, and the box around them.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Segment {
    /// Indices of its pixels in the picture, ascending.
    pub(super) pixels: Vec<u32>,
    /// Left and top of the box.
    pub(super) origin: (usize, usize),
    /// Size of the box.
    pub(super) size: (usize, usize),
    /// Pixels across the whole picture.
    stride: usize,
}

impl Segment {
    /// A pixel's index within the box.
    pub(super) fn local(&self, pixel: u32) -> usize {
        let (x, y) = (pixel as usize % self.stride, pixel as usize / self.stride);
        (y - self.origin.1) * self.size.0 + x - self.origin.0
    }

    /// The part of the segment in the box around its lit pixels, `margin` pixels wider on each side; `None` if
    /// none is lit.
    pub(super) fn near(&self, margin: usize, lit: impl Fn(usize) -> bool) -> Option<Self> {
        let stride = self.stride;
        let at = |pixel: u32| (pixel as usize % stride, pixel as usize / stride);
        let lit: Vec<u32> = self.pixels.iter().copied().filter(|&i| lit(i as usize)).collect();
        if lit.is_empty() {
            return None;
        }
        let bright = Self::of(lit, stride);
        let low = (bright.origin.0.saturating_sub(margin), bright.origin.1.saturating_sub(margin));
        let high = (bright.origin.0 + bright.size.0 + margin, bright.origin.1 + bright.size.1 + margin);
        let inside = |&i: &u32| {
            let (x, y) = at(i);
            (low.0..high.0).contains(&x) && (low.1..high.1).contains(&y)
        };
        Some(Self::of(self.pixels.iter().copied().filter(inside).collect(), stride))
    }

    fn of(mut pixels: Vec<u32>, stride: usize) -> Self {
        pixels.sort_unstable();
        let (mut low, mut high) = ((usize::MAX, usize::MAX), (0, 0));
        for &pixel in &pixels {
            let (x, y) = (pixel as usize % stride, pixel as usize / stride);
            low = (low.0.min(x), low.1.min(y));
            high = (high.0.max(x), high.1.max(y));
        }
        Self { pixels, origin: low, size: (high.0 - low.0 + 1, high.1 - low.1 + 1), stride }
    }
}

/// Neighbours whose normals differ by more than this are on different faces (cosine of 18°).
const SAME_FACE: f32 = 0.95;

/// All segments, in the order of their first pixels. Pixels with a footprint and those without are never in one: of the first
/// it is irradiance that is filtered, of the others radiance.
pub(super) fn segments(footprints: &Footprints) -> Vec<Segment> {
    let (count, width) = footprints.size();
    let sights: Vec<Option<(bool, Sight)>> = (0..count)
        .into_par_iter()
        .map(|i| Some((footprints.get(i).is_some(), footprints.sight(i)?)))
        .collect();
    let mut seen = vec![false; count];
    let mut segments = Vec::new();
    let mut queue = Vec::new();
    for start in 0..count {
        if seen[start] || sights[start].is_none() {
            continue;
        }
        seen[start] = true;
        queue.push(start);
        let mut members = Vec::new();
        while let Some(i) = queue.pop() {
            let Some(here) = &sights[i] else { continue };
            members.push(i as u32);
            let x = i % width;
            let left = (x > 0).then(|| i - 1);
            let right = (x + 1 < width).then_some(i + 1);
            let above = i.checked_sub(width);
            let below = (i + width < count).then_some(i + width);
            for j in [left, right, above, below].into_iter().flatten() {
                if !seen[j] && sights[j].as_ref().is_some_and(|there| joined(here, there)) {
                    seen[j] = true;
                    queue.push(j);
                }
            }
        }
        segments.push(Segment::of(members, width));
    }
    segments
}

/// True if both pixels show the same smooth piece: same view, similar normals, and each in the other's
/// tangent plane up to the slope that those normals allow.
fn joined((a_footprint, a): &(bool, Sight), (b_footprint, b): &(bool, Sight)) -> bool {
    if a_footprint != b_footprint || a.view != b.view || a.normal.dot(b.normal) < SAME_FACE {
        return false;
    }
    let apart = b.point - a.point;
    let off = apart.dot(a.normal).abs().max(apart.dot(b.normal).abs());
    off <= 0.35 * apart.length()
}
