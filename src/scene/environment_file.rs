//! The environment of the scene file: exactly what the JSON says, nothing computed.

use super::json::{Node, Value};
use super::read::{
    Context, Decode, MAX_LENGTH, any_is, color, name, object, optional, or, real, record, required,
};
use super::schema::Definitions;
use serde_json::json;

/// What surrounds the scene.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum EnvironmentFile {
    /// The same from everywhere.
    Constant(ConstantEnvironmentFile),
    /// A picture.
    Image(ImageEnvironmentFile),
}

record! {
    /// A picture of all directions: rows are latitudes, +y above; the middle column lies at -z, and to the right of it
    /// is +x.
    ImageEnvironmentFile {
        /// A Radiance (.hdr) or OpenEXR (.exr) file whose values are radiance in W·sr⁻¹·m⁻².
        image: String = required(name()),
        /// Factor on the picture's radiance.
        scale: f64 = or(real("factor on the radiance").between(0.0, MAX_LENGTH), 1.0),
        /// By how much the picture is turned about the y axis, anticlockwise seen from above.
        rotate: f64 = or(real("angle in degrees").between(-3600.0, 3600.0).unit("°"), 0.0),
        /// Its light group, as of a light.
        group: Option<String> = optional(name()),
    }
}

record! {
    /// The same light from everywhere.
    ConstantEnvironmentFile {
        /// Radiance.
        radiance: [f64; 3] = required(color("radiance").unit("W·sr⁻¹·m⁻²")),
        /// Its light group, as of a light.
        group: Option<String> = optional(name()),
    }
}

impl EnvironmentFile {
    /// Its light group.
    pub(super) fn group(&self) -> Option<&str> {
        match self {
            Self::Constant(ConstantEnvironmentFile { group, .. })
            | Self::Image(ImageEnvironmentFile { group, .. }) => group.as_deref(),
        }
    }
}

/// Reads an [`EnvironmentFile`].
pub(super) struct Surroundings;

impl Decode for Surroundings {
    type Out = EnvironmentFile;

    fn decode(&self, node: &Node<'_>, cx: &mut Context<'_>) -> Option<EnvironmentFile> {
        match &node.value {
            Value::Object(members) if any_is(members, "image") => {
                object::<ImageEnvironmentFile>().decode(node, cx).map(EnvironmentFile::Image)
            }
            Value::Null
            | Value::Bool
            | Value::Number(_)
            | Value::String(_)
            | Value::Array(_)
            | Value::Object(_) => {
                object::<ConstantEnvironmentFile>().decode(node, cx).map(EnvironmentFile::Constant)
            }
        }
    }

    fn schema(&self, definitions: &mut Definitions) -> serde_json::Value {
        let constant = object::<ConstantEnvironmentFile>().schema(definitions);
        json!({ "anyOf": [constant, object::<ImageEnvironmentFile>().schema(definitions)] })
    }
}
