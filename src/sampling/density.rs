//! Piecewise constant densities over the unit square: drawing from a table of weights.

use glam::Vec2;

/// A density over the unit square that is constant within each cell of a grid, as cumulative sums by row and within
/// rows. The sums are of 64 bits, so that the weak cells of a table with a sun in it keep their share.
#[derive(Clone, Debug, PartialEq)]
pub struct Density2d {
    columns: usize,
    by_row: Vec<f64>,
    /// For each row one sum more than it has cells.
    within_rows: Vec<f64>,
}

impl Density2d {
    /// In proportion to the weights of the cells, row after row; `None` if they do not sum to more than nothing.
    #[must_use]
    pub fn new(columns: usize, weights: &[f32]) -> Option<Self> {
        let mut by_row = vec![0.0];
        let mut within_rows = Vec::with_capacity(weights.len() + weights.len() / columns.max(1));
        let mut total = 0.0;
        for row in weights.chunks_exact(columns.max(1)) {
            let mut sum = 0.0;
            let start = within_rows.len();
            within_rows.push(0.0);
            within_rows.extend(row.iter().map(|weight| {
                sum += f64::from(*weight);
                sum
            }));
            if sum > 0.0 {
                within_rows[start..].iter_mut().for_each(|s| *s /= sum);
            }
            total += sum;
            by_row.push(total);
        }
        by_row.iter_mut().for_each(|s| *s /= total);
        (total > 0.0 && total.is_finite()).then_some(Self { columns, by_row, within_rows })
    }

    /// The point of the density that a uniform point of the unit square maps to, and the density there.
    #[inline]
    #[must_use]
    pub fn warp(&self, u: Vec2) -> (Vec2, f32) {
        let (row, y, rows_density) = invert(&self.by_row, u.y);
        let (_, x, columns_density) = invert(self.row(row), u.x);
        (Vec2::new(x, y), (rows_density * columns_density) as f32)
    }

    /// The density at a point of the unit square.
    #[must_use]
    pub fn density(&self, at: Vec2) -> f32 {
        let rows = self.by_row.len() - 1;
        let cell = |x: f32, count: usize| ((x * count as f32) as usize).min(count - 1);
        let (row, column) = (cell(at.y, rows), cell(at.x, self.columns));
        let share = |sums: &[f64], i: usize| (sums[i + 1] - sums[i]) * (sums.len() - 1) as f64;
        (share(&self.by_row, row) * share(self.row(row), column)) as f32
    }

    /// Bytes it takes in memory.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        size_of_val(&self.by_row[..]) + size_of_val(&self.within_rows[..])
    }

    #[inline]
    fn row(&self, row: usize) -> &[f64] {
        &self.within_rows[row * (self.columns + 1)..][..=self.columns]
    }
}

/// Inverts a cumulative sum: the cell, the place, and the density there.
#[inline]
fn invert(sums: &[f64], u: f32) -> (usize, f32, f64) {
    let cells = sums.len() - 1;
    let u = f64::from(u);
    let cell = sums.partition_point(|&s| s <= u).clamp(1, cells) - 1;
    let width = sums[cell + 1] - sums[cell];
    let within = ((u - sums[cell]) / width).clamp(0.0, 1.0);
    let place = (((cell as f64 + within) / cells as f64) as f32).min(1.0 - f32::EPSILON);
    (cell, place, width * cells as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::SamplePoint;

    /// One bright cell, an empty row, an empty cell.
    fn table() -> Density2d {
        Density2d::new(4, &[1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1e4, 1.0]).unwrap()
    }

    #[test]
    fn it_integrates_to_one() {
        let table = table();
        let cells = (0..12).map(|i| Vec2::new(((i % 4) as f32 + 0.5) / 4.0, ((i / 4) as f32 + 0.5) / 3.0));
        let integral: f64 = cells.map(|at| f64::from(table.density(at))).sum::<f64>() / 12.0;
        // f32 densities.
        assert!((integral - 1.0).abs() < 1e-6, "{integral}");
    }

    #[test]
    fn what_is_drawn_has_the_density_it_says() {
        let table = table();
        for i in 0..4096 {
            let (at, density) = table.warp(SamplePoint::new(1, i).get_2d(0));
            assert!(density > 0.0 && table.density(at) == density, "{at} {density}");
        }
    }

    #[test]
    fn nothing_to_draw_from_is_no_density() {
        assert_eq!(Density2d::new(2, &[0.0; 4]), None);
        assert_eq!(Density2d::new(2, &[f32::INFINITY, 0.0]), None);
        assert_eq!(Density2d::new(2, &[f32::NAN, 0.0]), None);
        assert_eq!(Density2d::new(0, &[]), None);
    }
}
