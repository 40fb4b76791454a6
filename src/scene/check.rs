//! What is allowed in a scene, but hardly meant: warnings, each with a stable code and its place.

/// Something the user should know.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// Stable name of the kind of warning.
    pub code: &'static str,
    /// Where, as a JSON pointer (RFC 6901); `None` where it is about the scene as a whole.
    pub pointer: Option<String>,
    /// The warning in words.
    pub message: String,
}
