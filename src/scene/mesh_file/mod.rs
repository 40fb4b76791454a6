//! Mesh files: PLY and OBJ, also compressed with gzip; told apart by their first bytes.

mod obj;
mod ply;

use crate::geometry::MeshData;
use flate2::read::MultiGzDecoder;
use std::borrow::Cow;
use std::io::Read;

/// Most bytes a compressed mesh may inflate to.
const MAX_INFLATED_BYTES: u64 = 1 << 30;
/// Inflated bytes per compressed byte beyond which a file is taken for an attack, once it is above
/// [`FREE_INFLATED_BYTES`]; meshes reach 10.
const MAX_INFLATION: u64 = 100;
/// A file may inflate to this size at any ratio.
const FREE_INFLATED_BYTES: u64 = 1 << 20;

/// Why a file is not a mesh.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum MeshFileError {
    /// The gzip stream is damaged.
    #[error("the gzip data is damaged or cut off: {0}")]
    Gzip(String),
    /// The gzip stream is far larger than it looks.
    #[error("it inflates to more than {0} bytes")]
    Inflates(u64),
    /// Neither of the formats.
    #[error("it is neither a PLY file nor the text of an OBJ file")]
    UnknownFormat,
    /// Something is wrong at a place of the file.
    #[error("{place}: {reason}")]
    At {
        /// Line or record.
        place: String,
        /// What is wrong there.
        reason: String,
    },
}

/// Reads a mesh. Indices and numbers are as in the file, not yet checked.
pub(super) fn decode(bytes: &[u8]) -> Result<MeshData, MeshFileError> {
    let bytes = inflate(bytes)?;
    if bytes.starts_with(b"ply") {
        return ply::decode(&bytes);
    }
    match std::str::from_utf8(&bytes) {
        Ok(text) if !text.contains('\0') => obj::decode(text),
        _ => Err(MeshFileError::UnknownFormat),
    }
}

fn inflate(bytes: &[u8]) -> Result<Cow<'_, [u8]>, MeshFileError> {
    if !bytes.starts_with(&[0x1f, 0x8b]) {
        return Ok(Cow::Borrowed(bytes));
    }
    let by_ratio = FREE_INFLATED_BYTES.max((bytes.len() as u64).saturating_mul(MAX_INFLATION));
    let limit = by_ratio.min(MAX_INFLATED_BYTES);
    let mut inflated = Vec::new();
    MultiGzDecoder::new(bytes)
        .take(limit + 1)
        .read_to_end(&mut inflated)
        .map_err(|error| MeshFileError::Gzip(error.to_string()))?;
    if inflated.len() as u64 > limit {
        return Err(MeshFileError::Inflates(limit));
    }
    Ok(Cow::Owned(inflated))
}

fn at(place: impl Into<String>, reason: impl Into<String>) -> MeshFileError {
    MeshFileError::At { place: place.into(), reason: reason.into() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::{Compression, write::GzEncoder};
    use std::io::Write;

    const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

    fn gzip(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    #[test]
    fn a_compressed_mesh_is_the_mesh() {
        assert_eq!(decode(&gzip(TRIANGLE.as_bytes())), decode(TRIANGLE.as_bytes()));
    }

    #[test]
    fn every_truncation_of_a_compressed_mesh_is_an_error() {
        let packed = gzip(TRIANGLE.as_bytes());
        for length in 0..packed.len() {
            decode(&packed[..length]).unwrap_err();
        }
    }

    #[test]
    fn a_bomb_is_refused() {
        let bomb = gzip(&vec![b' '; 16 << 20]);
        assert!(matches!(decode(&bomb), Err(MeshFileError::Inflates(_))));
    }

    #[test]
    fn other_files_are_refused() {
        for bytes in [&b"\x89PNG\r\n\x1a\n"[..], b"\xff\xfe", b"\0\0"] {
            assert_eq!(decode(bytes), Err(MeshFileError::UnknownFormat));
        }
        decode(b"").unwrap_err();
        decode(b"hello").unwrap_err();
    }
}
