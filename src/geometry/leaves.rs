//! What the leaves of a structure hold: packets of triangles, and runs of other primitives.

use super::Bounds;
use super::mesh::Mesh;
use super::nearest::Place;
use super::packet::{Packet, Triangle};
use arrayvec::ArrayVec;

/// Most primitives other than triangles in a run.
pub(super) const MAX_RUN: usize = 4;

/// The primitives, in the order of the structure.
#[derive(Debug, Default)]
pub(super) struct Leaves {
    pub(super) packets: Vec<Packet>,
    pub(super) entries: Vec<Entry>,
}

/// A primitive that is not a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Entry {
    pub(super) shape: Shape,
    /// Its number.
    pub(super) primitive: u32,
}

/// Its kind and its index in that kind's array.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Shape {
    Sphere(u32),
    Polygon(u32),
    Disk(u32),
    Cylinder(u32),
    Instance(u32),
    /// Primitives that move together.
    Moving(u32),
}

/// A child of a node in one word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Word(u32);

/// What a [`Word`] stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Child {
    Node(usize),
    Packet(usize),
    Run(Run),
}

/// Some entries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Run {
    pub(super) first: usize,
    pub(super) count: usize,
}

/// A word's two upper bits say what it stands for. A run's count takes three more, its first entry the rest.
const KIND: u32 = 30;
const PACKET: u32 = 1 << KIND;
const RUN: u32 = 2 << KIND;
const COUNT: u32 = 27;

impl Word {
    /// A child that is never walked.
    pub(super) const NOTHING: Self = Self(RUN);

    pub(super) fn node(index: usize) -> Self {
        debug_assert!(index < 1 << KIND);
        Self(index as u32)
    }

    /// Its bits, and back.
    #[inline(always)]
    pub(super) fn bits(self) -> u32 {
        self.0
    }

    #[inline(always)]
    pub(super) fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    #[inline(always)]
    pub(super) fn child(self) -> Child {
        let index = (self.0 & ((1 << KIND) - 1)) as usize;
        if self.0 < PACKET {
            Child::Node(index)
        } else if self.0 < RUN {
            Child::Packet(index)
        } else {
            Child::Run(Run { first: index & ((1 << COUNT) - 1), count: index >> COUNT })
        }
    }
}

/// A scene's primitives by number, as they were added.
#[derive(Debug, Default)]
pub(super) struct Primitives {
    pub(super) sources: Vec<Source>,
    pub(super) meshes: Vec<Mesh>,
}

/// What a primitive's number stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Source {
    /// A triangle of a mesh.
    Triangle { mesh: u32, index: u32 },
    /// Anything else.
    Other(Shape),
}

impl Primitives {
    pub(super) fn is_triangle(&self, primitive: u32) -> bool {
        matches!(self.sources[primitive as usize], Source::Triangle { .. })
    }
}

impl Leaves {
    /// Adds primitives of one kind, at most eight triangles or [`MAX_RUN`] others.
    pub(super) fn add(&mut self, numbers: &[u32], primitives: &Primitives) -> Word {
        let (packet, first) = (self.packets.len(), self.entries.len());
        let mut triangles: ArrayVec<(u32, Triangle), 8> = ArrayVec::new();
        for &primitive in numbers {
            match primitives.sources[primitive as usize] {
                Source::Triangle { mesh, index } => {
                    triangles.push((primitive, primitives.meshes[mesh as usize].triangle(index)));
                }
                Source::Other(shape) => self.entries.push(Entry { shape, primitive }),
            }
        }
        if triangles.is_empty() {
            debug_assert!(self.entries.len() < 1 << COUNT);
            return Word(RUN | (numbers.len() as u32) << COUNT | first as u32);
        }
        debug_assert!(packet < 1 << KIND);
        self.packets.push(Packet::new(triangles));
        Word(PACKET | packet as u32)
    }

    /// Gives back memory that no more primitives will need.
    pub(super) fn shrink(&mut self) {
        self.packets.shrink_to_fit();
        self.entries.shrink_to_fit();
    }

    /// Adds all primitives in their order, triangles first.
    pub(super) fn add_all(&mut self, primitives: &Primitives) -> Vec<Word> {
        let all = 0..primitives.sources.len() as u32;
        let (triangles, others): (Vec<u32>, Vec<u32>) = all.partition(|&n| primitives.is_triangle(n));
        let chunks = triangles.chunks(8).chain(others.chunks(MAX_RUN));
        chunks.map(|numbers| self.add(numbers, primitives)).collect()
    }

    /// Every primitive's place and box; `bounds` are in the order of their numbers.
    pub(super) fn placed(&self, bounds: &[Bounds]) -> Vec<(Place, Bounds)> {
        let triangles = self.packets.iter().flat_map(Packet::primitives);
        // Lanes that hold no triangle have a number that does not exist.
        let triangles = triangles.enumerate().map(|(slot, n)| (Place::Triangle(slot as u32), n));
        let entries = self.entries.iter().enumerate().map(|(i, e)| (Place::Entry(i as u32), e.primitive));
        triangles
            .chain(entries)
            .filter_map(|(place, number)| Some((place, *bounds.get(number as usize)?)))
            .collect()
    }

    /// The number of the triangle in a slot.
    pub(super) fn number(&self, slot: u32) -> u32 {
        self.packets[slot as usize / 8].primitives()[slot as usize % 8]
    }

    /// The triangle in a slot.
    #[inline]
    pub(super) fn triangle(&self, slot: u32) -> Triangle {
        self.packets[slot as usize / 8].triangle(slot as usize % 8)
    }

    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(&self.packets[..]) + size_of_val(&self.entries[..])
    }
}
