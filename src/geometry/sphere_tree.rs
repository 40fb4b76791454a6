//! A hierarchy of bounding spheres: a binary tree that halves the primitives along their longest extent. Kept
//! for comparison with the boxes, which fit flat and long things more closely.

use super::nearest::{Nearest, Place};
use super::{Bounds, HIT_ROUNDING, Ray};
use arrayvec::ArrayVec;
use glam::{DVec3, Vec3};

/// Most primitives in a leaf.
const LEAF: usize = 4;

/// Room for what waits while a ray walks the tree: halving gives at most 32 levels.
const STACK: usize = 40;

/// The tree, root first.
#[derive(Debug)]
pub(super) struct SphereTree {
    nodes: Vec<Node>,
    places: Vec<Place>,
    bounds: Bounds,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    center: Vec3,
    radius: f32,
    below: Below,
}

#[derive(Clone, Copy, Debug)]
enum Below {
    /// The first child follows its parent; this is the second.
    Nodes { second: u32 },
    /// A range of places.
    Places { first: u32, count: u32 },
}

impl SphereTree {
    /// Builds the tree over placed primitives.
    pub(super) fn build(items: &[(Place, Bounds)]) -> Self {
        let bounds = items.iter().fold(Bounds::EMPTY, |all, (_, b)| all.union(*b));
        let mut tree = Self { nodes: Vec::new(), places: Vec::new(), bounds };
        if !items.is_empty() {
            tree.subtree(&mut items.to_vec());
        }
        tree
    }

    fn subtree(&mut self, items: &mut [(Place, Bounds)]) {
        let bounds = items.iter().fold(Bounds::EMPTY, |all, (_, b)| all.union(*b));
        let index = self.nodes.len();
        let first = self.places.len() as u32;
        let below = Below::Places { first, count: items.len() as u32 };
        // Half an ulp each in the middle and in the radius.
        let radius = bounds.radius() * (1.0 + 4.0 * f32::EPSILON)
            + 2.0 * f32::EPSILON * bounds.center().abs().element_sum();
        self.nodes.push(Node { center: bounds.center(), radius, below });
        if items.len() <= LEAF {
            self.places.extend(items.iter().map(|(place, _)| *place));
            return;
        }
        let middles = Bounds::of(items.iter().map(|(_, b)| b.center()));
        let axis = (middles.max - middles.min).max_position();
        let half = items.len() / 2;
        items.select_nth_unstable_by(half, |a, b| a.1.center()[axis].total_cmp(&b.1.center()[axis]));
        let (low, high) = items.split_at_mut(half);
        self.subtree(low);
        self.nodes[index].below = Below::Nodes { second: self.nodes.len() as u32 };
        self.subtree(high);
    }

    /// Finds a hit nearer than `nearest`; `test` tests one primitive.
    pub(super) fn closest(
        &self,
        ray: &Ray,
        nearest: &mut Nearest,
        mut test: impl FnMut(Place, &mut Nearest),
    ) {
        self.walk(ray, |leaf| {
            leaf.iter().for_each(|place| test(*place, nearest));
            Some(nearest.t)
        });
    }

    /// True if `test` holds for any primitive on the ray before `t_max`.
    pub(super) fn any(&self, ray: &Ray, t_max: f32, mut test: impl FnMut(Place) -> bool) -> bool {
        let mut found = false;
        self.walk(ray, |leaf| {
            found = leaf.iter().any(|place| test(*place));
            (!found).then_some(t_max)
        });
        found
    }

    /// Visits leaves on the ray, near ones first as far as the tree knows. `visit` says beyond which distance
    /// nothing counts any more, or `None` to stop.
    fn walk(&self, ray: &Ray, mut visit: impl FnMut(&[Place]) -> Option<f32>) {
        let sight = Sight::new(ray, &self.bounds);
        let Some(mut index) = (!self.nodes.is_empty()).then_some(0_usize) else { return };
        let mut stack: ArrayVec<(usize, f64), STACK> = ArrayVec::new();
        let mut t_max = f64::MAX;
        loop {
            match self.nodes[index].below {
                Below::Places { first, count } => {
                    let leaf = &self.places[first as usize..(first + count) as usize];
                    let Some(limit) = visit(leaf) else { return };
                    t_max = f64::from(limit).min(f64::MAX);
                }
                Below::Nodes { second } => {
                    let mut children = [index + 1, second as usize].map(|i| (i, sight.enter(&self.nodes[i])));
                    if children[0].1 > children[1].1 {
                        children.swap(0, 1);
                    }
                    let [near, far] = children;
                    stack.extend([far, near].into_iter().filter(|(_, enter)| *enter <= t_max));
                }
            }
            let next = std::iter::from_fn(|| stack.pop()).find(|(_, enter)| *enter <= t_max);
            let Some((node, _)) = next else { return };
            index = node;
        }
    }

    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.places[..])
    }
}

/// A ray prepared for the spheres.
struct Sight {
    origin: DVec3,
    direction: DVec3,
    /// By how much spheres are grown for the rounding of hits (see [`HIT_ROUNDING`]).
    slack: f64,
}

impl Sight {
    fn new(ray: &Ray, bounds: &Bounds) -> Self {
        let reach = (bounds.min - ray.origin).abs().max((bounds.max - ray.origin).abs()).max_element();
        // The diagonal of a cube.
        let slack = 1.8 * f64::from(reach * HIT_ROUNDING);
        Self { origin: ray.origin.as_dvec3(), direction: ray.direction.as_dvec3(), slack }
    }

    /// Where the ray enters the sphere; infinite if it does not.
    fn enter(&self, node: &Node) -> f64 {
        let radius = f64::from(node.radius) + self.slack;
        let to_center = node.center.as_dvec3() - self.origin;
        let along = to_center.dot(self.direction) / self.direction.length_squared();
        let squared = radius * radius - (to_center - self.direction * along).length_squared();
        if squared < 0.0 || along + squared.sqrt() < 0.0 {
            return f64::INFINITY;
        }
        (along - squared.sqrt() - self.slack).max(0.0)
    }
}
