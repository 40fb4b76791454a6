//! A job as it changes, as server-sent events.

use crate::server::{DEADLINE, Server, endless, scene};
use reqwest::{Response, StatusCode};
use serde_json::Value;

/// One event: its name, id and data.
#[derive(Debug)]
struct Event {
    name: String,
    id: String,
    data: Value,
}

/// Reads events until `enough` or the end of the stream.
async fn read(mut answer: Response, enough: impl Fn(&[Event]) -> bool) -> Vec<Event> {
    let (mut text, mut events) = (String::new(), Vec::new());
    let reading = async {
        while let Some(piece) = answer.chunk().await.unwrap() {
            text.push_str(std::str::from_utf8(&piece).unwrap());
            while let Some((block, rest)) = text.split_once("\n\n") {
                let field = |name: &str| {
                    let line = block.lines().find_map(|line| line.strip_prefix(name));
                    line.map(|value| value.trim().to_owned()).unwrap_or_default()
                };
                if let Ok(data) = serde_json::from_str(&field("data:")) {
                    events.push(Event { name: field("event:"), id: field("id:"), data });
                }
                text = rest.to_owned();
            }
            if enough(&events) {
                return;
            }
        }
    };
    tokio::time::timeout(DEADLINE, reading).await.expect("events come before the deadline");
    events
}

async fn listen(server: &Server, id: &str, last: Option<&str>) -> Response {
    let mut request = server.client.get(server.url(&format!("/v1/renders/{id}/events")));
    if let Some(last) = last {
        request = request.header("last-event-id", last);
    }
    request.send().await.unwrap()
}

#[tokio::test]
async fn a_listener_hears_of_every_state_and_then_nothing() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let id = server.submit(&scene([160, 120], 6)).await;
    let answer = listen(&server, &id, None).await;
    assert_eq!(answer.headers()["content-type"], "text/event-stream");
    let events = read(answer, |_| false).await;
    assert!(events.iter().all(|event| event.name == "render" && !event.id.is_empty()));
    assert!(events.windows(2).all(|pair| pair[0].id != pair[1].id), "{events:#?}");
    let last = events.last().unwrap();
    assert_eq!(last.data["state"], "succeeded");
    assert!(last.data["links"]["image"].is_string());
    // A browser that comes back is told that there is nothing more.
    let again = listen(&server, &id, Some(&last.id)).await;
    assert_eq!(again.status(), StatusCode::NO_CONTENT);
    let missed = read(listen(&server, &id, Some("1-running-1")).await, |_| false).await;
    assert_eq!(missed.len(), 1, "whoever missed something is told how it is now");
    assert_eq!(missed[0].data["state"], "succeeded");
}

#[tokio::test]
async fn a_listener_who_comes_back_is_not_told_the_same_again() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let id = server.submit(&endless()).await;
    let first =
        read(listen(&server, &id, None).await, |events| events.iter().any(|e| e.data["rounds"] != 0)).await;
    let seen = &first.last().unwrap().id;
    let next = read(listen(&server, &id, Some(seen)).await, |events| !events.is_empty()).await;
    assert_ne!(next[0].id, *seen);
    assert!(next[0].data["rounds"].as_u64() > first.last().unwrap().data["rounds"].as_u64());
}

#[tokio::test]
async fn a_listener_of_a_job_that_is_deleted_hears_of_it() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let id = server.submit(&endless()).await;
    let answer = listen(&server, &id, None).await;
    server.client.delete(server.url(&format!("/v1/renders/{id}"))).send().await.unwrap();
    let events = read(answer, |_| false).await;
    // Whether it is seen between its end and its going is chance.
    let last = events.last().unwrap();
    assert!(last.name == "gone" || last.data["state"] == "cancelled", "{events:#?}");
    assert_eq!(listen(&server, &id, None).await.status(), StatusCode::NOT_FOUND);
}
