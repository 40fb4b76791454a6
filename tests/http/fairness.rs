//! One service, several users.

use crate::server::{Server, endless, quick};
use reqwest::StatusCode;
use serde_json::Value;

#[tokio::test]
async fn a_small_render_passes_a_long_one() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let long = server.submit(&endless()).await;
    server.wait_for_state(&long, "running").await;
    let small = server.submit(&quick()).await;
    server.wait_for_state(&small, "succeeded").await;
    assert_eq!(server.job(&long).await["state"], "running");
}

#[tokio::test]
async fn two_long_renders_advance_side_by_side() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let jobs = [server.submit(&endless()).await, server.submit(&endless()).await];
    for id in &jobs {
        server.wait_for(id, |job| job["rounds"].as_u64() >= Some(2)).await;
    }
}

#[tokio::test]
async fn a_full_queue_refuses_politely() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &["--concurrent", "1", "--queue", "2"]);
    let running = server.submit(&endless()).await;
    server.wait_for_state(&running, "running").await;
    server.submit(&endless()).await;
    let last = server.submit(&endless()).await;
    assert_eq!(server.job(&last).await["queue_position"], 1);
    let refused = server.post("/v1/renders", quick().to_string()).await;
    assert_eq!(refused.status(), StatusCode::TOO_MANY_REQUESTS);
    assert!(refused.headers().contains_key("retry-after"));
    assert_eq!(refused.json::<Value>().await.unwrap()["code"], "queue_full");
    // Room again as soon as one that waits is cancelled.
    server.post(&format!("/v1/renders/{last}/cancel"), "").await;
    server.submit(&endless()).await;
}
