//! What the service tells those who run it, and pages of other origins.

use crate::server::{Server, endless, quick, until};
use reqwest::{Method, StatusCode};

/// The value of a line of the metrics.
fn value(metrics: &str, name: &str) -> f64 {
    let line =
        metrics.lines().find(|line| line.starts_with(name)).unwrap_or_else(|| panic!("{name}: {metrics}"));
    line.rsplit(' ').next().unwrap().parse().unwrap()
}

#[tokio::test]
async fn the_numbers_tell_what_was_done() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &["--concurrent", "1"]);
    let done = server.submit(&quick()).await;
    server.wait_for_state(&done, "succeeded").await;
    let running = server.submit(&endless()).await;
    server.wait_for(&running, |job| job["rounds"].as_u64() > Some(0)).await;
    server.submit(&endless()).await;
    server.post("/v1/renders", "{}").await;
    let metrics = server.get("/metrics").await.text().await.unwrap();
    assert!(metrics.ends_with("# EOF\n"));
    assert!(value(&metrics, "nephroid_photons_total ") > 0.0);
    assert!(value(&metrics, "nephroid_rays_total ") > 0.0);
    assert!(value(&metrics, "nephroid_pass_seconds_total{pass=\"light\"}") > 0.0);
    assert!(value(&metrics, "nephroid_pass_seconds_total{pass=\"eye\"}") > 0.0);
    assert_eq!(value(&metrics, "nephroid_jobs_total{event=\"accepted\"}"), 3.0);
    assert_eq!(value(&metrics, "nephroid_jobs_total{event=\"succeeded\"}"), 1.0);
    assert_eq!(value(&metrics, "nephroid_problems_total{code=\"scene_invalid\"}"), 1.0);
    assert_eq!(value(&metrics, "nephroid_jobs_running "), 1.0);
    assert_eq!(value(&metrics, "nephroid_jobs_queued "), 1.0);
    let posts = "nephroid_requests_total{method=\"POST\",route=\"/v1/renders\",status=\"202\"}";
    assert_eq!(value(&metrics, posts), 3.0);
}

#[tokio::test]
async fn a_request_keeps_its_name_from_the_client_to_the_log() {
    let data = tempfile::tempdir().unwrap();
    let log = data.path().join("log");
    let server = Server::start_logged(data.path(), &["--log-format", "json"], &log);
    let name = "order-66.a";
    let request = server.client.post(server.url("/v1/renders")).header("content-type", "application/json");
    let answer = request.header("x-request-id", name).body(quick().to_string()).send().await.unwrap();
    assert_eq!(answer.headers()["x-request-id"], name);
    let id = answer.json::<serde_json::Value>().await.unwrap()["id"].as_str().unwrap().to_owned();
    server.wait_for_state(&id, "succeeded").await;
    let lines = || {
        let text = std::fs::read_to_string(&log).unwrap();
        let lines = text.lines().filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok());
        lines.collect::<Vec<_>>()
    };
    let accepted = |line: &serde_json::Value| line["fields"]["job"] == id && line["span"]["id"] == name;
    let ended =
        |line: &serde_json::Value| line["fields"]["job"] == id && line["fields"]["message"] == "ended";
    until(async || (lines().iter().any(accepted) && lines().iter().any(ended)).then_some(())).await;
    let wild =
        server.client.get(server.url("/healthz")).header("x-request-id", "a b\"c").send().await.unwrap();
    assert_ne!(wild.headers()["x-request-id"], "a b\"c", "what could spoil a log is replaced");
}

#[tokio::test]
async fn pages_of_configured_origins_may_come_and_see_what_they_need() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &["--cors-origin", "https://example.org,http://localhost:3000"]);
    let preflight = async |origin: &str| {
        let request =
            server.client.request(Method::OPTIONS, server.url("/v1/renders")).header("origin", origin);
        let request = request.header("access-control-request-method", "POST");
        request.header("access-control-request-headers", "content-type,authorization").send().await.unwrap()
    };
    let allowed = preflight("https://example.org").await;
    assert_eq!(allowed.status(), StatusCode::OK);
    assert_eq!(allowed.headers()["access-control-allow-origin"], "https://example.org");
    assert!(!allowed.headers().contains_key("access-control-allow-credentials"), "the cookie stays at home");
    assert!(!preflight("https://example.com").await.headers().contains_key("access-control-allow-origin"));
    let request = server.client.post(server.url("/v1/renders")).header("content-type", "application/json");
    let answer =
        request.header("origin", "http://localhost:3000").body(quick().to_string()).send().await.unwrap();
    let exposed = answer.headers()["access-control-expose-headers"].to_str().unwrap().to_owned();
    for name in ["location", "retry-after", "etag"] {
        assert!(exposed.contains(name), "{exposed}");
    }
}

#[tokio::test]
async fn a_label_comes_back_and_finds_its_jobs() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let answer = server.post("/v1/renders?label=frame%207", quick().to_string()).await;
    assert_eq!(answer.json::<serde_json::Value>().await.unwrap()["label"], "frame 7");
    server.submit(&quick()).await;
    let found = server.get_json("/v1/renders?label=frame%207").await;
    assert_eq!(found["renders"].as_array().unwrap().len(), 1);
    let long = format!("/v1/renders?label={}", "x".repeat(201));
    assert_eq!(server.post(&long, quick().to_string()).await.status(), StatusCode::BAD_REQUEST);
}
