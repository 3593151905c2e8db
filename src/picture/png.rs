//! PNG files: 8-bit sRGB, tone-mapped, marked with the sRGB chunk.

use std::io::{Cursor, Write};
use std::path::Path;

use ::image::codecs::png::{CompressionType, FilterType, PngEncoder};
use ::image::{ExtendedColorType, ImageEncoder};

use crate::error::{Error, Result};
use crate::picture::image::Picture;
use crate::picture::post::display::Display;

/// The sRGB chunk with rendering intent 0 (perceptual), length and CRC included. The encoder cannot write it.
const SRGB_CHUNK: &[u8; 13] = b"\0\0\0\x01sRGB\0\xae\xce\x1c\xe9";

/// Where the first chunk after the header begins: signature 8, IHDR 4 + 4 + 13 + 4.
const AFTER_HEADER: usize = 33;

/// Writes the beauty layer as `display` shows it; a tone map is a display, too. `path` only names the file in errors.
///
/// # Errors
/// [`Error::Usage`] if the picture has no beauty layer, [`Error::Io`] if `sink` fails or the format cannot hold it.
pub fn write(sink: impl Write, path: &Path, picture: &Picture, display: impl Into<Display>) -> Result<()> {
    let beauty = picture.beauty().ok_or_else(|| Error::Usage("a PNG needs a picture with R, G and B".into()))?;
    let bytes = display.into().encode(beauty, picture.width);
    write_rgb8(sink, path, [picture.width, picture.height], &bytes)
}

/// Writes 8-bit sRGB as it is: `size` is width and height in pixels, `bytes` three to a pixel, rows from the top.
pub(crate) fn write_rgb8(mut sink: impl Write, path: &Path, size: [u32; 2], bytes: &[u8]) -> Result<()> {
    let mut encoded = Cursor::new(Vec::new());
    PngEncoder::new_with_quality(&mut encoded, CompressionType::Default, FilterType::Adaptive)
        .write_image(bytes, size[0], size[1], ExtendedColorType::Rgb8)
        .map_err(|cause| Error::io(path, "encode", std::io::Error::other(cause)))?;
    let (header, rest) = encoded.get_ref().split_at(AFTER_HEADER);
    for part in [header, SRGB_CHUNK, rest] {
        sink.write_all(part).map_err(|source| Error::io(path, "write", source))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::image::Channels;
    use crate::picture::tonemap::{Curve, ToneMap};

    const LINEAR: ToneMap = ToneMap { curve: Curve::Linear, exposure: 0.0 };

    fn encode(picture: &Picture) -> Vec<u8> {
        let mut bytes = Vec::new();
        write(&mut bytes, Path::new("x.png"), picture, LINEAR).expect("in memory");
        bytes
    }

    /// CRC-32 as the PNG specification defines it (annex D).
    fn crc(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(u32::MAX, |crc, &byte| {
            (0..8).fold(crc ^ u32::from(byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 })
        })
    }

    #[test]
    fn pixels_come_back_in_order() {
        let mut picture = Picture::new(3, 2);
        let data = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3], [0.5; 3], [9.0; 3]];
        picture.push("", Channels::Rgb, data.concat());
        let back = ::image::load_from_memory(&encode(&picture)).expect("a PNG").to_rgb8();
        let pixels: Vec<[u8; 3]> = back.pixels().map(|pixel| pixel.0).collect();
        assert_eq!(back.dimensions(), (3, 2));
        assert_eq!(pixels, [[255, 0, 0], [0, 255, 0], [0, 0, 255], [0; 3], [188; 3], [255; 3]]);
    }

    #[test]
    fn the_chunks_are_whole_and_srgb_comes_second() {
        let mut picture = Picture::new(1, 1);
        picture.push("", Channels::Rgb, vec![0.5; 3]);
        let bytes = encode(&picture);
        let (mut at, mut names) = (8, Vec::new());
        while at < bytes.len() {
            let length = u32::from_be_bytes(bytes[at..at + 4].try_into().expect("4 bytes")) as usize;
            let end = at + 8 + length;
            assert_eq!(crc(&bytes[at + 4..end]).to_be_bytes(), bytes[end..end + 4], "CRC of the chunk at {at}");
            names.push(String::from_utf8_lossy(&bytes[at + 4..at + 8]).into_owned());
            at = end + 4;
        }
        assert_eq!(names.first().map(String::as_str), Some("IHDR"));
        assert_eq!(names.get(1).map(String::as_str), Some("sRGB"));
        assert_eq!(names.last().map(String::as_str), Some("IEND"));
    }

    #[test]
    fn a_picture_without_colour_is_refused() {
        let mut picture = Picture::new(1, 1);
        picture.push("depth", Channels::Scalar, vec![1.0]);
        let error = write(Vec::new(), Path::new("x.png"), &picture, LINEAR).expect_err("no colour");
        assert_eq!(error.exit_code(), 1);
    }
}
