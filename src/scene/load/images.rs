//! Decoding of texture images within a budget of texels. What is too large is reduced as what it holds: light,
//! directions or numbers.

use std::borrow::Cow;
use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};
use std::io::Cursor;

use glam::DVec3;
use image::{ColorType, DynamicImage, ImageDecoder, ImageFormat, ImageReader};

use super::Limits;
use super::document::Document;
use super::ktx;
use super::notes::{Notes, Outcome, clip};
use super::resolve::Folder;
use crate::scene::Image;

/// Memory while an image is decoded, in bytes: this much, and a multiple of the bytes that were read.
const DECODING_BYTES: u64 = 240 << 20;
const DECODING_RATIO: u64 = 30;
/// Bytes that all images together decode to, which takes time: this much, and a multiple of the bytes that were read.
const DECODED_BYTES: u64 = 1 << 30;
const DECODED_RATIO: u64 = 64;

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

/// Reads the images of one document.
pub(super) struct ImageSource<'a> {
    pub document: &'a Document<'a>,
    pub folder: &'a Folder,
    pub limits: &'a Limits,
}

/// Where an image is stored. Images of one place are one image.
#[derive(Clone, PartialEq, Eq, Hash)]
enum Place {
    /// Address and length of its bytes.
    Bytes(usize, usize),
    Uri(String),
}

/// An image that looks as if it could be decoded.
struct Probed {
    index: u32,
    size: [u32; 2],
    /// Bytes of the decoded image, before anything is done to it.
    bytes: u64,
    /// Whether its texels are bytes of RGB or RGBA.
    is_plain: bool,
    /// What it is to materials.
    roles: Vec<Role>,
}

/// Decoded images, by index in the file and role.
#[derive(Default)]
pub(super) struct Images {
    pub images: Vec<Image>,
    /// Where in `images` one is.
    slots: HashMap<(u32, Role), u32>,
}

impl Images {
    pub fn slot(&self, image: u32, role: Role) -> Option<u32> {
        self.slots.get(&(image, role)).copied()
    }
}

impl<'a> ImageSource<'a> {
    /// Whether an image can be read, as far as its first bytes tell.
    pub fn check(&self, index: u32, notes: &mut Notes) -> Outcome<()> {
        let (_, bytes) = self.contents(index, notes)?;
        self.probe(index, &bytes).map(drop)
    }

    /// Decodes images, in the order of the file, each place once. Larger than the budget in all, the largest are halved
    /// until they fit, one for each role. Images that cannot be decoded are left out.
    pub fn decode(&self, wanted: &[(u32, Role)], notes: &mut Notes) -> Images {
        let mut wanted = wanted.to_vec();
        wanted.sort_unstable();
        wanted.dedup();
        let (mut places, mut known) = (HashMap::new(), HashMap::new());
        let mut probed: Vec<Probed> = Vec::new();
        for (index, role) in &wanted {
            let slot = *known.entry(*index).or_insert_with(|| {
                let slot = self.slot_of(*index, &mut places, &mut probed, notes);
                notes.or_fault(slot)
            });
            let Some(slot) = slot else { continue };
            if !probed[slot].roles.contains(role) {
                probed[slot].roles.push(*role);
            }
        }
        let decoded = self.decode_all(&probed, notes);
        let mut result = Images::default();
        let firsts: Vec<usize> = decoded
            .into_iter()
            .map(|images| {
                let first = result.images.len();
                result.images.extend(images);
                first
            })
            .collect();
        for (index, role) in wanted {
            let Some(slot) = known[&index] else { continue };
            let end = firsts.get(slot + 1).copied().unwrap_or(result.images.len());
            let of_role = probed[slot].roles.iter().position(|known| *known == role).unwrap_or(0);
            if firsts[slot] < end {
                // What is not reduced serves all roles.
                result.slots.insert((index, role), (firsts[slot] + of_role).min(end - 1) as u32);
            }
        }
        result
    }

    /// Which of the images in `probed` an image is; a new one is added to them.
    fn slot_of(
        &self,
        index: u32,
        places: &mut HashMap<Place, usize>,
        probed: &mut Vec<Probed>,
        notes: &mut Notes,
    ) -> Outcome<usize> {
        let (place, bytes) = self.contents(index, notes)?;
        if let Some(slot) = places.get(&place) {
            return Ok(*slot);
        }
        probed.push(self.probe(index, &bytes)?);
        places.insert(place, probed.len() - 1);
        Ok(probed.len() - 1)
    }

    /// The images of `probed` for each of their roles, or one for all of them; none where one cannot be decoded. The
    /// largest is decoded first: then the least is in memory beside it.
    fn decode_all(&self, probed: &[Probed], notes: &mut Notes) -> Vec<Vec<Image>> {
        let sizes: Vec<[u32; 2]> = probed.iter().map(|probe| probe.size).collect();
        let halvings = fit(&sizes, self.limits.image_bytes);
        let mut order: Vec<usize> = (0..probed.len()).collect();
        order.sort_by_key(|slot| Reverse(probed[*slot].bytes));
        let mut images: Vec<Vec<Image>> = vec![Vec::new(); probed.len()];
        let (mut kept, mut decoded) = (0, 0);
        for slot in order {
            let probe = &probed[slot];
            let read = self.document.buffers.bytes_read();
            let most = (DECODING_BYTES + DECODING_RATIO.saturating_mul(read)).saturating_sub(kept);
            let most_in_all = DECODED_BYTES + DECODED_RATIO.saturating_mul(read);
            decoded += probe.bytes;
            let found = if probe.peak(halvings[slot]) > most || decoded > most_in_all {
                let Probed { index, bytes, .. } = probe;
                Err(format!("image {index}: {bytes} bytes of texels, too many for so small a file"))
            } else {
                self.decode_one(probe, halvings[slot], notes)
            };
            images[slot] = notes.or_fault(found).unwrap_or_default();
            kept += images[slot].iter().map(|image| 4 * image.rgba.len() as u64).sum::<u64>();
        }
        images
    }

    fn decode_one(&self, probe: &Probed, halvings: u32, notes: &mut Notes) -> Outcome<Vec<Image>> {
        let index = probe.index;
        let at = |cause: String| format!("image {index}: {cause}");
        let (_, bytes) = self.contents(index, notes)?;
        let native = native(&bytes, self.limits).map_err(at)?;
        if halvings == 0 {
            return Ok(vec![whole(native)]);
        }
        let [w, h] = [native.width(), native.height()].map(|side| (side >> halvings).max(1));
        let most = self.limits.image_bytes;
        notes.note(format!("image {index} was reduced to {w} x {h} to keep all textures within {most} bytes"));
        let reduced = |role: &Role| (1..halvings).fold(halve_native(&native, *role), |image, _| halve(&image, *role));
        Ok(probe.roles.iter().map(reduced).collect())
    }

    /// The encoded image and where it is.
    fn contents(&self, index: u32, notes: &mut Notes) -> Outcome<(Place, Cow<'a, [u8]>)> {
        let part = self.document.images.part(index as usize)?;
        let at = |cause: String| format!("{}: {cause}", part.place);
        if let Some(uri) = part.text("uri", notes) {
            let bytes = self.folder.fetch(&uri, u64::MAX).map_err(at)?;
            return Ok((Place::Uri(uri.into_owned()), Cow::Owned(bytes)));
        }
        let view = part.index("bufferView")?.ok_or_else(|| at("it has neither a URI nor a buffer view".into()))?;
        let bytes = self.document.buffers.view(view as usize, notes).map_err(at)?.bytes;
        Ok((Place::Bytes(bytes.as_ptr() as usize, bytes.len()), Cow::Borrowed(bytes)))
    }

    fn probe(&self, index: u32, bytes: &[u8]) -> Outcome<Probed> {
        let at = |cause: String| format!("image {index}: {cause}");
        let (size, bytes, color) = if ktx::is_ktx(bytes) {
            (ktx::size(bytes).map_err(at)?, 0, ColorType::Rgba8)
        } else {
            let decoder = open(bytes, self.limits).map_err(at)?;
            (decoder.dimensions().into(), decoder.total_bytes(), decoder.color_type())
        };
        let [width, height] = size;
        let (texels, side) = (u64::from(width) * u64::from(height), self.limits.image_side);
        let most = self.limits.image_decode_bytes;
        if width == 0 || height == 0 || width.max(height) > side || texels * 4 > most {
            return Err(at(format!("{width} x {height} texels are out of bounds")));
        }
        let is_plain = matches!(color, ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8);
        Ok(Probed { index, size, bytes: if bytes == 0 { 4 * texels } else { bytes }, is_plain, roles: Vec::new() })
    }
}

impl Probed {
    /// Bytes in memory while it is decoded and halved so often.
    fn peak(&self, halvings: u32) -> u64 {
        let texels = self.size.iter().map(|side| u64::from(*side)).product::<u64>();
        let roles = self.roles.len() as u64;
        let made = match (halvings, self.is_plain) {
            (0, _) => 4 * texels,
            (_, true) => roles * texels,
            (_, false) => (4 + roles) * texels,
        };
        self.bytes + made
    }
}

fn native(bytes: &[u8], limits: &Limits) -> Outcome<DynamicImage> {
    if ktx::is_ktx(bytes) {
        return ktx::decode(bytes);
    }
    DynamicImage::from_decoder(open(bytes, limits)?).map_err(|e| clip(&e.to_string()))
}

/// A decoder with limits; the first bytes decide, whatever the file says it is.
fn open<'b>(bytes: &'b [u8], limits: &Limits) -> Outcome<impl ImageDecoder + 'b> {
    let format = match image::guess_format(bytes) {
        Ok(format @ (ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::WebP)) => format,
        _ => return Err("neither PNG, JPEG, WebP nor KTX 2".into()),
    };
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut bounds = image::Limits::default();
    bounds.max_image_width = Some(limits.image_side);
    bounds.max_image_height = Some(limits.image_side);
    bounds.max_alloc = Some(limits.image_decode_bytes);
    reader.limits(bounds);
    reader.into_decoder().map_err(|e| clip(&e.to_string()))
}

/// The texels of an image as they are.
fn whole(image: DynamicImage) -> Image {
    let (width, height) = (image.width(), image.height());
    let rgba = bytemuck::allocation::try_cast_vec(image.into_rgba8().into_raw())
        .unwrap_or_else(|(_, rgba)| rgba.chunks_exact(4).map(|t| [t[0], t[1], t[2], t[3]]).collect());
    Image { width, height, rgba }
}

/// An image halved, without a whole copy of it where that can be avoided.
fn halve_native(image: &DynamicImage, role: Role) -> Image {
    let size = [image.width(), image.height()];
    match image {
        DynamicImage::ImageLuma8(gray) => {
            let bytes = gray.as_raw();
            halved(size, role, |at| [bytes[at], bytes[at], bytes[at], 255])
        }
        DynamicImage::ImageLumaA8(gray) => {
            let bytes = gray.as_raw();
            halved(size, role, |at| [bytes[2 * at], bytes[2 * at], bytes[2 * at], bytes[2 * at + 1]])
        }
        DynamicImage::ImageRgb8(rgb) => {
            let bytes = rgb.as_raw();
            halved(size, role, |at| [bytes[3 * at], bytes[3 * at + 1], bytes[3 * at + 2], 255])
        }
        DynamicImage::ImageRgba8(rgba) => {
            let bytes = rgba.as_raw();
            halved(size, role, |at| std::array::from_fn(|c| bytes[4 * at + c]))
        }
        _ => {
            let rgba = image.to_rgba8();
            halved(size, role, |at| std::array::from_fn(|c| rgba.as_raw()[4 * at + c]))
        }
    }
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

fn halve(image: &Image, role: Role) -> Image {
    halved([image.width, image.height], role, |at| image.rgba[at])
}

/// Averages blocks of two by two texels, of more where a side is odd, as what they hold. Alpha is a number in any
/// role.
fn halved([full_width, full_height]: [u32; 2], role: Role, texel: impl Fn(usize) -> [u8; 4]) -> Image {
    let [width, height] = [full_width, full_height].map(|side| (side / 2).max(1));
    let values: [f64; 256] = std::array::from_fn(|byte| decoded(byte as u8, role));
    let columns: Vec<Vec<(u32, f64)>> = (0..width).map(|x| parts(x, full_width).collect()).collect();
    let mut rgba = Vec::with_capacity(width as usize * height as usize);
    for y in 0..height {
        for columns in &columns {
            let mut sum = [0.0; 4];
            for (row, of_row) in parts(y, full_height) {
                for (column, of_column) in columns {
                    let [r, g, b, a] = texel(row as usize * full_width as usize + *column as usize);
                    let value = [values[r as usize], values[g as usize], values[b as usize], f64::from(a) / 255.0];
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

/// What a byte of red, green or blue is.
fn decoded(byte: u8, role: Role) -> f64 {
    let c = f64::from(byte) / 255.0;
    match role {
        Role::Color => {
            if c <= 0.04045 {
                c / 12.92
            } else {
                ((c + 0.055) / 1.055).powf(2.4)
            }
        }
        Role::Data => c,
        Role::Normal => 2.0 * c - 1.0,
    }
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
    fn halved_row(texels: &[[u8; 4]], role: Role) -> Vec<[u8; 4]> {
        halve(&Image { width: texels.len() as u32, height: 1, rgba: texels.to_vec() }, role).rgba
    }

    #[test]
    fn images_are_halved_as_what_they_hold() {
        let (black, white) = ([0, 0, 0, 0], [255; 4]);
        assert_eq!(halved_row(&[black, white], Role::Data), [[128; 4]]);
        // Half of the light; alpha is no light.
        assert_eq!(halved_row(&[black, white], Role::Color), [[188, 188, 188, 128]]);
        let slanted = [[218, 128, 218, 255], [37, 128, 218, 255]];
        assert_eq!(halved_row(&slanted, Role::Normal), [[128, 128, 255, 255]], "a unit vector");
        assert_eq!(halved_row(&[[0, 128, 128, 9], [255, 127, 127, 9]], Role::Normal)[0][3], 9);
    }

    #[test]
    fn no_texel_is_dropped() {
        let light = |texels: &[[u8; 4]]| halved_row(texels, Role::Data).iter().map(|t| f64::from(t[0])).sum::<f64>();
        let row: Vec<[u8; 4]> = (0..7u8).map(|i| [30 * i; 4]).collect();
        // Seven texels become three of 7 / 3 each.
        assert!((light(&row) * 7.0 / 3.0 - 30.0 * 21.0).abs() < 3.0);
        assert_eq!(halved_row(&[[60; 4], [0; 4], [90; 4]], Role::Data), [[50; 4]]);
        assert_eq!(halved_row(&[[7; 4]], Role::Color), [[7; 4]]);
        let tall = Image { width: 1, height: 4, rgba: vec![[8; 4], [8; 4], [80; 4], [80; 4]] };
        assert_eq!(halve(&tall, Role::Data).rgba, [[8; 4], [80; 4]]);
    }

    #[test]
    fn formats_are_halved_alike() {
        let rgba = image::RgbaImage::from_fn(5, 4, |x, y| image::Rgba([(40 * x) as u8, (60 * y) as u8, 7, 255]));
        let rgba = DynamicImage::ImageRgba8(rgba);
        let expected = halve(&whole(rgba.clone()), Role::Color);
        for other in
            [rgba.clone(), DynamicImage::ImageRgb8(rgba.to_rgb8()), DynamicImage::ImageRgba16(rgba.to_rgba16())]
        {
            assert_eq!(halve_native(&other, Role::Color), expected);
        }
        let gray = image::GrayAlphaImage::from_fn(5, 4, |x, y| image::LumaA([(40 * x) as u8, (60 * y) as u8]));
        let gray = DynamicImage::ImageLumaA8(gray);
        for gray in [DynamicImage::ImageLuma8(gray.to_luma8()), gray] {
            assert_eq!(halve_native(&gray, Role::Data), halve(&whole(gray.clone()), Role::Data));
        }
    }
}
