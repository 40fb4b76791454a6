//! Rules of fields, and decoders of words, lists and records.

use super::super::issue::{IssueCode, suggestion};
use super::super::json::{Node, Value};
use super::super::schema::{Definitions, Presence};
use super::numbers::{Count, Tuple, count};
use super::{Context, Decode, Encode, Fields, Record, Rule, Step, quoted};
use serde_json::json;
use std::marker::PhantomData;

/// Longest name.
const MAX_NAME: usize = 200;

/// The field must be there.
pub(in crate::scene) fn required<D: Decode>(decoder: D) -> Required<D> {
    Required(decoder)
}

/// The field may be left out.
pub(in crate::scene) fn optional<D: Decode>(decoder: D) -> Optional<D> {
    Optional(decoder)
}

/// The field may be left out and is then `default`.
pub(in crate::scene) fn or<D: Encode<Out: Clone>>(decoder: D, default: D::Out) -> Or<D> {
    Or(decoder, default)
}

/// The rest of the record is of use even if this field is wrong: then it becomes `None`.
pub(in crate::scene) fn part<R: Rule>(rule: R) -> Part<R> {
    Part(rule)
}

pub(in crate::scene) struct Required<D>(D);
pub(in crate::scene) struct Optional<D>(D);
pub(in crate::scene) struct Or<D: Decode>(D, D::Out);
pub(in crate::scene) struct Part<R>(R);

impl<D: Decode> Rule for Required<D> {
    type Out = D::Out;

    fn take(&self, name: &'static str, fields: &mut Fields<'_, '_, '_>) -> Option<D::Out> {
        let value = fields.decode(name, &self.0);
        if value.is_none() {
            fields.missing(name, "");
        }
        value?
    }

    fn schema(&self, definitions: &mut Definitions) -> (serde_json::Value, Presence) {
        (self.0.schema(definitions), Presence::Required)
    }
}

impl<D: Decode> Rule for Optional<D> {
    type Out = Option<D::Out>;

    fn take(&self, name: &'static str, fields: &mut Fields<'_, '_, '_>) -> Option<Self::Out> {
        match fields.decode(name, &self.0) {
            Some(value) => value.map(Some),
            None => Some(None),
        }
    }

    fn schema(&self, definitions: &mut Definitions) -> (serde_json::Value, Presence) {
        (self.0.schema(definitions), Presence::Optional)
    }
}

impl<D: Encode<Out: Clone>> Rule for Or<D> {
    type Out = D::Out;

    fn take(&self, name: &'static str, fields: &mut Fields<'_, '_, '_>) -> Option<D::Out> {
        fields.decode(name, &self.0).unwrap_or_else(|| Some(self.1.clone()))
    }

    fn schema(&self, definitions: &mut Definitions) -> (serde_json::Value, Presence) {
        (self.0.schema(definitions), Presence::Default(self.0.encode(&self.1)))
    }
}

impl<R: Rule> Rule for Part<R> {
    type Out = Option<R::Out>;

    fn take(&self, name: &'static str, fields: &mut Fields<'_, '_, '_>) -> Option<Self::Out> {
        Some(self.0.take(name, fields))
    }

    fn schema(&self, definitions: &mut Definitions) -> (serde_json::Value, Presence) {
        self.0.schema(definitions)
    }
}

/// Reads a [`Record`] from an object.
pub(in crate::scene) fn object<T: Record>() -> RecordOf<T> {
    RecordOf(PhantomData)
}

pub(in crate::scene) struct RecordOf<T>(PhantomData<T>);

impl<T: Record> Decode for RecordOf<T> {
    type Out = T;

    fn decode(&self, node: &Node<'_>, cx: &mut Context<'_>) -> Option<T> {
        Fields::read(node, cx)
    }

    fn schema(&self, definitions: &mut Definitions) -> serde_json::Value {
        definitions.refer::<T>()
    }
}

impl<T: Record + Default + PartialEq> Encode for RecordOf<T> {
    /// A record in which nothing is given, whose fields all have their defaults.
    fn encode(&self, _value: &T) -> serde_json::Value {
        json!({})
    }
}

/// A list of at least `min` values; wrong if one of them is.
pub(in crate::scene) fn list<D: Decode>(min: usize, item: D) -> List<D> {
    List { min, item }
}

pub(in crate::scene) struct List<D> {
    min: usize,
    item: D,
}

impl<D: Decode> Decode for List<D> {
    type Out = Vec<D::Out>;

    fn decode(&self, node: &Node<'_>, cx: &mut Context<'_>) -> Option<Self::Out> {
        let slots = Slots(&self.item).decode(node, cx)?;
        if slots.len() < self.min {
            let message = format!("expected at least {} elements, found {}", self.min, slots.len());
            cx.issue(IssueCode::WrongLength, message);
            return None;
        }
        slots.into_iter().collect()
    }

    fn schema(&self, definitions: &mut Definitions) -> serde_json::Value {
        json!({ "type": "array", "items": self.item.schema(definitions), "minItems": self.min })
    }
}

impl<D: Encode> Encode for List<D> {
    fn encode(&self, value: &Self::Out) -> serde_json::Value {
        value.iter().map(|item| self.item.encode(item)).collect()
    }
}

/// A list in which each value is read for itself: the wrong ones become `None`.
pub(in crate::scene) fn slots<D: Decode>(item: D) -> Slots<D> {
    Slots(item)
}

pub(in crate::scene) struct Slots<D>(D);

impl<D: Decode> Decode for Slots<D> {
    type Out = Vec<Option<D::Out>>;

    fn decode(&self, node: &Node<'_>, cx: &mut Context<'_>) -> Option<Self::Out> {
        let Value::Array(items) = &node.value else {
            cx.wrong_type("an array", node);
            return None;
        };
        let read = |(index, item)| cx.within(Step::Index(index), |cx| self.0.decode(item, cx));
        Some(items.iter().enumerate().map(read).collect())
    }

    fn schema(&self, definitions: &mut Definitions) -> serde_json::Value {
        json!({ "type": "array", "items": self.0.schema(definitions) })
    }
}

impl<D: Decode> Encode for Slots<D> {
    /// As a default there is nothing in it.
    fn encode(&self, _value: &Self::Out) -> serde_json::Value {
        json!([])
    }
}

impl<D: Decode> Decode for &D {
    type Out = D::Out;

    fn decode(&self, node: &Node<'_>, cx: &mut Context<'_>) -> Option<D::Out> {
        (*self).decode(node, cx)
    }

    fn schema(&self, definitions: &mut Definitions) -> serde_json::Value {
        (*self).schema(definitions)
    }
}

/// An object whose keys are names; the wrong values become `None`.
pub(in crate::scene) fn named<D: Decode>(item: D) -> Named<D> {
    Named(item)
}

pub(in crate::scene) struct Named<D>(D);

impl<D: Decode> Decode for Named<D> {
    type Out = Vec<(String, Option<D::Out>)>;

    fn decode(&self, node: &Node<'_>, cx: &mut Context<'_>) -> Option<Self::Out> {
        let Value::Object(members) = &node.value else {
            cx.wrong_type("an object that maps names to values", node);
            return None;
        };
        let mut entries = Vec::with_capacity(members.len());
        for member in members {
            let value = cx.within(Step::Key(quoted(&member.key)), |cx| {
                check_name(&member.key, cx).and_then(|()| self.0.decode(&member.node, cx))
            });
            entries.push((member.key.clone().into_owned(), value));
        }
        Some(entries)
    }

    fn schema(&self, definitions: &mut Definitions) -> serde_json::Value {
        let item = self.0.schema(definitions);
        json!({ "type": "object", "propertyNames": name_schema(), "additionalProperties": item })
    }
}

impl<D: Decode> Encode for Named<D> {
    /// As a default there is nothing in it.
    fn encode(&self, _value: &Self::Out) -> serde_json::Value {
        json!({})
    }
}

fn name_schema() -> serde_json::Value {
    json!({ "type": "string", "minLength": 1, "maxLength": MAX_NAME })
}

/// A string that names something: not empty, not overlong.
pub(in crate::scene) fn name() -> Name {
    Name
}

/// Any string.
struct Text;
pub(in crate::scene) struct Name;

impl Decode for Text {
    type Out = String;

    fn decode(&self, node: &Node<'_>, cx: &mut Context<'_>) -> Option<String> {
        let Value::String(text) = &node.value else {
            cx.wrong_type("a string", node);
            return None;
        };
        Some(text.clone().into_owned())
    }

    fn schema(&self, _definitions: &mut Definitions) -> serde_json::Value {
        json!({ "type": "string" })
    }
}

impl Decode for Name {
    type Out = String;

    fn decode(&self, node: &Node<'_>, cx: &mut Context<'_>) -> Option<String> {
        let name = Text.decode(node, cx)?;
        check_name(&name, cx).map(|()| name)
    }

    fn schema(&self, _definitions: &mut Definitions) -> serde_json::Value {
        name_schema()
    }
}

fn check_name(name: &str, cx: &mut Context<'_>) -> Option<()> {
    let length = name.chars().count();
    if (1..=MAX_NAME).contains(&length) {
        return Some(());
    }
    cx.issue(IssueCode::WrongLength, format!("a name has 1 to {MAX_NAME} characters, this has {length}"));
    None
}

/// The name of a material of the same scene.
pub(in crate::scene) fn reference() -> Reference {
    Reference
}

pub(in crate::scene) struct Reference;

impl Decode for Reference {
    type Out = String;

    fn decode(&self, node: &Node<'_>, cx: &mut Context<'_>) -> Option<String> {
        let name = Text.decode(node, cx)?;
        if cx.materials.contains(name.as_str()) {
            return Some(name);
        }
        let hint = match cx.issues.is_full() {
            true => String::new(),
            false => suggestion(&name, cx.materials.iter().copied()),
        };
        let message = format!("there is no material `{}`{hint}", quoted(&name));
        cx.issue(IssueCode::UnknownReference, message);
        None
    }

    fn schema(&self, _definitions: &mut Definitions) -> serde_json::Value {
        name_schema()
    }
}

/// One of several words, each with what it stands for.
pub(in crate::scene) fn choice<T: Copy>(words: Vec<(&'static str, T)>) -> Choice<T> {
    Choice(words)
}

pub(in crate::scene) struct Choice<T>(Vec<(&'static str, T)>);

impl<T: Copy> Decode for Choice<T> {
    type Out = T;

    fn decode(&self, node: &Node<'_>, cx: &mut Context<'_>) -> Option<T> {
        let words = || self.0.iter().map(|(word, _)| *word);
        let Value::String(found) = &node.value else {
            cx.wrong_type(&format!("one of `{}`", words().collect::<Vec<_>>().join("`, `")), node);
            return None;
        };
        let chosen = self.0.iter().find(|(word, _)| found == word).map(|(_, value)| *value);
        if chosen.is_none() {
            let message = format!("`{}` is not known here{}", quoted(found), suggestion(found, words()));
            cx.issue(IssueCode::UnknownValue, message);
        }
        chosen
    }

    fn schema(&self, _definitions: &mut Definitions) -> serde_json::Value {
        json!({ "enum": self.0.iter().map(|(word, _)| *word).collect::<Vec<_>>() })
    }
}

impl<T: Copy + PartialEq> Encode for Choice<T> {
    fn encode(&self, value: &T) -> serde_json::Value {
        self.0
            .iter()
            .find(|(_, known)| known == value)
            .map_or(serde_json::Value::Null, |(word, _)| json!(word))
    }
}

/// Three indices of vertices.
pub(in crate::scene) fn triangle() -> Tuple<3, Count> {
    Tuple::new("a triangle [a, b, c]", count("index of a vertex", 0, u32::MAX))
}
