//! The hierarchy of boxes: eight children to a node, all tested at once.

mod binary;
mod collapse;

use super::leaves::{Child, Leaves, Run, Word};
use super::nearest::Nearest;
use super::packet::{LaneRay, ShearedRay};
use super::simd::{Column, Kernel, Lanes, dispatch};
use super::{Bounds, HIT_ROUNDING, Ray};
use arrayvec::ArrayVec;
use glam::Vec3A;

/// Deepest hierarchy that is built.
const MAX_DEPTH: usize = 36;

/// Room for all that waits while a ray walks the hierarchy: seven children on each level, and the root.
const STACK: usize = 7 * MAX_DEPTH + 4;

/// A hierarchy over the primitives of a scene.
#[derive(Debug)]
pub(super) struct Bvh {
    nodes: Vec<Node>,
    root: Option<Word>,
    bounds: Bounds,
}

/// Eight boxes and what is in them.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
struct Node {
    /// Least and greatest x, then y, then z; an empty interval where there is no child.
    planes: [Column; 6],
    children: [Word; 8],
}

impl Bvh {
    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(&self.nodes[..])
    }

    /// Finds a hit nearer than `nearest`. `others` tests a run of primitives that are not triangles.
    #[inline]
    pub(super) fn closest(
        &self,
        leaves: &Leaves,
        ray: &Ray,
        nearest: &mut Nearest,
        others: impl FnMut(Run, &mut Nearest),
    ) {
        dispatch(Closest { bvh: self, leaves, ray, nearest, others });
    }

    /// True if anything is hit before `t_max`.
    #[inline]
    pub(super) fn any(
        &self,
        leaves: &Leaves,
        ray: &Ray,
        t_max: f32,
        others: impl FnMut(Run) -> bool,
    ) -> bool {
        dispatch(Any { bvh: self, leaves, ray, t_max, others })
    }
}

/// A ray prepared for the boxes.
struct Slabs<L: Lanes> {
    /// The origin moved against the planes that the ray enters by, and its reciprocal direction.
    enter: [L::F; 3],
    /// The origin moved towards the planes that the ray leaves by.
    leave: [L::F; 3],
    inverse: [L::F; 3],
    /// Which planes are entered and left.
    enter_plane: [usize; 3],
    zero: L::F,
}

impl<L: Lanes> Slabs<L> {
    #[inline(always)]
    fn new(lanes: L, ray: &Ray, bounds: &Bounds) -> Self {
        let (origin, direction) = (Vec3A::from(ray.origin), Vec3A::from(ray.direction));
        let (min, max) = (Vec3A::from(bounds.min), Vec3A::from(bounds.max));
        let reach = (min - origin).abs().max((max - origin).abs()).max_element();
        // Rounding the sum, by half an ulp, must not undo it.
        let slack = Vec3A::splat(reach * HIT_ROUNDING) + origin.abs() * f32::EPSILON;
        let (above, below) = (origin + slack, origin - slack);
        let inverse = Vec3A::ONE / direction;
        // Without branches, as which way a ray runs is hard to predict.
        let backwards = inverse.cmplt(Vec3A::ZERO);
        let enter = Vec3A::select(backwards, below, above).to_array();
        let leave = Vec3A::select(backwards, above, below).to_array();
        let (inverse, backwards) = (inverse.to_array(), backwards.bitmask());
        let mut slabs = Self {
            enter: [lanes.splat(0.0); 3],
            leave: [lanes.splat(0.0); 3],
            inverse: [lanes.splat(0.0); 3],
            enter_plane: [0; 3],
            zero: lanes.splat(0.0),
        };
        for axis in 0..3 {
            slabs.enter[axis] = lanes.splat(enter[axis]);
            slabs.leave[axis] = lanes.splat(leave[axis]);
            slabs.inverse[axis] = lanes.splat(inverse[axis]);
            slabs.enter_plane[axis] = (backwards >> axis & 1) as usize;
        }
        slabs
    }

    /// Which children the ray meets no later than `t_max`, and where it enters them.
    #[inline(always)]
    fn meets(&self, lanes: L, node: &Node, t_max: L::F) -> (u32, L::F) {
        let [x, y, z] = self.enter_plane;
        let [x0, y0, z0] = [&node.planes[x & 1], &node.planes[2 + (y & 1)], &node.planes[4 + (z & 1)]];
        let [x1, y1, z1] =
            [&node.planes[x & 1 ^ 1], &node.planes[2 + (y & 1 ^ 1)], &node.planes[4 + (z & 1 ^ 1)]];
        let enter = Self::later(lanes, self.at(lanes, x0, self.enter[0], 0), self.zero);
        let enter = Self::later(lanes, self.at(lanes, y0, self.enter[1], 1), enter);
        let enter = Self::later(lanes, self.at(lanes, z0, self.enter[2], 2), enter);
        let leave = Self::sooner(lanes, self.at(lanes, x1, self.leave[0], 0), t_max);
        let leave = Self::sooner(lanes, self.at(lanes, y1, self.leave[1], 1), leave);
        let leave = Self::sooner(lanes, self.at(lanes, z1, self.leave[2], 2), leave);
        (lanes.at_most(enter, leave), enter)
    }

    #[inline(always)]
    fn at(&self, lanes: L, plane: &Column, origin: L::F, axis: usize) -> L::F {
        lanes.mul(lanes.sub(lanes.load(plane), origin), self.inverse[axis])
    }

    /// The later of two distances. The first is not a number where the ray runs within a plane, and then does
    /// not count.
    #[inline(always)]
    fn later(lanes: L, plane: L::F, other: L::F) -> L::F {
        lanes.max(plane, other)
    }

    /// The sooner of two distances, as in [`Slabs::later`].
    #[inline(always)]
    fn sooner(lanes: L, plane: L::F, other: L::F) -> L::F {
        lanes.min(plane, other)
    }
}

/// What waits to be walked, and where the ray enters it: the distance's bits, which grow with it as it is never negative,
/// above the word's. Two are put in order without a branch, which nothing could predict.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Waiting(u64);

impl Waiting {
    #[inline(always)]
    fn new(word: Word, enter: f32) -> Self {
        Self(u64::from(enter.to_bits()) << 32 | u64::from(word.bits()))
    }

    #[inline(always)]
    fn enter(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }

    #[inline(always)]
    fn word(self) -> Word {
        Word::from_bits(self.0 as u32)
    }
}

type Stack = ArrayVec<Waiting, STACK>;

/// At the start of a cache line, and with it the frame around it: the registers that are kept there then never lie
/// across two lines, wherever the caller's frame ends.
#[repr(align(64))]
struct Aligned<T>(T);

struct Closest<'a, F> {
    bvh: &'a Bvh,
    leaves: &'a Leaves,
    ray: &'a Ray,
    /// Written in place: a copy of the whole would wait for its parts.
    nearest: &'a mut Nearest,
    others: F,
}

impl<F: FnMut(Run, &mut Nearest)> Kernel for Closest<'_, F> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self, lanes: L) {
        let nearest = self.nearest;
        let Some(mut word) = self.bvh.root else { return };
        let slabs = Slabs::new(lanes, self.ray, &self.bvh.bounds);
        let sheared = ShearedRay::new(self.ray);
        let lane_ray = LaneRay::new(lanes, &sheared);
        let mut stack = Aligned(Stack::new());
        let stack = &mut stack.0;
        loop {
            match word.child() {
                Child::Node(index) => {
                    let node = &self.bvh.nodes[index];
                    let (mask, enter) = slabs.meets(lanes, node, lanes.splat(nearest.t));
                    if mask & mask.wrapping_sub(1) != 0 {
                        word = nearest_of(stack, node, mask, &lanes.store(enter)).word();
                        continue;
                    }
                    if mask != 0 {
                        word = node.children[mask.trailing_zeros() as usize % 8];
                        continue;
                    }
                }
                Child::Packet(index) => {
                    self.leaves.packets[index].closest(lanes, (&lane_ray, &sheared), index, nearest);
                }
                Child::Run(run) => (self.others)(run, nearest),
            }
            word = loop {
                match stack.pop() {
                    None => return,
                    Some(waiting) if waiting.enter() <= nearest.t => break waiting.word(),
                    Some(_) => {}
                }
            };
        }
    }
}

/// The nearest of a mask's children, of which there are two at least; pushes the others, the nearest of them last.
#[inline(always)]
fn nearest_of(stack: &mut Stack, node: &Node, mut mask: u32, enter: &Column) -> Waiting {
    let mut next = || {
        let lane = mask.trailing_zeros() as usize % 8;
        mask &= mask - 1;
        (Waiting::new(node.children[lane], enter[lane]), mask)
    };
    let in_order = |a: Waiting, b: Waiting| (a.min(b), a.max(b));
    let (a, (b, mut rest)) = (next().0, next());
    let (mut nearest, farther) = in_order(a, b);
    let base = stack.len();
    stack.push(farther);
    while rest != 0 {
        let (child, after) = next();
        rest = after;
        let farther;
        (nearest, farther) = in_order(nearest, child);
        let mut at = stack.len();
        stack.push(farther);
        while at > base && stack[at - 1] < farther {
            stack[at] = stack[at - 1];
            at -= 1;
        }
        stack[at] = farther;
    }
    nearest
}

struct Any<'a, F> {
    bvh: &'a Bvh,
    leaves: &'a Leaves,
    ray: &'a Ray,
    t_max: f32,
    others: F,
}

impl<F: FnMut(Run) -> bool> Kernel for Any<'_, F> {
    type Output = bool;

    #[inline(always)]
    fn run<L: Lanes>(mut self, lanes: L) -> bool {
        let Some(mut word) = self.bvh.root else { return false };
        let slabs = Slabs::new(lanes, self.ray, &self.bvh.bounds);
        let sheared = ShearedRay::new(self.ray);
        let lane_ray = LaneRay::new(lanes, &sheared);
        let t_max = lanes.splat(self.t_max.min(f32::MAX));
        let mut stack: ArrayVec<Word, STACK> = ArrayVec::new();
        loop {
            match word.child() {
                Child::Node(index) => {
                    let node = &self.bvh.nodes[index];
                    let (mut mask, _) = slabs.meets(lanes, node, t_max);
                    while mask & mask.wrapping_sub(1) != 0 {
                        stack.push(node.children[mask.trailing_zeros() as usize % 8]);
                        mask &= mask - 1;
                    }
                    if mask != 0 {
                        word = node.children[mask.trailing_zeros() as usize % 8];
                        continue;
                    }
                }
                Child::Packet(index) => {
                    if self.leaves.packets[index].any(lanes, (&lane_ray, &sheared), self.t_max) {
                        return true;
                    }
                }
                Child::Run(run) => {
                    if (self.others)(run) {
                        return true;
                    }
                }
            }
            let Some(next) = stack.pop() else { return false };
            word = next;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::leaves::{Primitives, Source};
    use super::super::mesh::{Mesh, MeshData};
    use super::super::simd::Portable;
    use super::*;
    use crate::sampling::{SamplePoint, uniform_sphere};
    use glam::Vec3;

    /// Triangles of all sizes and directions, some of them flat or without area.
    fn soup(count: u32) -> Primitives {
        let mut mesh = MeshData::default();
        for i in 0..count {
            let sample = SamplePoint::new(5, i);
            let at = Vec3::new(sample.get(0), sample.get(1), sample.get(2)) * 2.0 - 1.0;
            let size = 0.3 * sample.get(3) * sample.get(3);
            let first = mesh.positions.len() as u32;
            mesh.positions.extend((0..3).map(|k| {
                let p = at + uniform_sphere(SamplePoint::new(k, i).get_2d(0)) * size;
                if i.is_multiple_of(7) { p.with_y(at.y) } else { p }
            }));
            mesh.triangles.push([first, first + 1, first + if i.is_multiple_of(11) { 1 } else { 2 }]);
        }
        let sources = (0..count).map(|index| Source::Triangle { mesh: 0, index }).collect();
        Primitives { sources, meshes: vec![Mesh::new(&mesh)] }
    }

    #[test]
    fn plain_and_wide_instructions_find_the_same_bits() {
        let primitives = soup(3000);
        let bounds: Vec<Bounds> = (0..3000).map(|i| primitives.meshes[0].triangle(i).bounds()).collect();
        let mut leaves = Leaves::default();
        let bvh = Bvh::build(&bounds, &primitives, &mut leaves);
        let mut hits = 0;
        for i in 0..4000 {
            let sample = SamplePoint::new(6, i);
            let origin = Vec3::new(sample.get(0), sample.get(1), sample.get(2)) * 3.0 - 1.5;
            // Every third ray aims at a corner, every third runs along an axis.
            let direction = match i % 3 {
                0 => uniform_sphere(sample.get_2d(3)),
                1 => (primitives.meshes[0].triangle(i % 3000).0[0] - origin).normalize(),
                _ => Vec3::AXES[i as usize / 3 % 3],
            };
            let ray = &Ray::new(origin, direction);
            let (mut wide, mut plain) = (Nearest::NONE, Nearest::NONE);
            let others = |_, _: &mut Nearest| {};
            dispatch(Closest { bvh: &bvh, leaves: &leaves, ray, nearest: &mut wide, others });
            Closest { bvh: &bvh, leaves: &leaves, ray, nearest: &mut plain, others }.run(Portable);
            assert_eq!(wide.areas, plain.areas, "{i}");
            assert_eq!((wide.t.to_bits(), wide.primitive), (plain.t.to_bits(), plain.primitive), "{i}");
            let any = || Any { bvh: &bvh, leaves: &leaves, ray, t_max: 0.3, others: |_| false };
            assert_eq!(dispatch(any()), any().run(Portable), "{i}");
            assert_eq!(dispatch(any()), wide.t < 0.3, "{i}");
            hits += u32::from(wide.place.is_some());
        }
        assert!((1000..3900).contains(&hits), "{hits}");
    }
}
