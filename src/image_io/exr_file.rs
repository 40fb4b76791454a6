//! Pictures in OpenEXR files: linear, 32-bit floats.

use super::{ImageError, LinearImage, check_size};
use exr::image::{Encoding, Image, Layer, SpecificChannels};
use exr::meta::MetaData;
use exr::meta::header::LayerAttributes;
use exr::prelude::{ReadChannels, ReadLayers, ReadSpecificChannel, Vec2, WritableImage, read};
use std::io::Cursor;

/// The picture as an EXR file, compressed without loss.
///
/// # Errors
/// If the picture is empty or a pixel is not finite.
pub fn encode_exr(image: &LinearImage) -> Result<Vec<u8>, ImageError> {
    image.check()?;
    let width = image.width as usize;
    let pixel = |at: Vec2<usize>| {
        let [r, g, b] = image.pixels.get(at.y() * width + at.x()).copied().unwrap_or_default();
        (r, g, b)
    };
    let layer = Layer::new(
        (width, image.height as usize),
        LayerAttributes::default(),
        // Blocks in increasing order, written by one thread: the same picture gives the same bytes.
        Encoding::SMALL_LOSSLESS,
        SpecificChannels::rgb(pixel),
    );
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer)
        .write()
        .non_parallel()
        .to_buffered(&mut bytes)
        .map_err(|error| ImageError::Encode(error.to_string()))?;
    Ok(bytes.into_inner())
}

/// Reads an OpenEXR file of at most `most_pixels` pixels.
pub(super) fn decode(bytes: &[u8], most_pixels: u64) -> Result<LinearImage, ImageError> {
    let malformed =
        |error: exr::error::Error| ImageError::Malformed { format: "EXR", reason: error.to_string() };
    let meta = MetaData::read_from_buffered(bytes, false).map_err(malformed)?;
    // Of several layers the first that has the channels is read, whichever that is.
    for header in &meta.headers {
        check_size(header.layer_size.width(), header.layer_size.height(), most_pixels)?;
    }
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .required("R")
        .required("G")
        .required("B")
        .collect_pixels(
            |size, _| (size.width(), vec![[0.0; 3]; size.width() * size.height()]),
            |(width, pixels): &mut (usize, Vec<[f32; 3]>), at, (r, g, b): (f32, f32, f32)| {
                if let Some(pixel) = pixels.get_mut(at.y() * *width + at.x()) {
                    *pixel = [r, g, b];
                }
            },
        )
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(malformed)?;
    let (width, pixels) = image.layer_data.channel_data.pixels;
    let (width, height) = check_size(width, pixels.len() / width.max(1), most_pixels)?;
    Ok(LinearImage { width, height, pixels })
}
