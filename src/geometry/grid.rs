//! A uniform grid, walked cell by cell (Amanatides and Woo 1987). Kept for comparison: it is quick where the
//! primitives are spread evenly, and useless where they all lie in one cell.

use super::nearest::{Nearest, Place};
use super::{Bounds, HIT_ROUNDING, Ray};
use glam::DVec3;

/// Cells per primitive that are aimed for.
const CELLS_PER_PRIMITIVE: f64 = 4.0;
/// Most cells along an axis.
const MAX_CELLS: f64 = 512.0;
/// Most entries in cells per primitive; beyond, the cells are made larger.
const MAX_ENTRIES: usize = 32;
/// Rays from within so many diagonals of the scene walk the grid: the boxes are grown for their rounding. Rays
/// from farther away test every primitive.
const REACH: f32 = 32.0;

/// Primitives by cell.
#[derive(Debug)]
pub(super) struct Grid {
    /// Box of the scene, grown by the slack.
    min: DVec3,
    max: DVec3,
    cells: [usize; 3],
    cell_size: DVec3,
    /// Cell `i` holds `places[starts[i]..starts[i + 1]]`.
    starts: Vec<u32>,
    places: Vec<Place>,
    /// Every primitive, for rays from far away.
    all: Vec<Place>,
    bounds: Bounds,
    reach: f32,
}

impl Grid {
    /// Builds the grid over placed primitives.
    pub(super) fn build(items: &[(Place, Bounds)]) -> Self {
        let bounds = items.iter().fold(Bounds::EMPTY, |all, (_, b)| all.union(*b));
        let diagonal = 2.0 * bounds.radius();
        let reach = REACH * if diagonal.is_finite() { diagonal } else { 0.0 };
        let slack = reach * HIT_ROUNDING;
        let grown = |b: Bounds| {
            let (min, max) = (b.min - slack, b.max + slack);
            Bounds::new(min.map(f32::next_down), max.map(f32::next_up))
        };
        let whole = grown(bounds);
        let mut grid = Self {
            min: whole.min.as_dvec3(),
            max: whole.max.as_dvec3(),
            cells: [1; 3],
            cell_size: DVec3::ONE,
            starts: vec![0],
            places: Vec::new(),
            all: items.iter().map(|(place, _)| *place).collect(),
            bounds,
            reach,
        };
        if items.is_empty() {
            return grid;
        }
        let items: Vec<(Place, Bounds)> = items.iter().map(|(place, b)| (*place, grown(*b))).collect();
        grid.divide(CELLS_PER_PRIMITIVE * items.len() as f64);
        while grid.entries(&items) > MAX_ENTRIES * items.len() && grid.cells != [1; 3] {
            grid.set_cells(grid.cells.map(|n| n.div_ceil(2)));
        }
        grid.fill(&items);
        grid
    }

    /// Chooses cells that are about cubes, `wanted` of them.
    fn divide(&mut self, wanted: f64) {
        let size = self.max - self.min;
        let least = size.max_element() / MAX_CELLS;
        let side = libm::cbrt(size.max(DVec3::splat(least)).element_product() / wanted);
        let along = |axis: usize| (size[axis] / side).ceil().clamp(1.0, MAX_CELLS) as usize;
        self.set_cells([along(0), along(1), along(2)]);
    }

    fn set_cells(&mut self, cells: [usize; 3]) {
        self.cells = cells;
        self.cell_size = (self.max - self.min) / DVec3::from(cells.map(|n| n as f64));
    }

    /// The cells that a box meets, as ranges along the axes.
    fn range(&self, bounds: &Bounds) -> [std::ops::RangeInclusive<usize>; 3] {
        let (from, to) = (self.cell_of(bounds.min.as_dvec3()), self.cell_of(bounds.max.as_dvec3()));
        std::array::from_fn(|axis| from[axis]..=to[axis])
    }

    fn cell_of(&self, p: DVec3) -> [usize; 3] {
        let local = (p - self.min) / self.cell_size;
        // The cast takes what lies outside, by rounding, to the first cell.
        std::array::from_fn(|axis| (local[axis] as usize).min(self.cells[axis] - 1))
    }

    fn entries(&self, items: &[(Place, Bounds)]) -> usize {
        items.iter().map(|(_, b)| self.range(b).iter().map(|r| r.clone().count()).product::<usize>()).sum()
    }

    fn fill(&mut self, items: &[(Place, Bounds)]) {
        let mut counts = vec![0_u32; self.cells.iter().product::<usize>() + 1];
        for (_, bounds) in items {
            self.visit(bounds, |cell| counts[cell + 1] += 1);
        }
        for cell in 1..counts.len() {
            counts[cell] += counts[cell - 1];
        }
        let mut places = vec![Place::Entry(0); counts.last().copied().unwrap_or(0) as usize];
        let mut next = counts.clone();
        for (place, bounds) in items {
            self.visit(bounds, |cell| {
                places[next[cell] as usize] = *place;
                next[cell] += 1;
            });
        }
        (self.starts, self.places) = (counts, places);
    }

    fn visit(&self, bounds: &Bounds, mut visit: impl FnMut(usize)) {
        let [x, y, z] = self.range(bounds);
        for k in z {
            for j in y.clone() {
                x.clone().for_each(|i| visit(self.index([i, j, k])));
            }
        }
    }

    fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.cells[1] + j) * self.cells[0] + i
    }

    fn cell(&self, cell: [usize; 3]) -> &[Place] {
        let index = self.index(cell);
        &self.places[self.starts[index] as usize..self.starts[index + 1] as usize]
    }

    /// Finds a hit nearer than `nearest`; `test` tests one primitive.
    pub(super) fn closest(
        &self,
        ray: &Ray,
        nearest: &mut Nearest,
        mut test: impl FnMut(Place, &mut Nearest),
    ) {
        self.walk(ray, |places, leave| {
            places.iter().for_each(|place| test(*place, nearest));
            f64::from(nearest.t) < leave
        });
    }

    /// True if `test` holds for any primitive on the ray before `t_max`.
    pub(super) fn any(&self, ray: &Ray, t_max: f32, mut test: impl FnMut(Place) -> bool) -> bool {
        let mut found = false;
        self.walk(ray, |places, leave| {
            found = places.iter().any(|place| test(*place));
            found || f64::from(t_max) < leave
        });
        found
    }

    /// Visits the cells along the ray until `visit`, told where the ray leaves the cell, says that it is enough.
    fn walk(&self, ray: &Ray, mut visit: impl FnMut(&[Place], f64) -> bool) {
        let reach = (self.bounds.min - ray.origin).abs().max((self.bounds.max - ray.origin).abs());
        if self.places.is_empty() || reach.max_element() > self.reach {
            visit(&self.all, f64::INFINITY);
            return;
        }
        let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let Some(enter) = self.enter(origin, direction) else { return };
        let mut cell = self.cell_of(origin + direction * enter);
        loop {
            // Where the ray leaves the cell along each axis; computed afresh, so that nothing adds up.
            let leave: [f64; 3] = std::array::from_fn(|axis| {
                let plane = cell[axis] + usize::from(direction[axis] > 0.0);
                let t =
                    (self.min[axis] + plane as f64 * self.cell_size[axis] - origin[axis]) / direction[axis];
                if direction[axis] == 0.0 { f64::INFINITY } else { t }
            });
            let axis = if leave[0] <= leave[1] && leave[0] <= leave[2] {
                0
            } else if leave[1] <= leave[2] {
                1
            } else {
                2
            };
            if visit(self.cell(cell), leave[axis]) {
                return;
            }
            let next = if direction[axis] > 0.0 { cell[axis] + 1 } else { cell[axis].wrapping_sub(1) };
            if next >= self.cells[axis] || leave[axis] == f64::INFINITY {
                return;
            }
            cell[axis] = next;
        }
    }

    /// Where the ray enters the grid; `None` if it does not.
    fn enter(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            let (o, d) = (origin[axis], direction[axis]);
            if d == 0.0 {
                if o < self.min[axis] || o > self.max[axis] {
                    return None;
                }
                continue;
            }
            let (a, b) = ((self.min[axis] - o) / d, (self.max[axis] - o) / d);
            (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
        }
        (enter <= leave).then_some(enter)
    }

    /// The grid in words.
    pub(super) fn describe(&self) -> String {
        let [x, y, z] = self.cells;
        let most = self.starts.windows(2).map(|w| w[1] - w[0]).max().unwrap_or(0) as usize;
        let all = self.all.len();
        let share = 100 * most / all.max(1);
        format!("{x} x {y} x {z} cells; the fullest holds {most} of {all} primitives ({share} %)")
    }

    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(&self.starts[..]) + size_of_val(&self.places[..]) + size_of_val(&self.all[..])
    }
}
