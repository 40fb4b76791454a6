//! Request bodies: JSON text, in bounded memory and bounded time.

use crate::jobs::{StoreError, Upload, UploadError};
use crate::problem::Problem;
use axum::body::Body;
use axum::http::{HeaderMap, header};
use http_body_util::BodyExt;
use std::time::Duration;

/// What is still read and thrown away of a body that is too large. A client that is cut off while it
/// sends sees a broken connection; one that may finish sees why it was refused.
const DISCARD_BYTES: usize = 1 << 30;
/// Longest time that a scene may take.
const TIME_LIMIT: Duration = Duration::from_secs(60);
/// Longest time that an asset may take.
const ASSET_TIME_LIMIT: Duration = Duration::from_secs(600);

/// The body as text, if it is declared as JSON and no larger than `limit` bytes.
///
/// # Errors
/// A 415, 413, 408 or 400 that says what is wrong.
pub async fn read_json_text(headers: &HeaderMap, body: Body, limit: usize) -> Result<String, Problem> {
    if !is_json(headers) {
        return Err(Problem::not_json_type());
    }
    if waits_for_permission(headers) && declared_length(headers).is_some_and(|length| length > limit) {
        return Err(Problem::body_too_large(limit));
    }
    let bytes = tokio::time::timeout(TIME_LIMIT, collect(body, limit)).await;
    let bytes = bytes.map_err(|_| Problem::body_too_slow())??;
    String::from_utf8(bytes).map_err(|error| Problem::not_utf8(error.utf8_error().valid_up_to()))
}

/// Sends an asset's pieces to where they are written, and waits for what comes of it. The disk is never waited for
/// on a thread that serves.
pub(crate) async fn receive(
    mut body: Body,
    limit: usize,
    upload: Upload,
    name: String,
) -> Result<bool, Problem> {
    let (pieces, mut inbox) = tokio::sync::mpsc::channel::<Piece>(8);
    let writing = tokio::task::spawn_blocking(move || write_pieces(&mut inbox, upload, &name));
    let mut seen = 0_usize;
    let reading = async {
        while let Some(frame) = body.frame().await {
            let frame = frame.map_err(|_| Problem::bad_request("The body ended before its time."))?;
            let Ok(data) = frame.into_data() else { continue };
            seen = seen.saturating_add(data.len());
            if seen > limit.saturating_add(DISCARD_BYTES) {
                break;
            }
            // If the writer has given up, the rest is read and thrown away, and its reason is the answer.
            if seen <= limit && pieces.send(Piece::Data(data)).await.is_err() {
                break;
            }
        }
        if seen > limit {
            return Err(Problem::body_too_large(limit));
        }
        let _ = pieces.send(Piece::End).await;
        Ok(())
    };
    tokio::time::timeout(ASSET_TIME_LIMIT, reading).await.map_err(|_| Problem::body_too_slow())??;
    match writing.await.map_err(Problem::internal)? {
        Ok(new) => Ok(new),
        Err(UploadError::Mismatch(actual)) => Err(Problem::asset_mismatch(&actual)),
        Err(UploadError::Store(error)) => Err(error.into()),
        Err(UploadError::Disk(error)) if error.kind() == std::io::ErrorKind::StorageFull => {
            Err(StoreError::StorageFull.into())
        }
        Err(UploadError::Disk(error)) => Err(Problem::internal(error)),
    }
}

/// What goes from a connection to the disk.
enum Piece {
    Data(axum::body::Bytes),
    /// That was all; without it, the connection broke.
    End,
}

fn write_pieces(
    inbox: &mut tokio::sync::mpsc::Receiver<Piece>,
    mut upload: Upload,
    name: &str,
) -> Result<bool, UploadError> {
    loop {
        match inbox.blocking_recv() {
            Some(Piece::Data(data)) => upload.write(&data)?,
            Some(Piece::End) => return upload.finish(name),
            None => return Ok(false),
        }
    }
}

async fn collect(mut body: Body, limit: usize) -> Result<Vec<u8>, Problem> {
    let mut kept = Vec::new();
    let mut seen = 0_usize;
    while let Some(frame) = body.frame().await {
        let frame = frame.map_err(|_| Problem::bad_request("The body ended before its time."))?;
        let Ok(data) = frame.into_data() else { continue };
        seen = seen.saturating_add(data.len());
        if seen <= limit {
            kept.extend_from_slice(&data);
        } else {
            kept = Vec::new();
        }
        if seen > limit.saturating_add(DISCARD_BYTES) {
            break;
        }
    }
    if seen > limit { Err(Problem::body_too_large(limit)) } else { Ok(kept) }
}

/// `application/json` or `application/…+json`, whatever its parameters.
fn is_json(headers: &HeaderMap) -> bool {
    let declared =
        headers.get(header::CONTENT_TYPE).and_then(|value| value.to_str().ok()).unwrap_or_default();
    let kind = declared.split(';').next().unwrap_or_default().trim().to_ascii_lowercase();
    kind == "application/json" || (kind.starts_with("application/") && kind.ends_with("+json"))
}

/// True if the client sends nothing before it is asked to.
fn waits_for_permission(headers: &HeaderMap) -> bool {
    headers.get(header::EXPECT).is_some_and(|value| value.as_bytes().eq_ignore_ascii_case(b"100-continue"))
}

fn declared_length(headers: &HeaderMap) -> Option<usize> {
    headers.get(header::CONTENT_LENGTH)?.to_str().ok()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::HeaderValue;

    fn declared(kind: &'static str) -> bool {
        is_json(&HeaderMap::from_iter([(header::CONTENT_TYPE, HeaderValue::from_static(kind))]))
    }

    #[test]
    fn json_is_declared_in_several_ways() {
        assert!(declared("application/json"));
        assert!(declared("Application/JSON; charset=utf-8"));
        assert!(declared("application/vnd.scene+json"));
        assert!(!declared("text/plain"));
        assert!(!declared("application/x-www-form-urlencoded"));
        assert!(!is_json(&HeaderMap::new()));
    }
}
