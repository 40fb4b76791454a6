//! The scene file's reference as a page in Markdown.

use super::{Field, Presence, RecordDoc, Variant};
use serde_json::Value;
use std::fmt::Write;

/// Bounds beyond this are those of every coordinate, which the page says once.
const UNLIMITED: f64 = 1e9;

const INTRODUCTION: &str = "\
# The scene file, version 1

<!-- Written by `nephroid schema --markdown > docs/scene-format.md`; a test compares the two. -->

A scene is one JSON document. Lengths are metres, angles degrees. A colour is linear `[r, g, b]`, or `\"#rrggbb\"`,
which is sRGB. Coordinates and lengths reach up to 1e9 m, amounts of light up to 1e12. A field that does not exist, is
given twice, or has a wrong value is an error, and all errors of a scene are reported at once, each with its place.

The same as a JSON Schema: `nephroid schema`, or `GET /v1/schema` of the service.

";

/// The page: the root first, then each record in the order of its first use.
pub(super) fn page(root: &RecordDoc, records: &[RecordDoc]) -> String {
    let mut page = INTRODUCTION.to_owned();
    for record in std::iter::once(root).chain(records) {
        section(&mut page, record);
    }
    page.truncate(page.trim_end().len());
    page.push('\n');
    page
}

fn section(page: &mut String, record: &RecordDoc) {
    // Writing to a string does not fail.
    let _ = writeln!(page, "## {}\n\n{}\n", record.name, record.doc);
    // What all variants have is said once.
    let shared = shared(&record.variants);
    if let Some(variant) = record.variants.first().filter(|_| shared > 0) {
        let _ = writeln!(page, "Of every type:\n");
        table(page, variant.fields.get(..shared).unwrap_or_default());
    }
    for variant in &record.variants {
        if let Some(tag) = variant.tag {
            let _ = writeln!(page, "### {} `\"type\": \"{tag}\"`\n\n{}\n", record.name, variant.doc);
        }
        table(page, variant.fields.get(shared..).unwrap_or_default());
    }
}

/// Number of fields at the start that are the same in all variants.
fn shared(variants: &[Variant]) -> usize {
    let Some((first, others)) = variants.split_first() else { return 0 };
    let everywhere = |(i, field): &(usize, &Field)| others.iter().all(|v| v.fields.get(*i) == Some(*field));
    if others.is_empty() { 0 } else { first.fields.iter().enumerate().take_while(everywhere).count() }
}

fn table(page: &mut String, fields: &[Field]) {
    if fields.is_empty() {
        return;
    }
    let _ = writeln!(page, "| field | value | unit | if left out | |\n|---|---|---|---|---|");
    for field in fields {
        let left_out = match &field.presence {
            Presence::Required => "required".to_owned(),
            Presence::Optional => String::new(),
            Presence::Default(value) => format!("`{value}`"),
        };
        let (kind, unit) = (kind(&field.schema), unit(&field.schema).unwrap_or_default());
        let _ = writeln!(page, "| `{}` | {kind} | {unit} | {left_out} | {} |", field.name, field.doc);
    }
    page.push('\n');
}

/// What a value may be, in words.
fn kind(schema: &Value) -> String {
    if let Some(name) = schema["$ref"].as_str().and_then(|r| r.strip_prefix("#/$defs/")) {
        return format!("[{name}](#{name})");
    }
    if let Some(words) = schema["enum"].as_array() {
        return words.iter().map(|word| format!("`{word}`")).collect::<Vec<_>>().join(", ");
    }
    if let Some(kinds) = schema["anyOf"].as_array() {
        return kinds.iter().map(kind).collect::<Vec<_>>().join(" or ");
    }
    if let Some(only) = schema.get("const") {
        return format!("`{only}`");
    }
    let named = schema["title"].as_str();
    match schema["type"].as_str() {
        Some("array") => match named {
            Some(title) if schema["items"]["type"].is_string() => {
                format!("{title}{}", limits(&schema["items"]))
            }
            Some(title) => format!("{title}: {}", kind(&schema["items"])),
            None => format!("a list of {}{}", least(schema), kind(&schema["items"])),
        },
        Some("object") => format!("names, each with {}", kind(&schema["additionalProperties"])),
        Some("number") => format!("a number{}", limits(schema)),
        Some("integer") => format!("a whole number{}", limits(schema)),
        Some(_) | None => named.unwrap_or("a text").to_owned(),
    }
}

/// Least number of elements of a list.
fn least(schema: &Value) -> String {
    match schema["minItems"].as_u64() {
        None | Some(0) => String::new(),
        Some(least) => format!("at least {least}: "),
    }
}

fn limits(schema: &Value) -> String {
    let limits = [("minimum", "≥"), ("exclusiveMinimum", ">"), ("maximum", "≤"), ("exclusiveMaximum", "<")];
    let known = limits.iter().filter_map(|(key, sign)| Some((schema[*key].as_f64()?, &schema[*key], sign)));
    let tight = known.filter(|(bound, _, _)| bound.abs() < UNLIMITED);
    let words: Vec<String> = tight.map(|(_, bound, sign)| format!("{sign} {bound}")).collect();
    if words.is_empty() { String::new() } else { format!(", {}", words.join(", ")) }
}

fn unit(schema: &Value) -> Option<&str> {
    if let Some(unit) = schema["x-unit"].as_str() {
        return Some(unit);
    }
    let inner = schema["anyOf"].as_array().into_iter().flatten().chain(schema.get("items"));
    inner.filter_map(unit).next()
}
