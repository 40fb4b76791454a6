//! What the service says to requests that it cannot serve.

use crate::server::{Server, quick, scene};
use reqwest::StatusCode;
use serde_json::{Value, json};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

/// The quick scene with one value replaced.
fn with(pointer: &str, value: Value) -> Value {
    let mut scene = quick();
    *scene.pointer_mut(pointer).unwrap() = value;
    scene
}

async fn problem_of(server: &Server, body: String) -> (StatusCode, Value) {
    let answer = server.post("/v1/renders", body).await;
    let status = answer.status();
    assert_eq!(answer.headers()["content-type"], "application/problem+json");
    let problem: Value = answer.json().await.unwrap();
    assert_eq!(problem["status"], status.as_u16());
    (status, problem)
}

#[tokio::test]
async fn every_error_of_a_scene_has_its_place() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let mut misspelt = quick();
    misspelt["objects"][1]["radios"] = json!(1);
    let cases = [
        (misspelt, "/objects/1/radios", "unknown_field"),
        (with("/objects/1/material", json!("glas")), "/objects/1/material", "unknown_reference"),
        (with("/objects/1/radius", json!(0)), "/objects/1/radius", "out_of_range"),
        (with("/objects/0/vertices", json!([[0, 0, 0], [1, 0, 0]])), "/objects/0/vertices", "wrong_length"),
        (with("/camera/target", quick()["camera"]["eye"].clone()), "/camera", "degenerate"),
    ];
    for (scene, pointer, code) in cases {
        let (status, problem) = problem_of(&server, serde_json::to_string_pretty(&scene).unwrap()).await;
        assert_eq!(status, StatusCode::UNPROCESSABLE_ENTITY, "{problem:#}");
        assert_eq!(problem["code"], "scene_invalid");
        let errors = problem["errors"].as_array().unwrap();
        let found = errors.iter().find(|error| error["code"] == code);
        let found = found.unwrap_or_else(|| panic!("{code} is missing: {problem:#}"));
        assert!(found["pointer"].as_str().unwrap().starts_with(pointer), "{problem:#}");
        assert!(found["line"].as_u64() > Some(1) && found["column"].as_u64() > Some(0), "{problem:#}");
        assert!(!found["detail"].as_str().unwrap().is_empty());
    }
    assert_eq!(server.get_json("/v1/renders").await["renders"], json!([]), "nothing of this is kept");
}

#[tokio::test]
async fn all_errors_are_told_at_once() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let mut scene = with("/objects/1/material", json!("glas"));
    scene["objects"][1]["radius"] = json!(-1);
    let (_, problem) = problem_of(&server, scene.to_string()).await;
    assert_eq!(problem["errors"].as_array().unwrap().len(), 2, "{problem:#}");
}

#[tokio::test]
async fn text_that_is_not_json_is_refused_with_its_line() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    for text in ["", "{", "nonsense", "{\"nephroid\": NaN}", "{\n\"a\": 1,\n}"] {
        let (status, problem) = problem_of(&server, text.into()).await;
        assert_eq!(status, StatusCode::BAD_REQUEST, "{text:?}: {problem:#}");
        assert_eq!(problem["code"], "json_invalid", "{text:?}");
        assert!(problem["errors"][0]["line"].as_u64() > Some(0), "{text:?}: {problem:#}");
    }
    let answer = server.post("/v1/renders", vec![b'"', 0xff, b'"']).await;
    assert_eq!(answer.status(), StatusCode::BAD_REQUEST);
}

#[tokio::test]
async fn a_body_must_be_declared_as_json() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    for kind in ["text/plain", "application/x-www-form-urlencoded"] {
        let request = server.client.post(server.url("/v1/renders")).header("content-type", kind);
        let answer = request.body(quick().to_string()).send().await.unwrap();
        assert_eq!(answer.status(), StatusCode::UNSUPPORTED_MEDIA_TYPE, "{kind}");
    }
}

#[tokio::test]
async fn a_scene_that_asks_for_too_much_is_told_the_limit() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &["--max-pixels", "10000", "--max-seconds", "5"]);
    let (status, problem) = problem_of(&server, scene([101, 100], 1).to_string()).await;
    assert_eq!((status, &problem["limit"]), (StatusCode::UNPROCESSABLE_ENTITY, &json!(10000)));
    let (status, problem) =
        problem_of(&server, with("/render/stop", json!({ "seconds": 6 })).to_string()).await;
    assert_eq!((status, &problem["limit"]), (StatusCode::UNPROCESSABLE_ENTITY, &json!(5.0)));
    assert_eq!(problem["errors"][0]["pointer"], "/render/stop/seconds");
    server.submit(&scene([100, 100], 1)).await;
}

#[tokio::test]
async fn addresses_without_anything_are_problems_too() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let unknown = "/v1/renders/01a207a1-46ba-736a-a457-0ff89a07ecd1";
    for path in [unknown, &format!("{unknown}/image.png"), "/v1/renders/x", "/v1/nothing", "/nothing"] {
        let answer = server.get(path).await;
        assert_eq!(answer.status(), StatusCode::NOT_FOUND, "{path}");
        assert_eq!(answer.headers()["content-type"], "application/problem+json", "{path}");
    }
    let answer = server.client.put(server.url("/v1/renders")).send().await.unwrap();
    assert_eq!(answer.status(), StatusCode::METHOD_NOT_ALLOWED);
    assert_eq!(answer.headers()["content-type"], "application/problem+json");
    assert!(answer.headers().contains_key("allow"));
}

/// Sends `head` and then `body_bytes` of JSON blanks; the answer.
async fn send_blanks(server: &Server, head: &str, body_bytes: usize) -> String {
    let mut stream = TcpStream::connect(server.base.strip_prefix("http://").unwrap()).await.unwrap();
    stream.write_all(head.as_bytes()).await.unwrap();
    let piece = vec![b' '; 1 << 20];
    for start in (0..body_bytes).step_by(piece.len()) {
        stream.write_all(&piece[..piece.len().min(body_bytes - start)]).await.unwrap();
    }
    let mut answer = String::new();
    stream.read_to_string(&mut answer).await.unwrap();
    answer
}

pub(crate) fn peak_memory_kib(server: &Server) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{}/status", server.child.id())).unwrap();
    let line = status.lines().find(|line| line.starts_with("VmHWM:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse().unwrap()
}

#[tokio::test]
async fn a_body_of_200_megabytes_is_refused_in_bounded_memory() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let before = peak_memory_kib(&server);
    let bytes = 200_000_000;
    let head = format!(
        "POST /v1/renders HTTP/1.1\r\nhost: x\r\nconnection: close\r\n\
         content-type: application/json\r\ncontent-length: {bytes}\r\n\r\n"
    );
    let answer = send_blanks(&server, &head, bytes).await;
    assert!(answer.starts_with("HTTP/1.1 413 "), "{answer}");
    assert!(answer.contains("body_too_large") && answer.contains("33554432"), "{answer}");
    // What is kept is at most the limit of 32 MiB, twice while the buffer grows.
    let grown = peak_memory_kib(&server) - before;
    assert!(grown < 100 * 1024, "{grown} KiB");
}

#[tokio::test]
async fn a_client_that_asks_first_need_not_send() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let head = "POST /v1/renders HTTP/1.1\r\nhost: x\r\nconnection: close\r\nexpect: 100-continue\r\n\
                content-type: application/json\r\ncontent-length: 200000000\r\n\r\n";
    let answer = send_blanks(&server, head, 0).await;
    assert!(answer.starts_with("HTTP/1.1 413 "), "{answer}");
}
