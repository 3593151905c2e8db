//! Decoding of texture images within a budget of texels.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::io::Cursor;

use gltf::json::image::Image as JsonImage;
use image::{ImageFormat, ImageReader};

use super::accessor::Reader;
use super::document::Document;
use super::resolve::{Folder, clip};
use super::{Limits, Notes, Outcome};
use crate::scene::Image;

/// Decodes the images with the given indices. Larger than the budget in all, the largest are halved until they fit.
pub(super) fn images(
    document: &Document,
    folder: &Folder,
    wanted: &[usize],
    limits: &Limits,
    notes: &mut Notes,
) -> Outcome<Vec<Image>> {
    let reader = Reader::new(document, limits);
    let mut encoded = Vec::with_capacity(wanted.len());
    let mut sizes = Vec::with_capacity(wanted.len());
    for &index in wanted {
        let at = |cause: String| format!("image {index}: {cause}");
        let json = document.root.images.get(index).ok_or_else(|| at("it does not exist".into()))?;
        let bytes = contents(json, &reader, folder).map_err(at)?;
        sizes.push(size(&bytes, limits).map_err(at)?);
        encoded.push(bytes);
    }
    let halvings = fit(&sizes, limits.image_bytes);
    let mut decoded = Vec::with_capacity(wanted.len());
    for ((bytes, &index), halvings) in encoded.iter().zip(wanted).zip(halvings) {
        let mut image = decode(bytes, limits).map_err(|cause| format!("image {index}: {cause}"))?;
        for _ in 0..halvings {
            image = halve(&image);
        }
        if halvings > 0 {
            let (w, h) = (image.width, image.height);
            notes.note(format!(
                "image {index} was reduced to {w} x {h} to keep all textures within {} bytes",
                limits.image_bytes
            ));
        }
        decoded.push(image);
    }
    Ok(decoded)
}

fn contents(json: &JsonImage, reader: &Reader, folder: &Folder) -> Outcome<Vec<u8>> {
    match (&json.uri, json.buffer_view) {
        (Some(uri), _) => folder.fetch(uri),
        (None, Some(view)) => Ok(reader.view(view)?.to_vec()),
        (None, None) => Err("it has neither a URI nor a buffer view".into()),
    }
}

/// A PNG or JPEG reader with limits; the first bytes decide, whatever the file says it is.
fn open<'a>(bytes: &'a [u8], limits: &Limits) -> Outcome<ImageReader<Cursor<&'a [u8]>>> {
    let format = match image::guess_format(bytes) {
        Ok(format @ (ImageFormat::Png | ImageFormat::Jpeg)) => format,
        _ => return Err("neither PNG nor JPEG".into()),
    };
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut bounds = image::Limits::default();
    bounds.max_image_width = Some(limits.image_side);
    bounds.max_image_height = Some(limits.image_side);
    bounds.max_alloc = Some(limits.image_decode_bytes);
    reader.limits(bounds);
    Ok(reader)
}

fn size(bytes: &[u8], limits: &Limits) -> Outcome<[u32; 2]> {
    let (width, height) = open(bytes, limits)?.into_dimensions().map_err(|e| clip(&e.to_string()))?;
    let texels = u64::from(width) * u64::from(height);
    if width == 0 || height == 0 || width.max(height) > limits.image_side || texels * 4 > limits.image_decode_bytes {
        return Err(format!("{width} x {height} texels are out of bounds"));
    }
    Ok([width, height])
}

fn decode(bytes: &[u8], limits: &Limits) -> Outcome<Image> {
    let rgba = open(bytes, limits)?.decode().map_err(|e| clip(&e.to_string()))?.into_rgba8();
    let (width, height) = rgba.dimensions();
    let texels = rgba.as_raw().chunks_exact(4).map(|t| [t[0], t[1], t[2], t[3]]).collect();
    Ok(Image { width, height, rgba: texels })
}

/// How often each image must be halved so that all RGBA8 texels fit in `budget` bytes: always the largest first, the
/// first of equals.
fn fit(sizes: &[[u32; 2]], budget: u64) -> Vec<u32> {
    let mut halvings = vec![0; sizes.len()];
    let bytes = |i: usize, n: u32| sizes[i].iter().map(|&s| u64::from((s >> n).max(1))).product::<u64>() * 4;
    let mut largest: BinaryHeap<(u64, Reverse<usize>)> = (0..sizes.len()).map(|i| (bytes(i, 0), Reverse(i))).collect();
    let mut total: u64 = largest.iter().map(|(bytes, _)| bytes).sum();
    // Nothing is left to halve where the largest image is one texel.
    while let Some((before, Reverse(i))) = largest.pop().filter(|(bytes, _)| total > budget && *bytes > 4) {
        halvings[i] += 1;
        let after = bytes(i, halvings[i]);
        total -= before - after;
        largest.push((after, Reverse(i)));
    }
    halvings
}

/// Averages blocks of two by two stored values; an odd last row or column is dropped.
fn halve(image: &Image) -> Image {
    let (width, height) = ((image.width / 2).max(1), (image.height / 2).max(1));
    let texel = |x: u32, y: u32| {
        let (x, y) = (x.min(image.width - 1), y.min(image.height - 1));
        image.rgba[y as usize * image.width as usize + x as usize].map(u32::from)
    };
    let mut rgba = Vec::with_capacity(width as usize * height as usize);
    for y in 0..height {
        for x in 0..width {
            let block =
                [texel(2 * x, 2 * y), texel(2 * x + 1, 2 * y), texel(2 * x, 2 * y + 1), texel(2 * x + 1, 2 * y + 1)];
            rgba.push(std::array::from_fn(|c| (block.iter().map(|t| t[c]).sum::<u32>().div_ceil(4)).min(255) as u8));
        }
    }
    Image { width, height, rgba }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn budget_is_kept_by_halving_the_largest() {
        assert_eq!(fit(&[[64, 64], [16, 16]], 1 << 20), [0, 0]);
        assert_eq!(fit(&[[64, 64], [16, 16]], 6000), [1, 0]);
        assert_eq!(fit(&[[64, 64], [64, 64]], 64 * 64 * 4 + 32 * 32 * 4), [1, 0]);
        assert_eq!(fit(&[[8, 1]], 0), [3]);
        assert!(fit(&[], 0).is_empty());
    }

    #[test]
    fn halving_averages() {
        let image = Image { width: 2, height: 3, rgba: (0..6u8).map(|i| [i * 10, 0, 255, 255]).collect() };
        let half = halve(&image);
        assert_eq!((half.width, half.height), (1, 1));
        assert_eq!(half.rgba, [[15, 0, 255, 255]]);
    }
}
