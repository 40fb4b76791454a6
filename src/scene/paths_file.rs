//! Light paths in the scene file: a preset or an expression.

use super::issue::{IssueCode, suggestion};
use super::json::{Node, Value};
use super::read::{Context, Decode, Encode, quoted};
use super::schema::Definitions;
use crate::light_path::{Expression, Paths, PathsError};
use serde_json::json;

/// The characters that an expression is made of, as a pattern of the JSON Schema.
const PATTERN: &str = r"^[\sLDSE()|*+?.{},0-9]+$";

/// Reads [`Paths`]: the name of a preset, or an expression.
pub(super) struct LightPaths;

/// Reads an [`Expression`].
pub(super) struct LightPath;

impl Decode for LightPaths {
    type Out = Paths;

    fn decode(&self, node: &Node<'_>, cx: &mut Context<'_>) -> Option<Paths> {
        let Value::String(text) = &node.value else {
            cx.wrong_type("a light-path expression, or `whitted`, `caustics` or `complete`", node);
            return None;
        };
        match text.parse() {
            Ok(paths) => Some(paths),
            Err(PathsError::UnknownName(name)) => {
                let near = suggestion(&name, Paths::NAMED.iter().map(|(name, _)| *name));
                let message =
                    format!("`{}` is neither a preset nor a light-path expression{near}", quoted(&name));
                cx.issue(IssueCode::UnknownValue, message);
                None
            }
            Err(PathsError::Expression { text, error }) => {
                cx.issue(IssueCode::UnknownValue, format!("`{}`: {error}", quoted(&text)));
                None
            }
        }
    }

    fn schema(&self, definitions: &mut Definitions) -> serde_json::Value {
        let names: Vec<_> = Paths::NAMED.iter().map(|(name, _)| *name).collect();
        json!({ "anyOf": [{ "enum": names }, LightPath.schema(definitions)] })
    }
}

impl Encode for LightPaths {
    fn encode(&self, value: &Paths) -> serde_json::Value {
        let named = Paths::NAMED.iter().find(|(_, known)| known == value);
        named.map_or_else(|| json!(value.expression()), |(name, _)| json!(name))
    }
}

impl Decode for LightPath {
    type Out = Expression;

    fn decode(&self, node: &Node<'_>, cx: &mut Context<'_>) -> Option<Expression> {
        let Value::String(text) = &node.value else {
            cx.wrong_type("a light-path expression", node);
            return None;
        };
        text.parse()
            .inspect_err(|error| {
                cx.issue(IssueCode::UnknownValue, format!("`{}`: {error}", quoted(text)));
            })
            .ok()
    }

    fn schema(&self, _definitions: &mut Definitions) -> serde_json::Value {
        json!({ "title": "a light-path expression", "type": "string", "pattern": PATTERN })
    }
}
