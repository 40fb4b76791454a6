//! Builds the hierarchy: a binary tree is cut into nodes of eight children where that is cheapest by the surface
//! area heuristic.

use super::super::Bounds;
use super::super::leaves::{Leaves, MAX_RUN, Primitives, Word};
use super::binary::BinaryTree;
use super::{Bvh, MAX_DEPTH, Node};

/// Cost of testing eight boxes, where a packet of triangles costs 1 (measured).
const NODE_COST: f32 = 1.2;
/// Cost of testing one primitive other than a triangle.
const OTHER_COST: f32 = 0.7;
/// From this depth on the tree is cut by the primitives' order instead, which is at most 11 levels deep: equal
/// or nested primitives can make the binary tree as deep as they are many.
const SPLIT_DEPTH: usize = MAX_DEPTH - 12;

impl Bvh {
    /// Builds the hierarchy and puts the primitives into `leaves` in its order.
    pub(in super::super) fn build(bounds: &[Bounds], primitives: &Primitives, leaves: &mut Leaves) -> Self {
        let mut bvh = Self {
            nodes: Vec::new(),
            root: None,
            bounds: bounds.iter().fold(Bounds::EMPTY, |a, b| a.union(*b)),
        };
        if bounds.is_empty() {
            return bvh;
        }
        let binary = BinaryTree::build(bounds);
        let costs = Costs::new(&binary, primitives);
        let mut collapse = Collapse { binary, costs, bounds, primitives, leaves, nodes: Vec::new() };
        bvh.root = Some(collapse.subtree(0, 0));
        bvh.nodes = std::mem::take(&mut collapse.nodes);
        drop(collapse);
        // Only now, since both grow in steps and are copied to their true size.
        bvh.nodes.shrink_to_fit();
        leaves.shrink();
        bvh
    }
}

/// What is known of each node of the binary tree.
struct Costs {
    /// `slots[i][k]`: least cost of the part below inner node `i` if it takes at most `k + 1` slots of the node above.
    slots: Vec<[f32; 8]>,
    /// The number `i` of each inner node; of a node with a single primitive, whose slots all cost the same, the cost's
    /// bits.
    places: Vec<u32>,
    /// Whether there is a single primitive below.
    single: Vec<bool>,
    /// Whether what is below becomes one leaf if it gets one slot.
    leaf: Vec<bool>,
}

/// Primitives below a node, by kind, up to the numbers that matter.
#[derive(Clone, Copy, Default)]
struct Content {
    triangles: u8,
    others: u8,
}

impl Content {
    fn plus(self, other: Self) -> Self {
        Self {
            triangles: self.triangles.saturating_add(other.triangles),
            others: self.others.saturating_add(other.others),
        }
    }

    /// Cost of one leaf, where one is possible.
    fn leaf_cost(self) -> Option<f32> {
        match self {
            Self { triangles: 1..=8, others: 0 } => Some(1.0),
            Self { triangles: 0, others } if usize::from(others) <= MAX_RUN => {
                Some(OTHER_COST * f32::from(others))
            }
            Self { .. } => None,
        }
    }
}

impl Costs {
    fn new(binary: &BinaryTree, primitives: &Primitives) -> Self {
        let count = binary.nodes.len();
        let mut costs = Self {
            slots: Vec::with_capacity(count / 2),
            places: vec![0; count],
            single: vec![false; count],
            leaf: vec![false; count],
        };
        let mut contents = vec![Content::default(); count];
        for (index, node) in binary.nodes.iter().enumerate().rev() {
            contents[index] = match node.children() {
                Some([l, r]) => contents[l].plus(contents[r]),
                None => {
                    let triangles = u8::from(primitives.is_triangle(binary.order[node.first as usize]));
                    Content { triangles, others: 1 - triangles }
                }
            };
            costs.fill(index, node.children(), node.bounds.half_area(), contents[index].leaf_cost());
        }
        costs
    }

    fn fill(&mut self, node: usize, children: Option<[usize; 2]>, area: f32, leaf: Option<f32>) {
        let leaf = leaf.map_or(f32::INFINITY, |cost| cost * area);
        let Some([l, r]) = children else {
            self.places[node] = leaf.to_bits();
            (self.single[node], self.leaf[node]) = (true, true);
            return;
        };
        let below = [self.of(l), self.of(r)];
        let inner = best_split(&below, 8).0 + NODE_COST * area;
        self.leaf[node] = leaf <= inner;
        let mut least = leaf.min(inner);
        let mut slots = [least; 8];
        for count in 2..=8 {
            least = least.min(best_split(&below, count).0);
            slots[count - 1] = least;
        }
        self.places[node] = self.slots.len() as u32;
        self.slots.push(slots);
    }

    /// Least cost of the part below a node for each number of slots.
    fn of(&self, node: usize) -> [f32; 8] {
        let place = self.places[node];
        if self.single[node] { [f32::from_bits(place); 8] } else { self.slots[place as usize] }
    }
}

/// Cheapest way to share `slots` (two or more) among two children, of which the costs are given: its cost, and the
/// slots of the first.
fn best_split([left, right]: &[[f32; 8]; 2], slots: usize) -> (f32, usize) {
    (1..slots)
        .map(|k| (left[k - 1] + right[slots - k - 1], k))
        .fold((f32::INFINITY, 1), |best, split| if split.0 < best.0 { split } else { best })
}

struct Collapse<'a> {
    binary: BinaryTree,
    costs: Costs,
    bounds: &'a [Bounds],
    primitives: &'a Primitives,
    leaves: &'a mut Leaves,
    nodes: Vec<Node>,
}

impl Collapse<'_> {
    fn subtree(&mut self, index: usize, depth: usize) -> Word {
        let node = &self.binary.nodes[index];
        let Some(below) = node.children().filter(|_| depth < SPLIT_DEPTH && !self.costs.leaf[index]) else {
            let (first, count) = (node.first as usize, node.count as usize);
            let numbers = self.binary.order[first..first + count].to_vec();
            return self.by_order(numbers);
        };
        let mut cut = Vec::with_capacity(8);
        self.split(below, 8, &mut cut);
        let index = self.add_node();
        for (lane, child) in cut.into_iter().enumerate() {
            let bounds = self.binary.nodes[child].bounds;
            let word = self.subtree(child, depth + 1);
            self.nodes[index].set(lane, bounds, word);
        }
        Word::node(index)
    }

    /// Cuts what is below two nodes into at most `slots` parts.
    fn split(&self, below: [usize; 2], slots: usize, cut: &mut Vec<usize>) {
        let (_, first) = best_split(&below.map(|node| self.costs.of(node)), slots);
        self.cut(below[0], first, cut);
        self.cut(below[1], slots - first, cut);
    }

    fn cut(&self, node: usize, slots: usize, cut: &mut Vec<usize>) {
        let cost = self.costs.of(node);
        // More slots than help are not taken.
        let useful = (0..slots).find(|&k| cost[k] == cost[slots - 1]).map_or(slots, |k| k + 1);
        match self.binary.nodes[node].children() {
            Some(below) if useful > 1 => self.split(below, useful, cut),
            _ => cut.push(node),
        }
    }

    /// A leaf, or where there are too many for one, nodes that halve the primitives' order three times.
    fn by_order(&mut self, numbers: Vec<u32>) -> Word {
        let triangles = numbers.iter().filter(|&&n| self.primitives.is_triangle(n)).count();
        if triangles == numbers.len() && triangles <= 8 || triangles == 0 && numbers.len() <= MAX_RUN {
            return self.leaves.add(&numbers, self.primitives);
        }
        let (first, second): (Vec<u32>, Vec<u32>) =
            numbers.iter().partition(|&&n| self.primitives.is_triangle(n));
        let index = self.add_node();
        let size = numbers.len().div_ceil(7).max(MAX_RUN);
        for (lane, part) in first.chunks(size).chain(second.chunks(size)).enumerate() {
            let bounds = part.iter().fold(Bounds::EMPTY, |b, &n| b.union(self.bounds[n as usize]));
            let word = self.by_order(part.to_vec());
            self.nodes[index].set(lane, bounds, word);
        }
        Word::node(index)
    }

    fn add_node(&mut self) -> usize {
        self.nodes.push(Node::EMPTY);
        self.nodes.len() - 1
    }
}

impl Node {
    const EMPTY: Self = {
        let (low, high) = ([f32::INFINITY; 8], [f32::NEG_INFINITY; 8]);
        Self { planes: [low, high, low, high, low, high], children: [Word::NOTHING; 8] }
    };

    fn set(&mut self, lane: usize, bounds: Bounds, word: Word) {
        for axis in 0..3 {
            self.planes[2 * axis][lane] = bounds.min[axis];
            self.planes[2 * axis + 1][lane] = bounds.max[axis];
        }
        self.children[lane] = word;
    }
}
