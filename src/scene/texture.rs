//! Textures: a colour over a surface, constant, checked or from a picture.

use crate::develop::srgb_to_linear;
use crate::geometry::TextureCoordinates;
use glam::{Vec2, Vec3};
use image::{ImageFormat, ImageReader, Limits};
use std::fmt;
use std::io::Cursor;
use std::sync::{Arc, LazyLock};

/// Most pixels across or down.
const MAX_SIDE: u32 = 16_384;

/// Bytes that a decoder may take beside the picture, per pixel of it: four channels of 16 bits.
const DECODER_BYTES: u64 = 8;

/// A colour over a surface.
#[derive(Clone, Debug, PartialEq)]
pub enum Texture {
    /// The same everywhere.
    Constant(Vec3),
    /// A checkerboard in the surface's uv coordinates (metres on a polygon).
    Checker {
        /// Colours of the even and the odd squares.
        colors: [Vec3; 2],
        /// Side of a square, in uv units.
        size: f32,
    },
    /// A picture that repeats in both directions.
    Image {
        /// The picture; materials may share it.
        image: Arc<TextureImage>,
        /// Width and height of one copy of it, in uv units.
        scale: Vec2,
    },
}

/// A picture of 8 bits per channel. What is kept is sRGB, as in the file; what is looked up is linear.
#[derive(PartialEq)]
pub struct TextureImage {
    width: u32,
    height: u32,
    /// Top row first.
    texels: Vec<[u8; 3]>,
    black: bool,
}

/// Why a file is not a texture.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum TextureError {
    /// Neither of the formats.
    #[error("it is neither a PNG nor a JPEG file")]
    UnknownFormat,
    /// The size in its header is too large, before or beside others.
    #[error("it has {width} × {height} pixels; up to {MAX_SIDE} each, and {left} in all, can still be read")]
    TooLarge {
        /// Pixels across.
        width: u32,
        /// Pixels down.
        height: u32,
        /// Pixels that may still be read.
        left: u64,
    },
    /// The data is damaged.
    #[error("it cannot be decoded: {0}")]
    Damaged(String),
}

impl Texture {
    /// The colour at a surface point.
    #[inline]
    #[must_use]
    pub fn eval(&self, at: TextureCoordinates) -> Vec3 {
        match self {
            Self::Constant(color) => *color,
            Self::Checker { colors, size } => {
                let square = (at.uv() / *size).floor();
                let odd = (square.x as i64 ^ square.y as i64) & 1;
                colors[odd as usize]
            }
            Self::Image { image, scale } => image.eval(at.uv() / *scale),
        }
    }

    /// True if no light is ever reflected.
    #[must_use]
    pub fn is_black(&self) -> bool {
        match self {
            Self::Constant(color) => *color == Vec3::ZERO,
            Self::Checker { colors, .. } => colors.iter().all(|c| *c == Vec3::ZERO),
            Self::Image { image, .. } => image.black,
        }
    }
}

impl TextureImage {
    /// Reads a PNG or JPEG file of at most `most_pixels` pixels.
    pub(super) fn decode(bytes: &[u8], most_pixels: u64) -> Result<Self, TextureError> {
        let decoded = decode_rgb8(bytes, most_pixels)?;
        let texels: Vec<[u8; 3]> = decoded.pixels().map(|pixel| pixel.0).collect();
        Ok(Self::new(decoded.width(), decoded.height(), texels))
    }

    fn new(width: u32, height: u32, texels: Vec<[u8; 3]>) -> Self {
        let black = texels.iter().all(|texel| *texel == [0; 3]);
        Self { width, height, texels, black }
    }

    /// The linear colour at a point of the unit square, v upwards, and of its copies all around: bilinear between
    /// the centres of four texels.
    fn eval(&self, uv: Vec2) -> Vec3 {
        let size = Vec2::new(self.width as f32, self.height as f32);
        // Into 0..1 first, so that no digits are lost in far copies.
        let place = (uv - uv.floor()) * size - 0.5;
        let low = place.floor();
        let weight = place - low;
        let (x, y) = (low.x as i64, low.y as i64);
        let row = |y: i64| self.texel(x, y).lerp(self.texel(x + 1, y), weight.x);
        row(y).lerp(row(y + 1), weight.y)
    }

    /// The texel of a column and a row counted upwards.
    fn texel(&self, x: i64, y: i64) -> Vec3 {
        static LINEAR: LazyLock<[f32; 256]> =
            LazyLock::new(|| std::array::from_fn(|byte| srgb_to_linear(byte as f64 / 255.0) as f32));
        let column = x.rem_euclid(i64::from(self.width)) as usize;
        let row = (i64::from(self.height) - 1 - y).rem_euclid(i64::from(self.height)) as usize;
        let texel = self.texels.get(row * self.width as usize + column).copied().unwrap_or_default();
        Vec3::from(texel.map(|byte| LINEAR[usize::from(byte)]))
    }

    /// Number of pixels.
    pub(super) fn pixels(&self) -> u64 {
        self.texels.len() as u64
    }

    /// Bytes it takes in memory.
    pub(super) fn memory_bytes(&self) -> u64 {
        size_of_val(&self.texels[..]) as u64
    }
}

/// Decodes a PNG or JPEG file of at most `most_pixels` pixels; transparency is left out.
pub(crate) fn decode_rgb8(bytes: &[u8], most_pixels: u64) -> Result<image::RgbImage, TextureError> {
    let format = image::guess_format(bytes).ok();
    let format = format.filter(|format| matches!(format, ImageFormat::Png | ImageFormat::Jpeg));
    let format = format.ok_or(TextureError::UnknownFormat)?;
    let reader = || ImageReader::with_format(Cursor::new(bytes), format);
    let damaged = |error: image::ImageError| TextureError::Damaged(error.to_string());
    // The header alone, before memory is taken for what it claims.
    let (width, height) = reader().into_dimensions().map_err(damaged)?;
    let pixels = u64::from(width) * u64::from(height);
    if width.max(height) > MAX_SIDE || pixels > most_pixels {
        return Err(TextureError::TooLarge { width, height, left: most_pixels });
    }
    let mut limits = Limits::default();
    // A row and what a compressed row takes come on top of a tiny picture.
    limits.max_alloc = Some((1 << 20) + DECODER_BYTES * pixels);
    let mut reader = reader();
    reader.limits(limits);
    Ok(reader.decode().map_err(damaged)?.into_rgb8())
}

impl fmt::Debug for TextureImage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "TextureImage({} × {})", self.width, self.height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ExtendedColorType, ImageEncoder};

    /// Red, green over blue, white.
    fn four() -> TextureImage {
        TextureImage::new(2, 2, vec![[255, 0, 0], [0, 255, 0], [0, 0, 255], [255; 3]])
    }

    fn png(width: u32, height: u32, texels: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        image::codecs::png::PngEncoder::new(&mut bytes)
            .write_image(texels, width, height, ExtendedColorType::Rgb8)
            .unwrap();
        bytes
    }

    #[test]
    fn a_texels_centre_has_its_colour_and_v_points_up() {
        for (u, v, color) in
            [(0.25, 0.75, Vec3::X), (0.75, 0.75, Vec3::Y), (0.25, 0.25, Vec3::Z), (0.75, 0.25, Vec3::ONE)]
        {
            assert_eq!(four().eval(Vec2::new(u, v)), color);
        }
    }

    #[test]
    fn between_centres_it_is_the_mean_also_across_the_edge() {
        for (u, v, color) in [
            (0.5, 0.75, Vec3::new(0.5, 0.5, 0.0)),
            (0.0, 0.75, Vec3::new(0.5, 0.5, 0.0)),
            (0.25, 0.5, Vec3::new(0.5, 0.0, 0.5)),
            (0.25, 1.0, Vec3::new(0.5, 0.0, 0.5)),
            (0.5, 0.5, Vec3::splat(0.5)),
        ] {
            assert_eq!(four().eval(Vec2::new(u, v)), color, "{u} {v}");
        }
    }

    #[test]
    fn copies_repeat_on_all_sides() {
        let image = four();
        for shift in [Vec2::new(1.0, 0.0), Vec2::new(-3.0, 2.0), Vec2::new(1000.0, -1000.0)] {
            let uv = Vec2::new(0.25, 0.375);
            assert_eq!(image.eval(uv + shift), image.eval(uv), "{shift}");
        }
    }

    #[test]
    fn colours_are_linear_where_the_file_is_srgb() {
        let image = TextureImage::new(1, 1, vec![[188, 188, 188]]);
        // sRGB 188 is half of the light, to the precision of 8 bits (1/255 of the slope 2.2 · 0.5).
        assert!((image.eval(Vec2::ZERO).x - 0.5).abs() < 0.005);
    }

    #[test]
    fn a_scaled_picture_is_as_large_as_it_says() {
        let texture = Texture::Image { image: Arc::new(four()), scale: Vec2::new(4.0, 2.0) };
        assert_eq!(texture.eval(TextureCoordinates::Uv(Vec2::new(1.0, 1.5))), Vec3::X);
        assert_eq!(texture.eval(TextureCoordinates::Uv(Vec2::new(3.0, 0.5))), Vec3::ONE);
    }

    #[test]
    fn a_png_is_read_top_row_first() {
        let bytes = png(2, 2, &[255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255]);
        assert!(TextureImage::decode(&bytes, 4).unwrap() == four());
    }

    #[test]
    fn a_jpeg_is_read() {
        let mut bytes = Vec::new();
        image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 100)
            .write_image(&[188; 3 * 64], 8, 8, ExtendedColorType::Rgb8)
            .unwrap();
        let image = TextureImage::decode(&bytes, 64).unwrap();
        assert!((image.eval(Vec2::splat(0.4)).y - 0.5).abs() < 0.01);
    }

    /// A header that promises 60 000 × 60 000 pixels is 45 bytes long.
    #[test]
    fn a_bomb_is_refused_by_its_header() {
        let mut bytes = png(1, 1, &[0; 3]);
        for side in [16..20, 20..24] {
            bytes[side].copy_from_slice(&60_000_u32.to_be_bytes());
        }
        let crc = flate2::Crc::new();
        let mut crc = crc;
        crc.update(&bytes[12..29]);
        bytes[29..33].copy_from_slice(&crc.sum().to_be_bytes());
        let error = TextureImage::decode(&bytes, u64::MAX).unwrap_err();
        assert_eq!(error, TextureError::TooLarge { width: 60_000, height: 60_000, left: u64::MAX });
    }

    #[test]
    fn more_pixels_than_are_left_are_refused() {
        let bytes = png(2, 2, &[0; 12]);
        assert!(matches!(TextureImage::decode(&bytes, 3), Err(TextureError::TooLarge { .. })));
        assert!(TextureImage::decode(&bytes, 4).unwrap().black);
    }

    #[test]
    fn other_files_are_refused() {
        for bytes in [&b""[..], b"#?RADIANCE\n", b"GIF89a", b"ply\n"] {
            assert_eq!(TextureImage::decode(bytes, 1 << 20).unwrap_err(), TextureError::UnknownFormat);
        }
    }
}
