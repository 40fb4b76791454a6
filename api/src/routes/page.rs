//! `/`: the web page and its files, embedded in the binary.

use super::renders::not_modified;
use crate::problem::Problem;
use axum::extract::Path;
use axum::http::{HeaderMap, header};
use axum::response::{IntoResponse, Response};
use sha2::{Digest, Sha256};

/// Name, type and content of each file.
const FILES: [(&str, &str, &str); 15] = [
    ("index.html", "text/html; charset=utf-8", include_str!("../../web/index.html")),
    ("page.css", "text/css; charset=utf-8", include_str!("../../web/page.css")),
    ("page.js", "text/javascript; charset=utf-8", include_str!("../../web/page.js")),
    ("recent.js", "text/javascript; charset=utf-8", include_str!("../../web/recent.js")),
    ("sketch.js", "text/javascript; charset=utf-8", include_str!("../../web/sketch.js")),
    ("chart.js", "text/javascript; charset=utf-8", include_str!("../../web/chart.js")),
    ("nephroid.js", "text/javascript; charset=utf-8", include_str!("../../web/nephroid.js")),
    ("editor.js", "text/javascript; charset=utf-8", include_str!("../../web/editor.js")),
    ("complete.js", "text/javascript; charset=utf-8", include_str!("../../web/complete.js")),
    ("exr.js", "text/javascript; charset=utf-8", include_str!("../../web/exr.js")),
    ("layers.js", "text/javascript; charset=utf-8", include_str!("../../web/layers.js")),
    ("docs.html", "text/html; charset=utf-8", include_str!("../../web/docs.html")),
    ("docs.css", "text/css; charset=utf-8", include_str!("../../web/docs.css")),
    ("docs.js", "text/javascript; charset=utf-8", include_str!("../../web/docs.js")),
    ("icon.svg", "image/svg+xml", include_str!("../../web/icon.svg")),
];

/// `GET /`
pub(super) async fn index(headers: HeaderMap) -> Result<Response, Problem> {
    file(Path("index.html".into()), headers).await
}

/// `GET /docs`
pub(super) async fn docs(headers: HeaderMap) -> Result<Response, Problem> {
    file(Path("docs.html".into()), headers).await
}

/// `GET /{file}`
pub(super) async fn file(Path(name): Path<String>, headers: HeaderMap) -> Result<Response, Problem> {
    let found = FILES.iter().find(|(own, _, _)| *own == name);
    let &(_, kind, content) = found.ok_or_else(|| Problem::not_found("There is nothing at this address."))?;
    let tag: String = Sha256::digest(content).iter().take(16).map(|byte| format!("{byte:02x}")).collect();
    let head = [
        (header::CONTENT_TYPE, kind.to_owned()),
        (header::CACHE_CONTROL, "no-cache".to_owned()),
        (header::ETAG, format!("\"{tag}\"")),
    ];
    Ok(not_modified(&headers, (head, content).into_response()))
}
