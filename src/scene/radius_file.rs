//! The reach of the density estimate in the scene file: exactly what the JSON says, nothing computed.

use super::json::{Node, Value};
use super::read::{Context, Decode, Encode, any_is, choice, count, object, real, record, required};
use super::schema::Definitions;
use crate::radius::RadiusRule;
use serde_json::json;

/// Most photons that a look-up of the nearest may ask for.
const MOST_NEAREST: u32 = 100_000;

record! {
    /// All photons within a distance, each counted alike.
    FixedRadiusFile {
        /// The distance.
        fixed: f64 = required(real("radius in metres").positive_length()),
    }
}

record! {
    /// The nearest photons.
    NearestRadiusFile {
        /// How many.
        nearest: u32 = required(count("number of photons", 2, MOST_NEAREST)),
        /// None further away than this.
        most: f64 = required(real("radius in metres").positive_length()),
    }
}

/// Reads a [`RadiusRule`]: a word, or a record with numbers.
pub(super) struct Radius;

impl Decode for Radius {
    type Out = RadiusRule;

    fn decode(&self, node: &Node<'_>, cx: &mut Context<'_>) -> Option<RadiusRule> {
        match &node.value {
            Value::Object(members) if any_is(members, "nearest") => {
                let file = object::<NearestRadiusFile>().decode(node, cx)?;
                Some(RadiusRule::Nearest { count: file.nearest, most: file.most as f32 })
            }
            Value::Object(_) => {
                let file = object::<FixedRadiusFile>().decode(node, cx)?;
                Some(RadiusRule::Fixed { radius: file.fixed as f32 })
            }
            Value::Null | Value::Bool | Value::Number(_) | Value::String(_) | Value::Array(_) => {
                choice(RadiusRule::NAMED.to_vec()).decode(node, cx)
            }
        }
    }

    fn schema(&self, definitions: &mut Definitions) -> serde_json::Value {
        let words = choice(RadiusRule::NAMED.to_vec()).schema(definitions);
        let fixed = object::<FixedRadiusFile>().schema(definitions);
        json!({ "anyOf": [words, fixed, object::<NearestRadiusFile>().schema(definitions)] })
    }
}

impl Encode for Radius {
    fn encode(&self, value: &RadiusRule) -> serde_json::Value {
        choice(RadiusRule::NAMED.to_vec()).encode(value)
    }
}
