//! Sums over rectangles of a plane in constant time.

/// Of all values to the left and above, for every corner (Crow, summed-area tables, 1984).
pub(super) struct Sums {
    width: usize,
    height: usize,
    table: Vec<f64>,
}

impl Sums {
    /// Of values row by row.
    pub(super) fn new((width, height): (usize, usize), mut values: impl Iterator<Item = f64>) -> Self {
        let stride = width + 1;
        let mut table = vec![0.0; stride * (height + 1)];
        let (mut above, mut rows) = table.split_at_mut(stride);
        while let Some((row, below)) = rows.split_at_mut_checked(stride) {
            let mut left = 0.0;
            let corners = above.windows(2).zip(&mut row[1..]).zip(&mut values);
            for ((above, corner), value) in corners {
                left = value + left + above[1] - above[0];
                *corner = left;
            }
            (above, rows) = (row, below);
        }
        Self { width, height, table }
    }

    /// Pixels across and down.
    pub(super) fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Sum over the square of `half` pixels around a pixel, clipped to the box.
    #[inline]
    pub(super) fn around(&self, (x, y): (usize, usize), half: usize) -> f64 {
        let stride = self.width + 1;
        let (x0, y0) = (x.saturating_sub(half), y.saturating_sub(half));
        let (x1, y1) = ((x + half + 1).min(self.width), (y + half + 1).min(self.height));
        let at = |x: usize, y: usize| self.table[y * stride + x];
        at(x1, y1) - at(x0, y1) - at(x1, y0) + at(x0, y0)
    }
}
