//! What is forgotten, and what is not.

use crate::server::{Server, endless, quick, until};
use reqwest::StatusCode;
use serde_json::Value;

async fn status(server: &Server, id: &str) -> StatusCode {
    server.get(&format!("/v1/renders/{id}")).await.status()
}

#[tokio::test]
async fn the_oldest_finished_jobs_go_when_there_are_too_many() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &["--keep-jobs", "2"]);
    let running = server.submit(&endless()).await;
    let mut ids = Vec::new();
    for _ in 0..4 {
        let id = server.submit(&quick()).await;
        server.wait_for(&id, |job| job["done"] != false).await;
        ids.push(id);
    }
    until(async || (status(&server, &ids[1]).await == StatusCode::GONE).then_some(())).await;
    let gone = server.get(&format!("/v1/renders/{}/image.png", ids[0])).await;
    assert_eq!(gone.status(), StatusCode::GONE);
    assert_eq!(gone.json::<Value>().await.unwrap()["code"], "expired");
    assert_eq!(status(&server, &ids[2]).await, StatusCode::OK);
    assert_eq!(status(&server, &ids[3]).await, StatusCode::OK);
    assert_eq!(status(&server, &running).await, StatusCode::OK, "what is not finished stays");
    server.kill();
    let again = Server::start(data.path(), &["--keep-jobs", "2"]);
    assert_eq!(status(&again, &ids[0]).await, StatusCode::GONE, "remembered after a crash");
}

#[tokio::test]
async fn a_job_says_when_it_expires_and_does() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &["--keep-age", "1h"]);
    let id = server.submit(&quick()).await;
    assert!(server.job(&id).await["expires_at"].is_null() || server.job(&id).await["done"] == true);
    let job = server.wait_for_state(&id, "succeeded").await;
    let hour = |time: &Value| time.as_str().unwrap()[11..13].parse::<u32>().unwrap();
    assert_eq!(hour(&job["expires_at"]), (hour(&job["finished_at"]) + 1) % 24);
    server.kill();
    let impatient = Server::start(data.path(), &["--keep-age", "1s"]);
    until(async || (status(&impatient, &id).await == StatusCode::GONE).then_some(())).await;
    assert!(!data.path().join("jobs").join(&id).exists());
}

#[tokio::test]
async fn jobs_go_when_they_take_too_much_room() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &["--keep-bytes", "60k"]);
    let first = server.submit(&quick()).await;
    server.wait_for(&first, |job| job["done"] != false).await;
    for _ in 0..8 {
        let id = server.submit(&quick()).await;
        server.wait_for(&id, |job| job["done"] != false).await;
    }
    until(async || (status(&server, &first).await == StatusCode::GONE).then_some(())).await;
    assert!(!server.get_json("/v1/renders").await["renders"].as_array().unwrap().is_empty());
}

#[tokio::test]
async fn a_disk_without_room_takes_nothing_new_and_keeps_what_it_has() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let id = server.submit(&quick()).await;
    server.wait_for_state(&id, "succeeded").await;
    assert!(server.terminate().await.success());
    // More than any disk has.
    let full = Server::start(data.path(), &["--min-free", "1000000G"]);
    let refused = full.post("/v1/renders", quick().to_string()).await;
    assert_eq!(refused.status(), StatusCode::INSUFFICIENT_STORAGE);
    assert!(refused.headers().contains_key("retry-after"));
    assert_eq!(refused.json::<Value>().await.unwrap()["code"], "storage_full");
    assert!(!full.png(&id).await.is_empty());
}
