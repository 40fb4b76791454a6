//! Sending a request again.

use crate::server::{Server, quick, scene};
use reqwest::{Response, StatusCode};
use serde_json::Value;

async fn post_with_key(server: &Server, key: &str, scene: &Value) -> Response {
    let request = server.client.post(server.url("/v1/renders")).header("content-type", "application/json");
    request.header("idempotency-key", key).body(scene.to_string()).send().await.unwrap()
}

#[tokio::test]
async fn a_request_that_is_sent_again_makes_no_second_job() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let first: Value = post_with_key(&server, "a", &quick()).await.json().await.unwrap();
    let again = post_with_key(&server, "a", &quick()).await;
    assert!(again.status().is_success());
    assert_eq!(again.headers()["idempotent-replayed"], "true");
    assert_eq!(again.json::<Value>().await.unwrap()["id"], first["id"]);
    assert_eq!(server.get_json("/v1/renders").await["renders"].as_array().unwrap().len(), 1);

    server.kill();
    let restarted = Server::start(data.path(), &[]);
    let later: Value = post_with_key(&restarted, "a", &quick()).await.json().await.unwrap();
    assert_eq!(later["id"], first["id"], "keys survive a crash as their jobs do");
}

#[tokio::test]
async fn many_at_once_with_one_key_make_one_job() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let scene = quick();
    let post =
        async || post_with_key(&server, "same", &scene).await.json::<Value>().await.unwrap()["id"].clone();
    let (a, b, c, d) = tokio::join!(post(), post(), post(), post());
    let mut ids = vec![a, b, c, d];
    ids.dedup();
    assert_eq!(ids.len(), 1);
}

#[tokio::test]
async fn a_key_belongs_to_one_request() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    post_with_key(&server, "a", &quick()).await;
    let other = post_with_key(&server, "a", &scene([50, 50], 1)).await;
    assert_eq!(other.status(), StatusCode::UNPROCESSABLE_ENTITY);
    assert_eq!(other.json::<Value>().await.unwrap()["code"], "idempotency_key_reused");
    // A request that was refused is not remembered.
    let invalid = post_with_key(&server, "b", &serde_json::json!({})).await;
    assert_eq!(invalid.status(), StatusCode::UNPROCESSABLE_ENTITY);
    assert_eq!(post_with_key(&server, "b", &quick()).await.status(), StatusCode::ACCEPTED);
}
