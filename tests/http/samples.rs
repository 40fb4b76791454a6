//! What the service brings along: sample scenes, the page, and word of its own health.

use crate::server::Server;
use reqwest::StatusCode;

#[tokio::test]
async fn every_sample_scene_can_be_planned() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let list = server.get_json("/v1/scenes").await;
    let samples = list["scenes"].as_array().unwrap();
    assert!(samples.iter().any(|sample| sample["name"] == "glass-ball"));
    for sample in samples {
        let text = server.get(sample["href"].as_str().unwrap()).await.text().await.unwrap();
        let plan = server.post("/v1/plans", text).await;
        assert_eq!(plan.status(), StatusCode::OK, "{}", sample["name"]);
    }
    assert_eq!(server.get("/v1/scenes/no-such").await.status(), StatusCode::NOT_FOUND);
}

#[tokio::test]
async fn the_schema_says_what_a_scene_may_hold() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let response = server.get("/v1/schema").await;
    assert_eq!(response.headers()["content-type"], "application/schema+json");
    let schema: serde_json::Value = response.json().await.unwrap();
    assert_eq!(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
    assert_eq!(schema["properties"]["nephroid"]["const"], 1);
}

#[tokio::test]
async fn the_page_runs_nothing_but_its_own_files() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let page = server.get("/").await;
    let policy = page.headers()["content-security-policy"].to_str().unwrap().to_owned();
    assert!(policy.starts_with("default-src 'none'") && !policy.contains("unsafe"));
    let html = page.text().await.unwrap();
    for file in ["/page.js", "/page.css", "/icon.svg"] {
        assert!(html.contains(file), "{file}");
        assert_eq!(server.get(file).await.status(), StatusCode::OK, "{file}");
    }
    let script = server.get("/page.js").await.text().await.unwrap();
    for line in script.lines().filter(|line| line.starts_with("import")) {
        let file = line.split('"').nth(1).unwrap().trim_start_matches('.');
        assert_eq!(server.get(file).await.status(), StatusCode::OK, "{file}");
    }
    assert!(!html.contains("://"), "nothing from elsewhere");
}

#[tokio::test]
async fn a_healthy_service_says_so() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    assert_eq!(server.get_json("/healthz").await["alive"], true);
    assert_eq!(server.get_json("/readyz").await["ready"], true);
}
