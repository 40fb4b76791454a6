//! Request bodies: JSON text, in bounded memory and bounded time.

use crate::jobs::{StoreError, Upload, UploadError};
use crate::problem::Problem;
use axum::body::Body;
use axum::http::{HeaderMap, header};
use http_body_util::BodyExt;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, SemaphorePermit};

/// What is still read and thrown away of a body that is too large. A client that is cut off while it
/// sends sees a broken connection; one that may finish sees why it was refused.
const DISCARD_BYTES: usize = 1 << 30;
/// Longest time that a scene may take.
const TIME_LIMIT: Duration = Duration::from_secs(60);
/// Longest time that an asset may take.
const ASSET_TIME_LIMIT: Duration = Duration::from_secs(600);

/// Memory is shared out in pieces of this size; the first of each body is free.
const PIECE: usize = 64 << 10;
/// As many bodies of the largest size may be in memory at once; more are refused, or one client could fill it with
/// bodies that never end.
const LARGEST_AT_ONCE: usize = 4;
/// Assets that may be on their way at once. Each holds a thread that writes it.
const UPLOADS_AT_ONCE: usize = 32;

/// Room for what is on its way in.
#[derive(Clone, Debug)]
pub(crate) struct Room {
    limit: usize,
    pieces: Arc<Semaphore>,
    uploads: Arc<Semaphore>,
}

/// The memory that a body takes, until this is dropped.
pub(crate) type Taken = Option<OwnedSemaphorePermit>;

impl Room {
    /// For bodies of at most `limit` bytes.
    pub(crate) fn new(limit: usize) -> Self {
        let pieces = (limit / PIECE + 1).saturating_mul(LARGEST_AT_ONCE).min(Semaphore::MAX_PERMITS);
        let uploads = Arc::new(Semaphore::new(UPLOADS_AT_ONCE));
        Self { limit, pieces: Arc::new(Semaphore::new(pieces)), uploads }
    }

    /// A place for an upload, until it is dropped.
    pub(crate) fn for_upload(&self) -> Result<SemaphorePermit<'_>, Problem> {
        self.uploads.try_acquire().map_err(|_| Problem::busy())
    }

    /// Takes what a body of so many bytes needs beyond what it has; false if there is not so much.
    fn grow(&self, taken: &mut Taken, bytes: usize) -> bool {
        let missing =
            (bytes / PIECE).saturating_sub(taken.as_ref().map_or(0, OwnedSemaphorePermit::num_permits));
        if missing == 0 {
            return true;
        }
        let count = u32::try_from(missing).unwrap_or(u32::MAX);
        let Ok(more) = Arc::clone(&self.pieces).try_acquire_many_owned(count) else { return false };
        match taken {
            Some(taken) => taken.merge(more),
            None => *taken = Some(more),
        }
        true
    }
}

/// The body as text, if it is declared as JSON and no larger than there is room for.
///
/// # Errors
/// A 415, 413, 408, 400 or 503 that says what is wrong.
pub(crate) async fn read_json_text(
    headers: &HeaderMap,
    body: Body,
    room: &Room,
) -> Result<(String, Taken), Problem> {
    let limit = room.limit;
    if !is_json(headers) {
        return Err(Problem::not_json_type());
    }
    if waits_for_permission(headers) && declared_length(headers).is_some_and(|length| length > limit) {
        return Err(Problem::body_too_large(limit));
    }
    let collected = tokio::time::timeout(TIME_LIMIT, collect(body, room)).await;
    let (bytes, taken) = collected.map_err(|_| Problem::body_too_slow())??;
    let text =
        String::from_utf8(bytes).map_err(|error| Problem::not_utf8(error.utf8_error().valid_up_to()))?;
    Ok((text, taken))
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

async fn collect(mut body: Body, room: &Room) -> Result<(Vec<u8>, Taken), Problem> {
    let limit = room.limit;
    let (mut kept, mut taken, mut fits) = (Vec::new(), None, true);
    let mut seen = 0_usize;
    while let Some(frame) = body.frame().await {
        let frame = frame.map_err(|_| Problem::bad_request("The body ended before its time."))?;
        let Ok(data) = frame.into_data() else { continue };
        seen = seen.saturating_add(data.len());
        fits = fits && seen <= limit && room.grow(&mut taken, seen);
        if fits {
            kept.extend_from_slice(&data);
        } else {
            (kept, taken) = (Vec::new(), None);
        }
        if seen > limit.saturating_add(DISCARD_BYTES) {
            break;
        }
    }
    match (seen > limit, fits) {
        (true, _) => Err(Problem::body_too_large(limit)),
        (false, true) => Ok((kept, taken)),
        (false, false) => Err(Problem::busy()),
    }
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
    use axum::body::Bytes;
    use axum::http::HeaderValue;
    use futures_util::{StreamExt, stream};
    use std::io;

    type Frame = Result<Bytes, io::Error>;

    fn json() -> HeaderMap {
        HeaderMap::from_iter([(header::CONTENT_TYPE, HeaderValue::from_static("application/json"))])
    }

    #[tokio::test(start_paused = true)]
    async fn a_body_that_never_ends_is_given_up() {
        let some = stream::iter([Frame::Ok(Bytes::from_static(b"{"))]);
        let body = Body::from_stream(some.chain(stream::pending()));
        let refused = read_json_text(&json(), body, &Room::new(1000)).await;
        assert_eq!(refused.unwrap_err().code(), "body_too_slow");
    }

    #[tokio::test]
    async fn large_bodies_share_a_bounded_room() {
        let room = Room::new(10 * PIECE);
        let read = async |bytes: usize| read_json_text(&json(), Body::from(vec![b' '; bytes]), &room).await;
        let mut held = Vec::new();
        while let Ok((_, taken)) = read(10 * PIECE).await {
            held.push(taken);
        }
        assert_eq!(held.len(), LARGEST_AT_ONCE);
        assert_eq!(read(10 * PIECE).await.unwrap_err().code(), "busy");
        assert!(read(PIECE - 1).await.is_ok(), "small ones always pass");
        held.pop();
        assert!(read(10 * PIECE).await.is_ok());
    }

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
