//! Exact shares of pixels that a triangle on the screen covers.
//!
//! Along a row of pixels, an edge of the triangle adds to every pixel on its right the height that it spans, up
//! or down, and to the pixel it crosses the part that lies on its right: the running sum of these is the area that the
//! triangle covers of each pixel.

use glam::Vec2;
use std::ops::Range;

/// Shares of one row of pixels.
#[derive(Debug, Default)]
pub(super) struct Coverage {
    /// Changes of the share from pixel to pixel.
    changes: Vec<f32>,
    /// Column of the first of them.
    left: f32,
    /// Rows between which the shape lies.
    low: f32,
    high: f32,
}

impl Coverage {
    /// Sets what shape follows; returns the columns of a screen of `width` pixels that it may cover.
    pub(super) fn start(&mut self, corners: &[Vec2; 4], width: usize) -> Range<usize> {
        let [a, b, c, d] = *corners;
        let (low, high) = (a.min(b).min(c.min(d)).floor(), a.max(b).max(c.max(d)));
        self.left = low.x;
        (self.low, self.high) = (low.y, high.y);
        self.changes.clear();
        // An edge that ends on a border of pixels also touches the next.
        self.changes.resize((high.x - low.x) as usize + 3, 0.0);
        let right = (high.x.max(0.0) as usize + 1).min(width);
        (low.x.max(0.0) as usize).min(right)..right
    }

    /// The shape's rows from `first` up to `end`.
    pub(super) fn rows(&self, first: usize, end: usize) -> Range<usize> {
        let low = self.low.max(first as f32) as usize;
        let high = (self.high.max(0.0) as usize + 1).min(end);
        low..high.max(low)
    }

    /// Forgets what was added to the row.
    pub(super) fn clear(&mut self) {
        self.changes.fill(0.0);
    }

    /// Adds `weight` times the share of each pixel of a row that a triangle covers.
    pub(super) fn add(&mut self, corners: [Vec2; 3], weight: f32, row: usize) {
        let origin = Vec2::new(self.left, row as f32);
        let [a, b, c] = corners.map(|corner| corner - origin);
        let weight = weight.copysign(weight * (b - a).perp_dot(c - a));
        self.edge(a, b, -weight);
        self.edge(b, c, -weight);
        self.edge(c, a, -weight);
    }

    /// The part of an edge between heights 0 and 1, columns counted from the shape's first.
    fn edge(&mut self, from: Vec2, to: Vec2, weight: f32) {
        let (top, bottom, weight) = if from.y <= to.y { (from, to, weight) } else { (to, from, -weight) };
        if bottom.y <= 0.0 || top.y >= 1.0 || top.y == bottom.y {
            return;
        }
        let slope = (bottom.x - top.x) / (bottom.y - top.y);
        let (y0, y1) = (top.y.max(0.0), bottom.y.min(1.0));
        let limits = (top.x.min(bottom.x).max(0.0), top.x.max(bottom.x));
        let x_at = |y: f32| (top.x + (y - top.y) * slope).clamp(limits.0, limits.1);
        let (x0, x1) = (x_at(y0), x_at(y1));
        self.span(x0.min(x1), x0.max(x1), (y1 - y0) * weight);
    }

    /// An edge from column `x0` to `x1` that spans `height`.
    fn span(&mut self, x0: f32, x1: f32, height: f32) {
        let (first, last) = (x0 as usize, x1 as usize);
        if first == last {
            let inside = 1.0 - (0.5 * (x0 + x1) - first as f32);
            self.changes[first] += height * inside;
            self.changes[first + 1] += height * (1.0 - inside);
            return;
        }
        // Area to the right of the edge, pixel by pixel; the changes are its differences.
        let per_column = height / (x1 - x0);
        let mut before = 0.0;
        for column in first..=last {
            let (enter, leave) = (x0.max(column as f32), x1.min(column as f32 + 1.0));
            // Height spanned up to here, and the area right of the edge in this pixel.
            let spanned = (enter - x0) * per_column;
            let own = (leave - enter) * per_column;
            let area = spanned + own * (column as f32 + 1.0 - 0.5 * (enter + leave));
            self.changes[column] += area - before;
            before = area;
        }
        self.changes[last + 1] += height - before;
    }

    /// The shares of the columns that [`Coverage::start`] returned.
    pub(super) fn shares(&self, columns: &Range<usize>) -> impl Iterator<Item = f32> + '_ {
        let skipped = columns.start.saturating_sub_signed(self.left as isize).min(self.changes.len());
        let mut sum: f32 = self.changes[..skipped].iter().sum();
        self.changes[skipped..].iter().map(move |change| {
            sum += change;
            sum
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Areas of clipped triangles against counting a fine grid of points in each pixel.
    #[test]
    fn shares_are_the_areas_that_a_grid_of_points_finds() {
        for case in 0..40 {
            let at =
                |d: u32| crate::sampling::SamplePoint::new(9, case).get_2d(d) * Vec2::new(9.0, 6.0) - 1.5;
            let corners = [at(0), at(2), at(4)];
            let [a, b, c] = corners;
            let mut coverage = Coverage::default();
            let columns = coverage.start(&[a, b, c, c], 6);
            for row in coverage.rows(0, 4) {
                coverage.clear();
                coverage.add(corners, 1.0, row);
                for (column, share) in columns.clone().zip(coverage.shares(&columns)) {
                    let n = 64;
                    let inside = (0..n * n).filter(|i| {
                        let p = Vec2::new((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32
                            + Vec2::new(column as f32, row as f32);
                        let s = [(a, b), (b, c), (c, a)].map(|(p0, p1)| (p1 - p0).perp_dot(p - p0) > 0.0);
                        s == [true; 3] || s == [false; 3]
                    });
                    let expected = inside.count() as f32 / (n * n) as f32;
                    // A grid of 64² points tells an area with straight borders to about 3 / 64² · 64.
                    assert!((share - expected).abs() < 0.03, "{case} {column} {row}: {share} {expected}");
                }
            }
        }
    }

    /// The shares of all pixels add up to the area.
    #[test]
    fn nothing_is_lost() {
        let corners = [Vec2::new(1.2, 0.7), Vec2::new(7.9, 2.2), Vec2::new(3.0, 5.5)];
        let [a, b, c] = corners;
        let mut coverage = Coverage::default();
        let columns = coverage.start(&[a, b, c, c], 9);
        let mut sum = 0.0;
        for row in coverage.rows(0, 9) {
            coverage.clear();
            coverage.add(corners, 1.0, row);
            sum += coverage.shares(&columns).take(columns.len()).sum::<f32>();
        }
        let area = 0.5 * (b - a).perp_dot(c - a).abs();
        assert!((sum - area).abs() < 1e-4 * area, "{sum} {area}");
    }
}
