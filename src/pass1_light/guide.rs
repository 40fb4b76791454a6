//! Pass 1: guiding, where in a window the photons that arrive come from.
//!
//! A pilot counts what each cell of the window delivers; later photons are drawn in proportion to the root mean
//! square of that, which is the density with the least variance. Cells that deliver nothing keep a small share,
//! so that nothing is ruled out and the estimate stays unbiased.

use crate::sampling::Density2d;
use glam::Vec2;

/// Cells across and down a window.
const CELLS: usize = 32;

/// Share of photons that is spread evenly.
const FLOOR: f32 = 0.05;

/// Fewer delivering photons than this make a table worse than none.
const LEAST_DELIVERING: u64 = 1000;

/// A table that promises to save less than this factor of photons is not worth its look-ups.
const LEAST_GAIN: f32 = 1.3;

/// A density over a window.
#[derive(Clone, Debug, PartialEq)]
pub struct Guide {
    density: Density2d,
    /// Gain in photons that the pilot promises.
    gain: f32,
}

/// Squared power that the pilot's photons delivered, by cell.
#[derive(Clone, Debug)]
pub(super) struct Lesson {
    squares: Vec<f32>,
    delivering: u64,
}

impl Lesson {
    pub(super) fn new() -> Self {
        Self { squares: vec![0.0; CELLS * CELLS], delivering: 0 }
    }

    /// A photon drawn at `at` delivered `power`.
    pub(super) fn delivered(&mut self, at: Vec2, power: f32) {
        let cell = |x: f32| ((x * CELLS as f32) as usize).min(CELLS - 1);
        self.squares[cell(at.y) * CELLS + cell(at.x)] += power * power;
        self.delivering += 1;
    }

    /// The table, if it is worth having.
    pub(super) fn learn(&self) -> Option<Guide> {
        if self.delivering < LEAST_DELIVERING {
            return None;
        }
        let score: Vec<f32> = (0..CELLS * CELLS).map(|i| self.around(i).sqrt()).collect();
        let (sum, squares): (f32, f32) = score.iter().fold((0.0, 0.0), |(s, q), x| (s + x, q + x * x));
        let cells = (CELLS * CELLS) as f32;
        let gain = cells * squares / (sum * sum);
        if !gain.is_finite() || gain < LEAST_GAIN {
            return None;
        }
        let density: Vec<f32> = score.iter().map(|s| (1.0 - FLOOR) * s * cells / sum + FLOOR).collect();
        Some(Guide { density: Density2d::new(CELLS, &density)?, gain })
    }

    /// Mean over the cell and its neighbours: what lies between the pilot's few photons is not lost.
    fn around(&self, cell: usize) -> f32 {
        let (x, y) = (cell % CELLS, cell / CELLS);
        let columns = x.saturating_sub(1)..(x + 2).min(CELLS);
        let rows = y.saturating_sub(1)..(y + 2).min(CELLS);
        let count = (columns.len() * rows.len()) as f32;
        rows.map(|row| self.squares[row * CELLS..][columns.clone()].iter().sum::<f32>()).sum::<f32>() / count
    }
}

impl Guide {
    /// The point of the density that a uniform point of the unit square maps to, and the density there.
    #[inline]
    #[must_use]
    pub fn warp(&self, u: Vec2) -> (Vec2, f32) {
        self.density.warp(u)
    }

    /// Gain in photons that the pilot promises.
    #[must_use]
    pub fn gain(&self) -> f32 {
        self.gain
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::SamplePoint;

    /// A window of which only one corner delivers, unevenly.
    fn guide() -> Guide {
        let mut lesson = Lesson::new();
        for i in 0..16_384 {
            let at = SamplePoint::new(1, i).get_2d(0);
            if at.x < 0.3 && at.y < 0.4 {
                lesson.delivered(at, 1.0 + at.x * 5.0);
            }
        }
        lesson.learn().expect("an eighth delivers: far more than the least gain")
    }

    /// The mean of 1/density over warped points is the area of the square: the density is a density. The
    /// tolerance is that of Sobol points over cells, 1/N.
    #[test]
    fn the_density_integrates_to_one_and_covers_everything() {
        let guide = guide();
        let n = 1 << 16;
        let mut covered = [false; 64];
        let mut mean = 0.0;
        for i in 0..n {
            let (at, density) = guide.warp(SamplePoint::new(2, i).get_2d(0));
            assert!((0.0..1.0).contains(&at.x) && (0.0..1.0).contains(&at.y) && density > 0.0);
            covered[(at.y * 8.0) as usize * 8 + (at.x * 8.0) as usize] = true;
            mean += 1.0 / f64::from(density) / f64::from(n);
        }
        assert!((mean - 1.0).abs() < 2e-3, "{mean}");
        assert!(covered.iter().all(|c| *c));
    }

    #[test]
    fn photons_go_where_they_deliver() {
        let guide = guide();
        let n = 4096;
        let hits = (0..n)
            .filter(|&i| {
                let (at, _) = guide.warp(SamplePoint::new(3, i).get_2d(0));
                at.x < 0.3 && at.y < 0.4
            })
            .count();
        assert!(hits > n as usize * 3 / 4, "{hits} of {n}");
        assert!(guide.gain() > 4.0, "{}", guide.gain());
    }

    #[test]
    fn an_even_window_and_a_dark_one_get_no_table() {
        let mut even = Lesson::new();
        (0..4096).for_each(|i| even.delivered(SamplePoint::new(1, i).get_2d(0), 1.0));
        assert_eq!(even.learn(), None);
        assert_eq!(Lesson::new().learn(), None);
    }
}
