//! The OpenAPI document, held against what the service really answers.

use crate::server::{Server, endless, quick};
use reqwest::{Method, Response};
use serde_json::{Value, json};
use std::collections::BTreeSet;

/// What the document says, and what of it was seen.
struct Contract {
    document: Value,
    seen: BTreeSet<String>,
}

impl Contract {
    /// Checks an answer: its status, its type and its body are those of the document.
    async fn check(&mut self, (method, path): (&str, &str), answer: Response) -> Value {
        let status = answer.status().as_u16().to_string();
        let at = format!("{method} {path}: {status}");
        let response = self.document["paths"][path][method]["responses"][&status].clone();
        assert!(response.is_object(), "{at} is not in the document");
        self.seen.insert(format!("{method} {path}"));
        for (name, header) in response["headers"].as_object().into_iter().flatten() {
            let optional = header["description"]
                .as_str()
                .is_some_and(|d| d.starts_with("`true` if") || d.starts_with("While"));
            assert!(optional || answer.headers().contains_key(name.as_str()), "{at} has no {name}");
        }
        let kind = answer.headers().get("content-type").map(|kind| kind.to_str().unwrap().to_owned());
        let kind = kind.map(|kind| kind.split(';').next().unwrap().to_owned());
        let Some(content) = response["content"].as_object() else {
            assert!(answer.bytes().await.unwrap().is_empty(), "{at} has a body");
            return Value::Null;
        };
        let kind = kind.unwrap_or_else(|| panic!("{at} has no type"));
        let schema = &content.get(&kind).unwrap_or_else(|| panic!("{at} is of type {kind}"))["schema"];
        if !kind.contains("json") {
            return Value::Null;
        }
        let body: Value = answer.json().await.unwrap();
        let whole = json!({ "allOf": [schema], "components": self.document["components"] });
        let validator = jsonschema::validator_for(&whole).unwrap();
        let errors: Vec<String> =
            validator.iter_errors(&body).map(|e| format!("{}: {e}", e.instance_path())).collect();
        assert!(errors.is_empty(), "{at}: {errors:#?}\n{body:#}");
        body
    }
}

/// Sends a request with a scene as its body.
async fn send(server: &Server, method: &str, path: &str, body: &Value) -> Response {
    let method: Method = method.to_uppercase().parse().unwrap();
    let request = server.client.request(method, server.url(path)).header("content-type", "application/json");
    request.body(body.to_string()).send().await.unwrap()
}

/// A finished, a running and an unknown job.
async fn jobs(server: &Server) -> [String; 3] {
    let done = server.submit(&quick()).await;
    server.wait_for_state(&done, "succeeded").await;
    let running = server.submit(&endless()).await;
    server.wait_for(&running, |job| job["rounds"].as_u64() > Some(0)).await;
    [done, running, "01a207a1-46ba-736a-a457-0ff89a07ecd1".into()]
}

#[tokio::test]
async fn every_address_answers_as_the_document_says() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let mut contract = Contract { document: server.get_json("/openapi.json").await, seen: BTreeSet::new() };
    let jobs = jobs(&server).await;
    for id in &jobs {
        for what in
            ["", "/scene.json", "/image.png", "/image.exr", "/error.png", "/preview.png", "/chart.svg"]
        {
            let answer = server.get(&format!("/v1/renders/{id}{what}")).await;
            contract.check(("get", &format!("/v1/renders/{{id}}{what}")), answer).await;
        }
        for file in ["caustic.png", "caustic.exr"] {
            let layer = server.get(&format!("/v1/renders/{id}/layers/{file}")).await;
            contract.check(("get", "/v1/renders/{id}/layers/{file}"), layer).await;
        }
        let events = server.get(&format!("/v1/renders/{id}/events")).await;
        contract.check(("get", "/v1/renders/{id}/events"), events).await;
    }
    let own = ["/healthz", "/readyz", "/metrics", "/v1/scenes", "/v1/schema", "/v1/session", "/v1/renders"];
    for path in own {
        contract.check(("get", path), server.get(path).await).await;
    }
    for name in ["glass-ball", "nothing"] {
        let path = format!("/v1/scenes/{name}");
        contract.check(("get", "/v1/scenes/{name}"), server.get(&path).await).await;
        let picture = server.get(&format!("{path}/picture.png")).await;
        contract.check(("get", "/v1/scenes/{name}/picture.png"), picture).await;
    }
    for body in [quick(), json!({ "nephroid": 1 }), json!("x")] {
        for path in ["/v1/renders", "/v1/plans", "/v1/session"] {
            contract.check(("post", path), send(&server, "post", path, &body).await).await;
        }
        let validated = send(&server, "post", "/v1/renders?validate_only=true", &body).await;
        contract.check(("post", "/v1/renders"), validated).await;
    }
    contract.check(("get", "/v1/renders"), server.get("/v1/renders?limit=0").await).await;
    contract
        .check(("delete", "/v1/session"), send(&server, "delete", "/v1/session", &json!(null)).await)
        .await;
    let name = "2c26b46b68ffc68ff99b453c1d30413413422d706483bfa0f98a5e886266e7ae";
    for (name, content) in [(name, "foo"), (name, "bar"), ("x", "")] {
        let path = format!("/v1/assets/{name}");
        let answer = server.client.put(server.url(&path)).body(content).send().await.unwrap();
        contract.check(("put", "/v1/assets/{sha256}"), answer).await;
        contract.check(("get", "/v1/assets/{sha256}"), server.get(&path).await).await;
    }
    for id in &jobs {
        let path = format!("/v1/renders/{id}");
        let cancelled = send(&server, "post", &format!("{path}/cancel"), &json!(null)).await;
        contract.check(("post", "/v1/renders/{id}/cancel"), cancelled).await;
        let deleted = send(&server, "delete", &path, &json!(null)).await;
        contract.check(("delete", "/v1/renders/{id}"), deleted).await;
    }
    let all = operations(&contract.document);
    assert_eq!(all.difference(&contract.seen).collect::<Vec<_>>(), Vec::<&String>::new(), "not tried");
}

/// Each method of each address.
fn operations(document: &Value) -> BTreeSet<String> {
    let methods = |(path, methods): (&String, &Value)| {
        let names = methods.as_object().unwrap().keys().map(|method| format!("{method} {path}"));
        names.collect::<Vec<_>>()
    };
    document["paths"].as_object().unwrap().iter().flat_map(methods).collect()
}
