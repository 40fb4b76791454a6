//! Pictures and masks as numpy arrays (format versions 1 to 3), little-endian, in C order.

use super::{ImageError, LinearImage, MAX_PIXELS, check_size};

const MAGIC: &[u8] = b"\x93NUMPY";

/// Which pixels of a picture count.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mask {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Per pixel, top row first.
    pub values: Vec<bool>,
}

/// The picture as a float32 array of height × width × 3.
#[must_use]
pub fn encode_npy(image: &LinearImage) -> Vec<u8> {
    let mut header = format!(
        "{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}, 3), }}",
        image.height, image.width
    );
    // Magic, version, length, header and line break fill a multiple of 64 bytes.
    let unpadded = MAGIC.len() + 4 + header.len() + 1;
    header.extend(std::iter::repeat_n(' ', unpadded.next_multiple_of(64) - unpadded));
    header.push('\n');
    let mut bytes = Vec::with_capacity(MAGIC.len() + 4 + header.len() + image.pixels.len() * 12);
    bytes.extend(MAGIC);
    bytes.extend([1, 0]);
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.bytes());
    bytes.extend(image.pixels.iter().flatten().flat_map(|x| x.to_le_bytes()));
    bytes
}

/// Reads a picture of height × width × 3 floats.
pub(super) fn decode_image(bytes: &[u8]) -> Result<LinearImage, ImageError> {
    let array = Array::read(bytes)?;
    let &[height, width, 3] = array.shape.as_slice() else {
        return Err(malformed(format!("expected height × width × 3, found {:?}", array.shape)));
    };
    let (width, height) = check_size(width, height, MAX_PIXELS)?;
    let floats: Vec<f32> = match array.descr.as_str() {
        "<f4" => array.elements()?.iter().map(|x| f32::from_le_bytes(*x)).collect(),
        "<f8" => array.elements()?.iter().map(|x| f64::from_le_bytes(*x) as f32).collect(),
        other => return Err(malformed(format!("expected numbers '<f4' or '<f8', found '{other}'"))),
    };
    Ok(LinearImage { width, height, pixels: floats.as_chunks().0.to_vec() })
}

/// Reads a mask of height × width booleans or bytes; what is not zero counts.
///
/// # Errors
/// If the bytes are not such an array, or one larger than 16384 pixels across or down.
pub fn decode_mask(bytes: &[u8]) -> Result<Mask, ImageError> {
    let array = Array::read(bytes)?;
    let &[height, width] = array.shape.as_slice() else {
        return Err(malformed(format!("expected height × width, found {:?}", array.shape)));
    };
    let (width, height) = check_size(width, height, MAX_PIXELS)?;
    match array.descr.as_str() {
        "|b1" | "|u1" | "<u1" | "<b1" => {
            let values = array.elements::<1>()?.iter().map(|[x]| *x != 0).collect();
            Ok(Mask { width, height, values })
        }
        other => Err(malformed(format!("expected booleans '|b1' or bytes '|u1', found '{other}'"))),
    }
}

/// A numpy array, its elements not yet decoded.
struct Array<'b> {
    /// Type of the elements, as numpy writes it.
    descr: String,
    shape: Vec<usize>,
    data: &'b [u8],
}

impl<'b> Array<'b> {
    fn read(bytes: &'b [u8]) -> Result<Self, ImageError> {
        let rest = bytes.strip_prefix(MAGIC).ok_or_else(|| malformed("it does not begin as a numpy file"))?;
        let (header, data) = split_header(rest).ok_or_else(|| malformed("the header is cut off"))?;
        let header = std::str::from_utf8(header).map_err(|_| malformed("the header is not a text"))?;
        let value = |key: &str| {
            let (_, rest) = header.split_once(&format!("'{key}':"))?;
            Some(rest.trim_start())
        };
        let incomplete = || malformed("the header lacks descr, fortran_order or shape");
        if !value("fortran_order").ok_or_else(incomplete)?.starts_with("False") {
            return Err(malformed("the array is in Fortran order; expected C order"));
        }
        let descr =
            value("descr").and_then(|v| v.strip_prefix('\'')?.split_once('\'')).ok_or_else(incomplete)?.0;
        let shape =
            value("shape").and_then(|v| v.strip_prefix('(')?.split_once(')')).ok_or_else(incomplete)?.0;
        let shape = shape
            .split(',')
            .map(str::trim)
            .filter(|n| !n.is_empty())
            .map(|n| n.parse().map_err(|_| malformed("the shape is not made of numbers")))
            .collect::<Result<_, _>>()?;
        Ok(Self { descr: descr.to_owned(), shape, data })
    }

    /// The elements of `N` bytes each, as many as the shape says.
    fn elements<const N: usize>(&self) -> Result<&'b [[u8; N]], ImageError> {
        let count = self.shape.iter().try_fold(1_usize, |product, n| product.checked_mul(*n));
        let (elements, rest) = self.data.as_chunks::<N>();
        if count != Some(elements.len()) || !rest.is_empty() {
            let (bytes, shape) = (self.data.len(), &self.shape);
            return Err(malformed(format!("{bytes} bytes of data do not fill {shape:?} of {N} bytes each")));
        }
        Ok(elements)
    }
}

/// Header and data of what follows the magic bytes.
fn split_header(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let ([major, _minor], rest) = bytes.split_first_chunk()?;
    let (length, rest) = match major {
        1 => {
            let (length, rest) = rest.split_first_chunk()?;
            (usize::from(u16::from_le_bytes(*length)), rest)
        }
        2 | 3 => {
            let (length, rest) = rest.split_first_chunk()?;
            (usize::try_from(u32::from_le_bytes(*length)).ok()?, rest)
        }
        _ => return None,
    };
    rest.split_at_checked(length)
}

fn malformed(reason: impl Into<String>) -> ImageError {
    ImageError::Malformed { format: "npy", reason: reason.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(version: u8, header: &str, data: &[u8]) -> Vec<u8> {
        let length = header.len() as u32;
        let length =
            if version == 1 { (length as u16).to_le_bytes().to_vec() } else { length.to_le_bytes().to_vec() };
        [MAGIC, &[version, 0], &length, header.as_bytes(), data].concat()
    }

    #[test]
    fn the_header_is_aligned_as_numpy_does_it() {
        let bytes = encode_npy(&LinearImage { width: 2, height: 1, pixels: vec![[1.0, 2.0, 3.0]; 2] });
        assert_eq!((bytes.len() - 24) % 64, 0);
        assert_eq!(bytes[bytes.len() - 25], b'\n');
    }

    #[test]
    fn doubles_are_read() {
        let data: Vec<u8> = [0.5_f64, 1.5, 2.5].iter().flat_map(|x| x.to_le_bytes()).collect();
        let bytes = file(2, "{'descr': '<f8', 'fortran_order': False, 'shape': (1, 1, 3), }", &data);
        assert_eq!(decode_image(&bytes).unwrap().pixels, [[0.5, 1.5, 2.5]]);
    }

    #[test]
    fn masks_are_booleans_or_bytes() {
        for descr in ["|b1", "|u1"] {
            let header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': (2, 2), }}\n");
            let mask = decode_mask(&file(1, &header, &[0, 1, 2, 0])).unwrap();
            assert_eq!(mask, Mask { width: 2, height: 2, values: vec![false, true, true, false] });
        }
    }

    #[test]
    fn other_arrays_are_refused() {
        let zeros = [0; 12];
        for header in [
            "{'descr': '<f4', 'fortran_order': True, 'shape': (1, 1, 3), }",
            "{'descr': '>f4', 'fortran_order': False, 'shape': (1, 1, 3), }",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 3), }",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2, 3), }",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (0, 1, 3), }",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (18446744073709551615, 2, 3), }",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (1, x, 3), }",
            "{'descr': '<f4', 'shape': (1, 1, 3), }",
            "{'descr': , 'fortran_order': False, 'shape': (1, 1, 3), }",
            "",
        ] {
            assert!(decode_image(&file(1, header, &zeros)).is_err(), "{header}");
            assert!(decode_mask(&file(1, header, &zeros)).is_err(), "{header}");
        }
    }
}
