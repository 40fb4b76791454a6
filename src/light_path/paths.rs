//! Which light paths are asked for.

use super::automaton::Automaton;
use super::expression::{ExpressionError, parse};
use super::language::Language;
use super::{Bounce, PathClass};
use std::fmt;
use std::str::FromStr;

/// A light-path expression over L, D, S and E: a set of light paths.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Expression {
    text: String,
    pub(super) automaton: Automaton,
}

/// Which light paths are computed: the choice of method.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub enum Paths {
    /// `LS*E|LDS*E`: the recursive ray tracing of Whitted (1980), without caustics.
    Whitted,
    /// `LS*E|LDS*E|LS+DS*E`: the two passes.
    #[default]
    Caustics,
    /// `L(D|S)*E`: everything, with the light that bounces between D's.
    Complete,
    /// Just these.
    Expression(Expression),
}

/// How much of a class is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Share {
    /// None of its paths.
    Nothing,
    /// Some, but not all.
    Part,
    /// All of its paths.
    Whole,
}

/// A value of `paths` that means nothing.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PathsError {
    /// A word that is no preset.
    #[error(
        "`{0}` is not one of `whitted` (LS*E|LDS*E), `caustics` (LS*E|LDS*E|LS+DS*E) and `complete` (L(D|S)*E), nor an expression like these"
    )]
    UnknownName(String),
    /// An expression with an error.
    #[error("`{text}`: {error}")]
    Expression {
        /// What was read.
        text: String,
        /// What is wrong with it.
        error: ExpressionError,
    },
}

impl Expression {
    /// The text it was read from.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Whether a path is one of these; `bounces` are its vertices after the light, in the order light travels.
    #[must_use]
    pub fn matches(&self, bounces: &[Bounce]) -> bool {
        self.automaton.matches(bounces)
    }
}

impl FromStr for Expression {
    type Err = ExpressionError;

    fn from_str(text: &str) -> Result<Self, ExpressionError> {
        let automaton = Automaton::of(&parse(text)?)?;
        // What walks carry must be small for any expression that is accepted.
        if Language::of_picture(&automaton).is_none() {
            return Err(ExpressionError::new(1, "too complex to be followed from the eye"));
        }
        Ok(Self { text: text.to_owned(), automaton })
    }
}

impl Paths {
    /// Every value that has a name.
    pub const NAMED: [(&str, Self); 3] =
        [("whitted", Self::Whitted), ("caustics", Self::Caustics), ("complete", Self::Complete)];

    /// The paths as an expression.
    #[must_use]
    pub fn expression(&self) -> &str {
        match self {
            Self::Whitted => "LS*E|LDS*E",
            Self::Caustics => "LS*E|LDS*E|LS+DS*E",
            Self::Complete => "L(D|S)*E",
            Self::Expression(expression) => expression.text(),
        }
    }

    /// How much of the paths of an expression is asked for, of those made of `alphabet` alone.
    ///
    /// # Panics
    /// If `pattern`, which the program itself gives, is not an expression.
    #[must_use]
    pub(crate) fn share_of(&self, pattern: &str, alphabet: &[Bounce]) -> Share {
        share(&self.automaton(), &compiled(pattern), alphabet)
    }

    /// How much of a class is asked for.
    #[must_use]
    pub fn share(&self, class: PathClass) -> Share {
        self.share_of(class.expression(), &Bounce::ALL)
    }

    /// The classes of which anything is asked for.
    #[must_use]
    pub fn classes(&self) -> Vec<PathClass> {
        PathClass::ALL.into_iter().filter(|&class| self.share(class) != Share::Nothing).collect()
    }

    /// Whether whole classes are asked for: then the class of a path says all.
    #[must_use]
    pub fn are_whole_classes(&self) -> bool {
        PathClass::ALL.into_iter().all(|class| self.share(class) != Share::Part)
    }

    /// Whether a path is asked for; `bounces` are its vertices after the light, in the order light travels.
    #[must_use]
    pub fn matches(&self, bounces: &[Bounce]) -> bool {
        self.automaton().matches(bounces)
    }

    pub(super) fn automaton(&self) -> Automaton {
        match self {
            Self::Whitted | Self::Caustics | Self::Complete => compiled(self.expression()),
            Self::Expression(expression) => expression.automaton.clone(),
        }
    }
}

/// The automaton of an expression that the program itself gives.
fn compiled(text: &str) -> Automaton {
    let node = parse(text).and_then(|node| Automaton::of(&node));
    node.expect("presets and classes are expressions")
}

/// How much of a class is asked for, of paths made of `alphabet` alone.
fn share(asked: &Automaton, class: &Automaton, alphabet: &[Bounce]) -> Share {
    if !asked.any_with(class, alphabet, |asked, class| asked && class) {
        Share::Nothing
    } else if asked.any_with(class, alphabet, |asked, class| class && !asked) {
        Share::Part
    } else {
        Share::Whole
    }
}

impl fmt::Display for Paths {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.expression())
    }
}

impl FromStr for Paths {
    type Err = PathsError;

    fn from_str(text: &str) -> Result<Self, PathsError> {
        if let Some((_, paths)) = Self::NAMED.iter().find(|(name, _)| *name == text) {
            return Ok(paths.clone());
        }
        // All letters of an expression are capitals.
        if text.trim_start().starts_with(char::is_lowercase) {
            return Err(PathsError::UnknownName(text.to_owned()));
        }
        let parsed = text.parse().map(Self::Expression);
        parsed.map_err(|error| PathsError::Expression { text: text.to_owned(), error })
    }
}
