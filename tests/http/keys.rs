//! Who may come, what they see, and how often.

use crate::server::{Server, endless, quick, until};
use reqwest::{Method, Response, StatusCode};
use serde_json::{Value, json};
use std::path::Path;
use std::process::{Command, Output};

fn keys(data: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_nephroid-api"));
    command.args(["keys", "--data"]).arg(data).args(arguments).output().unwrap()
}

/// Makes a key; its token.
fn add_key(data: &Path, name: &str) -> String {
    let output = keys(data, &["add", name]);
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).unwrap().trim().to_owned()
}

/// The part of a token that `list` shows.
fn id_of(token: &str) -> &str {
    token.split('_').nth(1).unwrap()
}

async fn ask(server: &Server, key: Option<&str>, (method, path): (Method, &str), body: &Value) -> Response {
    let mut request =
        server.client.request(method, server.url(path)).header("content-type", "application/json");
    if let Some(key) = key {
        request = request.bearer_auth(key);
    }
    request.body(body.to_string()).send().await.unwrap()
}

async fn submit(server: &Server, key: &str, scene: &Value) -> String {
    let answer = ask(server, Some(key), (Method::POST, "/v1/renders"), scene).await;
    assert_eq!(answer.status(), StatusCode::ACCEPTED);
    answer.json::<Value>().await.unwrap()["id"].as_str().unwrap().to_owned()
}

async fn job_of(server: &Server, key: &str, id: &str) -> Value {
    let path = format!("/v1/renders/{id}");
    ask(server, Some(key), (Method::GET, &path), &json!(null)).await.json().await.unwrap()
}

#[tokio::test]
async fn every_address_that_shows_or_does_something_needs_a_key() {
    let data = tempfile::tempdir().unwrap();
    let key = add_key(data.path(), "one");
    let server = Server::start(data.path(), &[]);
    let document = server.get_json("/openapi.json").await;
    let open =
        ["/v1/scenes", "/v1/scenes/{name}", "/v1/scenes/{name}/picture.png", "/v1/schema", "/v1/session"];
    let mut closed = 0;
    for (path, methods) in document["paths"].as_object().unwrap() {
        if !path.starts_with("/v1/") || open.contains(&path.as_str()) {
            continue;
        }
        let address = path
            .replace("{id}", "01a207a1-46ba-736a-a457-0ff89a07ecd1")
            .replace("{file}", "caustic.png")
            .replace("{sha256}", &"0".repeat(64));
        for method in methods.as_object().unwrap().keys() {
            let method: Method = method.to_uppercase().parse().unwrap();
            for key in [None, Some("nph_00000000_0"), Some("x")] {
                let answer = ask(&server, key, (method.clone(), &address), &json!({})).await;
                assert_eq!(answer.status(), StatusCode::UNAUTHORIZED, "{method} {address} with {key:?}");
                assert_eq!(answer.headers()["www-authenticate"], "Bearer");
            }
            let answer = ask(&server, Some(&key), (method.clone(), &address), &json!({})).await;
            assert_ne!(answer.status(), StatusCode::UNAUTHORIZED, "{method} {address}");
            closed += 1;
        }
    }
    assert!(closed >= 16, "{closed}");
}

#[tokio::test]
async fn what_belongs_to_one_key_does_not_exist_for_another() {
    let data = tempfile::tempdir().unwrap();
    let [anna, ben] = ["anna", "ben"].map(|name| add_key(data.path(), name));
    let server = Server::start(data.path(), &[]);
    let id = submit(&server, &anna, &quick()).await;
    until(async || Some(job_of(&server, &anna, &id).await).filter(|job| job["done"] == true)).await;
    for path in ["", "/image.png", "/preview.png", "/scene.json", "/events", "/chart.svg", "/error.png"] {
        let path = format!("/v1/renders/{id}{path}");
        let mine = ask(&server, Some(&anna), (Method::GET, &path), &json!(null)).await;
        assert_eq!(mine.status(), StatusCode::OK, "{path}");
        let theirs = ask(&server, Some(&ben), (Method::GET, &path), &json!(null)).await;
        assert_eq!(theirs.status(), StatusCode::NOT_FOUND, "{path}");
    }
    for (method, path) in [(Method::DELETE, ""), (Method::POST, "/cancel")] {
        let path = format!("/v1/renders/{id}{path}");
        let theirs = ask(&server, Some(&ben), (method, &path), &json!(null)).await;
        assert_eq!(theirs.status(), StatusCode::NOT_FOUND, "{path}");
    }
    let list = ask(&server, Some(&ben), (Method::GET, "/v1/renders"), &json!(null)).await;
    assert_eq!(list.json::<Value>().await.unwrap()["renders"], json!([]));
    assert_eq!(job_of(&server, &anna, &id).await["state"], "succeeded");
}

#[tokio::test]
async fn a_key_can_be_added_and_revoked_while_the_service_runs() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    assert_eq!(server.get("/v1/renders").await.status(), StatusCode::OK, "without keys everyone may");
    let token = add_key(data.path(), "late");
    until(async || (server.get("/v1/renders").await.status() == StatusCode::UNAUTHORIZED).then_some(()))
        .await;
    let look = async || ask(&server, Some(&token), (Method::GET, "/v1/renders"), &json!(null)).await.status();
    assert_eq!(look().await, StatusCode::OK);
    let list = String::from_utf8(keys(data.path(), &["list"]).stdout).unwrap();
    assert!(list.contains(id_of(&token)) && list.contains("active") && list.contains("late"), "{list}");
    assert!(!list.contains(token.rsplit('_').next().unwrap()), "the secret is shown only once");
    let database = std::fs::read(data.path().join("jobs.sqlite-wal")).unwrap();
    assert!(!database.windows(token.len()).any(|part| part == token.as_bytes()), "the secret is not kept");
    assert!(keys(data.path(), &["revoke", id_of(&token)]).status.success());
    assert!(
        !keys(data.path(), &["revoke", id_of(&token)]).status.success(),
        "there is nothing left to revoke"
    );
    until(async || (look().await == StatusCode::UNAUTHORIZED).then_some(())).await;
    assert_eq!(server.get("/v1/renders").await.status(), StatusCode::UNAUTHORIZED, "revoking opens nothing");
}

#[tokio::test]
async fn beyond_loopback_the_service_does_not_start_without_keys() {
    let data = tempfile::tempdir().unwrap();
    let start = || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_nephroid-api"));
        command.args(["--listen", "0.0.0.0:0", "--data"]).arg(data.path());
        command
    };
    let refused = start().output().unwrap();
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("keys add"));
    let token = add_key(data.path(), "only");
    keys(data.path(), &["revoke", id_of(&token)]);
    assert_eq!(start().output().unwrap().status.code(), Some(2), "a revoked key is none");
}

#[tokio::test]
async fn the_page_keeps_its_key_in_a_cookie_that_other_pages_cannot_use() {
    let data = tempfile::tempdir().unwrap();
    let key = add_key(data.path(), "page");
    let server = Server::start(data.path(), &[]);
    assert_eq!(server.get_json("/v1/session").await, json!({ "key_needed": true, "welcome": false }));
    let wrong = server.post("/v1/session", json!({ "key": "nph_1_2" }).to_string()).await;
    assert_eq!(wrong.status(), StatusCode::UNAUTHORIZED);
    let answer = server.post("/v1/session", json!({ "key": key }).to_string()).await;
    assert_eq!(answer.status(), StatusCode::NO_CONTENT);
    let cookie = answer.headers()["set-cookie"].to_str().unwrap().to_owned();
    assert!(cookie.contains("HttpOnly") && cookie.contains("SameSite=Strict"), "{cookie}");
    let pair = cookie.split(';').next().unwrap();
    let look = async |site: &str| {
        let request = server.client.get(server.url("/v1/renders")).header("cookie", pair);
        request.header("sec-fetch-site", site).send().await.unwrap().status()
    };
    assert_eq!(look("same-origin").await, StatusCode::OK);
    assert_eq!(look("same-site").await, StatusCode::UNAUTHORIZED, "a page of another port");
    assert_eq!(look("cross-site").await, StatusCode::UNAUTHORIZED);
}

#[tokio::test]
async fn a_key_has_its_share_of_requests_and_jobs() {
    let data = tempfile::tempdir().unwrap();
    let [greedy, modest] = ["greedy", "modest"].map(|name| add_key(data.path(), name));
    let server = Server::start(data.path(), &["--rate", "20", "--jobs-per-key", "2"]);
    for _ in 0..2 {
        submit(&server, &greedy, &endless()).await;
    }
    let refused = ask(&server, Some(&greedy), (Method::POST, "/v1/renders"), &quick()).await;
    assert_eq!(refused.status(), StatusCode::TOO_MANY_REQUESTS);
    assert!(refused.headers().contains_key("retry-after"));
    assert_eq!(refused.json::<Value>().await.unwrap()["code"], "too_many_jobs");
    let refused = until(async || {
        let answer = ask(&server, Some(&greedy), (Method::GET, "/v1/renders"), &json!(null)).await;
        (answer.status() == StatusCode::TOO_MANY_REQUESTS).then_some(answer)
    });
    // A look every 20 ms is not too many; several such are.
    let (answer, ..) = tokio::join!(refused, flood(&server, &greedy), flood(&server, &greedy));
    assert_eq!(answer.headers()["retry-after"], "1", "rounded up");
    assert_eq!(answer.json::<Value>().await.unwrap()["code"], "rate_limited");
    submit(&server, &modest, &quick()).await;
}

async fn flood(server: &Server, key: &str) {
    for _ in 0..200 {
        ask(server, Some(key), (Method::GET, "/v1/renders"), &json!(null)).await;
    }
}

#[tokio::test]
async fn many_jobs_of_one_key_do_not_hold_up_another() {
    let data = tempfile::tempdir().unwrap();
    let [many, one] = ["many", "one"].map(|name| add_key(data.path(), name));
    let server = Server::start(data.path(), &["--concurrent", "2"]);
    let mut ids = Vec::new();
    for _ in 0..4 {
        ids.push(submit(&server, &many, &endless()).await);
    }
    until(async || Some(job_of(&server, &many, &ids[1]).await).filter(|job| job["state"] == "running")).await;
    let small = submit(&server, &one, &quick()).await;
    // Both places are taken; the next that is free goes to whoever has none, before those who came earlier.
    let path = format!("/v1/renders/{}/cancel", ids[0]);
    ask(&server, Some(&many), (Method::POST, &path), &json!(null)).await;
    until(async || Some(job_of(&server, &one, &small).await).filter(|job| job["state"] == "succeeded")).await;
    assert_eq!(job_of(&server, &many, &ids[3]).await["state"], "queued");
}
