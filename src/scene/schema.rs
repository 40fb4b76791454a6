//! The scene file's JSON Schema (draft 2020-12), from the very declarations that read it.
//!
//! What a schema cannot say (whether a name exists, a polygon is flat, two fields exclude each other) only the
//! reader checks.

mod markdown;

use super::file::SceneFile;
use super::read::{Record, Rule};
use serde_json::{Map, Value, json};

/// The JSON Schema of scene files. `x-unit` is the unit of a number, or of each number of an array.
#[must_use]
pub fn schema() -> Value {
    let mut definitions = Definitions::default();
    let root = definitions.describe::<SceneFile>();
    let mut schema = root.schema();
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema".into();
    schema["title"] = "Nephroid scene".into();
    let named = definitions.records.iter().map(|record| (record.name.clone(), record.schema()));
    schema["$defs"] = named.collect::<Map<_, _>>().into();
    schema
}

/// The same for people: a page in Markdown.
#[must_use]
pub fn schema_markdown() -> String {
    let mut definitions = Definitions::default();
    let root = definitions.describe::<SceneFile>();
    markdown::page(&root, &definitions.records)
}

/// The records that a schema refers to by name, in the order of their first use.
#[derive(Default)]
pub(super) struct Definitions {
    records: Vec<RecordDoc>,
}

/// A record of the scene file.
struct RecordDoc {
    name: String,
    doc: String,
    variants: Vec<Variant>,
}

/// The fields that stand together in one JSON object.
pub(super) struct Variant {
    /// Value of the field `type`, if the record has several variants.
    tag: Option<&'static str>,
    doc: String,
    fields: Vec<Field>,
}

/// A field of a record.
#[derive(Clone, PartialEq)]
pub(super) struct Field {
    name: &'static str,
    doc: String,
    schema: Value,
    presence: Presence,
}

/// Whether a field must be there.
#[derive(Clone, PartialEq)]
pub(super) enum Presence {
    /// It must.
    Required,
    /// It may be left out.
    Optional,
    /// It may be left out, and then has this value.
    Default(Value),
}

impl Definitions {
    /// A reference to a record, which is described if this is its first.
    pub(super) fn refer<T: Record>(&mut self) -> Value {
        let name = definition_name(T::NAME);
        if !self.records.iter().any(|record| record.name == name) {
            // Its place is taken first: a record may hold itself.
            let place = self.records.len();
            self.records.push(RecordDoc { name: name.clone(), doc: String::new(), variants: Vec::new() });
            self.records[place] = self.describe::<T>();
        }
        json!({ "$ref": format!("#/$defs/{name}") })
    }

    fn describe<T: Record>(&mut self) -> RecordDoc {
        let (name, doc) = (definition_name(T::NAME), text(T::DOC));
        RecordDoc { name, doc, variants: T::variants(self) }
    }

    /// A field with the text of its doc comment.
    pub(super) fn field(&mut self, name: &'static str, doc: &str, rule: &impl Rule) -> Field {
        let (schema, presence) = rule.schema(self);
        Field { name, doc: text(doc), schema, presence }
    }
}

impl Variant {
    /// The variants of a record whose fields are followed by those of `inner` records.
    pub(super) fn of(doc: &str, fields: Vec<Field>, inner: Vec<Vec<Self>>) -> Vec<Self> {
        if inner.is_empty() {
            return vec![Self { tag: None, doc: text(doc), fields }];
        }
        let with_outer =
            |variant: Self| Self { fields: [fields.clone(), variant.fields].concat(), ..variant };
        inner.into_iter().flatten().map(with_outer).collect()
    }

    /// Chosen by this value of the field `type`.
    pub(super) fn tagged(self, tag: &'static str) -> Self {
        Self { tag: Some(tag), ..self }
    }

    fn schema(&self) -> Value {
        let tag = self.tag.map(|tag| ("type", json!({ "const": tag })));
        let required = tag
            .iter()
            .map(|(name, _)| *name)
            .chain(self.fields.iter().filter(|f| matches!(f.presence, Presence::Required)).map(|f| f.name));
        let required: Vec<&str> = required.collect();
        let fields = self.fields.iter().map(|field| (field.name, field.schema()));
        let properties: Map<String, Value> =
            tag.into_iter().chain(fields).map(|(name, schema)| (name.to_owned(), schema)).collect();
        json!({ "type": "object", "description": self.doc, "properties": properties, "required": required,
                "additionalProperties": false })
    }
}

impl Field {
    fn schema(&self) -> Value {
        let mut schema = self.schema.clone();
        schema["description"] = self.doc.as_str().into();
        match &self.presence {
            Presence::Required | Presence::Optional => {}
            Presence::Default(value) => schema["default"] = value.clone(),
        }
        schema
    }
}

impl RecordDoc {
    fn schema(&self) -> Value {
        if let [only] = &self.variants[..]
            && only.tag.is_none()
        {
            return only.schema();
        }
        let tags: Vec<&str> = self.variants.iter().filter_map(|variant| variant.tag).collect();
        let variants: Vec<Value> = self.variants.iter().map(Variant::schema).collect();
        json!({ "description": self.doc, "type": "object", "required": ["type"],
                "properties": { "type": { "enum": tags } }, "oneOf": variants })
    }
}

/// The lines of a doc comment as one text.
fn text(doc: &str) -> String {
    doc.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// `QuadLightFile` is `quad_light`.
fn definition_name(record: &str) -> String {
    let mut name = String::new();
    for c in record.trim_end_matches("File").chars() {
        if c.is_uppercase() && !name.is_empty() {
            name.push('_');
        }
        name.extend(c.to_lowercase());
    }
    name
}
