//! The strict reader: from JSON values to the types of a scene file.
//!
//! A type of the file is declared once, with [`record!`] or [`tagged!`]: name, type and rule of each
//! field. A rule ([`Rule`]) says whether the field must be there; a decoder ([`Decode`]) says what its
//! value may be. A value that is wrong is noted in [`Issues`] and reading goes on, so that all errors
//! of a scene are found at once. The same declarations, with their doc comments, are the JSON Schema
//! ([`super::schema`]).

mod color;
mod numbers;
mod structure;

pub(super) use color::color;
pub(super) use numbers::{
    MAX_LENGTH, MIN_LENGTH, Scale, count, direction, pair, point, real, seed, size2, size3, uv,
};
pub(super) use structure::{
    choice, list, name, named, object, optional, or, part, reference, required, slots, triangle,
};

use super::issue::{IssueCode, Issues, pointer_step, suggestion};
use super::json::{Member, Node, Value};
use super::schema::{Definitions, Presence, Variant};
use std::collections::{BTreeSet, HashSet};

/// Longest part of a user's own string that is quoted in a message or a pointer.
const MAX_QUOTED: usize = 120;

/// Says what a value may be.
pub(super) trait Decode {
    /// What the value becomes.
    type Out;
    /// Reads the value; `None` if it is wrong, which has then been noted in `cx`.
    fn decode(&self, node: &Node<'_>, cx: &mut Context<'_>) -> Option<Self::Out>;
    /// The JSON Schema of the values that are right.
    fn schema(&self, definitions: &mut Definitions) -> serde_json::Value;
}

/// A decoder whose values can be written: one of a field with a default.
pub(super) trait Encode: Decode {
    /// The JSON that reads as `value`.
    fn encode(&self, value: &Self::Out) -> serde_json::Value;
}

/// Says what a field of a record becomes, there or not.
pub(super) trait Rule {
    /// What the field becomes.
    type Out;
    /// Reads the field called `name`; `None` if it is wrong, which has then been noted.
    fn take(&self, name: &'static str, fields: &mut Fields<'_, '_, '_>) -> Option<Self::Out>;
    /// The JSON Schema of the field's value, and whether it must be there.
    fn schema(&self, definitions: &mut Definitions) -> (serde_json::Value, Presence);
}

/// Something read from the fields of a JSON object.
pub(super) trait Record: Sized {
    /// The type's own name, which ends in `File`.
    const NAME: &'static str;
    /// What it is, for the readers of the format.
    const DOC: &'static str;
    /// Takes its fields; `None` if something was wrong, which has then been noted.
    fn read(fields: &mut Fields<'_, '_, '_>) -> Option<Self>;
    /// The fields it may have: one list, or one for each value of `type`.
    fn variants(definitions: &mut Definitions) -> Vec<Variant>;
}

/// Where the reader is, what it has found wrong, and the names that values may refer to.
pub(super) struct Context<'n> {
    path: Vec<Step>,
    pub(super) issues: Issues,
    pub(super) materials: BTreeSet<&'n str>,
}

enum Step {
    Key(String),
    Field(&'static str),
    Index(usize),
}

impl<'n> Context<'n> {
    pub(super) fn new(issues: Issues, materials: BTreeSet<&'n str>) -> Self {
        Self { path: Vec::new(), issues, materials }
    }

    /// Notes an error in the value that is being read.
    pub(super) fn issue(&mut self, code: IssueCode, message: impl Into<String>) {
        self.issues.add(self.pointer(), code, message);
    }

    /// Notes a value of the wrong JSON type.
    pub(super) fn wrong_type(&mut self, expected: &str, node: &Node<'_>) {
        self.issue(IssueCode::WrongType, format!("expected {expected}, found {}", node.kind()));
    }

    fn pointer(&self) -> String {
        self.path.iter().fold(String::new(), |pointer, step| match step {
            Step::Key(key) => pointer_step(&pointer, key),
            Step::Field(name) => pointer_step(&pointer, name),
            Step::Index(index) => format!("{pointer}/{index}"),
        })
    }

    fn within<T>(&mut self, step: Step, read: impl FnOnce(&mut Self) -> T) -> T {
        self.path.push(step);
        let result = read(self);
        self.path.pop();
        result
    }
}

/// The fields of one JSON object while a record is read from it.
pub(super) struct Fields<'c, 'm, 'n> {
    members: &'m [Member<'m>],
    known: Vec<&'static str>,
    complete: bool,
    cx: &'c mut Context<'n>,
}

impl<'c, 'm, 'n> Fields<'c, 'm, 'n> {
    /// Reads a record from a value, and notes the fields it does not know.
    pub(super) fn read<T: Record>(node: &'m Node<'m>, cx: &'c mut Context<'n>) -> Option<T> {
        let Value::Object(members) = &node.value else {
            cx.wrong_type("an object", node);
            return None;
        };
        let mut fields = Fields { members, known: Vec::new(), complete: true, cx };
        let record = T::read(&mut fields);
        fields.note_unknown();
        record
    }

    /// The value of a field, if it is there.
    fn find(&mut self, name: &'static str) -> Option<&'m Node<'m>> {
        self.known.push(name);
        self.members.iter().find(|member| member.key == name).map(|member| &member.node)
    }

    /// Reads a field's value, if it is there.
    pub(super) fn decode<D: Decode>(&mut self, name: &'static str, decoder: &D) -> Option<Option<D::Out>> {
        let node = self.find(name)?;
        Some(self.cx.within(Step::Field(name), |cx| decoder.decode(node, cx)))
    }

    /// Notes that a field is missing.
    pub(super) fn missing(&mut self, name: &'static str, expected: &str) {
        let pointer = pointer_step(&self.cx.pointer(), name);
        let message = format!("the field `{name}` is missing{expected}");
        self.cx.issues.add(pointer, IssueCode::MissingField, message);
    }

    /// Reads the field that says which of several records this is.
    pub(super) fn tag(&mut self, name: &'static str, tags: &'static [&'static str]) -> Option<&'static str> {
        let decoder = choice(tags.iter().map(|tag| (*tag, *tag)).collect());
        let tag = match self.decode(name, &decoder) {
            Some(tag) => tag,
            None => {
                self.missing(name, &format!("; expected one of `{}`", tags.join("`, `")));
                None
            }
        };
        // Which fields belong here is not known without the tag.
        self.complete &= tag.is_some();
        tag
    }

    fn note_unknown(&mut self) {
        for member in self.members {
            let key = member.key.as_ref();
            if !self.complete || self.known.contains(&key) {
                continue;
            }
            let pointer = pointer_step(&self.cx.pointer(), &quoted(key));
            let hint = match self.cx.issues.is_full() {
                true => String::new(),
                false => suggestion(key, self.known.iter().copied()),
            };
            let message = format!("there is no field `{}` here{hint}", quoted(key));
            self.cx.issues.add_at(pointer, IssueCode::UnknownField, message, Some(member.key_offset));
        }
    }
}

/// Notes every key that is given twice in one object.
pub(super) fn note_duplicates(node: &Node<'_>, cx: &mut Context<'_>) {
    match &node.value {
        Value::Array(items) => {
            for (index, item) in items.iter().enumerate() {
                if matches!(item.value, Value::Array(_) | Value::Object(_)) {
                    cx.within(Step::Index(index), |cx| note_duplicates(item, cx));
                }
            }
        }
        Value::Object(members) => {
            let mut seen = HashSet::with_capacity(members.len());
            for member in members {
                let key = member.key.as_ref();
                if !seen.insert(key) {
                    let pointer = pointer_step(&cx.pointer(), &quoted(key));
                    let message = format!("the field `{}` is given twice", quoted(key));
                    cx.issues.add_at(pointer, IssueCode::DuplicateKey, message, Some(member.key_offset));
                }
                cx.within(Step::Key(quoted(key)), |cx| note_duplicates(&member.node, cx));
            }
        }
        Value::Null | Value::Bool | Value::Number(_) | Value::String(_) => {}
    }
}

/// Whether an object has a field of this name.
pub(super) fn any_is(members: &[Member<'_>], name: &str) -> bool {
    members.iter().any(|member| member.key == name)
}

/// The start of a user's string, for a message.
pub(super) fn quoted(text: &str) -> String {
    match text.char_indices().nth(MAX_QUOTED) {
        Some((end, _)) => format!("{}…", text.get(..end).unwrap_or_default()),
        None => text.to_owned(),
    }
}

/// Declares a struct of the scene file: each field with its type and the [`Rule`] it is read by. The doc
/// comments are also the descriptions in the JSON Schema.
///
/// A last field after `..` is a record of its own whose fields stand in the same JSON object.
macro_rules! record {
    ($(#[doc = $doc:literal])* $record:ident {
        $($(#[doc = $field_doc:literal])* $field:ident: $type:ty = $rule:expr,)*
        $(..$(#[doc = $inner_doc:literal])* $inner:ident: $inner_type:ty)?
    }) => {
        $(#[doc = $doc])*
        #[derive(Clone, Debug, PartialEq)]
        pub(super) struct $record {
            $($(#[doc = $field_doc])* pub(super) $field: $type,)*
            $($(#[doc = $inner_doc])* pub(super) $inner: $inner_type,)?
        }

        impl $crate::scene::read::Record for $record {
            const NAME: &'static str = stringify!($record);
            const DOC: &'static str = concat!($($doc),*);

            fn read(fields: &mut $crate::scene::read::Fields<'_, '_, '_>) -> Option<Self> {
                $(let $field = $crate::scene::read::Rule::take(&$rule, stringify!($field), fields);)*
                $(let $inner = <$inner_type as $crate::scene::read::Record>::read(fields);)?
                Some(Self { $($field: $field?,)* $($inner: $inner?,)? })
            }

            fn variants(
                definitions: &mut $crate::scene::schema::Definitions,
            ) -> Vec<$crate::scene::schema::Variant> {
                let fields = vec![$(definitions.field(stringify!($field), concat!($($field_doc),*), &$rule)),*];
                let inner = vec![$(<$inner_type as $crate::scene::read::Record>::variants(definitions))?];
                $crate::scene::schema::Variant::of(Self::DOC, fields, inner)
            }
        }
    };
}

/// Declares an enum of records, chosen by the field `type`.
macro_rules! tagged {
    ($(#[doc = $doc:literal])* $enum:ident { $($tag:literal => $variant:ident($record:ty),)* }) => {
        $(#[doc = $doc])*
        #[derive(Clone, Debug, PartialEq)]
        pub(super) enum $enum {
            $($variant($record),)*
        }

        impl $crate::scene::read::Record for $enum {
            const NAME: &'static str = stringify!($enum);
            const DOC: &'static str = concat!($($doc),*);

            fn read(fields: &mut $crate::scene::read::Fields<'_, '_, '_>) -> Option<Self> {
                match fields.tag("type", &[$($tag),*])? {
                    $($tag => <$record as $crate::scene::read::Record>::read(fields).map(Self::$variant),)*
                    _ => None,
                }
            }

            fn variants(
                definitions: &mut $crate::scene::schema::Definitions,
            ) -> Vec<$crate::scene::schema::Variant> {
                let mut variants = Vec::new();
                $({
                    let of_record = <$record as $crate::scene::read::Record>::variants(definitions);
                    variants.extend(of_record.into_iter().map(|variant| variant.tagged($tag)));
                })*
                variants
            }
        }
    };
}

pub(super) use {record, tagged};
