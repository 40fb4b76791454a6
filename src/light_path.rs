//! The alphabet of light paths, `L(D|S)*E`, and the classes an image is split into.

mod automaton;
mod expression;
mod language;
mod paths;

pub use expression::ExpressionError;
pub use language::{Kind, Kinds, Language, Layers, MOST_LAYERS, PICTURE, Pictures, Trail};
pub use paths::{Expression, Paths, PathsError, Share};

/// What a path met at a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bounce {
    /// D: anything a photon may rest on.
    Diffuse,
    /// S: a mirror or smooth glass.
    Specular,
}

impl Bounce {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Diffuse, Self::Specular];
}

/// A set of classes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Classes(u8);

impl Classes {
    /// Whether a class is one of them.
    #[inline]
    #[must_use]
    pub fn contains(self, class: PathClass) -> bool {
        self.0 >> class as u8 & 1 == 1
    }
}

impl FromIterator<PathClass> for Classes {
    fn from_iter<T: IntoIterator<Item = PathClass>>(classes: T) -> Self {
        Self(classes.into_iter().fold(0, |set, class| set | 1 << class as u8))
    }
}

/// The disjoint classes of light paths; each has exactly one estimator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PathClass {
    /// `LS*E`: the light seen directly, in mirrors and through glass.
    Emitted,
    /// `LDS*E`: light that goes straight from the light to the first D the eye sees.
    Direct,
    /// `LS+DS*E`: light that mirrors or glass throw onto the first D the eye sees.
    Caustic,
    /// `L(D|S)*DS*DS*E`: light that has met another D before.
    Indirect,
}

impl PathClass {
    /// All classes, in the order of the film's layers.
    pub const ALL: [Self; 4] = [Self::Emitted, Self::Direct, Self::Caustic, Self::Indirect];

    /// The class's name on the wire and in file names.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Emitted => "emitted",
            Self::Direct => "direct",
            Self::Caustic => "caustic",
            Self::Indirect => "indirect",
        }
    }

    /// The class as a light-path expression.
    #[must_use]
    pub fn expression(self) -> &'static str {
        match self {
            Self::Emitted => "LS*E",
            Self::Direct => "LDS*E",
            Self::Caustic => "LS+DS*E",
            Self::Indirect => "L(D|S)*DS*DS*E",
        }
    }

    /// The class of a path that comes straight from the light to a D which is the eye's `count`-th.
    #[inline]
    #[must_use]
    pub(crate) fn with_light_after(count: u32) -> Self {
        if count == 1 { Self::Direct } else { Self::Indirect }
    }

    /// The class of a path that comes over mirrors or glass from the light to a D which is the eye's `count`-th.
    #[inline]
    #[must_use]
    pub(crate) fn with_caustic_after(count: u32) -> Self {
        if count == 1 { Self::Caustic } else { Self::Indirect }
    }

    /// The class of a path whose vertices after the light are `bounces`, in the order light travels.
    #[must_use]
    pub fn of(bounces: &[Bounce]) -> Self {
        let mut diffuse = (0..bounces.len()).filter(|&i| bounces[i] == Bounce::Diffuse);
        match (diffuse.next(), diffuse.next()) {
            (None, _) => Self::Emitted,
            (Some(0), None) => Self::Direct,
            (Some(_), None) => Self::Caustic,
            (Some(_), Some(_)) => Self::Indirect,
        }
    }
}
