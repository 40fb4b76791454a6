//! Pictures of linear radiance, and the files they are kept in: PNG for people, EXR and npy for programs.

mod exr_file;
mod hdr_file;
mod npy;
mod png_file;

pub use exr_file::encode_exr;
pub use npy::{Mask, decode_mask, encode_npy};
pub use png_file::encode_png;

/// Most pixels across or down that are read.
const MAX_SIDE: usize = 16_384;

/// Most pixels in all of a picture that is read to be compared.
const MAX_PIXELS: u64 = 1 << 28;

/// Linear radiance per pixel, top row first.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearImage {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Red, green and blue of each pixel.
    pub pixels: Vec<[f32; 3]>,
}

/// The file formats of pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageFormat {
    /// 8 or 16 bits per channel, sRGB.
    Png,
    /// OpenEXR, linear.
    Exr,
    /// A numpy array of height × width × 3, linear.
    Npy,
}

/// Why a picture cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// A pixel is infinite or not a number, which no display shows truthfully.
    #[error("the pixel at ({x}, {y}) is not finite")]
    NotFinite {
        /// Column, from the left.
        x: u32,
        /// Row, from the top.
        y: u32,
    },
    /// Width, height and number of pixels do not fit together, or are out of bounds.
    #[error("the picture's size is wrong: {0}")]
    Size(String),
    /// The bytes are not a picture of this format.
    #[error("not a readable {format} file: {reason}")]
    Malformed {
        /// Name of the format.
        format: &'static str,
        /// What is wrong.
        reason: String,
    },
    /// A picture could not be encoded.
    #[error("the picture could not be encoded: {0}")]
    Encode(String),
}

/// Reads a picture; PNG is decoded to linear.
///
/// # Errors
/// If the bytes are not a picture of that format, or one larger than 16384 pixels across or down.
pub fn decode(bytes: &[u8], format: ImageFormat) -> Result<LinearImage, ImageError> {
    match format {
        ImageFormat::Png => png_file::decode(bytes),
        ImageFormat::Exr => exr_file::decode(bytes, MAX_PIXELS),
        ImageFormat::Npy => npy::decode_image(bytes),
    }
}

/// Reads a picture of linear radiance of at most `most_pixels` pixels: OpenEXR or Radiance, told apart by their first
/// bytes. The size is checked before memory is taken for it.
///
/// # Errors
/// If the bytes are neither, or a value is not finite.
pub fn decode_hdr(bytes: &[u8], most_pixels: u64) -> Result<LinearImage, ImageError> {
    let image = if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        exr_file::decode(bytes, most_pixels)?
    } else if bytes.starts_with(b"#?") {
        hdr_file::decode(bytes, most_pixels)?
    } else {
        let reason = "it begins like neither a Radiance nor an OpenEXR file".to_owned();
        return Err(ImageError::Malformed { format: "HDR", reason });
    };
    image.check()?;
    Ok(image)
}

impl ImageFormat {
    /// The format that a file name's extension stands for.
    #[must_use]
    pub fn from_extension(extension: &str) -> Option<Self> {
        match extension.to_ascii_lowercase().as_str() {
            "png" => Some(Self::Png),
            "exr" => Some(Self::Exr),
            "npy" => Some(Self::Npy),
            _ => None,
        }
    }
}

impl LinearImage {
    /// Checks that the picture can be shown: as many pixels as it says, all of them finite.
    fn check(&self) -> Result<(), ImageError> {
        let expected = u64::from(self.width) * u64::from(self.height);
        if expected == 0 || self.pixels.len() as u64 != expected {
            let size = format!("{} × {} with {} pixels", self.width, self.height, self.pixels.len());
            return Err(ImageError::Size(size));
        }
        match self.pixels.iter().position(|pixel| !pixel.iter().all(|x| x.is_finite())) {
            Some(index) => {
                let (x, y) = (index as u64 % u64::from(self.width), index as u64 / u64::from(self.width));
                Err(ImageError::NotFinite { x: x as u32, y: y as u32 })
            }
            None => Ok(()),
        }
    }
}

/// Checks the size that a file claims, before memory is taken for it.
fn check_size(width: usize, height: usize, most_pixels: u64) -> Result<(u32, u32), ImageError> {
    let side = |n: usize| u32::try_from(n).ok().filter(|_| (1..=MAX_SIDE).contains(&n));
    side(width).zip(side(height)).filter(|(w, h)| u64::from(*w) * u64::from(*h) <= most_pixels).ok_or_else(
        || {
            let limits = format!("1 to {MAX_SIDE} pixels each, and {most_pixels} in all, are read");
            ImageError::Size(format!("{width} × {height}; {limits}"))
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{ImageSettings, Tone};

    fn picture() -> LinearImage {
        let pixels = (0..35).map(|i| [i as f32 * 0.01, 1e-3 * i as f32, 100.0 / (i as f32 + 1.0)]).collect();
        LinearImage { width: 7, height: 5, pixels }
    }

    const PLAIN: ImageSettings = ImageSettings { width: 7, height: 5, exposure: 0.0, tone: Tone::Linear };

    #[test]
    fn exr_and_npy_keep_every_bit() {
        let picture = picture();
        let exr = encode_exr(&picture).unwrap();
        assert_eq!(decode(&exr, ImageFormat::Exr).unwrap(), picture);
        assert_eq!(decode(&encode_npy(&picture), ImageFormat::Npy).unwrap(), picture);
    }

    #[test]
    fn png_keeps_what_eight_bits_can() {
        let png = encode_png(&picture(), &PLAIN).unwrap();
        let read = decode(&png, ImageFormat::Png).unwrap();
        assert_eq!((read.width, read.height), (7, 5));
        // Encoding the decoded picture again changes no byte.
        assert_eq!(encode_png(&read, &PLAIN).unwrap(), png);
    }

    #[test]
    fn a_picture_that_is_not_finite_is_refused() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut picture = picture();
            picture.pixels[16][1] = bad;
            assert!(matches!(encode_png(&picture, &PLAIN), Err(ImageError::NotFinite { x: 2, y: 2 })));
            assert!(matches!(encode_exr(&picture), Err(ImageError::NotFinite { x: 2, y: 2 })));
        }
    }

    #[test]
    fn a_picture_of_the_wrong_size_is_refused() {
        let mut picture = picture();
        picture.pixels.pop();
        assert!(matches!(encode_png(&picture, &PLAIN), Err(ImageError::Size(_))));
        assert!(matches!(encode_exr(&picture), Err(ImageError::Size(_))));
    }

    #[test]
    fn every_truncation_is_an_error_and_no_panic() {
        let picture = picture();
        for (format, bytes) in
            [(ImageFormat::Exr, encode_exr(&picture).unwrap()), (ImageFormat::Npy, encode_npy(&picture))]
        {
            for end in 0..bytes.len() {
                assert!(decode(&bytes[..end], format).is_err(), "{format:?} cut at {end}");
            }
        }
        let png = encode_png(&picture, &PLAIN).unwrap();
        // The decoder does not ask for the last chunk, which holds nothing.
        for end in 0..png.len() - 16 {
            assert!(decode(&png[..end], ImageFormat::Png).is_err(), "PNG cut at {end}");
        }
    }
}
