//! Asking again for what has not changed.

use crate::server::{Server, quick};
use reqwest::StatusCode;

#[tokio::test]
async fn what_has_not_changed_is_not_sent_again() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let id = server.submit(&quick()).await;
    server.wait_for_state(&id, "succeeded").await;
    for path in [format!("/v1/renders/{id}"), format!("/v1/renders/{id}/image.png"), "/page.css".into()] {
        let tag = server.get(&path).await.headers()["etag"].clone();
        assert!(!tag.to_str().unwrap().starts_with("W/"), "strong");
        let again = server.client.get(server.url(&path)).header("if-none-match", &tag).send().await.unwrap();
        assert_eq!(again.status(), StatusCode::NOT_MODIFIED, "{path}");
        assert_eq!(again.headers()["etag"], tag);
        let other =
            server.client.get(server.url(&path)).header("if-none-match", "\"no\"").send().await.unwrap();
        assert_eq!(other.status(), StatusCode::OK, "{path}");
    }
}
