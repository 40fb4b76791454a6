//! The structure over the primitives: a plain list for a handful, a hierarchy of boxes for more, and two
//! rivals for comparison. All find the same hits to the last bit.

use super::Bounds;
use super::bvh::Bvh;
use super::grid::Grid;
use super::leaves::{Leaves, Primitives, Word};
use super::sphere_tree::SphereTree;

/// Up to this many primitives are simply tested one after the other (measured on spheres and polygons).
const LIST_LIMIT: usize = 4;

/// Which structure is built over the primitives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Structure {
    /// A list for a handful of primitives, else boxes.
    #[default]
    Auto,
    /// None: every primitive is tested.
    List,
    /// A uniform grid.
    Grid,
    /// A hierarchy of boxes.
    Bvh,
    /// A hierarchy of bounding spheres.
    Spheres,
}

impl Structure {
    /// Every value and its name.
    pub const NAMED: [(&str, Self); 5] = [
        ("auto", Self::Auto),
        ("list", Self::List),
        ("grid", Self::Grid),
        ("bvh", Self::Bvh),
        ("spheres", Self::Spheres),
    ];
}

/// How the nearest primitive is found.
#[derive(Debug)]
pub(super) enum Accel {
    /// Every primitive is tested.
    List(Vec<Word>),
    /// A uniform grid.
    Grid(Box<Grid>),
    /// A hierarchy of boxes.
    Bvh(Bvh),
    /// A hierarchy of bounding spheres.
    Spheres(SphereTree),
}

impl Accel {
    /// Builds the structure and puts the primitives into leaves in its order.
    pub(super) fn build(structure: Structure, bounds: &[Bounds], primitives: &Primitives) -> (Self, Leaves) {
        let mut leaves = Leaves::default();
        let accel = match structure {
            Structure::Auto if bounds.len() > LIST_LIMIT => {
                Self::Bvh(Bvh::build(bounds, primitives, &mut leaves))
            }
            Structure::Auto | Structure::List => Self::List(leaves.add_all(primitives)),
            Structure::Bvh => Self::Bvh(Bvh::build(bounds, primitives, &mut leaves)),
            Structure::Grid => {
                leaves.add_all(primitives);
                Self::Grid(Box::new(Grid::build(&leaves.placed(bounds))))
            }
            Structure::Spheres => {
                leaves.add_all(primitives);
                Self::Spheres(SphereTree::build(&leaves.placed(bounds)))
            }
        };
        (accel, leaves)
    }

    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::List(_) => "list",
            Self::Grid(_) => "grid",
            Self::Bvh(_) => "bvh",
            Self::Spheres(_) => "spheres",
        }
    }

    /// Why this structure, or what came of it.
    pub(super) fn reason(&self, asked: Structure, primitives: usize) -> String {
        let why = match self {
            Self::List(_) if asked == Structure::Auto => "testing each is quicker than walking a tree".into(),
            Self::List(_) => "each is tested, as asked for".into(),
            Self::Grid(grid) => format!("a uniform grid, as asked for: {}", grid.describe()),
            Self::Bvh(_) if asked == Structure::Auto => "boxes skip most of them for every ray".into(),
            Self::Bvh(_) => "boxes, as asked for".into(),
            Self::Spheres(_) => {
                "bounding spheres, as asked for: boxes fit flat and long things better".into()
            }
        };
        format!("{primitives} primitives: {why}")
    }

    pub(super) fn memory_bytes(&self) -> usize {
        match self {
            Self::List(words) => size_of_val(&words[..]),
            Self::Grid(grid) => grid.memory_bytes(),
            Self::Bvh(bvh) => bvh.memory_bytes(),
            Self::Spheres(tree) => tree.memory_bytes(),
        }
    }
}
