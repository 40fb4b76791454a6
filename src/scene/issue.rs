//! What is wrong with a scene: every error at once, each with its place and what is expected there.

use super::json::Node;
use std::fmt;

/// Most errors reported of one scene; the last says how many more there are.
const MAX_ISSUES: usize = 1000;
/// Most names a wrong one is compared with.
const MAX_COMPARED: usize = 1000;
/// Names longer than this are not compared with others.
const MAX_COMPARED_NAME: usize = 64;

/// Everything that is wrong with a scene, in the order of the text. Never empty.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneErrors {
    /// The errors, at least one.
    pub issues: Vec<SceneIssue>,
}

/// One thing that is wrong with a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneIssue {
    /// Where, as a JSON pointer (RFC 6901); the empty string is the whole document.
    pub pointer: String,
    /// What kind of error.
    pub code: IssueCode,
    /// What is expected, what was found and, for a wrong name, the nearest valid one.
    pub message: String,
    /// Line of the text, from 1; 0 where unknown.
    pub line: usize,
    /// Character in the line, from 1; 0 where unknown.
    pub column: usize,
}

macro_rules! issue_codes {
    ($($(#[$doc:meta])* $variant:ident = $name:literal,)*) => {
        /// The kinds of errors in a scene.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum IssueCode {
            $($(#[$doc])* $variant,)*
        }

        impl IssueCode {
            /// The code's name on the wire.
            #[must_use]
            pub fn as_str(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }
        }
    };
}

issue_codes! {
    /// The text is not JSON.
    Syntax = "syntax",
    /// The text, or what it refers to, is larger than the limits.
    TooLarge = "too_large",
    /// Nested deeper than any scene.
    TooDeep = "too_deep",
    /// A key is given twice in one object.
    DuplicateKey = "duplicate_key",
    /// The file is of a version this program does not read.
    UnsupportedVersion = "unsupported_version",
    /// A field that does not exist here.
    UnknownField = "unknown_field",
    /// A field that must be there is not.
    MissingField = "missing_field",
    /// A value of another JSON type than expected.
    WrongType = "wrong_type",
    /// An array with too few or too many elements.
    WrongLength = "wrong_length",
    /// A number outside its range.
    OutOfRange = "out_of_range",
    /// A number too large for a float.
    NotFinite = "not_finite",
    /// A word or colour that is not one of those allowed.
    UnknownValue = "unknown_value",
    /// A name that nothing in the scene has.
    UnknownReference = "unknown_reference",
    /// Fields that exclude or require each other.
    ConflictingFields = "conflicting_fields",
    /// A shape without area, or axes that span nothing.
    Degenerate = "degenerate",
    /// A polygon whose points are not in one plane.
    NotPlanar = "not_planar",
    /// An index of a mesh that points at no vertex.
    IndexOutOfRange = "index_out_of_range",
    /// An asset that cannot be read.
    AssetUnavailable = "asset_unavailable",
    /// An asset whose content is not what it is used as, or damaged.
    AssetInvalid = "asset_invalid",
    /// There are more errors than are listed.
    TooManyIssues = "too_many_issues",
}

impl fmt::Display for IssueCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl fmt::Display for SceneIssue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.line > 0 {
            write!(f, "{}:{}: ", self.line, self.column)?;
        }
        let pointer = if self.pointer.is_empty() { "(scene)" } else { &self.pointer };
        write!(f, "{pointer}: {} [{}]", self.message, self.code)
    }
}

impl fmt::Display for SceneErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, issue) in self.issues.iter().enumerate() {
            if i > 0 {
                f.write_str("\n")?;
            }
            issue.fmt(f)?;
        }
        Ok(())
    }
}

impl std::error::Error for SceneErrors {}

/// Collects what is wrong while a scene is read and compiled.
#[derive(Debug, Default)]
pub(super) struct Issues {
    found: Vec<Found>,
    total: usize,
}

#[derive(Debug)]
struct Found {
    pointer: String,
    code: IssueCode,
    message: String,
    offset: Option<usize>,
}

impl Issues {
    /// Notes an error at a pointer.
    pub(super) fn add(&mut self, pointer: impl Into<String>, code: IssueCode, message: impl Into<String>) {
        self.add_at(pointer, code, message, None);
    }

    /// Notes an error whose place in the text is known better than by its pointer.
    pub(super) fn add_at(
        &mut self,
        pointer: impl Into<String>,
        code: IssueCode,
        message: impl Into<String>,
        offset: Option<usize>,
    ) {
        self.total += 1;
        if !self.is_full() {
            let (pointer, message) = (pointer.into(), message.into());
            self.found.push(Found { pointer, code, message, offset });
        }
    }

    /// How many errors there are, listed or only counted.
    pub(super) fn count(&self) -> usize {
        self.total
    }

    /// True if further errors are only counted, so that work on their messages is wasted.
    pub(super) fn is_full(&self) -> bool {
        self.found.len() >= MAX_ISSUES
    }

    /// The errors in the order of the text, with lines and columns.
    pub(super) fn into_errors(self, text: &str, root: Option<&Node<'_>>) -> SceneErrors {
        let more = self.total - self.found.len();
        let mut found: Vec<(usize, Found)> = self
            .found
            .into_iter()
            .map(|f| (f.offset.or_else(|| root.map(|r| r.locate(&f.pointer))).unwrap_or(0), f))
            .collect();
        found.sort_by_key(|(offset, _)| *offset);
        let mut cursor = LineCursor { text, offset: 0, line: 1, column: 1 };
        let mut issues = Vec::with_capacity(found.len() + 1);
        for (offset, Found { pointer, code, message, .. }) in found {
            cursor.advance_to(offset);
            issues.push(SceneIssue { pointer, code, message, line: cursor.line, column: cursor.column });
        }
        if more > 0 {
            let (pointer, code) = (String::new(), IssueCode::TooManyIssues);
            issues.push(SceneIssue {
                pointer,
                code,
                message: format!("and {more} more errors"),
                line: 0,
                column: 0,
            });
        }
        SceneErrors { issues }
    }
}

/// Walks forward through a text and counts lines and characters.
struct LineCursor<'t> {
    text: &'t str,
    offset: usize,
    line: usize,
    column: usize,
}

impl LineCursor<'_> {
    fn advance_to(&mut self, offset: usize) {
        for c in self.text.get(self.offset..offset).unwrap_or_default().chars() {
            if c == '\n' {
                self.line += 1;
                self.column = 1;
            } else {
                self.column += 1;
            }
        }
        self.offset = self.offset.max(offset);
    }
}

/// ` (did you mean …?)` if one of the names is near, else the list of names if it is short.
pub(super) fn suggestion<'n>(wrong: &str, names: impl IntoIterator<Item = &'n str>) -> String {
    let names: Vec<&str> = names.into_iter().take(MAX_COMPARED).collect();
    let nearest = names
        .iter()
        .filter(|name| name.len() <= MAX_COMPARED_NAME && wrong.len() <= MAX_COMPARED_NAME)
        .map(|name| (edits(wrong, name), name))
        .min_by_key(|(edits, _)| *edits);
    match nearest {
        // One slip, and one more for every four letters, but never half of the name.
        Some((edits, name)) if edits <= 1 + name.len() / 4 && 2 * edits <= name.len() => {
            format!("; did you mean `{name}`?")
        }
        _ if names.is_empty() => String::new(),
        _ if names.len() <= 16 => format!("; valid here: `{}`", names.join("`, `")),
        _ => String::new(),
    }
}

/// Letters to insert, drop, replace or swap, blind to capitals.
fn edits(a: &str, b: &str) -> usize {
    strsim::osa_distance(&a.to_lowercase(), &b.to_lowercase())
}

/// One more step of a JSON pointer, escaped.
pub(super) fn pointer_step(pointer: &str, step: &str) -> String {
    format!("{pointer}/{}", step.replace('~', "~0").replace('/', "~1"))
}
