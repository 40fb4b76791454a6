//! The OpenAPI document: what is written at the handlers and types, and the scene's own schema.

use crate::routes::description;
use crate::{engine, wire};
use axum::http::header;
use axum::response::{IntoResponse, Response};
use serde_json::{Map, Value, json};
use std::sync::LazyLock;
use utoipa::{PartialSchema, ToSchema};

static TEXT: LazyLock<String> = LazyLock::new(|| format!("{:#}\n", document()));

/// A scene file: its schema is the renderer's own.
#[derive(Debug, ToSchema)]
pub struct Scene {}

/// `GET /openapi.json`
pub(crate) async fn get_document() -> Response {
    let head = [(header::CONTENT_TYPE, "application/json"), (header::CACHE_CONTROL, "no-cache")];
    (head, TEXT.as_str()).into_response()
}

/// The document as text, as `nephroid-api openapi` prints it.
#[must_use]
pub fn text() -> String {
    TEXT.clone()
}

/// The document.
#[must_use]
pub fn document() -> Value {
    let mut document = serde_json::to_value(description()).unwrap_or_default();
    document["info"] = json!({
        "title": "Nephroid",
        "version": env!("CARGO_PKG_VERSION"),
        "description": "A scene goes in as JSON, a picture comes out when it is ready.",
        "license": { "name": "MIT OR Apache-2.0", "identifier": "MIT OR Apache-2.0" },
    });
    document["servers"] = json!([{ "url": "/" }]);
    document["components"]["securitySchemes"] = json!({
        "key": { "type": "http", "scheme": "bearer", "description": "Needed once a key was made, unless the service is open." },
    });
    let schemas = &mut document["components"]["schemas"];
    schemas["Problem"] = serde_json::to_value(wire::Problem::schema()).unwrap_or_default();
    schemas["ProblemError"] = serde_json::to_value(wire::ProblemError::schema()).unwrap_or_default();
    add_scene(schemas);
    let paths = document["paths"].as_object_mut().into_iter().flat_map(Map::values_mut);
    for operation in paths.filter_map(Value::as_object_mut).flat_map(Map::values_mut) {
        complete(operation);
    }
    document
}

/// Puts the schema of scenes among those of the document.
fn add_scene(schemas: &mut Value) {
    let mut scene = engine::scene_schema();
    let definitions = scene.as_object_mut().and_then(|scene| {
        scene.remove("$schema");
        scene.remove("$id");
        scene.remove("$defs")
    });
    move_references(&mut scene);
    schemas["Scene"] = scene;
    for (name, mut definition) in definitions.as_ref().and_then(Value::as_object).cloned().unwrap_or_default()
    {
        move_references(&mut definition);
        schemas[format!("Scene.{name}")] = definition;
    }
}

fn move_references(schema: &mut Value) {
    match schema {
        Value::Object(members) => {
            if let Some(Value::String(reference)) = members.get_mut("$ref")
                && let Some(name) = reference.strip_prefix("#/$defs/")
            {
                *reference = format!("#/components/schemas/Scene.{name}");
            }
            members.values_mut().for_each(move_references);
        }
        Value::Array(items) => items.iter_mut().for_each(move_references),
        _ => {}
    }
}

/// Adds what is the same everywhere: what anything can fail with, and what a failure looks like.
fn complete(operation: &mut Value) {
    let needs_key = operation.get("security").is_some();
    if needs_key {
        // Whether it is needed depends on whether there are keys.
        operation["security"] = json!([{}, { "key": [] }]);
    }
    let Some(responses) = operation["responses"].as_object_mut() else { return };
    let anywhere: &[&str] = if needs_key { &["401", "429", "500", "503"] } else { &["500"] };
    for status in anywhere {
        responses.entry(*status).or_insert_with(|| json!({ "description": "" }));
    }
    for (status, response) in responses.iter_mut() {
        if status.starts_with(['4', '5']) {
            let schema = json!({ "$ref": "#/components/schemas/Problem" });
            response["content"] = json!({ "application/problem+json": { "schema": schema } });
        }
        if response["description"].as_str().is_none_or(str::is_empty) {
            response["description"] = describe(status).into();
        }
        let headers = response.get_mut("headers").and_then(Value::as_object_mut);
        headers.into_iter().flat_map(Map::values_mut).for_each(never_null);
    }
    let parameters = operation.get_mut("parameters").and_then(Value::as_array_mut);
    parameters.into_iter().flatten().for_each(never_null);
}

/// A header or a part of an address may be missing, which is said elsewhere; it is never `null`.
fn never_null(parameter: &mut Value) {
    let kinds = parameter.pointer("/schema/type").and_then(Value::as_array);
    if let Some(kind) = kinds.and_then(|kinds| kinds.iter().find(|kind| *kind != "null")).cloned() {
        parameter["schema"]["type"] = kind;
    }
    let choices = parameter.pointer("/schema/oneOf").and_then(Value::as_array);
    if let Some(choice) =
        choices.and_then(|choices| choices.iter().find(|choice| choice.get("$ref").is_some()))
    {
        parameter["schema"] = choice.clone();
    }
}

fn describe(status: &str) -> &'static str {
    match status {
        "200" => "Here it is",
        "201" => "It is kept",
        "202" => "It is being done",
        "204" => "Done",
        "304" => "It has not changed",
        "400" => "The request is malformed",
        "401" => "An API key is needed, or this one is not known",
        "404" => "There is nothing here",
        "408" => "The body took too long",
        "409" => "Not in this state",
        "410" => "It has expired",
        "413" => "The body is too large",
        "415" => "The body is not declared as JSON",
        "422" => "The scene cannot be rendered, or asks for too much",
        "429" => "Too many requests or jobs",
        "503" => "The service stops, has no room just now, or cannot use its database",
        "507" => "The disk is full",
        _ => "The service failed; its log says how",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_document_is_the_one_that_is_checked_in() {
        let known = include_str!("../openapi.json");
        assert!(known == text(), "cargo run -p nephroid-api -- openapi > api/openapi.json");
    }

    #[test]
    fn every_reference_leads_somewhere() {
        fn check(document: &Value, value: &Value) {
            match value {
                Value::Object(members) => {
                    if let Some(reference) = members.get("$ref").and_then(Value::as_str) {
                        let pointer = reference.strip_prefix('#').unwrap();
                        assert!(document.pointer(pointer).is_some(), "{reference}");
                    }
                    members.values().for_each(|member| check(document, member));
                }
                Value::Array(items) => items.iter().for_each(|item| check(document, item)),
                _ => {}
            }
        }
        let document = document();
        check(&document, &document);
    }
}
