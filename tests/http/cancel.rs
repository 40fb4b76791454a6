//! Stopping and forgetting jobs.

use crate::server::{Server, endless, quick, scene};
use reqwest::StatusCode;
use serde_json::Value;

#[tokio::test]
async fn cancelling_frees_the_cores_at_once() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &["--concurrent", "1"]);
    // A round of this takes many times longer than the cancellation may.
    let large = server.submit(&scene([2400, 1800], 1000)).await;
    server.wait_for_state(&large, "running").await;
    let next = server.submit(&endless()).await;
    let answer = server.post(&format!("/v1/renders/{large}/cancel"), "").await;
    assert_eq!(answer.status(), StatusCode::OK);
    assert_eq!(answer.json::<Value>().await.unwrap()["state"], "cancelled");
    server.wait_for_state(&next, "running").await;
    // Not at the end of the round: its first one was cut off.
    assert_eq!(server.job(&large).await["rounds"], 0);
}

#[tokio::test]
async fn cancelling_twice_or_too_late_changes_nothing() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let id = server.submit(&endless()).await;
    for _ in 0..2 {
        let answer = server.post(&format!("/v1/renders/{id}/cancel"), "").await;
        assert_eq!(answer.status(), StatusCode::OK);
        assert_eq!(answer.json::<Value>().await.unwrap()["state"], "cancelled");
    }
    let done = server.submit(&quick()).await;
    server.wait_for_state(&done, "succeeded").await;
    let answer = server.post(&format!("/v1/renders/{done}/cancel"), "").await;
    assert_eq!(answer.json::<Value>().await.unwrap()["state"], "succeeded");
}

#[tokio::test]
async fn a_job_that_waits_can_be_cancelled() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &["--concurrent", "1"]);
    let first = server.submit(&endless()).await;
    server.wait_for_state(&first, "running").await;
    let waiting = server.submit(&quick()).await;
    assert_eq!(server.job(&waiting).await["queue_position"], 0);
    server.post(&format!("/v1/renders/{waiting}/cancel"), "").await;
    assert_eq!(server.job(&waiting).await["state"], "cancelled");
}

#[tokio::test]
async fn a_cancelled_job_stays_cancelled_after_a_crash() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let id = server.submit(&endless()).await;
    server.wait_for_state(&id, "running").await;
    server.post(&format!("/v1/renders/{id}/cancel"), "").await;
    server.kill();
    let again = Server::start(data.path(), &[]);
    assert_eq!(again.job(&id).await["state"], "cancelled");
}

#[tokio::test]
async fn a_job_is_cancelled_when_its_client_will_have_given_up() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &["--concurrent", "1"]);
    let submit = async |scene: &Value, seconds: u32| -> String {
        let answer = server.post(&format!("/v1/renders?cancel_after={seconds}"), scene.to_string()).await;
        assert_eq!(answer.status(), StatusCode::ACCEPTED);
        answer.json::<Value>().await.unwrap()["id"].as_str().unwrap().to_owned()
    };
    let running = submit(&endless(), 1).await;
    let job = server.wait_for_state(&running, "cancelled").await;
    // Times in this form sort as they follow each other.
    assert!(job["finished_at"].as_str() >= job["cancel_at"].as_str(), "{job:#}");
    // One that would wait for ever.
    let other = server.submit(&endless()).await;
    server.wait_for_state(&other, "running").await;
    let waiting = submit(&quick(), 1).await;
    let job = server.wait_for_state(&waiting, "cancelled").await;
    assert_eq!(job["attempt"], 0);
    server.post(&format!("/v1/renders/{other}/cancel"), "").await;
    // What is done in its time stays.
    let soon = submit(&quick(), 600).await;
    server.wait_for_state(&soon, "succeeded").await;
    for wrong in ["0", "604801", "-1", "soon"] {
        let answer = server.post(&format!("/v1/renders?cancel_after={wrong}"), quick().to_string()).await;
        assert_eq!(answer.status(), StatusCode::BAD_REQUEST, "{wrong}");
    }
}

#[tokio::test]
async fn a_time_to_give_up_outlives_a_crash() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let answer = server.post("/v1/renders?cancel_after=2", endless().to_string()).await;
    let id = answer.json::<Value>().await.unwrap()["id"].as_str().unwrap().to_owned();
    server.kill();
    let again = Server::start(data.path(), &[]);
    again.wait_for_state(&id, "cancelled").await;
}

#[tokio::test]
async fn a_deleted_job_is_gone_with_its_files() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let id = server.submit(&quick()).await;
    server.wait_for_state(&id, "succeeded").await;
    let request = || server.client.delete(server.url(&format!("/v1/renders/{id}"))).send();
    assert_eq!(request().await.unwrap().status(), StatusCode::NO_CONTENT);
    assert_eq!(request().await.unwrap().status(), StatusCode::NOT_FOUND);
    assert_eq!(server.get(&format!("/v1/renders/{id}/image.png")).await.status(), StatusCode::NOT_FOUND);
    assert!(!data.path().join("jobs").join(&id).exists());
}

#[tokio::test]
async fn a_running_job_that_is_deleted_makes_room_and_leaves_nothing() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &["--concurrent", "1"]);
    let first = server.submit(&endless()).await;
    server.wait_for(&first, |job| job["rounds"].as_u64() > Some(0)).await;
    let next = server.submit(&quick()).await;
    let delete = server.client.delete(server.url(&format!("/v1/renders/{first}")));
    assert_eq!(delete.send().await.unwrap().status(), StatusCode::NO_CONTENT);
    server.wait_for_state(&next, "succeeded").await;
    assert_eq!(server.get(&format!("/v1/renders/{first}")).await.status(), StatusCode::NOT_FOUND);
    assert!(!data.path().join("jobs").join(&first).exists());
}
