//! Clients that mean harm, or do it.

use crate::bad_input::peak_memory_kib;
use crate::server::{Server, endless, png_size, quick, scene, until};
use reqwest::StatusCode;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use serde_json::{Value, json};
use std::sync::Arc;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::sync::Semaphore;

/// A request that goes on for ever.
const HALF_A_HEAD: &[u8] = b"GET /healthz HTTP/1.1\r\nhost: x\r\nx-slow: ";

async fn connect(server: &Server) -> TcpStream {
    TcpStream::connect(server.base.strip_prefix("http://").unwrap()).await.unwrap()
}

#[tokio::test]
async fn connections_that_dawdle_are_closed_and_hold_nobody_up() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &["--head-time", "2s"]);
    let before = peak_memory_kib(&server);
    let mut slow = Vec::new();
    for _ in 0..300 {
        let mut stream = connect(&server).await;
        stream.write_all(HALF_A_HEAD).await.unwrap();
        slow.push(stream);
    }
    assert_eq!(server.get("/healthz").await.status(), StatusCode::OK);
    let grown = peak_memory_kib(&server) - before;
    assert!(grown < 50 * 1024, "{grown} KiB");
    for mut stream in slow {
        // The answer, if there is one, and the end of the connection.
        let mut rest = Vec::new();
        let read = tokio::time::timeout(crate::server::DEADLINE, stream.read_to_end(&mut rest)).await;
        assert!(read.is_ok(), "the connection stays open");
    }
}

#[tokio::test]
async fn more_connections_than_may_be_wait_their_turn() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &["--connections", "2"]);
    let idle = [connect(&server).await, connect(&server).await];
    let waiting = tokio::spawn({
        let (client, url) = (reqwest::Client::new(), server.url("/healthz"));
        async move { client.get(url).send().await.unwrap().status() }
    });
    drop(idle);
    assert_eq!(waiting.await.unwrap(), StatusCode::OK);
}

#[tokio::test]
async fn nesting_without_end_is_refused() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    for text in ["[".repeat(1_000_000), format!("{}1{}", "{\"a\":".repeat(100_000), "}".repeat(100_000))] {
        let answer = server.post("/v1/renders", text).await;
        assert!(answer.status().is_client_error(), "{}", answer.status());
        let problem: Value = answer.json().await.unwrap();
        assert!(problem["detail"].as_str().unwrap().contains("nested"), "{problem:#}");
    }
}

/// Sends one request on a connection of its own; whether it was refused.
async fn ask_alone(address: &str, request: &str) -> bool {
    let mut stream = TcpStream::connect(address).await.unwrap();
    stream.write_all(request.as_bytes()).await.unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).await.unwrap();
    let status = answer.split(' ').nth(1).unwrap_or("none");
    assert!(["200", "202", "429"].contains(&status), "{answer}");
    status == "429"
}

#[tokio::test]
async fn ten_thousand_requests_at_once_are_answered_in_bounded_memory() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &["--queue", "50"]);
    server.submit(&endless()).await;
    let before = peak_memory_kib(&server);
    let address = server.base.strip_prefix("http://").unwrap();
    let body = scene([16, 12], 1).to_string();
    let head = "HTTP/1.1\r\nhost: x\r\nconnection: close\r\n";
    let post = format!(
        "POST /v1/renders {head}content-type: application/json\r\ncontent-length: {}\r\n\r\n{body}",
        body.len()
    );
    let get = format!("GET /v1/renders?limit=3 {head}\r\n");
    // All at once, where this process may open as many files.
    let limit = getrlimit(Resource::Nofile);
    setrlimit(Resource::Nofile, Rlimit { current: limit.maximum, ..limit }).unwrap();
    let files = getrlimit(Resource::Nofile).current.unwrap_or(u64::MAX);
    let gate =
        Arc::new(Semaphore::new(usize::try_from(files.saturating_sub(1000)).unwrap().clamp(1, 10_000)));
    let mut tasks = tokio::task::JoinSet::new();
    for number in 0..10_000 {
        let (address, gate) = (address.to_owned(), Arc::clone(&gate));
        let request = if number % 4 == 0 { post.clone() } else { get.clone() };
        tasks.spawn(async move {
            let _open = gate.acquire().await;
            ask_alone(&address, &request).await
        });
    }
    let refused = tasks.join_all().await.into_iter().filter(|refused| *refused).count();
    assert!(refused > 0, "the queue has a bound");
    let grown = peak_memory_kib(&server) - before;
    eprintln!("10,000 requests at once: {grown} KiB");
    assert!(grown < 256 * 1024, "{grown} KiB");
    assert_eq!(server.get("/readyz").await.status(), StatusCode::OK);
}

#[tokio::test]
async fn large_bodies_that_never_end_do_not_fill_the_memory() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &["--max-body", "8M"]);
    let before = peak_memory_kib(&server);
    let (bytes, mut open) = (8_000_000, Vec::new());
    let head = format!(
        "POST /v1/renders HTTP/1.1\r\nhost: x\r\ncontent-type: application/json\r\ncontent-length: {bytes}\r\n\r\n"
    );
    for _ in 0..40 {
        let mut stream = connect(&server).await;
        stream.write_all(head.as_bytes()).await.unwrap();
        stream.write_all(&vec![b' '; bytes - 1]).await.unwrap();
        open.push(stream);
    }
    // Who sends little is served, and who sends much is told.
    server.submit(&quick()).await;
    let mut last = open.pop().unwrap();
    last.write_all(b" ").await.unwrap();
    let mut answer = [0; 12];
    last.read_exact(&mut answer).await.unwrap();
    assert_eq!(&answer, b"HTTP/1.1 503");
    // Four of them are kept, each twice while its buffer grows; the rest is what connections and a small render take.
    let grown = peak_memory_kib(&server) - before;
    assert!(grown < 150 * 1024, "{grown} KiB");
}

#[tokio::test]
async fn connections_never_take_the_files_that_pictures_need() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start_with_files(data.path(), &["--head-time", "600s"], 100);
    // Large enough for files of its own.
    let id = server.submit(&scene([640, 480], 2)).await;
    let mut slow = Vec::new();
    // More than may be open, and no more than may wait to be.
    for _ in 0..140 {
        let mut stream = connect(&server).await;
        stream.write_all(HALF_A_HEAD).await.unwrap();
        slow.push(stream);
    }
    let picture = data.path().join("jobs").join(&id).join("attempt-1/image.png");
    until(async || picture.exists().then_some(())).await;
    drop(slow);
    server.wait_for_state(&id, "succeeded").await;
    assert_eq!(png_size(&server.png(&id).await), [640, 480]);
}

#[tokio::test]
async fn every_limit_of_a_scene_is_told_with_its_number() {
    let data = tempfile::tempdir().unwrap();
    let limits = ["--max-primitives", "1", "--max-lights", "1", "--max-memory", "300M"];
    let server = Server::start(data.path(), &limits);
    let refused = async |path: &str, scene: &Value| -> Value {
        let answer = server.post(path, scene.to_string()).await;
        assert_eq!(answer.status(), StatusCode::UNPROCESSABLE_ENTITY);
        answer.json().await.unwrap()
    };
    let problem = refused("/v1/renders", &quick()).await;
    assert_eq!((&problem["errors"][0]["pointer"], &problem["limit"]), (&json!("/objects"), &json!(1)));
    let mut alone = quick();
    alone["objects"].as_array_mut().unwrap().truncate(1);
    alone["lights"] = json!([
        { "type": "point", "position": [0, 3, 0], "intensity": [1, 1, 1] },
        { "type": "point", "position": [1, 3, 0], "intensity": [1, 1, 1] }
    ]);
    let problem = refused("/v1/renders", &alone).await;
    assert_eq!((&problem["errors"][0]["pointer"], &problem["limit"]), (&json!("/lights"), &json!(1)));
    alone["lights"].as_array_mut().unwrap().truncate(1);
    alone["image"] = json!({ "width": 3000, "height": 2000 });
    let problem = refused("/v1/renders", &alone).await;
    assert!(problem["detail"].as_str().unwrap().contains("memory"), "{problem:#}");
}

#[tokio::test]
async fn what_only_a_plan_tells_is_held_against_the_limits_before_a_job_is_taken() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let plan: Value = server.post("/v1/plans", quick().to_string()).await.json().await.unwrap();
    let memory = plan["memory_bytes"].as_u64().unwrap();
    let enough = ["--max-memory", &memory.to_string()];
    let little = ["--max-memory", &(memory - 1).to_string()];
    let cases = [(little, "memory", memory - 1), (["--max-photons", "1000"], "photons", 1000)];
    for (flags, what, limit) in cases {
        let data = tempfile::tempdir().unwrap();
        let server = Server::start(data.path(), &flags);
        for path in ["/v1/plans", "/v1/renders", "/v1/renders?validate_only=true"] {
            let answer = server.post(path, quick().to_string()).await;
            assert_eq!(answer.status(), StatusCode::UNPROCESSABLE_ENTITY, "{path} {what}");
            let problem: Value = answer.json().await.unwrap();
            assert_eq!((&problem["code"], &problem["limit"]), (&json!("limit_exceeded"), &json!(limit)));
            assert!(problem["detail"].as_str().unwrap().contains(what), "{problem:#}");
        }
        assert_eq!(server.get_json("/v1/renders").await["renders"], json!([]));
    }
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &enough);
    let id = server.submit(&quick()).await;
    server.wait_for_state(&id, "succeeded").await;
}

#[tokio::test]
async fn no_job_takes_more_than_its_time() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &["--max-seconds", "2"]);
    let id = server.submit(&scene([48, 36], 1_000_000)).await;
    let job = server.wait_for_state(&id, "succeeded").await;
    assert_eq!(job["stop_reason"], "seconds");
    assert_eq!(png_size(&server.png(&id).await), [48, 36]);

    // The first round of this takes many times longer.
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &["--max-seconds", "0.05"]);
    let id = server.submit(&scene([2400, 1800], 1)).await;
    let job = server.wait_for_state(&id, "failed").await;
    assert_eq!((&job["error"]["code"], &job["rounds"]), (&json!("time_exceeded"), &json!(0)));
}
