//! Decoding of texture images within a budget of texels. What is too large is reduced as what it holds: light,
//! directions or numbers.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::io::Cursor;

use glam::DVec3;
use gltf::json::image::Image as JsonImage;
use image::{ImageFormat, ImageReader};

use super::accessor::Reader;
use super::document::Document;
use super::resolve::{Folder, clip};
use super::{Limits, Notes, Outcome};
use crate::scene::Image;

/// What the texels of an image are to a material; the same image may be several things.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Role {
    /// Light, encoded in sRGB, with alpha.
    Color,
    /// Numbers.
    Data,
    /// Directions about (1/2, 1/2, 1).
    Normal,
}

/// Images of a scene, and where in them each of those that were wanted is.
pub(super) struct Images {
    pub images: Vec<Image>,
    pub places: Vec<u32>,
}

/// Decodes images, given by index and role, in ascending order. Larger than the budget in all, the largest are halved
/// until they fit.
pub(super) fn images(
    document: &Document,
    folder: &Folder,
    wanted: &[(usize, Role)],
    limits: &Limits,
    notes: &mut Notes,
) -> Outcome<Images> {
    let uses: Vec<&[(usize, Role)]> = wanted.chunk_by(|a, b| a.0 == b.0).collect();
    let reader = Reader::new(document, limits);
    let mut encoded = Vec::with_capacity(uses.len());
    let mut sizes = Vec::with_capacity(uses.len());
    for index in uses.iter().map(|roles| roles[0].0) {
        let at = |cause: String| format!("image {index}: {cause}");
        let json = document.root.images.get(index).ok_or_else(|| at("it does not exist".into()))?;
        let bytes = contents(json, &reader, folder).map_err(at)?;
        sizes.push(size(&bytes, limits).map_err(at)?);
        encoded.push(bytes);
    }
    let halvings = fit(&sizes, limits.image_bytes);
    let mut decoded = Images { images: Vec::with_capacity(uses.len()), places: Vec::with_capacity(wanted.len()) };
    for ((bytes, roles), halvings) in encoded.iter().zip(uses).zip(halvings) {
        let index = roles[0].0;
        let image = decode(bytes, limits).map_err(|cause| format!("image {index}: {cause}"))?;
        if halvings > 0 {
            let [w, h] = [image.width, image.height].map(|side| (side >> halvings).max(1));
            notes.note(format!(
                "image {index} was reduced to {w} x {h} to keep all textures within {} bytes",
                limits.image_bytes
            ));
        }
        decoded.add(image, roles, halvings);
    }
    Ok(decoded)
}

impl Images {
    /// Adds an image; one for each role if it is reduced.
    fn add(&mut self, image: Image, roles: &[(usize, Role)], halvings: u32) {
        if halvings == 0 {
            self.places.extend(roles.iter().map(|_| self.images.len() as u32));
            self.images.push(image);
            return;
        }
        for (_, role) in roles {
            let reduced = (1..halvings).fold(halve(&image, *role), |image, _| halve(&image, *role));
            self.places.push(self.images.len() as u32);
            self.images.push(reduced);
        }
    }
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

/// Averages blocks of two by two texels, of more where a side is odd, as what they hold. Alpha is a number in any
/// role.
fn halve(image: &Image, role: Role) -> Image {
    let [width, height] = [image.width, image.height].map(|side| (side / 2).max(1));
    let mut rgba = Vec::with_capacity(width as usize * height as usize);
    for y in 0..height {
        for x in 0..width {
            let mut sum = [0.0; 4];
            for (row, of_row) in parts(y, image.height) {
                for (column, of_column) in parts(x, image.width) {
                    let texel = image.rgba[row as usize * image.width as usize + column as usize];
                    let value = decoded(texel, role);
                    sum = std::array::from_fn(|c| sum[c] + of_row * of_column * value[c]);
                }
            }
            rgba.push(encoded(sum, role));
        }
    }
    Image { width, height, rgba }
}

/// The texels of a side of `side` texels that texel `at` of half as many covers, with their shares.
fn parts(at: u32, side: u32) -> impl Iterator<Item = (u32, f64)> {
    let half = (side / 2).max(1);
    let length = f64::from(side) / f64::from(half);
    let [first, end] = [at, at + 1].map(|edge| f64::from(edge) * length);
    let share = move |texel: u32| (end.min(f64::from(texel + 1)) - first.max(f64::from(texel))) / length;
    (first as u32..side.min(end.ceil() as u32))
        .map(move |texel| (texel, share(texel)))
        .filter(|(_, share)| *share > 0.0)
}

fn decoded(texel: [u8; 4], role: Role) -> [f64; 4] {
    let [r, g, b, a] = texel.map(|byte| f64::from(byte) / 255.0);
    let value = match role {
        Role::Color => [r, g, b].map(|c| if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }),
        Role::Data => [r, g, b],
        Role::Normal => [r, g, b].map(|x| 2.0 * x - 1.0),
    };
    [value[0], value[1], value[2], a]
}

fn encoded([x, y, z, a]: [f64; 4], role: Role) -> [u8; 4] {
    let value = match role {
        Role::Color => [x, y, z].map(|c| if c <= 0.0031308 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 }),
        Role::Data => [x, y, z],
        Role::Normal => DVec3::new(x, y, z).normalize_or(DVec3::Z).to_array().map(|x| 0.5 * x + 0.5),
    };
    [value[0], value[1], value[2], a].map(|x| (255.0 * x).round() as u8)
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

    /// One row of texels, halved.
    fn halved(texels: &[[u8; 4]], role: Role) -> Vec<[u8; 4]> {
        halve(&Image { width: texels.len() as u32, height: 1, rgba: texels.to_vec() }, role).rgba
    }

    #[test]
    fn images_are_halved_as_what_they_hold() {
        let (black, white) = ([0, 0, 0, 0], [255; 4]);
        assert_eq!(halved(&[black, white], Role::Data), [[128; 4]]);
        // Half of the light; alpha is no light.
        assert_eq!(halved(&[black, white], Role::Color), [[188, 188, 188, 128]]);
        let slanted = [[218, 128, 218, 255], [37, 128, 218, 255]];
        assert_eq!(halved(&slanted, Role::Normal), [[128, 128, 255, 255]], "a unit vector");
        assert_eq!(halved(&[[0, 128, 128, 9], [255, 127, 127, 9]], Role::Normal)[0][3], 9);
    }

    #[test]
    fn no_texel_is_dropped() {
        let light = |texels: &[[u8; 4]]| halved(texels, Role::Data).iter().map(|t| f64::from(t[0])).sum::<f64>();
        let row: Vec<[u8; 4]> = (0..7u8).map(|i| [30 * i; 4]).collect();
        // Seven texels become three of 7 / 3 each.
        assert!((light(&row) * 7.0 / 3.0 - 30.0 * 21.0).abs() < 3.0);
        assert_eq!(halved(&[[60; 4], [0; 4], [90; 4]], Role::Data), [[50; 4]]);
        assert_eq!(halved(&[[7; 4]], Role::Color), [[7; 4]]);
        let tall = Image { width: 1, height: 4, rgba: vec![[8; 4], [8; 4], [80; 4], [80; 4]] };
        assert_eq!(halve(&tall, Role::Data).rgba, [[8; 4], [80; 4]]);
    }

    #[test]
    fn roles_share_what_is_not_reduced() {
        let image = Image { width: 2, height: 1, rgba: vec![[0; 4], [255; 4]] };
        let roles = [(3, Role::Color), (3, Role::Data)];
        let mut images = Images { images: vec![], places: vec![] };
        images.add(image.clone(), &roles, 0);
        images.add(image, &roles, 1);
        assert_eq!(images.places, [0, 0, 1, 2]);
        assert_eq!((images.images[1].rgba[0][0], images.images[2].rgba[0][0]), (188, 128));
    }
}
