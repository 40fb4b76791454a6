//! The list of jobs.

use crate::server::{Server, endless, quick};
use reqwest::StatusCode;

#[tokio::test]
async fn a_list_has_pages_newest_first() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let mut ids = Vec::new();
    for _ in 0..5 {
        ids.push(server.submit(&quick()).await);
    }
    ids.reverse();
    let mut seen = Vec::new();
    let mut path = "/v1/renders?limit=2".to_owned();
    loop {
        let page = server.get_json(&path).await;
        let renders = page["renders"].as_array().unwrap();
        assert!(!renders.is_empty() && renders.len() <= 2);
        seen.extend(renders.iter().map(|job| job["id"].as_str().unwrap().to_owned()));
        let Some(cursor) = page["next_cursor"].as_str() else { break };
        path = format!("/v1/renders?limit=2&cursor={cursor}");
    }
    assert_eq!(seen, ids);
}

#[tokio::test]
async fn a_list_can_be_of_one_state() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let done = server.submit(&quick()).await;
    server.wait_for_state(&done, "succeeded").await;
    let running = server.submit(&endless()).await;
    server.wait_for_state(&running, "running").await;
    for (state, id) in [("succeeded", &done), ("running", &running)] {
        let page = server.get_json(&format!("/v1/renders?state={state}")).await;
        let renders = page["renders"].as_array().unwrap();
        assert_eq!(renders.len(), 1, "{state}");
        assert_eq!(renders[0]["id"], **id);
    }
}

#[tokio::test]
async fn a_query_that_makes_no_sense_is_refused() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    for query in ["limit=0", "limit=101", "limit=x", "state=done", "cursor=zzz", "colour=red"] {
        let answer = server.get(&format!("/v1/renders?{query}")).await;
        assert_eq!(answer.status(), StatusCode::BAD_REQUEST, "{query}");
        assert_eq!(answer.headers()["content-type"], "application/problem+json");
    }
}
