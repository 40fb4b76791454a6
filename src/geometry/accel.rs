//! The structure over the primitives: a plain list for a handful, a hierarchy of boxes for more.

use super::Bounds;
use super::bvh::Bvh;
use super::leaves::{Leaves, Primitives, Word};

/// Up to this many primitives are simply tested one after the other (measured, see `benches/rays.rs`).
const LIST_LIMIT: usize = 4;

/// How the nearest primitive is found.
#[derive(Debug)]
pub(super) enum Accel {
    /// Every primitive is tested.
    List(Vec<Word>),
    /// A hierarchy of boxes.
    Bvh(Bvh),
}

impl Accel {
    /// Builds the structure and puts the primitives into leaves in its order.
    pub(super) fn build(bounds: &[Bounds], primitives: &Primitives) -> (Self, Leaves) {
        let mut leaves = Leaves::default();
        let accel = if bounds.len() <= LIST_LIMIT {
            Self::List(leaves.add_all(primitives))
        } else {
            Self::Bvh(Bvh::build(bounds, primitives, &mut leaves))
        };
        (accel, leaves)
    }

    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::List(_) => "list",
            Self::Bvh(_) => "bvh",
        }
    }

    pub(super) fn memory_bytes(&self) -> usize {
        match self {
            Self::List(words) => size_of_val(&words[..]),
            Self::Bvh(bvh) => bvh.memory_bytes(),
        }
    }
}
