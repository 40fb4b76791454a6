//! The decoder of colours.

use super::super::issue::IssueCode;
use super::super::json::{Node, Value};
use super::super::schema::Definitions;
use super::numbers::{Real, Tuple, real};
use super::{Context, Decode, Encode, quoted};
use crate::develop::srgb_to_linear;
use serde_json::json;

/// Largest amount of light per channel, in whatever unit.
const MAX_LIGHT: f64 = 1e12;

/// A colour: linear `[r, g, b]`, or `"#rrggbb"` in sRGB.
#[derive(Clone, Copy, Debug)]
pub(in crate::scene) struct Color {
    what: &'static str,
    unit: Option<&'static str>,
    max: f64,
}

/// An amount of light per channel.
pub(in crate::scene) fn color(what: &'static str) -> Color {
    Color { what, unit: None, max: MAX_LIGHT }
}

impl Color {
    /// A fraction of the light, 0 to 1.
    pub(in crate::scene) fn fraction(self) -> Self {
        Self { max: 1.0, ..self }
    }

    /// The unit it is given in, for the schema.
    pub(in crate::scene) fn unit(self, unit: &'static str) -> Self {
        Self { unit: Some(unit), ..self }
    }

    /// Up to `max` per channel.
    pub(in crate::scene) fn up_to(self, max: f64) -> Self {
        Self { max, ..self }
    }

    fn linear(&self) -> Tuple<3, Real> {
        Tuple::new("a colour [r, g, b]", real(self.what).between(0.0, self.max))
    }
}

impl Decode for Color {
    type Out = [f64; 3];

    fn decode(&self, node: &Node<'_>, cx: &mut Context<'_>) -> Option<[f64; 3]> {
        match &node.value {
            Value::String(hex) => {
                let color = hex_color(hex);
                if color.is_none() {
                    let message = format!("expected {}: \"#rrggbb\", found \"{}\"", self.what, quoted(hex));
                    cx.issue(IssueCode::UnknownValue, message);
                }
                color
            }
            Value::Array(_) => self.linear().decode(node, cx),
            Value::Null | Value::Bool | Value::Number(_) | Value::Object(_) => {
                cx.wrong_type(&format!("{}: a colour [r, g, b] or \"#rrggbb\"", self.what), node);
                None
            }
        }
    }

    fn schema(&self, definitions: &mut Definitions) -> serde_json::Value {
        let hexadecimal =
            json!({ "title": "`\"#rrggbb\"`", "type": "string", "pattern": "^#[0-9a-fA-F]{6}$" });
        let mut schema = json!({ "anyOf": [self.linear().schema(definitions), hexadecimal] });
        if let Some(unit) = self.unit {
            schema["x-unit"] = unit.into();
        }
        schema
    }
}

impl Encode for Color {
    fn encode(&self, value: &[f64; 3]) -> serde_json::Value {
        self.linear().encode(value)
    }
}

fn hex_color(text: &str) -> Option<[f64; 3]> {
    let digits =
        text.strip_prefix('#').filter(|d| d.len() == 6 && d.bytes().all(|b| b.is_ascii_hexdigit()))?;
    let packed = u32::from_str_radix(digits, 16).ok()?;
    let [_, r, g, b] = packed.to_be_bytes();
    Some([r, g, b].map(|byte| srgb_to_linear(f64::from(byte) / 255.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hexadecimal_colours_are_srgb() {
        let [r, g, b] = hex_color("#ff0080").unwrap();
        assert_eq!((r, g), (1.0, 0.0));
        // The sRGB curve at 128/255.
        assert!((b - 0.215_860_5).abs() < 1e-6, "{b}");
        for bad in ["ff0080", "#ff008", "#ff00800", "#gg0000", "#", "", "#é00000", "#+12345"] {
            assert_eq!(hex_color(bad), None, "{bad}");
        }
    }
}
