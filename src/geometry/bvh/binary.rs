//! The binary tree that the hierarchy is cut from: top-down by the surface area heuristic over bins (Wald 2007).
//!
//! It takes O(n log n) also for equal and nested primitives, where builders that merge upwards become quadratic
//! and as deep as there are primitives.

use super::super::Bounds;
use glam::Vec3A;

/// Bins along each axis.
const BINS: usize = 16;
/// So few primitives are halved: they mostly end in one packet, and bins cost more than they have to tell.
const HALVE_COUNT: usize = 8;
/// From this depth on primitives are halved by their order.
const HALVE_DEPTH: u32 = 64;

/// Nodes, each before those below it, the root first.
pub(super) struct BinaryTree {
    pub(super) nodes: Vec<BinaryNode>,
    /// Numbers of the primitives, in the order of the leaves.
    pub(super) order: Vec<u32>,
}

pub(super) struct BinaryNode {
    pub(super) bounds: Bounds,
    /// First of its primitives in the order, and how many there are.
    pub(super) first: u32,
    pub(super) count: u32,
    /// Index of the first of two successive children; 0 for a leaf, which has one primitive.
    below: u32,
}

impl BinaryNode {
    pub(super) fn children(&self) -> Option<[usize; 2]> {
        (self.below != 0).then(|| [self.below as usize, self.below as usize + 1])
    }
}

/// A primitive while the tree is built.
#[derive(Clone, Copy)]
struct Item {
    bounds: Bounds,
    number: u32,
}

impl BinaryTree {
    /// Builds the tree over at least one box.
    pub(super) fn build(bounds: &[Bounds]) -> Self {
        let mut items: Vec<Item> =
            bounds.iter().zip(0..).map(|(&bounds, number)| Item { bounds, number }).collect();
        let mut nodes = Vec::with_capacity(2 * items.len());
        nodes.push(node(&items, 0));
        let mut waiting = vec![(0, 0)];
        while let Some((index, depth)) = waiting.pop() {
            let BinaryNode { first, count, .. } = nodes[index];
            if count == 1 {
                continue;
            }
            let range = &mut items[first as usize..(first + count) as usize];
            let middle = if depth < HALVE_DEPTH { split(range) } else { range.len() / 2 };
            let below = nodes.len();
            nodes[index].below = below as u32;
            nodes.push(node(&range[..middle], first));
            nodes.push(node(&range[middle..], first + middle as u32));
            waiting.extend([(below + 1, depth + 1), (below, depth + 1)]);
        }
        Self { nodes, order: items.into_iter().map(|item| item.number).collect() }
    }
}

/// A box in registers: all axes are joined at once.
#[derive(Clone, Copy)]
struct WideBounds {
    min: Vec3A,
    max: Vec3A,
}

impl WideBounds {
    const EMPTY: Self = Self { min: Vec3A::INFINITY, max: Vec3A::NEG_INFINITY };

    #[inline]
    fn new(bounds: &Bounds) -> Self {
        Self { min: bounds.min.into(), max: bounds.max.into() }
    }

    #[inline]
    fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    #[inline]
    fn include(self, point: Vec3A) -> Self {
        Self { min: self.min.min(point), max: self.max.max(point) }
    }

    #[inline]
    fn center(self) -> Vec3A {
        (self.min + self.max) * 0.5
    }

    fn narrow(self) -> Bounds {
        Bounds::new(self.min.into(), self.max.into())
    }
}

fn node(items: &[Item], first: u32) -> BinaryNode {
    let all = items.iter().fold(WideBounds::EMPTY, |all, item| all.union(WideBounds::new(&item.bounds)));
    let bounds = all.narrow();
    BinaryNode { bounds, first, count: items.len() as u32, below: 0 }
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: WideBounds,
    count: u32,
}

impl Bin {
    const EMPTY: Self = Self { bounds: WideBounds::EMPTY, count: 0 };

    fn add(&mut self, other: Self) {
        self.bounds = self.bounds.union(other.bounds);
        self.count += other.count;
    }

    fn cost(&self) -> f32 {
        if self.count == 0 { 0.0 } else { self.bounds.narrow().half_area() * self.count as f32 }
    }
}

/// Which bin of each axis a box falls into.
struct Binning {
    least: Vec3A,
    scale: Vec3A,
}

impl Binning {
    fn new(items: &[Item]) -> Self {
        let middle = |item: &Item| WideBounds::new(&item.bounds).center();
        let middles = items.iter().fold(WideBounds::EMPTY, |all, item| all.include(middle(item)));
        let size = middles.max - middles.min;
        // Just less than one bin more than there are, so that the greatest falls into the last.
        let scale = Vec3A::splat(BINS as f32 * (1.0 - 2.0 * f32::EPSILON)) / size;
        Self {
            least: middles.min,
            scale: Vec3A::select(size.cmpgt(Vec3A::ZERO) & scale.is_finite_mask(), scale, Vec3A::ZERO),
        }
    }

    #[inline]
    fn bins(&self, bounds: WideBounds) -> [usize; 3] {
        let at = (bounds.center() - self.least) * self.scale;
        at.to_array().map(|x| (x as usize).min(BINS - 1))
    }
}

/// Reorders the items into two parts, neither empty, and returns the size of the first.
fn split(items: &mut [Item]) -> usize {
    if items.len() <= HALVE_COUNT {
        return halve(items);
    }
    let binning = Binning::new(items);
    let mut bins = [[Bin::EMPTY; BINS]; 3];
    for item in items.iter() {
        let bounds = WideBounds::new(&item.bounds);
        let at = binning.bins(bounds);
        for axis in 0..3 {
            bins[axis][at[axis]].add(Bin { bounds, count: 1 });
        }
    }
    let best = (0..3).filter_map(|axis| best_plane(&bins[axis]).map(|(cost, plane)| (cost, axis, plane)));
    let Some((_, axis, plane)) = best.min_by(|a, b| a.0.total_cmp(&b.0)) else { return items.len() / 2 };
    partition(items, |item| binning.bins(WideBounds::new(&item.bounds))[axis] < plane)
}

/// Halves a few items along the longest extent of their middles.
fn halve(items: &mut [Item]) -> usize {
    let half = items.len() / 2;
    let middles = Bounds::of(items.iter().map(|item| item.bounds.center()));
    let axis = (middles.max - middles.min).max_position();
    let key = |item: &Item| item.bounds.center()[axis];
    items.sort_unstable_by(|a, b| key(a).total_cmp(&key(b)).then(a.number.cmp(&b.number)));
    half
}

/// The cheapest place to cut a row of bins; `None` if all is in one bin.
fn best_plane(bins: &[Bin; BINS]) -> Option<(f32, usize)> {
    let mut right_costs = [0.0; BINS];
    let mut right = Bin::EMPTY;
    for plane in (1..BINS).rev() {
        right.add(bins[plane]);
        right_costs[plane] = right.cost();
    }
    let all = right.count + bins[0].count;
    let mut left = Bin::EMPTY;
    let mut best = None;
    for plane in 1..BINS {
        left.add(bins[plane - 1]);
        let cost = left.cost() + right_costs[plane];
        if left.count > 0 && left.count < all && best.is_none_or(|(least, _)| cost < least) {
            best = Some((cost, plane));
        }
    }
    best
}

/// Brings the items for which `first` holds to the front and returns how many they are.
fn partition(items: &mut [Item], first: impl Fn(&Item) -> bool) -> usize {
    let mut end = 0;
    for index in 0..items.len() {
        if first(&items[index]) {
            items.swap(index, end);
            end += 1;
        }
    }
    end
}
