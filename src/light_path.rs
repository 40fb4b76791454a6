//! The alphabet of light paths, `L(D|S)*E`, and the classes an image is split into.

/// What a path met at a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bounce {
    /// D: anything a photon may rest on.
    Diffuse,
    /// S: a mirror or smooth glass.
    Specular,
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
}

impl PathClass {
    /// All classes that are rendered, in the order of the film's layers.
    pub const ALL: [Self; 3] = [Self::Emitted, Self::Direct, Self::Caustic];

    /// The class's name on the wire and in file names.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Emitted => "emitted",
            Self::Direct => "direct",
            Self::Caustic => "caustic",
        }
    }

    /// The class as a light-path expression.
    #[must_use]
    pub fn expression(self) -> &'static str {
        match self {
            Self::Emitted => "LS*E",
            Self::Direct => "LDS*E",
            Self::Caustic => "LS+DS*E",
        }
    }

    /// The class of a path whose vertices after the light are `bounces`, in the order light travels;
    /// `None` for the paths with more than one D, which are not rendered.
    #[must_use]
    pub fn of(bounces: &[Bounce]) -> Option<Self> {
        let mut diffuse = (0..bounces.len()).filter(|&i| bounces[i] == Bounce::Diffuse);
        match (diffuse.next(), diffuse.next()) {
            (None, _) => Some(Self::Emitted),
            (Some(0), None) => Some(Self::Direct),
            (Some(_), None) => Some(Self::Caustic),
            (Some(_), Some(_)) => None,
        }
    }
}
