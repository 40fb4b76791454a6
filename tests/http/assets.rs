//! Files that scenes refer to.

use crate::server::{Server, quick, until};
use reqwest::{Response, StatusCode};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

/// A tetrahedron of glass where the ball was.
const MESH: &str =
    "v 0 1 0\nv -0.5 0.1 0.5\nv 0.5 0.1 0.5\nv 0 0.1 -0.5\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n";

fn name_of(content: &[u8]) -> String {
    Sha256::digest(content).iter().map(|byte| format!("{byte:02x}")).collect()
}

async fn put(server: &Server, name: &str, content: impl Into<reqwest::Body>) -> Response {
    server.client.put(server.url(&format!("/v1/assets/{name}"))).body(content).send().await.unwrap()
}

fn scene_with(asset: &str) -> Value {
    let mut scene = quick();
    scene["objects"][1] = json!({ "name": "glass", "type": "mesh", "asset": asset, "material": "glass" });
    scene
}

#[tokio::test]
async fn a_mesh_that_was_sent_can_be_rendered() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let name = name_of(MESH.as_bytes());
    let unknown = server.post("/v1/renders", scene_with(&name).to_string()).await;
    assert_eq!(unknown.status(), StatusCode::UNPROCESSABLE_ENTITY);
    let problem: Value = unknown.json().await.unwrap();
    assert_eq!(problem["errors"][0]["code"], "asset_unavailable", "{problem:#}");

    let new = put(&server, &name, MESH).await;
    assert_eq!(new.status(), StatusCode::CREATED);
    assert_eq!(new.json::<Value>().await.unwrap(), json!({ "sha256": name, "bytes": MESH.len() }));
    assert_eq!(put(&server, &name, MESH).await.status(), StatusCode::OK, "sending it again changes nothing");
    let back = server.get(&format!("/v1/assets/{name}")).await;
    assert_eq!(back.text().await.unwrap(), MESH);

    let id = server.submit(&scene_with(&name)).await;
    server.wait_for_state(&id, "succeeded").await;
    server.kill();
    let again = Server::start(data.path(), &[]);
    let id = again.submit(&scene_with(&name)).await;
    again.wait_for_state(&id, "succeeded").await;
}

#[tokio::test]
async fn content_that_is_not_what_its_name_says_is_not_kept() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &["--max-asset", "1k"]);
    let name = name_of(b"something else");
    let wrong = put(&server, &name, MESH).await;
    assert_eq!(wrong.status(), StatusCode::UNPROCESSABLE_ENTITY);
    assert_eq!(wrong.json::<Value>().await.unwrap()["code"], "asset_mismatch");
    assert_eq!(server.get(&format!("/v1/assets/{name}")).await.status(), StatusCode::NOT_FOUND);
    let large = vec![b'v'; 3000];
    let refused = put(&server, &name_of(&large), large).await;
    assert_eq!(refused.status(), StatusCode::PAYLOAD_TOO_LARGE);
    assert_eq!(refused.json::<Value>().await.unwrap()["limit"], 1024);
    for name in ["x", &name.to_uppercase(), "..%2Fjobs.sqlite"] {
        assert_eq!(put(&server, name, MESH).await.status(), StatusCode::BAD_REQUEST, "{name}");
        assert_eq!(server.get(&format!("/v1/assets/{name}")).await.status(), StatusCode::NOT_FOUND, "{name}");
    }
    // The answer does not wait until its pieces are removed.
    let nothing_left = || std::fs::read_dir(data.path().join("assets")).unwrap().next().is_none();
    until(async || nothing_left().then_some(())).await;
}

/// Begins an upload, and goes no further.
async fn begin(server: &Server) -> TcpStream {
    let head = format!(
        "PUT /v1/assets/{} HTTP/1.1\r\nhost: x\r\nconnection: close\r\ncontent-length: 100\r\n\r\nv",
        name_of(b"what never comes")
    );
    let mut stream = TcpStream::connect(server.base.strip_prefix("http://").unwrap()).await.unwrap();
    stream.write_all(head.as_bytes()).await.unwrap();
    stream
}

#[tokio::test]
async fn uploads_that_never_end_hold_nobody_up() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &["--rate", "0"]);
    let mut open = Vec::new();
    for _ in 0..600 {
        open.push(begin(&server).await);
    }
    // More than the service takes at once: the last is told so, and everybody else is served.
    let mut answer = [0; 12];
    open.pop().unwrap().read_exact(&mut answer).await.unwrap();
    assert_eq!(&answer, b"HTTP/1.1 503");
    let id = server.submit(&quick()).await;
    server.wait_for_state(&id, "succeeded").await;
    drop(open);
    until(async || put(&server, &name_of(MESH.as_bytes()), MESH).await.status().is_success().then_some(()))
        .await;
}

#[tokio::test]
async fn an_upload_that_breaks_off_leaves_nothing() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let folder = data.path().join("assets");
    let mut stream =
        tokio::net::TcpStream::connect(server.base.strip_prefix("http://").unwrap()).await.unwrap();
    let head =
        format!("PUT /v1/assets/{} HTTP/1.1\r\nhost: x\r\ncontent-length: 1000\r\n\r\nhalf", name_of(b""));
    stream.write_all(head.as_bytes()).await.unwrap();
    let count = || std::fs::read_dir(&folder).unwrap().count();
    crate::server::until(async || (count() == 1).then_some(())).await;
    drop(stream);
    crate::server::until(async || (count() == 0).then_some(())).await;
}
